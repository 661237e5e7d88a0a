"""What the ground can give: Eqs. (17), (22) and, where a scenario needs it, friction.

All rows are functions of the variables of the ground alone: its wrench and, by least effort, how
far the forces of the feet lean.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import N_DOF, SIDES_IN_WORDS
from human_gait.dynamics.jet import Jet
from human_gait.problem.residual import (
    Constraint,
    Demand,
    Residual,
    Tolerance,
    Words,
    same_words,
)
from human_gait.scenario import Scenario
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.contact_plan import LEFT, RIGHT, ContactPlan
from human_gait.walk.ground_reaction import GroundReaction
from human_gait.walk.instant import Instants

ZMP_STABILITY = Demand(
    name="ZMP stability",
    equation="22",
    meaning="the pressure has to stay under the foot",
    tolerance=Tolerance("zmp_margin", upwards=False),
)
LOAD_TRANSFER = Demand(
    name="load transfer",
    equation="17",
    meaning="the load has to pass evenly from foot to foot",
    tolerance=Tolerance("load_transfer", upwards=True),
)
GROUND_PUSHES = Demand(
    name="ground pushes",
    equation="17",
    meaning="the ground cannot pull",
)
SLIDING_FRICTION = Demand(
    name="sliding friction",
    meaning="the floor can hold a foot only by friction",
)
TURNING_FRICTION = Demand(
    name="turning friction",
    meaning="the floor can hold a foot only by friction",
)

_ALL = np.arange(N_DOF)
_FRICTION_USED = 0.95  # of the coefficient, at the constrained instants: between them it is more
_SMALL_FORCE = 1e-3  # of the weight

RowsOfGround = Callable[[GroundReaction], list[Jet]]


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
        f"{SIDES_IN_WORDS[f]} foot, {edge} edge"
        for f, k in feet
        for two in edges[f]
        for _ in k
        for edge in two
    ]
    return _of_ground(ZMP_STABILITY, "m", 0.0, k, np.array(words), rows)


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
    return _of_ground(LOAD_TRANSFER, "of the load", 0.0, np.tile(k, 2), what, rows)


def ground_pushes(times: FloatArray, plan: ContactPlan) -> Constraint:
    """The ground pushes, it does not pull: R_y is at least a tenth of the weight."""
    k, weight = np.arange(len(times)), plan.weight

    def rows(ground: GroundReaction) -> list[Jet]:
        return [ground.force[:, 1] / weight]

    what = same_words(k, "vertical force, both feet")
    return _of_ground(GROUND_PUSHES, "body weight", 0.1, k, what, rows)


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
    what = np.array([f"{SIDES_IN_WORDS[f]} foot, horizontal force" for f, k in feet for _ in k])
    return _of_ground(SLIDING_FRICTION, "body weight", 0.0, k, what, rows)


def turning_friction(plan: ContactPlan, times: FloatArray) -> Constraint:
    """The feet do not turn on the ground: |M_y,zmp| <= mu R_y r, r of the foot support region."""
    k, weight = np.arange(len(times)), plan.weight
    holds = _FRICTION_USED * plan.friction * _least_radius(plan, times)

    def rows(ground: GroundReaction) -> list[Jet]:
        most, moment = holds * ground.force[:, 1], ground.yaw_moment
        return [(most - moment) / weight, (most + moment) / weight]

    what = np.repeat(["vertical moment, to the left", "vertical moment, to the right"], len(k))
    return _of_ground(TURNING_FRICTION, "m", 0.0, np.tile(k, 2), what, rows)


def _least_radius(plan: ContactPlan, times: FloatArray) -> FloatArray:
    """Return the turning radius (K,) that is left until the next instant, [m].

    The step before ends where this one starts, on one foot: at heel strike the other has no load.
    """
    radius = plan.turning_radius(np.append(times, plan.walk.step_time))
    least = np.minimum(radius[:-1], radius[1:])
    least[times == 0.0] = np.minimum(least[times == 0.0], radius[-1])
    return least


def _length(x: Jet, z: Jet) -> Jet:
    """Return the length of a vector, smooth at zero: sqrt(x^2 + z^2 + s^2) - s."""
    square = x * x + z * z + _SMALL_FORCE**2
    root = square.map(np.sqrt, lambda y: 0.5 / np.sqrt(y), lambda y: -0.25 / y**1.5)
    return root - _SMALL_FORCE


def _twice(share: Jet) -> Jet:
    return share[:, None][:, [0, 0]]


def _of_ground(
    demand: Demand, unit: str, least: float, k: IntArray, what: Words, rows: RowsOfGround
) -> Constraint:
    """Return the constraint that quantities r of the ground reaction are at least so much.

    They depend on the motion x = (q, v, a) through the variables y of the ground alone, so that

        dr/dx = dr/dy dy/dx,

    and with multipliers m the Lagrangian has the slopes m dr/dy and m d2r/dy2; the adjoint carries
    them on (`Walker.second_derivatives`). At one instant y is the same for all of its rows: their
    slopes add up.

    Parameters
    ----------
    k : (r,) int array
        Instant of each row.
    rows : function
        The ground reaction -> jets of any shape, which follow each other at the instants `k`.
    """
    last: list[tuple[Instants, Jet]] = []

    @lru_cache
    def places(n: int) -> IntArray:
        """Return where the n variables of each row are among those of all instants."""
        return (k[:, None] * n + np.arange(n)).ravel()

    def known(now: Instants) -> Jet:
        """Return the rows at the instants, without computing the last ones again."""
        if not last or last[0][0] is not now:
            last[:] = [(now, _flat(rows(now.ground)))]
        return last[0][1]

    def evaluate(now: Instants) -> Residual:
        r, dy_dx = known(now), now.ground.variables.partials
        n = dy_dx.shape[1]
        starts = np.arange(0, r.partials.size + 1, n)
        by_ground = csr_array((r.partials.ravel(), places(n), starts), (len(k), len(dy_dx) * n))
        dr_dx = by_ground @ dy_dx.reshape(-1, 3 * N_DOF)
        return Residual(r.value, *np.split(dr_dx, 3, axis=1))

    def to_adjoint(
        now: Instants, multipliers: FloatArray, curvature: FloatArray, adjoint: Adjoint
    ) -> None:
        r = known(now)
        np.add.at(adjoint.ground, k, multipliers[:, None] * r.partials)
        second = multipliers[:, None, None] * r.second
        second += (curvature[:, None] * r.partials)[:, :, None] * r.partials[:, None]
        np.add.at(adjoint.ground_second, k, second)

    lower = np.full(len(k), least)
    return Constraint(
        demand=demand,
        unit=unit,
        lower=lower,
        upper=lower + np.inf,
        instants=k,
        columns=np.tile(_ALL, (len(k), 1)),
        what=what,
        evaluate=evaluate,
        to_adjoint=to_adjoint,
    )


def _flat(jets: list[Jet]) -> Jet:
    """Return jets of the variables of the ground one after the other as one (r,)."""
    n = jets[0].partials.shape[-1]
    return Jet(
        np.concatenate([jet.value.ravel() for jet in jets]),
        np.concatenate([jet.partials.reshape(-1, n) for jet in jets]),
        np.concatenate([jet.second.reshape(-1, n, n) for jet in jets]),
    )
