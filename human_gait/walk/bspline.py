"""Cubic B-splines of a walk, Eqs. (28)-(30).

One step lasts from t = 0 to T; the next one is its image by the cycle of the walk: mirrored, and
further on by the step length L (Eq. 26). There are two kinds of basis:

*   mirrored: the knots go on beyond the step by the same rule, so that of n control points the last
    three are the images of the first three,

        P_(m+i) = mirror(P_i) + L z,   i = 0, 1, 2,   m = n - 3,

    and position, velocity and acceleration are periodic for any choice of the m free ones;
*   clamped, as in the paper: all n control points are free, the first and the last are the postures
    at 0 and T, and Eq. (26) has to be demanded of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import N_DOF
from human_gait.values import Value
from human_gait.walk.cycle import Cycle

DEGREE = 3


@dataclass(frozen=True, eq=False)
class Basis(Value):
    """Cubic basis functions N_j of one step.

    Attributes
    ----------
    breaks : (p + 1,) array, [s]
        Where the p polynomial pieces meet, from 0 to T.
    cycle : Cycle
        How the motion goes on after T.
    mirrored : bool
        Whether the splines go on as their mirror image; else they are clamped at both ends.
    """

    breaks: FloatArray
    cycle: Cycle
    mirrored: bool = True

    @classmethod
    def uniform(cls, cycle: Cycle, n_control_points: int, mirrored: bool = True) -> Basis:
        """Return the basis of `n_control_points` functions with pieces of equal length."""
        breaks = np.linspace(0.0, cycle.period, n_control_points - DEGREE + 1)
        return cls(breaks, cycle, mirrored)

    @property
    def step_time(self) -> float:
        """T, [s]."""
        return float(self.breaks[-1])

    @property
    def n_pieces(self) -> int:
        """Number p of polynomial pieces."""
        return len(self.breaks) - 1

    @property
    def n_free(self) -> int:
        """Number m of free control points."""
        return self.n_pieces if self.mirrored else self.n_control_points

    @property
    def n_control_points(self) -> int:
        """Number n = p + 3 of control points."""
        return self.n_pieces + DEGREE

    @cached_property
    def knots(self) -> FloatArray:
        """(n + 4,) array, [s]: the breaks, continued periodically or repeated at both ends."""
        T = self.step_time
        if not self.mirrored:
            return np.concatenate([np.zeros(DEGREE), self.breaks, np.full(DEGREE, T)])
        return self._knots(np.arange(self.n_control_points + DEGREE + 1))

    def _knots(self, i: npt.NDArray[np.intp]) -> FloatArray:
        """Return knots of the endless walk; number 3 is at t = 0."""
        step, piece = np.divmod(i - DEGREE, self.n_pieces)
        return np.asarray(self.breaks[piece] + step * self.step_time)

    def matrix(self, times: FloatArray, derivative: int = 0) -> FloatArray:
        """Return N, N' or N'' at the `times` (K,) in [0, T], (K, n).

        Of the functions of degree r those that begin at the r + 1 last knots before t are not 0.
        Each has a part in two of the next degree, by Cox and de Boor's recursion

            N_(j,r+1) = w_j N_(j,r) + (1 - w_(j+1)) N_(j+1,r),  w_j = (t - t_j) / (t_(j+r+1) - t_j),

        and with w_j = (r + 1) / (t_(j+r+1) - t_j) and -w instead of 1 - w in its derivative.
        """
        t, knots = np.asarray(times, dtype=float)[:, None], self.knots
        last = np.searchsorted(self.breaks[1:-1], t, side="right") + DEGREE
        N = np.ones((len(t), 1))
        for r in range(DEGREE):
            j = last + np.arange(-r, 1)
            part = N / (knots[j + r + 1] - knots[j])
            if r < DEGREE - derivative:
                up, down = (t - knots[j]) * part, (knots[j + r + 1] - t) * part
            else:
                up, down = (r + 1) * part, -(r + 1) * part
            N = np.hstack([np.zeros_like(t), up]) + np.hstack([down, np.zeros_like(t)])
        found = np.zeros((len(t), self.n_control_points))
        np.put_along_axis(found, last + np.arange(-DEGREE, 1), N, axis=1)
        return found

    def expand(self, free: FloatArray) -> FloatArray:
        """Return all n control points (n, 55) from the m free ones (m, 55), Eq. (26)."""
        if not self.mirrored:
            return free.copy()
        return np.concatenate([free, self.cycle.image(free[:DEGREE])])

    def fold(self, partials: FloatArray) -> FloatArray:
        """Return the partials (r, m, 55) in free control points from those (r, n, 55) in all."""
        m = self.n_free
        folded = partials[:, :m].copy()
        folded[:, : self.n_control_points - m] += self.cycle.turned(partials[:, m:])
        return folded

    def fit(self, times: FloatArray, q: FloatArray) -> FloatArray:
        """Return the free control points (m, 55) whose curves are nearest to q (K, 55).

        What is its own image and what is the opposite of it are fitted one after the other: in a
        mirrored basis the next step of such curves is the same, or has the other sign.
        """
        N, m = self.matrix(times), self.n_free
        q = q - N @ self.expand(np.zeros((m, N_DOF)))
        fitted = np.zeros((m, N_DOF))
        for sign in (1.0, -1.0):
            folded = N[:, :m].copy()
            folded[:, : self.n_control_points - m] += sign * N[:, m:]
            fitted += np.linalg.lstsq(folded, (q + sign * self.cycle.turned(q)) / 2)[0]
        return fitted

    def design(self, times: FloatArray, derivative: int = 0) -> FloatArray:
        """Return d q(t) / d(free control points), (K * 55, m * 55)."""
        N = self.matrix(times, derivative)
        full = np.einsum("kj,de->kdje", N, np.eye(N_DOF))
        folded = self.fold(full.reshape(-1, self.n_control_points, N_DOF))
        return folded.reshape(len(folded), -1)

    def symmetry(self, derivative: int = 0) -> FloatArray:
        """Return d(q(T) - mirror(q(0))) / d(free control points) of Eq. (26), (55, m * 55)."""
        first, last = self.design(np.array([0.0, self.step_time]), derivative).reshape(2, N_DOF, -1)
        return np.asarray(last - self.cycle.turned(first.T).T)

    def refined(self, n_control_points: int) -> Basis:
        """Return a basis of more functions: the longest pieces are halved, the first one first."""
        breaks = self.breaks
        while len(breaks) - 1 + DEGREE < n_control_points:
            lengths = np.round(np.diff(breaks) / self.step_time, 9)
            longest = int(np.argmax(lengths))
            breaks = np.insert(breaks, longest + 1, breaks[longest : longest + 2].mean())
        return Basis(breaks, self.cycle, self.mirrored)

    def insert(self, finer: Basis, control_points: FloatArray) -> FloatArray:
        """Return the control points (n', 55) of the same curves in a basis with further breaks.

        Knots are inserted one by one (Boehm's algorithm); in a mirrored basis in the steps before
        and after too, whose knots reach into this one.
        """
        T, new = self.step_time, np.setdiff1d(finer.breaks, self.breaks)
        knots, P = self.knots, control_points
        if self.mirrored:
            knots, P = self._three_steps(control_points)
            new = np.concatenate([new - T, new, new + T])
        for knot in new:
            knots, P = _inserted(knots, P, knot)
        first = int(np.argmin(np.abs(knots - finer.knots[0])))
        return P[first : first + finer.n_control_points]

    def _three_steps(self, control_points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return knots and control points of the step before, this one and the next."""
        m = self.n_pieces
        j = np.arange(-m, 2 * m + DEGREE)
        step, within = np.divmod(j, m)
        P = self.cycle.image(control_points[within], step)
        return self._knots(np.arange(j[0], j[-1] + DEGREE + 2)), P


def _inserted(knots: FloatArray, P: FloatArray, new: float) -> tuple[FloatArray, FloatArray]:
    """Return knots and control points of the same curves with one more knot.

    P'_j = w_j P_j + (1 - w_j) P_(j-1), where w_j = (t - t_j) / (t_(j+3) - t_j), from 0 to 1.
    """
    start, end, zero = knots[:-DEGREE], knots[DEGREE:], np.zeros_like(P[:1])
    within = (start < new) & (new < end)
    w = np.divide(new - start, end - start, out=1.0 * (end <= new), where=within)[:, None]
    refined = w * np.concatenate([P, zero]) + (1.0 - w) * np.concatenate([zero, P])
    return np.insert(knots, np.searchsorted(knots, new), new), refined
