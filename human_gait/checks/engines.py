"""Torques of a given motion under given forces, by three engines that share only the body.

Pinocchio and Drake read the URDF, each with its own algorithms; the paper's recursion reads the DH
table. None of them knows how the forces were found. Drake also gives what the laws of mechanics
say about a whole motion: momentum, energy and the power of the forces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import pinocchio as pin
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces

from human_gait.arrays import BoolArray, FloatArray
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

_CHUNK = 100  # instants that the recursion takes at once: 0.2 MB each


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
        model, data, tau = self._model, self._data, np.empty(motion[0].shape)
        forces = pin.StdVec_Force([pin.Force.Zero()] * model.njoints)
        acting = self._in_joints(motion[0], loads)
        for k, (q, v, a) in enumerate(zip(*motion, strict=True)):
            for joint, wrenches in acting.items():
                forces[joint] = pin.Force(wrenches[k])
            tau[k] = pin.rnea(model, data, q, v, a, forces)
        return tau

    def _in_joints(self, q: FloatArray, loads: Sequence[ExternalLoad]) -> dict[int, FloatArray]:
        """Return force and moment (K, 6) of the loads in the frames of the joints they act on."""
        joints = sorted({load.link + 1 for load in loads})
        turns = dict(zip(joints, self._rotations(q, joints), strict=True))
        acting = {joint: np.zeros((len(q), 6)) for joint in joints}
        for load in loads:
            force, moment = (
                np.einsum("kji,kj->ki", turns[load.link + 1], x) for x in (load.force, load.moment)
            )
            point = _moved(self._to_dh[load.link], load.point)
            acting[load.link + 1] += np.hstack([force, moment + np.cross(point, force)])
        return acting

    def _rotations(self, q: FloatArray, joints: Sequence[int]) -> FloatArray:
        """Return how joints are turned in the world, (n, K, 3, 3)."""
        found = np.empty((len(joints), len(q), 3, 3))
        for k, posture in enumerate(q):
            pin.forwardKinematics(self._model, self._data, posture)
            for n, joint in enumerate(joints):
                found[n, k] = self._data.oMi[joint].rotation
        return found


def _dot(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.asarray(np.sum(x * y, axis=-1))


def _wrench(place: FloatArray, force: FloatArray, moment: FloatArray | float = 0.0) -> FloatArray:
    """Return the moment about the origin and the force (K, 6) of a force at a place (K, 3)."""
    return np.hstack([np.cross(place, force) + moment, np.broadcast_to(force, place.shape)])


def _moved(place: FloatArray, points: FloatArray) -> FloatArray:
    """Return points (..., 3) by a transformation (3 or 4, 4)."""
    return np.asarray(points @ place[:3, :3].T + place[:3, 3])


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


class _Moving(NamedTuple):
    """A link at K instants: its pose (K, 3, 4) and velocity, angular and linear (K, 6)."""

    pose: FloatArray
    velocity: FloatArray

    @property
    def turning(self) -> FloatArray:
        """Angular velocity (K, 3), [rad/s]."""
        return self.velocity[:, :3]

    def point(self, at: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return place and velocity (K, 3) in the world of a point (3,) or (K, 3) of the link."""
        arm = (self.pose[..., :3] @ at[..., None])[..., 0]
        return arm + self.pose[..., 3], self.velocity[:, 3:] + np.cross(self.turning, arm)


