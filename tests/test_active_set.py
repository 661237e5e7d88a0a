"""Newton steps from the solution of a problem to that of one like it, on small problems."""

from dataclasses import replace

import numpy as np
import pytest
from small_problems import VALLEY_END, corner, cube, numbers, valley

from human_gait.active_set import LOST, OPTIMAL, follow
from human_gait.interior_point import minimise
from human_gait.nonlinear_program import Duals

TIGHT = {"tol": 1e-10, "nlp_scaling_method": "none"}


def none_of(problem):
    return Duals(np.zeros(len(problem.row_lower)), np.zeros(len(problem.lower)))


def solved(problem, start):
    """An end by IPOPT."""
    end = minimise(problem, start, TIGHT)
    assert end.solved
    return end


def left(problem, end):
    """What is left of the gradient of the Lagrangian."""
    rows, columns = problem.jacobian_entries
    slope = problem.gradient(end.x) + end.duals.variables
    np.add.at(slope, columns, end.duals.rows[rows] * problem.jacobian(end.x))
    return slope


def steeper(push):
    """The valley with a push along x."""
    plain = valley()
    return valley(
        cost=lambda x: plain.cost(x) - push * x[0],
        gradient=lambda x: plain.gradient(x) - numbers(push, 0.0),
    )


def test_a_solution_is_found_again_at_once():
    before = solved(valley(), VALLEY_END)
    end = follow(valley(), before.x, before.duals)
    assert end.solved
    assert end.status == OPTIMAL
    assert end.iterations == 3  # down to the problem itself
    np.testing.assert_allclose(end.x, before.x, atol=1e-6)
    np.testing.assert_allclose(end.duals.rows, before.duals.rows, rtol=1e-4)


@pytest.mark.parametrize("radius", [0.8, 0.95, 1.0, 1.05, 1.2])
def test_a_limit_that_is_moved_is_followed(radius):
    """To where an interior-point method ends too, with the same multipliers."""
    before = solved(valley(), VALLEY_END)
    moved = replace(valley(), row_upper=numbers(radius**2))
    end, cold = follow(moved, before.x, before.duals), solved(moved, VALLEY_END)
    assert end.solved
    np.testing.assert_allclose(end.x, cold.x, atol=1e-5)
    np.testing.assert_allclose(end.duals.rows, cold.duals.rows, rtol=1e-3)
    assert np.abs(left(moved, end)).max() < 1e-4


def test_a_limit_that_is_moved_out_of_reach_lets_go():
    """The minimum of the valley without a limit is (1, 1)."""
    before = solved(valley(), VALLEY_END)
    end = follow(replace(valley(), row_upper=numbers(9.0)), before.x, before.duals)
    assert end.solved
    np.testing.assert_allclose(end.x, [1.0, 1.0], atol=1e-4)
    assert not np.any(end.duals.rows)


def test_a_limit_that_starts_to_hold_gets_a_multiplier():
    before = solved(replace(valley(), row_upper=numbers(9.0)), VALLEY_END)
    end = follow(valley(), before.x, before.duals)
    assert end.solved
    np.testing.assert_allclose(end.x, VALLEY_END, atol=1e-5)
    assert end.duals.rows[0] > 0.01


@pytest.mark.parametrize("push", [-0.3, 0.2, 1.0])
def test_another_cost_is_followed(push):
    before = solved(valley(), VALLEY_END)
    end, cold = follow(steeper(push), before.x, before.duals), solved(steeper(push), VALLEY_END)
    assert end.solved
    np.testing.assert_allclose(end.x, cold.x, atol=1e-5)


def test_bounds_of_variables_are_followed():
    before = solved(corner(), numbers(0.3, 0.3))
    moved = replace(corner(), upper=numbers(0.75, 0.7), lower=numbers(0.0, 0.05))
    end = follow(moved, before.x, before.duals)
    assert end.solved
    np.testing.assert_allclose(end.x, [0.75, 0.05], atol=1e-9)
    assert np.abs(left(moved, end)).max() < 1e-9
    assert end.duals.variables[0] > 0.0 > end.duals.variables[1]


