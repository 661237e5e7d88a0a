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
Lagrangian. The matrix has as many rows as there are variables and is dense in blocks.

References
----------
A. Waechter and L. T. Biegler, Mathematical Programming 106 (2006): Eqs. (9)-(15).
J. Nocedal and S. J. Wright, "Numerical Optimization", 2nd ed., 2006: section 19.3 on the condensed
matrix, section 17.3 on augmented Lagrangians.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from human_gait.arrays import FloatArray, IntArray
from human_gait.newton.barrier import Bounds, State
from human_gait.newton.nonlinear_program import Stacked

PROXIMAL = 1e-7
"""Rows without slack: their multipliers change by what is missing / this."""

_TO_BOUND = 0.99  # tau of Eq. (8): part of the way to a bound that a step may take

Blocks = list[tuple[IntArray, slice | IntArray]]


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
    blocks : list
        Of the Jacobian, from `blocks_of`.
    state : State
    barrier : float

    Attributes
    ----------
    curvature : (n + m,) array
        S of the barriers, and what stands for it where there is no room.
    matrix : (n, n) array
        H + S_x + J' S_s J, of which only the upper triangle is used; fixed variables apart.
    """

    def __init__(
        self, stacked: Stacked, bounds: Bounds, blocks: Blocks, state: State, barrier: float
    ) -> None:
        self._bounds, self._state, self._barrier = bounds, state, barrier
        self._gaps = below, above = bounds.gaps(state.inside)
        springs = state.low / below + state.high / above
        self.curvature = np.where(bounds.equal, 1.0 / PROXIMAL, springs)
        H = stacked.hessian(state.point.x, state.y)
        self.matrix = condensed(H, state.now.jacobian, self.curvature, blocks)
        fixed = bounds.equal[: bounds.n]
        self.matrix[fixed] = self.matrix[:, fixed] = 0.0  # of a unit matrix: dx = 0
        self.matrix[fixed, fixed] = 1.0

    def factor(self, damping: float) -> FloatArray | None:
        """Return Cholesky's factor of the damped matrix; None if that is not positive definite.

        Then the step would not lead downhill: its model has no minimum.
        """
        damped = self.matrix.copy()
        damped.flat[:: len(damped) + 1] += damping
        # in LAPACK's order of columns the upper triangle is the lower one of the transpose
        factor, failed = dpotrf(damped.T, lower=1, clean=0, overwrite_a=1)
        return None if failed else factor

    def step(self, factor: FloatArray) -> Step:
        """Return the Newton step of a factorised matrix, all that was eliminated put back."""
        n, state, J = self._bounds.n, self._state, self._state.now.jacobian
        rigid, springs = self._bounds.equal[n:], self.curvature[n:]
        missing = state.point.bounded[n:] - state.inside[n:]  # c - s
        slope = self._bounds.slope(state.inside, self._barrier)  # b
        forces = np.where(rigid, 0.0, slope[n:] - state.y)  # b_s - y
        right = state.slope + slope[:n] + (springs * missing + forces) @ J
        right[self._bounds.equal[:n]] = 0.0
        dx = dpotrs(factor, -right, lower=1)[0]
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


def condensed(H: FloatArray, J: FloatArray, curvature: FloatArray, blocks: Blocks) -> FloatArray:
    """Return H + S_x + J' S_s J, right in the upper triangle, in the place of H.

    A block of J with the columns that its rows have in common is dense: one product of matrices.
    """
    n = len(H)
    H.flat[:: n + 1] += curvature[:n]
    for rows, columns in blocks:
        root = np.sqrt(curvature[n:][rows, None]) * J[rows][:, columns]  # J' S J = root' root
        at = (columns, columns) if isinstance(columns, slice) else np.ix_(columns, columns)
        H[at] += root.T @ root
    return H


def blocks_of(entries: tuple[IntArray, IntArray]) -> Blocks:
    """Return groups of rows and the columns that they have in common, few and dense.

    From the widest row on, each row joins the first group that has all its columns.
    """
    of_row: dict[int, set[int]] = {}
    for row, column in zip(*map(np.ndarray.tolist, entries), strict=True):
        of_row.setdefault(row, set()).add(column)
    groups: list[tuple[set[int], list[int]]] = []
    for row, columns in sorted(of_row.items(), key=lambda item: -len(item[1])):
        home = next((rows for wide, rows in groups if wide >= columns), None)
        if home is None:
            groups.append((columns, [row]))
        else:
            home.append(row)
    return [(np.array(sorted(rows)), _as_slice(sorted(columns))) for columns, rows in groups]


def _as_slice(columns: list[int]) -> slice | IntArray:
    """Return neighbouring columns as a slice."""
    adjacent = columns[-1] - columns[0] + 1 == len(columns)
    return slice(columns[0], columns[-1] + 1) if adjacent else np.array(columns)


def _most(gaps: FloatArray, move: FloatArray) -> float:
    """Return the largest part of a move for which part * move >= -0.99 gap, Eq. (15)."""
    closing = move < 0.0
    return float(min(1.0, (-_TO_BOUND * gaps[closing] / move[closing]).min(initial=np.inf)))
