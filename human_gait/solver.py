"""Solve the program with SNOPT or IPOPT: first a feasible posture path, then the torques."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from pydrake.solvers import (
    IpoptSolver,
    MathematicalProgram,
    MathematicalProgramResult,
    SnoptSolver,
    SolverOptions,
)

from human_gait.gait import Gait
from human_gait.program import GaitProgram, Violation

FloatArray = npt.NDArray[np.float64]

SOLVERS = ("snopt", "ipopt")
FEASIBLE = 1e-4
"""Largest violation, in the unit of its constraint, of an iterate that counts as feasible."""

_OPTIONS: dict[str, dict[str, Any]] = {
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
_POSTURE_OPTIONS: dict[str, dict[str, Any]] = {
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
        Points at which the solver had costs and gradients; times that the dynamics was evaluated.
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
        self.end: MathematicalProgramResult | None = None

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


def solve(
    program: GaitProgram,
    solver: str = "snopt",
    start: FloatArray | None = None,
    tell: Callable[[Iterate], None] | None = None,
    guess: FloatArray | None = None,
    weights: tuple[float, float] = POSTURE,
) -> Solution:
    """Solve a program.

    Parameters
    ----------
    program : GaitProgram
    solver : str
        ``snopt`` or ``ipopt``.
    start : (m * 55,) array, optional
        Free control points that the torques start from; by default the posture path.
    tell : function, optional
        Is given every evaluated point.
    guess : (m * 55,) array, optional
        Free control points that the posture path stays near; by default the program's own guess.
    weights : tuple of float
        Of the posture path, as in ``POSTURE``.

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
    program.observe, program.evaluations = watch, 0
    try:
        with _interruptible(watch):
            return _stages(program, solver, watch, start, (guess, weights))
    finally:
        program.observe = None


def posture(program: GaitProgram, tell: Callable[[Iterate], None] | None = None) -> FloatArray:
    """Return the posture path that the torque stage starts from first, (m * 55,), by SNOPT.

    Raises
    ------
    KeyboardInterrupt
        If it is interrupted: there is nothing to keep yet.
    """
    program.observe = watch = _Watch(program, tell)
    try:
        with _interruptible(watch):
            path = _posture(program, "snopt", None, POSTURE)
    except (_Interrupted, RuntimeError):  # Drake turns an exception in SNOPT into a RuntimeError
        if not watch.stop:
            raise
        raise KeyboardInterrupt from None
    finally:
        program.observe = None
    if watch.stop:  # asked for after the last evaluation
        raise KeyboardInterrupt
    return path


def _stages(
    program: GaitProgram,
    solver: str,
    watch: _Watch,
    start: FloatArray | None,
    near: tuple[FloatArray | None, tuple[float, float]],
) -> Solution:
    try:
        path = _posture(program, solver, *near) if start is None else start
        watch.stage = "torque"
        free, solved, status = _run(program.prog, solver, path, {}, program.unit, watch)
    except (_Interrupted, RuntimeError):  # Drake turns an exception in SNOPT into a RuntimeError
        if not watch.stop:
            raise
        if watch.best is None:  # asked to stop before there was anything to keep
            raise KeyboardInterrupt from None
        free, solved, status = watch.best.free, False, "interrupted"
    return _solution(program, solver, (free, solved, status), watch)


def _posture(
    program: GaitProgram, solver: str, guess: FloatArray | None, weights: tuple[float, float]
) -> FloatArray:
    """Return a posture path near a guess, (m * 55,), feasible or nearly so."""
    near = program.guess() if guess is None else guess
    easier = program.posture_program(near, *weights)
    return _run(easier, solver, near, _POSTURE_OPTIONS[solver], program.unit)[0]


def _run(
    prog: MathematicalProgram,
    solver: str,
    start: FloatArray,
    changes: dict[str, Any],
    unit: npt.ArrayLike = 1.0,
    watch: _Watch | None = None,
) -> tuple[FloatArray, bool, str]:
    """Return the point a solver ends at, whether it is content, and what it says.

    Points are in rad and m; the variables of the program are parts of `unit`. The result of Drake,
    which holds the multipliers, is left with the watch.
    """
    engine = SnoptSolver() if solver == "snopt" else IpoptSolver()
    options = SolverOptions()
    for name, value in {**_OPTIONS[solver], **changes}.items():
        options.SetOption(engine.solver_id(), name, value)
    result = engine.Solve(prog, start / np.asarray(unit), options)
    if watch:
        watch.end = result
    details = result.get_solver_details()
    status = _snopt_status(details.info) if solver == "snopt" else details.ConvertStatusToString()
    return result.GetSolution(prog.decision_variables()) * unit, result.is_success(), status


def _snopt_status(info: int) -> str:
    return f"{info}: {_SNOPT_STATUS.get(info, 'see the manual of SNOPT')}"


def _solution(
    program: GaitProgram, solver: str, end: tuple[FloatArray, bool, str], watch: _Watch
) -> Solution:
    free, solved, status = end
    wall_time, iterations = watch.elapsed, watch.count
    program.observe = None
    violations, (cost, _) = program.violations(free), program.cost(free)
    feasible = _largest(violations) <= FEASIBLE
    if not feasible and watch.best is not None:
        free, cost = watch.best.free, watch.best.cost
        violations = program.violations(free)
    converged = solved and feasible
    return Solution(
        program.gait(free, solver=solver, status=status, cost=cost, wall_time_s=wall_time),
        converged,
        watch.stop,
        solver,
        status,
        iterations,
        program.evaluations,
        cost,
        wall_time,
        violations,
        program.multipliers(watch.end) if converged and watch.end else {},
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
