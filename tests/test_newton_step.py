"""One Newton step: its matrix, what it solves, how far it may go."""

from dataclasses import replace

import numpy as np
import pytest
from small_problems import random_quadratic

from human_gait.newton.interior_point import InteriorPoint
from human_gait.newton.newton_step import PROXIMAL


def dense_hessian(problem, state):
    """Second derivatives of the Lagrangian of a state."""
    return problem.hessian(state.point.x, 1.0, state.y, 0.0 * state.y)


def undamped_step(method, state, barrier):
    """The whole Newton step, factorised by another routine."""
    return method.system(state, barrier).step(Inverted(method, state, barrier))


class Inverted:
    """What stands for a factor: the matrix and the springs of the variables, solved directly."""

    def __init__(self, method, state, barrier):
        system, moving = method.system(state, barrier), ~method.bounds.equal[: method.bounds.n]
        self._matrix = system.matrix.dense() + np.diag(system.curvature[: len(moving)][moving])

    def solve(self, right):
        return np.linalg.solve(self._matrix, right)


def sparse_rows():
    """Eight rows of ten columns, four of each filled, and their entries."""
    rng = np.random.default_rng(0)
    rows, columns = np.repeat(np.arange(8), 4), (np.arange(8)[:, None] + np.arange(4)).ravel() % 10
    J = np.zeros((8, 10))
    J[rows, columns] = rng.normal(size=32)
    return J, (rows, columns)


def test_the_matrix_of_a_state_has_the_springs_of_its_barriers():
    """Multiplier / distance on each side that is bounded; a fixed variable is not in it."""
    J, entries = sparse_rows()
    problem = random_quadratic(1, np.linspace(-1.0, 5.0, 10))
    curved = problem.hessian
    problem = replace(
        problem,
        rows=lambda x: J @ x,
        jacobian_entries=entries,
        jacobian=lambda _: J[entries],
        hessian=lambda *given: curved(*given[:3], np.zeros(8)) + J.T @ (given[3][:, None] * J),
    )
    problem.lower[3] = problem.upper[3] = 0.1
    method = InteriorPoint(problem)
    state = method.start(np.zeros(10), None, 0.1)
    got = method.system(state, 0.1)
    lower = np.append(problem.lower, problem.row_lower)
    upper = np.append(problem.upper, problem.row_upper)
    equal = lower == upper
    with np.errstate(divide="ignore", invalid="ignore"):
        springs = state.low / (state.inside - lower) + state.high / (upper - state.inside)
    springs[equal] = 1.0 / PROXIMAL
    np.testing.assert_allclose(got.curvature, springs)
    dense = dense_hessian(problem, state) + J.T @ (springs[10:, None] * J)
    left = np.delete(np.delete(dense, 3, axis=0), 3, axis=1)
    np.testing.assert_allclose(got.matrix.dense(), left, rtol=1e-12, atol=1e-8)
    springs, right = np.delete(springs[:10], 3), np.random.default_rng(2).normal(size=9)
    np.testing.assert_allclose(
        (left + np.diag(springs + 2.0)) @ got.factor(2.0).solve(right), right, atol=1e-5
    )


def test_fixed_variables_stay_and_stop_no_other():
    """The step of the others is that of a problem in which they are numbers."""
    problem = random_quadratic(4, np.linspace(0.5, 5.0, 10))
    problem.lower[[1, 6]] = problem.upper[[1, 6]] = 0.1
    method = InteriorPoint(problem)
    state = method.start(np.full(10, 0.2), None, 0.1)
    system = method.system(state, 0.1)
    step = system.step(system.factor(0.3))
    np.testing.assert_array_equal(step.inside[[1, 6]], 0.0)
    assert np.all(step.inside[[0, 2, 3, 4, 5, 7, 8, 9]] != 0.0)


def test_a_matrix_without_a_minimum_has_no_factor_until_it_is_damped():
    """Nor does factorising change it."""
    problem = random_quadratic(1, np.linspace(-9.0, 5.0, 10))
    problem.row_lower[:], problem.row_upper[:] = -np.inf, np.inf
    problem.lower[:], problem.upper[:] = -np.inf, np.inf
    method = InteriorPoint(problem)
    system = method.system(method.start(np.zeros(10), None, 0.1), 0.1)
    before = system.matrix.dense().copy()
    assert 0.0 < system.factor(0.0) <= 9.0
    assert 0.0 < system.factor(8.9) <= 0.1 + 1e-12
    inverse = np.stack([system.factor(9.1).solve(unit) for unit in np.eye(10)])
    np.testing.assert_array_equal(system.matrix.dense(), before)
    np.testing.assert_allclose(inverse @ (before + 9.1 * np.eye(10)), np.eye(10), atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_a_step_solves_the_linearised_conditions(seed):
    """Slacks and multipliers come out as if they had not been eliminated, Eq. (9)."""
    problem = random_quadratic(seed, np.linspace(0.5, 5.0, 10))
    method = InteriorPoint(problem)
    state = method.start(np.full(10, 0.2), None, 0.1)
    below, above = method.bounds.gaps(state.inside)
    step = undamped_step(method, state, 0.1)
    dx, ds, J = step.inside[:10], step.inside[10:], state.now.jacobian
    H = dense_hessian(problem, state)
    prices = state.now.gradient + (state.y + step.y) @ J + H @ dx
    by_bounds = state.high + step.high - state.low - step.low
    np.testing.assert_allclose(prices + by_bounds[:10], 0.0, atol=1e-6)
    equal = method.bounds.equal[10:]
    np.testing.assert_allclose((by_bounds[10:] - state.y - step.y)[~equal], 0.0, atol=1e-8)
    missing = problem.rows(state.point.x) - state.inside[10:]
    np.testing.assert_allclose((missing + J @ dx - ds)[~equal], 0.0, atol=1e-10)
    np.testing.assert_allclose((missing + J @ dx)[equal], PROXIMAL * step.y[equal], atol=1e-9)
    np.testing.assert_array_equal(ds[equal], 0.0)
    for z, dz, gap, sign in (
        (state.low, step.low, below, 1.0),
        (state.high, step.high, above, -1.0),
    ):
        bounded = np.isfinite(gap)
        linear = (z + dz)[bounded] * gap[bounded] + sign * (z * step.inside)[bounded]
        np.testing.assert_allclose(linear, 0.1, atol=1e-8)


def test_a_step_keeps_everything_positive():
    """However far the whole of it would lead; 1 % of a distance is left at least."""
    problem = random_quadratic(2, np.linspace(0.5, 5.0, 10))
    method = InteriorPoint(problem)
    state = method.start(np.full(10, 0.2), None, 1e-6)
    below, above = method.bounds.gaps(state.inside)
    step = undamped_step(method, state, 1e-6)
    assert min(step.primal, step.dual) < 1.0
    open_sides = np.isfinite(below), np.isfinite(above)
    inside = state.inside + step.primal * step.inside
    low, high = state.low + step.dual * step.low, state.high + step.dual * step.high
    assert np.all((inside - method.bounds.lower >= 0.0099 * below)[open_sides[0]])
    assert np.all((method.bounds.upper - inside >= 0.0099 * above)[open_sides[1]])
    assert np.all((low >= 0.0099 * state.low)[open_sides[0]])
    assert np.all((high >= 0.0099 * state.high)[open_sides[1]])
