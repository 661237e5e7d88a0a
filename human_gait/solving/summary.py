"""What the files of a result tell of a solve: ``summary.json``, ``explanation.json``."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

from human_gait.body.limits import mirrored_limits
from human_gait.checks.check import NO_LIMIT, Check
from human_gait.exceptions import ResultError
from human_gait.problem.program import GaitProgram
from human_gait.problem.tracking import Tracking
from human_gait.results.names import GAIT_FILE
from human_gait.settings.departures import departures
from human_gait.solving.diagnosis import check_text, not_kept, suggestions, violation_text
from human_gait.solving.shadow_prices import influences
from human_gait.solving.solver import Solution
from human_gait.solving.starts import Attempt
from human_gait.walk.described import gait_digest, with_story
from human_gait.walk.energy import energy
from human_gait.walk.gait import Gait
from human_gait.walk.gait_file import load_record, save_gait
from human_gait.walk.measured import TRACKED, was_measured

OWN_BOUNDS = "own_bounds"
"""Of the solution of a gait: what its bounds of one's own cost, which no file has as functions."""

PACKAGES = ("human-gait", "drake", "daqp", "pin", "numpy", "scipy")


def summary_content(
    kept: Attempt, attempts: list[Attempt], seed: int, gait: Gait
) -> dict[str, Any]:
    """Return what ``summary.json`` tells.

    Parameters
    ----------
    kept : Attempt
    attempts : list of Attempt
        All of them, in their order.
    seed : int
        Of the random starts.
    gait : Gait
        What was written of the attempt.
    """
    program, solution, checks = kept.program, kept.solution, kept.checks
    scenario = program.scenario
    return {
        "success": kept.success,
        "start": kept.start,
        "seed": seed,
        "solver": solution.solver,
        "dynamics": program.dynamics,
        "solver_status": solution.status,
        "wall_time_s": sum(attempt.solution.wall_time for attempt in attempts),
        "attempts": [_attempt(attempt) for attempt in attempts],
        **spread(attempts),
        "iterations": solution.iterations,
        "evaluations": solution.evaluations,
        "cost": solution.cost,
        "cost_unit": "N^2 m^2 s",
        "n_variables": len(program.variables),
        "n_constraints": program.n_constraint_rows,
        "violations": {
            worst.name: {
                "what": worst.what,
                "value": worst.value,
                "unit": worst.unit,
                "time_s": worst.time,
                "equation": worst.equation,
            }
            for worst in solution.violations
        },
        "checks": checks_content(checks),
        "diagnosis": None if kept.success else diagnosis_content(kept),
        "walking_speed_m_per_s": scenario.walk.speed,
        "step_length_m": scenario.walk.step_length,
        "body_mass_kg": scenario.subject.mass,
        "load_kg": scenario.load.mass,
        "energy": energy(gait).to_dict(),
        "limits_by_symmetry": mirrored_limits(scenario),
        "settings_that_move_limits": [asdict(one) for one in departures(scenario)],
        "scenario": scenario.to_dict(),
        "versions": {"python": platform.python_version()}
        | {package: version(package) for package in PACKAGES},
    }


def _attempt(attempt: Attempt) -> dict[str, Any]:
    solution = attempt.solution
    return {
        "start": attempt.start,
        "solver": solution.solver,
        "solver_status": solution.status,
        "converged": solution.converged,
        "success": attempt.success,
        "failed_checks": [check.name for check in attempt.checks if not check.passed],
        "wall_time_s": solution.wall_time,
        "evaluations": solution.evaluations,
        "cost": solution.cost,
    }


def checks_content(checks: list[Check]) -> dict[str, dict[str, Any]]:
    """Return the checks by name, and whether each is passed; a note has no limit (null)."""
    return {
        check.name: {
            **asdict(check),
            "limit": None if check.limit == NO_LIMIT else check.limit,
            "passed": check.passed,
        }
        for check in checks
    }


