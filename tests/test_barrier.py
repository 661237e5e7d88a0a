"""Barriers: where a solve starts, how they fall, what is left of their conditions."""

from dataclasses import replace

import numpy as np
import pytest
from small_problems import corner, numbers, random_quadratic

from human_gait.newton.barrier import COLD, WARM
from human_gait.newton.interior_point import InteriorPoint, minimise
from human_gait.newton.optimality import Error, Goal, left


@pytest.mark.parametrize("seed", range(4))
def test_a_warm_start_is_near_the_solution_and_balanced(seed):
    """Products are the barrier's, active bounds keep their multipliers, all else its place."""
    problem = random_quadratic(seed, np.linspace(0.1, 5.0, 10))
    end, barrier = minimise(problem, np.zeros(10)), 3e-5
    method = InteriorPoint(problem)
    state = method.start(end.x, end.duals, barrier)
    below, above = method.bounds.gaps(state.inside)
    for z, gap in ((state.low, below), (state.high, above)):
        bounded = np.isfinite(gap)
        np.testing.assert_allclose(z[bounded] * gap[bounded], barrier)
    z = np.concatenate([end.duals.variables, end.duals.rows])
    active = (np.abs(z) > 1e-2) & ~method.bounds.equal
    assert np.any(active)
    np.testing.assert_allclose((state.high - state.low)[active], z[active], rtol=1e-2, atol=1e-3)
    place = np.concatenate([end.x, problem.rows(end.x)])
    np.testing.assert_allclose(state.inside, place, atol=0.011)  # 1 % of a width from the bounds
    assert minimise(problem, end.x, duals=end.duals).iterations <= 3


@pytest.mark.parametrize(("push", "share"), [(0.01, 0.01), (0.05, 0.5), (0.2, 0.1)])
def test_a_cold_start_is_put_inside_its_bounds(push, share):
    """So far, or that part of their distance; what is inside stays where it is."""
    problem = corner()
    problem.lower[:], problem.upper[:] = [0.0, 0.0], [0.7, 0.02]
    method = InteriorPoint(problem, COLD._replace(push=push, share=share))
    state = method.start(numbers(-3.0, 0.5), None, 0.1)
    margin = np.minimum(push, share * numbers(0.7, 0.02))
    np.testing.assert_allclose(state.point.x, [margin[0], 0.02 - margin[1]], rtol=1e-12)
    assert state.inside[2] == state.point.bounded[2]


@pytest.mark.parametrize("schedule", [COLD, WARM])
def test_a_schedule_leads_to_any_barrier_in_a_few_stages(schedule):
    """Each at most a fifth of the one before."""
    barrier, stages = schedule.first, 0
    while barrier > 1e-8:
        after = schedule.after(barrier)
        assert after <= 0.2001 * barrier
        barrier, stages = after, stages + 1
    assert stages <= 6


@pytest.mark.parametrize("condition", ["stationary", "feasible", "complementary"])
def test_a_goal_is_met_if_each_condition_is(condition):
    goal = Goal(1e-5, 1e-6, 1e-7)
    just = Error(1e-5, 1e-6, 1e-7)
    assert just.meets(goal)
    assert not just._replace(**{condition: 1.01 * getattr(just, condition)}).meets(goal)
    assert just._replace(**{condition: 3.0}).largest == 3.0


def test_the_conditions_of_a_barrier_are_met_where_products_are_the_barrier():
    """A warm state has them so; to the problem itself its products are what is left."""
    problem, barrier = random_quadratic(0, np.linspace(0.1, 5.0, 10)), 1e-3
    end, method = minimise(problem, np.zeros(10)), InteriorPoint(problem)
    state = method.start(end.x, end.duals, barrier)
    assert left(method.bounds, state).of(barrier).complementary < 1e-12
    assert left(method.bounds, state).of(0.0).complementary == pytest.approx(barrier)


def test_errors_count_relative_to_multipliers_above_a_hundred():
    bounds = (method := InteriorPoint(corner())).bounds
    state = method.start(numbers(0.3, 0.3), None, 0.1)
    one = left(bounds, replace(state, y=numbers(50.0))).stationary
    two = left(bounds, replace(state, y=numbers(100.0))).stationary
    assert two == pytest.approx(2.0 * one, rel=0.1)
    many = left(bounds, replace(state, y=numbers(7e5)))
    sizes = 7e5 / 7 / 100.0  # mean of seven multipliers, six of them 1
    assert many.stationary == pytest.approx(7e5 / sizes, rel=1e-3)
