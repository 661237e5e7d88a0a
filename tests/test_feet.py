import numpy as np
import pinocchio as pin
import pytest
from bodies import BODIES, random_states
from walks import central_difference

from human_gait.body.links import CONTACT_POINTS
from human_gait.body.skeleton import index
from human_gait.checks.engines import DrakeEngine
from human_gait.dynamics.inverse_dynamics import CHAINS, ENGINES, PinocchioDynamics, make_dynamics
from human_gait.walk.feet import Feet

K = 3


class Legs:
    """The feet of one body and the reference in plain Pinocchio."""

    def __init__(self, body):
        self.body = body
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


TOES = [index("toe_extension_r"), index("toe_extension_l")]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_ball_on_the_toes_is_in_the_same_place_while_they_are_straight(legs, state, f, engine):
    body, q = legs.body, state[0].copy()
    q[:, TOES] = 0.0
    now = make_dynamics(body, engine).inverse(q, state[1], 0.0 * q)
    foot, toes = (Feet(body, ball).motion(now, state[1])[f] for ball in ("foot", "toes"))
    np.testing.assert_allclose(toes.position, foot.position, atol=1e-12)
    assert np.abs(toes.velocity - foot.velocity)[:, 1:3].max() > 1e-3


@pytest.mark.parametrize("engine", ENGINES)
def test_a_ball_on_the_toes_moves_with_them(legs, state, f, engine):
    """Its distance from the toe tip stays, and rates and slopes are those of its place."""
    dynamics, feet = make_dynamics(legs.body, engine), Feet(legs.body, "toes")
    q, v = state

    def motion(x, rate):
        return feet.motion(dynamics.inverse(x, rate, 0.0 * x), rate)[f]

    here, straight = motion(q, v), motion(np.zeros((1, 55)), np.zeros((1, 55)))
    apart = [x.position[:, 1:3] - x.position[:, 3:] for x in (here, straight)]
    lengths = [np.linalg.norm(x, axis=-1) for x in apart]
    np.testing.assert_allclose(lengths[0] - lengths[1], 0.0, atol=1e-12)
    rate = (motion(q + 1e-6 * v, v).position - motion(q - 1e-6 * v, v).position) / 2e-6
    np.testing.assert_allclose(here.velocity, rate, rtol=1e-7, atol=1e-6)
    for c, i in enumerate(CHAINS[f]):
        more = np.zeros_like(q)
        more[:, i] = 1e-6
        ahead, behind = motion(q + more, v), motion(q - more, v)
        slope = (ahead.position - behind.position) / 2e-6
        np.testing.assert_allclose(here.jacobian[..., c], slope, atol=1e-8)
        slope = (ahead.velocity - behind.velocity) / 2e-6
        np.testing.assert_allclose(here.velocity_dq[..., c], slope, atol=1e-6)


@pytest.mark.parametrize("ball", ["foot", "toes"])
def test_the_checks_look_at_the_same_points(legs, state, f, ball):
    q, v = state
    now = make_dynamics(legs.body, "pinocchio").inverse(q, v, 0.0 * q)
    foot = Feet(legs.body, ball).motion(now, v)[f]
    found = DrakeEngine(legs.body, ball).mechanics((q, v, 0.0 * q), [])
    np.testing.assert_allclose(found.points[:, f], foot.position, atol=1e-12)
    np.testing.assert_allclose(found.velocities[:, f], foot.velocity, atol=1e-11)
