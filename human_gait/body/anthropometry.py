"""Segment lengths, masses, centres of mass and inertias from sex, stature and mass.

Lengths are fractions of stature, or those that a subject is given; the trunk is what they leave.
Masses, centres of mass and radii of gyration are those of de Leva (1996), rescaled so that the
masses sum to the subject's. The trunk's three parts are taken as elliptic columns and cut at the
spine joints; what no source gives is marked *assumed* in ``data/anthropometry.csv``.

Everything here is in anatomical axes of the upright body: x to the left, y up, z forward.

References
----------
P. de Leva, "Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters", Journal of
Biomechanics 29 (1996) 1223-1230.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from human_gait import data
from human_gait.arrays import FloatArray
from human_gait.scenario import Subject
from human_gait.scenario.lengths import LENGTHS, TRUNK, trunk, usual_lengths
from human_gait.values import Value

Table = Mapping[tuple[str, str], float]
Values = Mapping[str, float]

_MIDLINE = ("head_and_neck", "trunk_lower", "trunk_middle", "trunk_upper")
_LIMBS = ("upperarm", "forearm", "hand", "thigh", "shank", "whole_foot")
_TRUNK_JOINTS = {
    "pelvis": "y_sp",
    "spine1": "L_s1",
    "spine2": "L_s2",
    "spine3": "L_s3",
    "thorax": "L_s4",
}
_TO_THE_RIGHT = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True, eq=False)
class Segment(Value):
    """A rigid segment in anatomical axes.

    Attributes
    ----------
    mass : float, [kg]
    com : (3,) array, [m]
        Centre of mass, from the centre of the segment's proximal joint.
    inertia : (3, 3) array, [kg m^2]
        About the centre of mass.
    """

    mass: float
    com: FloatArray
    inertia: FloatArray

    def moved(self, by: npt.ArrayLike) -> "Segment":
        """Return the segment displaced by a vector, [m]."""
        return Segment(self.mass, self.com + np.asarray(by), self.inertia)

    def scaled(self, factor: float) -> "Segment":
        """Return a segment of the same shape with ``factor`` times the density."""
        return Segment(self.mass * factor, self.com, self.inertia * factor)

    def mirrored(self) -> "Segment":
        """Return the same segment of the other side of the body."""
        flip = np.outer(_TO_THE_RIGHT, _TO_THE_RIGHT)
        return Segment(self.mass, self.com * _TO_THE_RIGHT, self.inertia * flip)


@dataclass(frozen=True, eq=False)
class Anthropometry(Value):
    """Measures of one subject.

    Attributes
    ----------
    subject : Subject
    lengths : mapping of str to float, [m]
        Keyed by the symbols of the DH table: ``L_th``, ``h_ank``, ...
    segments : mapping of str to Segment
        Keyed by the segment names of the DH table: ``pelvis``, ``thigh_r``, ...
    """

    subject: Subject
    lengths: Values
    segments: Mapping[str, Segment]

    def length(self, symbol: str) -> float:
        """Return the length, [m], of ``L_th``, ``-L_th`` or of a fraction of stature, ``0.05``."""
        name = symbol.removeprefix("-")
        value = self.lengths[name] if name in self.lengths else float(name) * self.subject.stature
        return -value if symbol.startswith("-") else value


def body_measures(subject: Subject) -> Anthropometry:
    """Return the lengths and the rigid segments of a subject."""
    table = _read_table(subject)
    lengths = _lengths(table, subject)
    lengths["h_drop"] = lengths["h_ank"] - lengths["h_mtp"]
    masses = _masses(table, subject.mass)
    left = _arm(table, lengths, masses) | _leg(table, lengths, masses)
    segments = _trunk(table, lengths, masses) | _head(table, lengths, masses)
    for name, segment in left.items():
        segments |= {f"{name}_l": segment, f"{name}_r": segment.mirrored()}
    return Anthropometry(subject, lengths, segments)


def combine(parts: Sequence[Segment]) -> Segment:
    """Return the rigid union of segments given from one origin (parallel axis theorem).

    A part of negative mass is cut out of the others.
    """
    mass = sum(part.mass for part in parts)
    com = np.asarray(sum(part.mass * part.com for part in parts)) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        r = part.com - com
        inertia += part.inertia + part.mass * (r @ r * np.eye(3) - np.outer(r, r))
    return Segment(mass, com, inertia)


def symmetric_inertia(mass: float, mean_square: npt.ArrayLike) -> FloatArray:
    """Return the inertia, [kg m^2], of a body symmetric about three planes.

    Parameters
    ----------
    mass : float, [kg]
    mean_square : (3,) array_like, [m^2]
        Mean of x^2, y^2, z^2 over its mass: s^2 / 12 of a box, s^2 / 5 of an ellipsoid's semi-axes.
    """
    spread = np.asarray(mean_square, dtype=float)
    return mass * np.diag(spread.sum() - spread)


def _read_table(subject: Subject) -> Table:
    """Return the values by (group, name), fractions of stature in metres, per cent as fractions."""
    unit = {"stature": subject.stature, "% of length": 0.01, "% of body mass": 0.01}
    return {
        (row["group"], row["name"]): float(row[subject.sex]) * unit.get(row["unit"], 1.0)
        for row in data.rows("anthropometry")
    }


def _lengths(table: Table, subject: Subject) -> dict[str, float]:
    """Return the lengths by symbol, [m], those of the table grown to the lengths of the subject."""
    lengths = {name: value for (group, name), value in table.items() if group == "length"}
    usual = usual_lengths(subject.sex, subject.stature)
    for name, symbols in LENGTHS.items():
        for symbol in symbols:
            lengths[symbol] *= getattr(subject, name) / usual[name]
    for symbol in TRUNK:
        lengths[symbol] *= trunk(subject.lengths, subject.sex, subject.stature)
    return lengths


def _masses(table: Table, total: float) -> Values:
    """Return the masses of de Leva's parts, [kg], one side of the limbs, rescaled to the total."""
    parts = (*_MIDLINE, *_LIMBS)
    whole = sum(table[part, "mass"] for part in (*parts, *_LIMBS))
    masses = {part: total * table[part, "mass"] / whole for part in parts}
    return masses | {"clavicle": total * table["clavicle", "mass"]}


