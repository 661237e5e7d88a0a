"""Torques of a given motion under given forces, by three engines that share only the body.

Pinocchio and Drake read the URDF, each with its own algorithms; the paper's recursion reads the DH
table. None of them knows how the forces were found. Drake also gives what the laws of mechanics
say about a whole motion: momentum, energy and the power of the forces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import pinocchio as pin
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces

from human_gait.arrays import FloatArray
from human_gait.body.dh import link_to_dh
from human_gait.body.links import GRAVITY
from human_gait.body.model import build_model
from human_gait.body.person import Body
from human_gait.body.skeleton import N_DOF
from human_gait.body.urdf import JOINT_NAMES, LINK_NAMES
from human_gait.dynamics.recursive_lagrangian import ExternalLoad, inverse_dynamics
from human_gait.exceptions import ModelError
from human_gait.values import Value

Motion = tuple[FloatArray, FloatArray, FloatArray]
"""q, v, a (K, 55), [rad] and [m], their rates per s and per s^2."""

_CHUNK = 50  # instants that the recursion takes at once: 0.2 MB each


class Engine(Protocol):
    """Inverse dynamics of one body."""

    def torques(self, motion: Motion, loads: Sequence[ExternalLoad]) -> FloatArray:
        """Return the joint torques (K, 55), [N m] and [N], of K instants under loads."""


class RecursionEngine:
    """The paper's recursion on the DH table, Eqs. (5)-(13)."""

    def __init__(self, body: Body) -> None:
        self._body = body

    def torques(self, motion: Motion, loads: Sequence[ExternalLoad]) -> FloatArray:
        """Return the joint torques (K, 55), [N m] and [N], of K instants under loads."""
        tau = np.empty(motion[0].shape)
        for k in range(0, len(tau), _CHUNK):
            part = slice(k, k + _CHUNK)
            q, v, a = (x[part] for x in motion)
            acting = [_part(load, part) for load in loads]
            tau[part] = inverse_dynamics(self._body, q, v, a, acting)
        return tau


def _part(load: ExternalLoad, part: slice) -> ExternalLoad:
    return ExternalLoad(load.link, load.point[part], load.force[part], load.moment[part])


class PinocchioEngine:
    """Pinocchio's recursive Newton-Euler algorithm on the URDF."""

    def __init__(self, body: Body) -> None:
        self._model = build_model(body.urdf, body)  # its own: nothing that the walk has touched
        self._data = self._model.createData()
        self._to_dh = link_to_dh(body.table)

    def torques(self, motion: Motion, loads: Sequence[ExternalLoad]) -> FloatArray:
        """Return the joint torques (K, 55), [N m] and [N], of K instants under loads."""
        tau = [
            pin.rnea(self._model, self._data, q, v, a, self._forces(q, loads, k))
            for k, (q, v, a) in enumerate(zip(*motion, strict=True))
        ]
        return np.array(tau)

    def _forces(self, q: FloatArray, loads: Sequence[ExternalLoad], k: int) -> list[pin.Force]:
        """Return the loads of instant k in the joints' frames."""
        pin.forwardKinematics(self._model, self._data, q)
        forces = [pin.Force.Zero() for _ in range(self._model.njoints)]
        for load in loads:
            to_dh, joint = self._to_dh[load.link], load.link + 1
            to_joint = self._data.oMi[joint].rotation.T
            point = to_dh[:3, :3] @ load.point[k] + to_dh[:3, 3]
            force, moment = to_joint @ load.force[k], to_joint @ load.moment[k]
            forces[joint] += pin.Force(force, moment + np.cross(point, force))
        return forces


@dataclass(frozen=True, eq=False)
class Mechanics(Value):
    """What a motion of K instants amounts to.

    Attributes
    ----------
    points, velocities : (K, 2, 4, 3) array, [m], [m/s]
        Contact points of the right and of the left foot.
    energy : (K,) array, [J]
        Kinetic and potential.
    momentum : (K, 6) array, [N m s], [N s]
        Angular about the world's origin, then linear.
    wrench : (K, 6) array, [N m], [N]
        Of gravity and the loads, about the world's origin: the rate of the momentum.
    loads_power : (K, n) array, [W]
        What each of the loads does.
    """

    points: FloatArray
    velocities: FloatArray
    energy: FloatArray
    momentum: FloatArray
    wrench: FloatArray
    loads_power: FloatArray


