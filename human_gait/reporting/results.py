"""What a report needs of result folders, read and checked: the rest of it is layout."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from human_gait.exceptions import ResultError
from human_gait.people.comparison import Comparison, compare_gait
from human_gait.people.reference import Cycle
from human_gait.reporting.outcome import Outcome, read_outcome
from human_gait.results.names import EXPLANATION, GAIT_FILE, REPORT, SUMMARY
from human_gait.results.reading import AGAIN, read_json
from human_gait.results.shapes import EXPLANATION_SHAPE
from human_gait.walk.belonging import own_gait
from human_gait.walk.energy import Energy, energy
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import gait_cycle

_FILES = (GAIT_FILE, SUMMARY, EXPLANATION)


@dataclass(frozen=True)
class Bound:
    """A bound that shapes a walk, from ``explanation.json``.

    Attributes
    ----------
    name, what, meaning, step : str
        Constraint, its row, what it stands for, and the more room that is thought of.
    share : float
        When it costs most, as a share of the step.
    saving : float
        Share of the cost that the room would save.
    """

    name: str
    what: str
    meaning: str
    step: str
    share: float
    saving: float


@dataclass(frozen=True)
class Result:
    """A result folder.

    Attributes
    ----------
    label : str
        What it is called in a report: the name of its scenario, of its folder if others share that.
    folder : Path
    gait : Gait
    cycle : mapping of str to (101,) array
    energy : Energy
    outcome : Outcome
    bounds : tuple of Bound
    comparison : Comparison or None
        With measured people.
    """

    label: str
    folder: Path
    gait: Gait
    cycle: Cycle
    energy: Energy
    outcome: Outcome
    bounds: tuple[Bound, ...]
    comparison: Comparison | None


def read_results(folders: Sequence[Path]) -> tuple[Result, ...]:
    """Read result folders.

    Raises
    ------
    ResultError
        If one is no result, has a file that is missing, damaged or of another walk, or is given
        twice.
    """
    places = [folder.resolve() for folder in folders]
    for folder, place in zip(folders, places, strict=True):
        if places.count(place) > 1:
            raise ResultError(f"{folder}: the same result is given twice")
    for folder in folders:
        _check_files(folder)
    gaits = [own_gait(folder, (REPORT,)) for folder in folders]
    names = (
        [gait.scenario.name for gait in gaits],
        [place.name for place in places],
        [str(folder) for folder in folders],
    )
    labels = next((found for found in names if len(set(found)) == len(found)), names[-1])
    return tuple(map(_result, labels, folders, gaits))


def _check_files(folder: Path) -> None:
    missing = [name for name in _FILES if not (folder / name).is_file()]
    if GAIT_FILE in missing:
        message = f"{folder}: no result here (no {GAIT_FILE}), make one with human-gait predict"
        raise ResultError(message)
    if missing:
        raise ResultError(f"{folder}: no {', no '.join(missing)}: {AGAIN}")


def _result(label: str, folder: Path, gait: Gait) -> Result:
    outcome, cycle = read_outcome(folder), gait_cycle(gait)
    comparison = _comparison(folder, gait, outcome)
    bounds = read_bounds(folder)
    return Result(label, folder, gait, cycle, energy(gait), outcome, bounds, comparison)


def _comparison(folder: Path, gait: Gait, outcome: Outcome) -> Comparison | None:
    """Return how a result compares with people; an attempt that failed need not be comparable."""
    try:
        return compare_gait(gait, str(folder))
    except ResultError:
        if outcome.success:
            raise
        return None


def read_bounds(folder: Path) -> tuple[Bound, ...]:
    """Return the bounds that shape the walk of a result, that which costs most first.

    Raises
    ------
    ResultError
        If ``explanation.json`` is missing or damaged.
    """
    found = read_json(folder / EXPLANATION, EXPLANATION_SHAPE)
    return tuple(_bound(one, found["step_time_s"]) for one in found["shapes"])


def _bound(found: Any, step_time: float) -> Bound:
    return Bound(
        name=found["constraint"],
        **{key: found[key] for key in ("what", "meaning", "step")},
        share=found["time_s"] / step_time,
        saving=float(found["saving"]),
    )
