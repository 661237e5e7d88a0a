"""First derivatives of the torques of the muscles, in the parts that they are made of.

A torque depends on the joints above and below it in the tree; those of the legs also on the few
variables y of the ground, which all joints move:

    dtau/dx = own + (dtau/dy) dy/dx,

so that of 49 x 165 numbers an instant a third are not zero, and the ground's are there once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from human_gait import kernel
from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import BRANCHES, N_DOF
from human_gait.dynamics.inverse_dynamics import ROOT, InverseDynamics
from human_gait.dynamics.jet import Jet
from human_gait.dynamics.tissues import PassiveTorque
from human_gait.walk.ground_reaction import (
    LEG_JOINTS,
    LOWER,
    N_LOWER,
    load_partials,
)

UPPER_JOINTS = slice(N_LOWER, N_DOF)
"""The 35 joints above the pelvis."""
UPPER = np.concatenate([ROOT, np.arange(N_LOWER, N_DOF)])
"""The 41 DOF that they depend on: the global ones and their own."""


@dataclass(frozen=True, eq=False)
class Torques:
    """The torques of joints and muscles at K instants.

    Attributes
    ----------
    dynamics : InverseDynamics
        Without ground reaction.
    on_links : Jet (K, 2, 2, 6)
        Wrenches on rear foot and toes of both feet (`GroundReaction`).
    passive : PassiveTorque, [N m]
        What tissues give.
    joint, muscle : (K, 55) array, [N m], [N]
        What muscles and tissues give together; what muscles give of it.
    """

    dynamics: InverseDynamics
    on_links: Jet
    passive: PassiveTorque
    joint: FloatArray
    muscle: FloatArray

    def gradient(self, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the gradient of weighted torques of muscles, weights (K, 55).

        Returns
        -------
        by_state : (K, 3, 55) array
            By q, v, a, the variables of the ground constant.
        by_ground : (K, n) array
            By these.
        """
        K = len(weights)
        by_state = (weights[:, None] @ self.dynamics.torque.partials).reshape(K, 3, N_DOF)
        by_q, by_v = self.passive.gradient(weights)
        by_state[:, 0] -= by_q
        by_state[:, 1] -= by_v
        by_posture, by_ground = (
            (weights[:, None, LEG_JOINTS] @ by)[:, 0] for by in self.load_partials
        )
        by_state[:, 0, LOWER] += by_posture
        return by_state, by_ground

    @cached_property
    def load_partials(self) -> tuple[FloatArray, FloatArray]:
        """Partials of what forces on the feet add to torques of the legs, by posture and ground."""
        return load_partials(self.dynamics.axes, self.on_links)

    def at(self, k: IntArray) -> Torques:
        """Return those of some instants."""
        dynamics, passive = self.dynamics, self.passive
        return Torques(
            InverseDynamics(dynamics.torque[k], dynamics.axes[k], dynamics.link_poses[k]),
            self.on_links[k],
            replace(passive, value=passive.value[k], sagittal=passive.sagittal[k]),
            self.joint[k],
            self.muscle[k],
        )


@dataclass(frozen=True, eq=False)
class MusclePartials:
    """Partials of the torques of the muscles at K instants.

    Attributes
    ----------
    torques : Torques
        What the partials are of: those of the joints above the pelvis need nothing else.
    legs : (K, 14, 3, 20) array
        Own ones of the joints of the legs, by q, v, a of `LOWER`.
    by_ground : (K, 14, n) array
        Of the joints of the legs by the variables of the ground.
    ground : (K, n, 165) array
        Of these in q, v, a.
    """

    torques: Torques
    legs: FloatArray
    by_ground: FloatArray
    ground: FloatArray

    @classmethod
    def of(cls, torques: Torques, ground: FloatArray) -> MusclePartials:
        """Return those of torques, the variables of the ground having the partials (K, n, 165)."""
        dynamics, passive, K = torques.dynamics, torques.passive, len(ground)
        by_state = dynamics.torque.partials.reshape(K, N_DOF, 3, N_DOF)
        legs = by_state[:, LEG_JOINTS, :, LOWER].copy()
        passive.subtract_from(legs, LEG_JOINTS, len(ROOT))
        by_posture, by_ground = torques.load_partials
        legs[:, :, 0] += by_posture
        return cls(torques, legs, by_ground, ground)

    @cached_property
    def upper(self) -> FloatArray:
        """Those of the joints above the pelvis (K, 35, 3, 41), by q, v, a of `UPPER`."""
        by_state = self.torques.dynamics.torque.partials.reshape(-1, N_DOF, 3, N_DOF)
        upper = by_state[:, UPPER_JOINTS][..., UPPER]
        self.torques.passive.subtract_from(upper, UPPER_JOINTS, len(ROOT))
        return upper

    def on_points(self, N: FloatArray, branch: str, dofs: IntArray) -> FloatArray:
        """Return those of a branch above the pelvis (K, r, 4, c) by the control points of some DOF.

        These are all that it depends on; they have the weights N (3, K, 4) in q, v, a.
        """
        joints = BRANCHES[branch]
        if run := kernel.function("onto_points"):
            passive, P = self.torques.passive, np.empty((N.shape[1], len(joints), 4, len(dofs)))
            partials = self.torques.dynamics.torque.partials
            slopes = passive.by_angle, passive.by_velocity
            which = N_DOF, joints[0], len(joints), N_DOF, len(dofs), dofs
            run(N.shape[1], *which, N, partials, *slopes, into=(P,))
            return P
        first, places = joints[0] - UPPER_JOINTS.start, np.searchsorted(UPPER, dofs)
        rows = self.upper[:, first : first + len(joints), :, None, :][..., places]
        q, v, a = N[:, :, None, :, None]
        P = rows[:, :, 0] * q
        P += rows[:, :, 1] * v
        P += rows[:, :, 2] * a
        return np.asarray(P)

    def dense(self) -> FloatArray:
        """Return them all (K, 55, 165); those of the global DOF, which have no torque, are 0."""
        K = len(self.ground)
        found = np.zeros((K, N_DOF, 3, N_DOF))
        found[:, UPPER_JOINTS][..., UPPER] = self.upper
        found[:, LEG_JOINTS] = (self.by_ground @ self.ground).reshape(K, -1, 3, N_DOF)
        found[:, LEG_JOINTS, :, LOWER] += self.legs
        return found.reshape(K, N_DOF, 3 * N_DOF)
