"""Three engines, one answer: the paper's recursion, Pinocchio and Drake.

Relative to the largest torque of the instant; 1e-10 leaves five digits for rounding.
"""

import numpy as np
import pinocchio as pin
import pytest
from engines import (
    BODIES,
    at_instant,
    complex_step,
    drake_plant,
    drake_torques,
    pinocchio_loads,
    random_loads,
    random_states,
)

from human_gait.model import build_model
from human_gait.recursive_lagrangian import inverse_dynamics
from human_gait.urdf import link_to_dh

N = 20
TOLERANCE = 1e-10


def relative(difference, reference):
    return np.abs(difference).max() / np.abs(reference).max()


@pytest.fixture(params=BODIES.values(), ids=BODIES, scope="module")
def body(request):
    return request.param


@pytest.fixture(scope="module")
def model(body):
    return build_model(body)


@pytest.fixture(params=[False, True], ids=["unloaded", "loaded"], scope="module")
def loads(request):
    return random_loads(N) if request.param else []


@pytest.fixture(scope="module")
def state():
    return random_states(N)


def test_torques_agree_with_pinocchio(body, model, state, loads):
    tau = inverse_dynamics(body, *state, loads)
    data = model.createData()
    for k, (q, v, a) in enumerate(zip(*state, strict=True)):
        forces = pinocchio_loads(body, model, q, at_instant(loads, k))
        assert relative(tau[k] - pin.rnea(model, data, q, v, a, forces), tau[k]) < TOLERANCE


def test_torques_agree_with_drake(body, state, loads):
    tau = inverse_dynamics(body, *state, loads)
    plant = drake_plant(body)
    for k, instant in enumerate(zip(*state, strict=True)):
        expected = drake_torques(plant, instant, at_instant(loads, k))
        assert relative(tau[k] - expected, tau[k]) < TOLERANCE


@pytest.mark.parametrize("k", range(3))
def test_gradients_agree_with_pinocchio(body, model, state, loads, k):
    q, v, a = (x[k] for x in state)
    now = at_instant(loads, k)
    by_q = complex_step(lambda x: inverse_dynamics(body, x, v, a, now), q)
    by_v = complex_step(lambda x: inverse_dynamics(body, q, x, a, now), v)
    by_a = complex_step(lambda x: inverse_dynamics(body, q, v, x, now), a)
    dq, dv, da = pinocchio_gradients(body, model, (q, v, a), now)
    assert relative(by_q - dq, dq) < TOLERANCE
    assert relative(by_v - dv, dv) < TOLERANCE
    assert relative(by_a - da, da) < TOLERANCE


def pinocchio_gradients(body, model, state, loads):
    """Pinocchio holds the forces constant in the joint's frame; here they are in the world's."""
    data = model.createData()
    forces = pinocchio_loads(body, model, state[0], loads)
    pin.computeRNEADerivatives(model, data, *state, forces)
    mass = np.triu(data.M) + np.triu(data.M, 1).T  # only this triangle is filled
    dtau_dq = data.dtau_dq.copy()
    for load in loads:
        J = pin.computeJointJacobian(model, data, state[0], load.link + 1)
        dtau_dq -= J.T @ turning_load(body, data, load, J[3:])
    return dtau_dq, data.dtau_dv.copy(), mass


def turning_load(body, data, load, w):
    """(6, 55) change of a load in the joint's frame as that frame turns by w (3, 55)."""
    rotation = data.oMi[load.link + 1].rotation
    to_dh = link_to_dh(body.table)[load.link]
    point = to_dh[:3, :3] @ load.point + to_dh[:3, 3]
    force = -np.cross(w.T, rotation.T @ load.force)
    moment = -np.cross(w.T, rotation.T @ load.moment) + np.cross(point, force)
    return np.hstack([force, moment]).T
