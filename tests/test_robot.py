"""The URDF for others in the engines of others: the mass and the torques of the body, as it is.

Pinocchio, Drake and MuJoCo, and PyBullet where it is installed: `pip install pybullet`.
"""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from bodies import BODIES, MALE, random_states
from exports import walking
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces
from walks import scenario

from human_gait import cli
from human_gait.body.limits import joint_limits, position_limits, torque_limits
from human_gait.body.links import GRAVITY
from human_gait.body.person import make_body
from human_gait.body.skeleton import DOF_NAMES, SIDES, index
from human_gait.body.urdf import JOINT_NAMES
from human_gait.exceptions import ScenarioError
from human_gait.export.formats import export_gait, sampled
from human_gait.export.notes import Note
from human_gait.export.ranges import joint_ranges
from human_gait.export.robot import robot_text, scenario_robot
from human_gait.scenario import Load, Subject

BODIES = {**BODIES, "with a weight": make_body(Subject.default(), Load(18.1, model="force"))}
SMALL = 1e-6
"""Of each joint's peak: what torques may differ by."""


@pytest.fixture(params=BODIES.values(), ids=BODIES, scope="module")
def body(request):
    return request.param


def text_of(body):
    return robot_text(body, joint_ranges(body.subject))


def carried(body):
    """The mass that the engines have to find: a weight is a force."""
    return body.subject.mass + (body.load.mass if body.load.model == "rigid" else 0.0)


def by_pinocchio(model, states):
    data = model.createData()
    return np.array([pin.rnea(model, data, *state) for state in zip(*states, strict=True)])


def from_text(text):
    model = pin.buildModelFromXML(text)
    model.gravity.linear = GRAVITY
    return model


def by_drake(text, states):
    plant = drake(text)
    context, torques = plant.CreateDefaultContext(), []
    for q, v, a in zip(*states, strict=True):
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        forces = MultibodyForces(plant)
        plant.CalcForceElementsContribution(context, forces)
        torques.append(plant.CalcInverseDynamics(context, a, forces))
    return plant.CalcTotalMass(context), np.array(torques)


def drake(text):
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(text, "urdf")
    plant.mutable_gravity_field().set_gravity_vector(GRAVITY)
    plant.Finalize()
    return plant


def mujoco_model(text):
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.gravity[:] = GRAVITY
    assert [model.joint(i).name for i in range(model.njnt)] == list(JOINT_NAMES)
    return mujoco, model


def by_mujoco(text, states, contacts=True):
    mujoco, model = mujoco_model(text)
    if not contacts:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    data, torques = mujoco.MjData(model), []
    for data.qpos[:], data.qvel[:], data.qacc[:] in zip(*states, strict=True):
        mujoco.mj_inverse(model, data)
        torques.append(data.qfrc_inverse.copy())
    return model.body_mass.sum(), np.array(torques)


def by_pybullet(path, states):
    bullet = pytest.importorskip("pybullet")
    bullet.connect(bullet.DIRECT)
    try:
        robot = bullet.loadURDF(str(path))
        bullet.setGravity(*GRAVITY)
        joints = [bullet.getJointInfo(robot, j) for j in range(bullet.getNumJoints(robot))]
        moving = [j[1].decode() for j in joints if j[2] != bullet.JOINT_FIXED]
        order = [JOINT_NAMES.index(name) for name in moving]
        mass = sum(bullet.getDynamicsInfo(robot, j)[0] for j in range(-1, len(joints)))
        torques = np.empty(states[0].shape)
        for k, state in enumerate(zip(*states, strict=True)):
            values = [x[order].tolist() for x in state]
            torques[k, order] = bullet.calculateInverseDynamics(robot, *values)
        return mass, torques
    finally:
        bullet.disconnect()


def assert_close(found, expected):
    peak = np.abs(expected).max(axis=0)
    assert (np.abs(found - expected).max(axis=0) / peak).max() < SMALL