def _hanging(table: Table, mass: float, name: str, length: float) -> Segment:
    """Return a limb segment that hangs straight down from its proximal joint."""
    axes = ("transverse", "longitudinal", "sagittal")
    gyration = length * np.array([table[name, f"k_{axis}"] for axis in axes])
    com = np.array([0.0, -table[name, "com"] * length, 0.0])
    return Segment(mass, com, mass * np.diag(gyration**2))


def _palm_inward(segment: Segment) -> Segment:
    """Turn a segment from the anatomical position (palm forward) to q = 0 (palm to the thigh)."""
    return Segment(segment.mass, segment.com, segment.inertia[::-1, ::-1])


def _arm(table: Table, lengths: Values, masses: Values) -> dict[str, Segment]:
    forearm = _hanging(table, masses["forearm"], "forearm", lengths["L_fa"])
    hand = _hanging(table, masses["hand"], "hand", lengths["L_hn"])
    return {
        "clavicle": _clavicle(table, lengths, masses["clavicle"]),
        "upperarm": _hanging(table, masses["upperarm"], "upperarm", lengths["L_ua"]),
        "forearm": _palm_inward(forearm),
        "hand": _palm_inward(hand),
    }


def _clavicle(table: Table, lengths: Values, mass: float) -> Segment:
    """Return the left shoulder girdle, about the line from the SC joint to the GH joint."""
    line = np.array([lengths["L_cl"], -lengths["y_gh"], -lengths["z_gh"]])
    axes = ("lateral", "across", "across")
    gyration = np.sqrt(line @ line) * np.array([table["clavicle", f"k_{axis}"] for axis in axes])
    return Segment(mass, table["clavicle", "com"] * line, mass * np.diag(gyration**2))


def _leg(table: Table, lengths: Values, masses: Values) -> dict[str, Segment]:
    foot, toe = _foot(table, lengths, masses["whole_foot"])
    return {
        "thigh": _hanging(table, masses["thigh"], "thigh", lengths["L_th"]),
        "shank": _hanging(table, masses["shank"], "shank", lengths["L_sh"]),
        "foot": foot,
        "toe": toe,
    }


