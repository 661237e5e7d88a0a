"""What came out of a solve, as ``summary.json`` tells it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from human_gait.results.names import SUMMARY
from human_gait.results.reading import read_json
from human_gait.results.shapes import SUMMARY_SHAPE


@dataclass(frozen=True)
class Finding:
    """A check of a walk, or the worst violation of a constraint, as ``summary.json`` has it.

    Attributes
    ----------
    name, unit, what, equation : str
    value, limit : float
        In `unit`; a violation is counted from the bound, hence its limit is 0; that of a note is
        infinite.
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


def read_outcome(folder: Path) -> Outcome:
    """Read what came out of the solve of a result.

    Raises
    ------
    ResultError
        If its ``summary.json`` is missing or damaged.
    """
    return _outcome(read_json(folder / SUMMARY, SUMMARY_SHAPE))


def _outcome(found: Any) -> Outcome:
    diagnosis = found["diagnosis"] or {"not_kept": (), "try": ()}
    alike = ("success", "start", "solver", "dynamics", "seed", "iterations", "evaluations")
    return Outcome(
        **{key: found[key] for key in (*alike, "n_variables", "n_constraints", "versions")},
        status=found["solver_status"],
        wall_time=float(found["wall_time_s"]),
        cost=_number(found["cost"]),
        trials=tuple(map(_trial, found["attempts"])),
        checks=tuple(_check(name, one) for name, one in found["checks"].items()),
        violations=tuple(_violation(name, one) for name, one in found["violations"].items()),
        not_kept=tuple(diagnosis["not_kept"]),
        tries=tuple((one["key"], one["change"], one["because"]) for one in diagnosis["try"]),
    )


def _number(found: float | None) -> float:
    """Return a number; null stands for one that is not finite."""
    return math.inf if found is None else float(found)


def _trial(found: Any) -> Trial:
    return Trial(
        **{key: found[key] for key in ("start", "solver", "converged", "success")},
        status=found["solver_status"],
        failed=tuple(found["failed_checks"]),
        wall_time=float(found["wall_time_s"]),
        cost=_number(found["cost"]),
    )


def _check(name: str, found: Any) -> Finding:
    value, limit, time = _number(found["value"]), _number(found["limit"]), float(found["time"])
    what, equation = (found.get(key) or "" for key in ("what", "equation"))
    return Finding(name, found["unit"], value, limit, time, found["passed"], what, equation)


def _violation(name: str, found: Any) -> Finding:
    value, time = _number(found["value"]), float(found["time_s"])
    what, equation = found["what"], found["equation"]
    return Finding(name, found["unit"], value, 0.0, time, what=what, equation=equation)
