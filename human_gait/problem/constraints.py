"""The constraints of the paper, Eqs. (19)-(27), as residuals at instants of the step.

A residual has rows; each row belongs to one instant and knows its partials in q, v and a of the
DOF that it depends on. `program` makes gradients in control points of them. For the second
derivatives a constraint passes the multipliers of its rows on to what the rows are made of: places
and velocities of the feet, the wrench of the ground, postures (`adjoint`).

Eq. (26) needs no row here: the splines are symmetric by construction, or `program` ties their ends
(`bspline`). Eq. (19) bounds the control points, whose convex hull holds the curve.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import N_DOF, index
from human_gait.dynamics.inverse_dynamics import CHAINS
from human_gait.dynamics.jet import Jet
from human_gait.scenario import Scenario
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.contact_plan import HEEL, LEFT, RIGHT, TOE, ContactPlan
from human_gait.walk.ground_reaction import GroundReaction
from human_gait.walk.instant import Instants

Words = npt.NDArray[np.str_]

ALL = np.arange(N_DOF)
SIDES = ("right", "left")
"""In words, by number of the foot."""

_UP = 1
_FRICTION_USED = 0.95  # of the coefficient, at the constrained instants: between them it is more
_SMALL_FORCE = 1e-3  # of the weight
_POINTS = ("heel", "inner ball", "outer ball", "toe")
_PLACE, _MOTION = ("sideways", "height", "forward"), ("sideways", "vertical", "forward")
_PELVIS = index("pelvis_tz")


@dataclass(frozen=True)
class Residual:
    """Rows of one constraint: values and partials in the DOF of each row.

    Attributes
    ----------
    value : (r,) array
    dq, dv, da : (r, c) array
    """

    value: FloatArray
    dq: FloatArray
    dv: FloatArray
    da: FloatArray


@dataclass(frozen=True, eq=False)
class Constraint:
    """One constraint of the paper at the instants where it holds.

    Attributes
    ----------
    name, equation, unit : str
    lower, upper : (r,) array
    instants : (r,) int array
        Index of each row's instant on the grid.
    columns : (r, c) int array
        DOF of each row.
    what : (r,) str array
        What each row is about, in words; no two rows of one instant say the same.
    evaluate : function
        Instants of the grid -> Residual.
    pass_on : function or None
        Instants, multipliers (r,), Adjoint: adds what the rows cost to the adjoint. None where the
        rows are linear in the motion.
    """

    name: str
    equation: str
    unit: str
    lower: FloatArray
    upper: FloatArray
    instants: IntArray
    columns: IntArray
    what: Words
    evaluate: Callable[[Instants], Residual]
    pass_on: Callable[[Instants, FloatArray, Adjoint], None] | None = None

    def lean(self, now: Instants, multipliers: FloatArray, adjoint: Adjoint) -> None:
        """Add what the rows cost at multipliers (r,) to an adjoint; nothing if they are linear."""
        if self.pass_on:
            self.pass_on(now, multipliers, adjoint)

    @property
    def linear(self) -> bool:
        """Whether the rows are linear in the motion."""
        return self.pass_on is None

    def at(self, instants: IntArray) -> Constraint:
        """Return the constraint with the rows of some instants only."""
        rows = np.flatnonzero(np.isin(self.instants, instants))

        def evaluate(now: Instants) -> Residual:
            r = self.evaluate(now)
            return Residual(r.value[rows], r.dq[rows], r.dv[rows], r.da[rows])

        def pass_on(now: Instants, multipliers: FloatArray, adjoint: Adjoint) -> None:
            every = np.zeros(len(self.lower))
            every[rows] = multipliers
            self.lean(now, every, adjoint)

        lower, upper = self.lower[rows], self.upper[rows]
        k, columns, what = self.instants[rows], self.columns[rows], self.what[rows]
        rest = replace(self, lower=lower, upper=upper, what=what)
        on = None if self.linear else pass_on
        return replace(rest, instants=k, columns=columns, evaluate=evaluate, pass_on=on)


def paper_constraints(scenario: Scenario, plan: ContactPlan, times: FloatArray) -> list[Constraint]:
    """Return all constraints of the paper.

    Parameters
    ----------
    scenario : Scenario
    plan : ContactPlan
    times : (K,) array, [s]
        The grid. Forces are constrained at all of its instants; the motion of feet, pelvis and
        arms, which is smoother, at the ends of the scenario's intervals.
    """
    on = np.arange(0, len(times), scenario.discretisation.dynamics_per_interval)
    return [
        ground_penetration(plan, times, on),
        contact_position(scenario, plan, times, on),
        soft_impact(scenario, plan, times, on),
        feet_apart(scenario, plan, times, on),
        zmp_stability(plan, times),
        load_transfer(scenario, plan, times),
        ground_pushes(times, plan),
        pelvic_velocity(scenario, on),
        knee_at_mid_swing(scenario, times),
        arm_leg_coupling(scenario, on),
    ]


def friction_constraints(plan: ContactPlan, times: FloatArray) -> list[Constraint]:
    """Return what the floor's friction allows. The paper has no such limits."""
    return [sliding_friction(plan, times), turning_friction(plan, times)]


