"""Cubic B-splines of a symmetric walk, Eqs. (28)-(30).

One step lasts from t = 0 to T; the next one is its mirror image, further on by the step length L
(Eq. 26). The knots go on beyond the step by the same rule, so that of n control points the last
three are the mirrored first three,

    P_(m+i) = mirror(P_i) + L z,   i = 0, 1, 2,   m = n - 3,

and position, velocity and acceleration are periodic for any choice of the m free ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline

from human_gait.skeleton import MIRROR_INDEX, MIRROR_SIGN, N_DOF, index, mirror

FloatArray = npt.NDArray[np.float64]

DEGREE = 3
WRAPPED = 3
"""Number of control points that repeat the first ones."""

_FORWARD = index("pelvis_tz")


@dataclass(frozen=True)
class Basis:
    """Cubic basis functions N_j of one step.

    Attributes
    ----------
    breaks : (m + 1,) array, [s]
        Where the polynomial pieces meet, from 0 to T.
    """

    breaks: FloatArray

    @classmethod
    def uniform(cls, step_time: float, n_control_points: int) -> Basis:
        """Return the basis of `n_control_points` functions with pieces of equal length."""
        return cls(np.linspace(0.0, step_time, n_control_points - WRAPPED + 1))

    @property
    def step_time(self) -> float:
        """T, [s]."""
        return float(self.breaks[-1])

    @property
    def n_free(self) -> int:
        """Number m of free control points."""
        return len(self.breaks) - 1

    @property
    def n_control_points(self) -> int:
        """Number n = m + 3 of control points."""
        return self.n_free + WRAPPED

    @cached_property
    def knots(self) -> FloatArray:
        """(n + 4,) array, [s]: the breaks, continued periodically on both sides."""
        T = self.step_time
        before, after = self.breaks[-WRAPPED - 1 : -1] - T, self.breaks[1 : WRAPPED + 1] + T
        return np.concatenate([before, self.breaks, after])

    def matrix(self, times: FloatArray, derivative: int = 0) -> FloatArray:
        """Return N, N' or N'' at the `times` in [0, T], (K, n)."""
        functions = BSpline(self.knots, np.eye(self.n_control_points), DEGREE)
        return np.asarray(functions(times, nu=derivative))

    def fit(self, times: FloatArray, q: FloatArray, step_length: float) -> FloatArray:
        """Return the free control points (m, 55) whose curves are nearest to q (K, 55)."""
        still = np.zeros((self.n_free, N_DOF))
        q_still = self.matrix(times) @ expand(still, step_length)
        matrix = self.design(times)
        solution = np.linalg.lstsq(matrix, (q - q_still).ravel(), rcond=None)[0]
        return np.asarray(solution.reshape(self.n_free, N_DOF))

    def design(self, times: FloatArray, derivative: int = 0) -> FloatArray:
        """Return d q(t) / d(free control points), (K * 55, m * 55)."""
        N = self.matrix(times, derivative)
        full = np.einsum("kj,de->kdje", N, np.eye(N_DOF))
        folded = fold(full.reshape(-1, self.n_control_points, N_DOF))
        return folded.reshape(len(folded), -1)


def expand(free: FloatArray, step_length: float) -> FloatArray:
    """Return all n control points (n, 55) from the m free ones (m, 55), Eq. (26)."""
    wrapped = mirror(free[:WRAPPED])
    wrapped[:, _FORWARD] += step_length
    return np.concatenate([free, wrapped])


def fold(partials: FloatArray) -> FloatArray:
    """Return the partials (r, m, 55) in the free control points from those (r, n, 55) in all."""
    m = partials.shape[1] - WRAPPED
    folded = partials[:, :m].copy()
    for i in range(WRAPPED):
        folded[:, i][:, MIRROR_INDEX] += partials[:, m + i] * MIRROR_SIGN
    return folded
