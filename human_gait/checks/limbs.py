"""Parts of the drawn body that pass through each other, from the capsules that draw it.

How deep the round shapes of the figure are in each other is told, beside how deep they are when the
body stands upright with hanging arms: skin and clothes give way, and the shapes are drawn by eye.
It is judged where the scenario holds limbs apart (`posture.limbs`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.dh import frames
from human_gait.body.figure import capsules
from human_gait.body.links import anatomical_to_link
from human_gait.body.person import Body
from human_gait.body.skeleton import N_DOF, SEGMENTS
from human_gait.checks.check import BETWEEN, Check, Claim, Kind
from human_gait.values import Value
from human_gait.walk.gait import Gait, Samples

OVERLAP = Claim("body parts in each other", "m", Kind.NOTE)
DEEPER = Claim("limbs deeper in each other than at rest", "m", Kind.INSTANTS)

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
_LOAD = "load"
_LIMBS = ("forearm", "hand", "thigh", "shank", "foot")
_INSTANTS = 101  # of a step
_TOLD = 4  # pairs, the deepest
_DEEP = 1e-3  # [m], what is told
_ALONG = np.linspace(0.0, 1.0, 9)  # points of an axis


@dataclass(frozen=True, eq=False)
class Shapes(Value):
    """The round shapes that draw a body.

    Attributes
    ----------
    part : list of str
        What each belongs to, such as ``left hand``.
    link : (n,) int array
        That they belong to, whose DH frame the places are in.
    start, along : (n, 3) array, [m]
        One end of the axis, and the way to the other.
    radius : (n,) array, [m]
    """

    part: list[str]
    link: IntArray
    start: FloatArray
    along: FloatArray
    radius: FloatArray


@dataclass(frozen=True)
class Overlap:
    """Two parts in each other: how deep at most and how deep at rest [m], and when [s]."""

    parts: tuple[str, str]
    depth: float
    rest: float
    time: float

    @property
    def deeper(self) -> float:
        """How much deeper than at rest, [m]."""
        return self.depth - self.rest

    def __str__(self) -> str:
        one, other = self.parts
        rest = f" (at rest {1e3 * self.rest:.0f})" if self.rest > 0.0 else ""
        return f"{one} in {other} {1e3 * self.depth:.0f} mm{rest} at {self.time:.2f} s"


def limbs_checks(gait: Gait, now: Samples) -> list[Check]:
    """Parts of the drawn body are not in each other: told how deep they are, and which.

    Limbs that are held apart are hardly deeper in each other than at rest.
    """
    found = overlaps(gait.body, now)
    depth, time = (found[0].depth, found[0].time) if found else (0.0, 0.0)
    checks = [OVERLAP.noted(depth, time, _told(found))]
    if gait.scenario.posture.limbs == "apart":
        limit = BETWEEN * gait.scenario.tolerances.limbs_apart
        limbs = [one for one in found if _LOAD not in one.parts and one.deeper > 0.0]
        limbs.sort(key=lambda one: -one.deeper)
        deeper, time = (limbs[0].deeper, limbs[0].time) if limbs else (0.0, 0.0)
        what = _told([one for one in limbs if one.deeper > limit])
        checks.append(DEEPER.found(deeper, limit, time, what))
    return checks


def _told(found: list[Overlap]) -> str:
    told = [str(one) for one in found[:_TOLD]]
    told += [f"and {len(found) - _TOLD} pairs more"] if len(found) > _TOLD else []
    return ", ".join(told)


def overlaps(body: Body, now: Samples) -> list[Overlap]:
    """Return the pairs of parts that are in each other during the step, the deepest first.

    A load counts as a part, that is joined to the trunk.
    """
    some = np.unique(np.linspace(0, len(now.t) - 1, _INSTANTS).astype(int))
    upright = np.zeros((1, N_DOF))
    found = []
    for parts, (rest, *depths) in _depths(body, np.concatenate([upright, now.q[some]])).items():
        k = int(np.argmax(depths))
        if depths[k] > _DEEP:
            at_rest = max(float(rest), 0.0)
            found.append(Overlap(parts, float(depths[k]), at_rest, float(now.t[some[k]])))
    return sorted(found, key=lambda one: -one.depth)


def _depths(body: Body, q: FloatArray) -> dict[tuple[str, str], FloatArray]:
    """Return how deep two parts are in each other in the postures q (K, 55), (K,); < 0: apart."""
    shapes = shapes_of(body)
    _, A = frames(body.table, q)
    start, along = _placed(A, shapes)
    p, u = (np.ascontiguousarray(x.T) for x in (start, along))
    deep = {
        parts: shapes.radius[one]
        + shapes.radius[other]
        - _apart(p[:, one], u[:, one], p[:, other], u[:, other]).T
        for parts, one, other in _pairs(shapes)
    }
    if body.load.mass > 0.0:
        points = start[:, :, None] + _ALONG[:, None] * along[:, :, None]
        in_load = shapes.radius - _outside_load(body, A, points).min(axis=2)
        deep |= {(part, _LOAD): in_load[:, of] for part, of in _members(shapes) if part != "trunk"}
    return {parts: depths.max(axis=1) for parts, depths in deep.items()}


def shapes_of(body: Body) -> Shapes:
    """Return the round shapes of a body, as it is drawn."""
    drawn = capsules(body.measures)
    link = np.array([capsule.link for capsule in drawn])
    ends = np.array([capsule.ends for capsule in drawn])
    place = anatomical_to_link(body.table)[link]
    turn, origin = place[:, :3, :3], place[:, :3, 3]
    return Shapes(
        part=[_part(capsule.segment) for capsule in drawn],
        link=link,
        start=origin + np.einsum("nij,nj->ni", turn, ends[:, 0]),
        along=np.einsum("nij,nj->ni", turn, ends[:, 1] - ends[:, 0]),
        radius=np.array([capsule.radius for capsule in drawn]),
    )


def _part(segment: str) -> str:
    """Return what a segment belongs to."""
    kind, _, side = segment.partition("_")
    kind = _KINDS.get(kind, kind if kind in _LIMBS else "trunk")
    return f"{'right' if side == 'r' else 'left'} {kind}" if side and kind != "trunk" else kind


def _pairs(shapes: Shapes) -> Iterator[tuple[tuple[str, str], IntArray, IntArray]]:
    """Yield two parts that are not joined, and the shapes of one with those of the other."""
    for (one, first), (other, second) in combinations(_members(shapes), 2):
        if (one, other) not in _NEIGHBOURS and (other, one) not in _NEIGHBOURS:
            pairs = np.meshgrid(first, second)
            yield (one, other), pairs[0].ravel(), pairs[1].ravel()


def _members(shapes: Shapes) -> list[tuple[str, IntArray]]:
    """Return every part with its shapes, small parts first."""
    parts = sorted(set(shapes.part), key=lambda part: (_ORDER.index(part.split()[-1]), part))
    return [(part, np.flatnonzero(np.array(shapes.part) == part)) for part in parts]


def _placed(A: FloatArray, shapes: Shapes) -> tuple[FloatArray, FloatArray]:
    """Return start and way along the axis (K, n, 3) of the shapes in the world."""
    place = A[:, shapes.link]
    turn, origin = place[..., :3, :3], place[..., :3, 3]
    start, along = (np.einsum("knij,nj->kni", turn, x) for x in (shapes.start, shapes.along))
    return origin + start, along


def _outside_load(body: Body, A: FloatArray, points: FloatArray) -> FloatArray:
    """Return how far points (K, ..., 3) of the world are outside of the load's box, [m]."""
    thorax = SEGMENTS["thorax"]
    place = anatomical_to_link(body.table)[thorax].copy()
    place[:3, 3] = body.load_com
    pose = A[:, thorax] @ place
    offset = points - pose[:, None, None, :3, 3]
    beyond = np.abs(np.einsum("kji,knuj->knui", pose[:, :3, :3], offset))
    beyond -= np.array(body.load.size) / 2.0
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
    return np.asarray(outside + np.minimum(beyond.max(axis=-1), 0.0))


def _apart(p: FloatArray, u: FloatArray, q: FloatArray, v: FloatArray) -> FloatArray:
    """Return the distance (...) of segments p + s u and q + t v (3, ...), 0 <= s, t <= 1.

    The nearest point of the second line to the first one, then of each segment to the other's.
    """
    r = p - q
    a, e, b = _dot(u, u), _dot(v, v), _dot(u, v)
    c, f = _dot(u, r), _dot(v, r)
    parallel = np.maximum(a * e - b * b, 1e-12)
    s = np.clip((b * f - c * e) / parallel, 0.0, 1.0)
    t = np.clip((b * s + f) / e, 0.0, 1.0)
    s = np.clip((b * t - c) / a, 0.0, 1.0)
    apart = r + s * u - t * v
    return np.asarray(np.sqrt(_dot(apart, apart)))


def _dot(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.asarray(x[0] * y[0] + x[1] * y[1] + x[2] * y[2])
