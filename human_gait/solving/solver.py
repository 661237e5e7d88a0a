"""Solve the program of a gait: by Newton steps, or with SNOPT or IPOPT.

``newton`` has exact second derivatives and starts from the guess as it is, or warm from a walk like
the one to be found (`newton_solver`). The other two build up second derivatives from changes of the
gradient on the way, and want a feasible posture path first.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from human_gait.arrays import FloatArray
from human_gait.checks.contents import OWN_COST
from human_gait.exceptions import UnsupportedProgram
from human_gait.problem.drake import Stage
from human_gait.problem.objective import objective
from human_gait.problem.program import GaitProgram
from human_gait.problem.violation import Violation
from human_gait.solving.drake_solvers import SOLVERS, duals_of, refuse, solve_program, status_of
from human_gait.solving.watch import FEASIBLE, Interrupted, Iterate, Watch, watched
from human_gait.stopping import TIME_LIMIT, checked_limit, outermost
from human_gait.values import Value
from human_gait.walk.gait import Gait

POSTURE_OPTIONS: dict[str, dict[str, Any]] = {
    "newton": {"stationary": 1e-2, "complementary": 1e-2, "most_iterations": 50},
    "snopt": {"Major optimality tolerance": 1e-1, "Major iterations limit": 25},
    "ipopt": {"tol": 1e-2, "max_iter": 50},
}
OWN_OPTIONS = {
    ("human", "newton"): {
        "first_barrier": 3e-3,
        "patience": 1e3,
        "start_push": 0.05,
        "start_share": 0.5,
    }
}
"""Of a formulation and a solver: its bounds are narrow, and their middle is far from its walks."""

POSTURE = (1.0, 1e-1)
"""Weights of a posture path: staying near the guess [1/rad^2 s], moving gently [s^3/rad^2]."""


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Value):
    """What the solver found.

    Attributes
    ----------
    gait : Gait
    converged : bool
        Whether the solver says that its point is feasible and optimal, and the point is feasible.
        SNOPT's 3 counts: optimal to within a hundred times its tolerance, and no nearer to be had.
    interrupted : bool
        Whether the user or a signal asked to stop; after the last evaluation that changes nothing
        else.
    solver, status : str
    iterations, evaluations : int
        Newton steps, or for the other solvers, which do not tell, points evaluated; times that the
        dynamics was evaluated.
    cost : float, [N^2 m^2 s]
        With all costs that the program holds.
    wall_time : float, [s]
    violations : list of Violation
    multipliers : dict of str to array
        What each bound costs, `GaitProgram.multipliers`; empty unless converged.
    """

    gait: Gait
    converged: bool
    interrupted: bool
    solver: str
    status: str
    iterations: int
    evaluations: int
    cost: float
    wall_time: float
    violations: list[Violation]
    multipliers: dict[str, FloatArray] = field(default_factory=dict)

    def __repr__(self) -> str:
        worst = max(self.violations, key=lambda violation: violation.value, default=None)
        off = f"{worst.name} by {worst.value:.2g} {worst.unit}" if worst and worst.value else "none"
        return (
            f"Solution: {'converged' if self.converged else 'not converged'}, "
            f"{self.solver} ({self.status})\n"
            f"  {self.iterations} iterations, {self.evaluations} evaluations, "
            f"{self.wall_time:.2f} s\n"
            f"  cost {self.cost:.6g} N^2 m^2 s, largest violation: {off}"
        )


@dataclass(frozen=True)
class End:
    """Where a solver ended.

    Attributes
    ----------
    x : (n,) array
        The decision variables, of which the first are control points in parts of their units.
    free : (m * 55,) array
        Free control points.
    solved : bool
    status : str
    iterations : int or None
    duals : mapping of str to array
        d cost / d bound by description of the constraint.
    """

    x: FloatArray | None
    free: FloatArray
    solved: bool
    status: str
    iterations: int | None = None
    duals: Mapping[str, FloatArray] = field(default_factory=dict)


@dataclass(frozen=True)
class _Start:
    """What a solve was given to start from; arguments of `solve`."""

    point: FloatArray | None
    guess: FloatArray | None
    weights: tuple[float, float] | None
    multipliers: Mapping[str, FloatArray] | None
    most_iterations: int | None

    def of(self, program: GaitProgram, solver: str) -> End:
        """Return what the torques start from: the point, the guess, or a posture path near it.

        Newton steps have exact second derivatives from the first one on and need no posture path
        but where weights ask for it. SNOPT and IPOPT know none at first and go astray from a guess
        that is not feasible: they take a posture path in any case.
        """
        if self.point is not None:
            return _without_steps(self.point, "given")
        guess = program.guess() if self.guess is None else self.guess
        weights = self.weights
        if weights is None and solver != "newton":
            weights = POSTURE
        if weights is None:
            return _without_steps(guess, "guess")
        return posture_path(program, solver, guess, weights)


def _without_steps(free: FloatArray, status: str) -> End:
    """Return control points as they are, where no solver has been."""
    return End(None, free, True, status, iterations=0)


def solve(  # noqa: PLR0913, options that are given by name
    program: GaitProgram,
    solver: str = "newton",
    start: FloatArray | None = None,
    tell: Callable[[Iterate], None] | None = None,
    guess: FloatArray | None = None,
    weights: tuple[float, float] | None = None,
    multipliers: Mapping[str, FloatArray] | None = None,
    *,
    most_iterations: int | None = None,
    time_limit: float | None = TIME_LIMIT,
) -> Solution:
    """Solve a program.

    Parameters
    ----------
    program : GaitProgram
    solver : str
        One of ``SOLVERS``.
    start : (m * 55,) array, optional
        Free control points that the torques start from; by default the guess for ``newton`` and
        a posture path for the others.
    tell : function, optional
        Is given every evaluated point.
    guess : (m * 55,) array, optional
        Free control points to use instead of the program's own guess.
    weights : tuple of float, optional
        Of the posture path, as in ``POSTURE``; with them ``newton`` takes one too.
    multipliers : mapping of str to array, optional
        Of a walk like this one (`Solution.multipliers`), whose control points are the start: for
        ``newton``, which then starts warm. BLAS uses one thread while a program is solved.
    most_iterations : int, optional
        After which ``newton`` gives up.
    time_limit : float or None, [s]
        When it ends at the latest; None for never. As a part of a prediction it has the limit of
        that.

    Returns
    -------
    Solution
        Also when the solver fails, is interrupted (Ctrl-C) or has no time left: then with its best
        point.

    Raises
    ------
    KeyboardInterrupt
        If it is interrupted before there is anything to keep.
    ValueError
        If there is no such solver or time limit.
    UnsupportedProgram
        If something was added to the program that the solver cannot honour.
    """
    if solver not in SOLVERS:
        raise ValueError(f"no solver is called {solver!r}: choose one of {', '.join(SOLVERS)}")
    if not isinstance(program, GaitProgram):
        raise TypeError(f"a program is solved, from build_program, not a {type(program).__name__}")
    refuse(program.torques.prog, solver)
    if missing := program.torques.missing():
        raise UnsupportedProgram(
            f"the program lacks {', '.join(map(repr, missing))}: constraints of a walk cannot be "
            "taken out, the scenario's tolerances and limits widen them"
        )
    # matrices of some hundred rows are done before more threads have started
    limit = checked_limit(time_limit) if outermost() else None
    with watched(program, tell, limit) as watch, threadpool_limits(1, "blas"):
        given = _Start(start, guess, weights, multipliers, most_iterations)
        return _stages(program, solver, watch, given)


def posture(program: GaitProgram, tell: Callable[[Iterate], None] | None = None) -> FloatArray:
    """Return the posture path that the torque stage starts from first, (m * 55,), by SNOPT.

    Where there is no time for all of it, as far as it came.

    Raises
    ------
    KeyboardInterrupt
        If it is interrupted: there is nothing to keep yet.
    """
    with watched(program, tell) as watch:
        try:
            path = posture_path(program, "snopt", program.guess(), POSTURE).free
        except (Interrupted, RuntimeError):  # Drake turns an exception in SNOPT into a RuntimeError
            if not watch.left:
                raise
            path = watch.best.free if watch.best else program.guess()
    if watch.run.asked.signal:  # at any time, also after the last evaluation
        raise KeyboardInterrupt
    return path


def posture_path(
    program: GaitProgram, solver: str, guess: FloatArray, weights: tuple[float, float]
) -> End:
    """Return a posture path near a guess, feasible or nearly so."""
    easier = program.posture(guess, *weights)
    return run_stage(program, easier, solver, guess, POSTURE_OPTIONS[solver])


def run_stage(
    program: GaitProgram,
    stage: Stage,
    solver: str,
    start: FloatArray,
    options: Mapping[str, Any] | None = None,
    multipliers: Mapping[str, FloatArray] | None = None,
) -> End:
    """Return where a solver ends from free control points; the variables are parts of the unit."""
    prog = stage.prog
    x = stage.point(start / program.unit)
    warm = program.duals(multipliers) if multipliers else None
    result = solve_program(prog, solver, x, options, warm)
    status, iterations = status_of(result)
    free = np.asarray(result.GetSolution(stage.variables)) * program.unit
    solved, duals = result.is_success(), duals_of(prog, result, stage.own)
    return End(np.asarray(result.get_x_val()), free, solved, status, iterations, duals)


def _stages(program: GaitProgram, solver: str, watch: Watch, given: _Start) -> Solution:
    try:
        before = given.of(program, solver)
        watch.stage = "torque"
        options = _options(program, solver)
        if solver == "newton" and given.most_iterations is not None:
            options["most_iterations"] = given.most_iterations
        end = run_stage(program, program.torques, solver, before.free, options, given.multipliers)
        if end.iterations is not None and before.iterations is not None:
            end = replace(end, iterations=before.iterations + end.iterations)
    except (Interrupted, RuntimeError):  # Drake turns an exception in SNOPT into a RuntimeError
        if not watch.left:
            raise
        if watch.best is None:  # asked to stop before there was anything to keep
            raise KeyboardInterrupt from None
        end = before = End(None, watch.best.free, False, watch.left)
    return _solution(program, solver, end, watch, before.free)


def _options(program: GaitProgram, solver: str) -> dict[str, Any]:
    """Return the options of a formulation; those of the MathematicalProgram go before them."""
    own = OWN_OPTIONS.get((program.scenario.objective.formulation, solver), {})
    return {**own, **program.torques.prog.solver_options().options.get(solver, {})}


def _solution(
    program: GaitProgram, solver: str, end: End, watch: Watch, start: FloatArray
) -> Solution:
    free, wall_time, status = end.free, watch.elapsed, end.status
    iterations = watch.count if end.iterations is None else end.iterations
    program.functions.observe = None
    try:
        violations, cost = _judged(program, end)
        feasible = _largest(violations) <= FEASIBLE
    except (np.linalg.LinAlgError, ValueError):  # no numbers, or a pose that cannot be computed
        free, cost, feasible = start, program.total_cost(start), False
        violations = program.violations(start)
    if not feasible and watch.best is not None:
        free, cost = watch.best.free, watch.best.cost
        violations = program.violations(free)
    converged = end.solved and feasible
    found = {"solver": solver, "status": status, "cost": cost, "wall_time_s": wall_time}
    return Solution(
        program.gait(free, **found, **_own_cost(program, free, cost)),
        converged,
        bool(watch.run.asked.signal),
        solver,
        status,
        iterations,
        program.functions.evaluations,
        cost,
        wall_time,
        violations,
        program.multipliers(end.duals, free) if converged else {},
    )


def _judged(program: GaitProgram, end: End) -> tuple[list[Violation], float]:
    """Return the violations and the cost of an end, with those of what Drake's calls added.

    Raises
    ------
    ValueError
        If it is not a point of finite numbers.
    """
    if not np.all(np.isfinite(end.free)):
        raise ValueError("the solver ended at what is no number")
    return program.violations(end.free, end.x), program.total_cost(end.free, end.x)


def _own_cost(program: GaitProgram, free: FloatArray, cost: float) -> dict[str, float]:
    """Return what of a cost is of one's own, if any: no file has the functions that it is of."""
    scenarios = program.functions.cost(objective(program.scenario), free)[0]
    return {OWN_COST: cost - scenarios} if cost != scenarios else {}


def _largest(violations: list[Violation]) -> float:
    """Return the largest violation of any constraint, in the unit of that constraint."""
    return max(violation.value for violation in violations)
