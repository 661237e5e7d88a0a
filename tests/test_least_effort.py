"""The lean of least effort, held against pivots of any height at the same motion."""

import numpy as np
import pytest
from walks import BACKPACK, scenario, walking_states

from human_gait.body.limits import torque_weights
from human_gait.walk.ground_reaction import LEG_JOINTS
from human_gait.walk.instant import Walker

GROUND = {"sharing": "least_effort", "pivot_height": 0.9}
TASKS = {
    "male": scenario(ground=GROUND),
    "weighted, with a backpack, all torques paid": scenario(
        ground=GROUND,
        load=BACKPACK | {"model": "force"},
        objective={"weighting": "strength", "passive_torques": "none"},
    ),
}


@pytest.fixture(params=TASKS.values(), ids=TASKS, scope="module")
def task(request):
    return request.param


@pytest.fixture(scope="module")
def states(task):
    return walking_states(task)


@pytest.fixture(scope="module")
def walker(task):
    return Walker(task)


@pytest.fixture(scope="module")
def now(walker, states):
    return walker.at(*states)


@pytest.fixture(scope="module")
def lean(walker, now):
    """g (n,) where both feet stand, [1/m]."""
    return walker.plan.spread + now.ground.variables.value[now.lean.k, 6]


def leaning(task, states, k, lean):
    """The walk at one instant with a pivot at the height 1/g."""
    walker = Walker(task.replace({"ground": {"sharing": "pivot"}}))
    walker.plan.spread = lean
    return walker.at(*(part[[k]] for part in states))


def test_some_instants_have_both_feet_on_the_ground_and_some_one(now):
    assert 3 < len(now.lean.k) < len(now.t) - 3


def test_at_every_instant_the_feet_lean_towards_one_pivot(task, states, now, lean):
    """Forces and torques are those of a pivot at 1/g, which is not that of the setting."""
    assert np.abs(lean * 0.9 * task.subject.stature - 1.0).max() > 0.1
    for k, g in zip(now.lean.k, lean, strict=True):
        pivot = leaning(task, states, k, g)
        for found, expected in zip(now.ground.wrenches, pivot.ground.wrenches, strict=True):
            np.testing.assert_allclose(found.value[[k]], expected.value, atol=1e-9)
        for found, expected in (
            (now.torque, pivot.torque),
            (now.muscle_torque, pivot.muscle_torque),
        ):
            np.testing.assert_allclose(found[[k]], expected, atol=1e-9)


def test_no_other_lean_takes_the_muscles_less(task, states, walker, now, lean):
    """The squared torques of the legs and what holds the lean, at leans all round."""
    weights, spread = torque_weights(task)[LEG_JOINTS], walker.plan.spread
    hold = (0.3 * walker.plan.weight * task.walk.step_length**2) ** 2

    def effort(k, g):
        muscles = leaning(task, states, k, g).muscle_torque[0, LEG_JOINTS]
        return np.sum(weights * muscles**2) + hold * (g - spread) ** 2

    for k, g in zip(now.lean.k, lean, strict=True):
        least = effort(k, g)
        assert all(effort(k, g + more) > least for more in (-1.0, -0.01, 0.01, 1.0))


def test_only_the_legs_feel_it(task, states, now):
    """The pair cancels in the sum: nothing changes for the rest, and nothing on one foot."""
    parallel = Walker(task.replace({"ground": {"sharing": "parallel"}})).at(*states)
    rest = np.delete(now.torque - parallel.torque, LEG_JOINTS, axis=1)
    assert np.abs(rest).max() < 1e-9
    both = [sum(w.value for w in x.ground.wrenches) for x in (now, parallel)]
    np.testing.assert_allclose(*both, atol=1e-9)
    single = np.setdiff1d(np.arange(len(now.t)), now.lean.k)
    np.testing.assert_array_equal(now.torque[single], parallel.torque[single])
    found, expected = (x.muscle_partials[single] for x in (now, parallel))
    np.testing.assert_allclose(found, expected, atol=1e-14 * np.abs(expected).max())


def test_the_pair_goes_with_the_loads_of_both_feet(task, now):
    """It is 0 where one of them has none: l1 l2 R_y |B - A| a unit of lean."""
    l2 = now.ground.leading_share.value[now.lean.k]
    right, left = (unit.value[:, [0, 2]] for unit in now.lean.pair.on_feet)
    np.testing.assert_allclose(right, -left, atol=1e-9)
    loads = l2 * (1.0 - l2) * now.ground.force.value[now.lean.k, 1]
    length = np.linalg.norm(right, axis=1)
    assert np.all(length >= 0.3 * task.walk.step_length * loads)
    assert np.all(length <= 1.5 * task.walk.step_length * loads)
