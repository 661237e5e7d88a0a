"""The model of a step: what it returns is a local minimum, by its conditions and by comparison."""

import numpy as np
import pytest
from scipy.linalg import eigvalsh, null_space

from human_gait.newton.quadratic import CERTAIN, Quadratic, bounds_of, local_minimum

N, M = 12, 20
ROOM = 1e-7
LEFT = 1e-3  # of the gradient, where the curvature was turned round on the way


def model(seed, least=0.5, **changes):
    """A random model whose curvatures go from `least` to 3; 0 keeps all bounds."""
    rng = np.random.default_rng(seed)
    directions = np.linalg.qr(rng.normal(size=(N, N)))[0]
    given = {
        "H": (directions * np.linspace(least, 3.0, N)) @ directions.T,
        "g": rng.normal(size=N),
        "A": rng.normal(size=(M, N)),
        "lower": -rng.uniform(0.02, 0.3, N + M),
        "upper": rng.uniform(0.02, 0.3, N + M),
    }
    return Quadratic(**given | changes)


def cost(of, d):
    return d @ of.H @ d / 2 + of.g @ d


def assert_kkt(of, d, y, left=LEFT):
    activity = of.activity(d)
    assert np.all(activity >= of.lower - ROOM)
    assert np.all(activity <= of.upper + ROOM)
    assert np.abs(of.slope(d, y)).max() < left
    held = y != 0.0
    np.testing.assert_allclose(
        activity[held], bounds_of(y, of.lower, of.upper)[held], atol=10 * ROOM
    )


def along_the_bounds(of, y):
    """Curvatures of the directions in which all active bounds stay active."""
    active = np.concatenate([np.eye(N), of.A])[y != 0.0]
    free = null_space(active) if len(active) else np.eye(N)
    return eigvalsh(free.T @ of.H @ free) if free.shape[1] else np.zeros(0)


@pytest.mark.parametrize("seed", range(8))
def test_the_minimum_of_a_convex_model_meets_its_conditions(seed):
    of = model(seed)
    d, y = local_minimum(of, np.zeros(N + M), 10.0)
    assert_kkt(of, d, y, 1e-9)
    assert np.any(y)


@pytest.mark.parametrize("seed", range(8))
def test_no_step_that_keeps_the_bounds_of_a_convex_model_costs_less(seed):
    of = model(seed)
    d, _ = local_minimum(of, np.zeros(N + M), 10.0)
    others = np.random.default_rng(seed).normal(size=(300, N))
    activity = np.concatenate([others, others @ of.A.T], axis=1)
    others /= np.maximum(activity / of.upper, activity / of.lower).max(axis=1, keepdims=True)
    for share in (1.0, 0.1, 0.01):
        steps = d + share * (others - d)  # these keep the bounds
        assert min(cost(of, step) for step in steps) >= cost(of, d) - 1e-9


@pytest.mark.parametrize("seed", range(12))
def test_where_the_model_is_not_convex_a_local_minimum_is_found(seed):
    of = model(seed, least=-1.0)
    d, y = local_minimum(of, np.zeros(N + M), 10.0)
    assert_kkt(of, d, y)
    assert np.all(along_the_bounds(of, y) > 0.0)
    assert cost(of, d) < 0.0


@pytest.mark.parametrize("least", [0.5, -1.0])
def test_the_minimum_is_found_again_from_its_multipliers(least):
    of = model(3, least)
    d, y = local_minimum(of, np.zeros(N + M), 10.0)
    again, multipliers = local_minimum(of, y, 10.0)
    np.testing.assert_allclose(again, d, atol=1e-3)
    np.testing.assert_array_equal(multipliers != 0.0, y != 0.0)


def test_a_negative_curvature_that_active_bounds_hide_does_no_harm():
    """Steep in one direction, but a row holds it: the rest is solved exactly, in one go."""
    across = np.ones((1, N)) / np.sqrt(N)
    of = model(1, A=across, lower=np.full(N + 1, -9.0), upper=np.append(np.full(N, 9.0), 0.1))
    steep = of.H - 50.0 * across.T @ across
    of = Quadratic(steep, of.g - 9.0 * across[0], of.A, of.lower, of.upper)
    guess = np.zeros(N + 1)
    guess[N] = 9.0
    d, y = local_minimum(of, guess, 10.0)
    assert_kkt(of, d, y, 1e-7)
    assert y[N] > 0.0


def test_a_bound_that_is_wrongly_taken_for_active_is_let_go():
    of = model(2, lower=np.full(N + M, -9.0), upper=np.full(N + M, 9.0))
    wrong = np.zeros(N + M)
    of.upper[0], wrong[0] = 0.05, 10.0 * CERTAIN
    of.g[0] = 5.0  # downhill is away from the bound
    _, y = local_minimum(of, wrong, 10.0)
    assert y[0] == 0.0
    d, y = local_minimum(of, y, 10.0)
    assert_kkt(of, d, y, 1e-9)


@pytest.mark.parametrize("least", [0.5, -1.0])
def test_no_variable_moves_further_than_the_radius_which_is_no_bound_with_a_price(least):
    of = model(4, least, lower=np.full(N + M, -9.0), upper=np.full(N + M, 9.0))
    d, y = local_minimum(of, np.zeros(N + M), 0.01)
    assert np.abs(d).max() == pytest.approx(0.01)
    assert not np.any(y)


def test_rows_that_no_step_within_the_radius_keeps_are_told():
    of = model(5)
    of.lower[N], of.upper[N] = 5.0, 6.0
    assert local_minimum(of, np.zeros(N + M), 0.01) is None


def test_the_model_is_left_as_it_was():
    of, before = model(6, least=-1.0), model(6, least=-1.0)
    local_minimum(of, np.zeros(N + M), 1.0)
    for name, value in vars(before).items():
        np.testing.assert_array_equal(getattr(of, name), value)


def test_rows_that_seemed_far_away_are_kept_too():
    """Dense rows, a little further than is taken for near: the free step would break them."""
    n, radius = 40, 0.1
    rows = np.ones((1, n))
    far = 2.05 * radius * np.sqrt(n)
    wide = np.full(n + 1, 9.0)
    of = Quadratic(np.eye(n), -np.ones(n), rows, -wide, np.append(wide[:n], far))
    assert radius * n > far
    d, y = local_minimum(of, np.zeros(n + 1), radius)
    assert (rows @ d)[0] == pytest.approx(far)
    assert y[n] > 0.0


@pytest.mark.parametrize("seed", range(20))
def test_bounds_that_seemed_sure_are_doubted_where_they_leave_no_way(seed):
    of, rng = model(seed), np.random.default_rng(seed)
    noise = np.where(rng.uniform(size=N + M) < 0.4, rng.normal(size=N + M), 0.0)
    found = local_minimum(of, noise, 10.0)
    assert found is not None
    activity = of.activity(found[0])
    assert np.all((activity >= of.lower - ROOM) & (activity <= of.upper + ROOM))


@pytest.mark.parametrize("seed", range(6))
def test_equations_and_fixed_variables_are_kept(seed):
    of = model(seed, least=-1.0)
    for i in (0, 3, N + 1, N + 2):
        of.lower[i] = of.upper[i] = 0.01
    d, _ = local_minimum(of, np.zeros(N + M), 10.0)
    np.testing.assert_allclose(of.activity(d)[[0, 3, N + 1, N + 2]], 0.01, atol=ROOM)
