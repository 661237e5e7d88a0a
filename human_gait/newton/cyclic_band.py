"""Symmetric matrices of blocks in a band that is closed to a ring, and their factors.

Block i meets the w blocks before and after it, counted round a ring of m: the last ones meet the
first ones. The last w blocks are put aside as a border, and what is left is a band:

        [ B   C ]                                    [ L      ]
    A = [       ],    B = L L',  C = L P,    A = R R',   R = [        ],    M M' = D - P' P .
        [ C'  D ]                                    [ P'   M ]

Each row of blocks of B has w blocks to its right and those of the border, in which the fill stays.
So the time grows with m and not with its cube.

References
----------
G. H. Golub and C. F. Van Loan, "Matrix Computations", 4th ed., 2013: sections 4.2.6 on Cholesky's
method in blocks, 4.3.5 in a band.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dtrtri
from scipy.sparse import coo_array

from human_gait import kernel
from human_gait.arrays import BoolArray, FloatArray
from human_gait.newton.matrix import Dense, DenseFactor, Matrix, cholesky

_MANY = 17
"""With fewer blocks the whole matrix is factorised as quickly."""


class CyclicBand:
    """A symmetric matrix X + X' of m * b rows in blocks of b.

    Parameters
    ----------
    blocks : (m, w + 1, b, b) array
        Of X, with the rows of block i and the columns of block (i + d) mod m at [i, d]. In a ring
        of few blocks some of them are in the same place: they are added.
    """

    def __init__(self, blocks: FloatArray) -> None:
        self._blocks = blocks

    @cached_property
    def _whole(self) -> Dense:
        return Dense(self.dense())

    def dense(self) -> FloatArray:
        """Return all of it (m * b, m * b)."""
        m, width, b, _ = self._blocks.shape
        X, i = np.zeros((m, b, m, b)), np.arange(m)
        if run := kernel.function("dense"):
            run(m, width, b, self._blocks, into=(X,))
            return X.reshape(m * b, m * b)
        for d in range(width):
            X[i, :, (i + d) % m] += self._blocks[:, d]
        half = X.reshape(m * b, m * b)
        return half + half.T

    def scaled(self, unit: FloatArray) -> CyclicBand:
        """Return the matrix with its rows and its columns times a unit (m * b,)."""
        m, width, b, _ = self._blocks.shape
        by_block = unit.reshape(m, b)
        columns = np.stack([np.roll(by_block, -d, axis=0) for d in range(width)], axis=1)
        found = self._blocks * by_block[:, None, :, None]
        found *= columns[:, :, None]
        return CyclicBand(found)

    def plus(self, other: coo_array) -> CyclicBand | None:
        """Return the sum with a symmetric matrix; None if that is not in the band."""
        (m, width, b, _), (rows, columns) = self._blocks.shape, other.coords
        (i, row), (j, column) = np.divmod(rows, b), np.divmod(columns, b)
        d = (j - i) % m  # [i, d] and, transposed, [j, m - d]: one of them is in X
        if m < 2 * width or np.any((d >= width) & (m - d >= width)):
            return None
        blocks, on = self._blocks.copy(), d < width
        half = np.where(d > 0, other.data, other.data / 2.0)
        np.add.at(blocks, tuple(part[on] for part in (i, d, row, column)), half[on])
        return CyclicBand(blocks)

    def without(self, gone: BoolArray) -> Matrix:
        """Return what is left without some rows; a band if they are the same in every block."""
        by_block = gone.reshape(len(self._blocks), -1)
        if np.any(by_block != by_block[0]):
            return self._whole.without(gone)
        left = np.flatnonzero(~by_block[0])
        return CyclicBand(self._blocks[:, :, left[:, None], left])

    def factor(self, added: FloatArray) -> BandFactor | DenseFactor | float:
        """Return a factor; if there is none, how much has to be added at least."""
        m, width, _, _ = self._blocks.shape
        if m < max(_MANY, 2 * width):
            return self._whole.factor(added)
        return BandFactor(*self._rows(added)).eliminated()

    def _rows(self, added: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the rows (m - w, b, (2 w + 1) b) of B and C, and D (w b, w b), added to.

        Of the first w + 1 blocks of columns, j is for each block of B whose number is j when
        divided by w + 1: of those from the row's own one on it is only one.
        """
        m, width, b, _ = self._blocks.shape
        n, w = m - width + 1, width - 1
        rows = np.zeros((n, b, width + w, b))
        border = np.zeros((w, b, w, b))
        for d in range(width):
            X = self._blocks[:, d] if d else self._blocks[:, d] + self._blocks[:, d].swapaxes(1, 2)
            i = np.arange(n - d)
            rows[i, :, (i + d) % width] = X[: n - d]
            i = np.arange(n - d, n)  # those meet the border
            rows[i, :, width + i + d - n] += X[i]
            k = np.arange(w - d, w) if d else np.zeros(0, dtype=int)  # the border meets the first
            rows[k + d - w, :, width + k] += X[n + k].swapaxes(1, 2)
            k = np.arange(w - d)
            border[k, :, k + d] = X[n + k]
            border[k + d, :, k] = X[n + k].swapaxes(1, 2)
        i, every, by_block = np.arange(n)[:, None], np.arange(b), added.reshape(m, b)
        rows[i, every, i % width, every] += by_block[:n]
        k = np.arange(w)[:, None]
        border[k, every, k, every] += by_block[n:]
        return rows.reshape(n, b, -1), border.reshape(w * b, w * b)


