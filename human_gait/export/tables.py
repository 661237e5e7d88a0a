"""The walk as tables: joint angles, joint torques and ground reaction, CSV.

Names and axes (x left, y up, z forward) are those of ``gait.npz``; units end the names.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import DOF_NAMES, PRISMATIC, SIDES_IN_WORDS
from human_gait.export.rules import check_names, check_numbers
from human_gait.walk.gait import Samples

_N_GLOBAL = 6


def save_joint_angles(now: Samples, path: Path) -> None:
    """Write the 55 coordinates: angles [deg], translations of the pelvis [m]."""
    names = [
        f"{name}_{'m' if slides else 'deg'}"
        for name, slides in zip(DOF_NAMES, PRISMATIC, strict=True)
    ]
    values = np.where(PRISMATIC, now.q, np.rad2deg(now.q))
    save_csv({"time_s": now.t} | dict(zip(names, values.T, strict=True)), path)


def save_joint_torques(now: Samples, path: Path) -> None:
    """Write the torques of the joints, [N m]: net, and the part of the muscles.

    The difference is what the passive tissues give. The global DOF have none.
    """
    columns = {"time_s": now.t}
    for kind, torques in (("net", now.tau), ("muscle", now.active)):
        for i, name in enumerate(DOF_NAMES[_N_GLOBAL:], start=_N_GLOBAL):
            columns[f"{name}_{kind}_Nm"] = torques[:, i]
    save_csv(columns, path)


def save_ground_reaction(now: Samples, path: Path) -> None:
    """Write force [N], centre of pressure [m] and free moment [N m] of each foot, and the ZMP [m].

    Where a foot carries nothing its centre of pressure is left empty.
    """
    columns, gaps = {"time_s": now.t}, list[str]()
    for f, side in enumerate(SIDES_IN_WORDS):
        loaded = now.grf[:, f].any(axis=1, keepdims=True)
        place = np.where(loaded, now.cop[:, f], np.nan)
        columns |= {f"{side}_force_{x}_N": now.grf[:, f, i] for i, x in enumerate("xyz")}
        pressure = {f"{side}_pressure_{x}_m": place[:, i] for i, x in ((0, "x"), (2, "z"))}
        columns |= pressure
        gaps += pressure
        columns[f"{side}_free_moment_y_Nm"] = now.yaw_moment[:, f]
        columns[f"{side}_share_on_toes"] = now.toe_share[:, f]
    columns |= {f"zmp_{x}_m": now.zmp[:, i] for i, x in ((0, "x"), (2, "z"))}
    save_csv(columns, path, gaps)


def save_csv(columns: Mapping[str, FloatArray], path: Path, gaps: Collection[str] = ()) -> None:
    """Write columns (K,) below their names, to 12 digits; NaN is left empty where gaps may be."""
    check_names(path.name, columns, r'\s,"')
    known = {name: np.where(np.isnan(x), 0.0, x) for name, x in columns.items() if name in gaps}
    check_numbers(path.name, {**columns, **known})
    table = np.column_stack(list(columns.values())) + 0.0  # no -0
    rows = [",".join("" if np.isnan(x) else f"{x:.12g}" for x in row) for row in table.tolist()]
    path.write_text("\n".join([",".join(columns), *rows, ""]), encoding="utf-8")