def ground_penetration(plan: ContactPlan, times: FloatArray, on: IntArray) -> Constraint:
    """Points that do not stand are above the ground, Eq. (20): y >= 0."""
    k, f, p = _points(~plan.contact(times), on)

    def evaluate(now: Instants) -> Residual:
        return _of_points(now, k, f, p, [_UP])

    def pass_on(_: Instants, multipliers: FloatArray, adjoint: Adjoint) -> None:
        adjoint.position[k, f, p, _UP] += multipliers

    lower, columns, what = np.zeros(len(k)), _chains(f, 1), _point_words(f, p, ["height"])
    return Constraint(
        "ground penetration", "20", "m", lower, lower + np.inf, k, columns, what, evaluate, pass_on
    )


def contact_position(
    scenario: Scenario, plan: ContactPlan, times: FloatArray, on: IntArray
) -> Constraint:
    """Points that stand are at their footholds on the ground, Eqs. (20), (21): x = x~, y = 0."""
    k, f, p = _points(plan.contact(times), on)
    targets = plan.footholds[f, p].ravel()
    tolerance = np.full(len(targets), scenario.tolerances.contact)

    def evaluate(now: Instants) -> Residual:
        at = _of_points(now, k, f, p, [0, 1, 2])
        return Residual(at.value - targets, at.dq, at.dv, at.da)

    def pass_on(_: Instants, multipliers: FloatArray, adjoint: Adjoint) -> None:
        adjoint.position[k, f, p] += multipliers.reshape(-1, 3)

    instants, columns, what = np.repeat(k, 3), _chains(f, 3), _point_words(f, p, _PLACE)
    bounds = -tolerance, tolerance
    return Constraint(
        "contact position", "20, 21", "m", *bounds, instants, columns, what, evaluate, pass_on
    )


def soft_impact(
    scenario: Scenario, plan: ContactPlan, times: FloatArray, on: IntArray
) -> Constraint:
    """Points that stand do not move, Eq. (24): their velocity is zero."""
    k, f, p = _points(plan.contact(times), on)
    tolerance = np.full(3 * len(k), scenario.tolerances.contact_speed)

    def evaluate(now: Instants) -> Residual:
        value, dq, dv = (
            _picked(now, name, k, f, p) for name in ("velocity", "velocity_dq", "jacobian")
        )
        return Residual(value.ravel(), _rows(dq), _rows(dv), 0.0 * _rows(dv))

    def pass_on(_: Instants, multipliers: FloatArray, adjoint: Adjoint) -> None:
        adjoint.velocity[k, f, p] += multipliers.reshape(-1, 3)

    instants, columns, what = np.repeat(k, 3), _chains(f, 3), _point_words(f, p, _MOTION)
    bounds = -tolerance, tolerance
    return Constraint(
        "soft impact", "24", "m/s", *bounds, instants, columns, what, evaluate, pass_on
    )


