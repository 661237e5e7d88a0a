"""One step from the solution of a problem to that of one like it, on small problems."""

from dataclasses import replace

import numpy as np
import pytest
from small_problems import VALLEY_START, corner, numbers, valley

from human_gait.newton.interior_point import minimise
from human_gait.newton.nonlinear_program import Duals
from human_gait.newton.optimality import Goal
from human_gait.newton.sensitivity import by_active_set, by_barrier

TIGHT = Goal(1e-9, 1e-9, 1e-9)
WAYS = {"active set": by_active_set, "barrier": by_barrier}
BLIND = {"active set": 1e-9, "barrier": 2e-4}  # the barrier keeps away from bounds


def within(radius):
    return valley(row_upper=numbers(radius**2))


def solved(problem):
    end = minimise(problem, VALLEY_START, TIGHT)
    assert end.solved
    return end


@pytest.mark.parametrize("way", WAYS)
def test_what_a_step_misses_is_of_second_order(way):
    before = solved(within(1.0))
    missed, stated = [], []
    for change in (0.02, 0.04, 0.08):
        problem = within(1.0 + change)
        after = solved(problem)
        moved = WAYS[way](problem, before.x, before.duals)
        missed.append(np.abs(moved.x - after.x).max())
        cost = problem.cost(moved.x)
        stated.append(abs(cost - moved.cost) + moved.left)
        assert missed[-1] < np.abs(before.x - after.x).max() / 4.0
        assert abs(cost - problem.cost(after.x)) <= stated[-1]
    assert missed[2] <= 6.0 * missed[1] <= 36.0 * missed[0] + BLIND[way]
    assert stated == sorted(stated)


@pytest.mark.parametrize("way", WAYS)
def test_a_problem_that_has_not_changed_is_where_it_was(way):
    before = solved(within(1.0))
    moved = WAYS[way](within(1.0), before.x, before.duals)
    np.testing.assert_allclose(moved.x, before.x, atol=1e-3)
    assert moved.cost == pytest.approx(within(1.0).cost(before.x), abs=1e-4)
    assert moved.left < 1e-4


@pytest.mark.parametrize("way", WAYS)
def test_variables_stay_in_their_bounds(way):
    problem = replace(corner(), upper=numbers(0.6, 0.7))
    moved = WAYS[way](problem, numbers(0.7, 0.0), Duals(np.zeros(1), numbers(2.6, -2.0)))
    assert np.all((moved.x >= problem.lower) & (moved.x <= problem.upper))
    np.testing.assert_allclose(moved.x, [0.6, 0.0], atol=1e-2)


@pytest.mark.parametrize("way", WAYS)
def test_where_there_is_no_step_there_is_none(way):
    nowhere = replace(within(1.0), row_lower=numbers(4.0), row_upper=numbers(1.0))
    before = solved(within(1.0))
    assert WAYS[way](nowhere, before.x, before.duals) is None
