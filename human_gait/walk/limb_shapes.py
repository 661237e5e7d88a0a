"""The pairs of limbs that can meet in walking, the first of each as beads, the second as capsules.

Shapes are those of the drawn body (`figure.capsules`), in the frames of their links.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.dh import link_to_dh
from human_gait.body.figure import TRUNK, Capsule, capsules
from human_gait.body.links import anatomical_to_link
from human_gait.body.person import Body
from human_gait.body.skeleton import SIDES, SIDES_IN_WORDS
from human_gait.values import Value

_SIDES = dict(zip(SIDES, SIDES_IN_WORDS, strict=True))
_OTHER = dict(zip(SIDES_IN_WORDS, reversed(SIDES_IN_WORDS), strict=True))


def _arm(side: str, part: str) -> tuple[tuple[str, str], ...]:
    others = ("trunk", *(f"{which} thigh" for which in SIDES_IN_WORDS))
    return tuple((f"{side} {part}", other) for other in others)


LIMBS: Mapping[str, tuple[tuple[str, str], ...]] = {
    **{
        f"{side} {part}": _arm(side, part)
        for side in SIDES_IN_WORDS
        for part in ("hand", "forearm")
    },
    "thighs": (("right thigh", "left thigh"),),
    "lower legs": (
        *((f"right {part}", f"left {part}") for part in ("shank", "foot")),
        *(
            (f"{side} {part}", f"{_OTHER[side]} {other}")
            for side in SIDES_IN_WORDS
            for part, other in (("shank", "thigh"), ("foot", "shank"))
        ),
    ),
}
"""Pairs of parts that can meet and are not joined to each other, beads first, by limb."""

PAIRS = tuple(pair for pairs in LIMBS.values() for pair in pairs)

_SPACING = 0.04, 1.25  # between beads, at most: [m], and of their radius


@dataclass(frozen=True, eq=False)
class Rounds(Value):
    """Capsules, or balls where they have no length.

    Attributes
    ----------
    link : (n,) int array
        Degree of freedom of the segment.
    start, along : (n, 3) array, [m]
        One end of the axis, and the way to the other, in the frame of the link (URDF).
    radius : (n,) array, [m]
    """

    link: IntArray
    start: FloatArray
    along: FloatArray
    radius: FloatArray

    @classmethod
    def joined(cls, several: Iterable[Rounds]) -> Rounds:
        """Return those of several, one after the other."""
        fields = zip(*((r.link, r.start, r.along, r.radius) for r in several), strict=True)
        return cls(*(np.concatenate(values) for values in fields))

    def beads(self) -> Rounds:
        """Return balls along the axes, from end to end.

        Across a capsule at a distance s between the axes spacing^2 / 8 s is missed, up to 2 mm.
        """
        spacing = np.minimum(_SPACING[0], _SPACING[1] * self.radius)
        parts = np.ceil(np.linalg.norm(self.along, axis=1) / spacing).astype(int)
        of = np.repeat(np.arange(len(parts)), parts + 1)
        share = np.concatenate([np.linspace(0.0, 1.0, n + 1) for n in parts])[:, None]
        start = self.start[of] + share * self.along[of]
        return Rounds(self.link[of], start, 0.0 * start, self.radius[of])


@dataclass(frozen=True, eq=False)
class Meetings(Value):
    """Every bead with every capsule that it can meet, by limb, then by the links of both.

    Attributes
    ----------
    beads, capsules : Rounds
    limb, pair, bead, capsule : (N,) int array
        Which of ``LIMBS``, of ``PAIRS``, of the beads and of the capsules.
    group : (N,) int array
        Which of the groups.
    groups : (G, 3) int array
        Limb, link of the beads and link of the capsules.
    """

    beads: Rounds
    capsules: Rounds
    limb: IntArray
    pair: IntArray
    bead: IntArray
    capsule: IntArray
    group: IntArray
    groups: IntArray

    @classmethod
    def of(cls, body: Body) -> Meetings:
        """Return all that can meet of a body."""
        rounds = _rounds(body)
        beads = {one: rounds[one].beads() for one, _ in PAIRS}
        capsules = {other: rounds[other] for _, other in PAIRS}
        numbers, places = _numbers(beads), _numbers(capsules)
        limb_of = [limb for limb, pairs in enumerate(LIMBS.values()) for _ in pairs]
        meeting = [
            (limb_of[p], a, b, p, i, j)
            for p, (one, other) in enumerate(PAIRS)
            for a, i in zip(beads[one].link, numbers[one], strict=True)
            for b, j in zip(capsules[other].link, places[other], strict=True)
        ]
        limb, first, second, pair, bead, capsule = np.array(sorted(meeting), dtype=np.intp).T
        by_link = np.stack([limb, first, second], axis=1)
        groups, group = np.unique(by_link, axis=0, return_inverse=True)
        both = Rounds.joined(beads.values()), Rounds.joined(capsules.values())
        return cls(*both, limb, pair, bead, capsule, group.ravel(), groups)


def _numbers(parts: Mapping[str, Rounds]) -> dict[str, IntArray]:
    """Return the numbers that the rounds of each part get where all are joined."""
    ends = np.cumsum([len(rounds.link) for rounds in parts.values()])
    return dict(zip(parts, np.split(np.arange(ends[-1]), ends[:-1]), strict=True))


def _rounds(body: Body) -> dict[str, Rounds]:
    """Return the capsules of each part of a body."""
    to_link = link_to_dh(body.table) @ anatomical_to_link(body.table)
    found: dict[str, list[Capsule]] = {}
    for capsule in capsules(body.measures):
        found.setdefault(_part(capsule.segment), []).append(capsule)
    return {part: _placed(those, to_link) for part, those in found.items()}


def _placed(drawn: Sequence[Capsule], to_link: FloatArray) -> Rounds:
    link = np.array([capsule.link for capsule in drawn])
    ends, radius = (np.array([getattr(c, name) for c in drawn]) for name in ("ends", "radius"))
    turn, origin = to_link[link, :3, :3], to_link[link, :3, 3]
    start, along = (np.einsum("nij,nj->ni", turn, x) for x in (ends[:, 0], ends[:, 1] - ends[:, 0]))
    return Rounds(link, origin + start, along, radius)


def _part(segment: str) -> str:
    """Return the part that a segment belongs to; what is in no pair is a part of its own."""
    if segment in TRUNK:
        return "trunk"
    kind, _, side = segment.partition("_")
    return f"{_SIDES.get(side, '')} {'foot' if kind == 'toe' else kind}"
