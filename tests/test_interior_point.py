"""IPOPT with exact second derivatives, on problems of two variables."""

import time

import numpy as np
import pytest
from small_problems import VALLEY_END, VALLEY_START, corner, cube, numbers, valley

from human_gait.interior_point import minimise
from human_gait.nonlinear_program import Duals, NonlinearProgram

TIGHT = {"tol": 1e-9, "nlp_scaling_method": "none"}
FUNCTIONS = ("cost", "gradient", "rows", "jacobian", "hessian")


def left(problem, end):
    """What is left of the gradient of the Lagrangian, (n,): nothing where it is stationary."""
    rows, columns = problem.jacobian_entries
    slope = problem.gradient(end.x) + end.duals.variables
    np.add.at(slope, columns, end.duals.rows[rows] * problem.jacobian(end.x))
    return slope


def test_it_finds_the_end_of_the_valley():
    end = minimise(valley(), VALLEY_START, TIGHT)
    assert end.solved
    assert end.status == "Solve_Succeeded"
    assert 0 < end.iterations < 40
    np.testing.assert_allclose(end.x, VALLEY_END, atol=1e-7)


def test_second_derivatives_converge_fast_at_the_end():
    """Newton's method: some more digits of the tolerance take a few steps only."""
    steps = [minimise(valley(), VALLEY_START, TIGHT | {"tol": t}).iterations for t in (1e-4, 1e-10)]
    assert steps[0] < steps[1] <= steps[0] + 8


def test_a_point_that_ran_out_of_iterations_is_not_solved():
    end = minimise(valley(), VALLEY_START, TIGHT | {"max_iter": 3})
    assert not end.solved
    assert end.status == "Maximum_Iterations_Exceeded"
    assert end.iterations == 3


def test_an_unknown_option_is_refused_by_its_name():
    with pytest.raises(RuntimeError, match="no_such_option"):
        minimise(valley(), VALLEY_START, {"no_such_option": 3})


@pytest.mark.parametrize(
    ("name", "value"), [("tol", "small"), ("tol", -1.0), ("max_iter", -1), ("mu_strategy", "mild")]
)
def test_a_bad_value_of_an_option_is_refused(name, value):
    with pytest.raises(RuntimeError, match=r"Ipopt|type mismatch"):
        minimise(valley(), VALLEY_START, {name: value})


class Failing:
    """A function that fails at its n-th call, and how often any function is called after that."""

    def __init__(self, name, n, error):
        self.n, self.error, self.after = n, error, 0
        problem = valley()
        watched = {other: self.watched(getattr(problem, other)) for other in FUNCTIONS}
        watched[name] = self.failing(getattr(problem, name))
        self.problem = valley(**watched)

    def watched(self, function):
        def call(*given):
            self.after += self.n < 1
            return function(*given)

        return call

    def failing(self, function):
        def call(*given):
            self.after += self.n < 1
            self.n -= 1
            if self.n == 0:
                raise self.error
            return function(*given)

        return call


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("n", [1, 2, 5])
@pytest.mark.parametrize("error", [ZeroDivisionError("a mistake"), KeyboardInterrupt()])
def test_what_a_function_raises_ends_the_solve_at_once_and_is_raised_again(name, n, error):
    failing = Failing(name, n, error)
    started = time.perf_counter()
    with pytest.raises(type(error)) as raised:
        minimise(failing.problem, VALLEY_START, TIGHT)
    assert raised.value is error
    assert failing.after == 0
    assert time.perf_counter() - started < 10.0


def test_a_failed_solve_leaves_the_next_one_alone():
    before = minimise(valley(), VALLEY_START, TIGHT)
    with pytest.raises(ZeroDivisionError):
        minimise(Failing("hessian", 3, ZeroDivisionError()).problem, VALLEY_START, TIGHT)
    after = minimise(valley(), VALLEY_START, TIGHT)
    np.testing.assert_array_equal(after.x, before.x)
    assert after.iterations == before.iterations


@pytest.mark.parametrize("share", [0.5, -1.0])
def test_entries_of_the_jacobian_that_occur_twice_are_added(share):
    twice = valley(
        jacobian_entries=(np.array([0, 0, 0]), np.array([0, 1, 0])),
        jacobian=lambda x: numbers(2.0 * share * x[0], 2.0 * x[1], 2.0 * (1.0 - share) * x[0]),
    )
    ends = [minimise(problem, VALLEY_START, TIGHT) for problem in (valley(), twice)]
    np.testing.assert_allclose(ends[1].x, ends[0].x, atol=1e-12)
    assert ends[1].iterations == ends[0].iterations


