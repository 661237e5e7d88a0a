"""Solve the program: by Newton steps, or with SNOPT or IPOPT through Drake.

``newton`` has exact second derivatives (`lagrangian`): an interior-point method from the guess as
it is (`interior_point`), or few steps from a walk like the one to be found (`active_set`). The
other two build up second derivatives from changes of the gradient on the way, and want a feasible
posture path first.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

from pydrake.solvers import (
    IpoptSolver,
    MathematicalProgram,
    SnoptSolver,
    SolverOptions,
)
from threadpoolctl import threadpool_limits

from human_gait.arrays import FloatArray
from human_gait.newton.active_set import follow
from human_gait.newton.interior_point import Goal, minimise
from human_gait.newton.nonlinear_program import Duals, End, NonlinearProgram
from human_gait.problem.lagrangian import Lagrangian
from human_gait.problem.program import GaitProgram, Stage
from human_gait.problem.violation import Violation
from human_gait.walk.gait import Gait

SOLVERS = ("newton", "snopt", "ipopt")
FEASIBLE = 1e-4
"""Largest violation, in the unit of its constraint, of an iterate that counts as feasible."""

_OPTIONS: dict[str, dict[str, Any]] = {
    "newton": {},  # those of `Goal`
    "snopt": {
        "Major feasibility tolerance": 1e-6,
        "Major optimality tolerance": 1e-4,
        "Major iterations limit": 500,
        "Iterations limit": 100_000,
        "Superbasics limit": 2_000,
        "Hessian updates": 50,
    },
    "ipopt": {
        "tol": 2e-2,
        "constr_viol_tol": 1e-6,
        "honor_original_bounds": "yes",  # else joint limits are exceeded by 1e-8
        "acceptable_iter": 0,
        "max_iter": 2_000,
        "hessian_approximation": "limited-memory",
        "limited_memory_max_history": 50,
        "nlp_scaling_method": "none",
        "mu_strategy": "adaptive",
    },
}
_FEW_VARIABLES = 400
"""Up to 9 control points `active_set` is quick: its quadratic programs are dense."""

_POSTURE_OPTIONS: dict[str, dict[str, Any]] = {
    "newton": {"stationary": 1e-2, "complementary": 1e-2, "most_iterations": 50},
    "snopt": {"Major optimality tolerance": 1e-1, "Major iterations limit": 25},
    "ipopt": {"tol": 1e-2, "max_iter": 50},
}
POSTURE = (1.0, 1e-1)
"""Weights of a posture path: staying near the guess [1/rad^2 s], moving gently [s^3/rad^2]."""

_SNOPT_STATUS = {
    1: "optimality conditions satisfied",
    2: "feasible point found",
    3: "requested accuracy could not be achieved",
    11: "infeasible linear constraints",
    13: "nonlinear infeasibilities minimized",
    14: "infeasibilities minimized",
    31: "iteration limit reached",
    32: "major iteration limit reached",
    41: "current point cannot be improved",
}


@dataclass(frozen=True)
class Iterate:
    """One evaluated point on the way.

    Attributes
    ----------
    stage : str
        ``posture`` or ``torque``.
    number : int
        How many points have been evaluated.
    elapsed : float, [s]
    cost : float, [N^2 m^2 s]
    worst : Violation
    free : (m * 55,) array
        Free control points.
    """

    stage: str
    number: int
    elapsed: float
    cost: float
    worst: Violation
    free: FloatArray

    @property
    def feasible(self) -> bool:
        """Whether every constraint is kept to within ``FEASIBLE``."""
        return self.worst.value <= FEASIBLE


@dataclass(frozen=True)
class Solution:
    """What the solver found.

    Attributes
    ----------
    gait : Gait
    converged : bool
        Whether the solver says that its point is feasible and optimal, and the point is feasible.
        SNOPT's 3 counts: optimal to within a hundred times its tolerance, and no nearer to be had.
    interrupted : bool
        Whether the user asked to stop; after the last evaluation that changes nothing else.
    solver, status : str
    iterations, evaluations : int
        Newton steps, or for the other solvers, which do not tell, points evaluated; times that the
        dynamics was evaluated.
    cost : float, [N^2 m^2 s]
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


class _Interrupted(Exception):
    """Leave the solver: the user wants to stop."""