def feet_apart(
    scenario: Scenario, plan: ContactPlan, times: FloatArray, on: IntArray
) -> Constraint:
    """The swing foot passes the standing one: it does not move through that leg.

    Not in the paper. Heel and toe tip stay on their side by ``tolerances.feet_apart``.
    """
    swing = on[~plan.double_support(times[on])]
    k, p = np.repeat(swing, 2), np.tile([HEEL, TOE], len(swing))
    lower, legs = np.full(len(k), scenario.tolerances.feet_apart), np.unique(CHAINS)

    def evaluate(now: Instants) -> Residual:
        value = now.feet[LEFT].position[k, p, 0] - now.feet[RIGHT].position[k, p, 0]
        dq = np.zeros((len(k), len(legs)))
        for f, sign in ((LEFT, 1.0), (RIGHT, -1.0)):
            dq[:, np.searchsorted(legs, CHAINS[f])] += sign * now.feet[f].jacobian[k, p, 0]
        return Residual(value, dq, 0.0 * dq, 0.0 * dq)

    def pass_on(_: Instants, multipliers: FloatArray, adjoint: Adjoint) -> None:
        adjoint.position[k, LEFT, p, 0] += multipliers
        adjoint.position[k, RIGHT, p, 0] -= multipliers

    what = np.tile(["right heel past the left one", "right toe past the left one"], len(swing))
    bounds, columns = (lower, lower + np.inf), np.tile(legs, (len(k), 1))
    return Constraint("feet apart", "", "m", *bounds, k, columns, what, evaluate, pass_on)


def zmp_stability(plan: ContactPlan, times: FloatArray) -> Constraint:
    """The ZMP is in the foot support region, Eq. (22), and so is the pressure of each foot.

    Written as (p - bound) R_y / weight >= 0, which is linear in the wrench of the ground and tame
    where R_y is small; division by R_y is neither.
    """
    region = plan.pressure_region(times)
    feet = [(RIGHT, np.flatnonzero(plan.double_support(times))), (LEFT, np.arange(len(times)))]
    weight = plan.weight

    def rows(ground: GroundReaction) -> list[Jet]:
        share = ground.force[:, 1] / weight
        return [
            sign * (ground.pressure[f][k] - region[k, f, side]) * _twice(share[k])
            for f, k in feet
            for side, sign in enumerate((1.0, -1.0))
        ]

    k = np.concatenate([np.repeat(k, 2) for _, k in feet for _ in range(2)])
    edges = [[("outer", "rear"), ("inner", "front")], [("inner", "rear"), ("outer", "front")]]
    words = [
        f"{SIDES[f]} foot, {edge} edge"
        for f, k in feet
        for two in edges[f]
        for _ in k
        for edge in two
    ]
    return _of_wrench("ZMP stability", "22", "m", 0.0, k, np.array(words), rows)


def load_transfer(scenario: Scenario, plan: ContactPlan, times: FloatArray) -> Constraint:
    """Double support hands the load over evenly, from all on A to all on B of Eq. (17).

    The share that the ZMP gives to the leading foot follows the time to within a tolerance, and
    at both ends it is at most 0 and at least 1: no foot takes or loses load in a jump.
    """
    k = np.flatnonzero(plan.double_support(times))
    A, B = (point[k][:, [0, 2]] for point in plan.transfer_points(times))
    along = (B - A) / np.sum((B - A) ** 2, axis=1, keepdims=True)
    even = plan.fraction(times[k]) / plan.phases.double_support
    tolerance, weight = scenario.tolerances.load_transfer, plan.weight
    least = np.where(even >= 1.0, 1.0, even - tolerance)
    most = np.where(even <= 0.0, 0.0, even + tolerance)

    def rows(ground: GroundReaction) -> list[Jet]:
        offset = (ground.zmp[k] - A) * along
        share, push = offset[:, 0] + offset[:, 1], ground.force[k, 1] / weight
        return [(share - least) * push, (most - share) * push]

    what = np.repeat(["left foot loaded too late", "left foot loaded too early"], len(k))
    return _of_wrench("load transfer", "17", "of the load", 0.0, np.tile(k, 2), what, rows)


def ground_pushes(times: FloatArray, plan: ContactPlan) -> Constraint:
    """The ground pushes, it does not pull: R_y is at least a tenth of the weight."""
    k, weight = np.arange(len(times)), plan.weight
    what = _same(k, "vertical force, both feet")

    def rows(ground: GroundReaction) -> list[Jet]:
        return [ground.force[:, 1] / weight]

    return _of_wrench("ground pushes", "17", "body weight", 0.1, k, what, rows)


