"""The quadratic model of one step: exact curvature, linearised rows, a bound on the step.

    minimise d' H d / 2 + g' d   subject to   lower <= (d, A d) <= upper,  |d| <= radius

H, the Hessian of the Lagrangian, is seldom positive definite. A few convex problems in a row lead
to a local minimum; each is solved by a dual active-set method, quick from a good guess of what is
active.

References
----------
D. Arnstroem, A. Bemporad and D. Axehill, "A dual active-set solver for embedded quadratic
programming using recursive LDL^T updates", IEEE Transactions on Automatic Control 67 (2022).
"""

from __future__ import annotations

from dataclasses import dataclass

import daqp
import numpy as np
from scipy.linalg import eigh, lapack

from human_gait.arrays import BoolArray, FloatArray

CERTAIN = 1e-3
"""A bound of a variable with a larger multiplier is taken for active without asking."""

_ROUNDS = 6
_SETTLED = 0.1  # part of the gradient at the start that ends the rounds when no more is left
_ROUGHEST, _FINEST = 1e-3, 1e-4  # limits of what may be left
_BARRIER = 1e-5  # weight of an active bound: its multiplier squared over this
_LEAST_CURVATURE = 1e-3
_REACH = 0.1  # rows further away than their gradient times this and the radius wait until broken
_KEPT = 1e-7  # by how much a row that was left out may be broken
_ON = 1e-9  # distance at which a bound counts as reached
_MOST_CHANGES = 1000  # of the active set; some hundred are many


@dataclass(frozen=True)
class Quadratic:
    """A quadratic model around a point; bounds are distances from there.

    Attributes
    ----------
    H : (n, n) array
    g : (n,) array
    A : (m, n) array
    lower, upper : (n + m,) array
        Of the variables, then of the rows.
    """

    H: FloatArray
    g: FloatArray
    A: FloatArray
    lower: FloatArray
    upper: FloatArray

    def activity(self, d: FloatArray) -> FloatArray:
        """Return what is bounded, (n + m,): the step, then the rows."""
        return np.concatenate([d, self.A @ d])

    def slope(self, d: FloatArray, y: FloatArray) -> FloatArray:
        """Return the gradient (n,) of the Lagrangian at a step, with multipliers y (n + m,)."""
        n = len(self.g)
        return np.asarray(self.H @ d + self.g + y[:n] + y[n:] @ self.A, dtype=float)


