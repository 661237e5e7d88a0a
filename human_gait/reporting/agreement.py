"""Results of one problem by several solvers, held against each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from human_gait.people.reference import Cycle, correlation
from human_gait.results.folder import whole_file
from human_gait.results.names import AGREEMENT, SUMMARY
from human_gait.results.reading import read_json
from human_gait.results.sealed import write_json
from human_gait.results.shapes import RESULT_SHAPE
from human_gait.walk.belonging import own_gait
from human_gait.walk.described import gait_digest
from human_gait.walk.gait_cycle import COLUMNS, gait_cycle, label_and_unit


@dataclass(frozen=True)
class CurveDifference:
    """One curve of the gait cycle in two results.

    Attributes
    ----------
    curve : str
        Name of the column in ``gait_cycle.csv``.
    r : float
        Correlation. If one is constant: 1 if both are the same, else 0.
    rms, largest : float
        Difference over the cycle, in the unit of the curve.
    """

    curve: str
    r: float
    rms: float
    largest: float


def agreement_to_folder(folder: Path, names: Sequence[str]) -> Table:
    """Compare the results in `folder`/name with the first of them, write ``agreement.json``.

    Raises
    ------
    ResultError
        If one cannot be read, or has a file of another walk.
    """
    gaits = {name: own_gait(folder / name) for name in names}
    summaries = {name: read_json(folder / name / SUMMARY, RESULT_SHAPE) for name in names}
    first, *others = map(gait_cycle, gaits.values())
    differences = dict(
        zip(names[1:], (curve_differences(first, other) for other in others), strict=True)
    )
    found = {
        "results": {
            name: {key: summary[key] for key in RESULT_SHAPE} for name, summary in summaries.items()
        },
        "cost_relative_to_first": {
            name: _relative(summary["cost"], summaries[names[0]]["cost"])
            for name, summary in summaries.items()
        },
        "curves": {name: [asdict(d) for d in rows] for name, rows in differences.items()},
    }
    with whole_file(folder / AGREEMENT) as path:
        write_json(path, found, {name: gait_digest(gait) for name, gait in gaits.items()})
    return _table(names, summaries, differences)


def _relative(cost: float | None, first: float | None) -> float | None:
    """Return by what share a cost is higher; None if that is no number."""
    return cost / first - 1.0 if cost is not None and first else None


def curve_differences(one: Cycle, other: Cycle) -> list[CurveDifference]:
    """Return the differences of the curves of two gait cycles, ``COLUMNS`` but the first."""
    return [_difference(name, one[name], other[name]) for name in COLUMNS[1:]]


def _difference(name: str, one: Any, other: Any) -> CurveDifference:
    apart = np.abs(one - other)
    r = correlation(one, other)
    if np.isnan(r):
        r = float(np.allclose(one, other))
    return CurveDifference(name, r, float(np.sqrt(np.mean(apart**2))), float(apart.max()))


def _outcome(name: str, summary: dict[str, Any]) -> str:
    found = "a walk" if summary["success"] else "no walk"
    cost = "unknown" if summary["cost"] is None else f"{summary['cost']:.1f} N2 m2 s"
    return f"{name}: {found}, cost {cost} ({summary['solver_status']})"


def _table(
    names: Sequence[str],
    summaries: dict[str, dict[str, Any]],
    differences: dict[str, list[CurveDifference]],
) -> Table:
    lines = [_outcome(name, summaries[name]) for name in names]
    table = Table(title=Text("\n".join(lines)), title_justify="left", box=SIMPLE_HEAD)
    for column in ("curve", "solver", "r", "RMS", "largest"):
        table.add_column(column, justify="left" if column in ("curve", "solver") else "right")
    for name, rows in differences.items():
        for row in rows:
            label, unit = label_and_unit(row.curve)
            numbers = (f"{row.r:.3f}", f"{row.rms:.3g} {unit}", f"{row.largest:.3g} {unit}")
            table.add_row(label, f"{name} - {names[0]}", *numbers)
    return table
