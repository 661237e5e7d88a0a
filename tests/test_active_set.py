"""Newton steps from the solution of a problem to that of one like it, on small problems."""

from collections import deque
from dataclasses import replace

import numpy as np
import pytest
from small_problems import VALLEY_END, corner, cube, left, numbers, valley

from human_gait.newton import active_set as room
from human_gait.newton.active_set import (
    LOST,
    OPTIMAL,
    Homotopy,
    follow,
    is_optimal,
    noticed,
    shortened,
)
from human_gait.newton.interior_point import minimise
from human_gait.newton.nonlinear_program import Duals, Stacked
from human_gait.newton.optimality import Goal
from human_gait.newton.quadratic import bounds_of

TIGHT = Goal(1e-10, 1e-10, 1e-10)


def none_of(problem):
    return Duals(np.zeros(len(problem.row_lower)), np.zeros(len(problem.lower)))


def solved(problem, start):
    """An end by the interior-point method."""
    end = minimise(problem, start, TIGHT)
    assert end.solved
    return end


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
    assert end.iterations == 1  # of the problem itself
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


def test_only_what_is_far_is_approached_by_another_problem(monkeypatch):
    seen, model = [], Homotopy.model
    monkeypatch.setattr(
        Homotopy, "model", lambda self, t, *rest: (seen.append(t), model(self, t, *rest))[1]
    )
    before = solved(valley(), VALLEY_END)
    for radius, first in ((1.0, 0.0), (0.99, 0.0), (0.9, 0.5)):
        seen.clear()
        follow(replace(valley(), row_upper=numbers(radius**2)), before.x, before.duals)
        assert seen[0] == first
        assert not any(seen[1:])


def test_a_limit_that_is_moved_out_of_reach_lets_go():
    """The minimum of the valley without a limit is (1, 1)."""
    before = solved(valley(), VALLEY_END)
    end = follow(replace(valley(), row_upper=numbers(9.0)), before.x, before.duals)
    assert end.solved
    np.testing.assert_allclose(end.x, [1.0, 1.0], atol=1e-4)
    assert not np.any(end.duals.rows)


def test_a_limit_that_starts_to_hold_gets_a_multiplier():
    before = solved(replace(valley(), row_upper=numbers(9.0)), VALLEY_END)
    held = replace(valley(), row_upper=numbers(1.3))
    end = follow(held, before.x, before.duals)
    assert end.solved
    np.testing.assert_allclose(end.x, solved(held, VALLEY_END).x, atol=1e-5)
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
    """x = 9 is more than 25 steps of at most 0.3 away from x = -2, each of them possible."""
    far = replace(cube(), row_lower=numbers(-9.0), row_upper=numbers(1e3))
    far = replace(far, cost=lambda x: (x[0] - 9.0) ** 2)
    far = replace(far, gradient=lambda x: 2.0 * (x - 9.0), hessian=lambda *_: 2.0 * np.eye(1))
    end = follow(far, numbers(-2.0), none_of(far))
    assert not end.solved
    assert end.status == LOST
    assert end.iterations == 25
    assert 5.0 < end.x[0] < -2.0 + 25 * room.WIDEST


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


# --- the parts


def test_at_its_beginning_the_homotopy_is_solved_by_the_start():
    """Every active bound is met exactly, no other is exceeded, nothing is left of the gradient."""
    stacked = Stacked(replace(corner(), row_lower=numbers(1.2)))
    start = stacked.point(numbers(0.9, -0.1))
    y = numbers(0.5, -2.0, -0.7)
    now = stacked.derivatives(start.x)
    path = Homotopy(stacked, start, now.slope(y), y)
    lower, upper = path.bounds(1.0)
    np.testing.assert_allclose(start.bounded, bounds_of(y, lower, upper), atol=1e-15)
    assert np.all(path.excess(1.0, start) < 1e-15)
    left_over = path.gradient(1.0, now) + y[:2] + y[2:] @ now.jacobian
    np.testing.assert_allclose(left_over, 0.0, atol=1e-15)


def test_at_its_end_the_homotopy_is_the_problem():
    stacked = Stacked(corner())
    start = stacked.point(numbers(0.9, -0.1))
    now = stacked.derivatives(start.x)
    path = Homotopy(stacked, start, now.slope(np.ones(3)), np.ones(3))
    np.testing.assert_array_equal(path.bounds(0.0), (stacked.lower, stacked.upper))
    np.testing.assert_array_equal(path.gradient(0.0, now), now.gradient)
    assert path.merit(0.0, start, np.zeros(3)) == start.cost