class DrakeEngine:
    """Drake's MultibodyPlant of the URDF."""

    def __init__(self, body: Body, ball: str = "foot") -> None:
        self.plant = plant = drake_plant(body)
        self._context = plant.CreateDefaultContext()
        self._mass = plant.CalcTotalMass(self._context)
        self._links = [plant.GetBodyByName(name) for name in LINK_NAMES]
        marks = [plant.GetFrameByName(f"dh_{i + 1:02d}") for i in range(N_DOF)]
        self._to_dh = [
            mark.CalcPose(self._context, body.body_frame()).GetAsMatrix34()  # constant
            for mark, body in zip(marks, self._links, strict=True)
        ]
        contact = body.standing(ball)
        self._points = [
            [(int(link), self._from_dh(link, point)) for link, point in zip(*foot, strict=True)]
            for foot in zip(contact.links, contact.points, strict=True)
        ]

    def torques(self, motion: Motion, loads: Sequence[ExternalLoad]) -> FloatArray:
        """Return the joint torques (K, 55), [N m] and [N], of K instants under loads."""
        plant, context, tau = self.plant, self._context, np.empty(motion[0].shape)
        forces, world = MultibodyForces(plant), plant.world_frame()
        acting = [(self._links[load.link], *self._in_body(load)) for load in loads]
        for k, (q, v, a) in enumerate(zip(*motion, strict=True)):
            self._move(q, v)
            plant.CalcForceElementsContribution(context, forces)
            for body, points, wrenches, pushes in acting:
                if pushes[k]:
                    turn = plant.EvalBodyPoseInWorld(context, body).rotation()
                    arm, wrench = turn.multiply(points[k]), SpatialForce(wrenches[k])
                    body.AddInForce(context, arm, wrench, world, forces)
            tau[k] = plant.CalcInverseDynamics(context, a, forces)
        return tau

    def _in_body(self, load: ExternalLoad) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Return where a load acts on its body (K, 3), its wrench (K, 6), and whether it does."""
        wrench = np.hstack([load.moment, load.force])
        return self._from_dh(load.link, load.point), wrench, np.any(wrench != 0.0, axis=1)

    def _from_dh(self, link: int, points: FloatArray) -> FloatArray:
        """Return points (..., 3) of the DH frame of a link in the axes of Drake's body."""
        return _moved(self._to_dh[link], points)

    def mechanics(self, motion: Motion, loads: Sequence[ExternalLoad]) -> Mechanics:
        """Return points, energy, momentum, wrench and power of loads at K instants."""
        on_feet = [link for foot in self._points for link, _ in foot]
        links = sorted({*on_feet, *(load.link for load in loads)})
        energy, momentum, centre, poses, velocities = self._followed(motion, links)
        moving = {link: _Moving(poses[:, n], velocities[:, n]) for n, link in enumerate(links)}
        # two feet, four points, place or velocity, K, 3
        feet = np.array([[moving[link].point(at) for link, at in foot] for foot in self._points])
        points, rates = feet.transpose(2, 3, 0, 1, 4)
        wrench, power = _wrench(centre, self._mass * GRAVITY), np.zeros((len(energy), len(loads)))
        for n, load in enumerate(loads):
            link = moving[load.link]
            place, velocity = link.point(self._from_dh(load.link, load.point))
            wrench += _wrench(place, load.force, load.moment)
            power[:, n] = _dot(load.force, velocity) + _dot(load.moment, link.turning)
        return Mechanics(points, rates, energy, momentum, wrench, power)

    def _followed(self, motion: Motion, links: Sequence[int]) -> list[FloatArray]:
        """Return what Drake says of K instants.

        Energy (K,), momentum (K, 6) about the world's origin, centre of mass (K, 3), pose
        (K, n, 3, 4) and velocity (K, n, 6) of n links.
        """
        plant, context, origin = self.plant, self._context, np.zeros(3)
        bodies, instants = [self._links[link] for link in links], []
        for q, v in zip(*motion[:2], strict=True):
            self._move(q, v)
            energy = plant.CalcKineticEnergy(context) + plant.CalcPotentialEnergy(context)
            momentum = plant.CalcSpatialMomentumInWorldAboutPoint(context, origin).get_coeffs()
            centre = plant.CalcCenterOfMassPositionInWorld(context)
            poses = [plant.EvalBodyPoseInWorld(context, body).GetAsMatrix34() for body in bodies]
            velocities = [
                plant.EvalBodySpatialVelocityInWorld(context, body).get_coeffs() for body in bodies
            ]
            instants.append((energy, momentum, centre, poses, velocities))
        return [np.array(parts) for parts in zip(*instants, strict=True)]

    def _move(self, q: FloatArray, v: FloatArray) -> None:
        self.plant.SetPositions(self._context, q)
        self.plant.SetVelocities(self._context, v)


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
