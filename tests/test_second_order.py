"""Functions that offer exact second derivatives, against central differences of their values."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array

from human_gait.newton.matrix import matrix_of
from human_gait.newton.second_order import Alone, Linear, QuadraticForm, Weighted, by_differences

N, M = 5, 3
RNG = np.random.default_rng(0)
X, MULTIPLIERS = RNG.normal(size=N), RNG.normal(size=M)
STEP = 1e-5
A = np.where(RNG.uniform(size=(M, N)) < 0.6, RNG.normal(size=(M, N)), 0.0)
B = RNG.normal(size=(M, N))


def waves(x):
    """Rows sin(B x) + (A x)^2."""
    return np.sin(B @ x) + (A @ x) ** 2


def waves_jacobian(x):
    return np.cos(B @ x)[:, None] * B + 2.0 * (A @ x)[:, None] * A


def waves_second(x, multipliers):
    curved = -np.sin(B @ x) * multipliers
    return B.T @ (curved[:, None] * B) + 2.0 * A.T @ (multipliers[:, None] * A)


def symmetric():
    Q = np.random.default_rng(1).normal(size=(N, N))
    return Q + Q.T


WAVES = Alone((M, N), waves, waves_jacobian, waves_second)
FUNCTIONS = {
    "linear": Linear(csr_array(A), MULTIPLIERS),
    "quadratic": QuadraticForm(symmetric(), RNG.normal(size=N), 3.0),
    "alone": WAVES,
    "by differences": replace(WAVES, second=by_differences(waves_jacobian)),
}


def slopes(function, x):
    """Central differences of a function of n variables along each, (..., n)."""
    steps = STEP * np.eye(len(x))
    ends = [(function(x + d) - function(x - d)) / (2.0 * STEP) for d in steps]
    return np.stack(ends, axis=-1)


def dense(function, x):
    """The Jacobian (m, n) of its entries, those met twice added."""
    jacobian = np.zeros((len(function.value(x)), len(x)))
    np.add.at(jacobian, function.entries, function.jacobian(x))
    return jacobian


def multipliers_of(function, seed=2):
    return np.random.default_rng(seed).normal(size=len(function.value(X)))


def second_derivatives_agree(function, x=X):
    """Of multipliers * rows with the slopes of their gradient."""
    y = multipliers_of(function)
    expected = slopes(lambda at: y @ dense(function, at), x)
    found = second(function, x, [weighted(function, y)])
    np.testing.assert_allclose(found, expected, atol=1e-6)


def second(function, x, members):
    """Second derivatives of members of a function's family, dense."""
    return matrix_of(function.family.hessian(x, members)).dense()


def weighted(function, multipliers, curvature=None):
    """A function with multipliers, and curvature if there is any."""
    curvature = np.zeros_like(multipliers) if curvature is None else curvature
    return Weighted(function, multipliers, curvature)


def first_derivatives_agree(function, x=X):
    np.testing.assert_allclose(dense(function, x), slopes(function.value, x), atol=1e-8)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_first_derivatives(name):
    first_derivatives_agree(FUNCTIONS[name])


@pytest.mark.parametrize("name", FUNCTIONS)
def test_second_derivatives(name):
    second_derivatives_agree(FUNCTIONS[name])


@pytest.mark.parametrize("name", FUNCTIONS)
def test_multipliers_of_the_same_function_are_added(name):
    """A program may hold a function twice: as a cost and as a constraint, say."""
    function = FUNCTIONS[name]
    one, two = multipliers_of(function, 3), multipliers_of(function, 4)
    together = second(function, X, [weighted(function, one), weighted(function, two)])
    at_once = second(function, X, [weighted(function, one + two)])
    np.testing.assert_allclose(together, at_once, atol=1e-6)
    assert name == "linear" or np.abs(at_once).max() > 0.1


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_curvature_of_a_row_comes_with_its_gradient_twice(name):
    """J' diag(curvature) J, added to multipliers * rows; of a function that is given twice too."""
    function, y = FUNCTIONS[name], multipliers_of(FUNCTIONS[name])
    s, J = np.arange(1.0, len(y) + 1.0), dense(function, X)
    plain = second(function, X, [weighted(function, y)])
    parts = [weighted(function, y, s), weighted(function, 0.0 * y, 2.0 * s)]
    found = second(function, X, parts) - plain
    np.testing.assert_allclose(found, J.T @ (3.0 * s[:, None] * J), atol=1e-10)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_without_multipliers_there_are_no_second_derivatives(name):
    found = second(FUNCTIONS[name], X, [])
    np.testing.assert_array_equal(found, np.zeros((N, N)), strict=True)


