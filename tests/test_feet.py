import numpy as np
import pinocchio as pin
import pytest
from bodies import BODIES, random_states
from walks import central_difference

from human_gait.body.links import CONTACT_POINTS
from human_gait.dynamics.inverse_dynamics import CHAINS, PinocchioDynamics
from human_gait.walk.feet import Feet

K = 3


class Legs:
    """The feet of one body and the reference in plain Pinocchio."""

    def __init__(self, body):
        self.dynamics, self.feet = PinocchioDynamics(body), Feet(body)
        self.model = body.pinocchio_model()

    def motion(self, q, v):
        q, v = np.atleast_2d(q), np.atleast_2d(v)
        return self.feet.motion(self.dynamics.inverse(q, v, 0 * q), v)

    def points(self, q, side):
        data = self.model.createData()
        pin.framesForwardKinematics(self.model, data, q)
        names = [f"{name}_{side}" for name in CONTACT_POINTS]
        return np.array([data.oMf[self.model.getFrameId(name)].translation for name in names])


@pytest.fixture(params=BODIES.values(), ids=BODIES, scope="module")
def legs(request):
    return Legs(request.param)


@pytest.fixture(scope="module")
def state():
    q, v, _ = random_states(K)
    return q, v


@pytest.fixture(params=[0, 1], ids=["right", "left"])
def f(request):
    return request.param


def test_points_are_pinocchios_frames(legs, state, f):
    foot = legs.motion(*state)[f]
    expected = [legs.points(q, "rl"[f]) for q in state[0]]
    np.testing.assert_allclose(foot.position, expected, atol=1e-13)


def test_the_jacobian_is_the_slope_of_the_positions(legs, state, f):
    """Rounding of metres over 1e-6 is 1e-10; the curvature adds as little."""
    foot = legs.motion(*state)[f]
    for k, q in enumerate(state[0]):
        directions = np.eye(55)[:, CHAINS[f]]
        slopes = central_difference(lambda x: legs.points(x, "rl"[f]), q, directions)
        np.testing.assert_allclose(foot.jacobian[k], slopes, atol=1e-8)


def test_no_other_joint_moves_the_foot(legs, state, f):
    others = np.setdiff1d(np.arange(55), CHAINS[f])
    moved = state[0].copy()
    moved[:, others] += 0.1
    before, after = legs.motion(*state)[f], legs.motion(moved, state[1])[f]
    np.testing.assert_array_equal(before.position, after.position)


def test_the_velocity_is_the_jacobian_times_the_joint_velocities(legs, state, f):
    foot = legs.motion(*state)[f]
    expected = np.einsum("kpxc,kc->kpx", foot.jacobian, state[1][:, CHAINS[f]])
    np.testing.assert_allclose(foot.velocity, expected, atol=1e-12)


def test_the_velocity_is_the_rate_of_the_position(legs, state, f):
    foot = legs.motion(*state)[f]
    for k, (q, v) in enumerate(zip(*state, strict=True)):
        rate = central_difference(lambda x: legs.points(x, "rl"[f]), q, v[:, None])[..., 0]
        np.testing.assert_allclose(foot.velocity[k], rate, rtol=1e-7, atol=1e-6)


def test_velocity_dq_is_the_slope_of_the_velocity(legs, state, f):
    """Velocities of up to 1e2 m/s: rounding over 1e-6 is 1e-8, the curvature some 1e-9."""
    foot = legs.motion(*state)[f]
    for k, (q, v) in enumerate(zip(*state, strict=True)):
        directions = np.eye(55)[:, CHAINS[f]]
        slopes = central_difference(lambda x, v=v: legs.motion(x, v)[f].velocity[0], q, directions)
        np.testing.assert_allclose(foot.velocity_dq[k], slopes, atol=1e-6)


def test_only_the_toe_tip_moves_with_the_toe_joint(legs, state, f):
    foot = legs.motion(*state)[f]
    for partials in (foot.jacobian[..., -1], foot.velocity_dq[..., -1]):
        np.testing.assert_array_equal(partials[:, :-1], 0.0)
        assert np.abs(partials[:, -1]).max() > 0.01
