"""What a report needs of result folders, read and checked: the rest of it is layout."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from human_gait.exceptions import ResultError
from human_gait.people.comparison import Comparison, compare_folder
from human_gait.people.reference import Cycle
from human_gait.results.folder import AGAIN, read_json
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import load_gait_cycle
from human_gait.walk.gait_file import FILE, load_gait

PLAYBACK = "playback.html"
_FILES = (FILE, "summary.json", "gait_cycle.csv", "explanation.json")


@dataclass(frozen=True)
class Finding:
    """A check of a walk, or the worst violation of a constraint, as ``summary.json`` has it.

    Attributes
    ----------
    name, unit, what, equation : str
    value, limit : float
        In `unit`; a violation is counted from the bound, hence its limit is 0.
    time : float, [s]
    passed : bool
    """

    name: str
    unit: str
    value: float
    limit: float
    time: float
    passed: bool = True
    what: str = ""
    equation: str = ""


@dataclass(frozen=True)
class Trial:
    """One attempt at solving.

    Attributes
    ----------
    start, solver, status : str
    converged, success : bool
    failed : tuple of str
        Names of the checks that failed.
    wall_time, cost : float, [s] and [N^2 m^2 s]
    """

    start: str
    solver: str
    status: str
    converged: bool
    success: bool
    failed: tuple[str, ...]
    wall_time: float
    cost: float


@dataclass(frozen=True)
class Outcome:
    """What came out, from ``summary.json``.

    Attributes
    ----------
    success : bool
    start, solver, dynamics, status : str
    seed, iterations, evaluations, n_variables, n_constraints : int
    wall_time, cost : float, [s] and [N^2 m^2 s]
    trials : tuple of Trial
    checks, violations : tuple of Finding
    not_kept : tuple of str
        What is wrong with it, the worst first; empty for a walk.
    tries : tuple of (key, change, because)
        What to try instead.
    versions : mapping of str to str
        Of Python and of the packages.
    """

    success: bool
    start: str
    solver: str
    dynamics: str
    status: str
    seed: int
    iterations: int
    evaluations: int
    n_variables: int
    n_constraints: int
    wall_time: float
    cost: float
    trials: tuple[Trial, ...]
    checks: tuple[Finding, ...]
    violations: tuple[Finding, ...]
    not_kept: tuple[str, ...]
    tries: tuple[tuple[str, str, str], ...]
    versions: Mapping[str, str]

    @property
    def first_solver(self) -> str:
        """Return the solver that was asked for: of later attempts another may be kept."""
        return self.trials[0].solver if self.trials else self.solver


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
        Share of the effort that the room would save.
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
    outcome : Outcome
    bounds : tuple of Bound
    comparison : Comparison or None
        With measured people.
    """

    label: str
    folder: Path
    gait: Gait
    cycle: Cycle
    outcome: Outcome
    bounds: tuple[Bound, ...]
    comparison: Comparison | None


def read_results(folders: Sequence[Path]) -> tuple[Result, ...]:
    """Read result folders.

    Raises
    ------
    ResultError
        If one is no result, has a file missing or damaged, or is given twice.
    """
    places = [folder.resolve() for folder in folders]
    for folder, place in zip(folders, places, strict=True):
        if places.count(place) > 1:
            raise ResultError(f"{folder}: the same result is given twice")
    for folder in folders:
        _check_files(folder)
    gaits = [load_gait(folder) for folder in folders]
    names = (
        [gait.scenario.name for gait in gaits],
        [place.name for place in places],
        [str(folder) for folder in folders],
    )
    labels = next((found for found in names if len(set(found)) == len(found)), names[-1])
    return tuple(map(_result, labels, folders, gaits))


def _check_files(folder: Path) -> None:
    missing = [name for name in _FILES if not (folder / name).is_file()]
    if FILE in missing:
        message = f"{folder}: no result here (no {FILE}), make one with human-gait predict"
        raise ResultError(message)
    if missing:
        raise ResultError(f"{folder}: no {', no '.join(missing)}: {AGAIN}")


def _result(label: str, folder: Path, gait: Gait) -> Result:
    outcome = read_json(folder / "summary.json", _outcome)
    return Result(
        label,
        folder,
        gait,
        load_gait_cycle(folder / "gait_cycle.csv"),
        outcome,
        read_json(folder / "explanation.json", _bounds),
        _comparison(folder, outcome),
    )


def _comparison(folder: Path, outcome: Outcome) -> Comparison | None:
    """Return how a result compares with people; an attempt that failed need not be comparable."""
    try:
        return compare_folder(folder)
    except ResultError:
        if outcome.success:
            raise
        return None


def _outcome(found: Any) -> Outcome:
    diagnosis = found["diagnosis"] or {"not_kept": (), "try": ()}
    return Outcome(
        success=bool(found["success"]),
        start=str(found["start"]),
        solver=str(found["solver"]),
        dynamics=str(found["dynamics"]),
        status=str(found["solver_status"]),
        seed=int(found["seed"]),
        iterations=int(found["iterations"]),
        evaluations=int(found["evaluations"]),
        n_variables=int(found["n_variables"]),
        n_constraints=int(found["n_constraints"]),
        wall_time=float(found["wall_time_s"]),
        cost=float(found["cost"]),
        trials=tuple(map(_trial, found["attempts"])),
        checks=tuple(_check(name, one) for name, one in found["checks"].items()),
        violations=tuple(_violation(name, one) for name, one in found["violations"].items()),
        not_kept=tuple(map(str, diagnosis["not_kept"])),
        tries=tuple(
            (str(one["key"]), str(one["change"]), str(one["because"])) for one in diagnosis["try"]
        ),
        versions={str(name): str(version) for name, version in found["versions"].items()},
    )


def _trial(found: Any) -> Trial:
    return Trial(
        start=str(found["start"]),
        solver=str(found["solver"]),
        status=str(found["solver_status"]),
        converged=bool(found["converged"]),
        success=bool(found["success"]),
        failed=tuple(map(str, found["failed_checks"])),
        wall_time=float(found["wall_time_s"]),
        cost=float(found["cost"]),
    )


def _check(name: str, found: Any) -> Finding:
    value, limit, time = (float(found[key]) for key in ("value", "limit", "time"))
    passed, equation = bool(found["passed"]), str(found.get("equation", ""))
    return Finding(name, str(found["unit"]), value, limit, time, passed, equation=equation)


def _violation(name: str, found: Any) -> Finding:
    value, time = float(found["value"]), float(found["time_s"])
    what, equation = str(found["what"]), str(found["equation"])
    return Finding(name, str(found["unit"]), value, 0.0, time, what=what, equation=equation)


def _bounds(found: Any) -> tuple[Bound, ...]:
    step_time = float(found["step_time_s"])
    return tuple(
        Bound(
            name=str(one["constraint"]),
            what=str(one["what"]),
            meaning=str(one["meaning"]),
            step=str(one["step"]),
            share=float(one["time_s"]) / step_time,
            saving=float(one["saving"]),
        )
        for one in found["shapes"]
    )
