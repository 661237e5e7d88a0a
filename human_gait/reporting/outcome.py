"""What came out of a solve, as ``summary.json`` tells it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from human_gait.results.names import SUMMARY
from human_gait.results.reading import read_json


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
    return read_json(folder / SUMMARY, _outcome)


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
    value, time = float(found["value"]), float(found["time"])
    limit = math.inf if found["limit"] is None else float(found["limit"])
    what, equation = (str(found.get(key, "")) for key in ("what", "equation"))
    unit, passed = str(found["unit"]), bool(found["passed"])
    return Finding(name, unit, value, limit, time, passed, what, equation)


def _violation(name: str, found: Any) -> Finding:
    value, time = float(found["value"]), float(found["time_s"])
    what, equation = str(found["what"]), str(found["equation"])
    return Finding(name, str(found["unit"]), value, 0.0, time, what=what, equation=equation)
