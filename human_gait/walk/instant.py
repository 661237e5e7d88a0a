"""Everything known at the instants of a step: torques, ground reaction and feet, with partials."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.limits import torque_weights
from human_gait.body.person import make_body
from human_gait.body.skeleton import N_DOF, SEGMENTS
from human_gait.dynamics.carried_load import CarriedForce
from human_gait.dynamics.inverse_dynamics import (
    LINKS,
    ROOT,
    InverseDynamics,
    make_dynamics,
)
from human_gait.dynamics.second_derivatives import Tree, TreeHessian, TreeMotion
from human_gait.dynamics.tissues import PassiveJoints, no_torque
from human_gait.scenario import Scenario
from human_gait.walk.adjoint import Adjoint, Block
from human_gait.walk.contact_plan import ContactPlan
from human_gait.walk.feet import Feet, FootMotion
from human_gait.walk.ground_reaction import (
    LEG_JOINTS,
    LOWER,
    GroundReaction,
    add_torques_to_adjoint,
    ground_reaction,
    joint_torques,
)
from human_gait.walk.least_effort import Lean, LeanHessian, least_effort
from human_gait.walk.muscles import MusclePartials, Torques

_DOF = np.arange(N_DOF)
_OF_BODY = "subject", "load", "objective", "ground"  # sections that more than the plan comes from
_HEAD = int(np.searchsorted(LINKS, SEGMENTS["head"]))


@dataclass(frozen=True)
class Instants:
    """K instants of a step.

    Attributes
    ----------
    t : (K,) array, [s]
    q, v, a : (K, 55) array
    tree : TreeMotion
        Of the body without its ground reaction.
    torques : Torques
    ground : GroundReaction
    feet : FootMotion of the right and of the left foot
    head : (K, 3, 3) array
        How the head is turned from upright.
    lean : Lean, or None
        By least effort.
    """

    t: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    tree: TreeMotion
    torques: Torques
    ground: GroundReaction
    feet: tuple[FootMotion, FootMotion]
    head: FloatArray
    lean: Lean | None = None

    @property
    def dynamics(self) -> InverseDynamics:
        """Without ground reaction."""
        return self.torques.dynamics

    @property
    def torque(self) -> FloatArray:
        """Joint torques (K, 55) with the ground reaction: what muscles and tissues give together.

        [N m]; those of the global DOF vanish.
        """
        return self.torques.joint

    @property
    def passive_torque(self) -> FloatArray:
        """What tissues give of it (K, 55), [N m]."""
        return self.torques.passive.value

    @property
    def muscle_torque(self) -> FloatArray:
        """The part that the muscles give (K, 55), [N m]."""
        return self.torques.muscle

    @cached_property
    def muscles(self) -> MusclePartials:
        """Partials of the torques of the muscles, in parts."""
        return MusclePartials.of(self.torques, self.ground.variables.partials)

    @cached_property
    def muscle_partials(self) -> FloatArray:
        """Partials of the torques of the muscles (K, 55, 165) in q, v, a."""
        return self.muscles.dense()


@dataclass(frozen=True)
class SecondDerivatives:
    """Second derivatives of a weighted sum at K instants, in q, v, a, in parts.

    At each instant they are those of the tree, own ones and blocks of the adjoint, and with the
    partials J of the torques of muscles, V of the velocities of joints and y' of the variables of
    the ground

        J^T w J + J^T c V + V^T c J + y'^T M y' + y'^T R + R^T y',

    w, c and M being those of the adjoint, and B^T C + C^T B; between an instant and the next one
    those by torques and velocities (`Adjoint`).

    Attributes
    ----------
    tree : TreeHessian
    muscles : MusclePartials
    adjoint : Adjoint
    ground : (K, n, 20) array
        R, by q of `LOWER`.
    lean : LeanHessian or None
    """

    tree: TreeHessian
    muscles: MusclePartials
    adjoint: Adjoint
    ground: FloatArray
    lean: LeanHessian | None

    def dense(self) -> FloatArray:
        """Return those at the instants as matrices (K, 165, 165)."""
        adjoint, J, y = self.adjoint, self.muscles.dense(), self.muscles.ground
        half = J * (adjoint.torque_second[..., None] / 2.0)
        half[:, _DOF, N_DOF + _DOF] += adjoint.torque_velocity
        right = adjoint.ground_second @ y / 2.0
        right[:, :, LOWER] += self.ground
        found = J.swapaxes(1, 2) @ half + y.swapaxes(1, 2) @ right
        by_state = found.reshape(len(found), 3, N_DOF, 3, N_DOF)
        for dofs, B, C in adjoint.products:
            by_state[:, :, dofs[:, None, None], :, dofs] += np.einsum("krox,krpy->xykop", B, C)
        if self.lean:
            k, by_posture, by_ground = self.lean[:3]
            s = by_ground @ y[k]
            s[..., LOWER] += by_posture
            found[k] += s.swapaxes(1, 2) @ J[k, LEG_JOINTS]
        found += found.swapaxes(1, 2).copy()
        for block in adjoint.blocks:
            block.add_to(by_state)
        for i, j in np.ndindex(2, 2):
            by_state[:, i, _DOF, j, _DOF] += adjoint.own[:, i + j]
        return np.asarray(self.tree.dense() + found)


class Walker:
    """The body of a scenario on the ground of its plan.

    Parameters
    ----------
    scenario : Scenario
    dynamics : str
        One of ``dynamics.ENGINES``.
    """

    def __init__(self, scenario: Scenario, dynamics: str = "pinocchio") -> None:
        self.scenario, self._engine = scenario, dynamics
        self.body = make_body(scenario.subject, scenario.load)
        self.plan = ContactPlan(scenario, self.body)
        self._dynamics = make_dynamics(self.body, dynamics)
        self._tree = Tree(self.body.table, self.body.pseudo_inertia())
        self._feet = Feet(self.body, scenario.ground.ball)
        self._carried = CarriedForce(self.body) if scenario.load.model == "force" else None
        standing = self._dynamics.inverse(*np.zeros((3, 1, N_DOF)))
        self._upright = standing.link_poses[0, _HEAD, :3, :3]
        self._weights = torque_weights(scenario)
        kind = scenario.objective.passive_torques
        self._passive = None if kind == "none" else PassiveJoints(kind)

    def moved_to(self, scenario: Scenario) -> Walker:
        """Return the walker of another scenario: of the same body only the plan is another.

        Walkers of one body share what its dynamics is computed in, so that they belong to one
        thread.
        """
        if any(getattr(scenario, name) != getattr(self.scenario, name) for name in _OF_BODY):
            return Walker(scenario, self._engine)
        walker = copy(self)
        walker.scenario, walker.plan = scenario, ContactPlan(scenario, self.body)
        return walker

    def at(self, t: FloatArray, q: FloatArray, v: FloatArray, a: FloatArray) -> Instants:
        """Return what is known at the times t (K,) in [0, T] of the motion q, v, a (K, 55)."""
        dynamics = self._dynamics.inverse(q, v, a)
        tree = self._tree.first(dynamics, v, a)
        wrench = tree.wrench
        if self._carried:
            dynamics, wrench = self._carried.added(dynamics, wrench)
        ground = ground_reaction(wrench, self.plan, t)
        passive = self._passive.torque(q, v) if self._passive else no_torque(q)
        joint, lean = joint_torques(dynamics, ground.on_links), None
        torques = Torques(dynamics, ground.on_links, passive, joint, joint - passive.value)
        if self.plan.least_effort:
            lean = least_effort(torques, self.plan, t, ground, self._weights)
            ground = lean.leaning(ground)
            for torque in (torques.joint, torques.muscle):
                lean.add_to(torque)
            torques = replace(torques, on_links=ground.on_links)
        feet = self._feet.motion(dynamics, v)
        head = dynamics.link_poses[:, _HEAD, :3, :3] @ self._upright.T
        return Instants(t, q, v, a, tree, torques, ground, feet, head, lean)

    def gradient(self, now: Instants, adjoint: Adjoint) -> FloatArray:
        """Return the gradient (K, 165) of a weighted sum in q, v, a; contacts are left out."""
        weights = adjoint.torque.copy()
        weights[:, ROOT] = 0.0  # the global DOF have no torque, whatever the motion
        by_state, by_ground = now.torques.gradient(weights)
        by_state += adjoint.state
        for into, by in zip((0, 1), now.torques.passive.gradient(adjoint.passive), strict=True):
            by_state[:, into] += by
        by_ground += adjoint.ground
        found = by_state.reshape(len(now.t), -1)
        found += (by_ground[:, None] @ now.ground.variables.partials)[:, 0]
        return found

    def second_derivatives(self, now: Instants, adjoint: Adjoint) -> SecondDerivatives:
        """Return the second derivatives of a weighted sum in q, v, a.

        The chain rule: second derivatives of what the sum is made of, with the adjoint for weights,
        and products of first ones. The adjoint is used up.
        """
        adjoint.torque[:, ROOT] = 0.0
        axes, lean = now.dynamics.axes, now.lean
        of_lean = lean.second_derivatives(axes, now.muscle_torque, adjoint) if lean else None
        own, ground = add_torques_to_adjoint(axes, now.ground.on_links, adjoint)
        weights = adjoint.torque, adjoint.ground[:, :6]
        lower = np.zeros((3, *own.shape))  # by q twice, q and v, v twice
        lower[0] += own
        if of_lean:
            lower[0, of_lean.k] += of_lean.second
            ground[of_lean.k] += of_lean.mixed
        now.torques.passive.add_squares(adjoint.passive_second, adjoint.own, lower)
        if self._passive:
            self._passive.add_hessian(now.q, adjoint.passive - adjoint.torque, lower[0])
        contacts = (
            *(adjoint.contact_position, adjoint.contact_velocity),
            *(adjoint.contact_position_second, adjoint.contact_velocity_second),
        )
        self._feet.add_hessian(axes, now.v, now.feet, contacts, [*lower])
        adjoint.blocks.append(Block(_DOF[LOWER], *lower))
        if self._carried:
            adjoint.blocks.append(Block(_DOF, self._carried.hessian(now.dynamics, *weights)))
        tree = self._tree.second(now.tree, *weights)
        return SecondDerivatives(tree, now.muscles, adjoint, ground, of_lean)
