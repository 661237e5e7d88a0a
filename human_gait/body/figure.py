"""What a person looks like: every segment as capsules, by sex, stature and mass.

The shape is that of ``data/capsules.csv``, made for the median male. A segment that is heavier for
its length is thicker: at one density the area of its section is m / (rho l). Nothing here is
physics, nothing of it reaches the dynamics.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from human_gait import data
from human_gait.arrays import FloatArray
from human_gait.body.anthropometry import Anthropometry, body_measures
from human_gait.body.skeleton import SEGMENTS
from human_gait.scenario import Subject
from human_gait.values import Value

_LENGTHS = {  # of each segment, by its symbol in the DH table
    "pelvis": "y_sp",
    "spine1": "L_s1",
    "spine2": "L_s2",
    "spine3": "L_s3",
    "thorax": "L_s4",
    "neck": "L_nk",
    "head": "L_hd",
    "clavicle": "L_cl",
    "upperarm": "L_ua",
    "forearm": "L_fa",
    "hand": "L_hn",
    "thigh": "L_th",
    "shank": "L_sh",
    "foot": "L_f",
    "toe": "L_toe",
}
TRUNK = ("pelvis", "spine1", "spine2", "spine3", "thorax")
"""Segments that are broader than deep, from below."""

_TO_THE_RIGHT = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True, eq=False)
class Capsule(Value):
    """A cylinder with half a ball at each end, as a piece of a segment.

    Attributes
    ----------
    segment : str
        One of `skeleton.SEGMENTS`.
    link : int
        Index of the segment's degree of freedom.
    ends : (2, 3) array, [m]
        Centres of the balls in anatomical axes (x left, y up, z forward) from the centre of the
        segment's proximal joint.
    radius : float, [m]
    colour : str
        One of `urdf.COLOURS`.
    """

    segment: str
    link: int
    ends: FloatArray
    radius: float
    colour: str


def capsules(measures: Anthropometry) -> tuple[Capsule, ...]:
    """Return the capsules of the body of a subject, by degree of freedom."""
    by_part: dict[str, list[Mapping[str, str]]] = {}
    for row in data.rows("capsules"):
        by_part.setdefault(row["segment"], []).append(row)
    return tuple(
        Capsule(segment, link, *found, row["colour"]).frozen()
        for segment, link in SEGMENTS.items()
        for row in by_part[_part(segment)]
        for found in _placed(row, segment, measures)
    )


def _part(segment: str) -> str:
    return segment.removesuffix("_r").removesuffix("_l")


def _placed(
    row: Mapping[str, str], segment: str, measures: Anthropometry
) -> Iterator[tuple[FloatArray, float]]:
    """Yield ends and radius of a capsule, unless its sex has none; the table has the left side."""
    shape = float(row[measures.subject.sex])
    if shape == 0.0:
        return
    girth = _girth(measures, segment)
    grown = shape * girth ** float(row["grows"])
    ends = np.array([[measures.length(row[axis + end]) for axis in "xyz"] for end in "01"])
    if segment in TRUNK:
        ends[:, 0] *= grown
    # What is added grows out of the body: forward, and away from the middle.
    outward = np.array([float(row["aside"]), 0.0, float(row["ahead"])])
    ends += (girth - 1.0) * measures.subject.stature * outward
    side = _TO_THE_RIGHT if segment.endswith("_r") else np.ones(3)
    yield side * ends, grown * measures.length(row["radius"])


def _girth(measures: Anthropometry, segment: str) -> float:
    """Return how thick a segment is for its stature, against that of the man who is drawn."""
    return float(np.sqrt(_section(measures, segment) / _section(_drawn_man(), segment)))


def _section(measures: Anthropometry, segment: str) -> float:
    """Return the area of a segment's section for one density and stature, [kg/m^3]."""
    length, stature = measures.lengths[_LENGTHS[_part(segment)]], measures.subject.stature
    return measures.segments[segment].mass / (length * stature**2)


@cache
def _drawn_man() -> Anthropometry:
    """Return the man whose capsules the table has: their radii are those of his mass."""
    return body_measures(Subject("male", 1.755, 78.4))
