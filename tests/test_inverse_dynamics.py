"""Held against plain Pinocchio; `test_cross_validation` holds it against the other engines."""

import numpy as np
import pinocchio as pin
import pytest
from bodies import BODIES, random_states

from human_gait.body import skeleton
from human_gait.dynamics.inverse_dynamics import (
    CHAINS,
    ENGINES,
    FOOT_LINKS,
    LINKS,
    ROOT,
    PinocchioDynamics,
    RecursiveDynamics,
    load_torques,
    make_dynamics,
)

K = 4


@pytest.fixture(params=BODIES.values(), ids=BODIES, scope="module")
def body(request):
    return request.param


@pytest.fixture(scope="module")
def model(body):
    return body.pinocchio_model()


@pytest.fixture(scope="module")
def state():
    return random_states(K)


@pytest.fixture(scope="module")
def now(body, state):
    return PinocchioDynamics(body).inverse(*state)


def test_torques_are_those_of_the_recursive_newton_euler_algorithm(model, state, now):
    data = model.createData()
    expected = [pin.rnea(model, data, *instant) for instant in zip(*state, strict=True)]
    np.testing.assert_allclose(now.torque.value, expected, rtol=1e-12, atol=1e-10)


def test_partials_stand_in_the_order_position_velocity_acceleration(model, state, now):
    """Central differences of the torques of some 1e3 N m: rounding over 1e-6 leaves 1e-6."""
    data, h = model.createData(), 1e-6
    for k in range(K):
        instant = [x[k] for x in state]
        for block in range(3):
            for i in (1, 5, 9, 30, 40):
                ends = []
                for side in (1, -1):
                    moved = [x.copy() for x in instant]
                    moved[block][i] += side * h
                    ends.append(pin.rnea(model, data, *moved))
                slope = (ends[0] - ends[1]) / (2 * h)
                found = now.torque.partials[k, :, 55 * block + i]
                np.testing.assert_allclose(found, slope, atol=1e-8 * np.abs(slope).max() + 1e-5)


def test_the_mass_matrix_is_symmetric(now):
    M = now.torque.partials[:, :, 110:]
    np.testing.assert_array_equal(M, M.swapaxes(1, 2))


def test_axes_are_the_motion_of_the_body_at_the_worlds_origin(model, state, now):
    data = model.createData()
    for k, q in enumerate(state[0]):
        expected = pin.computeJointJacobians(model, data, q)
        np.testing.assert_allclose(now.axes[k], expected, atol=1e-12)


def test_link_poses_are_the_frames_of_the_links(model, state, now):
    data = model.createData()
    for k, q in enumerate(state[0]):
        pin.forwardKinematics(model, data, q)
        expected = [data.oMi[int(link) + 1].homogeneous for link in LINKS]
        np.testing.assert_allclose(now.link_poses[k], expected, atol=1e-13)


def test_a_load_does_the_work_of_its_wrench(now):
    """tau . v = F . V: the power of the joints is that of the wrench on the moving link."""
    chain = CHAINS[0]
    wrench, v = np.random.default_rng(3).normal(size=(2, K, 55))
    wrench = wrench[:, :6]
    twist = np.einsum("kxi,ki->kx", now.axes[:, :, chain], v[:, chain])
    power = np.sum(load_torques(now.axes[:, :, chain], wrench) * v[:, chain], axis=1)
    np.testing.assert_allclose(power, np.sum(wrench * twist, axis=1), rtol=1e-12)


def test_chains_lead_from_the_world_to_the_toes():
    for chain, toes in zip(CHAINS, FOOT_LINKS[:, 1], strict=True):
        assert (chain[0], chain[-1]) == (0, toes)
        np.testing.assert_array_equal(skeleton.PARENT[chain[1:]], chain[:-1])
    np.testing.assert_array_equal(ROOT, np.arange(6))


def test_instants_do_not_influence_each_other(state, now, body):
    alone = PinocchioDynamics(body).inverse(*(x[2:3] for x in state))
    np.testing.assert_array_equal(alone.torque.value[0], now.torque.value[2])
    np.testing.assert_array_equal(alone.torque.partials[0], now.torque.partials[2])


@pytest.mark.parametrize("part", ["value", "partials"])
def test_the_recursion_gives_the_torques_and_partials_of_pinocchio(body, state, now, part):
    """1e-10 of the largest of each block: five digits are left for rounding."""
    native = RecursiveDynamics(body).inverse(*state)
    found, expected = getattr(native.torque, part), getattr(now.torque, part)
    assert found.shape == expected.shape
    blocks = 3 if part == "partials" else 1
    for a, b in zip(*(np.split(x, blocks, axis=-1) for x in (found, expected)), strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-10 * np.abs(b).max())


def test_the_recursion_gives_the_axes_and_poses_of_pinocchio(body, state, now):
    native = RecursiveDynamics(body).inverse(*state)
    np.testing.assert_allclose(native.axes, now.axes, atol=1e-12)
    np.testing.assert_allclose(native.link_poses, now.link_poses, atol=1e-12)


def test_dynamics_go_by_name(body):
    made = [type(make_dynamics(body, engine)) for engine in ENGINES]
    assert made == [PinocchioDynamics, RecursiveDynamics]
    with pytest.raises(ValueError, match="'newton': choose one of pinocchio, dh"):
        make_dynamics(body, "newton")
