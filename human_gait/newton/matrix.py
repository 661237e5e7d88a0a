"""Symmetric matrices that are factorised if they are positive definite."""

from __future__ import annotations

from typing import Protocol, Self

import numpy as np
from scipy.linalg.blas import dtrsv
from scipy.linalg.lapack import dpotrf, dpotrs
from scipy.sparse import coo_array, sparray

from human_gait.arrays import BoolArray, FloatArray


class Factor(Protocol):
    """What a positive definite matrix was factorised into."""

    def solve(self, right: FloatArray) -> FloatArray:
        """Return the x (n,) for which the matrix times x is the right-hand side (n,)."""


class Matrix(Protocol):
    """A symmetric matrix of n rows, whatever is kept of it."""

    def dense(self) -> FloatArray:
        """Return all of it (n, n)."""

    def without(self, gone: BoolArray) -> Matrix:
        """Return what is left without some rows (n,) and the same columns."""

    def factor(self, added: FloatArray) -> Factor | float:
        """Return a factor of the matrix with something (n,) added to its diagonal.

        If that is not positive definite: how much more has to be added everywhere at least, the
        curvature -v'Av / v'v of some direction v.
        """


class Dense:
    """A matrix of which all is kept.

    Parameters
    ----------
    values : (n, n) array
    """

    def __init__(self, values: FloatArray) -> None:
        self._values = values

    def dense(self) -> FloatArray:
        """Return all of it (n, n)."""
        return self._values

    def without(self, gone: BoolArray) -> Self:
        """Return what is left without some rows (n,) and the same columns."""
        left = np.flatnonzero(~gone)
        return type(self)(self._values[np.ix_(left, left)])

    def factor(self, added: FloatArray) -> DenseFactor | float:
        """Return Cholesky's factor; if there is none, how much has to be added at least."""
        raised = self._values.copy()
        raised.flat[:: len(raised) + 1] += added
        L, v = cholesky(raised)
        if v is None:
            return DenseFactor(L)
        return -float(v @ (self._values @ v + added * v) / (v @ v))


class Sparse:
    """A matrix with few entries that are not 0; factorised as if it were dense.

    Parameters
    ----------
    entries : (n, n) sparse array
    """

    def __init__(self, entries: sparray) -> None:
        self.entries = coo_array(entries)

    def dense(self) -> FloatArray:
        """Return all of it (n, n)."""
        return np.asarray(self.entries.toarray())

    def without(self, gone: BoolArray) -> Dense:
        """Return what is left without some rows (n,) and the same columns."""
        return Dense(self.dense()).without(gone)

    def factor(self, added: FloatArray) -> DenseFactor | float:
        """Return Cholesky's factor; if there is none, how much has to be added at least."""
        return Dense(self.dense()).factor(added)


class DenseFactor:
    """Cholesky's factor L of L L'; what is above its diagonal is not used."""

    def __init__(self, L: FloatArray) -> None:
        self._L = L

    def solve(self, right: FloatArray) -> FloatArray:
        """Return the x (n,) for which the matrix times x is the right-hand side (n,)."""
        return np.asarray(dpotrs(self._L, right, lower=1)[0])


def cholesky(A: FloatArray) -> tuple[FloatArray, FloatArray | None]:
    """Return L of A = L L' in the place of A, and None or a v for which v'Av is not positive.

    L is in LAPACK's order of columns; above its diagonal it is not cleared. If row k + 1 is the
    first whose pivot is not positive, v = (-L'^-1 l, 1, 0) with the rows L and l' of the factor
    above and in it: A v is 0 in the first k rows and the pivot in the next.
    """
    L, failed = dpotrf(A.T, lower=1, clean=0, overwrite_a=1)
    if not failed:
        return L, None
    v, k = np.zeros(len(L)), failed - 1
    v[:k] = -L[k, :k]
    if k:
        v = dtrsv(L, v, lower=1, trans=1)
    v[k], v[failed:] = 1.0, 0.0
    return L, v


def matrix_of(values: FloatArray | Matrix) -> Matrix:
    """Return an array (n, n) as a matrix; what is one already stays as it is."""
    return Dense(values) if isinstance(values, np.ndarray) else values
