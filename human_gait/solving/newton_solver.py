"""Newton steps as a solver of MathematicalPrograms, beside Drake's own SNOPT and IPOPT.

Second derivatives are exact where evaluators offer them. From nothing it is an interior-point
method (`newton.interior_point`); from the solution of a program like this one, with its duals, few
steps of sequential quadratic programming (`newton.active_set`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from pydrake.solvers import (
    Binding,
    MathematicalProgram,
    SolutionResult,
    SolverId,
    SolverInterface,
    SolverOptions,
)
from pydrake.symbolic import Expression, Variable

from human_gait.arrays import FloatArray
from human_gait.newton.active_set import follow
from human_gait.newton.barrier import COLD, Schedule
from human_gait.newton.interior_point import LIMIT_REACHED, NO_ROOM, OPTIMAL, minimise
from human_gait.newton.nonlinear_program import Duals, End, NonlinearProgram
from human_gait.newton.optimality import Goal
from human_gait.newton.sensitivity import Moved, by_active_set, by_barrier
from human_gait.solving.mathematical_program import ProgramFunctions, binding_key, unsupported

NAME = "newton"
_STAGES = {
    "first_barrier": "first",
    "patience": "patience",
    "start_push": "push",
    "start_share": "share",
}
"""Options of a cold start, and what of its `Schedule` they are."""
_FEW_VARIABLES = 400
"""Up to 9 control points `active_set` is quick: its quadratic programs are dense."""

_RESULTS = {
    OPTIMAL: SolutionResult.kSolutionFound,
    LIMIT_REACHED: SolutionResult.kIterationLimit,
    NO_ROOM: SolutionResult.kInfeasibleConstraints,
}


@dataclass(frozen=True)
class NewtonDetails:
    """What a solve tells besides its solution.

    Attributes
    ----------
    status : str
        In words.
    iterations : int
        Newton steps.
    """

    status: str
    iterations: int


class NewtonResult:
    """Where a solve ended; methods are called like those of Drake's MathematicalProgramResult."""

    def __init__(self, prog: MathematicalProgram, functions: ProgramFunctions, end: End) -> None:
        self._variables = prog.decision_variables()
        self._index = {variable.get_id(): i for i, variable in enumerate(self._variables)}
        self._x, self._end = end.x, end
        self._cost = _cost(functions, end.x)
        self._duals = functions.duals_by_binding(end.duals)

    def is_success(self) -> bool:
        """Return whether the point is feasible and optimal."""
        return self._end.solved

    def get_solution_result(self) -> SolutionResult:
        """Return the outcome as Drake names it."""
        success = SolutionResult.kSolutionFound
        other = _RESULTS.get(self._end.status, SolutionResult.kSolverSpecificError)
        return success if self._end.solved else other

    def get_solver_id(self) -> SolverId:
        """Return the id of ``newton``."""
        return NewtonSolver.id()

    def get_solver_details(self) -> NewtonDetails:
        """Return status and iterations."""
        return NewtonDetails(self._end.status, self._end.iterations)

    def get_x_val(self) -> FloatArray:
        """Return all decision variables (n,)."""
        return self._x

    def get_optimal_cost(self) -> float:
        """Return the cost at the point."""
        return self._cost

    def GetSolution(self, variables: Any = None) -> Any:  # noqa: N802, Drake's name
        """Return the values of some variables, in the shape that they are given; of all by default.

        Raises
        ------
        KeyError
            If one is no decision variable of the program.
        """
        if variables is None:
            return self._x
        if isinstance(variables, Variable | Expression):
            return self._value(variables)
        given = np.asarray(variables, dtype=object)
        return np.array([self._value(one) for one in given.flat]).reshape(given.shape)

    def _value(self, one: Variable | Expression) -> float:
        """Return the value of a variable or of an expression of variables."""
        if isinstance(one, Variable):
            return float(self._x[self._index[one.get_id()]])
        return float(
            one.Evaluate({v: self._x[self._index[v.get_id()]] for v in one.GetVariables()})
        )

    def GetDualSolution(self, binding: Binding) -> FloatArray:  # noqa: N802, Drake's name
        """Return d cost / d bound (m,) of a constraint, positive where a lower bound holds it.

        Raises
        ------
        KeyError
            If the constraint is not in the program.
        """
        return self._duals[binding_key(binding)]