def test_the_predicted_fall_is_the_slope_of_the_merit():
    """Along a step to where linear rows and bounds of variables are just kept."""
    stacked = Stacked(replace(corner(), row_lower=numbers(1.2)))
    start = stacked.point(numbers(0.8, 0.1))  # 0.1 beyond the bound of x, 0.3 below that of the row
    now = stacked.derivatives(start.x)
    path = Homotopy(stacked, start, now.slope(np.zeros(3)), np.zeros(3))
    d, prices, eps = numbers(-0.1, 0.4), numbers(30.0, 2.0, 50.0), 1e-7
    moved = stacked.point(start.x + eps * d)
    np.testing.assert_allclose(path.excess(0.0, stacked.point(start.x + d)), 0.0, atol=1e-15)
    slope = (path.merit(0.0, moved, prices) - path.merit(0.0, start, prices)) / eps
    assert path.fall(0.0, start, now, d, prices) == pytest.approx(slope, rel=1e-5)
    assert path.fall(0.0, start, now, d, 0.0 * prices) == 0.0  # uphill: none is predicted


def test_multipliers_are_noticed_where_they_are_large_and_have_a_bound():
    stacked = Stacked(valley())  # one upper bound of a row, none of the variables
    assert noticed(stacked, Duals(numbers(0.3), np.zeros(2))).tolist() == [0.0, 0.0, 0.3]
    assert not np.any(noticed(stacked, Duals(numbers(1e-3), np.zeros(2))))
    assert not np.any(noticed(stacked, Duals(numbers(-0.3), numbers(0.3, -0.3))))


@pytest.mark.parametrize(
    ("x", "y", "met"),
    [
        ((0.7, 0.0), (2.6, -2.0, 0.0), True),
        ((0.7, 0.0), (2.6, 0.0, 0.0), False),  # not stationary
        ((0.6, 0.0), (2.8, -2.0, 0.0), False),  # not on the bound
        ((0.7001, 0.0), (2.5998, -2.0, 0.0), False),  # beyond it
    ],
)
def test_all_conditions_have_to_be_met(x, y, met):
    stacked = Stacked(corner())
    point = stacked.point(numbers(*x))
    assert is_optimal(stacked, point, stacked.derivatives(point.x), numbers(*y)) is met


def test_a_step_that_makes_everything_worse_is_shortened():
    """Down the steep side of the valley and up the other one."""
    stacked = Stacked(replace(valley(), row_upper=numbers(9.0)))
    point = stacked.point(numbers(0.0, 0.5))
    now = stacked.derivatives(point.x)
    path = Homotopy(stacked, point, now.gradient, np.zeros(3))
    there, share = shortened(path, 0.0, numbers(0.0, -1.5), np.zeros(3), -100.0, deque([point]))
    assert 0.1 < share < 1.0
    assert there.cost < point.cost
    np.testing.assert_allclose(there.x, point.x + share * numbers(0.0, -1.5))


@pytest.mark.parametrize("values", [np.nan, np.inf])
def test_rows_that_are_no_numbers_are_as_bad_as_an_infinite_cost(values):
    stacked = Stacked(replace(valley(), rows=lambda _: [values]))
    assert stacked.point(VALLEY_END).cost == np.inf


def test_variables_may_be_fixed_and_rows_may_be_none():
    plain = corner()
    bare = replace(
        plain,
        lower=numbers(0.0, 0.3),
        upper=numbers(0.7, 0.3),
        row_lower=np.zeros(0),
        row_upper=np.zeros(0),
        rows=lambda _: np.zeros(0),
        jacobian_entries=(np.zeros(0, dtype=int), np.zeros(0, dtype=int)),
        jacobian=lambda _: np.zeros(0),
    )
    end = follow(bare, numbers(0.2, 0.3), none_of(bare))
    assert end.solved
    np.testing.assert_allclose(end.x, [0.7, 0.3], atol=1e-9)


def test_a_start_outside_the_limits_is_brought_back():
    before = solved(corner(), numbers(0.3, 0.3))
    end = follow(corner(), numbers(2.0, -3.0), before.duals)
    assert end.solved
    np.testing.assert_allclose(end.x, [0.7, 0.0], atol=1e-9)


def test_multipliers_go_as_far_as_the_step(monkeypatch):
    """Where half a step is taken, so is half the way to the multipliers of the model."""
    calls, minimum, whole = [], room.local_minimum, room.shortened

    def watched(model, y, radius):
        calls.append((y, minimum(model, y, radius)))
        return calls[-1][1]

    def halved(path, t, d, *rest):
        point, share = whole(path, t, d / 2.0, *rest)
        return point, share / 2.0

    monkeypatch.setattr(room, "local_minimum", watched)
    monkeypatch.setattr(room, "shortened", halved)
    before = solved(valley(), VALLEY_END)
    follow(replace(valley(), row_upper=numbers(1.1)), before.x, before.duals)
    (y, (_, wanted)), (then, _) = calls[:2]
    assert np.abs(wanted - y).max() > 1e-3
    np.testing.assert_allclose(then, y + (wanted - y) / 2.0)