def test_engines_find_mass_and_torques(body):
    """Of the body without weight, which URDF cannot hold; MuJoCo without contact: limbs cross."""
    text, states = text_of(body), random_states(5)
    expected = by_pinocchio(from_text(body.urdf), states)
    model = from_text(text)
    assert pin.computeTotalMass(model) == pytest.approx(carried(body), rel=1e-12)
    assert_close(by_pinocchio(model, states), expected)
    for engine in (by_drake, lambda *given: by_mujoco(*given, contacts=False)):
        mass, torques = engine(text, states)
        assert mass == pytest.approx(carried(body), rel=1e-12)
        assert_close(torques, expected)


def test_pybullet_finds_mass_and_torques_without_options(body, tmp_path):
    path, states = tmp_path / "human.urdf", random_states(5)
    path.write_text(text_of(body))
    mass, torques = by_pybullet(path, states)
    assert mass == pytest.approx(carried(body), rel=1e-12)
    assert_close(torques, by_pinocchio(from_text(body.urdf), states))


def test_no_part_of_a_walker_touches_another(tmp_path):
    """In MuJoCo, where links that touch push each other and a walk needs other torques."""
    gait = walking()
    now = sampled(gait, 50).samples
    export_gait(gait, tmp_path, ["urdf"])
    text, states = (tmp_path / "human.urdf").read_text(), (now.q, now.v, now.a)
    _, torques = by_mujoco(text, states)
    assert_close(torques, by_pinocchio(from_text(gait.body.urdf), states))


def test_every_link_but_the_world_has_mass_and_inertia(body):
    robot = ET.fromstring(text_of(body))
    for link in robot.iter("link"):
        if link.get("name") == "world":
            continue
        (inertial,) = link.findall("inertial")
        tensor = inertial.find("inertia").attrib
        assert float(inertial.find("mass").get("value")) > 0
        xx, yy, zz, xy, xz, yz = (
            float(tensor[f"i{axes}"]) for axes in ("xx", "yy", "zz", "xy", "xz", "yz")
        )
        moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        assert moments[0] > 0
        assert moments[:2].sum() > moments[2]  # a body of positive density


def test_libraries_that_follow_the_first_child_come_to_the_toes():
    robot = ET.fromstring(text_of(MALE))
    children = {}
    for joint in robot.iter("joint"):
        children.setdefault(joint.find("parent").get("link"), []).append(joint)
    link, passed = "base_link", []
    while link in children:
        joint = children[link][0]
        link = joint.find("child").get("link")
        passed.append(joint.get("name"))
    assert passed[:-1] == list(JOINT_NAMES[:13])  # pelvis and right leg
    assert "dh_" not in text_of(MALE)


def test_soles_are_at_the_contact_points(body):
    """The lowest points of the balls, standing upright, with the friction of the ground."""
    text = robot_text(body, joint_ranges(body.subject), 0.3)
    model = from_text(text)
    shapes, data = (
        pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION),
        model.createData(),
    )
    placed = shapes.createData()
    pin.updateGeometryPlacements(model, data, shapes, placed, np.zeros(55))
    for f, side in enumerate(SIDES):
        found = [
            pose.translation - [0, shape.geometry.radius, 0]
            for pose, shape in zip(placed.oMg, shapes.geometryObjects, strict=True)
            if shape.name.startswith("sole") and f"_{side}_" in shape.name
        ]
        np.testing.assert_allclose(found, standing_points(body, f), atol=1e-9)
    for kind in ("lateral_friction", "mu_static", "mu_dynamic"):
        values = [value for value in text.splitlines() if kind in value]
        assert values
        assert all('value="0.3"' in value for value in values)


def standing_points(body, f):
    model = body.pinocchio_model()
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.zeros(55))
    names = [f"{name}_{SIDES[f]}" for name in body.contact.names]
    return [data.oMf[model.getFrameId(name)].translation for name in names]


OWN = {
    "ankle_dorsiflexion_r": [-60, 40],
    "ankle_dorsiflexion_l": [-60, 40],
    "knee_flexion_r": [5, 70],
    "frozen": ["neck_upper_rotation"],
}


