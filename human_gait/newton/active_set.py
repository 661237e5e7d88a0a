"""From a solved problem to one like it: Newton steps with an active set that is nearly known.

The start and its multipliers solve another problem exactly: the same one with t r'x taken from the
cost and the bounds shifted by t s, for t = 1, where r is what is left of the Lagrangian's gradient
and s how far the start is from the bounds that should hold. In a few steps t goes to 0: sequential
quadratic programming along a homotopy. The steps after that converge quadratically. No barrier has
to be built up again, so few steps are needed; their matrices are dense, for some hundred variables.

References
----------
J. Nocedal and S. J. Wright, "Numerical Optimization", 2nd ed., 2006: chapter 18 on sequential
quadratic programming, section 11.3 on homotopies. Equations, sections and theorems are those of
this book.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.newton.matrix import matrix_of
from human_gait.newton.nonlinear_program import (
    Derivatives,
    Duals,
    End,
    NonlinearProgram,
    Point,
    Stacked,
)
from human_gait.newton.quadratic import Quadratic, bounds_of, local_minimum

OPTIMAL = "the active set is settled"
LOST = "no active set within reach"

WIDEST = 0.3
"""Largest change of a variable in one step ever."""

_HOMOTOPY = (0.5,)  # t of the first steps; 0 from then on
_AT_ONCE = (
    0.1  # what a start violates, and what its multipliers ask for it: if less, t is 0 at once
)
_MOST_STEPS = 25
_RADIUS = 0.12  # largest change of a variable in one step, at first
_WIDER = 1.6  # after a whole step
_STATIONARY, _FEASIBLE, _COMPLEMENTARY = 1e-4, 1e-6, 1e-5
_NOTICED = 3e-3  # cost per unit of a bound: smaller multipliers are what a barrier has left
_MEMORY = 3  # points that the merit is compared with: it need not fall at each
_SHORTEST = 0.1  # less of a step is taken whatever the merit says
_ENOUGH = 1e-4  # part of the predicted fall that is asked for (Armijo)
_IGNORED = 5e-4  # rise of the merit, of itself, that does no harm


class Homotopy:
    """Bounds and cost that a start satisfies exactly at t = 1, and those of the problem at 0.

    Where a multiplier says that a bound holds, the bound is moved to the start; where none does, it
    is moved only as far as the start is beyond it.

    Parameters
    ----------
    stacked : Stacked
    start : Point
    slope : (n,) array
        r, what is left of the Lagrangian's gradient at the start.
    y : (n + m,) array
        Multipliers of the start.
    """

    def __init__(self, stacked: Stacked, start: Point, slope: FloatArray, y: FloatArray) -> None:
        self.stacked, self._left = stacked, slope
        above_lower, above_upper = start.bounded - stacked.lower, start.bounded - stacked.upper
        self._lower = np.where(y < 0.0, above_lower, np.minimum(above_lower, 0.0))
        self._upper = np.where(y > 0.0, above_upper, np.maximum(above_upper, 0.0))

    def bounds(self, t: float) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper bounds (n + m,)."""
        return self.stacked.lower + t * self._lower, self.stacked.upper + t * self._upper

    def model(self, t: float, here: Point, now: Derivatives, y: FloatArray) -> Quadratic:
        """Return the quadratic model of a step from a point, Nocedal and Wright, Eq. (18.11).

        Curvature is that of the Lagrangian; t r'x and the shifts t s have none.
        """
        lower, upper = (bound - here.bounded for bound in self.bounds(t))
        y = y[self.stacked.n :]
        H = matrix_of(self.stacked.hessian(here.x, y, np.zeros_like(y))).dense()
        return Quadratic(H, self.gradient(t, now), now.jacobian.toarray(), lower, upper)

    def gradient(self, t: float, derivatives: Derivatives) -> FloatArray:
        """Return the gradient (n,) of the cost."""
        return np.asarray(derivatives.gradient - t * self._left, dtype=float)

    def merit(self, t: float, at: Point, prices: FloatArray) -> float:
        """Return the cost with what exceeds the bounds, at its price (n + m,).

        The l1 merit function, section 18.3, with a price for each bound.
        """
        return float(at.cost - t * self._left @ at.x + prices @ self.excess(t, at))

    def fall(self, t: float, here: Point, now: Derivatives, d: FloatArray, p: FloatArray) -> float:
        """Return the slope of the merit with prices p along a step d, Theorem 18.2; never above 0.

        A whole step keeps all bounds of the model, so that the excess goes to 0.
        """
        return min(float(self.gradient(t, now) @ d - p @ self.excess(t, here)), 0.0)

    def excess(self, t: float, at: Point) -> FloatArray:
        """Return by how much each bound is exceeded, (n + m,)."""
        lower, upper = self.bounds(t)
        beyond = np.maximum(lower - at.bounded, at.bounded - upper)
        return np.asarray(np.maximum(beyond, 0.0), dtype=float)


