"""What is left of the optimality conditions, and how much of it may be left.

References
----------
A. Waechter and L. T. Biegler, Mathematical Programming 106 (2006): Eqs. (4)-(6).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from human_gait.newton.barrier import Bounds, State

_SCALE = 100.0  # mean multiplier from where errors count relative to it, s_max of Eq. (6)


@dataclass(frozen=True)
class Goal:
    """When a point is optimal, and when to give up.

    Attributes
    ----------
    stationary, feasible, complementary : float
        Largest entry of the Lagrangian's gradient, violation, and product of a multiplier and the
        distance from its bound; the first and the last as parts of the mean multiplier over 100,
        where that is above 1.
    most_iterations : int
    """

    stationary: float = 1e-5
    feasible: float = 1e-6
    complementary: float = 1e-7
    most_iterations: int = 300


class Error(NamedTuple):
    """What is left of the optimality conditions, Eq. (5); attributes are those of a `Goal`."""

    stationary: float
    feasible: float
    complementary: float

    @property
    def largest(self) -> float:
        """E_mu, the largest of the three."""
        return max(self)

    def meets(self, goal: Goal) -> bool:
        """Return whether all of it is small enough."""
        wanted = goal.stationary, goal.feasible, goal.complementary
        return all(left <= allowed for left, allowed in zip(self, wanted, strict=True))


class Left(NamedTuple):
    """What is left of the conditions at a state, whatever the barrier.

    Attributes
    ----------
    stationary, feasible : float
        As those of `Error`.
    least, most : float
        Products of a multiplier and the distance from its bound, as parts of the scale.
    scale : float
    """

    stationary: float
    feasible: float
    least: float
    most: float
    scale: float

    def of(self, barrier: float) -> Error:
        """Return what is left of a barrier problem; with 0 of the problem itself."""
        wanted = barrier / self.scale
        return Error(
            self.stationary, self.feasible, max(self.most - wanted, wanted - self.least, 0.0)
        )


def left(bounds: Bounds, state: State) -> Left:
    """Return what is left of the conditions of a barrier problem at a state.

    gradient f + J' y - low + high = 0    by variables,    c(x) = s,
                   - y - low + high = 0    by slacks,       low * below = high * above = barrier
    """
    below, above = bounds.gaps(state.inside)
    by_value = np.concatenate([state.slope, -state.y])
    slope = np.where(bounds.equal, 0.0, by_value - state.low + state.high)
    low, high = state.low[bounds.below], state.high[bounds.above]
    products = np.concatenate([low * below[bounds.below], high * above[bounds.above]])
    multipliers = np.concatenate([np.abs(state.y), low, high])
    mean = float(multipliers.sum()) / max(len(multipliers), 1)
    scale = max(_SCALE, mean) / _SCALE
    missing = state.point.bounded - state.inside
    return Left(
        float(np.abs(slope).max(initial=0.0)) / scale,
        float(np.abs(missing).max(initial=0.0)),
        float(products.min(initial=np.inf)) / scale,
        float(products.max(initial=-np.inf)) / scale,
        scale,
    )