def _foot(table: Table, lengths: Values, mass: float) -> tuple[Segment, Segment]:
    """Return rear foot (from the ankle) and toes (from the MTP axis): together de Leva's foot."""
    toe = _toe(table, lengths, mass)
    length = lengths["L_heel"] + lengths["L_f"] + lengths["L_toe"]
    below = (1.0 - table["whole_foot", "height"]) * lengths["h_ank"]
    ahead = table["whole_foot", "com"] * length - lengths["L_heel"]
    axes = ("transverse", "sagittal", "longitudinal")
    gyration = length * np.array([table["whole_foot", f"k_{axis}"] for axis in axes])
    whole = Segment(mass, np.array([0.0, -below, ahead]), mass * np.diag(gyration**2))
    ankle_to_mtp = (0.0, -lengths["h_drop"], lengths["L_f"])
    return combine([whole, toe.moved(ankle_to_mtp).scaled(-1.0)]), toe


def _toe(table: Table, lengths: Values, foot_mass: float) -> Segment:
    """Return the toes as a box with its centre of mass at the height of the MTP axis."""
    mass = table["toe", "share"] * foot_mass
    box = np.array([table["toe", "breadth"], table["toe", "thickness"], lengths["L_toe"]])
    com = np.array([0.0, 0.0, table["toe", "com"] * lengths["L_toe"]])
    return Segment(mass, com, symmetric_inertia(mass, box**2 / 12))


def _trunk(table: Table, lengths: Values, masses: Values) -> dict[str, Segment]:
    """Cut de Leva's three trunk parts, stacked from mid-hip to C7/T1, at the spine joints."""
    joints = np.cumsum([0.0] + [lengths[symbol] for symbol in _TRUNK_JOINTS.values()])
    parts = _MIDLINE[1:]
    tops = np.cumsum([0.0] + [table[part, "length"] for part in parts])
    borders = tops / tops[-1] * joints[-1]
    segments = {}
    for name, (low, high) in zip(_TRUNK_JOINTS, pairwise(joints), strict=True):
        slabs = [
            _slab(table, masses[part], part, (bottom, top), (max(low, bottom), min(high, top)))
            for part, (bottom, top) in zip(parts, pairwise(borders), strict=True)
            if max(low, bottom) < min(high, top)
        ]
        segments[name] = combine(slabs).moved((0.0, -low, 0.0))
    thorax = segments["thorax"]
    segments["thorax"] = thorax.scaled(1.0 - 2.0 * masses["clavicle"] / thorax.mass)
    return segments


def _slab(
    table: Table, mass: float, part: str, whole: tuple[float, float], cut: tuple[float, float]
) -> Segment:
    """Return the slice ``cut`` (bottom, top), [m], of the upright column over ``whole``."""
    height = whole[1] - whole[0]
    share = (cut[1] - cut[0]) / height
    x2 = (table[part, "k_sagittal"] ** 2 - 1 / 12) * height**2
    z2 = (table[part, "k_transverse"] ** 2 - 1 / 12) * height**2
    inertia = symmetric_inertia(share * mass, (x2, (cut[1] - cut[0]) ** 2 / 12, z2))
    return Segment(share * mass, np.array([0.0, (cut[0] + cut[1]) / 2, 0.0]), inertia)


def _head(table: Table, lengths: Values, masses: Values) -> dict[str, Segment]:
    """Return neck (a cylinder from C7/T1) and head (an ellipsoid, from C0/C1)."""
    neck_mass = table["neck", "share"] * masses["head_and_neck"]
    head_mass = masses["head_and_neck"] - neck_mass
    radius, length = table["neck", "radius"], lengths["L_nk"]
    neck_inertia = symmetric_inertia(neck_mass, (radius**2 / 4, length**2 / 12, radius**2 / 4))
    semi_axes = np.array([table["head", f"semi_{axis}"] for axis in "xyz"])
    com = np.array([0.0, table["head", "com"] * lengths["L_hd"], table["head", "forward"]])
    return {
        "neck": Segment(neck_mass, np.array([0.0, length / 2, 0.0]), neck_inertia),
        "head": Segment(head_mass, com, symmetric_inertia(head_mass, semi_axes**2 / 5)),
    }
