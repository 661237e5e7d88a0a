"""What is carried, drawn as what it is by where it is and how large: pack, box, vest.

All in the anatomical axes of the thorax (x left, y up, z forward, from the T8/T9 joint), in which a
scenario says where a load is.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, product

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.figure import Capsule, capsules
from human_gait.body.person import Body
from human_gait.body.skeleton import SEGMENTS
from human_gait.playback.shapes import Mesh, band, rounded, section

_CLOTH, _STRAP, _BOX, _VEST = 0x6B7845, 0x39402A, 0xB98F5E, 0x4F5A38
_ROUNDING = {_CLOTH: 0.28, _BOX: 0.07}  # radius of the edges, of the shortest of them
_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))  # of a cube
_STRAP_CORNERS = 72
_STRAP_APART, _STRAP_HALF_WIDTH, _STRAP_HALF_THICKNESS = 0.046, 0.010, 0.0035  # of the stature
_STRAP_SLANT = 0.35  # outwards per way down
_CHIN = 0.105  # of the stature, from the T8/T9 joint: above it a load in front hides the face
_BAR = 0.07  # of the shortest half edge: thickness of a frame
_CUSHION = 0.03  # of the stature
_UNDER_STRAPS = ("thorax", "clavicle_r", "clavicle_l")
_VEST_THICKNESS = 0.012  # of the stature
_WITHIN_REACH = 0.10  # gap between chest and pack that straps bridge, of the stature

KINDS = {
    "backpack": "Backpack",
    "front pack": "Front pack",
    "vest": "Vest",
    "box on the head": "Box on the head",
    "box": "Box",
}
"""What a load can be, and how it is called in a legend."""


def kind_of_load(body: Body) -> str:
    """Return what the load is, one of `KINDS`: a pack where straps can hold it, else a box."""
    load, measures = body.load, body.measures
    (x, y, z), half = load.position, np.array(load.size) / 2
    neck, crown = (_height(body, name) for name in ("neck", "crown"))
    if y - half[1] > neck:
        over = abs(z) < half[2] and abs(x) < half[0] and y > crown
        return "box on the head" if over else "box"
    chest = [c for c in capsules(measures) if c.segment == "thorax"]
    front = max(float(c.ends[:, 2].max()) + c.radius for c in chest)
    back = min(float(c.ends[:, 2].min()) - c.radius for c in chest)
    if back < z < front:
        fits = half[0] < 0.3 * body.subject.stature and y - half[1] > -0.45 * body.subject.stature
        return "vest" if fits else "box"
    gap = (z - half[2]) - front if z > 0 else back - (z + half[2])
    held = y + half[1] > 0 and y + half[1] < neck + 0.12 * body.subject.stature
    if gap > _WITHIN_REACH * body.subject.stature or not held:
        return "box"
    return "front pack" if z > 0 else "backpack"


def _height(body: Body, what: str) -> float:
    """Return the height of C7/T1 or of the crown over the T8/T9 joint, upright, [m]."""
    lengths = body.measures.lengths
    above = ("L_s4",) if what == "neck" else ("L_s4", "L_nk", "L_hd")
    return float(sum(lengths[name] for name in above))


def carried(body: Body, joints: FloatArray) -> Iterator[tuple[str, Mesh, int]]:
    """Yield the parts of a load: name, surface and colour.

    Parameters
    ----------
    body : Body
    joints : (55, 3) array, [m]
        Centres of the proximal joints of all links in the upright body, seen from the thorax.
    """
    kind = kind_of_load(body)
    if kind == "vest":
        yield "pack", _vest(body), _VEST
        return
    packed = kind in ("backpack", "front pack")
    colour = _CLOTH if packed else _BOX
    centre, half = np.array(body.load.position), np.array(body.load.size) / 2
    if _hides_face(body):
        yield from _crate(centre, half, colour, _CHIN * body.subject.stature)
    else:
        yield "pack", _rounded_box(centre, half, colour), colour
    if packed:
        straps = [_strap(body, joints, sign) for sign in (1.0, -1.0)]
        for side, strap in zip(("left", "right"), straps, strict=True):
            yield f"strap_{side}", strap, _STRAP
        yield from _padding(centre, half, straps)
    if kind == "box on the head":
        yield from _cushion(body, centre[1] - half[1])


def _rounded_box(centre: FloatArray, half: FloatArray, colour: int) -> Mesh:
    radius = _ROUNDING[colour] * half.min()
    return rounded(centre + _CORNERS * (half - radius), radius)


def _hides_face(body: Body) -> bool:
    """Return whether a load stands before the face."""
    (_, y, z), half = body.load.position, body.load.size[1] / 2
    return z > 0 and y + half > _CHIN * body.subject.stature and y - half < _height(body, "crown")


def _crate(
    centre: FloatArray, half: FloatArray, colour: int, chin: float
) -> Iterator[tuple[str, Mesh, int]]:
    """Yield a box of which only the edges are there above the chin: the face is seen."""
    radius = _BAR * half.min()
    corners = centre + _CORNERS * (half - radius)
    for k, (one, other) in enumerate(combinations(corners, 2)):
        if np.count_nonzero(one != other) == 1:  # neighbours
            yield f"edge{k:02d}", rounded(np.stack([one, other]), radius, 60), colour
    filled = chin - (centre[1] - half[1])
    if filled > 2 * radius:
        lower = np.array([0.0, filled / 2 - half[1], 0.0])
        size = np.array([half[0], filled / 2, half[2]])
        yield "pack", _rounded_box(centre + lower, size, colour), colour


def _cushion(body: Body, bottom: float) -> Iterator[tuple[str, Mesh, int]]:
    """Yield what a box on the head rests on."""
    stature, crown = body.subject.stature, _height(body, "crown")
    if bottom > crown:
        turn = np.linspace(0.0, 2 * np.pi, 16, endpoint=False)
        ring = _CUSHION * stature * np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=1)
        heights = np.repeat([crown - 0.01 * stature, bottom], len(ring))
        ends = np.tile(ring, (2, 1)) + np.outer(heights, [0.0, 1.0, 0.0])
        yield "cushion", rounded(ends, 0.008 * stature, 40), _STRAP


def _padding(
    centre: FloatArray, half: FloatArray, straps: list[Mesh]
) -> Iterator[tuple[str, Mesh, int]]:
    """Yield what fills a gap between a pack and the straps."""
    towards = 1.0 if centre[2] < 0 else -1.0  # the body
    face = towards * (centre[2] + towards * half[2])
    worn = min(float((towards * strap.vertices[:, 2]).min()) for strap in straps)
    if worn > face:
        radius = _ROUNDING[_CLOTH] * half.min()
        corners = centre + _CORNERS * (0.55 * half)
        corners[:, 2] = towards * np.where(_CORNERS[:, 2] > 0, worn + radius, face - radius)
        yield "padding", rounded(corners, radius / 2), _STRAP


def _strap(body: Body, joints: FloatArray, sign: float) -> Mesh:
    """Return a band over a shoulder and under the arm where a slanting plane cuts the chest."""
    stature = body.subject.stature
    hull = _hull([c for c in capsules(body.measures) if c.segment in _UNDER_STRAPS], joints)
    axis = np.array([sign, _STRAP_SLANT, 0.0]) / np.hypot(1.0, _STRAP_SLANT)
    top = np.array([sign * _STRAP_APART * stature, hull.vertices[:, 1].max(), 0.0])
    loop = section(hull, axis, float(axis @ top), _STRAP_CORNERS)
    return band(loop, axis, _STRAP_HALF_WIDTH * stature, _STRAP_HALF_THICKNESS * stature)


def _vest(body: Body) -> Mesh:
    """Return the chest, thicker by what is worn on it."""
    thorax = SEGMENTS["thorax"]
    chest = [c for c in capsules(body.measures) if c.link == thorax]
    return _hull(chest, np.zeros((thorax + 1, 3)), _VEST_THICKNESS * body.subject.stature)


def _hull(pieces: list[Capsule], joints: FloatArray, thicker: float = 0.0) -> Mesh:
    centres = np.concatenate([piece.ends + joints[piece.link] for piece in pieces])
    return rounded(centres, thicker + np.repeat([piece.radius for piece in pieces], 2), 300)
