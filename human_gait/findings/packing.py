"""Numbers as a page carries them: base64 of whole numbers, or of floats where there is room."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.findings.columns import Column

_LEVELS = 255
_STEPS = 65534  # the code after it is for no number


def encoded(array: Any, kind: str) -> str:
    """Return an array in the byte order and type of a typed array of the browser."""
    return base64.b64encode(np.asarray(array).astype(kind).tobytes()).decode("ascii")


def packed_values(column: Column, exact: bool) -> dict[str, Any]:
    """Return the values of a column: by levels, as floats (`exact`), or in steps of its range.

    Levels and floats of 24 bits lose nothing that is shown; steps are 1/65,534 of the range.
    """
    values, levels = column.values, _levels(column)
    if levels is not None:
        code = np.searchsorted(levels, values)
        return {
            "levels": levels.tolist(),
            "u1": encoded(np.where(np.isnan(values), _LEVELS, code), "u1"),
        }
    if exact:
        return {"f4": encoded(values, "<f4")}
    code, low, step = in_steps(values)
    return {"low": low, "step": step, "u2": encoded(code, "<u2")}


def _levels(column: Column) -> FloatArray | None:
    """Return the values of a column that has few; an output seldom has."""
    return column.levels(_LEVELS if column.setting else min(_LEVELS, len(column.values) // 3))


def in_steps(values: Any) -> tuple[Any, float, float]:
    """Return values as whole numbers of steps from the least, 65,535 where there is none."""
    low, high = (0.0, 0.0) if np.isnan(values).all() else (np.nanmin(values), np.nanmax(values))
    step = float(high - low) / _STEPS or 1.0
    code = np.rint((np.nan_to_num(values, nan=low) - low) / step)
    return np.where(np.isnan(values), _STEPS + 1, code), float(low), step


def cost(column: Column, exact: bool) -> int:
    """Return how many characters of the page the values of a column take, about."""
    size = 1 if _levels(column) is not None else 4 if exact else 2
    return len(column.values) * size * 4 // 3