class DrakeEngine:
    """Drake's MultibodyPlant of the URDF."""

    def __init__(self, body: Body, ball: str = "foot") -> None:
        self._body, self._contact = body, body.standing(ball)
        self.plant = plant = drake_plant(body)
        self._context = plant.CreateDefaultContext()
        self._mass = plant.CalcTotalMass(self._context)
        self._links = [plant.GetBodyByName(name) for name in LINK_NAMES]
        self._dh_frames = [plant.GetFrameByName(f"dh_{i + 1:02d}") for i in range(N_DOF)]

    def torques(self, motion: Motion, loads: Sequence[ExternalLoad]) -> FloatArray:
        """Return the joint torques (K, 55), [N m] and [N], of K instants under loads."""
        tau = np.empty(motion[0].shape)
        for k, (q, v, a) in enumerate(zip(*motion, strict=True)):
            self._move(q, v)
            forces = MultibodyForces(self.plant)
            self.plant.CalcForceElementsContribution(self._context, forces)
            for load in loads:
                self._add(load, k, forces)
            tau[k] = self.plant.CalcInverseDynamics(self._context, a, forces)
        return tau

    def mechanics(self, motion: Motion, loads: Sequence[ExternalLoad]) -> Mechanics:
        """Return points, energy, momentum, wrench and power of loads at K instants."""
        plant, context, instants = self.plant, self._context, []
        for k, (q, v, _) in enumerate(zip(*motion, strict=True)):
            self._move(q, v)
            energy = plant.CalcKineticEnergy(context) + plant.CalcPotentialEnergy(context)
            momentum = plant.CalcSpatialMomentumInWorldAboutPoint(context, np.zeros(3))
            feet = np.stack([self._contact_points(f) for f in range(2)])
            power = [self._power(load, k) for load in loads]
            wrench = self._gravity() + sum(self._wrench(load, k) for load in loads)
            points, velocities = feet[:, :, 0], feet[:, :, 1]
            instants.append((points, velocities, energy, momentum.get_coeffs(), wrench, power))
        return Mechanics(*(np.array(parts) for parts in zip(*instants, strict=True)))

    def _move(self, q: FloatArray, v: FloatArray) -> None:
        self.plant.SetPositions(self._context, q)
        self.plant.SetVelocities(self._context, v)

    def _contact_points(self, f: int) -> FloatArray:
        """Return place and velocity (4, 2, 3) of the contact points of a foot in the world."""
        contact, found = self._contact, []
        for link, point in zip(contact.links[f], contact.points[f], strict=True):
            place = self._pose(link).multiply(point)
            found.append((place, self._velocity(link, place)))
        return np.array(found)

    def _velocity(self, link: int, place: FloatArray) -> FloatArray:
        """Return the velocity (3,) of the point of a link that is at a place in the world."""
        body = self._links[link]
        origin = self.plant.EvalBodyPoseInWorld(self._context, body).translation()
        moving = self.plant.EvalBodySpatialVelocityInWorld(self._context, body)
        return np.asarray(moving.translational() + np.cross(moving.rotational(), place - origin))

    def _pose(self, link: int) -> Any:
        return self._dh_frames[link].CalcPoseInWorld(self._context)

    def _arm(self, load: ExternalLoad, k: int) -> FloatArray:
        """Return where a load acts, from the origin of its link, in the world's axes."""
        link = self.plant.EvalBodyPoseInWorld(self._context, self._links[load.link])
        return np.asarray(self._pose(load.link).multiply(load.point[k]) - link.translation())

    def _add(self, load: ExternalLoad, k: int, forces: MultibodyForces) -> None:
        force = SpatialForce(load.moment[k], load.force[k])
        world, arm = self.plant.world_frame(), self._arm(load, k)
        self._links[load.link].AddInForce(self._context, arm, force, world, forces)

    def _gravity(self) -> FloatArray:
        """Return moment about the world's origin and force (6,) of gravity."""
        weight = self._mass * GRAVITY
        centre = self.plant.CalcCenterOfMassPositionInWorld(self._context)
        return np.concatenate([np.cross(centre, weight), weight])

    def _wrench(self, load: ExternalLoad, k: int) -> FloatArray:
        """Return moment about the world's origin and force (6,) of a load."""
        point = self._pose(load.link).multiply(load.point[k])
        moment = np.cross(point, load.force[k]) + load.moment[k]
        return np.concatenate([moment, load.force[k]])

    def _power(self, load: ExternalLoad, k: int) -> float:
        velocity = self._velocity(load.link, self._pose(load.link).multiply(load.point[k]))
        moving = self.plant.EvalBodySpatialVelocityInWorld(self._context, self._links[load.link])
        return float(load.force[k] @ velocity + load.moment[k] @ moving.rotational())


def drake_plant(body: Body) -> MultibodyPlant:
    """Return the finalized continuous MultibodyPlant of a body's URDF.

    Raises
    ------
    ModelError
        If Drake numbers the joints in another order.
    """
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(body.urdf, "urdf")
    plant.mutable_gravity_field().set_gravity_vector(GRAVITY)
    plant.Finalize()
    places = [plant.GetJointByName(name).position_start() for name in JOINT_NAMES]
    if places != list(range(N_DOF)):
        raise ModelError(f"Drake numbers the joints {places}, expected the order of {JOINT_NAMES}")
    return plant