def sliding_friction(plan: ContactPlan, times: FloatArray) -> Constraint:
    """No foot slides: its horizontal force is at most mu times its vertical one.

    The horizontal force is rounded where it is near zero.
    """
    feet = [(RIGHT, np.flatnonzero(plan.double_support(times))), (LEFT, np.arange(len(times)))]
    mu, weight = _FRICTION_USED * plan.friction, plan.weight

    def rows(ground: GroundReaction) -> list[Jet]:
        forces = [ground.wrenches[f][k] / weight for f, k in feet]
        return [mu * F[:, 1] - _length(F[:, 0], F[:, 2]) for F in forces]

    k = np.concatenate([k for _, k in feet])
    what = np.array([f"{SIDES[f]} foot, horizontal force" for f, k in feet for _ in k])
    return _of_wrench("sliding friction", "", "body weight", 0.0, k, what, rows)


def turning_friction(plan: ContactPlan, times: FloatArray) -> Constraint:
    """The feet do not turn on the ground: |M_y,zmp| <= mu R_y r, r of the foot support region."""
    k, weight = np.arange(len(times)), plan.weight
    holds = _FRICTION_USED * plan.friction * _least_radius(plan, times)

    def rows(ground: GroundReaction) -> list[Jet]:
        most, moment = holds * ground.force[:, 1], ground.yaw_moment
        return [(most - moment) / weight, (most + moment) / weight]

    what = np.repeat(["vertical moment, to the left", "vertical moment, to the right"], len(k))
    return _of_wrench("turning friction", "", "m", 0.0, np.tile(k, 2), what, rows)


def _least_radius(plan: ContactPlan, times: FloatArray) -> FloatArray:
    """Return the turning radius (K,) that is left until the next instant, [m].

    The step before ends where this one starts, on one foot: at heel strike the other has no load.
    """
    radius = plan.turning_radius(np.append(times, plan.walk.step_time))
    least = np.minimum(radius[:-1], radius[1:])
    least[times == 0.0] = np.minimum(least[times == 0.0], radius[-1])
    return least


def pelvic_velocity(scenario: Scenario, on: IntArray) -> Constraint:
    """The pelvis moves forward at the walking speed, Eq. (23)."""
    k = on
    tolerance = np.full(len(k), scenario.tolerances.pelvis_speed)
    speed, one = scenario.walk.speed, np.ones((len(k), 1))

    def evaluate(now: Instants) -> Residual:
        return Residual(now.v[k, _PELVIS] - speed, 0 * one, one, 0 * one)

    columns, what = np.full((len(k), 1), _PELVIS), _same(k, "pelvis, forward")
    return Constraint(
        "pelvic velocity", "23", "m/s", -tolerance, tolerance, k, columns, what, evaluate
    )


def knee_at_mid_swing(scenario: Scenario, times: FloatArray) -> Constraint:
    """The knee of the swing leg is bent by 60 degrees at mid-swing, Eq. (25)."""
    knee = index("knee_flexion_r")
    middle = scenario.phases.mid_swing * scenario.walk.step_time
    k = np.array([np.argmin(np.abs(times - middle))])
    tolerance, one = np.deg2rad([scenario.tolerances.knee_flexion_deg]), np.ones((1, 1))

    def evaluate(now: Instants) -> Residual:
        return Residual(now.q[k, knee] - np.deg2rad(60.0), one, 0 * one, 0 * one)

    columns, what = np.array([[knee]]), _same(k, "right knee, flexion")
    return Constraint(
        "knee at mid-swing", "25", "rad", -tolerance, tolerance, k, columns, what, evaluate
    )


def arm_leg_coupling(scenario: Scenario, on: IntArray) -> Constraint:
    """Arm and leg of a side swing in opposite directions, Eq. (27): product of flexions <= 0.

    Relaxed by a small amount: where both angles pass zero together the gradient vanishes.
    """
    joints = ("shoulder_flexion", "hip_flexion")
    pairs = np.array([[index(f"{joint}_{side}") for joint in joints] for side in "rl"])
    k = np.repeat(on, 2)
    columns = np.tile(pairs, (len(on), 1))
    upper = np.full(len(k), scenario.tolerances.arm_leg)
    what = np.tile([f"{side} shoulder against {side} hip" for side in SIDES], len(on))

    def evaluate(now: Instants) -> Residual:
        angles = now.q[k[:, None], columns]
        dq = angles[:, ::-1]
        return Residual(angles.prod(axis=1), dq, 0.0 * dq, 0.0 * dq)

    def pass_on(_: Instants, multipliers: FloatArray, adjoint: Adjoint) -> None:
        arm, leg = columns.T
        adjoint.posture_second[k, arm, leg] += multipliers
        adjoint.posture_second[k, leg, arm] += multipliers

    bounds = upper - np.inf, upper
    return Constraint(
        "arm-leg coupling", "27", "rad^2", *bounds, k, columns, what, evaluate, pass_on
    )