class _Watch:
    """Follow a program through its evaluations: count, keep the best, tell, stop on request."""

    def __init__(self, program: GaitProgram, tell: Callable[[Iterate], None] | None) -> None:
        self.program, self.tell = program, tell
        self.started = time.perf_counter()
        self.stage = "posture"
        self.count = 0
        self.best: Iterate | None = None
        self.stop = False

    @property
    def elapsed(self) -> float:
        return time.perf_counter() - self.started

    def __call__(self, free: FloatArray) -> None:
        if self.stop:
            raise _Interrupted
        self.count += 1
        cost = self.program.cost(free)[0]
        worst = max(self.program.violations(free), key=lambda violation: violation.value)
        now = Iterate(self.stage, self.count, self.elapsed, cost, worst, free.copy())
        if self.best is None or _rank(now) < _rank(self.best):
            self.best = now
        if self.tell:
            self.tell(now)


@dataclass(frozen=True)
class _End:
    """Where a solver ended: a point, whether it is content, what it says, duals by constraint."""

    free: FloatArray
    solved: bool
    status: str
    iterations: int | None = None
    duals: Mapping[str, FloatArray] = field(default_factory=dict)


@dataclass(frozen=True)
class _Start:
    """What a solve was given to start from."""

    point: FloatArray | None
    guess: FloatArray | None
    weights: tuple[float, float] | None
    multipliers: Mapping[str, FloatArray] | None

    def of(self, program: GaitProgram, solver: str) -> _End:
        """Return what the torques start from."""
        if self.point is not None:
            return _End(self.point, True, "given", 0)
        guess = program.guess() if self.guess is None else self.guess
        weights = self.weights if solver == "newton" else self.weights or POSTURE
        if weights is None:
            return _End(guess, True, "guess", 0)
        return _posture(program, solver, guess, weights)


