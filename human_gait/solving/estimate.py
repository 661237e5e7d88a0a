"""About how a walk changes with its scenario: one Newton step from a walk that was found."""

from __future__ import annotations

from threadpoolctl import threadpool_limits

from human_gait.exceptions import ResultError
from human_gait.problem.program import GaitProgram
from human_gait.problem.units import COST_SCALE
from human_gait.solving.newton_solver import one_step
from human_gait.solving.starts import from_walk
from human_gait.walk.described import ESTIMATE, with_story
from human_gait.walk.gait import Gait

ONE_STEP = "an estimate: one step from a walk like it"
"""Status of the solver."""


def estimated(gait: Gait, program: GaitProgram) -> Gait:
    """Return about how the walk of a program is, from a walk like it with its multipliers.

    How far it is off stands in its `Gait.solution`, under ``estimate``: the largest violation of
    any constraint is measured. The error of the cost is that of the quadratic model, whose cost
    differs from the one that is measured, and what the step has left (`newton.sensitivity`).

    Raises
    ------
    ResultError
        If no step can be computed.
    """
    start = from_walk(gait, program)
    x, duals = program.torques.point(start.point / program.unit), program.duals(start.multipliers)
    with threadpool_limits(1, "blas"):
        moved = one_step(program.torques.prog, x, duals)
        if moved is None:
            raise ResultError(f"{program.scenario.name}: cannot be estimated; predict it")
        free = moved.x[: len(program.unit)] * program.unit
        violations = program.violations(free, moved.x)
        cost = program.total_cost(free, moved.x)
    worst = max(violations, key=lambda violation: violation.value)
    off = abs(cost - moved.cost / COST_SCALE) + moved.left / COST_SCALE
    how = {
        "from": gait.scenario.name,
        "cost_error": float(off),
        "largest_violation": worst.value,
        "unit": worst.unit,
        "constraint": worst.name,
        "time_s": worst.time,
    }
    found = {"solver": "newton", "status": ONE_STEP, "cost": cost, "dynamics": program.dynamics}
    return with_story(program.gait(free, **found), success=False, **{ESTIMATE: how})
