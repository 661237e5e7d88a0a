"""The interior-point method, on small problems whose ends are known."""

import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from small_problems import (
    VALLEY_END,
    VALLEY_START,
    corner,
    cube,
    left,
    numbers,
    quadratic,
    random_quadratic,
    valley,
)

from human_gait.newton import interior_point as room
from human_gait.newton.barrier import COLD, WARM
from human_gait.newton.cyclic_band import CyclicBand
from human_gait.newton.damping import UNDAMPED
from human_gait.newton.filter import Filter
from human_gait.newton.interior_point import (
    LAST_BARRIER,
    LIMIT_REACHED,
    NO_ROOM,
    NO_START,
    OPTIMAL,
    SPREAD,
    STUCK,
    InteriorPoint,
    minimise,
)
from human_gait.newton.newton_step import Step
from human_gait.newton.nonlinear_program import Duals, NonlinearProgram
from human_gait.newton.optimality import Goal
from human_gait.newton.optimality import left as remaining

TIGHT = Goal(1e-9, 1e-9, 1e-9)
FUNCTIONS = ("cost", "gradient", "rows", "jacobian", "hessian")


def test_it_finds_the_end_of_the_valley():
    end = minimise(valley(), VALLEY_START, TIGHT)
    assert end.solved
    assert end.status == OPTIMAL
    assert 0 < end.iterations < 40
    np.testing.assert_allclose(end.x, VALLEY_END, atol=1e-7)


def test_second_derivatives_converge_fast_at_the_end():
    """Newton's method: some more digits of the goal take a few steps only."""
    goals = (Goal(t, t, t) for t in (1e-4, 1e-10))
    steps = [minimise(valley(), VALLEY_START, goal).iterations for goal in goals]
    assert steps[0] < steps[1] <= steps[0] + 8


def test_a_point_that_ran_out_of_iterations_is_not_solved():
    end = minimise(valley(), VALLEY_START, replace(TIGHT, most_iterations=3))
    assert not end.solved
    assert end.status == LIMIT_REACHED
    assert end.iterations == 3


@pytest.mark.parametrize("condition", ["stationary", "feasible", "complementary"])
def test_every_condition_of_the_goal_takes_effect(condition):
    """With one of them tight it takes longer than with all of them loose."""
    loose = Goal(1.0, 1.0, 1.0)
    steps = [
        minimise(valley(), VALLEY_START, goal).iterations
        for goal in (loose, replace(loose, **{condition: 1e-11}))
    ]
    assert steps[0] < steps[1]


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
    turned = valley(
        jacobian_entries=(np.array([0, 0]), np.array([1, 0])),
        jacobian=lambda x: 2.0 * x[::-1],
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


def test_a_warm_start_from_the_solution_takes_few_iterations():
    cold = minimise(valley(), VALLEY_START, TIGHT)
    warm = minimise(valley(), cold.x, TIGHT, cold.duals)
    assert warm.solved
    assert warm.iterations <= 3 < cold.iterations
    np.testing.assert_allclose(warm.x, cold.x, atol=1e-8)


def test_a_warm_start_uses_the_duals():
    """With duals that are far off it takes longer from the same point."""
    cold = minimise(valley(), VALLEY_START, TIGHT)
    off = Duals(cold.duals.rows + 100.0, cold.duals.variables)
    steps = [minimise(valley(), cold.x, TIGHT, duals).iterations for duals in (cold.duals, off)]
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
        lambda _, factor, *__: np.array([[2.0 * factor]]),
    )
    end = minimise(problem, numbers(0.9), TIGHT)
    assert end.solved
    assert end.x == pytest.approx(0.3)
    assert end.duals.rows.shape == (0,)


def optimality(problem, end):
    """Largest violation, gradient left, multiplier of a wrong sign and multiplier x distance."""
    values = np.concatenate([end.x, problem.rows(end.x)])
    lower = np.concatenate([problem.lower, problem.row_lower])
    upper = np.concatenate([problem.upper, problem.row_upper])
    z = np.concatenate([end.duals.variables, end.duals.rows])
    violation = np.maximum(lower - values, values - upper).max()
    slack = np.where(z > 0.0, upper - values, values - lower)
    slack[~np.isfinite(slack)] = 1.0  # a multiplier of a bound that is not there has to vanish
    return max(violation, np.abs(left(problem, end)).max(), np.abs(z * slack).max())


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("least", [0.1, 0.0, -2.0], ids=["convex", "flat", "with a saddle"])
def test_the_end_of_any_quadratic_program_is_optimal(seed, least):
    problem = random_quadratic(seed, np.linspace(least, 5.0, 10))
    end = minimise(problem, np.zeros(10), TIGHT)
    assert end.solved
    assert optimality(problem, end) < 1e-7


