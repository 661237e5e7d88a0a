"""Everything known at the instants of a step: torques, ground reaction and feet, with partials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.limits import torque_weights
from human_gait.body.person import make_body
from human_gait.body.skeleton import N_DOF, SEGMENTS
from human_gait.dynamics.carried_load import CarriedForce
from human_gait.dynamics.inverse_dynamics import (
    CHAINS,
    LINKS,
    ROOT,
    InverseDynamics,
    make_dynamics,
)
from human_gait.dynamics.jet import Linearised
from human_gait.dynamics.second_derivatives import StateHessian, TreeCurvature
from human_gait.dynamics.tissues import PassiveJoints, no_torque
from human_gait.scenario import Scenario
from human_gait.walk.adjoint import JOINTS, Adjoint
from human_gait.walk.contact_plan import ContactPlan
from human_gait.walk.feet import Feet, FootMotion
from human_gait.walk.ground_reaction import (
    GroundReaction,
    add_torques_to_adjoint,
    ground_reaction,
    joint_torques,
)
from human_gait.walk.least_effort import Lean, least_effort

_DOF = np.arange(N_DOF)
_HEAD = int(np.searchsorted(LINKS, SEGMENTS["head"]))


@dataclass(frozen=True)
class Instants:
    """K instants of a step.

    Attributes
    ----------
    t : (K,) array, [s]
    dynamics : InverseDynamics
        Without ground reaction.
    q, v, a : (K, 55) array
    torque : Linearised (K, 55), [N m], [N]
        Joint torques with the ground reaction: what muscles and tissues give together.
    passive_torque : Linearised (K, 55), [N m]
        What tissues give of it.
    muscle_torque : Linearised (K, 55), [N m]
        The part that the muscles give: `torque` without the passive torques.
    ground : GroundReaction
    feet : FootMotion of the right and of the left foot
    head : (K, 3, 3) array
        How the head is turned from upright.
    lean : Lean, or None
        By least effort.
    """

    t: FloatArray
    dynamics: InverseDynamics
    q: FloatArray
    v: FloatArray
    a: FloatArray
    torque: Linearised
    passive_torque: Linearised
    muscle_torque: Linearised
    ground: GroundReaction
    feet: tuple[FootMotion, FootMotion]
    head: FloatArray
    lean: Lean | None = None


class OfTorques(NamedTuple):
    """Second derivatives by the torques of the joints of K instants and by what goes with them.

    Attributes
    ----------
    partials : (K, 49, 165) array
        J, of the torques in q, v, a.
    second, onward, by_velocity : (K, 49) array
        Second derivatives by a torque twice, by it and the same one at the next instant, by it and
        the velocity of its joint (`Adjoint`).
    """

    partials: FloatArray
    second: FloatArray
    onward: FloatArray
    by_velocity: FloatArray

    def dense(self) -> FloatArray:
        """Return those at single instants as matrices (K, 165, 165), J^T w J + J^T c V + V^T c J.

        V are the partials of the velocities.
        """
        J = self.partials
        half = (self.second[..., None] / 2.0) * J
        half[:, np.arange(len(JOINTS)), N_DOF + JOINTS] += self.by_velocity
        found = J.swapaxes(1, 2) @ half
        return np.asarray(found + found.swapaxes(1, 2))


@dataclass(frozen=True)
class SecondDerivatives:
    """Second derivatives of a weighted sum at K instants, in q, v, a, in parts.

    At each instant they are direct + those by the torques + B^T C + C^T B; between an instant k and
    the next one those by the torques, D_k^T E_k+1 and its transpose.

    Attributes
    ----------
    direct : StateHessian
    torques : OfTorques
    left, right : (K, r, 165) array
        B and C, for products with the variables of the ground and of own terms.
    pairs : list of two (K, r, 165) arrays
        D and E, for products with what is at the next instant (`Adjoint.pairs`).
    """

    direct: StateHessian
    torques: OfTorques
    left: FloatArray
    right: FloatArray
    pairs: Sequence[tuple[FloatArray, FloatArray]] = ()

    def dense(self) -> FloatArray:
        """Return those at the instants as matrices (K, 165, 165)."""
        mixed = self.left.swapaxes(1, 2) @ self.right
        return self.direct.dense() + self.torques.dense() + mixed + mixed.swapaxes(1, 2)


class Walker:
    """The body of a scenario on the ground of its plan.

    Parameters
    ----------
    scenario : Scenario
    dynamics : str
        One of ``dynamics.ENGINES``.
    """

    def __init__(self, scenario: Scenario, dynamics: str = "pinocchio") -> None:
        self.body = make_body(scenario.subject, scenario.load)
        self.plan = ContactPlan(scenario, self.body)
        self._dynamics = make_dynamics(self.body, dynamics)
        self._curvature = TreeCurvature(self.body.table, self.body.pseudo_inertia())
        self._feet = Feet(self.body, scenario.ground.ball)
        self._carried = CarriedForce(self.body) if scenario.load.model == "force" else None
        standing = self._dynamics.inverse(*np.zeros((3, 1, N_DOF)))
        self._upright = standing.link_poses[0, _HEAD, :3, :3]
        self._weights = torque_weights(scenario)
        kind = scenario.objective.passive_torques
        self._passive = None if kind == "none" else PassiveJoints(kind)

    def at(self, t: FloatArray, q: FloatArray, v: FloatArray, a: FloatArray) -> Instants:
        """Return what is known at the times t (K,) in [0, T] of the motion q, v, a (K, 55)."""
        dynamics = self._dynamics.inverse(q, v, a)
        if self._carried:
            dynamics = self._carried.added(dynamics, q)
        ground = ground_reaction(dynamics, self.plan, t)
        torque, lean = joint_torques(dynamics, ground), None
        passive = self._passive.torque(q, v) if self._passive else no_torque(q)
        muscle_torque = torque - passive
        if self.plan.least_effort:
            lean = least_effort(dynamics, self.plan, t, ground, muscle_torque, self._weights)
            ground = lean.leaning(ground)
            lean.add_to(torque)
            lean.add_to(muscle_torque)
        feet = self._feet.motion(dynamics, v)
        head = dynamics.link_poses[:, _HEAD, :3, :3] @ self._upright.T
        torques = torque, passive, muscle_torque
        return Instants(t, dynamics, q, v, a, *torques, ground, feet, head, lean)

    def second_derivatives(self, now: Instants, adjoint: Adjoint) -> SecondDerivatives:
        """Return the second derivatives of a weighted sum in q, v, a.

        The chain rule: second derivatives of what the sum is made of, with the adjoint for weights,
        and products of first ones. The adjoint is used up.
        """
        adjoint.torque[:, ROOT] = 0.0  # the global DOF have no torque, whatever the motion
        dynamics = now.dynamics
        lean = now.lean
        of_lean = lean.second_derivatives(dynamics, now.muscle_torque, adjoint) if lean else None
        own, mixed = add_torques_to_adjoint(dynamics.axes, now.ground.on_links, adjoint)
        weights = adjoint.torque, adjoint.ground[:, :6]
        qq, qv, qa, vv = self._curvature.hessian((now.q, now.v, now.a), dynamics.axes, *weights)
        qq += own + adjoint.posture_second
        qv += adjoint.posture_velocity
        if self._passive:
            qq += self._passive.hessian(now.q, adjoint.passive - adjoint.torque)
        if self._carried:
            qq += self._carried.hessian(now.q, dynamics.axes, *weights)
        for f, chain in enumerate(CHAINS):
            weights = adjoint.position[:, f], adjoint.velocity[:, f]
            by_qq, by_qv = self._feet.hessian(dynamics, now.feet[f], now.v, f, *weights)
            qq[:, chain[:, None], chain] += by_qq
            qv[:, chain[:, None], chain] += by_qv
        vv[:, _DOF, _DOF] += adjoint.velocity_second
        hessian = StateHessian(qq, qv, qa, vv)
        if adjoint.passive_second.any():
            _add_passive(now, adjoint.passive_second, hessian)
        y = now.ground.variables.partials
        half = adjoint.ground_second @ y / 2
        half[:, :, :N_DOF] += mixed.swapaxes(1, 2)
        if of_lean:
            of_lean.add_to(half, hessian)
        left = np.concatenate([half, *(B for B, _ in adjoint.products)], axis=1)
        right = np.concatenate([y, *(C for _, C in adjoint.products)], axis=1)
        by = adjoint.torque_second, adjoint.torque_next, adjoint.torque_velocity
        J = now.muscle_torque.partials[:, JOINTS]
        torques = OfTorques(J, *(weights[:, JOINTS] for weights in by))
        return SecondDerivatives(hessian, torques, left, right, adjoint.pairs)


def _add_passive(now: Instants, weights: FloatArray, hessian: StateHessian) -> None:
    """Add the second derivatives J^T w J of squares of the torques of tissues.

    They depend on the postures of a few joints, and each on the velocity of its own joint alone.
    """
    by_q, by_v, _ = np.split(now.passive_torque.partials, 3, axis=2)
    damping = by_v[:, _DOF, _DOF]
    weighted = by_q.swapaxes(1, 2) * weights[:, None]
    hessian.qq[:] += weighted @ by_q
    hessian.qv[:] += weighted * damping[:, None]
    hessian.vv[:, _DOF, _DOF] += weights * damping**2
