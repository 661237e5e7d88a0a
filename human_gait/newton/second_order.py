"""What a function can offer to Newton steps: entries of its Jacobian, second derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from scipy.sparse import csr_array

from human_gait.arrays import FloatArray, IntArray


class Family(Protocol):
    """Functions of the same variables whose second derivatives are computed in one pass."""

    def hessian(self, x: FloatArray, weighted: Sequence[tuple[Any, FloatArray]]) -> FloatArray:
        """Return the second derivatives (n, n) of the sum of members times multipliers.

        Parameters
        ----------
        x : (n,) array
        weighted : sequence of (member, (m,) array)
            Members of the family with the multipliers of their rows.
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


@dataclass(frozen=True, eq=False)
class Alone:
    """A function that is its own family, from plain functions with dense derivatives.

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
    def family(self) -> Alone:
        """The function itself."""
        return self

    @property
    def entries(self) -> tuple[IntArray, IntArray]:
        """Every row and column."""
        rows, columns = np.indices(self.shape).reshape(2, -1)
        return rows, columns

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Return the Jacobian's entries, row by row."""
        return np.asarray(self.dense_jacobian(x), dtype=float).ravel()

    def hessian(self, x: FloatArray, weighted: Sequence[tuple[Any, FloatArray]]) -> FloatArray:
        """Return the second derivatives (n, n) of multipliers * rows."""
        found = np.zeros((len(x), len(x)))
        for _, multipliers in weighted:
            found += self.second(x, multipliers)
        return found


class Linear:
    """Rows A x + b, which have no second derivatives.

    Parameters
    ----------
    A : (m, n) sparse array
    b : (m,) array
    """

    def __init__(self, A: csr_array, b: FloatArray) -> None:
        self._A, self._b = csr_array(A), b
        self._coordinates = self._A.tocoo()

    @property
    def family(self) -> Linear:
        """The rows themselves."""
        return self

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

    def hessian(self, x: FloatArray, _: Sequence[tuple[Any, FloatArray]]) -> FloatArray:
        """Return nothing but zeros."""
        return np.zeros((len(x), len(x)))


@dataclass(frozen=True, eq=False)
class QuadraticForm:
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
    def family(self) -> QuadraticForm:
        """The function itself."""
        return self

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

    def hessian(self, _: FloatArray, weighted: Sequence[tuple[Any, FloatArray]]) -> FloatArray:
        """Return Q times the multipliers."""
        return np.asarray(sum(float(y[0]) for _, y in weighted) * self.Q)


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
