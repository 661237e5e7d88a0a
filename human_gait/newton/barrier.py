"""Bounds with logarithmic barriers: where there is room, how much, and how the barriers fall.

Rows c(x) get slacks s, so that variables and slacks w = (x, s) are bounded alike, and

    minimise  f(x) - barrier * (sum of log(w - lower) + sum of log(upper - w)),   c(x) = s

is solved for barriers that fall to 0 in a few stages.

References
----------
A. Waechter and L. T. Biegler, Mathematical Programming 106 (2006): Eq. (3), section 2.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.newton.filter import NOWHERE, Measures
from human_gait.newton.nonlinear_program import Derivatives, Duals, Point, Stacked

_LEAST_GAP = 1e-15  # so that nothing is divided by 0 where rounding put a value on its bound
_FALL = 0.2  # part of the barrier that the next stage has at most, kappa_mu of Eq. (7)


class Schedule(NamedTuple):
    """How the barrier falls, Eq. (7).

    Attributes
    ----------
    first : float
        The barrier of the first stage.
    patience : float
        A stage ends where the error is this many times its barrier, be it at once; kappa_epsilon
        of step A-3.
    power : float
        The next barrier is this one to that power, or lower; theta_mu.
    push, share : float
        How far a start is put inside its bounds: so much, but no larger part of their distance;
        kappa_1 and kappa_2 of section 3.6. Slacks beside bounds of narrow rows hold up all else.
    """

    first: float
    patience: float
    power: float
    push: float = 0.01
    share: float = 0.01

    def ends(self, barrier: float, error: float) -> bool:
        """Return whether the stage of a barrier is over."""
        return error <= self.patience * barrier

    def after(self, barrier: float) -> float:
        """Return the barrier of the next stage."""
        return float(min(_FALL * barrier, barrier**self.power))


COLD = Schedule(0.1, 10.0, 1.5)
"""Into the middle of the valley first."""
WARM = Schedule(1e-4, 1e4, 1.2)
"""The valley is the right one: no need to go to its middle."""


@dataclass(frozen=True, eq=False)
class State:
    """Where the method is.

    Attributes
    ----------
    point : Point
    now : Derivatives
    inside : (n + m,) array
        w, the variables and the slacks of the rows.
    y : (m,) array
        Multipliers of rows = slacks.
    low, high : (n + m,) array
        Multipliers of lower and of upper bounds, none negative.
    """

    point: Point
    now: Derivatives
    inside: FloatArray
    y: FloatArray
    low: FloatArray
    high: FloatArray

    @cached_property
    def slope(self) -> FloatArray:
        """The gradient (n,) of cost and rows, without the bounds of the variables."""
        return np.asarray(self.now.gradient + self.y @ self.now.jacobian, dtype=float)


class Bounds:
    """The bounds of variables and slacks, some of which leave no room for a barrier.

    Parameters
    ----------
    stacked : Stacked
    cold : Schedule
        Where a start without multipliers is put.

    Attributes
    ----------
    n : int
        Number of variables.
    equal : (n + m,) bool array
        Fixed variables, and rows without slack: no barrier keeps them.
    lower, upper : (n + m,) array
        Of all others; infinite where no barrier is.
    below, above : (n + m,) bool array
        Where there is a barrier.
    """

    def __init__(self, stacked: Stacked, cold: Schedule = COLD) -> None:
        self.n, self._cold = stacked.n, cold
        self.equal = stacked.lower == stacked.upper
        self._values = stacked.lower  # of those that are equal
        self.lower = np.where(self.equal, -np.inf, stacked.lower)
        self.upper = np.where(self.equal, np.inf, stacked.upper)
        self.below, self.above = np.isfinite(self.lower), np.isfinite(self.upper)

    def gaps(self, inside: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the distances (n + m,) from the lower and the upper bounds."""
        below, above = inside - self.lower, self.upper - inside
        return np.maximum(below, _LEAST_GAP), np.maximum(above, _LEAST_GAP)

    def slope(self, inside: FloatArray, barrier: float) -> FloatArray:
        """Return the gradient (n + m,) of the barriers."""
        below, above = self.gaps(inside)
        return np.asarray(barrier / above - barrier / below, dtype=float)

    def measures(self, point: Point, inside: FloatArray, barrier: float) -> Measures:
        """Return the violation of rows = slacks and the barrier function, Eq. (3a)."""
        if not np.isfinite(point.cost):
            return NOWHERE
        below, above = self.gaps(inside)
        logs = np.log(below[self.below]).sum() + np.log(above[self.above]).sum()
        violation = np.abs(point.bounded - inside).sum()
        return Measures(float(violation), float(point.cost - barrier * logs))

    def cold(self, point: Point, now: Derivatives) -> State:
        """Return a state with slacks near the rows of a point, and nothing known of multipliers."""
        slacks = self.placed_slacks(point.bounded[self.n :])
        inside = np.concatenate([point.x, slacks])
        low, high = self.below.astype(float), self.above.astype(float)
        return State(point, now, inside, np.zeros(len(slacks)), low, high)

    def warm(self, point: Point, now: Derivatives, duals: Duals, barrier: float) -> State:
        """Return a state in which every product of multiplier and distance is the barrier.

        A bound with a multiplier z is barrier / z away, wherever the row's own value is: to get
        rows and slacks together takes one Newton step, to balance products takes many.
        """
        slacks = self.placed_slacks(point.bounded[self.n :], duals.rows, barrier)
        inside = np.concatenate([point.x, slacks])
        below, above = self.gaps(inside)
        return State(point, now, inside, duals.rows, barrier / below, barrier / above)

    def placed_variables(
        self, x: FloatArray, z: FloatArray | None = None, barrier: float = 0.0
    ) -> FloatArray:
        """Return variables (n,) inside their bounds, as near to those with a price as it says."""
        return self._placed(x, z, barrier, slice(self.n))

    def placed_slacks(
        self, rows: FloatArray, z: FloatArray | None = None, barrier: float = 0.0
    ) -> FloatArray:
        """Return slacks (m,) near rows but inside their bounds; the same for multipliers (m,)."""
        return self._placed(rows, z, barrier, slice(self.n, None))

    def _placed(
        self, values: FloatArray, z: FloatArray | None, barrier: float, part: slice
    ) -> FloatArray:
        lower, upper = self.lower[part], self.upper[part]
        schedule = self._cold if z is None else WARM
        margin = np.minimum(schedule.push, schedule.share * (upper - lower))
        values = np.clip(values, lower + margin, upper - margin)
        if z is not None:
            near = barrier / np.maximum(np.abs(z), np.finfo(float).tiny)  # gap * |z| = barrier
            at_lower = self.below[part] & (z < 0.0) & (values > lower + near)
            at_upper = self.above[part] & (z > 0.0) & (values < upper - near)
            values = np.where(at_lower, lower + near, np.where(at_upper, upper - near, values))
        return np.where(self.equal[part], self._values[part], values)
