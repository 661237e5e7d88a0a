"""A gait that was found before as the start of another problem, with its multipliers."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import N_DOF, index
from human_gait.problem.constraints import LIMITS, SYMMETRY
from human_gait.problem.program import GaitProgram
from human_gait.results.archive import numbers, opened, told
from human_gait.results.names import MULTIPLIERS
from human_gait.walk.belonging import GAIT_MEMBER, multipliers_belong
from human_gait.walk.described import gait_digest
from human_gait.walk.gait import Gait

_FORWARD = index("pelvis_tz")
_SAMPLES = 100
_NAMES = "__names__"


def save_multipliers(gait: Gait, folder: Path) -> None:
    """Write the shadow price of every bound, by name of its constraint, to ``multipliers.npz``.

    In N^2 m^2 s per unit of the row, as `Solution.multipliers`; nothing is written if there are
    none. The digest of the gait is with them.
    """
    if gait.multipliers:
        members = {**_packed(gait.multipliers), GAIT_MEMBER: np.array(gait_digest(gait))}
        np.savez_compressed(folder / MULTIPLIERS, **members)  # type: ignore[arg-type]


def _packed(multipliers: Mapping[str, FloatArray]) -> dict[str, np.ndarray[Any, Any]]:
    """Return the arrays of the file: names are text in one of them, for any name is allowed.

    As names of arrays numpy takes some for options (``file``), and an archive folders (``a/b``).
    """
    keys = {f"__{k}__": name for k, name in enumerate(multipliers)}
    prices = {key: multipliers[name] for key, name in keys.items()}
    return {_NAMES: np.array(json.dumps(keys)), **prices}


def _keys(file: Mapping[str, Any]) -> dict[str, str]:
    """Return the name of its array for each name of a constraint, also of older versions."""
    if _NAMES not in file:
        return {name: name for name in file if name != GAIT_MEMBER}
    keys = told(file, _NAMES)
    if not isinstance(keys, dict):
        raise TypeError(f"{_NAMES} holds no names")
    return {str(name): key for key, name in keys.items()}


def load_multipliers(gait: Gait, folder: Path) -> dict[str, FloatArray]:
    """Return the multipliers of the gait of a result; none if it has none.

    Raises
    ------
    ResultError
        If the file cannot be read, holds something else, or is of another gait.
    """
    path = folder / MULTIPLIERS
    if not path.exists():
        return {}
    with opened(path, "multipliers") as file:
        if not multipliers_belong(file, gait):
            raise ValueError("they are of another walk than the gait beside them")
        found = {name: numbers(file, key) for name, key in _keys(file).items()}
        if odd := [name for name, price in found.items() if price.ndim != 1]:
            raise ValueError(f"{odd[0]} is not a list of numbers")
    return found


def adapted(gait: Gait, program: GaitProgram) -> FloatArray:
    """Return free control points (m * 55,) of a program from the gait of another one.

    The phases of the step stay where they are, so do the joint angles; the pelvis moves forward
    as far as the new step is long. Control points beyond new joint limits are brought back.
    """
    longer = program.scenario.walk.step_length / gait.step_length
    same = len(gait.breaks) == len(program.basis.breaks) and (
        gait.basis.mirrored == program.basis.mirrored
    )
    if same and np.allclose(
        gait.breaks / gait.step_time, program.basis.breaks / program.basis.step_time
    ):
        points = stretched(gait.free, longer).reshape(-1, N_DOF)
    else:
        phases = np.linspace(0.0, 1.0, _SAMPLES)
        q = gait.basis.matrix(phases * gait.step_time) @ gait.control_points
        q[:, _FORWARD] *= longer
        points = program.basis.fit(phases * program.basis.step_time, q)
    return np.clip(points, *program.limits).ravel()


def stretched(free: FloatArray, factor: float) -> FloatArray:
    """Return control points of steps that are longer by a factor, the joint angles as they are."""
    points = free.reshape(-1, N_DOF).copy()
    points[:, _FORWARD] *= factor
    return points.ravel()


def fitting(multipliers: Mapping[str, FloatArray], program: GaitProgram) -> dict[str, FloatArray]:
    """Return the multipliers whose rows a program has too, and 0 for its other rows.

    Rows belong together if a constraint has as many in both; the limits if there are as many
    control points.
    """
    sizes = {c.name: len(c.lower) for c in program.constraints}
    sizes |= {SYMMETRY.name: len(program.symmetry_words), LIMITS.name: len(program.variables)}
    prices = {name: multipliers.get(name, np.zeros(0)) for name in sizes}
    return {
        name: price if len(price) == sizes[name] else np.zeros(sizes[name])
        for name, price in prices.items()
    }