def test_a_convex_program_ends_at_the_same_point_from_anywhere():
    problem = random_quadratic(3, np.linspace(0.1, 5.0, 10))
    ends = [minimise(problem, np.full(10, start), TIGHT) for start in (-1.0, 0.0, 0.8, 50.0)]
    for end in ends[1:]:
        np.testing.assert_allclose(end.x, ends[0].x, atol=1e-6)


def test_a_saddle_is_left_downhill():
    """Newton's method without damping would stay at the origin, a stationary point."""
    H = np.diag([1.0, -1.0])
    none = np.zeros(0)
    problem = quadratic(
        H, np.zeros(2), np.zeros((0, 2)), -np.ones(2), np.array([1.0, 2.0]), none, none
    )
    end = minimise(problem, numbers(0.3, 1e-3), TIGHT)
    assert end.solved
    assert abs(end.x[0]) < 1e-6
    assert end.x[1] in (pytest.approx(-1.0), pytest.approx(2.0))


def test_no_evaluation_leaves_the_bounds_of_the_variables():
    seen = []
    problem = corner()
    watched = replace(problem, cost=lambda x: (seen.append(x), problem.cost(x))[1])
    minimise(watched, numbers(3.0, -3.0), TIGHT)
    assert np.all((np.array(seen) > 0.0) & (np.array(seen) < 0.7))


def test_where_nothing_is_feasible_it_says_so():
    """x^2 + y^2 <= 1 and >= 2 at the same time."""
    plain = valley()
    rows, columns = (np.concatenate([entries, entries]) for entries in plain.jacobian_entries)
    problem = replace(
        plain,
        row_lower=numbers(-np.inf, 2.0),
        row_upper=numbers(1.0, np.inf),
        rows=lambda x: np.repeat(plain.rows(x), 2),
        jacobian_entries=(np.array([0, 0, 1, 1]), columns),
        jacobian=lambda x: np.tile(plain.jacobian(x), 2),
        hessian=lambda x, factor, *of_rows: plain.hessian(
            x, factor, *(numbers(given.sum()) for given in of_rows)
        ),
    )
    assert len(rows) == 4
    end = minimise(problem, VALLEY_START, replace(TIGHT, most_iterations=200))
    assert not end.solved
    assert end.status in (STUCK, LIMIT_REACHED)
    assert np.all(np.isfinite(end.x))


def test_a_trial_point_that_cannot_be_computed_shortens_the_step():
    """The cost ends at x = 0.5: beyond it a matrix is singular, or a number none."""
    plain = valley()

    def fenced(result):
        def cost(x):
            if x[0] > 0.5:
                if result is None:
                    raise np.linalg.LinAlgError
                return result
            return plain.cost(x) - 0.1 * np.log(0.5 - x[0])

        return cost

    ends = []
    for result in (None, np.nan, np.inf):
        problem = replace(
            plain,
            cost=fenced(result),
            gradient=lambda x: plain.gradient(x) + numbers(0.1 / (0.5 - x[0]), 0.0),
            hessian=lambda x, factor, *of_rows: (
                plain.hessian(x, factor, *of_rows)
                + factor * np.diag([0.1 / (0.5 - x[0]) ** 2, 0.0])
            ),
        )
        ends.append(minimise(problem, VALLEY_START, TIGHT))
        assert ends[-1].solved
        assert ends[-1].x[0] < 0.5
    np.testing.assert_array_equal(ends[1].x, ends[0].x)
    np.testing.assert_array_equal(ends[2].x, ends[0].x)


def test_a_variable_without_room_keeps_its_value_and_stops_no_other():
    """As joints that are held straight do."""
    held = replace(corner(), lower=numbers(0.0, 0.2), upper=numbers(0.7, 0.2))
    end = minimise(held, numbers(0.3, 0.3), TIGHT)
    assert end.solved
    assert end.x[1] == 0.2
    assert end.x[0] == pytest.approx(0.7, abs=1e-6)
    np.testing.assert_allclose(left(held, end), 0.0, atol=1e-7)


def bowl(rows=True, factor=1.0):
    """sqrt(1 + x^2): Newton's steps from beyond 1 go further and further astray."""
    m = int(rows)
    return NonlinearProgram(
        *(numbers(-np.inf), numbers(np.inf)),
        np.full(m, -1e6),
        np.full(m, 1e6),
        lambda x: factor * np.sqrt(1.0 + x[0] ** 2),
        lambda x: factor * x / np.sqrt(1.0 + x**2),
        lambda x: x[:m],
        (np.zeros(m, dtype=int), np.zeros(m, dtype=int)),
        lambda _: np.ones(m),
        lambda x, weight, _, springs: np.diag(
            weight * factor * (1.0 + x**2) ** -1.5 + springs.sum()
        ),
    )


