"""Where the feet stand and swing: Eqs. (20), (21), (24), and that they pass each other."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from human_gait.arrays import BoolArray, FloatArray, IntArray
from human_gait.body.skeleton import SIDES_IN_WORDS
from human_gait.dynamics.inverse_dynamics import CHAINS
from human_gait.problem.residual import Constraint, Demand, Residual, Tolerance, Words
from human_gait.scenario import Scenario
from human_gait.walk.adjoint import Adjoint, Block
from human_gait.walk.contact_plan import HEEL, LEFT, RIGHT, TOE, ContactPlan
from human_gait.walk.instant import Instants

GROUND_PENETRATION = Demand(
    name="ground penetration",
    equation="20",
    meaning="the swinging foot has to clear the ground",
)
CONTACT_POSITION = Demand(
    name="contact position",
    equation="20, 21",
    meaning="a standing foot has to stay where it was put down",
    tolerance=Tolerance("contact", upwards=True),
)
SOFT_IMPACT = Demand(
    name="soft impact",
    equation="24",
    meaning="a standing foot has to rest",
    tolerance=Tolerance("contact_speed", upwards=True),
)
FEET_APART = Demand(
    name="feet apart",
    meaning="the swinging foot has to pass beside the other leg",
    tolerance=Tolerance("feet_apart", upwards=False),
)

_UP = 1
_POINTS = ("heel", "inner ball", "outer ball", "toe")
_PLACE, _MOTION = ("sideways", "height", "forward"), ("sideways", "vertical", "forward")


def ground_penetration(plan: ContactPlan, times: FloatArray, on: IntArray) -> Constraint:
    """Points that do not stand are above the ground, Eq. (20): y >= 0."""
    points = _Points.where(~plan.contact(times), on)
    k, f, p = points.k, points.f, points.p

    def evaluate(now: Instants) -> Residual:
        return points.positions(now, [_UP])

    def to_adjoint(
        _: Instants, multipliers: FloatArray, curvature: FloatArray, adjoint: Adjoint
    ) -> None:
        adjoint.contact_position[k, f, p, _UP] += multipliers
        adjoint.contact_position_second[k, f, p, _UP] += curvature

    lower = np.zeros(len(k))
    return Constraint(
        demand=GROUND_PENETRATION,
        unit="m",
        lower=lower,
        upper=lower + np.inf,
        instants=k,
        columns=points.columns(1),
        what=points.words(["height"]),
        evaluate=evaluate,
        to_adjoint=to_adjoint,
    )


def contact_position(
    scenario: Scenario, plan: ContactPlan, times: FloatArray, on: IntArray
) -> Constraint:
    """Points that stand are at their footholds on the ground, Eqs. (20), (21): x = x~, y = 0."""
    points = _Points.where(plan.contact(times), on)
    k, f, p = points.k, points.f, points.p
    targets = plan.footholds[f, p].ravel()
    aside, up = scenario.tolerances.contact, scenario.tolerances.contact_height
    tolerance = np.tile([aside, up, aside], len(k))

    def evaluate(now: Instants) -> Residual:
        at = points.positions(now, [0, 1, 2])
        return Residual(at.value - targets, at.dq, at.dv, at.da)

    def to_adjoint(
        _: Instants, multipliers: FloatArray, curvature: FloatArray, adjoint: Adjoint
    ) -> None:
        adjoint.contact_position[k, f, p] += multipliers.reshape(-1, 3)
        adjoint.contact_position_second[k, f, p] += curvature.reshape(-1, 3)

    return Constraint(
        demand=CONTACT_POSITION,
        unit="m",
        lower=-tolerance,
        upper=tolerance,
        instants=np.repeat(k, 3),
        columns=points.columns(3),
        what=points.words(_PLACE),
        evaluate=evaluate,
        to_adjoint=to_adjoint,
    )


def soft_impact(plan: ContactPlan, times: FloatArray, on: IntArray) -> Constraint:
    """Points that stand do not move, Eq. (24): their velocity is zero."""
    points = _Points.where(plan.contact(times), on)
    k, f, p = points.k, points.f, points.p
    tolerance = np.repeat(plan.allowed_speed(times)[k, f, p], 3)

    def evaluate(now: Instants) -> Residual:
        value, dq, dv = (
            points.picked(now, name) for name in ("velocity", "velocity_dq", "jacobian")
        )
        return Residual(value.ravel(), _rows(dq), _rows(dv), 0.0 * _rows(dv))

    def to_adjoint(
        _: Instants, multipliers: FloatArray, curvature: FloatArray, adjoint: Adjoint
    ) -> None:
        adjoint.contact_velocity[k, f, p] += multipliers.reshape(-1, 3)
        adjoint.contact_velocity_second[k, f, p] += curvature.reshape(-1, 3)

    return Constraint(
        demand=SOFT_IMPACT,
        unit="m/s",
        lower=-tolerance,
        upper=tolerance,
        instants=np.repeat(k, 3),
        columns=points.columns(3),
        what=points.words(_MOTION),
        evaluate=evaluate,
        to_adjoint=to_adjoint,
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

    def slopes(now: Instants) -> FloatArray:
        dq = np.zeros((len(k), len(legs)))
        for f, sign in ((LEFT, 1.0), (RIGHT, -1.0)):
            dq[:, np.searchsorted(legs, CHAINS[f])] += sign * now.feet[f].jacobian[k, p, 0]
        return dq

    def evaluate(now: Instants) -> Residual:
        value = now.feet[LEFT].position[k, p, 0] - now.feet[RIGHT].position[k, p, 0]
        dq = slopes(now)
        return Residual(value, dq, 0.0 * dq, 0.0 * dq)

    def to_adjoint(
        now: Instants, multipliers: FloatArray, curvature: FloatArray, adjoint: Adjoint
    ) -> None:
        adjoint.contact_position[k, LEFT, p, 0] += multipliers
        adjoint.contact_position[k, RIGHT, p, 0] -= multipliers
        J = slopes(now).reshape(len(swing), 2, -1)
        squares = (J.swapaxes(1, 2) * curvature.reshape(-1, 1, 2)) @ J
        second = np.zeros((len(now.q), len(legs), len(legs)))
        second[swing] = squares
        adjoint.blocks.append(Block(legs, second))

    return Constraint(
        demand=FEET_APART,
        unit="m",
        lower=lower,
        upper=lower + np.inf,
        instants=k,
        columns=np.tile(legs, (len(k), 1)),
        what=np.tile(["right heel past the left one", "right toe past the left one"], len(swing)),
        evaluate=evaluate,
        to_adjoint=to_adjoint,
    )


@dataclass(frozen=True)
class _Points:
    """Contact points of the feet at instants of the grid.

    Attributes
    ----------
    k, f, p : (n,) int array
        Instant, foot and number of each point.
    """

    k: IntArray
    f: IntArray
    p: IntArray

    @classmethod
    def where(cls, chosen: BoolArray, on: IntArray) -> _Points:
        """Return the chosen points (K, 2, 4) at the instants `on`."""
        k, f, p = np.nonzero(chosen[on])
        return cls(on[k], f, p)

    def picked(self, now: Instants, name: str) -> FloatArray:
        """Return one quantity of the feet (n, ...) at the points."""
        both = np.stack([getattr(foot, name) for foot in now.feet])
        return np.asarray(both[self.f, self.k, self.p])

    def positions(self, now: Instants, axes: list[int]) -> Residual:
        """Return where the points are along some axes, a row each."""
        value = self.picked(now, "position")[:, axes].ravel()
        dq = _rows(self.picked(now, "jacobian")[:, axes])
        return Residual(value, dq, 0.0 * dq, 0.0 * dq)

    def columns(self, rows: int) -> IntArray:
        """Return the DOF that move each point, for so many rows a point."""
        return np.repeat(np.stack(CHAINS)[self.f], rows, axis=0)

    def words(self, axes: Iterable[str]) -> Words:
        """Return what the rows are about, an axis each."""
        pairs = zip(self.f, self.p, strict=True)
        return np.array(
            [f"{SIDES_IN_WORDS[i]} {_POINTS[j]}, {axis}" for i, j in pairs for axis in axes], str
        )


def _rows(partials: FloatArray) -> FloatArray:
    return partials.reshape(-1, partials.shape[-1])
