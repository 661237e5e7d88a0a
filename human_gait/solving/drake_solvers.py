"""SNOPT and IPOPT through Drake, and ``newton`` beside them: one way to solve a program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from pydrake.solvers import (
    Binding,
    EvaluatorBase,
    IpoptSolver,
    MathematicalProgram,
    SnoptSolver,
    SolverId,
    SolverOptions,
)

from human_gait.arrays import FloatArray
from human_gait.exceptions import UnsupportedProgram
from human_gait.problem.drake import tell_sparsity
from human_gait.solving.newton_solver import NewtonDetails, NewtonSolver

SOLVERS = ("newton", "snopt", "ipopt")

OPTIONS: dict[str, dict[str, Any]] = {
    "newton": {},  # those of `optimality.Goal`
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


class Result(Protocol):
    """Where a solver ended: what NewtonResult and Drake's MathematicalProgramResult share."""

    def is_success(self) -> bool:
        """Return whether the point is feasible and optimal."""

    def get_x_val(self) -> FloatArray:
        """Return all decision variables (n,)."""

    def get_optimal_cost(self) -> float:
        """Return the cost at the point."""

    def get_solver_id(self) -> SolverId:
        """Return who solved."""

    def get_solver_details(self) -> Any:
        """Return what else the solver tells."""

    def GetSolution(self, variables: Any) -> Any:  # noqa: N802, Drake's name
        """Return the values of variables."""

    def GetDualSolution(self, binding: Binding) -> FloatArray:  # noqa: N802, Drake's name
        """Return d cost / d bound (m,) of a constraint."""


def engine(
    solver: str, duals: Mapping[str, FloatArray] | None = None
) -> NewtonSolver | SnoptSolver | IpoptSolver:
    """Return a solver by its name; duals are for a warm start of ``newton``."""
    if solver == "newton":
        return NewtonSolver(duals)
    return SnoptSolver() if solver == "snopt" else IpoptSolver()


def solve_program(
    prog: MathematicalProgram,
    solver: str,
    start: FloatArray,
    options: Mapping[str, Any] | None = None,
    duals: Mapping[str, FloatArray] | None = None,
) -> Result:
    """Solve a program from a start with a solver's usual options and changes of them.

    Raises
    ------
    UnsupportedProgram
        If something in the program cannot be honoured by the solver: what, and who can.
    """
    refuse(prog, solver)
    if solver != "newton":
        tell_sparsity(prog)
    chosen, wanted = engine(solver, duals), SolverOptions()
    own = prog.solver_options().options.get(chosen.solver_id().name(), {})
    for name, value in {**OPTIONS[solver], **own, **(options or {})}.items():
        wanted.SetOption(chosen.solver_id(), name, value)
    result: Result = chosen.Solve(prog, start, wanted)
    return result


def refuse(prog: MathematicalProgram, solver: str) -> None:
    """Raise UnsupportedProgram if a solver cannot honour everything in a program."""
    if engine(solver).AreProgramAttributesSatisfied(prog):
        return
    able = [name for name in SOLVERS if engine(name).AreProgramAttributesSatisfied(prog)]
    who = f"; {' and '.join(able)} can" if able else "; no solver here can"
    raise UnsupportedProgram(engine(solver).ExplainUnsatisfiedProgramAttributes(prog) + who)


def status_of(result: Result) -> tuple[str, int | None]:
    """Return what a solver says of its end, and its iterations if it tells."""
    details = result.get_solver_details()
    if isinstance(details, NewtonDetails):
        return details.status, details.iterations
    if result.get_solver_id() == SnoptSolver.id():
        return f"{details.info}: {_SNOPT_STATUS.get(details.info, 'see the manual of SNOPT')}", None
    return str(details.ConvertStatusToString()), None


def duals_of(
    prog: MathematicalProgram, result: Result, only: Sequence[EvaluatorBase] | None = None
) -> dict[str, FloatArray]:
    """Return d cost / d bound by description of the constraint; none if it is not solved.

    `only` are the evaluators to tell of, by default all: descriptions may not be unique.
    """
    if not result.is_success():
        return {}
    return {
        binding.evaluator().get_description(): np.asarray(result.GetDualSolution(binding))
        for binding in prog.GetAllConstraints()
        if only is None or binding.evaluator() in only
    }