@pytest.mark.parametrize("rows", [True, False])
def test_a_step_that_climbs_is_shortened(rows):
    end = minimise(bowl(rows), numbers(2.0), TIGHT)
    assert end.solved
    assert end.x[0] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("start", [500.0, 2.0])
def test_large_numbers_are_no_error(start):
    """exp(x) - x: the fall that is predicted is beyond what can be raised to a power."""
    problem = replace(
        bowl(),
        cost=lambda x: np.exp(x[0]) - x[0],
        gradient=lambda x: np.exp(x) - 1.0,
        hessian=lambda x, weight, _, springs: np.diag(weight * np.exp(x) + springs),
    )
    end = minimise(problem, numbers(start), replace(TIGHT, most_iterations=1000))
    assert end.solved
    assert end.x[0] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("result", [None, np.nan, np.inf])
def test_a_start_that_cannot_be_evaluated_is_given_back(result):
    def cost(_):
        if result is None:
            raise np.linalg.LinAlgError
        return result

    end = minimise(valley(cost=cost), VALLEY_START)
    assert not end.solved
    assert end.status == NO_START
    np.testing.assert_array_equal(end.x, VALLEY_START)


@pytest.mark.parametrize(
    "changes",
    [{"row_lower": numbers(2.0)}, {"lower": numbers(1.0, 0.0), "upper": numbers(0.0, 1.0)}],
)
def test_bounds_that_leave_no_room_are_no_solution(changes):
    end = minimise(valley(**changes), VALLEY_START)
    assert not end.solved
    assert end.status == NO_ROOM


def test_derivatives_that_are_no_numbers_end_it():
    """Nothing is evaluated where they would lead."""
    seen, plain = [], valley()
    broken = valley(
        cost=lambda x: (seen.append(x), plain.cost(x))[1],
        hessian=lambda *_: np.full((2, 2), np.nan),
    )
    end = minimise(broken, VALLEY_START)
    assert not end.solved
    assert end.status == STUCK
    assert np.all(np.isfinite(end.x))
    assert np.all(np.isfinite(seen))


def state_of(problem, **changes):
    method = InteriorPoint(problem)
    return method, replace(method.start(numbers(0.3, 0.3), None, 0.1), **changes)


def test_multipliers_and_slacks_go_their_own_part_of_the_way():
    method, state = state_of(corner())
    full = [np.full(size, 0.01) for size in (3, 1, 3, 3)]
    step = Step(*full, primal=0.5, dual=0.25)
    point = method.stacked.point(state.inside[:2] + 0.005)
    after = method.moved(state, step, 0.5, point, 0.1)
    np.testing.assert_allclose(after.inside - state.inside, 0.005)
    np.testing.assert_allclose(after.y - state.y, 0.005)
    np.testing.assert_allclose(after.low - state.low, 0.0025)
    np.testing.assert_allclose(after.high - state.high, 0.0025)


def test_multipliers_stay_within_a_factor_of_what_the_barrier_asks_for():
    method, state = state_of(corner(), low=np.full(3, 1e-30), high=np.full(3, 1e30))
    still = Step(*(np.zeros(size) for size in (3, 1, 3, 3)), primal=1.0, dual=1.0)
    after = method.moved(state, still, 1.0, state.point, 0.1)
    below, above = method.bounds.gaps(state.inside)
    np.testing.assert_allclose(after.low, 0.1 / below / SPREAD)
    np.testing.assert_allclose(after.high, 0.1 / above * SPREAD)


def test_the_filter_forgets_when_the_barrier_falls(monkeypatch):
    made = []

    class Counted(Filter):
        def __init__(self):
            super().__init__()
            made.append(self)

    monkeypatch.setattr(room, "Filter", Counted)
    minimise(corner(), numbers(0.3, 0.3), TIGHT)
    assert len(made) >= 5


@pytest.mark.parametrize("schedule", [COLD, COLD._replace(first=1e-2), WARM])
def test_the_barriers_of_a_solve_are_those_of_its_schedule(monkeypatch, schedule):
    """A stage ends as soon as its error is small enough; the last asks for a tenth of the goal."""
    step, seen, ended = InteriorPoint.step, [], []
    warm = schedule == WARM
    cold = COLD if warm else schedule

    def over(method, state, barrier):
        return remaining(method.bounds, state).of(barrier).largest <= schedule.patience * barrier

    def noted(self, state, barrier, damping, filtered):
        ended.append([over(self, state, earlier) for earlier in (*seen[-1:], barrier)])
        seen.append(barrier)
        return step(self, state, barrier, damping, filtered)

    first = minimise(valley(), VALLEY_START, TIGHT)
    monkeypatch.setattr(InteriorPoint, "step", noted)
    duals = first.duals if warm else None
    end = minimise(valley(), VALLEY_START, TIGHT, duals, cold)
    assert end.solved
    assert seen[0] == schedule.first
    last = LAST_BARRIER * TIGHT.complementary
    assert last == min(seen) < max(seen)
    assert not any(now for (*_, now), barrier in zip(ended, seen, strict=True) if barrier > last)
    for (before, _), (earlier, barrier) in zip(ended[1:], pairwise(seen), strict=True):
        assert before == (barrier < earlier) or barrier == last
        assert barrier == earlier or barrier <= max(schedule.after(earlier), last)


