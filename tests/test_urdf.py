from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy
from bodies import BODIES, LOADED, MALE, random_states

from human_gait.body import dh
from human_gait.body.limits import position_limits
from human_gait.body.urdf import roll_pitch_yaw, urdf_text
from human_gait.checks.engines import drake_plant

FRAMES = [f"dh_{i:02d}" for i in range(1, 56)]


@pytest.fixture(params=BODIES.values(), ids=BODIES)
def body(request):
    return request.param


def test_frames_in_pinocchio_are_the_dh_frames(body):
    """1e-12: rounding of a chain of some 25 transformations of a 2 m body, with a wide margin."""
    model = body.pinocchio_model()
    data = model.createData()
    q, _, _ = random_states(10)
    _, A = dh.frames(body.table, q)
    for posture, expected in zip(q, A, strict=True):
        pin.framesForwardKinematics(model, data, posture)
        poses = [data.oMf[model.getFrameId(name)].homogeneous for name in FRAMES]
        np.testing.assert_allclose(poses, expected, atol=1e-12)


def test_frames_in_drake_are_the_dh_frames(body):
    plant = drake_plant(body)
    context = plant.CreateDefaultContext()
    q, _, _ = random_states(10)
    _, A = dh.frames(body.table, q)
    links = [plant.GetBodyByName(name) for name in FRAMES]
    for posture, expected in zip(q, A, strict=True):
        plant.SetPositions(context, posture)
        poses = [plant.EvalBodyPoseInWorld(context, link).GetAsMatrix4() for link in links]
        np.testing.assert_allclose(poses, expected, atol=1e-12)


def test_frames_in_yourdfpy_are_the_dh_frames(tmp_path: Path):
    path = tmp_path / "human.urdf"
    path.write_text(urdf_text(MALE))
    robot = yourdfpy.URDF.load(path)
    q, _, _ = random_states(3)
    _, A = dh.frames(MALE.table, q)
    for posture, expected in zip(q, A, strict=True):
        robot.update_cfg(posture)
        poses = [robot.get_transform(name, "world") for name in FRAMES]
        np.testing.assert_allclose(poses, expected, atol=1e-12)


def test_contact_points_are_named_frames_of_the_model(body):
    model = body.pinocchio_model()
    data = model.createData()
    q = random_states(1)[0][0]
    pin.framesForwardKinematics(model, data, q)
    _, A = dh.frames(body.table, q)
    for side, links, points in zip("rl", body.contact.links, body.contact.points, strict=True):
        for name, i, point in zip(body.contact.names, links, points, strict=True):
            frame = data.oMf[model.getFrameId(f"{name}_{side}")]
            expected = A[i, :3, :3] @ point + A[i, :3, 3]
            np.testing.assert_allclose(frame.translation, expected, atol=1e-12)


def test_readers_find_the_mass_of_the_body(body):
    assert pin.computeTotalMass(body.pinocchio_model()) == pytest.approx(body.total_mass, rel=1e-14)
    plant = drake_plant(body)
    mass = plant.CalcTotalMass(plant.CreateDefaultContext())
    assert mass == pytest.approx(body.total_mass, rel=1e-14)


def test_readers_find_the_joint_limits(body):
    lower, upper = position_limits()
    model, plant = body.pinocchio_model(), drake_plant(body)
    np.testing.assert_array_equal(model.lowerPositionLimit, lower)
    np.testing.assert_array_equal(model.upperPositionLimit, upper)
    np.testing.assert_array_equal(plant.GetPositionLowerLimits(), lower)
    np.testing.assert_array_equal(plant.GetPositionUpperLimits(), upper)


def test_a_backpack_is_a_link_only_if_there_is_a_load():
    assert "backpack" in drake_link_names(LOADED)
    assert "backpack" not in drake_link_names(MALE)


def drake_link_names(body):
    plant = drake_plant(body)
    return {
        plant.get_body(i).name()
        for i in plant.GetBodyIndices(plant.GetModelInstanceByName("human"))
    }


def test_the_same_body_gives_the_same_text(body):
    assert urdf_text(body) == urdf_text(body)


def test_the_shapes_stay_above_the_sole_and_below_the_vertex():
    """Seen by yourdfpy standing upright; 4 mm: the shapes are drawn, not measured."""
    import io

    robot = yourdfpy.URDF.load(io.StringIO(urdf_text(MALE)))
    (low, high) = robot.scene.bounds[:, 1]
    lengths = MALE.measures.lengths
    sole = -(lengths["L_th"] + lengths["L_sh"] + lengths["h_ank"])
    assert low == pytest.approx(sole, abs=0.004)
    assert high == pytest.approx(sole + MALE.subject.stature, abs=0.004)


@pytest.mark.parametrize("angles", [(0.3, -0.5, 2.0), (0.4, np.pi / 2, 0), (-0.4, -np.pi / 2, 0)])
def testroll_pitch_yaw_rebuilds_the_rotation(angles):
    """1e-8: near a pitch of a right angle the angles carry only half of the digits."""
    R = pin.rpy.rpyToMatrix(*angles)
    np.testing.assert_allclose(pin.rpy.rpyToMatrix(*roll_pitch_yaw(R)), R, atol=1e-8)
