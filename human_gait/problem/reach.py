"""Whether the feet can be where the plan wants them: postures that come nearest to it.

Positions alone, without forces: at some instants of the step the legs are to reach the footholds,
clear the ground and pass each other within the limits of the joints, while the pelvis goes on at
the walking speed. A violation that no posture avoids is left by every walk.

The squares of what is beyond a bound are minimised by damped Gauss-Newton steps within the limits,
from the first guess and from postures at random: a posture that keeps everything has none left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from human_gait.arrays import BoolArray, FloatArray, IntArray
from human_gait.body.limits import joint_limits
from human_gait.body.skeleton import N_DOF, index
from human_gait.problem.constraints import with_rows
from human_gait.problem.contact_rows import contact_position, feet_apart, ground_penetration
from human_gait.problem.posture_rows import arm_leg_coupling
from human_gait.problem.residual import Constraint
from human_gait.scenario import Scenario
from human_gait.walk.bspline import Basis
from human_gait.walk.initial_guess import initial_guess
from human_gait.walk.instant import Walker

MISSED = 0.02
"""What counts as out of reach, beyond all tolerances, [m]: twice what the checks allow."""

_KEPT = 0.005  # [m]: on the way to what is kept
_STARTS, _STEPS = 4, 200
_SAME = 0.01  # of what is missed: two starts that end alike are believed
_SETTLED = 1e-9  # of the squares: slow progress ends in what is kept, too
_LONGEST_STEP = 0.5  # [rad or m]
_PACE = 1.5  # the pelvis between instants, in tolerances of Eq. (23) at them
_FORWARD = index("pelvis_tz")
_RANDOM = slice(3, 20)  # joints of the pelvis and the legs
_WIDEST = 2.5  # [rad] of a range to draw from


@dataclass(frozen=True)
class Nearest:
    """Postures at instants of the step that keep the plan as well as limits allow.

    Attributes
    ----------
    q : (K, 55) array, [rad] and [m]
    missed : float, [m]
        Of the worst row, beyond its bounds.
    what : str
        The worst row in words.
    slope : (K, 55) array
        Of half the sum of squares, by the postures: where it is not 0 a limit is in the way.
    stuck : (K, 55) bool array
        Which joints are at the limit that they would have to pass.
    """

    q: FloatArray
    missed: float
    what: str
    slope: FloatArray
    stuck: BoolArray

    @property
    def in_the_way(self) -> FloatArray:
        """How much each DOF (55,) at a limit would help."""
        return np.asarray(np.where(self.stuck, np.abs(self.slope), 0.0).max(axis=0))


def nearest(
    scenario: Scenario,
    walker: Walker,
    basis: Basis,
    limits: tuple[FloatArray, FloatArray] | None = None,
) -> Nearest:
    """Return the postures that come nearest to the plan of a scenario.

    Parameters
    ----------
    scenario : Scenario
    walker : Walker
    basis : Basis
    limits : two (55,) arrays, optional
        Instead of those of the scenario, [rad] and [m].
    """
    task = _Task(scenario, walker, limits or joint_limits(scenario))
    points = initial_guess(scenario, walker.body, walker.plan, basis)
    guess = basis.matrix(task.t) @ basis.expand(points)
    rng, best = np.random.default_rng(0), task.followed(guess)
    for _ in range(_STARTS - 1):
        if best.missed <= _KEPT:
            break
        other = guess.copy()
        low, high = (np.clip(limit, -_WIDEST, _WIDEST)[_RANDOM] for limit in task.limits)
        other[:, _RANDOM] = rng.uniform(low, high, other[:, _RANDOM].shape)
        found = task.followed(other)
        same = abs(found.missed - best.missed) < _SAME * best.missed
        best = min(best, found, key=lambda one: one.missed)
        if same:
            break
    return best


class _Task:
    """What is asked of the postures, at the first and the last instant of each set of contacts."""

    def __init__(
        self, scenario: Scenario, walker: Walker, limits: tuple[FloatArray, FloatArray]
    ) -> None:
        self.walker, self.walk = walker, scenario.walk
        self.t = _instants(scenario, walker)
        on = np.arange(len(self.t))
        plan, pace = walker.plan, _PACE * scenario.tolerances.pelvis_speed
        rows = [
            contact_position(scenario, plan, self.t, on),
            ground_penetration(plan, self.t, on),
            feet_apart(scenario, plan, self.t, on),
            arm_leg_coupling(scenario, on),
        ]
        self.rows = with_rows(rows)
        self.used = np.unique(np.concatenate([c.columns.ravel() for c in self.rows]))
        gaps = np.diff(np.append(self.t, self.walk.step_time))
        self.pace = gaps * (self.walk.speed - pace), gaps * (self.walk.speed + pace)
        lower, upper = (limit.copy() for limit in limits)
        upper[_FORWARD] += self.walk.step_length  # control points of the next step are further on
        self.limits = lower, upper

    def followed(self, q: FloatArray) -> Nearest:
        """Return where damped Gauss-Newton steps from postures (K, 55) lead."""
        q = np.clip(q, *self.limits)
        found, damping = self._seen(q), 1e-4
        for _ in range(_STEPS):
            if found.worst <= _KEPT or damping > 1e4:
                break
            other = self._seen(np.clip(q + self._step(found, damping), *self.limits))
            better = other.squares < found.squares
            damping = max(damping / 5.0, 1e-9) if better else 5.0 * damping
            if better:
                settled = found.squares - other.squares < _SETTLED * found.squares
                q, found = other.q, other
                if settled:
                    break
        slope = np.zeros_like(q)
        slope[:, self.used] = found.slope.reshape(len(q), -1)
        return Nearest(q, found.worst, found.what, slope, self._stuck(q, slope))

    def _seen(self, q: FloatArray) -> _Seen:
        """Return what is beyond the bounds at postures (K, 55), with slopes."""
        now = self.walker.at(self.t, q, 0.0 * q, 0.0 * q)
        K, n = len(q), len(self.used)
        squares, matrix = 0.0, np.zeros((K, n, K, n))
        slope, worst, what = np.zeros((K, n)), 0.0, ""
        for constraint in self.rows:
            rows = constraint.evaluate(now)
            off = _beyond(rows.value, constraint.lower, constraint.upper)
            J = self._dense(constraint, rows.dq)[off != 0.0]
            at, e = constraint.instants[off != 0.0], off[off != 0.0]
            squares += float(e @ e)
            np.add.at(slope, at, J * e[:, None])
            for k in np.unique(at):
                matrix[k, :, k] += J[at == k].T @ J[at == k]
            if len(e) and np.abs(off).max() > worst:
                row = int(np.argmax(np.abs(off)))
                worst, what = float(np.abs(off[row])), str(constraint.what[row])
        z = int(np.searchsorted(self.used, _FORWARD))
        off = _beyond(self._advance(q[:, _FORWARD]), *self.pace)
        D = np.roll(np.eye(K), 1, axis=1) - np.eye(K)  # z_k+1 - z_k, the next step's z_0 the last
        squares += float(off @ off)
        slope[:, z] += off @ D
        matrix[:, z, :, z] += D[off != 0.0].T @ D[off != 0.0]
        if np.abs(off).max() > worst:
            worst, what = float(np.abs(off).max()), "pelvis, forward"
        return _Seen(q, squares, slope.ravel(), matrix.reshape(K * n, K * n), worst, what)

    def _advance(self, z: FloatArray) -> FloatArray:
        """Return how far the pelvis moves from each instant to the next, (K,), [m]."""
        return np.diff(np.append(z, z[0] + self.walk.step_length))

    def _dense(self, constraint: Constraint, dq: FloatArray) -> FloatArray:
        """Return partials (r, n) by the DOF that are used."""
        full = np.zeros((len(dq), len(self.used)))
        np.put_along_axis(full, np.searchsorted(self.used, constraint.columns), dq, axis=1)
        return full

    def _stuck(self, q: FloatArray, slope: FloatArray) -> BoolArray:
        lower, upper = self.limits
        return (q <= lower) & (slope > 0.0) | (q >= upper) & (slope < 0.0)

    def _step(self, found: _Seen, damping: float) -> FloatArray:
        """Return a step (K, 55) that leaves alone what is stuck."""
        K = len(found.q)
        whole = np.zeros((K, N_DOF))
        whole[:, self.used] = found.slope.reshape(K, -1)
        free = ~self._stuck(found.q, whole)[:, self.used].ravel()
        H = found.matrix[np.ix_(free, free)]
        H[np.diag_indices(len(H))] += damping
        step = np.zeros(len(free))
        step[free] = np.linalg.solve(H, -found.slope[free])
        step *= min(1.0, _LONGEST_STEP / max(np.abs(step).max(), 1e-12))
        whole[:, self.used] = step.reshape(K, -1)
        return whole


@dataclass(frozen=True)
class _Seen:
    """Half the squares of what is beyond bounds, as far as a Gauss-Newton step needs it."""

    q: FloatArray
    squares: float
    slope: FloatArray
    matrix: FloatArray
    worst: float
    what: str


def _beyond(value: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Return by how much rows are above (positive) or below (negative) their bounds."""
    return np.maximum(value - upper, 0.0) - np.maximum(lower - value, 0.0)


def _instants(scenario: Scenario, walker: Walker) -> FloatArray:
    """Return the instants (K,) of the grid where the contacts change, before and after, [s]."""
    grid, T = scenario.discretisation, scenario.walk.step_time
    t = np.arange(grid.intervals) * T / grid.intervals
    touching = walker.plan.contact(t).reshape(len(t), -1)
    change: IntArray = np.flatnonzero((touching[1:] != touching[:-1]).any(axis=1))
    return np.asarray(t[np.unique(np.concatenate([[0], change, change + 1, [len(t) - 1]]))])