def bounds_of(y: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Return the bound that each multiplier belongs to, 0 where there is none.

    Multipliers are positive at upper bounds and negative at lower ones.
    """
    return np.where(y > 0.0, upper, np.where(y < 0.0, lower, 0.0))


def local_minimum(
    model: Quadratic, y: FloatArray, radius: float
) -> tuple[FloatArray, FloatArray] | None:
    """Return a step (n,) and its multipliers (n + m,) from a guess of the multipliers.

    Variables whose bounds are surely active take no part, nor do rows that are far away unless the
    step would break them.

    Parameters
    ----------
    model : Quadratic
    y : (n + m,) array
    radius : float
        Largest change of a variable.

    Returns
    -------
    tuple or None
        A step that keeps the bounds; a local minimum if its curvature is settled in a few rounds.
        None if no step within the radius that keeps the rows was found.
    """
    n = len(model.g)
    bound = bounds_of(y, model.lower, model.upper)[:n]
    free = (np.abs(y[:n]) <= CERTAIN) | (np.abs(bound) > radius)
    found = _with_free(model, y, radius, free)
    if found is None and not np.all(free):  # the bounds that seemed sure leave no way
        doubted = np.concatenate([np.zeros(n), y[n:]])
        found = _with_free(model, doubted, radius, np.ones(n, dtype=bool))
    return found


def _with_free(
    model: Quadratic, y: FloatArray, radius: float, free: BoolArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return a step and multipliers with the other variables on their bounds."""
    n = len(model.g)
    reach = _REACH * radius * np.linalg.norm(model.A[:, free], axis=1)
    near = (model.lower[n:] > -reach) | (model.upper[n:] < reach)
    while True:
        found = _partial_minimum(model, y, radius, free, near)
        if found is None:
            return None
        rows = model.A @ found[0]
        broken = (rows < model.lower[n:] - _KEPT) | (rows > model.upper[n:] + _KEPT)
        if not np.any(broken & ~near):
            return found
        near |= broken


def _partial_minimum(
    model: Quadratic, y: FloatArray, radius: float, free: BoolArray, near: BoolArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return a step and multipliers, all rows ignored that are not near.

    With the fixed variables d_F on their bounds, what is left of the model for the free ones d_E is

        minimise d_E' H_EE d_E / 2 + (g_E + H_EF d_F)' d_E
        subject to  lower <= A_F d_F + A_E d_E <= upper,  |d_E| <= radius .

    The slope of the Lagrangian has to vanish for the fixed variables too: it leaves them their
    multipliers, y_F = -(H d + g + A' y)_F, but 0 where the sign says that they should leave the
    bound, so that they are free the next time.
    """
    n = len(model.g)
    d = np.where(free, 0.0, bounds_of(y, model.lower, model.upper)[:n])  # d_F, 0 for d_E
    by_fixed = model.A @ d  # A_F d_F
    part = Quadratic(
        H=model.H[np.ix_(free, free)],
        g=model.g[free] + (model.H @ d)[free],
        A=np.ascontiguousarray(model.A[np.ix_(near, free)]),  # row after row, as DAQP reads it
        lower=np.append(
            np.maximum(model.lower[:n][free], -radius), (model.lower[n:] - by_fixed)[near]
        ),
        upper=np.append(
            np.minimum(model.upper[:n][free], radius), (model.upper[n:] - by_fixed)[near]
        ),
    )
    concerned = np.concatenate([free, near])
    found = _descended(part, y[concerned], radius)
    if found is None:
        return None
    d[free], multipliers = found[0], np.zeros(len(y))
    multipliers[concerned] = found[1]
    left = -model.slope(d, multipliers)[:n]
    held = ~free & (left * y[:n] > 0.0)  # the sign that took the bound for active
    multipliers[:n][held] = left[held]
    return d, multipliers


def _descended(
    part: Quadratic, y: FloatArray, radius: float
) -> tuple[FloatArray, FloatArray] | None:
    """Return a step and multipliers after some convex problems, each around the last step.

    Where bounds are active, half their weight times the square of the distance to them is added to
    the cost. It changes nothing at a solution, but makes the model convex there: H has to be
    positive along the active bounds only. (A radius that hides a bound takes its place.)
    """
    n = len(part.g)
    d = np.zeros(n)
    settled = np.clip(_SETTLED * np.abs(part.slope(d, y)).max(initial=0.0), _FINEST, _ROUGHEST)
    for _ in range(_ROUNDS):
        weight = y**2 / _BARRIER
        bound, active = bounds_of(y, part.lower, part.upper), np.flatnonzero(weight[n:])
        A = part.A[active]
        K = _convex(part.H + np.diag(weight[:n]) + (A.T * weight[n:][active]) @ A)
        # about the last step d, its gradient there being slope(d, pull), the cost of a step x is
        # x' K x / 2 + (slope(d, pull) - K d)' x
        pull = weight * (part.activity(d) - bound)
        step = _convex_minimum(K, part.slope(d, pull) - K @ d, part, y)
        if step is None:
            return None
        d, y = step
        activity = part.activity(d)
        y = y + weight * (activity - bound)  # the pull that is left is part of the multiplier
        inside = np.abs(d) < radius * (1.0 - _ON)
        y[:n] *= inside  # the radius is no bound of the problem and has no multiplier
        y[_off(y, activity, part)] = 0.0
        if np.abs(part.slope(d, y) * inside).max(initial=0.0) < settled:
            break
    return d, y


def _off(y: FloatArray, activity: FloatArray, part: Quadratic) -> BoolArray:
    """Return where a bound has a multiplier but is not reached."""
    below, above = activity < part.upper - _ON, activity > part.lower + _ON
    return np.asarray(((y > 0.0) & below) | ((y < 0.0) & above))


def _convex(K: FloatArray) -> FloatArray:
    """Return a symmetric matrix as it is if it is positive definite, else without low curvature.

    Negative curvature is turned round, small curvature raised.
    """
    if lapack.dpotrf(K, lower=True)[1] == 0:
        return K
    below = -np.inf, _LEAST_CURVATURE
    low, along = eigh(K, check_finite=False, driver="evr", subset_by_value=below)
    turned = np.maximum(np.abs(low), _LEAST_CURVATURE) - low
    return np.asarray(K + (along * turned) @ along.T, dtype=float)


def _convex_minimum(
    K: FloatArray, slope: FloatArray, part: Quadratic, y: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return the minimum of d' K d / 2 + slope' d within the bounds, from a guess of what holds."""
    guess = np.where(y > 0.0, 1, np.where(y < 0.0, 3, 0)).astype(np.int32)  # active: upper, lower
    d, _, flag, info = daqp.solve(
        K, slope, part.A, part.upper, part.lower, guess, iter_limit=_MOST_CHANGES
    )
    if flag < 1 or not np.all(np.isfinite(d)):
        return None
    return np.asarray(d, dtype=float), np.array(info["lam"], dtype=float)
