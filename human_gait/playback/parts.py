"""The body as one sees it: rounded parts with skin, hair and clothes, and what is carried.

Nothing here is physics: the capsules of `body.figure`, joined to smooth hulls.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import groupby, pairwise

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.dh import frames, inverse, link_to_dh
from human_gait.body.figure import TRUNK, Capsule, capsules
from human_gait.body.links import anatomical_to_link
from human_gait.body.person import Body
from human_gait.body.skeleton import N_DOF, SEGMENTS
from human_gait.body.urdf import COLOURS
from human_gait.playback.carried import carried
from human_gait.playback.shapes import Mesh, rounded

LOAD = "backpack"
"""Name that the parts of the load begin with, whatever it is."""

_POINTS = {"head": 500, **dict.fromkeys(TRUNK, 260)}  # of each ball, by segment
_POINTS_OF_LIMBS = 150
# Places on the head, of the stature, in the axes of the body: x left, y up, z forward.
_FACE = {  # centre on the left side, radius, colour
    "eye": ((0.0150, 0.0300, 0.0470), 0.0030, 0x33261F),
    "ear": ((0.0450, 0.0230, 0.0040), 0.0080, 0xDEAD8C),
}
_BODIES = 4  # whose parts are kept: one page, film and report after another


@dataclass(frozen=True, eq=False)
class Part:
    """A surface of one colour on one link.

    Attributes
    ----------
    link : int
        Index of the degree of freedom that it moves with.
    name : str
    mesh : Mesh
        In the frame of the link.
    colour : int
        Red, green, blue, as 0xRRGGBB.
    """

    link: int
    name: str
    mesh: Mesh
    colour: int


def link_poses(body: Body, q: FloatArray) -> FloatArray:
    """Return where the frames of the links are in postures (K, 55): (K, 55, 4, 4), in the world."""
    _, A = frames(body.table, q)
    return np.asarray(A @ inverse(link_to_dh(body.table)))


@lru_cache(maxsize=_BODIES)
def drawn_parts(body: Body) -> tuple[Part, ...]:
    """Return all that is seen of a person and the load."""
    place = link_to_dh(body.table) @ anatomical_to_link(body.table)
    joints = frames(body.table, np.zeros(N_DOF))[0][:, :3, 3]
    parts = [*_limbs(capsules(body.measures), joints), *_face(body)]
    if body.load.mass > 0:
        thorax = SEGMENTS["thorax"]
        parts += [
            Part(thorax, f"{LOAD}/{name}", mesh, colour)
            for name, mesh, colour in carried(body, joints - joints[thorax])
        ]
    return tuple(
        replace(part, mesh=part.mesh.moved(place[part.link, :3, :3], place[part.link, :3, 3]))
        for part in parts
    )


def _limbs(drawn: Sequence[Capsule], joints: FloatArray) -> Iterator[Part]:
    """Yield the capsules of one colour of one link as one surface, in anatomical axes."""
    pieces = sorted([*drawn, *_waist(drawn, joints)], key=lambda piece: piece.link)
    for k, ((link, colour), group) in enumerate(groupby(pieces, lambda p: (p.link, p.colour))):
        of_part = list(group)
        centres = np.concatenate([piece.ends for piece in of_part])
        radii = np.repeat([piece.radius for piece in of_part], 2)
        points = _POINTS.get(of_part[0].segment, _POINTS_OF_LIMBS)
        yield Part(link, f"part{k:02d}", rounded(centres, radii, points), as_number(colour))


def _waist(drawn: Sequence[Capsule], joints: FloatArray) -> Iterator[Capsule]:
    """Yield the lowest capsule of each part of the shirt again, on the part below it.

    A part of the trunk then reaches up to the next one, and no seam shows between them.
    """
    for lower, upper in pairwise(TRUNK[1:]):
        first = next(piece for piece in drawn if piece.segment == upper)
        onto = SEGMENTS[lower]
        across = joints[first.link] - joints[onto]
        yield replace(first, segment=lower, link=onto, ends=first.ends + across)


def _face(body: Body) -> Iterator[Part]:
    """Yield both eyes and ears, in anatomical axes."""
    stature = body.subject.stature
    for name, (centre, radius, colour) in _FACE.items():
        for side, sign in (("left", 1.0), ("right", -1.0)):
            point = stature * np.array(centre) * [sign, 1.0, 1.0]
            ball = rounded(point[None], radius * stature, 60)
            yield Part(SEGMENTS["head"], f"{name}_{side}", ball, colour)


def as_number(colour: str) -> int:
    """Return a colour of `urdf.COLOURS` as 0xRRGGBB."""
    shares = map(float, COLOURS[colour].split()[:3])
    return int.from_bytes(bytes(round(255 * share) for share in shares))
