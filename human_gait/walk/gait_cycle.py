"""The right leg's gait cycle, from its heel strike to the next, in the signs of gait laboratories.

Angles are those of the degrees of freedom; the three of the pelvis (obliquity, tilt, rotation, in
this order) agree with other sequences to second order in small angles. Moments are internal net
moments about the same axes, inverse dynamics' own: they extend the hip, abduct it, extend the knee
and plantarflex the ankle when positive. They are per mass and the ground reaction per weight of the
body alone, without a load.
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

COLUMNS: tuple[str, ...] = (
    "gait_cycle_percent",
    *_PELVIS_AND_LEG,
    "trunk_flexion_deg",
    *_ARM,
    *_MOMENTS,
    *_FORCES,
)
"""Columns of ``gait_cycle.csv``."""

_FORCE_LABELS = {
    "vertical_up": "vertical force",
    "foreaft_forward": "forward force",
    "mediolateral_medial": "medial force",
}


def label_and_unit(column: str) -> tuple[str, str]:
    """Return what a column is called in tables and plots, and its unit."""
    if column.endswith("_BW"):
        return _FORCE_LABELS[column.removesuffix("_BW")], "BW"
    if column.endswith("_Nm_per_kg"):
        return column.removesuffix("_Nm_per_kg").replace("_", " ") + " moment", "N m/kg"
    return column.removesuffix("_deg").replace("_", " "), "deg"


def gait_cycle(gait: Gait) -> dict[str, FloatArray]:
    """Return the gait cycle of the right leg, each of ``COLUMNS`` as a (101,) array.

    Parameters
    ----------
    gait : Gait
        Its step runs from left to right heel strike: the right leg's cycle is t = T ... 3 T.
    """
    instants = gait.instants(gait.step_time * (1.0 + PERCENT / 50.0))
    mass = gait.body.subject.mass
    tau, force = instants.tau / mass, instants.grf[:, 0] / (mass * skeleton.GRAVITY)
    return {
        "gait_cycle_percent": PERCENT.copy(),
        **_signed(_PELVIS_AND_LEG, np.rad2deg(instants.q)),
        "trunk_flexion_deg": np.rad2deg(trunk_lean(gait.body.table, instants.q)),
        **_signed(_ARM, np.rad2deg(instants.q)),
        **_signed(_MOMENTS, tau),
        **{column: force[:, axis] for column, axis in _FORCES.items()},
    }


def _signed(columns: Signed, values: FloatArray) -> dict[str, FloatArray]:
    return {name: sign * values[:, skeleton.index(dof)] for name, (dof, sign) in columns.items()}


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
    """Write the gait cycle of the right leg as CSV, ``COLUMNS`` by 101 rows."""
    cycle = gait_cycle(gait)
    values = np.column_stack([cycle[column] for column in COLUMNS]) + 0.0  # no -0
    lines = [",".join(f"{value:.9g}" for value in row) for row in values.tolist()]
    Path(path).write_text("\n".join([",".join(COLUMNS), *lines, ""]), encoding="utf-8")


def load_gait_cycle(path: str | Path) -> dict[str, FloatArray]:
    """Read what `save_gait_cycle` wrote; further columns are ignored.

    Raises
    ------
    ResultError
        If the file cannot be read, lacks a column or holds anything but 101 rows of numbers.
    """
    header, values = _read_csv(Path(path))
    missing = [column for column in COLUMNS if column not in header]
    if missing:
        raise ResultError(f"{path}: no column {', '.join(missing)}")
    cycle = {column: values[:, header.index(column)] for column in COLUMNS}
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
