import numpy as np
import pytest
from bodies import BODIES, MALE, random_states

from human_gait import data
from human_gait.body import dh, skeleton

AXES = {"x": 0, "y": 1, "z": 2}


def test_the_transformation_is_eq_1():
    """T = Rz(theta) Tz(d) Tx(a) Rx(alpha), put together from its four factors."""
    theta, d, a, alpha = 0.3, 0.7, -0.2, 1.1
    rz, rx, shift = np.eye(4), np.eye(4), np.eye(4)
    rz[:2, :2] = [[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]]
    rx[1:3, 1:3] = [[np.cos(alpha), -np.sin(alpha)], [np.sin(alpha), np.cos(alpha)]]
    shift[0, 3], shift[2, 3] = a, d
    np.testing.assert_allclose(dh.dh_matrix(theta, d, a, alpha), rz @ shift @ rx, atol=1e-16)


def test_derivatives_of_the_transformations_match_a_complex_step():
    q, _, _ = random_states(5)
    T, dT, ddT = dh.transforms(MALE.table, q)
    stepped = dh.transforms(MALE.table, q + 1e-30j)
    np.testing.assert_array_equal(stepped[0].real, T)
    np.testing.assert_allclose(stepped[0].imag / 1e-30, dT, atol=1e-15)
    np.testing.assert_allclose(stepped[1].imag / 1e-30, ddT, atol=1e-15)


def test_twists_turn_transformations_into_their_derivatives():
    T, dT, ddT = dh.transforms(MALE.table, random_states(5)[0])
    Q = dh.twists(MALE.table)
    np.testing.assert_allclose(T @ Q, dT, atol=1e-15)
    np.testing.assert_allclose(T @ Q @ Q, ddT, atol=1e-15)


def test_every_joint_axis_is_the_world_axis_of_the_table_at_q_zero():
    P, _ = dh.frames(MALE.table, np.zeros(55))
    rows = [row for row in data.rows("dh_table") if row["kind"] == "joint"]
    for row, frame in zip(rows, P, strict=True):
        sign, axis = row["axis_at_neutral"]
        expected = np.eye(3)[AXES[axis]] * (-1.0 if sign == "-" else 1.0)
        np.testing.assert_allclose(frame[:3, 2], expected, atol=1e-15, err_msg=row["name"])


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_the_mirrored_posture_is_the_mirror_image(body):
    """Points mirror as vectors, rotation axes as pseudovectors."""
    q, _, _ = random_states(5)
    P, A = dh.frames(body.table, q)
    P_mirror, A_mirror = dh.frames(body.table, skeleton.mirror(q))
    other, sign = skeleton.MIRROR_INDEX, skeleton.MIRROR_SIGN
    points = A[:, other][..., :3, 3] * [-1, 1, 1]
    np.testing.assert_allclose(A_mirror[..., :3, 3], points, atol=1e-14)
    turns = ~skeleton.PRISMATIC
    axes = (P[:, other][..., :3, 2] * [1, -1, -1] * sign[:, None])[:, turns]
    np.testing.assert_allclose(P_mirror[:, turns][..., :3, 2], axes, atol=1e-14)


def test_frames_follow_the_tree():
    q, _, _ = random_states(3)
    T, _, _ = dh.transforms(MALE.table, q)
    _, A = dh.frames(MALE.table, q)
    for j, p in enumerate(MALE.table.parent):
        parent = np.eye(4) if p < 0 else A[:, p]
        np.testing.assert_allclose(A[:, j], parent @ MALE.table.base[j] @ T[:, j], atol=1e-14)


def test_positive_angles_are_what_their_names_say():
    """One degree of freedom moves; where does a point below it go? x left, y up, z forward."""

    def moved(name, segment):
        q = np.zeros((2, 55))
        q[1, skeleton.index(name)] = 0.2
        tip = dh.frames(MALE.table, q)[1][:, skeleton.SEGMENTS[segment], :3, 3]
        return tip[1] - tip[0]

    forward, up, left = np.array([0, 0, 1]), np.array([0, 1, 0]), np.array([1, 0, 0])
    assert moved("hip_flexion_r", "thigh_r") @ forward > 0
    assert moved("hip_abduction_r", "thigh_r") @ left < 0
    assert moved("hip_abduction_l", "thigh_l") @ left > 0
    assert moved("knee_flexion_l", "shank_l") @ forward < 0
    assert moved("ankle_dorsiflexion_r", "toe_r") @ up > 0
    assert moved("hip_rotation_r", "toe_r") @ left > 0
    assert moved("toe_extension_l", "toe_l") @ up > 0
    assert moved("spine1_flexion", "head") @ forward > 0
    assert moved("spine1_lateral", "head") @ left < 0
    assert moved("shoulder_flexion_r", "hand_r") @ forward > 0
    assert moved("shoulder_abduction_r", "hand_r") @ left < 0
    assert moved("elbow_flexion_l", "hand_l") @ forward > 0
    assert moved("clavicle_elevation_r", "upperarm_r") @ up > 0
    assert moved("clavicle_protraction_r", "upperarm_r") @ forward > 0


def test_the_inverse_undoes_the_transformation():
    T, _, _ = dh.transforms(MALE.table, random_states(2)[0])
    identity = np.broadcast_to(np.eye(4), T.shape)
    np.testing.assert_allclose(dh.inverse(T) @ T, identity, atol=1e-15)


def test_another_number_of_dof_is_refused():
    with pytest.raises(ValueError, match=r"\(\.\.\., 55\)"):
        dh.transforms(MALE.table, np.zeros(54))
