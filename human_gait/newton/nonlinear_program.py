"""A nonlinear program as plain functions of its variables, its multipliers, and where it ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from human_gait.arrays import FloatArray, IntArray
from human_gait.newton.matrix import Matrix


@dataclass(frozen=True)
class NonlinearProgram:
    """Minimise a cost subject to bounds of n variables and of m rows.

    Attributes
    ----------
    lower, upper : (n,) array
    row_lower, row_upper : (m,) array
    cost : function, x -> float
    gradient : function, x -> (n,) array
    rows : function, x -> (m,) array
    jacobian_entries : two int arrays
        Rows and columns of the entries that can differ from zero; what occurs twice is added.
    jacobian : function, x -> array
        The entries.
    hessian : function, (x, float, (m,) array, (m,) array) -> (n, n) array or Matrix
        Second derivatives of factor * cost + multipliers * rows, and J' diag(curvature) J of the
        rows' Jacobian J, in an array of their own.
    """

    lower: FloatArray
    upper: FloatArray
    row_lower: FloatArray
    row_upper: FloatArray
    cost: Callable[[FloatArray], float]
    gradient: Callable[[FloatArray], FloatArray]
    rows: Callable[[FloatArray], FloatArray]
    jacobian_entries: tuple[IntArray, IntArray]
    jacobian: Callable[[FloatArray], FloatArray]
    hessian: Callable[[FloatArray, float, FloatArray, FloatArray], FloatArray | Matrix]


@dataclass(frozen=True)
class Duals:
    """Multipliers of a point, positive at upper bounds that hold, negative at lower ones.

    Attributes
    ----------
    rows : (m,) array
    variables : (n,) array
    """

    rows: FloatArray
    variables: FloatArray


@dataclass(frozen=True)
class End:
    """Where a solver ended.

    Attributes
    ----------
    x : (n,) array
    duals : Duals
    solved : bool
    status : str
        In the solver's words.
    iterations : int
    """

    x: FloatArray
    duals: Duals
    solved: bool
    status: str
    iterations: int


@dataclass(frozen=True)
class Point:
    """The variables, the cost, and all that is bounded: variables, then rows, (n + m,)."""

    x: FloatArray
    cost: float
    bounded: FloatArray


@dataclass(frozen=True)
class Derivatives:
    """Gradient (n,) of the cost and sparse Jacobian (m, n) of the rows."""

    gradient: FloatArray
    jacobian: csr_array

    def slope(self, y: FloatArray) -> FloatArray:
        """Return the gradient (n,) of the Lagrangian with multipliers of all that is bounded."""
        n = len(self.gradient)
        return np.asarray(self.gradient + y[:n] + y[n:] @ self.jacobian, dtype=float)


class Stacked:
    """A nonlinear program, its variables and rows bounded alike.

    Attributes
    ----------
    n : int
    lower, upper : (n + m,) array
        Of the variables, then of the rows.
    """

    def __init__(self, problem: NonlinearProgram) -> None:
        self._problem, self.n = problem, len(problem.lower)
        self.lower = np.concatenate([problem.lower, problem.row_lower])
        self.upper = np.concatenate([problem.upper, problem.row_upper])
        rows, columns = problem.jacobian_entries
        order = np.argsort(rows, kind="stable")  # row by row; what occurs twice stays so
        self._order = order if np.any(np.diff(rows) < 0) else slice(None)
        self._columns = columns[order].astype(np.int32)
        ends = np.cumsum(np.bincount(rows, minlength=len(problem.row_lower)))
        self._starts = np.concatenate([[0], ends]).astype(np.int32)

    def point(self, x: FloatArray) -> Point:
        """Return cost and rows; an infinite cost where they cannot be computed."""
        try:
            cost, rows = self._problem.cost(x), self._problem.rows(x)
        except np.linalg.LinAlgError:  # a pose at the end of its coordinates
            return Point(x, np.inf, np.zeros_like(self.lower))
        point = Point(x, cost, np.concatenate([x, rows]))
        computed = np.isfinite(cost) and np.all(np.isfinite(point.bounded))
        return point if computed else Point(x, np.inf, np.zeros_like(self.lower))

    def excess(self, point: Point) -> FloatArray:
        """Return by how much each bound is exceeded, (n + m,)."""
        beyond = np.maximum(self.lower - point.bounded, point.bounded - self.upper)
        return np.asarray(np.maximum(beyond, 0.0), dtype=float)

    def derivatives(self, x: FloatArray) -> Derivatives:
        """Return gradient and Jacobian."""
        shape = len(self.lower) - self.n, self.n
        entries = np.asarray(self._problem.jacobian(x), dtype=float)[self._order]
        jacobian = csr_array((entries, self._columns, self._starts), shape=shape)
        return Derivatives(self._problem.gradient(x), jacobian)

    def hessian(
        self, x: FloatArray, by_row: FloatArray, curvature: FloatArray
    ) -> FloatArray | Matrix:
        """Return the second derivatives (n, n) of the Lagrangian, in an array of their own.

        J' diag(curvature) J is added, curvature (m,) being that of what else depends on the rows.
        """
        return self._problem.hessian(x, 1.0, by_row, curvature)