def test_limits_are_those_of_the_scenario(tmp_path):
    """In every engine, by the command and by export; what is frozen stays so in MuJoCo, too."""
    own = scenario(limits=OWN)
    (tmp_path / "own.toml").write_text(own.to_toml())
    out = tmp_path / "own.urdf"
    assert cli.run(["urdf", "--scenario", str(tmp_path / "own.toml"), "--out", str(out)]) == 0
    lower, upper = joint_limits(own)
    assert np.abs(lower - position_limits()[0]).max() > 0.1
    plant, model = drake(out.read_text()), from_text(out.read_text())
    for found, expected in (
        (plant.GetPositionLowerLimits(), lower),
        (plant.GetPositionUpperLimits(), upper),
        (model.lowerPositionLimit, lower),
        (model.upperPositionLimit, upper),
    ):
        np.testing.assert_allclose(found, expected, atol=2e-12)
    _, physics = mujoco_model(out.read_text())
    assert physics.jnt_limited.all()
    np.testing.assert_allclose(physics.jnt_range, np.stack([lower, upper], axis=1), atol=2e-12)


def test_a_body_without_scenario_has_the_limits_of_the_anatomy():
    model = from_text(scenario_robot())
    np.testing.assert_array_equal(model.lowerPositionLimit, position_limits()[0])
    np.testing.assert_array_equal(model.upperPositionLimit, position_limits()[1])


def test_limits_of_what_is_no_joint_are_refused():
    with pytest.raises(ScenarioError, match=r"limits\.tail: unknown DOF"):
        scenario_robot(scenario(limits={"tail": [0, 1]}))


def test_limits_hold_the_motion_beside_them():
    """Effort is strength, or what the walk takes; velocity, too; none for the pelvis."""
    gait = walking()
    now = sampled(gait, 100).samples
    strong = replace(now, tau=now.tau * 50, v=now.v * 50)
    for motion in (now, strong):
        ranges = joint_ranges(gait.scenario.subject, gait.scenario, motion)
        assert (ranges.effort[:6] == 0).all()
        assert (np.abs(motion.tau)[:, 6:] <= ranges.effort[6:]).all()
        assert (np.abs(motion.v) <= ranges.velocity).all()
        strength = np.abs(torque_limits(gait.scenario.subject)).max(axis=0)[6:]
        assert (ranges.effort[6:] >= strength).all()
        raised = {DOF_NAMES[i + 6] for i in np.flatnonzero(ranges.effort[6:] > strength)}
        said = " ".join(ranges.of_drive)
        assert all(name in said for name in raised)
        assert "nothing drives the six joints of the pelvis" in said


def test_a_motion_beyond_its_limits_is_said_to_be_and_one_at_them_is_within():
    gait = walking()
    q = sampled(gait, 100).samples.q.copy()
    lower, upper = joint_limits(gait.scenario)
    q[:] = np.clip(q, lower, upper)
    elbow, knee = index("elbow_flexion_r"), index("knee_flexion_l")
    q[3, elbow], q[4, knee] = upper[elbow] + 1e-9, lower[knee] - 0.2
    motion = replace(sampled(gait, 100).samples, q=q)
    ranges = joint_ranges(gait.scenario.subject, gait.scenario, motion)
    assert "knee_flexion_l by 0.2 rad" in " ".join(ranges.of_position)
    assert "elbow" not in " ".join(ranges.of_position)
    assert ranges.upper[elbow] == q[3, elbow]
    assert ranges.lower[knee] == lower[knee]


def test_the_comment_of_a_file_is_xml_whatever_the_scenario_is_called():
    """Two hyphens end a comment of XML: a lawful name of a scenario may have them."""
    note = Note(scenario(name="a--b---"), "0" * 16, "This is no walk -- at all: <&>")
    robot = ET.fromstring(
        robot_text(MALE, joint_ranges(MALE.subject), note=note),
        ET.XMLParser(target=ET.TreeBuilder(insert_comments=True)),
    )
    (comment,) = [child for child in robot if child.tag is ET.Comment]
    lines = dict(line.split("=", 1) for line in comment.text.splitlines() if "=" in line)
    assert json.loads(lines["scenario"]) == note.scenario.to_dict()
    assert lines["gait_digest"] == "0" * 16
