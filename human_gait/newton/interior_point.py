"""A primal-dual interior-point method with exact second derivatives.

Rows c(x) get slacks s, and logarithmic barriers keep x and s inside their bounds (`barrier`); the
barriers fall in a few stages. Each step is one of Newton's method on the optimality conditions
(`newton_step`), damped where its model has no minimum (`damping`) and shortened until a filter
takes it (`line_search`, `filter`). It ends where little is left of the conditions (`optimality`).
Variables and rows have to be in units that make them of the order of 1.

References
----------
A. Waechter and L. T. Biegler, "On the implementation of an interior-point filter line-search
algorithm for large-scale nonlinear programming", Mathematical Programming 106 (2006): the barrier's
stages and the filter, Algorithm A, without second-order corrections. Instead of their phase that
restores feasibility slacks and multipliers begin anew where no step leads on. Equation numbers are
those of this paper.
J. Nocedal and S. J. Wright, "Numerical Optimization", 2nd ed., 2006: chapter 19.
"""

from __future__ import annotations

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.newton import damping as damped
from human_gait.newton.barrier import COLD, WARM, Bounds, Schedule, State
from human_gait.newton.filter import Filter
from human_gait.newton.line_search import along
from human_gait.newton.newton_step import NewtonSystem, Step
from human_gait.newton.nonlinear_program import Duals, End, NonlinearProgram, Point, Stacked
from human_gait.newton.optimality import Goal, Left, left

OPTIMAL = "optimal"
LIMIT_REACHED = "iteration limit reached"
STUCK = "no step leads on"
NO_START = "the start cannot be evaluated"
NO_ROOM = "a lower bound is above its upper bound"

LAST_BARRIER = 0.1
"""Of the last stage, as part of the products that the goal asks for."""
SPREAD = 1e10
"""Multipliers of bounds stay within this factor of barrier / distance, kappa_Sigma of Eq. (16)."""

_ANEW = 3  # starts with new slacks and multipliers where no step leads on


def minimise(
    problem: NonlinearProgram,
    start: FloatArray,
    goal: Goal | None = None,
    duals: Duals | None = None,
    cold: Schedule = COLD,
) -> End:
    """Minimise from a start.

    Parameters
    ----------
    problem : NonlinearProgram
    start : (n,) array
        Is moved inside the bounds of the variables; it need not satisfy the rows.
    goal : Goal, optional
    duals : Duals, optional
        Multipliers of a start that is nearly optimal: the barrier then starts low.
    cold : Schedule
        Where a start without multipliers is put, and how its barrier falls.

    Returns
    -------
    End
        Solved if the goal is met. That the point is no saddle is not checked, but every step was
        one towards a minimum of its quadratic model. Not solved, with the start itself, if that
        cannot be evaluated or bounds leave no room.

    Raises
    ------
    BaseException
        Whatever an evaluation raises, but for cost or rows that need the inverse of a singular
        matrix: the step is then shortened.
    """
    method, goal = InteriorPoint(problem, cold), goal or Goal()
    stages = Stages(cold if duals is None else WARM, LAST_BARRIER * goal.complementary)
    state = method.start(start, duals, stages.barrier)
    if isinstance(state, str):
        none = Duals(np.zeros(len(problem.row_lower)), np.zeros(len(start)))
        return End(start, none, False, state, 0)
    return _descended(method, state, stages, goal, cold)


def _descended(
    method: InteriorPoint, state: State, stages: Stages, goal: Goal, cold: Schedule
) -> End:
    """Return where steps from a state end."""
    damping, anew = 0.0, _ANEW
    for steps in range(goal.most_iterations + 1):
        remaining = left(method.bounds, state)
        if remaining.of(0.0).meets(goal):
            return method.end(state, OPTIMAL, steps)
        if steps == goal.most_iterations:
            break
        stages.advance(remaining)
        found = method.step(state, stages.barrier, damping, stages.seen)
        if found is None and not anew:
            return method.end(state, STUCK, steps)
        if found is None:  # instead of the paper's phase that restores feasibility
            anew -= 1
            stages.begin(cold)
            found = method.bounds.cold(state.point, state.now), 0.0
        state, damping = found
    return method.end(state, LIMIT_REACHED, goal.most_iterations)


