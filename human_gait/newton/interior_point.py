"""A primal-dual interior-point method with exact second derivatives, for dense blocks.

Rows c(x) get slacks s, and logarithmic barriers keep x and s inside their bounds; the barriers fall
in a few stages. Each step is one of Newton's method on the optimality conditions, shortened until a
filter takes it. Variables and rows have to be in units that make them of the order of 1. Slacks and
multipliers are eliminated, which leaves

    (H + S_x + J' S_s J + damping I) dx = right-hand side

with the second derivatives H of the Lagrangian, the Jacobian J of the rows and the barriers'
curvature S. The matrix has as many rows as there are variables, some hundred, and is dense in
blocks. Where Cholesky's method finds it not positive definite, the step would not lead downhill,
and the damping grows; so it does where the filter takes no part of a step. It falls again as long
as steps stay short: where the cost has a curved valley, long ones leave it.

References
----------
A. Waechter and L. T. Biegler, "On the implementation of an interior-point filter line-search
algorithm for large-scale nonlinear programming", Mathematical Programming 106 (2006): the barrier's
stages and the filter, without second-order corrections. Instead of their phase that restores
feasibility slacks and multipliers begin anew where no step leads on. Equation numbers are those of
this paper.
J. Nocedal and S. J. Wright, "Numerical Optimization", 2nd ed., 2006: chapter 19.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from human_gait.arrays import FloatArray, IntArray
from human_gait.newton.nonlinear_program import (
    Derivatives,
    Duals,
    End,
    NonlinearProgram,
    Point,
    Stacked,
)

OPTIMAL = "optimal"
LIMIT_REACHED = "iteration limit reached"
STUCK = "no step leads on"
NO_START = "the start cannot be evaluated"
NO_ROOM = "a lower bound is above its upper bound"

_LAST_BARRIER = 0.1  # of the products that are asked for
_FALL = 0.2  # part of the barrier that the next stage has at most
_PUSH = 1e-2  # of a start into the bounds, part of their distance
_TO_BOUND = 0.99  # part of the way to a bound that a step may take, Eq. (8)
_PROXIMAL = 1e-7  # of equalities: multipliers of rows change by what is missing / this
_SPREAD = 1e10  # of the multipliers of bounds about barrier / distance, Eq. (16)
_SCALE = 100.0  # mean multiplier from where errors count relative to it, Eq. (6)

_DAMPING = 1e-4  # the smallest
_UNDAMPED = 3e-3  # below it a step without damping is tried first
_MORE = 3.0  # damping of the next try
_REFUSED, _LEAST_REFUSED = 10.0, 1e-2  # the same after a step that the filter refused
_LESS, _AT_ONCE = 1.0 / 3.0, 10.0  # fall after a step without damping, and most after one with it
_SHORT = 0.5  # largest change of a variable, in its unit, from where the damping does not fall
_MOST_DAMPING = 1e8

_SHORTEST = 1e-3  # part of the longest step that the bounds allow
_FALL_POWER, _VIOLATION_POWER = 2.3, 1.1  # Eq. (19)
_ENOUGH = 1e-8  # part of the predicted fall, Eq. (20)
_MARGIN = 1e-5  # of the filter, Eq. (18)
_SWITCH = 1e-4  # violation per row below which the barrier function has to fall
_ROUNDING = 1e-12  # of the barrier function
_LEAST_GAP = 1e-15
_ANEW = 3  # starts with new slacks and multipliers where no step leads on


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


class _Schedule(NamedTuple):
    """How the barrier falls, Eq. (7): from `first` on, to its `power` after each stage or lower.

    A stage ends where the error is `patience` times the barrier, be it at once.
    """

    first: float
    patience: float
    power: float

    def ends(self, barrier: float, error: float) -> bool:
        """Return whether the stage of a barrier is over."""
        return error <= self.patience * barrier

    def after(self, barrier: float) -> float:
        """Return the barrier of the next stage."""
        return float(min(_FALL * barrier, barrier**self.power))


_COLD = _Schedule(0.1, 10.0, 1.5)
_WARM = _Schedule(1e-4, 1e4, 1.2)  # the valley is the right one: no need to go to its middle


class _State(NamedTuple):
    """Where the method is: bounded values are variables, then slacks of rows, (n + m,)."""

    point: Point
    now: Derivatives
    inside: FloatArray  # (n + m,) variables and slacks
    y: FloatArray  # (m,) multipliers of rows = slacks
    low: FloatArray  # (n + m,) multipliers of lower bounds
    high: FloatArray  # (n + m,) of upper bounds

    @property
    def slope(self) -> FloatArray:
        """The gradient (n,) of cost and rows, without the bounds of the variables."""
        return np.asarray(self.now.gradient + self.y @ self.now.jacobian, dtype=float)


class _Step(NamedTuple):
    """Changes of a state, and how much of them the bounds allow."""

    inside: FloatArray
    y: FloatArray
    low: FloatArray
    high: FloatArray
    primal: float
    dual: float


def minimise(
    problem: NonlinearProgram,
    start: FloatArray,
    goal: Goal | None = None,
    duals: Duals | None = None,
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
    method = _Method(problem)
    goal = goal or Goal()
    schedule = _COLD if duals is None else _WARM
    barrier, last = schedule.first, _LAST_BARRIER * goal.complementary
    state = method.start(start, duals, barrier)
    if isinstance(state, str):
        none = Duals(np.zeros(len(problem.row_lower)), np.zeros(len(start)))
        return End(start, none, False, state, 0)
    damping, seen, anew = 0.0, _Filter(), _ANEW
    for step in range(goal.most_iterations + 1):
        if method.error(state, 0.0).meets(goal):
            return method.end(state, OPTIMAL, step)
        if step == goal.most_iterations:
            break
        while barrier > last and schedule.ends(barrier, method.error(state, barrier).largest):
            barrier, seen = max(schedule.after(barrier), last), _Filter()
        found = method.step(state, barrier, damping, seen)
        if found is None and not anew:
            return method.end(state, STUCK, step)
        if found is None:
            anew, schedule, barrier, seen = anew - 1, _COLD, _COLD.first, _Filter()
            found = method.afresh(state.point, state.now), 0.0
        state, damping = found
    return method.end(state, LIMIT_REACHED, goal.most_iterations)


class _Error(NamedTuple):
    """What is left of the optimality conditions, Eq. (5), relative to large multipliers."""

    stationary: float
    feasible: float
    complementary: float

    @property
    def largest(self) -> float:
        return max(self)

    def meets(self, goal: Goal) -> bool:
        """Return whether all of it is small enough."""
        wanted = goal.stationary, goal.feasible, goal.complementary
        return all(left <= allowed for left, allowed in zip(self, wanted, strict=True))


class _Method:
    """Newton steps for one problem."""

    def __init__(self, problem: NonlinearProgram) -> None:
        self._stacked = Stacked(problem)
        self._n = self._stacked.n
        lower, upper = self._stacked.lower, self._stacked.upper
        self._equal = lower == upper  # fixed variables, rows without slack: no barrier keeps them
        self._lower = np.where(self._equal, -np.inf, lower)
        self._upper = np.where(self._equal, np.inf, upper)
        self._below, self._above = np.isfinite(self._lower), np.isfinite(self._upper)
        self._blocks = _blocks(problem)

    def start(self, x: FloatArray, duals: Duals | None, barrier: float) -> _State | str:
        """Return a state inside the bounds, or why there is none.

        With duals it is one where products are the barrier's: a bound with a multiplier z is then
        barrier / z away, wherever the row's own value is. To get rows and slacks together takes one
        Newton step, to balance products takes many.
        """
        n, stacked = self._n, self._stacked
        if not np.all(stacked.lower <= stacked.upper):
            return NO_ROOM
        z = np.zeros(len(self._lower)) if duals is None else np.r_[duals.variables, duals.rows]
        x = self._placed(x, z[:n], barrier, slice(n))
        point = stacked.point(x)
        if not np.isfinite(point.cost):
            return NO_START
        now = stacked.derivatives(x)
        if duals is None:
            return self.afresh(point, now)
        slacks = self._placed(point.bounded[n:], z[n:], barrier, slice(n, None))
        inside = np.concatenate([x, slacks])
        below, above = self._gaps(inside)
        return _State(point, now, inside, z[n:], barrier / below, barrier / above)

    def afresh(self, point: Point, now: Derivatives) -> _State:
        """Return a point inside the bounds with slacks near its rows and nothing known of duals."""
        none = np.zeros(len(self._lower) - self._n)
        slacks = self._placed(point.bounded[self._n :], none, 0.0, slice(self._n, None))
        inside = np.concatenate([point.x, slacks])
        low, high = self._below.astype(float), self._above.astype(float)
        return _State(point, now, inside, none, low, high)

    def end(self, state: _State, status: str, steps: int) -> End:
        """Return where the method ends."""
        n = self._n
        by_variable = np.where(self._equal[:n], -state.slope, (state.high - state.low)[:n])
        duals = Duals(state.y, by_variable)
        return End(state.point.x, duals, status == OPTIMAL, status, steps)

    def error(self, state: _State, barrier: float) -> _Error:
        """Return what is left of the conditions of a barrier problem; with 0 of the problem."""
        below, above = self._gaps(state.inside)
        prices = np.concatenate([state.slope, -state.y])
        left = np.where(self._equal, 0.0, prices - state.low + state.high)
        low, high = state.low[self._below], state.high[self._above]
        products = np.concatenate([low * below[self._below], high * above[self._above]])
        sizes = np.concatenate([np.abs(state.y), low, high])
        scale = max(_SCALE, float(sizes.sum()) / max(len(sizes), 1)) / _SCALE
        missing = state.point.bounded - state.inside
        return _Error(
            float(np.abs(left).max()) / scale,
            float(np.abs(missing).max()),
            float(np.abs(products - barrier).max(initial=0.0)) / scale,
        )

    def step(
        self, state: _State, barrier: float, damping: float, seen: _Filter
    ) -> tuple[_State, float] | None:
        """Return the next state and the damping to begin with there; None if none is found."""
        n, curvature = self._n, self._curvature(state)
        matrix = self._matrix(state, curvature)
        diagonal = matrix.diagonal().copy()
        tried = damping if damping >= _UNDAMPED else 0.0
        while tried <= _MOST_DAMPING:
            matrix.flat[:: n + 1] = diagonal + tried
            factor, failed = dpotrf(matrix.T, lower=1, clean=0)
            if failed:
                tried = max(_MORE * tried, _LESS * damping, _DAMPING)
                continue
            step = self._direction(state, factor, curvature, barrier)
            if not np.all(np.isfinite(step.inside)):
                return None
            moved = self._along(state, step, barrier, seen)
            if moved is not None:
                part, point = moved
                longest = part * float(np.abs(step.inside[:n]).max())
                after = self._next(state, step, part, point, barrier)
                return after, _calmer(tried, damping, longest)
            tried = max(_REFUSED * tried, _LEAST_REFUSED)
        return None

    def _placed(self, values: FloatArray, z: FloatArray, barrier: float, part: slice) -> FloatArray:
        """Return values inside their bounds, at those with a multiplier as near as it says."""
        lower, upper = self._lower[part], self._upper[part]
        margin = _PUSH * np.minimum(upper - lower, 1.0)
        values = np.clip(values, lower + margin, upper - margin)
        near = barrier / np.maximum(np.abs(z), np.finfo(float).tiny)
        at_lower = self._below[part] & (z < 0.0) & (values > lower + near)
        at_upper = self._above[part] & (z > 0.0) & (values < upper - near)
        values = np.where(at_lower, lower + near, np.where(at_upper, upper - near, values))
        return np.where(self._equal[part], self._stacked.lower[part], values)

    def _gaps(self, inside: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the distances (n + m,) from the lower and the upper bounds."""
        below, above = inside - self._lower, self._upper - inside
        return np.maximum(below, _LEAST_GAP), np.maximum(above, _LEAST_GAP)

    def _curvature(self, state: _State) -> FloatArray:
        """Return S (n + m,) of the barriers, and what stands for it where there is no room."""
        below, above = self._gaps(state.inside)
        return np.where(self._equal, 1.0 / _PROXIMAL, state.low / below + state.high / above)

    def _matrix(self, state: _State, curvature: FloatArray) -> FloatArray:
        """Return H + S_x + J' S_s J, its upper triangle, fixed variables apart."""
        n, J = self._n, state.now.jacobian
        matrix = self._stacked.hessian(state.point.x, state.y)
        matrix.flat[:: n + 1] += curvature[:n]
        for rows, columns in self._blocks:
            block = np.sqrt(curvature[n:][rows, None]) * J[rows][:, columns]
            at = (columns, columns) if isinstance(columns, slice) else np.ix_(columns, columns)
            matrix[at] += block.T @ block
        fixed = self._equal[:n]
        matrix[fixed] = matrix[:, fixed] = 0.0
        matrix[fixed, fixed] = 1.0
        return matrix

    def _direction(
        self, state: _State, factor: FloatArray, curvature: FloatArray, barrier: float
    ) -> _Step:
        """Return the Newton step, Eqs. (11) and (12), with slacks and multipliers eliminated."""
        n, J, slope = self._n, state.now.jacobian, self._barrier_slope(state, barrier)
        missing = state.point.bounded[n:] - state.inside[n:]
        of_slacks = np.where(self._equal[n:], 0.0, slope[n:] - state.y)
        right = state.slope + slope[:n] + (curvature[n:] * missing + of_slacks) @ J
        right[self._equal[:n]] = 0.0
        dx = dpotrs(factor, -right, lower=1)[0]
        by_rows = J @ dx + missing
        dy = curvature[n:] * by_rows + of_slacks
        move = np.concatenate([dx, np.where(self._equal[n:], 0.0, by_rows)])
        below, above = self._gaps(state.inside)
        low = barrier / below - state.low - state.low / below * move
        high = barrier / above - state.high + state.high / above * move
        primal = min(_most(below, move), _most(above, -move))
        dual = min(_most(state.low, low), _most(state.high, high))
        return _Step(move, dy, low, high, primal, dual)

    def _along(
        self, state: _State, step: _Step, barrier: float, seen: _Filter
    ) -> tuple[float, Point] | None:
        """Return the part of a step that the filter takes, and the point; Algorithm A, A-5."""
        n, slope = self._n, self._barrier_slope(state, barrier)
        violation, height = here = self._measures(state.point, state.inside, barrier)
        fall = float(state.now.gradient @ step.inside[:n] + slope @ step.inside)
        rounding = _ROUNDING * abs(height)
        kept = violation < _SWITCH * max(len(step.y), 1)
        part = step.primal
        while part >= _SHORTEST * step.primal:
            inside = state.inside + part * step.inside
            point = self._stacked.point(inside[:n])
            there = self._measures(point, inside, barrier)
            if seen.takes(there):
                if kept and _downhill(part, fall, violation):
                    if there[1] <= height + _ENOUGH * part * fall + rounding:
                        return part, point
                elif _better(there, here):
                    seen.add(here)
                    return part, point
            part /= 2.0
        return None

    def _barrier_slope(self, state: _State, barrier: float) -> FloatArray:
        """Return the gradient (n + m,) of the barriers."""
        below, above = self._gaps(state.inside)
        return np.asarray(barrier / above - barrier / below, dtype=float)

    def _measures(self, point: Point, inside: FloatArray, barrier: float) -> tuple[float, float]:
        """Return the violation of rows = slacks and the barrier function, Eq. (3a)."""
        if not np.isfinite(point.cost):
            return np.inf, np.inf
        below, above = self._gaps(inside)
        logs = np.log(below[self._below]).sum() + np.log(above[self._above]).sum()
        violation = np.abs(point.bounded - inside).sum()
        return float(violation), float(point.cost - barrier * logs)

    def _next(
        self, state: _State, step: _Step, part: float, point: Point, barrier: float
    ) -> _State:
        """Return the state after part of a step, multipliers of bounds near barrier / distance."""
        inside = state.inside + part * step.inside
        below, above = self._gaps(inside)
        low, high = state.low + step.dual * step.low, state.high + step.dual * step.high
        low = np.clip(low, barrier / (_SPREAD * below), _SPREAD * barrier / below)
        high = np.clip(high, barrier / (_SPREAD * above), _SPREAD * barrier / above)
        now = self._stacked.derivatives(point.x)
        return _State(point, now, inside, state.y + part * step.y, low, high)