def test_the_order_of_entries_does_not_matter():
    """CasADi wants them column by column; here they come the other way round."""
    rows, columns = valley().hessian_entries
    turned = valley(
        jacobian_entries=(np.array([0, 0]), np.array([1, 0])),
        jacobian=lambda x: 2.0 * x[::-1],
        hessian_entries=(rows[::-1], columns[::-1]),
        hessian=lambda *given: valley().hessian(*given)[::-1],
    )
    ends = [minimise(problem, VALLEY_START, TIGHT) for problem in (valley(), turned)]
    np.testing.assert_allclose(ends[1].x, ends[0].x, atol=1e-12)
    assert ends[1].iterations == ends[0].iterations


@pytest.mark.parametrize(
    ("problem", "start"),
    [(valley(), VALLEY_START), (corner(), numbers(0.3, 0.3)), (cube(), numbers(5.0))],
    ids=["valley", "corner", "cube"],
)
def test_the_point_is_stationary_with_its_duals(problem, start):
    end = minimise(problem, start, TIGHT)
    assert end.solved
    np.testing.assert_allclose(left(problem, end), 0.0, atol=1e-7)


def test_duals_are_positive_at_upper_bounds_and_negative_at_lower_ones():
    by_variable = minimise(corner(), numbers(0.3, 0.3), TIGHT).duals.variables
    np.testing.assert_allclose(by_variable, [2.6, -2.0], atol=1e-6)
    held_above = minimise(valley(), VALLEY_START, TIGHT).duals.rows
    assert held_above[0] > 0.1
    outside = valley(row_lower=numbers(3.0), row_upper=numbers(np.inf))
    held_below = minimise(outside, numbers(1.0, 2.0), TIGHT)
    assert held_below.solved
    assert held_below.duals.rows[0] < -0.01


def test_duals_are_what_a_bound_costs():
    """d cost / d bound, with the opposite sign."""
    more = 1e-5
    ends = [
        minimise(valley(row_upper=numbers(1.0 + change)), VALLEY_START, TIGHT)
        for change in (0.0, -more, more)
    ]
    costs = [valley().cost(end.x) for end in ends]
    assert (costs[2] - costs[1]) / (2.0 * more) == pytest.approx(-ends[0].duals.rows[0], rel=1e-3)


WARM = {
    "warm_start_init_point": "yes",
    "warm_start_bound_push": 1e-9,
    "warm_start_slack_bound_push": 1e-9,
    "warm_start_mult_bound_push": 1e-9,
    "mu_init": 1e-9,
}


def test_a_warm_start_from_the_solution_takes_few_iterations():
    cold = minimise(valley(), VALLEY_START, TIGHT)
    warm = minimise(valley(), cold.x, TIGHT | WARM, cold.duals)
    assert warm.solved
    assert warm.iterations <= 2 < cold.iterations
    np.testing.assert_allclose(warm.x, cold.x, atol=1e-8)


def test_a_warm_start_uses_the_duals():
    """With duals that are far off it takes longer from the same point."""
    cold = minimise(valley(), VALLEY_START, TIGHT)
    off = Duals(cold.duals.rows + 100.0, cold.duals.variables)
    steps = [
        minimise(valley(), cold.x, TIGHT | WARM, duals).iterations for duals in (cold.duals, off)
    ]
    assert steps[0] < steps[1]


def test_a_problem_without_rows_is_solved():
    nothing = np.zeros(0, dtype=int)
    problem = NonlinearProgram(
        numbers(0.0),
        numbers(1.0),
        np.zeros(0),
        np.zeros(0),
        lambda x: (x[0] - 0.3) ** 2,
        lambda x: 2.0 * (x - 0.3),
        lambda _: np.zeros(0),
        (nothing, nothing),
        lambda _: np.zeros(0),
        (np.array([0]), np.array([0])),
        lambda _, factor, __: numbers(2.0 * factor),
    )
    end = minimise(problem, numbers(0.9), TIGHT)
    assert end.solved
    assert end.x == pytest.approx(0.3)
    assert end.duals.rows.shape == (0,)
