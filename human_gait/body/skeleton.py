"""The 55 degrees of freedom: order, names, tree and mirror map; no measures of a subject.

The paper's numbers 1-55 are the indices 0-54 here: six global DOF, right leg, left leg, spine,
right arm, left arm, head. The paper prints no names and no DH table: they are those of
``data/dh_table.csv``.
"""

from collections.abc import Mapping
from itertools import groupby
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from human_gait import data
from human_gait.arrays import FloatArray, IntArray

GRAVITY = 9.81
"""Acceleration of gravity, [m/s^2]."""

SIDES = ("r", "l")
"""How names of one side of the body end, right first: by number of the foot."""

SIDES_IN_WORDS = ("right", "left")
"""The same for people to read."""

_PELVIS = {  # axes of the world: x left, y up, z forward
    "tx": "sideways",
    "ty": "height",
    "tz": "forward",
    "rx": "tilt",
    "ry": "rotation",
    "rz": "obliquity",
}
_JOINTS = [row for row in data.rows("dh_table") if row["kind"] == "joint"]

DOF_NAMES: tuple[str, ...] = tuple(row["name"] for row in _JOINTS)
"""Names of the degrees of freedom, in the paper's order."""

N_DOF = len(DOF_NAMES)

PARENT: IntArray = np.array([int(row["parent_link"]) - 1 for row in _JOINTS])
"""(55,) index of the link that each joint hangs on; -1 is the world."""

PRISMATIC: npt.NDArray[np.bool_] = np.array([row["type"] == "P" for row in _JOINTS])
"""(55,) true for the global translations."""

DOF_UNITS: tuple[str, ...] = tuple("m" if sliding else "rad" for sliding in PRISMATIC)
"""Units of the degrees of freedom."""

BRANCHES: Mapping[str, tuple[int, ...]] = MappingProxyType(
    {
        branch: tuple(int(row["joint"]) - 1 for row in members)
        for branch, members in groupby(_JOINTS, key=lambda row: row["branch"])
    }
)
"""Indices by branch: ``virtual``, ``right_leg``, ``left_leg``, ``spine``, ``right_arm`` ..."""

SEGMENTS: Mapping[str, int] = MappingProxyType(
    {row["segment"]: i for i, row in enumerate(_JOINTS) if row["segment"]}
)
"""Index of the link that carries each segment; the other links have no mass."""


def index(name: str) -> int:
    """Return the index (from 0) of a degree of freedom.

    Raises
    ------
    ValueError
        If there is no DOF of that name.
    """
    if name not in DOF_NAMES:
        raise ValueError(f"no degree of freedom is called {name!r}")
    return DOF_NAMES.index(name)


def in_words(name: str) -> str:
    """Return a degree of freedom as one would say it, such as ``right hip flexion``."""
    if name.startswith("pelvis_"):
        return f"pelvis {_PELVIS[name.removeprefix('pelvis_')]}"
    stem, _, side = name.rpartition("_")
    sides = dict(zip(SIDES, SIDES_IN_WORDS, strict=True))
    words = (f"{sides[side]} {stem}" if side in sides else name).replace("_", " ")
    return words.replace("spine", "spine ").replace(" lateral", " lateral bending")


def _other_side(name: str) -> str:
    swap = {"_r": "_l", "_l": "_r"}
    return name[:-2] + swap[name[-2:]] if name[-2:] in swap else name


def _mirror_sign(row: Mapping[str, str]) -> float:
    """Return the sign of a DOF mirrored at the plane x = 0; limb pairs are defined alike."""
    if row["name"] != _other_side(row["name"]):
        return 1.0
    along_x = row["axis_at_neutral"].endswith("x")
    keeps = along_x != (row["type"] == "P")
    return 1.0 if keeps else -1.0


MIRROR_INDEX: IntArray = np.array([index(_other_side(name)) for name in DOF_NAMES])
"""(55,) the DOF of the other side, itself on the midline (Eq. 26)."""

MIRROR_SIGN: FloatArray = np.array([_mirror_sign(row) for row in _JOINTS])
"""(55,) sign of a DOF in the mirrored posture (Eq. 26)."""

ANKLES: IntArray = np.array([index(f"ankle_dorsiflexion_{side}") for side in SIDES])
"""Flexion of the ankles, which have long tendons: right, left."""


def mirror(q: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the posture, velocity, acceleration or torque seen in a mirror, Eq. (26).

    Parameters
    ----------
    q : (..., 55) array, [rad] and [m]

    Notes
    -----
    Rotations about y and z and the translation along x change sign. The advance along z is kept:
    from one step to the next the caller adds the step length.
    """
    return q[..., MIRROR_INDEX] * MIRROR_SIGN
