"""How the solution of a problem moves when the problem changes a little: one Newton step.

From the solution of a problem like this one and its multipliers, the quadratic model of the new
problem is minimised once (Nocedal and Wright, section 18.1), without a search: bounds may be broken
by what the model does not see, to second order in the change.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.newton import damping as damped
from human_gait.newton.active_set import Homotopy, noticed
from human_gait.newton.interior_point import InteriorPoint
from human_gait.newton.newton_step import NewtonSystem
from human_gait.newton.nonlinear_program import (
    Derivatives,
    Duals,
    NonlinearProgram,
    Point,
    Stacked,
)
from human_gait.newton.quadratic import local_minimum

_RADIUS = 0.5  # largest change of a variable, by active sets
_BARRIER = 1e-5  # how near bounds with multipliers are, by barriers


class Moved(NamedTuple):
    """Where one step leads.

    Attributes
    ----------
    x : (n,) array
    cost : float
        That the quadratic model predicts.
    left : float
        How far the cost may be from the least one besides, to second order: what is violated, at
        its price; what damping held back; what barriers keep away from bounds.
    """

    x: FloatArray
    cost: float
    left: float


def by_active_set(problem: NonlinearProgram, start: FloatArray, duals: Duals) -> Moved | None:
    """Return where a quadratic program leads, for few variables; None if it leads nowhere."""
    stacked = Stacked(problem)
    start = np.clip(start, problem.lower, problem.upper)
    here, now, y = stacked.point(start), stacked.derivatives(start), noticed(stacked, duals)
    model = Homotopy(stacked, here, now.slope(y), y).model(0.0, here, now, y)
    found = local_minimum(model, y, _RADIUS)
    if found is None:
        return None
    d, y = found
    return _moved(stacked, here, now, float(d @ model.H @ d), d, y, 0.0)


def by_barrier(problem: NonlinearProgram, start: FloatArray, duals: Duals) -> Moved | None:
    """Return where the step of a low barrier leads, for many variables; None if it has none."""
    method = InteriorPoint(problem)
    state = method.start(start, duals, _BARRIER)
    if isinstance(state, str):
        return None
    system, tried = method.system(state, _BARRIER), 0.0
    while isinstance(factor := system.factor(tried), float):
        if tried > damped.MOST:
            return None
        tried = damped.if_indefinite(tried, 0.0, tried + factor)
    step = system.step(factor)
    d, y = step.inside[: method.stacked.n], noticed(method.stacked, duals)
    held_back = float(tried * d @ d) + _BARRIER * np.count_nonzero(y)
    bend = _bend(system, state.now.jacobian, d)
    return _moved(method.stacked, state.point, state.now, bend, d, y, held_back)


def _bend(system: NewtonSystem, J: FloatArray, d: FloatArray) -> float:
    """Return d' H d from the matrix H + J' S_s J of the variables that are not fixed."""
    moving, springs = d[system.moving], system.curvature[len(d) :]
    return float(moving @ system.matrix.dense() @ moving - springs @ (J @ d) ** 2)


def _moved(
    stacked: Stacked,
    here: Point,
    now: Derivatives,
    bend: float,
    d: FloatArray,
    y: FloatArray,
    held_back: float,
) -> Moved:
    lower, upper = stacked.lower[: stacked.n], stacked.upper[: stacked.n]
    predicted = here.cost + now.gradient @ d + bend / 2.0
    there = stacked.point(np.clip(here.x + d, lower, upper))
    mending = np.abs(y) @ stacked.excess(there)
    return Moved(there.x, float(predicted), float(mending + held_back))
