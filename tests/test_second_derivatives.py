"""Second derivatives, each block against central differences of the gradients it belongs to."""

import numpy as np
import pytest
from walks import BACKPACK, PEOPLE, central_difference, near_walk, scenario, walking_states

from human_gait.body.person import make_body
from human_gait.dynamics.carried_load import CarriedForce
from human_gait.dynamics.inverse_dynamics import (
    CHAINS,
    ENGINES,
    load_hessian,
    load_torques_dq,
    make_dynamics,
    weighted_axes_dq,
)
from human_gait.dynamics.second_derivatives import TreeCurvature
from human_gait.dynamics.tissues import PassiveJoints
from human_gait.problem.objective import squared_torque
from human_gait.problem.program import build_program
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.feet import Feet
from human_gait.walk.ground_reaction import root_wrench
from human_gait.walk.instant import Walker

RNG = np.random.default_rng(0)
TOLERANCE = 1e-7  # of the largest: rounding leaves 1e-10 of the gradients over a step of 1e-6
CARRIED = scenario(load=BACKPACK | {"model": "force"})


def split(x):
    return x[..., :55], x[..., 55:110], x[..., 110:]


def assert_slopes(second, gradient, x, n_directions=8):
    """A Hessian (K, n, n) against the slopes of a gradient (K, n) along random directions."""
    d = np.random.default_rng(1).normal(size=(*x.shape, n_directions))
    slopes = central_difference(gradient, x, np.moveaxis(d, -1, 0).T)
    found = np.einsum("kst,ktd->ksd", second, d)
    assert np.abs(found - slopes).max() < TOLERANCE * np.abs(slopes).max()
    np.testing.assert_allclose(second, second.swapaxes(1, 2), atol=1e-12 * np.abs(second).max())


@pytest.fixture(params=PEOPLE.values(), ids=PEOPLE, scope="module")
def task(request):
    return request.param


@pytest.fixture(scope="module")
def state(task):
    return walking_states(task)[1:]


@pytest.mark.parametrize("engine", ENGINES)
def test_of_weighted_torques_and_root_wrench(task, state, engine):
    """The tree's own formula against the first derivatives of either engine."""
    body = make_body(task.subject, task.load)
    dynamics = make_dynamics(body, engine)
    weights, by_wrench = RNG.normal(size=(len(state[0]), 55)), RNG.normal(size=(len(state[0]), 6))

    def gradient(x):
        found = dynamics.inverse(*split(x))
        parts = (weights, found.torque), (by_wrench, root_wrench(found))
        return sum(np.einsum("ki,kis->ks", w, part.partials) for w, part in parts)

    axes = dynamics.inverse(*state).axes
    curvature = TreeCurvature(body.table, body.pseudo_inertia())
    found = curvature.hessian(state, axes, weights, by_wrench).dense()
    assert_slopes(found, gradient, np.concatenate(state, axis=1))


def test_a_resting_weight_has_those_of_a_carried_force(state):
    body = make_body(CARRIED.subject, CARRIED.load)
    dynamics, carried = make_dynamics(body, "pinocchio"), CarriedForce(body)
    weights, by_wrench = RNG.normal(size=(len(state[0]), 55)), RNG.normal(size=(len(state[0]), 6))

    def gradient(q):
        bare = dynamics.inverse(q, *state[1:])
        loaded, alone = (
            np.einsum("ki,kis->ks", weights, x.torque.partials)
            + np.einsum("ki,kis->ks", by_wrench, root_wrench(x).partials)
            for x in (carried.added(bare, q), bare)
        )
        return (loaded - alone)[:, :55]

    axes = dynamics.inverse(*state).axes
    assert_slopes(carried.hessian(state[0], axes, weights, by_wrench), gradient, state[0])


@pytest.mark.parametrize("side", [0, 1])
def test_of_the_torques_of_a_constant_wrench(task, state, side):
    dynamics, chain = make_dynamics(make_body(task.subject), "pinocchio"), CHAINS[side]
    weights, wrench = RNG.normal(size=(len(state[0]), 13)), RNG.normal(size=(len(state[0]), 6))

    def gradient(q_chain):
        q = state[0].copy()
        q[:, chain] = q_chain
        S = dynamics.inverse(q, *state[1:]).axes[:, :, chain]
        return np.einsum("ki,kij->kj", weights, load_torques_dq(S, wrench))

    S = dynamics.inverse(*state).axes[:, :, chain]
    assert_slopes(load_hessian(S, weights, wrench), gradient, state[0][:, chain])
    by_wrench = np.einsum("kx,kxj->kj", wrench, weighted_axes_dq(S, weights))
    np.testing.assert_allclose(by_wrench, gradient(state[0][:, chain]), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("side", [0, 1])
def test_of_the_contact_points(task, state, side):
    body, chain = make_body(task.subject), CHAINS[side]
    feet, dynamics = Feet(body), make_dynamics(body, "pinocchio")
    by_position, by_velocity = RNG.normal(size=(2, len(state[0]), 4, 3))
    onto = np.concatenate([chain, 55 + chain])

    def gradient(x):
        q, v = state[0].copy(), state[1].copy()
        q[:, chain], v[:, chain] = x[:, :13], x[:, 13:]
        foot = feet.motion(dynamics.inverse(q, v, state[2]), v)[side]
        by_q = np.einsum("kpx,kpxj->kj", by_position, foot.jacobian)
        by_q += np.einsum("kpx,kpxj->kj", by_velocity, foot.velocity_dq)
        by_v = np.einsum("kpx,kpxj->kj", by_velocity, foot.jacobian)
        return np.concatenate([by_q, by_v], axis=1)

    at = dynamics.inverse(*state)
    motion = feet.motion(at, state[1])[side]
    qq, qv = feet.hessian(at, motion, state[1], side, by_position, by_velocity)
    second = np.block([[qq, qv], [qv.swapaxes(1, 2), np.zeros_like(qq)]])
    assert_slopes(second, gradient, np.concatenate(state[:2], axis=1)[:, onto])


def test_of_passive_torques(state):
    passive, weights = PassiveJoints(), RNG.normal(size=(len(state[0]), 55))

    def gradient(q):
        return np.einsum("ki,kis->ks", weights, passive.torque(q, state[1]).partials)[:, :55]

    assert_slopes(passive.hessian(state[0], weights), gradient, state[0])


@pytest.mark.parametrize("sharing", ["pivot", "least_effort"])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_walker_adds_them_up(sharing, engine):
    """The squared muscle torques at single instants; the constraints are tested in the program."""
    task = CARRIED.replace({"ground": {"sharing": sharing}})
    program = build_program(task, dynamics=engine)
    walker, now = Walker(task, engine), program.instants(near_walk(program))
    spacing, weights = np.full(len(now.t), 0.1), RNG.uniform(1, 2, 55)

    def gradient(x):
        at = walker.at(now.t, *split(x))
        weight = 2.0 * 0.1 * weights * at.muscle_torque.value
        return np.einsum("ki,kis->ks", weight, at.muscle_torque.partials)

    adjoint = Adjoint.none(*now.ground.variables.value.shape)
    squared_torque(weights).add_to_adjoint(now, spacing, 1.0, adjoint)
    x = np.concatenate([now.q, now.v, now.a], axis=1)
    assert_slopes(walker.second_derivatives(now, adjoint).dense(), gradient, x)
