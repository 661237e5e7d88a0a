"""A result folder held against measured people: a table, two files of numbers and a plot."""

import csv
import math
import statistics
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from html import escape
from io import StringIO
from pathlib import Path
from typing import Any, Unpack

from rich.table import Table

from human_gait.exceptions import ResultError
from human_gait.people.comparison_table import comparison_table
from human_gait.people.own import Own, own_trials
from human_gait.people.pictures import compare_figure
from human_gait.people.readings import readings_text
from human_gait.people.reference import Cycle, Reference, Score, references_near, scores, tuned_by
from human_gait.people.spatiotemporal import StepScore, step_scores
from human_gait.results.names import (
    COMPARISON,
    COMPARISON_CSV,
    COMPARISON_JSON,
    COMPARISON_PNG,
)
from human_gait.results.ours import check_free, our_folder
from human_gait.results.sealed import digest_of, write_json
from human_gait.terminal import screen
from human_gait.trials.stated import Options, stated
from human_gait.values import Value
from human_gait.walk.belonging import own_gait
from human_gait.walk.described import gait_digest, no_walk
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import gait_cycle
from human_gait.walk.gait_file import load_gait

NO_TRIALS = Own()
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
    no_walk : str
        Why what was compared is no walk, in a sentence; empty for a walk.
    tuned_on : str
        Which measured curves had a say in the walk, in a sentence; empty where nobody knows.
    gait : str
        The digest of what was compared.
    own : Own
        Own trials, whose references are among those above: what was read as what.
    """

    speed: float
    step_length: float
    cycle: Cycle
    references: tuple[Reference, ...]
    scores: tuple[Score, ...]
    step_scores: tuple[StepScore, ...]
    no_walk: str = ""
    tuned_on: str = ""
    gait: str = ""
    own: Own = field(default_factory=Own)

    def __str__(self) -> str:
        console = screen(width=_WIDTH, color_system=None, force_terminal=False, file=StringIO())
        with console.capture() as shown:
            console.print(comparison_table(self))
        table = "\n".join(line.rstrip() for line in shown.get().splitlines())
        return f"{readings_text(self.own)}\n{table}" if self.own.references else table

    def __repr__(self) -> str:
        lines = [self.no_walk] if self.no_walk else []
        lines += [f"Comparison: {self.speed:.2f} m/s, steps of {self.step_length:.2f} m"]
        for reference in self.references:
            r = [score.r for score in self.scores if score.reference == reference.name]
            known = [value for value in r if math.isfinite(value)]
            median = f"median r {statistics.median(known):.2f}" if known else "no r"
            lines.append(f"  {reference.label}: {len(r)} curves, {median}")
        return "\n".join([*lines, "print() shows the table"])

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


def compare(
    result: Gait | str | Path,
    with_: str | Path | Sequence[str | Path] = (),
    **options: Unpack[Options],
) -> Comparison:
    """Hold a walk against measured people of about its speed, and against own trials.

    Parameters
    ----------
    result : Gait, str or Path
        A gait, or the folder of a result, or its ``gait.npz``.
    with_ : str, Path or sequence of them
        Files of own trials, .mot, .sto, .trc, .c3d or .csv; those about one trial follow each
        other. The cycles of all make a mean and a band of one standard deviation.
    options
        What the files do not say, as the options of ``human-gait compare``: ``units``, ``up``,
        ``forward``, ``map``, ``events``, ``feet``, ``mass``, ``side``.

    Returns
    -------
    Comparison
        Scores of every curve that was measured; ``print`` shows them as a table.

    Raises
    ------
    ResultError
        If there is no gait that can be read, or it moves too little to be compared.
    TrialError
        If a file of a trial cannot be read, or leaves something open.
    """
    files = [with_] if isinstance(with_, str | Path) else list(with_)
    given = stated(**options)
    own = own_trials(files, given) if files else Own()
    if isinstance(result, Gait):
        return compare_gait(result, result.scenario.name, own)
    return compare_gait(load_gait(result), str(result), own)


def compare_gait(gait: Gait, source: str, own: Own = NO_TRIALS) -> Comparison:
    """Score a gait, which comes from a source that errors name, against the measured curves.

    Raises
    ------
    ResultError
        If it moves too little to be compared.
    """
    walk = gait.scenario.walk
    found = compare_cycle(gait_cycle(gait), walk.speed, walk.step_length, source, own)
    tuned = tuned_by(gait)
    return replace(found, no_walk=no_walk(gait), tuned_on=tuned, gait=gait_digest(gait))


def compare_to_folder(folder: str | Path, own: Own = NO_TRIALS) -> Table:
    """Compare the result in a folder, write ``compare.*`` into it and return the table.

    Raises
    ------
    ResultError
        If there is no gait that can be read or compared, or a file beside it does not belong to it.
    """
    comparison = compare_folder(folder, own)
    save_comparison(comparison, folder)
    return comparison_table(comparison)


def compare_folder(folder: str | Path, own: Own = NO_TRIALS) -> Comparison:
    """Score the result in a folder against the measured curves, and own trials.

    Raises
    ------
    ResultError
        If there is no gait that can be read or compared, or a file beside it does not belong to it.
    """
    return compare_gait(own_gait(Path(folder), COMPARISON), str(folder), own)


def compare_cycle(
    cycle: Cycle, speed: float, step_length: float, source: str, own: Own = NO_TRIALS
) -> Comparison:
    """Score a gait cycle of a walk, by its speed [m/s] and step length [m], which has a source.

    Raises
    ------
    ResultError
        If it cannot be compared; with the source.
    """
    measured = (*references_near(speed), *own.references)
    try:
        found = tuple(score for reference in measured for score in scores(cycle, reference))
        steps = step_scores(cycle, speed, step_length)
    except ResultError as error:
        raise ResultError(f"{source}: {error}") from None
    return Comparison(speed, step_length, cycle, measured, found, steps, own=own)


def save_comparison(comparison: Comparison, folder: str | Path) -> None:
    """Write ``compare.json``, ``compare.csv`` and ``compare.png`` into a folder, all or none."""
    folder = Path(folder)
    check_free(folder, COMPARISON)
    figure = compare_figure(comparison.cycle, comparison.references, comparison.no_walk)
    table = _csv(comparison).encode()
    content = _plain(comparison) | {"files": {COMPARISON_CSV: digest_of(table)}}
    with our_folder(folder, solved=False) as new:
        write_json(new / COMPARISON_JSON, content, comparison.gait)
        (new / COMPARISON_CSV).write_bytes(table)
        (new / COMPARISON_PNG).write_bytes(figure.png({"gait": comparison.gait}))


def _plain(comparison: Comparison) -> dict[str, Any]:
    """Return the scores as JSON knows them; an undefined correlation will be null."""
    return {
        "no_walk": comparison.no_walk or None,
        "tuned_on": comparison.tuned_on or None,
        "walking_speed_m_per_s": comparison.speed,
        "step_length_m": comparison.step_length,
        "references": [_source(reference) for reference in comparison.references],
        "own": {
            "notes": list(comparison.own.notes),
            "read": [asdict(reading) for reading in comparison.own.readings],
        },
        "scores": [asdict(score) for score in comparison.scores],
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