def test_a_warm_start_that_begins_anew_is_a_cold_one(monkeypatch):
    step, seen = InteriorPoint.step, []

    def refuse_once(self, state, barrier, damping, filtered):
        seen.append((barrier, remaining(self.bounds, state).of(barrier).largest))
        return None if len(seen) == 1 else step(self, state, barrier, damping, filtered)

    duals = minimise(valley(), VALLEY_START, TIGHT).duals
    monkeypatch.setattr(InteriorPoint, "step", refuse_once)
    assert minimise(valley(), VALLEY_START, TIGHT, duals).solved
    assert seen[1][0] == COLD.first
    last = LAST_BARRIER * TIGHT.complementary
    stages = [(barrier, left_over) for barrier, left_over in seen[1:] if barrier > last]
    assert all(left_over > COLD.patience * barrier for barrier, left_over in stages)


def test_where_no_step_leads_on_slacks_and_multipliers_begin_anew(monkeypatch):
    """A few times; the point is kept."""
    step, refused = InteriorPoint.step, []

    def refuse_at_first(self, state, barrier, damping, seen):
        if len(refused) < 3 and state.point.cost < 2.0:
            refused.append(state)
            return None
        return step(self, state, barrier, damping, seen)

    monkeypatch.setattr(InteriorPoint, "step", refuse_at_first)
    end = minimise(valley(), VALLEY_START, TIGHT)
    assert end.solved
    assert len(refused) == 3
    np.testing.assert_array_equal(refused[1].point.x, refused[0].point.x)
    np.testing.assert_array_equal(refused[1].y, 0.0)
    assert refused[1].high[-1] == 1.0
    np.testing.assert_allclose(end.x, VALLEY_END, atol=1e-7)


def test_little_damping_is_first_left_away():
    """A convex problem needs none; much of it is not taken off at once."""
    method, state = state_of(corner())
    little, much = 0.5 * UNDAMPED, 2.0 * UNDAMPED
    assert method.step(state, 0.1, little, Filter())[1] == pytest.approx(little / 3.0)
    assert method.step(state, 0.1, much, Filter())[1] >= much / 10.0 > 0.0


def ring_of_bowls(m=12, w=3, b=2):
    """Bowls that are curved downwards on top, tied to their neighbours in a ring; one is fixed."""
    rng = np.random.default_rng(0)
    blocks = 0.02 * rng.normal(size=(m, w + 1, b, b))
    ties, target = CyclicBand(blocks).dense(), rng.uniform(-2.0, 2.0, m * b)

    def second(x):
        found = blocks.copy()
        found[:, 0, np.arange(b), np.arange(b)] += (1.5 * x**2 - 0.5).reshape(m, b)
        return CyclicBand(found)

    lower, upper = np.full(m * b, -1.2), np.full(m * b, 1.2)
    lower[5] = upper[5] = 0.3
    return NonlinearProgram(
        *(lower, upper, np.zeros(0), np.zeros(0)),
        lambda x: x @ ties @ x / 2.0 + np.sum(x**4 / 4.0 - x**2 / 2.0) - target @ x,
        lambda x: ties @ x + x**3 - x - target,
        lambda _: np.zeros(0),
        (np.zeros(0, dtype=int), np.zeros(0, dtype=int)),
        lambda _: np.zeros(0),
        lambda x, *_: second(x),
    )


@pytest.mark.parametrize("fixed", ["one", "none", "the same of every block"])
def test_second_derivatives_may_come_as_a_ring_of_blocks(fixed):
    """Steps and end are those of the dense matrix."""
    problem = ring_of_bowls()
    if fixed != "one":
        problem.lower[5], problem.upper[5] = -1.2, 1.2
    if fixed == "the same of every block":
        problem.lower[1::2] = problem.upper[1::2] = 0.3
    dense = replace(problem, hessian=lambda *given: problem.hessian(*given).dense())
    found, expected = (minimise(p, np.zeros(24), TIGHT) for p in (problem, dense))
    assert found.solved
    assert found.iterations == expected.iterations > 3
    np.testing.assert_allclose(found.x, expected.x, atol=1e-10)
    np.testing.assert_allclose(left(problem, found), 0.0, atol=1e-8)
