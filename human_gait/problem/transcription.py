"""From control points to instants and back: the chain rule of Eq. (31), in one place.

Rows of constraints and second derivatives know the state (q, v, a) of an instant; in control points

    d/dP = d/dq N + d/dv N' + d/da N''.

An instant couples only the four control points whose basis functions are not zero there.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.sparse import coo_array

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import N_DOF
from human_gait.dynamics.second_derivatives import StateHessian
from human_gait.problem.residual import Constraint, Residual
from human_gait.walk.adjoint import JOINTS
from human_gait.walk.bspline import DEGREE, Basis
from human_gait.walk.instant import OfTorques, SecondDerivatives

_EVERY = slice(None)

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
        starts = np.flatnonzero(np.diff(self._active[:, 0], prepend=-1))
        self._pieces = [
            (slice(i, j), _points(self._active[i, 0]))
            for i, j in pairwise([*starts.tolist(), len(times)])
        ]
        """Instants between two knots, and their control points times DOF."""

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

            sum over k of N_k^T (direct + B^T C + C^T B) N_k  and those by the torques.

        Of each symmetric sum only a half X is computed, X + X^T being the whole. Instants between
        two knots have the same active control points and are summed up first.
        """
        n, K = self.basis.n_control_points * N_DOF, len(self.times)
        half, after = np.zeros((n, n)), (np.arange(K) + 1) % K
        B, C = self._onto_points(second.left), self._onto_points(second.right)
        pairs = [
            (self._onto_points(D, slice(len(D))), self._onto_points(E, after[: len(E)]))
            for D, E in second.pairs
        ]
        for k, at in self._pieces:
            P, by_P, by_last = self._torques(second.torques, k)
            inner, last = slice(k.start, k.stop - 1), slice(k.stop - 1, k.stop)
            half[at, at] += self._half_of_direct(second.direct, k)
            half[at, at] += _products(
                (P, by_P), (B[k], C[k]), *((D[inner], E[inner]) for D, E in pairs)
            )
            half[at, _points(self._active[after[last]][0, 0])] += _products(
                (P[-1:], by_last), *((D[last], E[last]) for D, E in pairs)
            )
        half = self._folded(half)
        return half + half.T

    def _torques(self, torques: OfTorques, k: slice) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return rows whose products are a half of the second derivatives by torques of instants k.

        With P of their partials in the control points, w, w' and c of their second derivatives
        (`OfTorques`) and P' of the next instant it is

            P^T (w P / 2 + c V + w' P'),        V_i = N' for the velocity of joint i, else 0.

        Returned are P, what is in brackets, and w' P' of the last instant, which is in the next
        control points. After the last instant of a step that is its own mirror image comes T.
        """
        w, onward, by_velocity = (part[k] for part in torques[1:])
        P = self._onto_points(torques.partials[k], k)
        rows = P * (w / 2.0)[..., None, None]
        rows[:-1] += onward[:-1, :, None, None] * P[1:]
        joint = np.arange(len(JOINTS))
        rows[:, joint, :, JOINTS] += by_velocity.T[..., None] * self._active_N[1, k]
        following = slice(k.stop, k.stop + 1) if k.stop < len(self.times) else slice(1)
        after = self._onto_points(torques.partials[following], following)
        if following.start is None:
            cycle = self.basis.cycle
            after = after[:, cycle.index[JOINTS] - JOINTS[0]] * cycle.sign[JOINTS, None, None]
        after *= onward[-1:, :, None, None]
        return P, rows, after

    def _folded(self, half: FloatArray) -> FloatArray:
        """Return by the free control points what is by all of them, Eq. (26); `half` is used up.

        Control points past the free ones are images P_(m+i) = S P_i + L z of the first ones, so
        that their rows and columns are turned by S, which is its own transpose.
        """
        n, m, cycle = self.basis.n_control_points, self.basis.n_free, self.basis.cycle
        rows = half.reshape(n, N_DOF, n * N_DOF)
        rows[: n - m] += rows[m:, cycle.index] * cycle.sign[:, None]
        columns = half.reshape(n * N_DOF, n, N_DOF)[: m * N_DOF]
        columns[:, : n - m] += cycle.turned(columns[:, m:])
        return half[: m * N_DOF, : m * N_DOF]

    def _onto_points(self, rows: FloatArray, k: slice | IntArray = _EVERY) -> FloatArray:
        """Return rows (k, r, 165) in q, v, a as rows (k, r, 4, 55) in the active control points.

        Those of the instants k, by default of all.
        """
        by_q, by_v, by_a = (rows[:, :, None, i : i + N_DOF] for i in range(0, 3 * N_DOF, N_DOF))
        q, v, a = self._active_N[:, k, None, :, None]
        found = by_q * q
        found += by_v * v
        found += by_a * a
        return np.asarray(found)

    def _half_of_direct(self, blocks: StateHessian, k: slice) -> FloatArray:
        """Return a half (220, 220) of what second derivatives at instants add to active points.

        In the control points i and j those of an instant are

            N_ki H_qq N_kj + N_ki H_qv N'_kj + N_ki H_qa N''_kj + N'_ki H_vv N'_kj

        and the transposes of the mixed ones, H_vq and H_aq, which come with the other half;
        therefore only half of H_qq and H_vv is taken. Products of matrices sum over instants: their
        rows are pairs of control points, their columns are pairs of DOF.
        """
        q, v, a = self._active_N[:, k]  # N, N', N'': instant, control point
        by_block = (q / 2, q), (q, v), (q, a), (v / 2, v)
        weights = [(i[:, :, None] * j[:, None, :]).reshape(-1, POINTS**2) for i, j in by_block]
        parts = zip(weights, blocks, strict=True)
        sums = sum(weight.T @ block[k].reshape(-1, N_DOF**2) for weight, block in parts)
        half = np.asarray(sums).reshape(POINTS, POINTS, N_DOF, N_DOF)  # i, j, DOF of i, DOF of j
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


def _products(*pairs: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Return the sum (220, 220) of X^T Y of pairs of rows (k, r, 4, 55)."""
    flat = (
        np.concatenate([rows.reshape(-1, POINTS * N_DOF) for rows in side])
        for side in zip(*pairs, strict=True)
    )
    X, Y = flat
    return np.asarray(X.T @ Y)


def _points(first: int) -> slice:
    """Return which of (n * 55) are of the four control points from the first one on."""
    return slice(first * N_DOF, (first + POINTS) * N_DOF)


def _active_functions(basis: Basis, times: FloatArray) -> IntArray:
    """Return the four basis functions (K, 4) that are not zero at each instant."""
    piece = np.searchsorted(basis.breaks, times, side="right") - 1
    piece = np.clip(piece, 0, basis.n_pieces - 1)  # T belongs to the last one
    return np.asarray(piece[:, None] + np.arange(POINTS))
