"""What a function can offer to Newton steps: entries of its Jacobian, second derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, Protocol, Self, TypeVar

import numpy as np
from scipy.sparse import csr_array

from human_gait.arrays import FloatArray, IntArray
from human_gait.newton.matrix import Matrix, Sparse

Member = TypeVar("Member")


class Weighted(NamedTuple, Generic[Member]):
    """A member of a family, and what depends on its rows.

    Attributes
    ----------
    member : function
    multipliers : (m,) array
        Derivatives by the rows, y.
    curvature : (m,) array
        Second derivatives by each row, s; none negative.
    """

    member: Member
    multipliers: FloatArray
    curvature: FloatArray


class Family(Protocol):
    """Functions of the same variables whose derivatives are computed in one pass."""

    def cost(self, x: FloatArray, members: Sequence[Any]) -> float:
        """Return the sum of members of one row each."""

    def gradient(self, x: FloatArray, members: Sequence[Any]) -> FloatArray:
        """Return the gradient (n,) of the sum of members of one row each."""

    def hessian(self, x: FloatArray, weighted: Sequence[Weighted[Any]]) -> FloatArray | Matrix:
        """Return the second derivatives (n, n) of functions of the members' rows c.

        A function with the derivatives y and the second derivatives diag(s) by the rows has

            sum over rows of y c'' + J' diag(s) J .

        Parameters
        ----------
        x : (n,) array
        weighted : sequence of Weighted
            Members of the family, each with y and s.
        """


class SecondOrder(Protocol):
    """A function of n variables, x -> (m,), with exact derivatives."""

    @property
    def family(self) -> Family:
        """What computes its second derivatives, with those of other functions."""

    @property
    def entries(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the Jacobian that can differ from zero; those met twice are added."""

    def value(self, x: FloatArray) -> FloatArray:
        """Return the rows (m,)."""

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Return the Jacobian's entries."""


class OwnFamily:
    """A function that is its own family: whatever it is a member of is the sum of its members."""

    @property
    def family(self) -> Self:
        """The function itself."""
        return self

    def cost(self, x: FloatArray, members: Sequence[SecondOrder]) -> float:
        """Return the sum of members of one row each."""
        return float(sum(member.value(x)[0] for member in members))

    def gradient(self, x: FloatArray, members: Sequence[SecondOrder]) -> FloatArray:
        """Return the gradient (n,) of the sum of members of one row each."""
        slope = np.zeros(len(x))
        for member in members:
            np.add.at(slope, member.entries[1], member.jacobian(x))
        return slope


@dataclass(frozen=True, eq=False)
class Alone(OwnFamily):
    """A function from plain functions with dense derivatives.

    Attributes
    ----------
    shape : int, int
        m and n.
    value : function, x -> (m,) array
    dense_jacobian : function, x -> (m, n) array
    second : function, x, multipliers (m,) -> (n, n) array
    """

    shape: tuple[int, int]
    value: Callable[[FloatArray], FloatArray]
    dense_jacobian: Callable[[FloatArray], FloatArray]
    second: Callable[[FloatArray, FloatArray], FloatArray]

    @property
    def entries(self) -> tuple[IntArray, IntArray]:
        """Every row and column."""
        rows, columns = np.indices(self.shape).reshape(2, -1)
        return rows, columns

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Return the Jacobian's entries, row by row."""
        return np.asarray(self.dense_jacobian(x), dtype=float).ravel()

    def hessian(self, x: FloatArray, weighted: Sequence[Weighted[Any]]) -> FloatArray:
        """Return the second derivatives (n, n) of functions of the rows."""
        found = np.zeros((len(x), len(x)))
        for _, multipliers, _ in weighted:
            found += self.second(x, multipliers)
        if np.any(curvature := _sum_of_curvatures(weighted)):
            J = np.asarray(self.dense_jacobian(x))
            found += J.T @ (curvature[:, None] * J)
        return found


class Linear(OwnFamily):
    """Rows A x + b, which have no second derivatives.

    Parameters
    ----------
    A : (m, n) sparse array
    b : (m,) array
    """

    def __init__(self, A: csr_array, b: FloatArray) -> None:
        self._A, self._b = csr_array(A), b
        self._coordinates, self._transposed = self._A.tocoo(), csr_array(self._A.T)

    @property
    def entries(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of A."""
        rows, columns = self._coordinates.coords
        return rows.astype(np.intp), columns.astype(np.intp)

    def value(self, x: FloatArray) -> FloatArray:
        """Return A x + b."""
        return np.asarray(self._A @ x + self._b)

    def jacobian(self, _: FloatArray) -> FloatArray:
        """Return the entries of A."""
        return np.asarray(self._coordinates.data)

    def hessian(self, _: FloatArray, weighted: Sequence[Weighted[Any]]) -> Sparse:
        """Return A' diag(curvature) A."""
        return Sparse((self._transposed * _sum_of_curvatures(weighted)) @ self._A)


@dataclass(frozen=True, eq=False)
class QuadraticForm(OwnFamily):
    """The function x^T Q x / 2 + b^T x + c.

    Attributes
    ----------
    Q : (n, n) array
        Symmetric.
    b : (n,) array
    c : float
    """

    Q: FloatArray
    b: FloatArray
    c: float = 0.0

    @property
    def entries(self) -> tuple[IntArray, IntArray]:
        """The whole gradient."""
        n = len(self.b)
        return np.zeros(n, dtype=np.intp), np.arange(n)

    def value(self, x: FloatArray) -> FloatArray:
        """Return the value (1,)."""
        return np.array([x @ self.Q @ x / 2 + self.b @ x + self.c])

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Return the gradient (n,)."""
        return np.asarray(self.Q @ x + self.b)

    def hessian(self, x: FloatArray, weighted: Sequence[Weighted[Any]]) -> FloatArray:
        """Return Q times the multipliers, and the curvature times the gradient squared."""
        slope, curvature = self.jacobian(x), float(np.sum(_sum_of_curvatures(weighted)))
        found = curvature * np.outer(slope, slope)
        return np.asarray(found + sum(float(y[0]) for _, y, _ in weighted) * self.Q)


def _sum_of_curvatures(weighted: Sequence[Weighted[Any]]) -> FloatArray:
    """Return the curvature (m,) of the rows of a function that is given once or more."""
    return np.asarray(sum(curvature for _, _, curvature in weighted))


def by_differences(
    dense_jacobian: Callable[[FloatArray], FloatArray],
) -> Callable[[FloatArray, FloatArray], FloatArray]:
    """Return second derivatives of multipliers * rows as differences of the first ones.

    Forward differences, n + 1 evaluations of the Jacobian each time, relative error about 1e-8:
    the step is the square root of the rounding error, of the variable or of 1, Nocedal and Wright,
    section 8.1.
    """

    def second(x: FloatArray, multipliers: FloatArray) -> FloatArray:
        here = multipliers @ dense_jacobian(x)
        rows = np.empty((len(x), len(x)))
        for i, step in enumerate(np.sqrt(np.finfo(float).eps) * np.maximum(np.abs(x), 1.0)):
            moved = x.copy()
            moved[i] += step
            rows[i] = (multipliers @ dense_jacobian(moved) - here) / (moved[i] - x[i])
        return np.asarray((rows + rows.T) / 2.0)

    return second