class NewtonSolver(SolverInterface):  # type: ignore[misc]  # Drake's classes have no types
    """Newton steps with exact second derivatives, in the words of Drake's solvers.

    ``Solve(prog, initial_guess, solver_options)`` takes linear, quadratic and generic costs and
    constraints, bounding boxes and second-order cones. Options, set for ``NewtonSolver.id()``, are
    those of `newton.optimality.Goal`, and of a cold start those of `newton.barrier.Schedule`:
    ``first_barrier``, ``patience``, ``start_push``, ``start_share``. Drake lets Python fill no
    MathematicalProgramResult with duals; therefore the result is of a class of its own with the
    same methods.

    Parameters
    ----------
    duals : mapping of str to array, optional
        d cost / d bound by description of the constraint, of a program like the one to be solved
        whose solution is the initial guess: a warm start.
    """

    def __init__(self, duals: Mapping[str, FloatArray] | None = None) -> None:
        SolverInterface.__init__(self)
        self._warm = dict(duals or {})

    @staticmethod
    def id() -> SolverId:
        """Return the id of the solver."""
        return SolverId(NAME)

    def solver_id(self) -> SolverId:
        """Return the id of the solver."""
        return self.id()

    def SolverName(self) -> str:  # noqa: N802, Drake's name
        """Return ``newton``."""
        return NAME

    def available(self) -> bool:
        """Return True: it comes with this package."""
        return True

    def enabled(self) -> bool:
        """Return True: it needs no licence."""
        return True

    def AreProgramAttributesSatisfied(self, prog: MathematicalProgram) -> bool:  # noqa: N802
        """Return whether everything in a program can be honoured."""
        return unsupported(prog) is None

    def ExplainUnsatisfiedProgramAttributes(self, prog: MathematicalProgram) -> str:  # noqa: N802
        """Return what cannot be honoured; nothing if all can."""
        return unsupported(prog) or ""

    def Solve(  # noqa: N802, Drake's name
        self,
        prog: MathematicalProgram,
        initial_guess: FloatArray | None = None,
        solver_options: SolverOptions | None = None,
    ) -> NewtonResult:
        """Minimise from a guess.

        Parameters
        ----------
        prog : MathematicalProgram
        initial_guess : (n,) array, optional
            By default that of the program, 0 where it has none.
        solver_options : SolverOptions, optional
            Besides those of the program.

        Returns
        -------
        NewtonResult
            Solved or not.

        Raises
        ------
        UnsupportedProgram
            If something in the program cannot be honoured.
        ValueError
            On an unknown option, or a guess of another size.
        """
        functions = ProgramFunctions(prog)
        guess = prog.initial_guess() if initial_guess is None else initial_guess
        start = np.nan_to_num(np.asarray(guess, dtype=float).ravel())
        if len(start) != functions.n:
            raise ValueError(f"a guess of {len(start)} numbers for {functions.n} variables")
        problem, (goal, cold) = functions.problem(), _wanted(prog, solver_options)
        if not self._warm:
            end = minimise(problem, start, goal, cold=cold)
        else:
            end = _warm(problem, start, functions.duals_from_names(self._warm), goal, cold)
        return NewtonResult(prog, functions, end)


def one_step(
    prog: MathematicalProgram, start: FloatArray, duals: Mapping[str, FloatArray]
) -> Moved | None:
    """Return where one step leads from the solution of a program like this one.

    Parameters
    ----------
    prog : MathematicalProgram
    start : (n,) array
    duals : mapping of str to array
        As `NewtonSolver`.
    """
    functions = ProgramFunctions(prog)
    problem, given = functions.problem(), functions.duals_from_names(duals)
    found = by_active_set(problem, start, given) if len(start) <= _FEW_VARIABLES else None
    return found or by_barrier(problem, start, given)


def _cost(functions: ProgramFunctions, x: FloatArray) -> float:
    """Return the cost at a point, infinite where it cannot be computed."""
    try:
        return functions.cost(x)
    except np.linalg.LinAlgError:  # a pose at the end of its coordinates
        return np.inf


def _wanted(prog: MathematicalProgram, options: SolverOptions | None) -> tuple[Goal, Schedule]:
    """Return what options ask for, those of the call before those of the program."""
    given: dict[str, Any] = {}
    for source in (prog.solver_options(), options):
        given |= source.options.get(NAME, {}) if source else {}
    known = [*(item.name for item in fields(Goal)), *_STAGES]
    for name in given:
        if name not in known:
            raise ValueError(f"newton has no option {name!r}: it has {', '.join(known)}")
    own = {_STAGES[name]: given.pop(name) for name in _STAGES if name in given}
    return Goal(**given), COLD._replace(**own)


def _warm(
    problem: NonlinearProgram, start: FloatArray, duals: Duals, goal: Goal, cold: Schedule
) -> End:
    """Return where the active set leads, else where a low barrier does; all steps counted."""
    spent = 0
    usual = replace(Goal(), most_iterations=goal.most_iterations)
    if len(start) <= _FEW_VARIABLES and goal == usual:  # it has a goal of its own
        end = follow(problem, start, duals)
        if end.solved:
            return end
        spent = end.iterations
    end = minimise(problem, start, goal, duals, cold)
    return End(end.x, end.duals, end.solved, end.status, spent + end.iterations)