def test_equations_are_followed():
    moved = replace(cube(), row_lower=numbers(9.0), row_upper=numbers(9.0))
    end = follow(moved, numbers(2.0), Duals(numbers(0.0), numbers(0.0)))
    assert end.solved
    np.testing.assert_allclose(end.x, 9.0 ** (1 / 3), rtol=1e-7)


def test_steps_converge_quadratically():
    """A smaller change needs hardly fewer steps; the ends are exact to far below the tolerance."""
    before = solved(valley(), VALLEY_END)
    for change in (1e-2, 1e-4):
        moved = replace(valley(), row_upper=numbers(1.0 + change))
        end = follow(moved, before.x, before.duals)
        assert end.solved
        assert end.iterations <= 6
        assert abs(moved.rows(end.x)[0] - 1.0 - change) < 1e-6


def test_what_is_too_far_is_not_called_solved():
    """No x has x^3 = 1e6 within the steps allowed."""
    far = replace(cube(), row_lower=numbers(1e6), row_upper=numbers(1e6))
    end = follow(far, numbers(2.0), none_of(far))
    assert not end.solved
    assert end.status == LOST


def test_bounds_that_exclude_each_other_are_not_called_solved():
    none = replace(corner(), row_lower=numbers(3.0))
    assert not follow(none, numbers(0.7, 0.0), none_of(none)).solved


def test_the_small_multipliers_that_a_barrier_leaves_are_no_active_bounds():
    before = solved(replace(valley(), row_upper=numbers(9.0)), VALLEY_END)
    blurred = Duals(numbers(1e-3), numbers(1e-3, -1e-3))
    wide = replace(valley(), row_upper=numbers(9.0), upper=numbers(9.0, 9.0), lower=-numbers(9, 9))
    end = follow(wide, before.x, blurred)
    assert end.solved
    np.testing.assert_allclose(end.x, [1.0, 1.0], atol=1e-4)


def test_points_where_a_matrix_is_singular_are_avoided():
    """Half of every first step is beyond them."""
    plain, refused = valley(), []

    def cost(x):
        if x[0] > 0.85 and not refused:
            refused.append(x)
            raise np.linalg.LinAlgError
        return plain.cost(x)

    wide = replace(valley(cost=cost), row_upper=numbers(9.0))
    before = solved(valley(), VALLEY_END)
    end = follow(wide, before.x, before.duals)
    assert refused
    assert end.solved
    np.testing.assert_allclose(end.x, [1.0, 1.0], atol=1e-4)


def test_where_no_part_of_a_step_can_be_computed_the_last_point_is_returned():
    plain, before = valley(), solved(valley(), VALLEY_END)

    def cost(x):
        if x[0] > VALLEY_END[0] + 1e-6:
            raise np.linalg.LinAlgError
        return plain.cost(x)

    end = follow(replace(valley(cost=cost), row_upper=numbers(9.0)), before.x, before.duals)
    assert not end.solved
    assert end.status == LOST
    np.testing.assert_allclose(end.x, VALLEY_END, atol=1e-5)


def test_multipliers_of_bounds_that_are_not_there_are_left_out():
    """Those of a file that belongs to something else, say."""
    before = solved(valley(), VALLEY_END)
    odd = Duals(before.duals.rows, numbers(-2.0, 3.0))
    end = follow(valley(), before.x, odd)
    assert end.solved
    np.testing.assert_allclose(end.x, VALLEY_END, atol=1e-5)


@pytest.mark.parametrize("name", ["cost", "gradient", "rows", "jacobian", "hessian"])
def test_what_a_function_raises_is_passed_on(name):
    def fail(*_):
        raise KeyboardInterrupt

    broken = valley(**{name: fail})
    with pytest.raises(KeyboardInterrupt):
        follow(broken, VALLEY_END, none_of(broken))
