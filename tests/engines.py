"""What the tests of the body share: bodies, random states and the other engines' answers."""

import numpy as np
import pinocchio as pin
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces

from human_gait import skeleton
from human_gait.body import GRAVITY, make_body
from human_gait.recursive_lagrangian import ExternalLoad
from human_gait.scenario import Load, Subject
from human_gait.urdf import LINK_NAMES, link_to_dh, urdf_text

MALE = make_body(Subject.default("male"))
FEMALE = make_body(Subject.default("female"))
LOADED = make_body(Subject.default("male"), Load(mass=18.1, position=(0.02, 0.07, -0.2)))
BODIES = {"male": MALE, "female": FEMALE, "with a backpack": LOADED}


def random_states(n, seed=0):
    """Postures inside the joint limits, faster and more abrupt than those of walking."""
    rng = np.random.default_rng(seed)
    lower, upper = skeleton.position_limits()
    shape = (n, skeleton.N_DOF)
    return rng.uniform(lower, upper, shape), rng.uniform(-5, 5, shape), rng.uniform(-40, 40, shape)


def random_loads(n, seed=1):
    """Forces and moments on both feet, the toes and the thorax, for n instants."""
    rng = np.random.default_rng(seed)
    links = [skeleton.SEGMENTS[name] for name in ("foot_r", "toe_r", "foot_l", "thorax")]
    return [
        ExternalLoad(
            link,
            point=rng.uniform(-0.2, 0.2, (n, 3)),
            force=rng.uniform(-800, 800, (n, 3)),
            moment=rng.uniform(-80, 80, (n, 3)),
        )
        for link in links
    ]


def at_instant(loads, k):
    """The loads of one instant."""
    return [ExternalLoad(x.link, x.point[k], x.force[k], x.moment[k]) for x in loads]


def pinocchio_loads(body, model, q, loads):
    """Loads of one instant as Pinocchio takes them: in the joints' local frames."""
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    forces = [pin.Force.Zero() for _ in range(model.njoints)]
    for load in loads:
        rotation = data.oMi[load.link + 1].rotation
        to_dh = link_to_dh(body.table)[load.link]
        point = to_dh[:3, :3] @ load.point + to_dh[:3, 3]
        force, moment = rotation.T @ load.force, rotation.T @ load.moment
        forces[load.link + 1] += pin.Force(force, moment + np.cross(point, force))
    return forces


def drake_plant(body):
    """A finalized continuous MultibodyPlant read from the body's URDF."""
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(urdf_text(body), "urdf")
    plant.mutable_gravity_field().set_gravity_vector(GRAVITY)
    plant.Finalize()
    return plant


def drake_torques(plant, state, loads=()):
    """Inverse dynamics of one instant by Drake."""
    q, v, a = state
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    forces = MultibodyForces(plant)
    plant.CalcForceElementsContribution(context, forces)
    world = plant.world_frame()
    for load in loads:
        link = plant.GetBodyByName(LINK_NAMES[load.link])
        tip = plant.GetBodyByName(f"dh_{load.link + 1:02d}")
        arm = plant.EvalBodyPoseInWorld(context, tip).multiply(load.point)
        arm -= plant.EvalBodyPoseInWorld(context, link).translation()
        link.AddInForce(context, arm, SpatialForce(load.moment, load.force), world, forces)
    return plant.CalcInverseDynamics(context, a, forces)


def complex_step(function, x, step=1e-30):
    """Jacobian (n_f, n_x) of a function that takes (..., n_x), exact to rounding."""
    return function(x + 1j * step * np.eye(len(x))).imag.T / step