class BandFactor:
    """Cholesky's factor of a band with a border.

    Parameters
    ----------
    rows : (n, b, (2 w + 1) b) array
        Of B and C, as in `CyclicBand`; those of L', but for its diagonal blocks, and of P take
        their place.
    border : (w b, w b) array
        D.
    """

    def __init__(self, rows: FloatArray, border: FloatArray) -> None:
        self._rows, self._border = rows, border
        n, b, columns = rows.shape
        self._width = (columns // b + 1) // 2
        self._inverses = np.empty((n, b, b))  # of the diagonal blocks of L

    def eliminated(self) -> BandFactor | float:
        """Return the factor; if there is none, how much is missing on the diagonal at least.

        L_i L_i' = A_ii - (sum over k < i of P_ki' P_ki),   P_ij = L_i^-1 (A_ij - sum P_ki' P_kj)
        """
        n, b, columns = self._rows.shape
        last = np.zeros((self._width - 1, b, columns))  # P_k of the last w rows, done columns 0
        X = last.reshape(-1, columns)
        for i in range(n):
            row, own = self._rows[i], self._own(i)
            row -= X[:, own].T @ X
            pivot = row[:, own].copy()
            L, u = cholesky(pivot.copy())
            if u is not None:
                return self._missing(i, u, pivot)
            self._inverses[i] = np.tril(dtrtri(L, lower=1)[0])
            row[:, own] = last[:, :, own] = 0.0
            row[:] = last[i % len(last)] = self._inverses[i] @ row
        P = self._rows.reshape(n * b, columns)[:, self._own(n)]
        pivot = self._border - P.T @ P
        L, u = cholesky(pivot.copy())
        if u is not None:
            return self._missing(n, u, pivot)
        self._corner = DenseFactor(L)
        return self

    def solve(self, right: FloatArray) -> FloatArray:
        """Return the x (n,) for which the matrix times x is the right-hand side (n,)."""
        n, b, columns = self._rows.shape
        y, z = right[: n * b].reshape(n, b).copy(), np.zeros(columns)
        for i, row in enumerate(self._rows):  # L y = right, z the sum of P_k' y_k
            own = self._own(i)
            y[i] = self._inverses[i] @ (y[i] - z[own])
            z[own] = 0.0
            z += y[i] @ row
        corner = self._corner.solve(right[n * b :] - z[self._own(n)])
        return np.concatenate([self._upwards(y, n, corner).ravel(), corner])

    def _own(self, i: int) -> slice:
        """Return the columns of block i of B; those of the border after the last one."""
        n, b, columns = self._rows.shape
        start = i % self._width * b
        return slice(start, start + b) if i < n else slice(self._width * b, columns)

    def _upwards(self, y: FloatArray, i: int, u: FloatArray) -> FloatArray:
        """Return the x (i, b) with L' x = y (i, b) where x is u in block i and 0 in those after."""
        z, x = np.zeros(self._rows.shape[2]), np.empty_like(y)
        z[self._own(i)] = u
        for k in reversed(range(i)):
            x[k] = z[self._own(k)] = (y[k] - self._rows[k] @ z) @ self._inverses[k]
        return x

    def _missing(self, i: int, u: FloatArray, pivot: FloatArray) -> float:
        """Return -v'Av / v'v, u being a direction along which the pivot of block i is negative.

        Of all v that are u there the one that is orthogonal to the rows of A above leaves the
        pivot alone.
        """
        v = self._upwards(np.zeros((i, self._rows.shape[1])), i, u)
        return -float(u @ pivot @ u / (np.sum(v**2) + u @ u))