def test_rows_that_are_linear_have_the_entries_of_their_matrix_alone():
    linear = FUNCTIONS["linear"]
    rows, columns = linear.entries
    assert len(rows) == np.count_nonzero(A) < A.size
    assert np.all(A[rows, columns] != 0.0)
    np.testing.assert_array_equal(linear.value(X), A @ X + MULTIPLIERS)


def test_a_row_may_be_given_as_a_full_matrix():
    """As Drake gives the one of a linear cost."""
    linear = Linear(np.ones((1, N)), np.array([2.0]))
    np.testing.assert_allclose(linear.value(X), X.sum() + 2.0)
    first_derivatives_agree(linear)


FAULTS = {
    "a slope of the wrong sign": lambda x: -waves_jacobian(x),
    "a row in the place of another": lambda x: waves_jacobian(x)[::-1],
    "a slope that does not change": lambda _: waves_jacobian(X + 0.1),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_jacobian_is_seen(fault):
    with pytest.raises(AssertionError):
        first_derivatives_agree(replace(WAVES, dense_jacobian=FAULTS[fault]))


SECOND_FAULTS = {
    "a part left out": lambda x, y: B.T @ ((-np.sin(B @ x) * y)[:, None] * B),
    "a missing factor": lambda x, y: waves_second(x, y) / 2.0,
    "multipliers in another order": lambda x, y: waves_second(x, y[::-1]),
    "those of another point": lambda x, y: waves_second(x + 1e-3, y),
    "differences of something else": by_differences(lambda x: waves_jacobian(x) ** 2),
}


@pytest.mark.parametrize("fault", SECOND_FAULTS)
def test_wrong_second_derivatives_are_seen(fault):
    with pytest.raises(AssertionError):
        second_derivatives_agree(replace(WAVES, second=SECOND_FAULTS[fault]))


def test_a_quadratic_form_is_half_of_its_matrix():
    form = FUNCTIONS["quadratic"]
    assert form.value(X) == pytest.approx([X @ form.Q @ X / 2.0 + form.b @ X + 3.0])


def test_the_matrix_of_a_quadratic_form_has_to_be_symmetric():
    with pytest.raises(AssertionError):
        first_derivatives_agree(QuadraticForm(np.triu(symmetric()), np.zeros(N)))


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3, 1e6])
def test_differences_are_exact_to_some_digits_at_points_of_any_size(size):
    """Of a parabola they are exact but for rounding; steps grow with the variable."""
    second = by_differences(lambda x: 2.0 * (A @ x)[:, None] * A)
    exact = 2.0 * A.T @ (MULTIPLIERS[:, None] * A)
    got = second(size * X, MULTIPLIERS)
    np.testing.assert_array_equal(got, got.T)
    np.testing.assert_allclose(got, exact, atol=1e-6 * np.abs(exact).max())


def test_differences_take_one_jacobian_for_each_variable_and_leave_the_point_alone():
    seen = []

    def watched(x):
        seen.append(x.copy())
        return waves_jacobian(x)

    x = X.copy()
    by_differences(watched)(x, MULTIPLIERS)
    np.testing.assert_array_equal(x, X)
    assert len(seen) == N + 1
    assert all(np.count_nonzero(at != X) <= 1 for at in seen)


def test_the_multipliers_of_rows_pick_their_rows():
    """A second derivative of each row alone, and nothing where all are 0."""
    for row, unit in enumerate(np.eye(M)):
        expected = slopes(lambda at, row=row: waves_jacobian(at)[row], X)
        np.testing.assert_allclose(second(WAVES, X, [weighted(WAVES, unit)]), expected, atol=1e-6)
    assert not np.any(second(WAVES, X, [weighted(WAVES, np.zeros(M))]))


def test_every_function_is_its_own_family():
    """Two with equal numbers are two: their multipliers must not be mixed up."""
    for function in FUNCTIONS.values():
        assert function.family is function
    twin = QuadraticForm(np.eye(N), np.zeros(N)), QuadraticForm(np.eye(N), np.zeros(N))
    assert twin[0] != twin[1]
    assert len({*twin}) == 2
