"""A stage of the program with exact first and second derivatives, for Newton steps.

Bounds, linear rows and quadratic costs are read from Drake's MathematicalProgram. What Drake knows
as a function only, the torques and the nonlinear rows, comes from the program itself, as sparse
entries and with second derivatives.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import vstack

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import N_DOF
from human_gait.newton.nonlinear_program import Duals, NonlinearProgram
from human_gait.problem.constraints import LIMITS
from human_gait.problem.program import GaitProgram, Stage


class Lagrangian:
    """Cost and rows of one stage in Drake's variables.

    The rows are those of the nonlinear constraints, then those of the linear ones.

    Parameters
    ----------
    program : GaitProgram
    stage : Stage
        Of the program.
    """

    def __init__(self, program: GaitProgram, stage: Stage) -> None:
        prog = stage.prog
        self.program, self.stage = program, stage
        self.curved = [c for c in stage.constraints if not c.linear]
        self.linear = [*prog.linear_constraints(), *prog.linear_equality_constraints()]
        self.bindings = [*prog.generic_constraints(), *self.linear]
        self._n = prog.num_vars()
        self._ends = np.cumsum([len(c.lower) for c in self.curved])
        self._matrix = vstack([b.evaluator().get_sparse_A() for b in self.linear], format="csr")
        self._Q, self._b = self._quadratic()
        self._rows, self._columns = self._jacobian_entries()
        self._hessian_entries = _upper(program.transcription.coupled())

    def problem(self) -> NonlinearProgram:
        """Return the stage as plain functions of its variables."""
        (box,) = self.stage.prog.bounding_box_constraints()
        bounds = [(b.evaluator().lower_bound(), b.evaluator().upper_bound()) for b in self.bindings]
        lower, upper = (np.concatenate(side) for side in zip(*bounds, strict=True))
        linear = self._matrix.tocoo()
        rows = np.concatenate([self._rows, self._ends[-1] + linear.row])
        columns = np.concatenate([self._columns, linear.col])
        return NonlinearProgram(
            box.evaluator().lower_bound(),
            box.evaluator().upper_bound(),
            lower,
            upper,
            self.cost,
            self.gradient,
            self.rows,
            (rows, columns),
            lambda x: np.concatenate([self.jacobian(x), linear.data]),
            self._hessian_entries,
            self.hessian,
        )

    def cost(self, x: FloatArray) -> float:
        """Return the cost, torques and quadratic part."""
        value = float(x @ self._Q @ x / 2 + self._b @ x)
        if self.stage.cost_factor:
            value += self.stage.cost_factor * self.program.cost(self._free(x))[0]
        return value

    def gradient(self, x: FloatArray) -> FloatArray:
        """Return the gradient (n,) of the cost."""
        slope = self._Q @ x + self._b
        if self.stage.cost_factor:
            by_free = self.program.cost(self._free(x))[1]
            slope += self.stage.cost_factor * self.program.unit * by_free
        return slope

    def rows(self, x: FloatArray) -> FloatArray:
        """Return all rows (m,)."""
        free = self._free(x)
        curved = [self.program.rows(constraint, free).value for constraint in self.curved]
        return np.concatenate([*curved, self._matrix @ x])

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Return the entries of the nonlinear rows' Jacobian."""
        free, values = self._free(x), self.program.transcription.values
        entries = [values(c, self.program.rows(c, free)) for c in self.curved]
        return np.concatenate(entries) * self.program.unit[self._columns]

    def hessian(self, x: FloatArray, factor: float, multipliers: FloatArray) -> FloatArray:
        """Return the upper entries of the second derivatives of factor * cost + the rows'."""
        by_constraint = np.split(multipliers, self._ends)
        leaning = zip(self.curved, by_constraint[:-1], strict=True)
        weight = factor * self.stage.cost_factor
        second = self.program.hessian(self._free(x), weight, leaning)
        rows, columns = self._hessian_entries
        unit = self.program.unit
        scaled = second[rows, columns] * unit[rows] * unit[columns]
        return scaled if self.stage.cost_factor else scaled + factor * self._Q[rows, columns]

    def by_name(self, duals: Duals) -> dict[str, FloatArray]:
        """Return duals by name of their constraint, in Drake's sign: d cost / d bound."""
        names = [binding.evaluator().get_description() for binding in self.bindings]
        sizes = [binding.evaluator().num_constraints() for binding in self.bindings]
        parts = np.split(-duals.rows, np.cumsum(sizes)[:-1])
        return {**dict(zip(names, parts, strict=True)), LIMITS.name: -duals.variables}

    def from_names(self, prices: dict[str, FloatArray]) -> Duals:
        """Return duals from those `by_name`; 0 for rows that have none."""
        found = []
        for binding in self.bindings:
            rows = binding.evaluator()
            none = np.zeros(rows.num_constraints())
            found.append(-prices.get(rows.get_description(), none))
        return Duals(np.concatenate(found), -prices.get(LIMITS.name, np.zeros(self._n)))

    def _free(self, x: FloatArray) -> FloatArray:
        return x * self.program.unit

    def _quadratic(self) -> tuple[FloatArray, FloatArray]:
        """Return Q and b of the quadratic costs x^T Q x / 2 + b^T x."""
        Q, b = np.zeros((self._n, self._n)), np.zeros(self._n)
        for binding in self.stage.prog.quadratic_costs():
            Q += binding.evaluator().Q()
            b += binding.evaluator().b()
        return Q, b

    def _jacobian_entries(self) -> tuple[IntArray, IntArray]:
        """Return rows and columns of the nonlinear rows' entries."""
        entries = [self.program.transcription.entries(c) for c in self.curved]
        first = np.concatenate([[0], self._ends[:-1]])
        rows = [start + rows for start, (rows, _) in zip(first, entries, strict=True)]
        return np.concatenate(rows), np.concatenate([columns for _, columns in entries])


def _upper(coupled: npt.NDArray[np.bool_]) -> tuple[IntArray, IntArray]:
    """Return the entries of the upper triangle where control points (m, m) are coupled."""
    all_dof = np.ones((N_DOF, N_DOF), dtype=bool)
    rows, columns = np.nonzero(np.triu(np.kron(coupled, all_dof)))
    return rows, columns