class Stages:
    """The barrier of the present stage and its filter.

    Parameters
    ----------
    schedule : Schedule
    last : float
        Barrier of the last stage.

    Attributes
    ----------
    barrier : float
    seen : Filter
    """

    def __init__(self, schedule: Schedule, last: float) -> None:
        self._last = last
        self.begin(schedule)

    def begin(self, schedule: Schedule) -> None:
        """Go to the first stage of a schedule."""
        self._schedule, self.barrier, self.seen = schedule, schedule.first, Filter()

    def advance(self, remaining: Left) -> None:
        """Go on to the first stage of which too much remains, Algorithm A, A-3.

        Each begins with an empty filter: its barrier function is another one, so that earlier
        heights mean nothing.
        """
        while self.barrier > self._last and self._schedule.ends(
            self.barrier, remaining.of(self.barrier).largest
        ):
            self.barrier = max(self._schedule.after(self.barrier), self._last)
            self.seen = Filter()


class InteriorPoint:
    """The steps of the method, for one problem.

    Parameters
    ----------
    problem : NonlinearProgram
    cold : Schedule
        Where a start without multipliers is put.

    Attributes
    ----------
    stacked : Stacked
    bounds : Bounds
    """

    def __init__(self, problem: NonlinearProgram, cold: Schedule = COLD) -> None:
        self.stacked = Stacked(problem)
        self.bounds = Bounds(self.stacked, cold)

    def start(self, x: FloatArray, duals: Duals | None, barrier: float) -> State | str:
        """Return a state inside the bounds, or why there is none."""
        if not np.all(self.stacked.lower <= self.stacked.upper):
            return NO_ROOM
        z = None if duals is None else duals.variables
        x = self.bounds.placed_variables(x, z, barrier)
        point = self.stacked.point(x)
        if not np.isfinite(point.cost):
            return NO_START
        now = self.stacked.derivatives(x)
        if duals is None:
            return self.bounds.cold(point, now)
        return self.bounds.warm(point, now, duals, barrier)

    def system(self, state: State, barrier: float) -> NewtonSystem:
        """Return the linear equations of a step from a state."""
        return NewtonSystem(self.stacked, self.bounds, state, barrier)

    def step(
        self, state: State, barrier: float, damping: float, seen: Filter
    ) -> tuple[State, float] | None:
        """Return the next state and the damping that is left to it; None if none is found.

        The first step is taken that is one to a minimum of its model and of which the filter takes
        a part; as long as there is none, damping grows.
        """
        system = self.system(state, barrier)
        tried = damped.first(damping)
        while tried <= damped.MOST:
            factor = system.factor(tried)
            if isinstance(factor, float):
                tried = damped.if_indefinite(tried, damping, tried + factor)
                continue
            step = system.step(factor)
            if not np.all(np.isfinite(step.inside)):
                return (
                    None  # derivatives that are no numbers, or too large: nothing to search along
                )
            moved = along(self.stacked, self.bounds, state, step, barrier, seen)
            if moved is None:
                tried = damped.if_refused(tried)
                continue
            part, point = moved
            longest = part * float(np.abs(step.inside[: self.bounds.n]).max())
            after = self.moved(state, step, part, point, barrier)
            return after, damped.left(tried, damping, longest)
        return None

    def moved(self, state: State, step: Step, part: float, point: Point, barrier: float) -> State:
        """Return the state after part of a step, Eq. (14).

        Variables, slacks and the multipliers of rows go that part of the way, multipliers of bounds
        as far as keeps them positive, but stay near barrier / distance, Eq. (16).
        """
        inside = state.inside + part * step.inside
        below, above = self.bounds.gaps(inside)
        low, high = state.low + step.dual * step.low, state.high + step.dual * step.high
        low = np.clip(low, barrier / (SPREAD * below), SPREAD * barrier / below)
        high = np.clip(high, barrier / (SPREAD * above), SPREAD * barrier / above)
        now = self.stacked.derivatives(point.x)
        return State(point, now, inside, state.y + part * step.y, low, high)

    def end(self, state: State, status: str, steps: int) -> End:
        """Return where the method ends; a fixed variable's multiplier is what its slope leaves."""
        fixed, by_bounds = self.bounds.equal, state.high - state.low
        n = self.bounds.n
        by_variable = np.where(fixed[:n], -state.slope, by_bounds[:n])
        return End(state.point.x, Duals(state.y, by_variable), status == OPTIMAL, status, steps)
