"""Results of one problem by several solvers, held against each other."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from human_gait.people.reference import correlation
from human_gait.results.folder import whole_file
from human_gait.results.names import AGREEMENT, GAIT_CYCLE, SUMMARY
from human_gait.walk.gait_cycle import label_and_unit, load_gait_cycle

_SHOWN = ("success", "solver_status", "cost", "wall_time_s", "evaluations")


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
    """Compare the results in `folder`/name with the first of them, write ``agreement.json``."""
    summaries = {name: _summary(folder / name) for name in names}
    differences = {name: curve_differences(folder / names[0], folder / name) for name in names[1:]}
    found = {
        "results": summaries,
        "cost_relative_to_first": {
            name: summary["cost"] / summaries[names[0]]["cost"] - 1.0
            for name, summary in summaries.items()
        },
        "curves": {name: [asdict(d) for d in rows] for name, rows in differences.items()},
    }
    with whole_file(folder / AGREEMENT) as path:
        path.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
    return _table(names, summaries, differences)


def curve_differences(first: Path, second: Path) -> list[CurveDifference]:
    """Return the differences of all curves of two result folders."""
    one, other = (load_gait_cycle(folder / GAIT_CYCLE) for folder in (first, second))
    return [_difference(name, one[name], other[name]) for name in list(one)[1:]]


def _difference(name: str, one: Any, other: Any) -> CurveDifference:
    apart = np.abs(one - other)
    r = correlation(one, other)
    if np.isnan(r):
        r = float(np.allclose(one, other))
    return CurveDifference(name, r, float(np.sqrt(np.mean(apart**2))), float(apart.max()))


def _summary(folder: Path) -> dict[str, Any]:
    summary = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    return {key: summary[key] for key in _SHOWN}


def _outcome(name: str, summary: dict[str, Any]) -> str:
    found = "a walk" if summary["success"] else "no walk"
    return f"{name}: {found}, cost {summary['cost']:.1f} N2 m2 s ({summary['solver_status']})"


def _table(
    names: Sequence[str],
    summaries: dict[str, dict[str, Any]],
    differences: dict[str, list[CurveDifference]],
) -> Table:
    lines = [_outcome(name, summaries[name]) for name in names]
    table = Table(title="\n".join(lines), title_justify="left", box=SIMPLE_HEAD)
    for column in ("curve", "solver", "r", "RMS", "largest"):
        table.add_column(column, justify="left" if column in ("curve", "solver") else "right")
    for name, rows in differences.items():
        for row in rows:
            label, unit = label_and_unit(row.curve)
            numbers = (f"{row.r:.3f}", f"{row.rms:.3g} {unit}", f"{row.largest:.3g} {unit}")
            table.add_row(label, f"{name} - {names[0]}", *numbers)
    return table
