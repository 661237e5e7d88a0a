"""Three engines, one answer: the paper's recursion, Pinocchio and Drake.

Relative to the largest torque of the instant; 1e-10 leaves five digits for rounding.
"""

import numpy as np
import pytest
from bodies import (
    BODIES,
    at_instant,
    complex_step,
    random_loads,
    random_states,
)

from human_gait.body import dh, skeleton
from human_gait.checks.engines import DrakeEngine, PinocchioEngine
from human_gait.dynamics.inverse_dynamics import (
    CHAINS,
    FOOT_LINKS,
    PinocchioDynamics,
    linearised_load,
    load_torques,
    load_torques_dq,
)
from human_gait.dynamics.jet import Linearised
from human_gait.dynamics.recursive_lagrangian import (
    ExternalLoad,
    inverse_dynamics,
    inverse_dynamics_derivatives,
)

N = 20
TOLERANCE = 1e-10


def relative(difference, reference):
    return np.abs(difference).max() / np.abs(reference).max()


@pytest.fixture(params=BODIES.values(), ids=BODIES, scope="module")
def body(request):
    return request.param


@pytest.fixture(scope="module")
def dynamics(body):
    return PinocchioDynamics(body)


@pytest.fixture(params=[False, True], ids=["unloaded", "loaded"], scope="module")
def loads(request):
    return random_loads(N) if request.param else []


@pytest.fixture(scope="module")
def state():
    return random_states(N)


@pytest.mark.parametrize("engine", [PinocchioEngine, DrakeEngine])
def test_torques_agree_with_the_other_engines(body, state, loads, engine):
    tau, other = inverse_dynamics(body, *state, loads), engine(body).torques(state, loads)
    for mine, theirs in zip(tau, other, strict=True):
        assert relative(mine - theirs, mine) < TOLERANCE


@pytest.mark.parametrize("k", range(3))
def test_gradients_agree_with_pinocchio(body, dynamics, state, loads, k):
    """Loads constant in the world, their points fixed in the links."""
    q, v, a = (x[k] for x in state)
    now = at_instant(loads, k)
    by_q = complex_step(lambda x: inverse_dynamics(body, x, v, a, now), q)
    by_v = complex_step(lambda x: inverse_dynamics(body, q, x, a, now), v)
    by_a = complex_step(lambda x: inverse_dynamics(body, q, v, x, now), a)
    tau = loaded_torques(body, dynamics, (q, v, a), now)
    assert relative(tau.value[0] - inverse_dynamics(body, q, v, a, now), tau.value) < TOLERANCE
    for by, found in zip((by_q, by_v, by_a), np.split(tau.partials[0], 3, axis=1), strict=True):
        assert relative(by - found, by) < TOLERANCE


def test_sensitivities_agree_with_pinocchio(body, dynamics, state, loads):
    """Loads constant in the world, their points fixed in the links."""
    native = inverse_dynamics_derivatives(body, *state, loads)
    for k in range(N):
        now = at_instant(loads, k)
        tau = loaded_torques(body, dynamics, [x[k] for x in state], now)
        for by, found in zip(native[1:], np.split(tau.partials[0], 3, axis=1), strict=True):
            assert relative(by[k] - found, found) < TOLERANCE


@pytest.mark.parametrize("f", [0, 1], ids=["right foot", "left foot"])
def test_gradients_under_a_wrench_that_stays_where_it_is(body, dynamics, state, f):
    """The same wrench about the world's origin, whatever the foot does under it."""
    q, v, a = (x[0] for x in state)
    link, wrench = FOOT_LINKS[f, 1], np.array([90.0, 800.0, -150.0, 40.0, -60.0, 300.0])

    def torques(x):
        A = dh.frames(body.table, x)[1][..., link, :3, :]
        point = -np.einsum("...ji,...j->...i", A[..., :3], A[..., 3])  # the origin, in the link
        load = ExternalLoad(link, point, wrench[:3], wrench[3:])
        return inverse_dynamics(body, x, v, a, [load])

    now = dynamics.inverse(q[None], v[None], a[None])
    chain, by_q = CHAINS[f], complex_step(torques, q)
    S = now.axes[:, :, chain]
    tau, dtau_dq = now.torque.value[0], now.torque.partials[0, :, :55].copy()
    tau[chain] -= load_torques(S, wrench[None])[0]
    dtau_dq[np.ix_(chain, chain)] -= load_torques_dq(S, wrench[None])[0]
    assert relative(tau - torques(q), tau) < TOLERANCE
    assert relative(dtau_dq - by_q, by_q) < TOLERANCE


def loaded_torques(body, dynamics, state, loads):
    """Torques (1, 55) under loads, with partials; the wrenches move with the loaded points."""
    now = dynamics.inverse(*(x[None] for x in state))
    A = dh.frames(body.table, state[0])[1]
    value, partials = now.torque.value.copy(), now.torque.partials.copy()
    for load in loads:
        chain = path(load.link)
        point = A[load.link, :3, :3] @ load.point + A[load.link, :3, 3]
        linear, angular = now.axes[0, :3, chain], now.axes[0, 3:, chain]
        moved = np.zeros((1, 6, 165))
        moved[0, 3:, chain] = np.cross(linear + np.cross(angular, point), load.force)
        wrench = np.concatenate([load.force, np.cross(point, load.force) + load.moment])
        torque = linearised_load(now.axes, chain, Linearised(wrench[None], moved))
        value[:, chain] -= torque.value
        partials[:, chain] -= torque.partials
    return Linearised(value, partials)


def path(link):
    """The joints from the world to a link."""
    chain = [link]
    while skeleton.PARENT[chain[0]] >= 0:
        chain.insert(0, int(skeleton.PARENT[chain[0]]))
    return np.array(chain)
