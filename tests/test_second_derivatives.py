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
    load_torques,
    load_torques_dq,
    make_dynamics,
    weighted_axes_dq,
)
from human_gait.dynamics.jet import Linearised
from human_gait.dynamics.second_derivatives import Tree
from human_gait.dynamics.tissues import PassiveJoints
from human_gait.problem.objective import squared_torque
from human_gait.problem.program import build_program
from human_gait.walk.adjoint import Adjoint, Block
from human_gait.walk.feet import Feet
from human_gait.walk.ground_reaction import N_LOWER
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


def wrench_of(tree, dynamics, x):
    """What all bodies need, with first derivatives."""
    q, v, a = split(x)
    return tree.first(dynamics.inverse(q, v, a), v, a).wrench


@pytest.mark.parametrize("engine", ENGINES)
def test_the_wrench_of_the_tree_gives_the_torques_of_the_global_dof(task, state, engine):
    """J^T F = tau_1..6 of either engine, which the tree shares no formula with."""
    body = make_body(task.subject, task.load)
    dynamics, tree = make_dynamics(body, engine), Tree(body.table, body.pseudo_inertia())
    now = dynamics.inverse(*state)
    found = load_torques(now.axes[:, :, :6], tree.first(now, *state[1:]).wrench.value)
    scale = np.abs(now.torque.value[:, :6]).max()
    np.testing.assert_allclose(found, now.torque.value[:, :6], atol=1e-11 * scale)


def test_the_partials_of_the_wrench_are_its_slopes(task, state):
    body = make_body(task.subject, task.load)
    dynamics, tree = make_dynamics(body, "pinocchio"), Tree(body.table, body.pseudo_inertia())
    x = np.concatenate(state, axis=1)
    d = np.random.default_rng(1).normal(size=(*x.shape, 8))
    slopes = central_difference(
        lambda x: wrench_of(tree, dynamics, x).value, x, np.moveaxis(d, -1, 0).T
    )
    found = wrench_of(tree, dynamics, x).partials @ d
    assert np.abs(found - slopes).max() < TOLERANCE * np.abs(slopes).max()


@pytest.mark.parametrize("engine", ENGINES)
def test_of_weighted_torques_and_root_wrench(task, state, engine):
    """The tree's own formula against the first derivatives of either engine."""
    body = make_body(task.subject, task.load)
    dynamics, tree = make_dynamics(body, engine), Tree(body.table, body.pseudo_inertia())
    weights, by_wrench = RNG.normal(size=(len(state[0]), 55)), RNG.normal(size=(len(state[0]), 6))

    def gradient(x):
        found = dynamics.inverse(*split(x)).torque, wrench_of(tree, dynamics, x)
        parts = zip((weights, by_wrench), found, strict=True)
        return sum(np.einsum("ki,kis->ks", w, part.partials) for w, part in parts)

    at = tree.first(dynamics.inverse(*state), *state[1:])
    found = tree.second(at, weights, by_wrench)
    assert_slopes(found.dense(), gradient, np.concatenate(state, axis=1))
    np.testing.assert_array_equal(found.by_posture(), found.dense()[:, :55, :55])


def test_a_resting_weight_has_those_of_a_carried_force(state):
    body = make_body(CARRIED.subject, CARRIED.load)
    dynamics, carried, K = make_dynamics(body, "pinocchio"), CarriedForce(body), len(state[0])
    none = Linearised(np.zeros((K, 6)), np.zeros((K, 6, 165)))
    weights, by_wrench = RNG.normal(size=(len(state[0]), 55)), RNG.normal(size=(len(state[0]), 6))

    def gradient(q):
        bare = dynamics.inverse(q, *state[1:])
        loaded, wrench = carried.added(bare, none)
        added = (loaded.torque - bare.torque), wrench
        parts = zip((weights, by_wrench), added, strict=True)
        return sum(np.einsum("ki,kis->ks", w, part.partials) for w, part in parts)[:, :55]

    now = dynamics.inverse(*state)
    assert_slopes(carried.hessian(now, weights, by_wrench), gradient, state[0])


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
    moved = weighted_axes_dq(S, weights)
    assert_slopes(load_hessian(S, moved, wrench), gradient, state[0][:, chain])
    by_wrench = np.einsum("kx,kxj->kj", wrench, moved)
    np.testing.assert_allclose(by_wrench, gradient(state[0][:, chain]), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("ball", ["foot", "toes"])
def test_of_the_contact_points(task, state, ball):
    """Of a function of positions and velocities with slopes and curvatures of its own."""
    body, (q, v, a) = make_body(task.subject), state
    feet, dynamics = Feet(body, ball), make_dynamics(body, "pinocchio")
    slopes, curvatures = RNG.normal(size=(2, 2, len(q), 2, 4, 3))
    at = dynamics.inverse(q, v, a)
    here = places(feet.motion(at, v))

    def gradient(x):
        moved = feet.motion(dynamics.inverse(*split(x)), split(x)[1])
        found = np.zeros((len(q), 3, 55))
        by_position, by_velocity = (
            slope + curvature * (there - before)
            for slope, curvature, there, before in zip(
                slopes, curvatures, places(moved), here, strict=True
            )
        )
        for f, foot in enumerate(moved):
            by_q = np.einsum("kpx,kpxj->kj", by_position[:, f], foot.jacobian)
            by_q += np.einsum("kpx,kpxj->kj", by_velocity[:, f], foot.velocity_dq)
            found[:, 0, CHAINS[f]] += by_q
            by_v = np.einsum("kpx,kpxj->kj", by_velocity[:, f], foot.jacobian)
            found[:, 1, CHAINS[f]] += by_v
        return found.reshape(len(q), -1)

    into, second = np.zeros((3, len(q), N_LOWER, N_LOWER)), np.zeros((len(q), 3, 55, 3, 55))
    feet.add_hessian(at.axes, v, feet.motion(at, v), (*slopes, *curvatures), into)
    Block(np.arange(N_LOWER), *into).add_to(second)
    assert_slopes(second.reshape(-1, 165, 165), gradient, np.concatenate(state, axis=1))


def places(feet):
    """Positions and velocities of the points of both feet, each (K, 2, 4, 3)."""
    return [np.stack([getattr(x, of) for x in feet], axis=1) for of in ("position", "velocity")]


def test_of_passive_torques(state):
    passive, weights = PassiveJoints(), RNG.normal(size=(len(state[0]), 55))

    def gradient(q):
        return passive.torque(q, state[1]).gradient(weights)[0]

    second = np.zeros((len(state[0]), 55, 55))
    passive.add_hessian(state[0], weights, second[:, :N_LOWER, :N_LOWER])
    assert_slopes(second, gradient, state[0])


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
        weight = 2.0 * 0.1 * weights * at.muscle_torque
        return np.einsum("ki,kis->ks", weight, at.muscle_partials)

    adjoint = Adjoint.none(*now.ground.variables.value.shape)
    squared_torque(weights).add_to_adjoint(now, spacing, 1.0, adjoint)
    x = np.concatenate([now.q, now.v, now.a], axis=1)
    assert_slopes(walker.second_derivatives(now, adjoint).dense(), gradient, x)