def _calmer(damping: float, before: float, longest: float) -> float:
    """Return the damping to begin with after a step whose longest move is given, in units."""
    if not damping:
        return _LESS * before
    return damping * min(max(longest / _SHORT, 1.0 / _AT_ONCE), 1.0)


def _most(gaps: FloatArray, move: FloatArray) -> float:
    """Return the part of a move that keeps gaps positive, Eq. (15)."""
    closing = move < 0.0
    return float(min(1.0, (-_TO_BOUND * gaps[closing] / move[closing]).min(initial=np.inf)))


def _downhill(part: float, fall: float, violation: float) -> bool:
    """Return whether the barrier function falls by more than there is violation left, Eq. (19)."""
    if fall >= 0.0 or not violation:
        return fall < 0.0
    power = np.log(part) + _FALL_POWER * np.log(-fall)
    return bool(power > _VIOLATION_POWER * np.log(violation))


def _better(there: tuple[float, float], entry: tuple[float, float]) -> bool:
    """Return whether violation or barrier function is below that of another point, Eq. (18)."""
    least = _MARGIN * entry[0]
    return there[0] <= entry[0] - least or there[1] <= entry[1] - least


class _Filter:
    """Violation and barrier function of points that no later one may be worse than in both."""

    def __init__(self) -> None:
        self._points: list[tuple[float, float]] = []

    def add(self, point: tuple[float, float]) -> None:
        """Keep the violation and the barrier function of a point."""
        self._points.append(point)

    def takes(self, there: tuple[float, float]) -> bool:
        """Return whether a point is better in one of them than each that was kept."""
        return there[0] < np.inf and all(_better(there, point) for point in self._points)


def _blocks(problem: NonlinearProgram) -> list[tuple[IntArray, slice | IntArray]]:
    """Return groups of rows and the columns that they have in common, few and dense."""
    of_row: dict[int, set[int]] = {}
    for row, column in zip(*map(np.ndarray.tolist, problem.jacobian_entries), strict=True):
        of_row.setdefault(row, set()).add(column)
    groups: list[tuple[set[int], list[int]]] = []
    for row, columns in sorted(of_row.items(), key=lambda item: -len(item[1])):
        home = next((rows for wide, rows in groups if wide >= columns), None)
        if home is None:
            groups.append((columns, [row]))
        else:
            home.append(row)
    return [(np.array(sorted(rows)), _as_slice(sorted(columns))) for columns, rows in groups]


def _as_slice(columns: list[int]) -> slice | IntArray:
    """Return neighbouring columns as a slice."""
    adjacent = columns[-1] - columns[0] + 1 == len(columns)
    return slice(columns[0], columns[-1] + 1) if adjacent else np.array(columns)
