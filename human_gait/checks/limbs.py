"""Parts of the drawn body that pass through each other, from the capsules that draw it.

Nothing keeps limbs apart but their joint limits: heels and toe tips alone are held beside the
standing leg. How deep the round shapes of the URDF are in each other is told, not judged: skin and
clothes give way, and the shapes are drawn by eye.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pinocchio as pin

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.person import Body
from human_gait.body.skeleton import SEGMENTS
from human_gait.checks.check import Check, Claim, Kind
from human_gait.values import Value
from human_gait.walk.gait import Samples

OVERLAP = Claim("body parts in each other", "m", Kind.NOTE)

_NEIGHBOURS = {  # joined to each other: they are always in each other
    *(("trunk", part) for part in ("head", "right upper arm", "left upper arm")),
    *(("trunk", f"{side} thigh") for side in ("right", "left")),
    *(
        (f"{side} {one}", f"{side} {other}")
        for side in ("right", "left")
        for one, other in (
            *(("upper arm", "forearm"), ("forearm", "hand")),
            *(("thigh", "shank"), ("shank", "foot")),
        )
    ),
}
_KINDS = {"upperarm": "upper arm", "toe": "foot", "neck": "head", "head": "head"}
_ORDER = ("hand", "forearm", "arm", "foot", "shank", "thigh", "head", "trunk")
"""What is said to be in what: the first in the second."""
_LIMBS = ("forearm", "hand", "thigh", "shank", "foot")
_INSTANTS = 101  # of a step
_TOLD = 4  # pairs, the deepest
_DEEP = 1e-3  # [m], what is told


@dataclass(frozen=True, eq=False)
class Capsules(Value):
    """The round shapes that draw a body.

    Attributes
    ----------
    part : list of str
        What each belongs to, such as ``left hand``.
    joint : (n,) int array
        Of the Pinocchio model, whose frame the places are in.
    start, along : (n, 3) array, [m]
        One end of the axis, and the way to the other.
    radius : (n,) array, [m]
    """

    part: list[str]
    joint: IntArray
    start: FloatArray
    along: FloatArray
    radius: FloatArray


@dataclass(frozen=True)
class Overlap:
    """Two parts in each other: how deep at most [m], and when [s]."""

    parts: tuple[str, str]
    depth: float
    time: float

    def __str__(self) -> str:
        one, other = self.parts
        return f"{one} in {other} {1e3 * self.depth:.0f} mm at {self.time:.2f} s"


def limbs_check(body: Body, now: Samples) -> Check:
    """Parts of the drawn body are not in each other: told how deep they are, and which."""
    found = overlaps(body, now)
    if not found:
        return OVERLAP.noted(0.0, 0.0, "")
    told = [str(one) for one in found[:_TOLD]]
    told += [f"and {len(found) - _TOLD} pairs more"] if len(found) > _TOLD else []
    return OVERLAP.noted(found[0].depth, found[0].time, ", ".join(told))


def overlaps(body: Body, now: Samples) -> list[Overlap]:
    """Return the pairs of parts that are in each other during the step, the deepest first."""
    shapes = capsules(body)
    some = np.unique(np.linspace(0, len(now.t) - 1, _INSTANTS).astype(int))
    start, along = _placed(body, shapes, now.q[some])
    found = []
    for parts, first, second in _pairs(shapes):
        gap = _apart(start[:, first], along[:, first], start[:, second], along[:, second])
        deep = (shapes.radius[first] + shapes.radius[second] - gap).max(axis=1)
        k = int(np.argmax(deep))
        if deep[k] > _DEEP:
            found.append(Overlap(parts, float(deep[k]), float(now.t[some[k]])))
    return sorted(found, key=lambda one: -one.depth)


def capsules(body: Body) -> Capsules:
    """Return the round shapes of the URDF of a body, as it is drawn."""
    shapes = pin.buildGeomFromUrdfString(body.model, body.urdf, pin.GeometryType.VISUAL)
    round_ones = [
        shape for shape in shapes.geometryObjects if isinstance(shape.geometry, pin.coal.Cylinder)
    ]
    half = [s.placement.rotation[:, 2] * s.geometry.halfLength for s in round_ones]
    along = 2.0 * np.array(half)
    return Capsules(
        part=[_part(int(shape.parentJoint) - 1) for shape in round_ones],
        joint=np.array([int(shape.parentJoint) for shape in round_ones]),
        start=np.array([shape.placement.translation for shape in round_ones]) - along / 2.0,
        along=along,
        radius=np.array([shape.geometry.radius for shape in round_ones]),
    )


def _part(link: int) -> str:
    """Return what the segment of a link belongs to."""
    segment = next(name for name, i in SEGMENTS.items() if i == link)
    kind, _, side = segment.partition("_")
    kind = _KINDS.get(kind, kind if kind in _LIMBS else "trunk")
    return f"{'right' if side == 'r' else 'left'} {kind}" if side and kind != "trunk" else kind


def _pairs(shapes: Capsules) -> Iterator[tuple[tuple[str, str], IntArray, IntArray]]:
    """Yield two parts that are not joined, and the shapes of one with those of the other."""
    parts = sorted(set(shapes.part), key=lambda part: (_ORDER.index(part.split()[-1]), part))
    members = {part: np.flatnonzero(np.array(shapes.part) == part) for part in parts}
    for one, other in combinations(members, 2):
        if (one, other) not in _NEIGHBOURS and (other, one) not in _NEIGHBOURS:
            first, second = np.meshgrid(members[one], members[other])
            yield (one, other), first.ravel(), second.ravel()


def _placed(body: Body, shapes: Capsules, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return start and way along the axis (K, n, 3) of the shapes in the world."""
    data, poses = body.model.createData(), []
    for posture in q:
        pin.forwardKinematics(body.model, data, posture)
        poses.append([pose.homogeneous for pose in data.oMi])
    place = np.array(poses)[:, shapes.joint]
    turn, origin = place[..., :3, :3], place[..., :3, 3]
    start, along = (np.einsum("knij,nj->kni", turn, x) for x in (shapes.start, shapes.along))
    return origin + start, along


def _apart(p: FloatArray, u: FloatArray, q: FloatArray, v: FloatArray) -> FloatArray:
    """Return the distance (K, n) of segments p + s u and q + t v, 0 <= s, t <= 1.

    The nearest point of the second line to the first one, then of each segment to the other's.
    """
    r = p - q
    a, e, b = _dot(u, u), _dot(v, v), _dot(u, v)
    c, f = _dot(u, r), _dot(v, r)
    parallel = np.maximum(a * e - b * b, 1e-12)
    s = np.clip((b * f - c * e) / parallel, 0.0, 1.0)
    t = np.clip((b * s + f) / e, 0.0, 1.0)
    s = np.clip((b * t - c) / a, 0.0, 1.0)
    return np.asarray(np.linalg.norm(r + s[..., None] * u - t[..., None] * v, axis=-1))


def _dot(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("kni,kni->kn", x, y))
