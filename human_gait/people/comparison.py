"""A result folder held against measured people: a table, two files of numbers and a plot."""

import csv
import json
import math
import statistics
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from html import escape
from io import StringIO
from pathlib import Path
from typing import Any

from rich.table import Table

from human_gait.exceptions import ResultError
from human_gait.people.comparison_table import comparison_table
from human_gait.people.pictures import compare_figure
from human_gait.people.reference import Cycle, Reference, Score, references_near, scores
from human_gait.people.spatiotemporal import StepScore, step_scores
from human_gait.results.names import (
    COMPARISON,
    COMPARISON_CSV,
    COMPARISON_JSON,
    COMPARISON_PNG,
    GAIT_CYCLE,
    SUMMARY,
)
from human_gait.results.ours import check_free, our_folder
from human_gait.results.reading import read_json
from human_gait.terminal import screen
from human_gait.values import Value
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import gait_cycle, load_gait_cycle
from human_gait.walk.gait_file import load_gait

_WIDTH = 120  # signs in a line of the table, where there is no terminal


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Value):
    """A gait cycle and its scores against measured people; ``print`` shows them as a table.

    Attributes
    ----------
    speed, step_length : float, [m/s] and [m]
    cycle : mapping of str to (101,) array
    references : tuple of Reference
    scores : tuple of Score
    step_scores : tuple of StepScore
    """

    speed: float
    step_length: float
    cycle: Cycle
    references: tuple[Reference, ...]
    scores: tuple[Score, ...]
    step_scores: tuple[StepScore, ...]

    def __str__(self) -> str:
        console = screen(width=_WIDTH, color_system=None, force_terminal=False, file=StringIO())
        with console.capture() as shown:
            console.print(comparison_table(self))
        return "\n".join(line.rstrip() for line in shown.get().splitlines())

    def __repr__(self) -> str:
        lines = [f"Comparison: {self.speed:.2f} m/s, steps of {self.step_length:.2f} m"]
        for reference in self.references:
            r = [score.r for score in self.scores if score.reference == reference.name]
            known = [value for value in r if math.isfinite(value)]
            median = f"median r {statistics.median(known):.2f}" if known else "no r"
            lines.append(f"  {reference.label}: {len(r)} curves, {median}")
        return "\n".join([*lines, "print() shows the table"])

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


def compare(result: Gait | str | Path) -> Comparison:
    """Hold a walk against measured people of about its speed.

    Parameters
    ----------
    result : Gait, str or Path
        A gait, or the folder of a result, or its ``gait.npz``.

    Returns
    -------
    Comparison
        Scores of every curve that was measured; ``print`` shows them as a table.

    Raises
    ------
    ResultError
        If there is no gait that can be read, or it moves too little to be compared.
    """
    gait = result if isinstance(result, Gait) else load_gait(result)
    source = gait.scenario.name if isinstance(result, Gait) else str(result)
    walk = gait.scenario.walk
    return _compared(gait_cycle(gait), walk.speed, walk.step_length, source)


def compare_to_folder(folder: str | Path) -> Table:
    """Compare the result in a folder, write ``compare.*`` into it and return the table.

    Raises
    ------
    ResultError
        If ``gait_cycle.csv`` or ``summary.json`` is missing or cannot be used.
    """
    comparison = compare_folder(folder)
    save_comparison(comparison, folder)
    return comparison_table(comparison)


def compare_folder(folder: str | Path) -> Comparison:
    """Read the result in a folder and score it against the measured curves.

    Raises
    ------
    ResultError
        If ``gait_cycle.csv`` or ``summary.json`` is missing or cannot be used.
    """
    folder = Path(folder)
    cycle = load_gait_cycle(folder / GAIT_CYCLE)
    speed, step_length = _speed_and_step_length(folder / SUMMARY)
    return _compared(cycle, speed, step_length, str(folder / GAIT_CYCLE))


def _compared(cycle: Cycle, speed: float, step_length: float, source: str) -> Comparison:
    measured = references_near(speed)
    try:
        found = tuple(score for reference in measured for score in scores(cycle, reference))
        steps = step_scores(cycle, speed, step_length)
    except ResultError as error:
        raise ResultError(f"{source}: {error}") from None
    return Comparison(speed, step_length, cycle, measured, found, steps)


def _speed_and_step_length(path: Path) -> tuple[float, float]:
    def positive(summary: object) -> tuple[float, float]:
        speed = _positive(path, summary, "walking_speed_m_per_s")
        return speed, _positive(path, summary, "step_length_m")

    return read_json(path, positive)


def _positive(path: Path, summary: object, key: str) -> float:
    value = summary.get(key) if isinstance(summary, Mapping) else None
    if isinstance(value, bool) or not isinstance(value, int | float) or not 1e-3 < value < 1e3:
        raise ResultError(f"{path}: {key} must be a number above 0, of a walk")
    return float(value)


def save_comparison(comparison: Comparison, folder: str | Path) -> None:
    """Write ``compare.json``, ``compare.csv`` and ``compare.png`` into a folder, all or none."""
    folder = Path(folder)
    check_free(folder, COMPARISON)
    figure = compare_figure(comparison.cycle, comparison.references)
    text = json.dumps(_plain(comparison), indent=2, allow_nan=False)
    with our_folder(folder, solved=False) as new:
        (new / COMPARISON_JSON).write_text(text + "\n", encoding="utf-8")
        (new / COMPARISON_CSV).write_text(_csv(comparison), encoding="utf-8")
        (new / COMPARISON_PNG).write_bytes(figure.png())


def _plain(comparison: Comparison) -> dict[str, Any]:
    """Return the scores as JSON knows them; an undefined correlation is null."""
    return {
        "walking_speed_m_per_s": comparison.speed,
        "step_length_m": comparison.step_length,
        "references": [_source(reference) for reference in comparison.references],
        "scores": [
            asdict(score) | {"r": score.r if math.isfinite(score.r) else None}
            for score in comparison.scores
        ],
        "step": [asdict(step) | {"inside": step.inside} for step in comparison.step_scores],
    }


def _source(reference: Reference) -> dict[str, Any]:
    return {
        "name": reference.name,
        "label": reference.label,
        "speed_m_per_s": reference.speed,
        "citation": reference.citation,
        "licence": reference.licence,
    }


def _csv(comparison: Comparison) -> str:
    """Return one row for each score, the ranges in two columns each."""
    text = StringIO()
    rows = [_flat(score) for score in comparison.scores]
    writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _flat(score: Score) -> dict[str, object]:
    row: dict[str, object] = {}
    for name, value in asdict(score).items():
        if isinstance(value, tuple):
            stem = name.removesuffix("_range")
            row |= {f"{stem}_least": value[0], f"{stem}_greatest": value[1]}
        else:
            row[name] = value
    return row
