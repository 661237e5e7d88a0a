"""Splines of the mean step through noisy angles: as smooth as their scatter asks for.

The control points c of a joint minimise |y - N c|^2 + h int (q''')^2 dt. How much smoothness
counts, h, is one number for all joints, since their errors hang together: what a joint turns too
far the next one turns back. It is that of the least generalised cross-validation, the sum of
|y - N c|^2 / (n - tr H)^2 in parts of each joint's scatter, H what takes samples to the curve: of
angles without noise it is none.

References
----------
P. Craven and G. Wahba, "Smoothing noisy data with spline functions", Numerische Mathematik 31
(1979) 377-403.
"""

from __future__ import annotations

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import N_DOF
from human_gait.walk.bspline import Basis

_WEIGHTS = np.concatenate([[0.0], np.logspace(-8.0, 3.0, 45)])  # of what samples weigh
_ROUNDING = 1e-7  # [rad], [m]: scatter that is none


def smooth_fit(basis: Basis, times: FloatArray, q: FloatArray) -> FloatArray:
    """Return the free control points (m, 55) of smooth curves through q (K, 55) at times (K,).

    As `Basis.fit`, what is its own image and what is the opposite of it one after the other.
    """
    N, m = basis.matrix(times), basis.n_free
    advance, jerk = basis.expand(np.zeros((m, N_DOF))), _jerk(basis)
    q, already = q - N @ advance, jerk @ advance
    fitted = np.zeros((m, N_DOF))
    for sign in (1.0, -1.0):
        parts = ((x + sign * basis.cycle.turned(x)) / 2.0 for x in (q, already))
        fitted += _smooth(_folded(basis, N, sign), _folded(basis, jerk, sign), *parts)
    return fitted


def _jerk(basis: Basis) -> FloatArray:
    """Return third derivatives of the basis functions in each piece (p, n), for their integral."""
    ends = basis.breaks
    lengths = np.diff(ends)
    inner = 1e-6 * lengths  # the second derivative is linear in a piece
    before, after = (basis.matrix(t, 2) for t in (ends[:-1] + inner, ends[1:] - inner))
    return (after - before) / (lengths - 2.0 * inner)[:, None] * np.sqrt(lengths)[:, None]


def _folded(basis: Basis, rows: FloatArray, sign: float) -> FloatArray:
    """Return rows (r, n) in the free control points of curves that are, or oppose, their image."""
    m = basis.n_free
    found = rows[:, :m].copy()
    found[:, : basis.n_control_points - m] += sign * rows[:, m:]
    return np.asarray(found)


def _smooth(N: FloatArray, R: FloatArray, y: FloatArray, already: FloatArray) -> FloatArray:
    """Return the control points (m, d) of the smoothness of least cross-validation.

    The third derivatives are R c and what there is `already` (p, d) by the way of a step.
    """
    A, B, n = N.T @ N, R.T @ R, len(N)
    unit = np.trace(A) / np.trace(B)
    free = np.linalg.lstsq(N, y)[0]
    scatter = np.sum((y - N @ free) ** 2, axis=0) / n + _ROUNDING**2
    best, found = np.inf, free
    for h in _WEIGHTS * unit:
        C = np.linalg.solve(A + h * B, N.T)
        c = C @ y - np.linalg.solve(A + h * B, h * (R.T @ already))
        left = np.sum((y - N @ c) ** 2 / scatter)
        score = left / (n - np.einsum("mn,nm->", C, N)) ** 2
        if score < best:
            best, found = score, c
    return np.asarray(found)
