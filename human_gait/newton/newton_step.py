"""One step of Newton's method on the conditions of a barrier problem, from a condensed matrix.

With w = (x, s), gaps g from the bounds and multipliers z of them, Eq. (9) linearises

    gradient of f + J' y - z_low + z_high = 0    by x,         c(x) - s = 0,
                      - y - z_low + z_high = 0    by s,         z * g = barrier.

The last gives dz by dw, Eq. (12): the barriers then act like springs with S = z_low / g_low +
z_high / g_high, and like forces with the gradient b of the barriers. The second and the third give

    ds = J dx + (c - s),       dy = S_s ds + (b_s - y),

and what is left is Eq. (11) with the slacks eliminated too,

    (H + S_x + J' S_s J + damping I) dx
        = -(gradient of f + J' y + b_x + J' (S_s (c - s) + b_s - y)).

Rows without slack have c - 1e-7 dy = 0 instead: a spring of 1e7 and no force, as in an augmented
Lagrangian. The matrix has as many rows as there are variables that are not fixed.

References
----------
A. Waechter and L. T. Biegler, Mathematical Programming 106 (2006): Eqs. (9)-(15).
J. Nocedal and S. J. Wright, "Numerical Optimization", 2nd ed., 2006: section 19.3 on the condensed
matrix, section 17.3 on augmented Lagrangians.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.newton.barrier import Bounds, State
from human_gait.newton.matrix import Factor, matrix_of
from human_gait.newton.nonlinear_program import Stacked

PROXIMAL = 1e-7
"""Rows without slack: their multipliers change by what is missing / this."""

_TO_BOUND = 0.99  # tau of Eq. (8): part of the way to a bound that a step may take


class Step(NamedTuple):
    """Changes of a state, and how much of them the bounds allow.

    Attributes
    ----------
    inside, y, low, high : array
        As in `State`.
    primal : float
        Largest part of `inside` that keeps all gaps positive, Eq. (15a).
    dual : float
        Largest part of `low` and `high` that keeps them positive, Eq. (15b).
    """

    inside: FloatArray
    y: FloatArray
    low: FloatArray
    high: FloatArray
    primal: float
    dual: float


class NewtonSystem:
    """The linear equations of a step from a state.

    Parameters
    ----------
    stacked : Stacked
    bounds : Bounds
    state : State
    barrier : float

    Attributes
    ----------
    curvature : (n + m,) array
        S of the barriers, and what stands for it where there is no room.
    moving : (n,) bool array
        Variables that are not fixed.
    matrix : Matrix
        H + J' S_s J of these.
    """

    def __init__(self, stacked: Stacked, bounds: Bounds, state: State, barrier: float) -> None:
        self._bounds, self._state, self._barrier = bounds, state, barrier
        self._gaps = below, above = bounds.gaps(state.inside)
        springs = state.low / below + state.high / above
        self.curvature = np.where(bounds.equal, 1.0 / PROXIMAL, springs)
        n = bounds.n
        self.moving = ~bounds.equal[:n]
        matrix = matrix_of(stacked.hessian(state.point.x, state.y, self.curvature[n:]))
        self.matrix = matrix if np.all(self.moving) else matrix.without(~self.moving)
        self._springs = self.curvature[:n][self.moving]

    def factor(self, damping: float) -> Factor | float:
        """Return Cholesky's factor of the damped matrix, S_x added.

        If that is not positive definite, the step would not lead downhill, its model having no
        minimum: returned is by how much the damping is too small, at least.
        """
        return self.matrix.factor(self._springs + damping)

    def step(self, factor: Factor) -> Step:
        """Return the Newton step of a factorised matrix, all that was eliminated put back."""
        n, state, J = self._bounds.n, self._state, self._state.now.jacobian
        rigid, springs = self._bounds.equal[n:], self.curvature[n:]
        missing = state.point.bounded[n:] - state.inside[n:]  # c - s
        slope = self._bounds.slope(state.inside, self._barrier)  # b
        forces = np.where(rigid, 0.0, slope[n:] - state.y)  # b_s - y
        right = state.slope + slope[:n] + (springs * missing + forces) @ J
        dx = np.zeros(n)
        dx[self.moving] = -factor.solve(right[self.moving])
        by_rows = J @ dx + missing
        dy = springs * by_rows + forces
        return self._with_bounds(np.concatenate([dx, np.where(rigid, 0.0, by_rows)]), dy)

    def _with_bounds(self, move: FloatArray, dy: FloatArray) -> Step:
        """Return the step whose variables and slacks move, with multipliers of bounds, Eq. (12)."""
        (below, above), state, barrier = self._gaps, self._state, self._barrier
        low = barrier / below - state.low - state.low / below * move
        high = barrier / above - state.high + state.high / above * move
        primal = min(_most(below, move), _most(above, -move))
        dual = min(_most(state.low, low), _most(state.high, high))
        return Step(move, dy, low, high, primal, dual)


def _most(gaps: FloatArray, move: FloatArray) -> float:
    """Return the largest part of a move for which part * move >= -0.99 gap, Eq. (15)."""
    closing = move < 0.0
    return float(min(1.0, (-_TO_BOUND * gaps[closing] / move[closing]).min(initial=np.inf)))
