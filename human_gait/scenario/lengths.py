"""The lengths of a body that can be given, and what they are by sex and stature.

From the sole to the vertex a person is as long as the stature says: the trunk takes what the other
lengths leave.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from human_gait import data

LENGTHS: Mapping[str, tuple[str, ...]] = {
    "thigh": ("L_th",),
    "shank": ("L_sh",),
    "ankle_height": ("h_ank",),
    "foot": ("L_heel", "L_f", "L_toe"),
    "hip_width": ("w_hip",),
    "shoulder_width": ("x_sc", "L_cl"),
    "upper_arm": ("L_ua",),
    "forearm": ("L_fa",),
    "hand": ("L_hn",),
    "head_and_neck": ("L_nk", "L_hd"),
}
"""Settings by name, and the lengths of the DH table that grow with each."""

TRUNK = ("y_sp", "L_s1", "L_s2", "L_s3", "L_s4")
"""From the hip centres to C7/T1."""

UPRIGHT = ("thigh", "shank", "ankle_height", "head_and_neck")
"""Stand on each other: the trunk is the stature less these."""

_BOTH_SIDES = ("hip_width", "shoulder_width")


def fraction(name: str, sex: str) -> float:
    """Return a length as a fraction of stature, as it is by default."""
    return _fractions(sex)[name]


def usual_lengths(sex: str, stature: float) -> dict[str, float]:
    """Return all the lengths, [m], as they are by default."""
    return {name: share * stature for name, share in _fractions(sex).items()}


def trunk(lengths: Mapping[str, float], sex: str, stature: float) -> float:
    """Return what is left for the trunk, from the hip centres to C7/T1, as a part of the usual."""
    usual = usual_lengths(sex, stature)
    whole = stature * sum(_symbols(sex)[symbol] for symbol in TRUNK)
    return (whole - sum(lengths[name] - usual[name] for name in UPRIGHT)) / whole


@cache
def _fractions(sex: str) -> dict[str, float]:
    symbols = _symbols(sex)
    sides = {name: 2.0 if name in _BOTH_SIDES else 1.0 for name in LENGTHS}
    return {
        name: sides[name] * sum(symbols[symbol] for symbol in parts)
        for name, parts in LENGTHS.items()
    }


@cache
def _symbols(sex: str) -> dict[str, float]:
    rows = data.rows("anthropometry")
    return {row["name"]: float(row[sex]) for row in rows if row["group"] == "length"}
