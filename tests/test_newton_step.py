"""One Newton step: its matrix, what it solves, how far it may go."""

from dataclasses import replace

import numpy as np
import pytest
from small_problems import random_quadratic

from human_gait.newton.interior_point import InteriorPoint
from human_gait.newton.newton_step import PROXIMAL, blocks_of, condensed


def test_rows_with_the_same_columns_or_some_of_them_share_a_block():
    """Every row is in one block, whose columns are all of its own and few others."""
    entries = (
        np.array([0, 0, 0, 1, 1, 2, 2, 3, 4, 4]),
        np.array([0, 1, 2, 2, 1, 5, 3, 5, 6, 6]),
    )
    blocks = blocks_of(entries)
    as_lists = [(list(rows), np.arange(9)[columns].tolist()) for rows, columns in blocks]
    assert as_lists == [([0, 1], [0, 1, 2]), ([2, 3], [3, 5]), ([4], [6])]
    assert isinstance(blocks[0][1], slice)
    assert not isinstance(blocks[1][1], slice)


def dense_hessian(problem, state):
    """Second derivatives of the Lagrangian of a state."""
    return problem.hessian(state.point.x, 1.0, state.y)


def undamped_step(method, state, barrier):
    """The whole Newton step, factorised by another routine."""
    system = method.system(state, barrier)
    upper = np.triu(system.matrix)
    return system.step(np.linalg.cholesky(upper + np.triu(upper, 1).T))


def sparse_rows():
    """Eight rows of ten columns, four of each filled, and their entries."""
    rng = np.random.default_rng(0)
    rows, columns = np.repeat(np.arange(8), 4), (np.arange(8)[:, None] + np.arange(4)).ravel() % 10
    J = np.zeros((8, 10))
    J[rows, columns] = rng.normal(size=32)
    return J, (rows, columns)


def test_the_matrix_of_a_step_is_the_dense_one():
    """H + S_x + J' S_s J, its upper triangle, with blocks that overlap."""
    rng, (J, entries) = np.random.default_rng(1), sparse_rows()
    H, curvature = rng.normal(size=(10, 10)), rng.uniform(0.1, 9.0, 18)
    H += H.T
    expected = H + np.diag(curvature[:10]) + J.T @ (curvature[10:, None] * J)
    assert len(blocks_of(entries)) > 1
    got = condensed(H.copy(), J, curvature, blocks_of(entries))
    np.testing.assert_allclose(np.triu(got), np.triu(expected), atol=1e-12)


def test_the_matrix_of_a_state_has_the_springs_of_its_barriers():
    """Multiplier / distance on each side that is bounded; a fixed variable is apart."""
    J, entries = sparse_rows()
    problem = replace(
        random_quadratic(1, np.linspace(-1.0, 5.0, 10)),
        rows=lambda x: J @ x,
        jacobian_entries=entries,
        jacobian=lambda _: J[entries],
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
    dense = dense_hessian(problem, state) + np.diag(springs[:10]) + J.T @ (springs[10:, None] * J)
    dense[3] = dense[:, 3] = np.eye(10)[3]
    np.testing.assert_allclose(np.triu(got.matrix), np.triu(dense), rtol=1e-12, atol=1e-8)


def test_a_matrix_without_a_minimum_has_no_factor_until_it_is_damped():
    """Nor does factorising change it."""
    problem = random_quadratic(1, np.linspace(-9.0, 5.0, 10))
    problem.row_lower[:], problem.row_upper[:] = -np.inf, np.inf
    problem.lower[:], problem.upper[:] = -np.inf, np.inf
    method = InteriorPoint(problem)
    system = method.system(method.start(np.zeros(10), None, 0.1), 0.1)
    before = system.matrix.copy()
    assert system.factor(0.0) is None
    assert system.factor(8.9) is None
    L = np.tril(system.factor(9.1))
    np.testing.assert_array_equal(system.matrix, before)
    np.testing.assert_allclose(L @ L.T, before + 9.1 * np.eye(10), atol=1e-12)


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
