"""From control points to instants and back: the chain rule of Eq. (31), in one place.

Rows of constraints and second derivatives know the state (q, v, a) of an instant; in control points

    d/dP = d/dq N + d/dv N' + d/da N''.

An instant couples only the four control points whose basis functions are not zero there.
"""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np
from scipy.sparse import coo_array

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import N_DOF
from human_gait.problem.grid import POINTS, Grid
from human_gait.problem.residual import Constraint, Residual
from human_gait.walk.bspline import Basis


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
        self.grid = Grid(basis, times)
        self._weights: WeakKeyDictionary[Constraint, tuple[FloatArray, FloatArray]] = (
            WeakKeyDictionary()
        )
        self._active = self.grid.first[:, None] + np.arange(POINTS)

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
        if constraint not in self._weights:
            _, _, sign = self._places(constraint)
            N = self.grid.N[:, constraint.instants]  # order, row, control point
            self._weights[constraint] = N, sign
        N, sign = self._weights[constraint]
        blocks = N[0, :, :, None] * residual.dq[:, None]  # row, control point, column
        for n, d in ((N[1], residual.dv), (N[2], residual.da)):
            if d.any():
                blocks += n[:, :, None] * d[:, None]
        blocks *= sign
        return blocks.ravel()

    def jacobian(self, constraint: Constraint, residual: Residual) -> FloatArray:
        """Return the Jacobian (r, m * 55) of the rows of a constraint."""
        shape = len(constraint.instants), self.basis.n_free * N_DOF
        entries = self.values(constraint, residual), self.entries(constraint)
        return np.asarray(coo_array(entries, shape=shape).toarray())

    def _places(self, constraint: Constraint) -> tuple[IntArray, IntArray, FloatArray]:
        """Return free control point (r, 4, 1), DOF and sign (r, 4, c) of each entry, Eq. (26).

        Control points past the free ones are the mirror images of the first ones.
        """
        cycle, m, columns = self.basis.cycle, self.basis.n_free, constraint.columns[:, None]
        functions = self._active[constraint.instants][:, :, None]
        mirrored = functions >= m
        dof = np.where(mirrored, cycle.index[columns], columns)
        return functions % m, dof, np.where(mirrored, cycle.sign[columns], 1.0)
