import numpy as np
import pytest
from walks import near_walk, scenario

from human_gait.body.limits import torque_weights
from human_gait.body.skeleton import MIRROR_INDEX, index
from human_gait.dynamics.tissues import PassiveJoints
from human_gait.problem.objective import squared_torque
from human_gait.problem.program import build_program
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.instant import Walker

PLAIN = {"weighting": "none", "passive_torques": "none"}
STANDING = np.zeros((3, 55))
TIMES = 0.5 * np.ones(3)


def still(**objective):
    """Instants of standing on the left foot."""
    return Walker(scenario(objective=objective)).at(TIMES, STANDING, STANDING, STANDING)


def test_it_is_the_integral_of_the_squared_torques():
    """Eq. (18): the same torques for two seconds."""
    now = still(**PLAIN)
    value = squared_torque(np.ones(55)).value(now, np.array([0.5, 1.0, 0.5]))
    assert value == pytest.approx(2.0 * np.sum(now.torque[0] ** 2), rel=1e-12)


def test_partials_are_those_of_a_square():
    walker = Walker(scenario())
    now = walker.at(TIMES, STANDING, STANDING, STANDING)
    weights = np.random.default_rng(0).uniform(0, 2, 55)
    adjoint = Adjoint.none(*now.ground.variables.value.shape)
    squared_torque(weights).add_to_adjoint(now, np.full(3, 0.1), 2.0, adjoint)
    found, tau = walker.gradient(now, adjoint), now.muscle_torque
    expected = 0.2 * np.einsum("i,ki,kis->ks", 2 * weights, tau, now.muscle_partials)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-13 * np.abs(expected).max())


def test_the_value_does_not_depend_on_the_number_of_instants():
    """A coarse and a fine grid of one motion: the rectangle rule of a periodic function."""
    coarse = build_program(scenario(intervals=24, objective=PLAIN))
    fine = build_program(scenario(intervals=96, objective=PLAIN))
    free = near_walk(coarse, noise=0.0)
    assert coarse.cost(free)[0] == pytest.approx(fine.cost(free)[0], rel=0.1)


def test_muscles_do_not_pay_for_what_the_tissues_give():
    paid, free = still(passive_torques="none"), still(passive_torques="tissue")
    np.testing.assert_array_equal(paid.muscle_torque, paid.torque)
    tissue = PassiveJoints().torque(STANDING, STANDING).value
    np.testing.assert_allclose(free.muscle_torque, free.torque - tissue, atol=1e-12)
    np.testing.assert_array_equal(free.torque, paid.torque)


def test_without_weighting_all_torques_count_alike():
    np.testing.assert_array_equal(torque_weights(scenario(objective=PLAIN)), np.ones(55))


def test_weighted_by_strength_a_strong_joint_may_do_more():
    weights = torque_weights(scenario(objective={"weighting": "strength"}))
    assert weights[index("hip_flexion_r")] < weights[index("elbow_flexion_r")]
    assert weights[index("elbow_flexion_r")] < weights[index("wrist_flexion_r")]
    assert np.all(weights[6:] > 0.0)
    np.testing.assert_array_equal(weights[:6], 0.0)  # free of torque in any case
    np.testing.assert_allclose(weights, weights[MIRROR_INDEX])