def _points(chosen: npt.NDArray[np.bool_], on: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return instant, foot and point of the chosen points (K, 2, 4) at the instants `on`."""
    k, f, p = np.nonzero(chosen[on])
    return on[k], f, p


def _of_points(now: Instants, k: IntArray, f: IntArray, p: IntArray, axes: list[int]) -> Residual:
    value = _picked(now, "position", k, f, p)[:, axes].ravel()
    dq = _rows(_picked(now, "jacobian", k, f, p)[:, axes])
    return Residual(value, dq, 0.0 * dq, 0.0 * dq)


def _picked(now: Instants, name: str, k: IntArray, f: IntArray, p: IntArray) -> FloatArray:
    """Return one quantity of the feet at instants k, feet f, points p."""
    both = np.stack([getattr(foot, name) for foot in now.feet])
    return np.asarray(both[f, k, p])


def _rows(partials: FloatArray) -> FloatArray:
    return partials.reshape(-1, partials.shape[-1])


def _chains(f: IntArray, rows: int) -> IntArray:
    """Return the columns of `rows` rows for each of the feet f."""
    return np.repeat(np.stack(CHAINS)[f], rows, axis=0)


def _point_words(f: IntArray, p: IntArray, axes: Iterable[str]) -> Words:
    """Return what the rows of points p of the feet f are about, an axis each."""
    pairs = zip(f, p, strict=True)
    return np.array([f"{SIDES[i]} {_POINTS[j]}, {axis}" for i, j in pairs for axis in axes], str)


def _same(k: IntArray, words: str) -> Words:
    return np.full(len(k), words)


def _all(k: IntArray) -> IntArray:
    return np.tile(ALL, (len(k), 1))


def _length(x: Jet, z: Jet) -> Jet:
    """Return the length of a vector, smooth at zero: sqrt(x^2 + z^2 + s^2) - s."""
    square = x * x + z * z + _SMALL_FORCE**2
    root = square.map(np.sqrt, lambda y: 0.5 / np.sqrt(y), lambda y: -0.25 / y**1.5)
    return root - _SMALL_FORCE


def _twice(share: Jet) -> Jet:
    return share[:, None][:, [0, 0]]


def _of_wrench(
    name: str,
    equation: str,
    unit: str,
    least: float,
    k: IntArray,
    what: Words,
    rows: Callable[[GroundReaction], list[Jet]],
) -> Constraint:
    """Return the constraint that quantities of the ground reaction are at least so much.

    `rows` gives them at the instants k (r,), in jets of any shape that follow each other.
    """

    def joined(ground: GroundReaction) -> Jet:
        parts = rows(ground)
        value = np.concatenate([part.value.ravel() for part in parts])
        partials = np.concatenate([part.partials.reshape(-1, 6) for part in parts])
        return Jet(value, partials, np.concatenate([p.second.reshape(-1, 6, 6) for p in parts]))

    def evaluate(now: Instants) -> Residual:
        r = joined(now.ground)
        by_state = r.partials[:, None] @ now.ground.wrench.partials[k]
        return Residual(r.value, *np.split(by_state[:, 0], 3, axis=1))

    def pass_on(now: Instants, multipliers: FloatArray, adjoint: Adjoint) -> None:
        r = joined(now.ground)
        np.add.at(adjoint.wrench, k, multipliers[:, None] * r.partials)
        np.add.at(adjoint.wrench_second, k, multipliers[:, None, None] * r.second)

    lower = np.full(len(k), least)
    bounds = lower, lower + np.inf
    return Constraint(name, equation, unit, *bounds, k, _all(k), what, evaluate, pass_on)