def solve(
    program: GaitProgram,
    solver: str = "newton",
    start: FloatArray | None = None,
    tell: Callable[[Iterate], None] | None = None,
    guess: FloatArray | None = None,
    weights: tuple[float, float] | None = None,
    multipliers: Mapping[str, FloatArray] | None = None,
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

    Returns
    -------
    Solution
        Also when the solver fails or is interrupted (Ctrl-C): then with its best point.

    Raises
    ------
    ValueError
        If there is no such solver.
    """
    if solver not in SOLVERS:
        raise ValueError(f"no solver is called {solver!r}: choose one of {', '.join(SOLVERS)}")
    watch = _Watch(program, tell)
    program.watched_by(watch)
    try:
        # matrices of some hundred rows are done before more threads have started
        with _interruptible(watch), threadpool_limits(1, "blas"):
            return _stages(program, solver, watch, _Start(start, guess, weights, multipliers))
    finally:
        program.observe = None


def posture(program: GaitProgram, tell: Callable[[Iterate], None] | None = None) -> FloatArray:
    """Return the posture path that the torque stage starts from first, (m * 55,), by SNOPT.

    Raises
    ------
    KeyboardInterrupt
        If it is interrupted: there is nothing to keep yet.
    """
    watch = _Watch(program, tell)
    program.watched_by(watch)
    try:
        with _interruptible(watch):
            path = _posture(program, "snopt", program.guess(), POSTURE).free
    except (_Interrupted, RuntimeError):  # Drake turns an exception in SNOPT into a RuntimeError
        if not watch.stop:
            raise
        raise KeyboardInterrupt from None
    finally:
        program.observe = None
    if watch.stop:  # asked for after the last evaluation
        raise KeyboardInterrupt
    return path


def _stages(program: GaitProgram, solver: str, watch: _Watch, given: _Start) -> Solution:
    try:
        before = given.of(program, solver)
        watch.stage = "torque"
        end = _run(program, program.torques, solver, before.free, {}, given.multipliers)
        if end.iterations is not None and before.iterations is not None:
            end = replace(end, iterations=before.iterations + end.iterations)
    except (_Interrupted, RuntimeError):  # Drake turns an exception in SNOPT into a RuntimeError
        if not watch.stop:
            raise
        if watch.best is None:  # asked to stop before there was anything to keep
            raise KeyboardInterrupt from None
        end = _End(watch.best.free, False, "interrupted")
    return _solution(program, solver, end, watch)


def _posture(
    program: GaitProgram, solver: str, guess: FloatArray, weights: tuple[float, float]
) -> _End:
    """Return a posture path near a guess, feasible or nearly so."""
    easier = program.posture(guess, *weights)
    return _run(program, easier, solver, guess, _POSTURE_OPTIONS[solver])


def _run(
    program: GaitProgram,
    stage: Stage,
    solver: str,
    start: FloatArray,
    changes: dict[str, Any],
    multipliers: Mapping[str, FloatArray] | None = None,
) -> _End:
    """Return where a solver ends from free control points; the variables are parts of the unit."""
    x = start / program.unit
    if solver == "newton":
        end = _by_newton(Lagrangian(program, stage), x, changes, multipliers)
    else:
        end = _by_drake(stage.prog, solver, x, changes)
    return replace(end, free=end.free * program.unit)


def _by_newton(
    lagrangian: Lagrangian,
    start: FloatArray,
    changes: dict[str, Any],
    multipliers: Mapping[str, FloatArray] | None,
) -> _End:
    problem, goal = lagrangian.problem(), Goal(**{**_OPTIONS["newton"], **changes})
    if not multipliers:
        end, before = minimise(problem, start, goal), 0
    else:
        duals = lagrangian.from_names(lagrangian.program.duals(multipliers))
        end, before = _warm(problem, start, duals, goal)
    steps = before + end.iterations
    return _End(end.x, end.solved, end.status, steps, lagrangian.by_name(end.duals))


def _warm(
    problem: NonlinearProgram, start: FloatArray, duals: Duals, goal: Goal
) -> tuple[End, int]:
    """Return where the active set leads, else where a low barrier does, and steps in vain."""
    spent = 0
    if len(start) <= _FEW_VARIABLES:
        end = follow(problem, start, duals)
        if end.solved:
            return end, 0
        spent = end.iterations
    return minimise(problem, start, goal, duals), spent


def _by_drake(
    prog: MathematicalProgram, solver: str, start: FloatArray, changes: dict[str, Any]
) -> _End:
    engine = SnoptSolver() if solver == "snopt" else IpoptSolver()
    options = SolverOptions()
    for name, value in {**_OPTIONS[solver], **changes}.items():
        options.SetOption(engine.solver_id(), name, value)
    result = engine.Solve(prog, start, options)
    details, solved = result.get_solver_details(), result.is_success()
    status = _snopt_status(details.info) if solver == "snopt" else details.ConvertStatusToString()
    bindings = prog.GetAllConstraints() if solved else []
    duals = {b.evaluator().get_description(): result.GetDualSolution(b) for b in bindings}
    return _End(result.GetSolution(prog.decision_variables()), solved, status, None, duals)


def _snopt_status(info: int) -> str:
    return f"{info}: {_SNOPT_STATUS.get(info, 'see the manual of SNOPT')}"


def _solution(program: GaitProgram, solver: str, end: _End, watch: _Watch) -> Solution:
    free, wall_time = end.free, watch.elapsed
    iterations = watch.count if end.iterations is None else end.iterations
    program.observe = None
    violations, (cost, _) = program.violations(free), program.cost(free)
    feasible = _largest(violations) <= FEASIBLE
    if not feasible and watch.best is not None:
        free, cost = watch.best.free, watch.best.cost
        violations = program.violations(free)
    converged = end.solved and feasible
    return Solution(
        program.gait(free, solver=solver, status=end.status, cost=cost, wall_time_s=wall_time),
        converged,
        watch.stop,
        solver,
        end.status,
        iterations,
        program.evaluations,
        cost,
        wall_time,
        violations,
        program.multipliers(end.duals, free) if converged else {},
    )


def _largest(violations: list[Violation]) -> float:
    """Return the largest violation of any constraint, in the unit of that constraint."""
    return max(violation.value for violation in violations)


def _rank(iterate: Iterate) -> tuple[float, float]:
    """Return what is smaller for a better iterate: violation first, then cost."""
    return max(iterate.worst.value, FEASIBLE), iterate.cost


@contextmanager
def _interruptible(watch: _Watch) -> Iterator[None]:
    """Let Ctrl-C stop the solver at its next evaluation instead of killing the process."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def ask_to_stop(*_: object) -> None:
        watch.stop = True

    before = signal.signal(signal.SIGINT, ask_to_stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