def follow(problem: NonlinearProgram, start: FloatArray, duals: Duals) -> End:
    """Minimise from the solution of a problem like this one.

    Parameters
    ----------
    problem : NonlinearProgram
    start : (n,) array
    duals : Duals
        Multipliers of the start.

    Returns
    -------
    End
        Solved if the KKT conditions are met: gradient of the Lagrangian 1e-4, feasibility 1e-6,
        complementarity 1e-5. That the point is no saddle is not checked. Not solved if the steps
        lead nowhere; the start is then too far away.

    Raises
    ------
    BaseException
        Whatever an evaluation raises, but for cost or rows that need the inverse of a singular
        matrix: the step is then shortened.
    """
    start = np.clip(start, problem.lower, problem.upper)
    stacked = Stacked(problem)
    y = noticed(stacked, duals)
    here, now = stacked.point(start), stacked.derivatives(start)
    path = Homotopy(stacked, here, now.slope(y), y)
    excess = stacked.excess(here)
    homotopy = _HOMOTOPY if max(excess.max(), np.abs(y) @ excess) > _AT_ONCE else ()
    prices, past, radius = np.zeros_like(y), deque[Point](maxlen=_MEMORY), _RADIUS
    for step in range(_MOST_STEPS + 1):
        t = homotopy[step] if step < len(homotopy) else 0.0
        # at t > 0 another problem was solved: not before one step of the problem itself
        if step > len(homotopy) and is_optimal(stacked, here, now, y):
            return _end(stacked, here, y, OPTIMAL, step)
        if step == _MOST_STEPS:
            break
        found = local_minimum(path.model(t, here, now, y), y, radius)
        if found is None:
            break
        d, wanted = found
        past.append(here)
        prices = _raised(prices, wanted)
        here, share = shortened(path, t, d, prices, path.fall(t, here, now, d, prices), past)
        radius = _next_radius(radius, share)
        if not np.isfinite(here.cost):  # no part of the step leads to where costs are numbers
            here = past[-1]
            break
        # as far as the variables went: wanted are the multipliers at the end of the whole step
        y = y + share * (wanted - y)
        now = stacked.derivatives(here.x)
    return _end(stacked, here, y, LOST, step)


def noticed(stacked: Stacked, duals: Duals) -> FloatArray:
    """Return multipliers (n + m,) of a start, 0 where they are small or belong to no bound.

    Small ones are what a barrier has left; others may be those of a problem with more bounds.
    """
    y = np.concatenate([duals.variables, duals.rows])
    bounded = np.isfinite(bounds_of(y, stacked.lower, stacked.upper))
    return np.where(bounded & (np.abs(y) > _NOTICED), y, 0.0)


def _raised(prices: FloatArray, wanted: FloatArray) -> FloatArray:
    """Return prices (n + m,) of the merit from those before and the multipliers of a step.

    Above the multipliers the merit has its minimum where the problem has (Theorem 17.3); a price
    that was once needed is halved with every step, and none is ever 0.
    """
    return np.asarray(np.maximum(2.0 * np.abs(wanted), prices / 2.0) + 1e-3, dtype=float)


def _next_radius(radius: float, share: float) -> float:
    """Return a wider radius after a whole step, a narrower one after part of a step, in limits."""
    wider = _WIDER * radius if share == 1.0 else share * radius
    return min(max(wider, _RADIUS), WIDEST)


def shortened(
    path: Homotopy, t: float, d: FloatArray, prices: FloatArray, fall: float, past: deque[Point]
) -> tuple[Point, float]:
    """Return a point along a step and the part of the step: halved until the merit is low enough.

    Low enough is a part of the predicted fall (Armijo, Eq. 3.4) below the highest of the last few
    points: a merit that has to fall at each step cuts good steps short (section 15.6). Variables
    keep their own limits, also while those of the homotopy are wider.
    """
    merits = [path.merit(t, point, prices) for point in past]
    limit = max(merits) + _IGNORED * max(1.0, abs(merits[-1]))
    x, n, share = past[-1].x, path.stacked.n, 1.0
    while True:
        trial = np.clip(x + share * d, path.stacked.lower[:n], path.stacked.upper[:n])
        point = path.stacked.point(trial)
        if path.merit(t, point, prices) <= limit + _ENOUGH * share * fall or share < _SHORTEST:
            return point, share
        share /= 2.0


def is_optimal(stacked: Stacked, here: Point, now: Derivatives, y: FloatArray) -> bool:
    """Return whether a point and its multipliers meet the KKT conditions."""
    excess = np.maximum(stacked.lower - here.bounded, here.bounded - stacked.upper)
    slack = here.bounded - bounds_of(y, stacked.lower, stacked.upper)
    return bool(
        np.abs(now.slope(y)).max() <= _STATIONARY
        and excess.max() <= _FEASIBLE
        and np.abs(y * slack).max() <= _COMPLEMENTARY
    )


def _end(stacked: Stacked, here: Point, y: FloatArray, status: str, steps: int) -> End:
    duals = Duals(y[stacked.n :], y[: stacked.n])
    return End(here.x, duals, status == OPTIMAL, status, steps)
