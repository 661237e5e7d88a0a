"""The right leg's gait cycle, from its heel strike to the next, in the signs of gait laboratories.

``COLUMNS`` are what every file has and people are compared in; ``FURTHER`` are moments of the other
planes and of the lower back, joint powers, and the left leg at the same times, which does half a
cycle later what the right leg does.

Angles are those of the degrees of freedom; the three of the pelvis (obliquity, tilt, rotation, in
this order) agree with other sequences to second order in small angles. Moments are internal net
moments about the same axes, inverse dynamics' own: they extend the hip, abduct it, extend the knee
and plantarflex the ankle when positive. Powers are moments times velocities, of one axis or of
all axes of a joint; they are positive where it gives energy. Moments and powers are per mass and
the ground reaction is per weight of the body alone, without a load.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body import skeleton
from human_gait.body.dh import DHTable, frames
from human_gait.exceptions import ResultError
from human_gait.results.reading import read_text
from human_gait.walk.joint_work import joint_power
from human_gait.walk.strain import L5S1

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait

Signed = Mapping[str, tuple[str, float]]

PERCENT: FloatArray = np.arange(101.0)
"""(101,) percentages of the gait cycle."""

_TOO_LARGE = 1e6  # for any curve, in whatever unit

# Column: degree of freedom and its sign.
_PELVIS_AND_LEG: Signed = {
    "pelvis_tilt_anterior_deg": ("pelvis_rx", 1.0),
    "pelvis_obliquity_up_deg": ("pelvis_rz", -1.0),
    "pelvis_rotation_internal_deg": ("pelvis_ry", 1.0),
    "hip_flexion_deg": ("hip_flexion_r", 1.0),
    "hip_adduction_deg": ("hip_abduction_r", -1.0),
    "hip_rotation_internal_deg": ("hip_rotation_r", 1.0),
    "knee_flexion_deg": ("knee_flexion_r", 1.0),
    "ankle_dorsiflexion_deg": ("ankle_dorsiflexion_r", 1.0),
}
_ARM: Signed = {
    "shoulder_flexion_deg": ("shoulder_flexion_r", 1.0),
    "elbow_flexion_deg": ("elbow_flexion_r", 1.0),
}
_MOMENTS: Signed = {
    "hip_extension_Nm_per_kg": ("hip_flexion_r", -1.0),
    "hip_abduction_Nm_per_kg": ("hip_abduction_r", 1.0),
    "knee_extension_Nm_per_kg": ("knee_flexion_r", -1.0),
    "ankle_plantarflexion_Nm_per_kg": ("ankle_dorsiflexion_r", -1.0),
}
# Column: axis of the world. The left, +x, is medial of the right foot.
_FORCES: Mapping[str, int] = {
    "vertical_up_BW": 1,
    "foreaft_forward_BW": 2,
    "mediolateral_medial_BW": 0,
}
_FURTHER_ANGLES: Signed = {
    "ankle_inversion_deg": ("ankle_inversion_r", 1.0),
    "toe_extension_deg": ("toe_extension_r", 1.0),
}
_FURTHER_MOMENTS: Signed = {
    "hip_internal_rotation_Nm_per_kg": ("hip_rotation_r", 1.0),
    "ankle_inversion_Nm_per_kg": ("ankle_inversion_r", 1.0),
    "toe_flexion_Nm_per_kg": ("toe_extension_r", -1.0),
}
_TRUNK: Signed = {
    "L5S1_extension_Nm_per_kg": L5S1["extension"],
    "L5S1_bending_right_Nm_per_kg": L5S1["lateral bending"],
    "L5S1_rotation_left_Nm_per_kg": L5S1["rotation"],
}
# Column: degrees of freedom whose powers it adds up.
_POWERS: Mapping[str, tuple[str, ...]] = {
    "hip_sagittal_W_per_kg": ("hip_flexion_r",),
    "hip_W_per_kg": ("hip_flexion_r", "hip_abduction_r", "hip_rotation_r"),
    "knee_W_per_kg": ("knee_flexion_r",),
    "ankle_sagittal_W_per_kg": ("ankle_dorsiflexion_r",),
    "ankle_W_per_kg": ("ankle_dorsiflexion_r", "ankle_inversion_r"),
}
_LEG_ANGLES: Signed = {
    **{name: one for name, one in _PELVIS_AND_LEG.items() if not name.startswith("pelvis")},
    **_FURTHER_ANGLES,
}
_LEG_MOMENTS: Signed = {**_MOMENTS, **_FURTHER_MOMENTS}

_LEFT = "left_"

COLUMNS: tuple[str, ...] = (
    "gait_cycle_percent",
    *_PELVIS_AND_LEG,
    "trunk_flexion_deg",
    *_ARM,
    *_MOMENTS,
    *_FORCES,
)
"""The first columns of ``gait_cycle.csv``, those of the right leg that people are compared in."""

FURTHER: tuple[str, ...] = (
    *_FURTHER_ANGLES,
    *_FURTHER_MOMENTS,
    *_TRUNK,
    *_POWERS,
    *(_LEFT + name for name in (*_LEG_ANGLES, *_LEG_MOMENTS, *_POWERS, *_FORCES)),
)
"""The columns after these; files of older versions do not have them."""

POWERS, TRUNK_MOMENTS = tuple(_POWERS), tuple(_TRUNK)
"""Columns with the powers of the right leg, and with the moments of L5/S1."""

ANGLES: Signed = {**_PELVIS_AND_LEG, **_ARM, **_FURTHER_ANGLES}
"""Degree of freedom and its sign by column of the angles, but for the lean of the trunk."""

MOMENTS: Signed = {**_MOMENTS, **_FURTHER_MOMENTS}
"""The same of the moments of the right leg."""

FORCES: Mapping[str, int] = _FORCES
"""Axis of the world by column of the ground reaction."""

_FORCE_LABELS = {
    "vertical_up": "vertical force",
    "foreaft_forward": "forward force",
    "mediolateral_medial": "medial force",
}


def label_and_unit(column: str) -> tuple[str, str]:
    """Return what a column is called in tables and plots, and its unit."""
    if column.startswith(_LEFT):
        label, unit = label_and_unit(column.removeprefix(_LEFT))
        return f"left {label}", unit
    if column.endswith("_BW"):
        return _FORCE_LABELS[column.removesuffix("_BW")], "BW"
    if column.endswith("_Nm_per_kg"):
        words = column.removesuffix("_Nm_per_kg").replace("L5S1", "L5/S1").replace("_", " ")
        return f"{words} moment", "N m/kg"
    if column.endswith("_W_per_kg"):
        return column.removesuffix("_W_per_kg").replace("_", " ") + " power", "W/kg"
    return column.removesuffix("_deg").replace("_", " "), "deg"


def gait_cycle(gait: Gait) -> dict[str, FloatArray]:
    """Return the gait cycle of the right leg, (101,) arrays by ``COLUMNS`` and ``FURTHER``.

    Parameters
    ----------
    gait : Gait
        Its step runs from left to right heel strike: the right leg's cycle is t = T ... 3 T.
    """
    now = gait.right_stride
    mass = gait.body.subject.mass
    q, tau, power = np.rad2deg(now.q), now.tau / mass, joint_power(now) / mass
    force = now.grf / (mass * skeleton.GRAVITY)
    left = {
        **_signed(_LEG_ANGLES, q, "l"),
        **_signed(_LEG_MOMENTS, tau, "l"),
        **_added(_POWERS, power, "l"),
        **_on_foot(force[:, 1] * (-1.0, 1.0, 1.0)),  # medial of the left foot is to the right
    }
    return {
        "gait_cycle_percent": PERCENT.copy(),
        **_signed(_PELVIS_AND_LEG, q),
        "trunk_flexion_deg": np.rad2deg(trunk_lean(gait.body.table, now.q)),
        **_signed(_ARM, q),
        **_signed(_MOMENTS, tau),
        **_on_foot(force[:, 0]),
        **_signed(_FURTHER_ANGLES, q),
        **_signed(_FURTHER_MOMENTS, tau),
        **_signed(_TRUNK, tau),
        **_added(_POWERS, power),
        **{_LEFT + name: curve for name, curve in left.items()},
    }


def _signed(columns: Signed, values: FloatArray, side: str = "r") -> dict[str, FloatArray]:
    return {name: sign * values[:, _of(dof, side)] for name, (dof, sign) in columns.items()}


def _added(
    columns: Mapping[str, tuple[str, ...]], values: FloatArray, side: str = "r"
) -> dict[str, FloatArray]:
    return {
        name: values[:, [_of(dof, side) for dof in dofs]].sum(axis=1)
        for name, dofs in columns.items()
    }


def _on_foot(force: FloatArray) -> dict[str, FloatArray]:
    return {column: force[:, axis] for column, axis in _FORCES.items()}


def _of(dof: str, side: str) -> int:
    """Return the index of a degree of freedom of the right side, or of its like on another side."""
    return skeleton.index(f"{dof[:-1]}{side}" if dof.endswith("_r") else dof)


def trunk_lean(table: DHTable, q: FloatArray) -> FloatArray:
    """Return the forward lean of the thorax from the vertical, (...), [rad].

    Parameters
    ----------
    table : DHTable
    q : (..., 55) array, [rad] and [m]

    Notes
    -----
    The angle, in the plane of walking, of the thorax's own long axis. To first order it is the sum
    of pelvic tilt and the flexions of the four spine joints.
    """
    thorax = skeleton.SEGMENTS["thorax"]
    upright = frames(table, np.zeros(skeleton.N_DOF))[1][thorax, :3, :3]
    now = frames(table, q)[1][..., thorax, :3, :3]
    long_axis = now @ upright.T[:, 1]
    return np.asarray(np.arctan2(long_axis[..., 2], long_axis[..., 1]), dtype=np.float64)


def save_gait_cycle(gait: Gait, path: str | Path) -> None:
    """Write the gait cycle as CSV, ``COLUMNS`` and ``FURTHER`` by 101 rows."""
    cycle = gait_cycle(gait)
    values = np.column_stack(list(cycle.values())) + 0.0  # no -0
    lines = [",".join(f"{value:.9g}" for value in row) for row in values.tolist()]
    Path(path).write_text("\n".join([",".join(cycle), *lines, ""]), encoding="utf-8")


def load_gait_cycle(path: str | Path) -> dict[str, FloatArray]:
    """Read what `save_gait_cycle` wrote, now or before there was `FURTHER`; others are ignored.

    Raises
    ------
    ResultError
        If the file cannot be read, lacks one of `COLUMNS` or holds anything but 101 rows of
        numbers.
    """
    header, values = _read_csv(Path(path))
    missing = [column for column in COLUMNS if column not in header]
    if missing:
        raise ResultError(f"{path}: no column {', '.join(missing)}")
    known = (*COLUMNS, *(column for column in FURTHER if column in header))
    cycle = {column: values[:, header.index(column)] for column in known}
    if not np.array_equal(cycle["gait_cycle_percent"], PERCENT):
        raise ResultError(f"{path}: gait_cycle_percent must count from 0 to 100")
    return cycle


def _read_csv(path: Path) -> tuple[list[str], FloatArray]:
    """Return the header and the values, (101, columns), all finite."""
    try:
        rows = list(csv.reader(read_text(path).splitlines()))
        values = np.array(rows[1:], dtype=float)
    except (ValueError, csv.Error):  # not text, not numbers, or rows of unequal length
        raise ResultError(f"{path}: is not a table of numbers below a header") from None
    header = rows[0] if rows else []
    if values.shape != (len(PERCENT), len(header)) or not (np.abs(values) < _TOO_LARGE).all():
        message = f"must hold {len(PERCENT)} rows of finite numbers below {_TOO_LARGE:g}"
        raise ResultError(f"{path}: {message}")
    return header, values
