"""From control points to instants and back: the chain rule of Eq. (31), in one place.

Rows of constraints and second derivatives know the state (q, v, a) of an instant; in control points

    d/dP = d/dq N + d/dv N' + d/da N''.

An instant couples only the four control points whose basis functions are not zero there.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import N_DOF
from human_gait.problem.residual import Constraint, Residual
from human_gait.walk.bspline import DEGREE, Basis
from human_gait.walk.instant import SecondDerivatives

POINTS = DEGREE + 1
"""Control points that an instant depends on: 4."""


class Transcription:
    """The motion of a basis at the instants of a grid.

    Parameters
    ----------
    basis : Basis
    times : (K,) array, [s]
    """

    def __init__(self, basis: Basis, times: FloatArray) -> None:
        self.basis, self.times = basis, times
        self._N = [basis.matrix(times, order) for order in range(3)]  # N, N', N'', each (K, n)
        self._active = _active_functions(basis, times)
        at = np.arange(len(times))[:, None]
        self._active_N = np.stack([matrix[at, self._active] for matrix in self._N])  # (3, K, 4)

    def motion(self, control_points: FloatArray) -> list[FloatArray]:
        """Return q, v, a (K, 55) from all control points (n, 55)."""
        return [N @ control_points for N in self._N]

    def gradient(self, partials: FloatArray) -> FloatArray:
        """Return the gradient (m * 55,) of what has partials (K, 165) in q, v, a."""
        by_order = partials.reshape(-1, 3, N_DOF)  # instant, order of derivative, DOF
        by_point = sum(N.T @ by_order[:, order] for order, N in enumerate(self._N))
        return self.basis.fold(np.asarray(by_point)[None]).ravel()

    def entries(self, constraint: Constraint) -> tuple[IntArray, IntArray]:
        """Return row and column of every entry of a Jacobian that can differ from zero.

        With three free control points an entry can occur twice: the two are to be added.
        """
        j, d, _ = self._places(constraint)
        rows = np.broadcast_to(np.arange(len(j))[:, None, None], d.shape)
        return rows.ravel(), (j * N_DOF + d).ravel()

    def values(self, constraint: Constraint, residual: Residual) -> FloatArray:
        """Return the entries of a Jacobian in the order of `entries`."""
        _, _, sign = self._places(constraint)
        N = self._active_N[:, constraint.instants]  # order, row, control point
        parts = zip(N, (residual.dq, residual.dv, residual.da), strict=True)
        blocks = sum(n[:, :, None] * d[:, None, :] for n, d in parts)  # row, control point, column
        return np.asarray(blocks * sign).ravel()

    def jacobian(self, constraint: Constraint, residual: Residual) -> FloatArray:
        """Return the Jacobian (r, m * 55) of the rows of a constraint."""
        shape = len(constraint.instants), self.basis.n_free * N_DOF
        entries = self.values(constraint, residual), self.entries(constraint)
        return np.asarray(coo_array(entries, shape=shape).toarray())

    def hessian(self, second: SecondDerivatives) -> FloatArray:
        """Return second derivatives (m * 55, m * 55) from those at the instants.

        With N_k (165, 220) from the four active control points to q, v, a of instant k they are

            sum over k of N_k^T (direct + A^T A + B^T C + C^T B) N_k .

        Instants between two knots have the same active control points: they are summed up first.
        Of each symmetric sum only a half X is computed, X + X^T being the whole.
        """
        m = self.basis.n_free
        by_point = np.zeros((m, N_DOF, m, N_DOF))  # control point, DOF, control point, DOF
        direct = np.stack(second.direct, axis=1)  # instant, one of qq, qv, qa, vv, DOF, DOF
        A, B, C = (self._onto_points(rows) for rows in (second.rows, second.left, second.right))
        for first in np.unique(self._active[:, 0]):
            k = np.flatnonzero(self._active[:, 0] == first)
            half = _flat(B[k]).T @ _flat(C[k]) + self._half_of_direct(k, direct[k])
            squares = _flat(A[k])
            half += squares.T @ squares / 2
            functions = first + np.arange(POINTS)
            self._add(by_point, functions, functions, half + half.T)
        for left, right in second.pairs:
            self._add_pairs(by_point, left, right)
        return by_point.reshape(m * N_DOF, m * N_DOF)

    def _add_pairs(self, by_point: FloatArray, left: FloatArray, right: FloatArray) -> None:
        """Add D_k^T E_k+1 and its transpose: neighbouring instants share five control points.

        After the last instant of a step that is its own mirror image comes T, in the control points
        of the first one.
        """
        here = np.arange(len(left))
        after = (here + 1) % len(self.times)
        D, E = self._onto_points(left, here), self._onto_points(right, after)
        for k, onward in zip(here, after, strict=True):
            block = _flat(D[k]).T @ _flat(E[k])
            rows, columns = self._active[k], self._active[onward]
            self._add(by_point, rows, columns, block.copy())
            self._add(by_point, columns, rows, block.T.copy())

    def _add(
        self, by_point: FloatArray, rows: IntArray, columns: IntArray, block: FloatArray
    ) -> None:
        """Add second derivatives (220, 220) in two times four control points, Eq. (26).

        Control points past the free ones are images P_(m+i) = S P_i + L z of the first ones, so
        that their rows and columns are turned by S, which is its own transpose.
        """
        m, cycle = self.basis.n_free, self.basis.cycle
        block = block.reshape(POINTS, N_DOF, POINTS, N_DOF)
        past = rows >= m
        block[past] = block[past][:, cycle.index] * cycle.sign[:, None, None]
        past = columns >= m
        block[:, :, past] = block[:, :, past][..., cycle.index] * cycle.sign
        for i, row in enumerate(rows % m):  # one by one: two may be the same free control point
            for j, column in enumerate(columns % m):
                by_point[row, :, column] += block[i, :, j]

    def _onto_points(self, rows: FloatArray, at: IntArray | None = None) -> FloatArray:
        """Return rows (K, r, 165) in q, v, a as rows (K, r, 4, 55) in the active control points.

        Those of the instants `at`, all by default.
        """
        by_order = rows.reshape(*rows.shape[:2], 3, N_DOF)  # instant, row, order, DOF
        N = self._active_N if at is None else self._active_N[:, at]
        N = N.transpose(1, 2, 0)  # instant, control point, order
        return np.asarray(N[:, None] @ by_order)

    def _half_of_direct(self, k: IntArray, blocks: FloatArray) -> FloatArray:
        """Return a half of what blocks (k, 4, 55, 55) add to the active points, (220, 220).

        The blocks of an instant are H_qq, H_qv, H_qa and H_vv. In the control points i and j they
        are

            sum over k of N_ki H_qq N_kj + N_ki H_qv N'_kj + N_ki H_qa N''_kj + N'_ki H_vv N'_kj

        and the transposes of the mixed ones, H_vq and H_aq, which come with the other half;
        therefore only half of H_qq and H_vv is taken. One product of matrices sums over instants
        and blocks: its rows are pairs of control points, its columns are pairs of DOF.
        """
        q, v, a = self._active_N[:, k]  # N, N', N'': instant, control point
        by_block = (q / 2, q), (q, v), (q, a), (v / 2, v)
        weights = np.stack([i[:, :, None] * j[:, None, :] for i, j in by_block])
        weights = weights.transpose(2, 3, 1, 0)  # from block, instant, i, j to i, j, instant, block
        sums = weights.reshape(POINTS**2, -1) @ blocks.reshape(-1, N_DOF**2)
        half = sums.reshape(POINTS, POINTS, N_DOF, N_DOF)  # i, j, DOF of i, DOF of j
        return half.transpose(0, 2, 1, 3).reshape(POINTS * N_DOF, POINTS * N_DOF)

    def _places(self, constraint: Constraint) -> tuple[IntArray, IntArray, FloatArray]:
        """Return free control point (r, 4, 1), DOF and sign (r, 4, c) of each entry, Eq. (26).

        Control points past the free ones are the mirror images of the first ones.
        """
        cycle, m, columns = self.basis.cycle, self.basis.n_free, constraint.columns[:, None]
        functions = self._active[constraint.instants][:, :, None]
        mirrored = functions >= m
        dof = np.where(mirrored, cycle.index[columns], columns)
        return functions % m, dof, np.where(mirrored, cycle.sign[columns], 1.0)


def _flat(rows: FloatArray) -> FloatArray:
    """Return rows (k, r, 4, 55) of several instants below each other, (k * r, 220)."""
    return rows.reshape(-1, POINTS * N_DOF)


def _active_functions(basis: Basis, times: FloatArray) -> IntArray:
    """Return the four basis functions (K, 4) that are not zero at each instant."""
    piece = np.searchsorted(basis.breaks, times, side="right") - 1
    piece = np.clip(piece, 0, basis.n_pieces - 1)  # T belongs to the last one
    return np.asarray(piece[:, None] + np.arange(POINTS))