def diagnosis_content(attempt: Attempt) -> dict[str, Any]:
    """Return which constraints and checks failed, when and by how much, and what to try."""
    program, solution, checks = attempt.program, attempt.solution, attempt.checks
    if found := was_measured(solution.gait):
        return {"not_kept": list(found["not_kept"]), "try": []}
    scenario, T = program.scenario, program.basis.step_time
    broken = [violation_text(worst, T) for worst in not_kept(scenario, solution.violations)]
    failed = [check_text(check, T) for check in checks if not check.passed]
    tries = [asdict(one) for one in suggestions(program, solution, checks)]
    return {"not_kept": broken + failed, "try": tries}


def spread(attempts: Sequence[Attempt]) -> dict[str, Any]:
    """Return how many attempts are walks, and by what part of the least their costs differ.

    Local optima are different walks at different costs.
    """
    costs = [attempt.solution.cost for attempt in attempts if attempt.success]
    least = min(costs, default=0.0)
    apart = (max(costs) - least) / abs(least) if least else None
    return {"walks": len(costs), "cost_spread": apart}


def found_gait(kept: Attempt, seed: int, attempts: Sequence[Attempt] = ()) -> Gait:
    """Return the gait of an attempt with all that is known of how it was found.

    Parameters
    ----------
    kept : Attempt
    seed : int
        Of the random starts.
    attempts : sequence of Attempt
        All of them.
    """
    program, solution = kept.program, kept.solution
    told = solution.gait.retold(solution.gait.solution, solution.multipliers)
    return with_story(
        told,
        kept.success,
        start=kept.start,
        seed=seed,
        dynamics=program.dynamics,
        iterations=solution.iterations,
        evaluations=solution.evaluations,
        **(spread(attempts) if attempts else {}),
        **own_bounds(program, solution),
        **followed(program),
    )


def save_found(kept: Attempt, seed: int, folder: Path) -> Gait:
    """Write the gait of a checked attempt, read the file back, and return what is in it.

    Raises
    ------
    ResultError
        If the file does not hold what was checked.
    """
    gait = found_gait(kept, seed)
    save_gait(gait, folder)
    read = load_record(folder)
    if read.altered or gait_digest(read.gait) != gait_digest(gait):
        raise ResultError(f"{folder / GAIT_FILE}: is not as it was written: is the disk damaged?")
    return gait


def followed(program: GaitProgram) -> dict[str, Any]:
    """Return which walk a program follows and with what weight, to keep with its gait."""
    own = next((cost for cost in program.own_costs if isinstance(cost, Tracking)), None)
    return {TRACKED: {"what": own.what, "weight": float(own.weight)}} if own else {}


def own_bounds(program: GaitProgram, solution: Solution) -> dict[str, Any]:
    """Return what bounds of one's own cost, as ``explanation.json`` tells it, to keep with a gait.

    Empty if the program has no such constraints.
    """
    names = {own.name for own in program.own_constraints}
    if not names:
        return {}
    found = influences(program, solution)
    return {OWN_BOUNDS: [one.to_dict() for one in found if one.name in names]}


def explanation_content(program: GaitProgram, solution: Solution) -> dict[str, Any]:
    """Return what shapes a gait, the most costly bound first; nothing unless it converged.

    Bounds of one's own that the gait knows of count too where the program has them no more.
    """
    names = {constraint.name for constraint in program.constraints}
    known = solution.gait.solution.get(OWN_BOUNDS, ())
    shapes = [one.to_dict() for one in influences(program, solution)]
    shapes += [one for one in known if one["constraint"] not in names]
    return {
        "cost": solution.cost,
        "cost_unit": "N^2 m^2 s",
        "price_unit": "N^2 m^2 s per unit of the bound",
        "step_time_s": program.basis.step_time,
        "shapes": sorted(shapes, key=lambda one: -one["saving"]),
    }
