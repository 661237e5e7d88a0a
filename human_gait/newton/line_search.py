"""The part of a Newton step that is taken: the largest of 1, 1/2, 1/4 ... that a filter accepts.

References
----------
A. Waechter and L. T. Biegler, Mathematical Programming 106 (2006): section 2.3, Algorithm A, steps
A-5.2 to A-5.4, without second-order corrections.
"""

from __future__ import annotations

import numpy as np

from human_gait.newton.barrier import Bounds, State
from human_gait.newton.filter import Filter
from human_gait.newton.newton_step import Step
from human_gait.newton.nonlinear_program import Point, Stacked

_SHORTEST = 1e-3  # part of the longest step that the bounds allow, alpha_min
_FALL_POWER, _VIOLATION_POWER = 2.3, 1.1  # s_phi and s_theta of Eq. (19), delta = 1
_ENOUGH = 1e-8  # part of the predicted fall, eta_phi of Eq. (20)
_FEASIBLE = 1e-4  # violation per row below which the barrier function has to fall, theta_min
_ROUNDING = 1e-12  # of the barrier function


def along(
    stacked: Stacked, bounds: Bounds, state: State, step: Step, barrier: float, seen: Filter
) -> tuple[float, Point] | None:
    """Return the part of a step that is taken, and the point there; None if none is.

    A point is taken that no kept one beats and that, where the state is feasible but for little and
    the step leads downhill (Eq. 19), lowers the barrier function by a part of what its slope
    predicts (Armijo's condition, Eq. 20). Elsewhere it has to be better than the state in one of
    the measures (Eq. 18), and the state is kept in the filter.
    """
    here = bounds.measures(state.point, state.inside, barrier)
    fall = predicted_fall(bounds, state, step, barrier)
    feasible = here.violation < _FEASIBLE * max(len(step.y), 1)
    rounding = _ROUNDING * abs(here.height)
    part = step.primal
    while part >= _SHORTEST * step.primal:
        inside = state.inside + part * step.inside
        point = stacked.point(inside[: bounds.n])
        there = bounds.measures(point, inside, barrier)
        if seen.takes(there):
            if feasible and leads_downhill(part, fall, here.violation):
                if there.height <= here.height + _ENOUGH * part * fall + rounding:
                    return part, point
            elif there.better_than(here):
                seen.add(here)
                return part, point
        part /= 2.0
    return None


def predicted_fall(bounds: Bounds, state: State, step: Step, barrier: float) -> float:
    """Return the slope of the barrier function along a whole step, negative if it falls."""
    by_barriers = bounds.slope(state.inside, barrier) @ step.inside
    return float(state.now.gradient @ step.inside[: bounds.n] + by_barriers)


def leads_downhill(part: float, fall: float, violation: float) -> bool:
    """Return whether the barrier function falls by more than there is violation left, Eq. (19).

    part * (-fall)^2.3 > violation^1.1, in logarithms, since powers of large numbers overflow.
    """
    if fall >= 0.0 or not violation:
        return fall < 0.0
    power = np.log(part) + _FALL_POWER * np.log(-fall)
    return bool(power > _VIOLATION_POWER * np.log(violation))
