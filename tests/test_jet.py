"""Each operation against complex steps through the plain operation and through its gradient."""

import numpy as np
import pytest

from human_gait.dynamics.jet import Jet, cross, stack

K, S, STEP = 4, 5, 1e-30
RNG = np.random.default_rng(0)
WEIGHTS = RNG.normal(size=(2, 3, S))
CONSTANT = RNG.uniform(1, 2, (K, 3))
X = RNG.normal(size=(K, S))


def vectors(x):
    """Two nonlinear quantities (K, 3) of the state x (K, S), none of them near zero."""
    a, b = (np.einsum("ks,is->ki", x, w) for w in WEIGHTS)
    return a * a + 1.0, 2.0 + np.sin(b)


def jets(x):
    """The vectors as jets: a a + 1 and 2 + sin(b) of linear a and b."""
    a, b = (np.einsum("ks,is->ki", x, w) for w in WEIGHTS)
    wa, wb = WEIGHTS
    squares_a, squares_b = (w[:, :, None] * w[:, None, :] for w in WEIGHTS)
    first = Jet(
        a * a + 1.0, 2 * a[..., None] * wa, np.broadcast_to(2.0 * squares_a, (K, 3, S, S)) + 0.0
    )
    second = Jet(
        2.0 + np.sin(b), np.cos(b)[..., None] * wb, -np.sin(b)[..., None, None] * squares_b
    )
    return first, second


OPERATIONS = {
    "sum": lambda a, b: a + b,
    "sum with an array": lambda a, _: a + CONSTANT,
    "sum of an array": lambda a, _: CONSTANT + a,
    "sum with a number": lambda a, _: 2.5 + a + 1.0,
    "negative": lambda a, _: -a,
    "difference": lambda a, b: a - b,
    "difference with an array": lambda a, _: a - CONSTANT,
    "difference of an array": lambda a, _: CONSTANT - a,
    "difference of a number": lambda a, _: 1.0 - a,
    "product": lambda a, b: a * b,
    "product with an array": lambda a, _: a * CONSTANT,
    "product of an array": lambda a, _: CONSTANT * a,
    "product with a number": lambda a, _: 3.0 * a * 2.0,
    "quotient": lambda a, b: a / b,
    "quotient by an array": lambda a, _: a / CONSTANT,
    "quotient by a number": lambda a, _: a / 7.0,
    "of one vector component": lambda a, b: a[:, 1] * b[:, 2],
    "of some instants": lambda a, b: a[[0, 2]] * b[[0, 2]],
    "with a numpy scalar": lambda a, _: np.float64(2.0) * a,
}


@pytest.mark.parametrize("operation", OPERATIONS.values(), ids=OPERATIONS)
def test_operations_carry_value_and_derivatives(operation):
    assert_same(operation, lambda x: operation(*vectors(x)))


def test_functions_follow_the_chain_rule():
    assert_same(
        lambda a, _: (0.3 * a).map(np.sin, np.cos, lambda y: -np.sin(y)),
        lambda x: np.sin(0.3 * vectors(x)[0]),
    )


def test_cross_product():
    assert_same(cross, lambda x: np.cross(*vectors(x)))


def test_stacking_makes_a_new_last_axis_of_the_value():
    assert_same(
        lambda a, b: stack([a[:, 0], b[:, 1]]),
        lambda x: np.stack([vectors(x)[0][:, 0], vectors(x)[1][:, 1]], axis=-1),
    )


def test_where_the_condition_fails_there_is_a_constant():
    a, _ = jets(X)
    chosen = a[:, 0].where(np.array([True, False, True, False]), 1.0)
    np.testing.assert_array_equal(chosen.value[[1, 3]], 1.0)
    np.testing.assert_array_equal(chosen.partials[[1, 3]], 0.0)
    np.testing.assert_array_equal(chosen.second[[1, 3]], 0.0)
    np.testing.assert_array_equal(chosen.value[[0, 2]], a.value[[0, 2], 0])
    np.testing.assert_array_equal(chosen.partials[[0, 2]], a.partials[[0, 2], 0])


def test_instants_may_come_from_two_jets():
    a, b = jets(X)
    first = np.array([True, False, True, False])
    chosen = a.where(first, b)
    for part in ("value", "partials", "second"):
        for k, source in enumerate((a, b, a, b)):
            np.testing.assert_array_equal(getattr(chosen, part)[k], getattr(source, part)[k])


def test_variables_are_independent():
    x = Jet.variables(X)
    np.testing.assert_array_equal(x.value, X)
    np.testing.assert_array_equal(x.partials, np.tile(np.eye(S), (K, 1, 1)))
    np.testing.assert_array_equal(x.second, 0.0)


def assert_same(operation, function):
    """Gradients exact but for rounding; second derivatives by central differences of gradients."""
    found = operation(*jets(X))
    np.testing.assert_allclose(found.value, function(X), rtol=1e-13)
    h = 1e-6
    for s in range(S):
        expected = function(X + 1j * STEP * np.eye(S)[s]).imag / STEP
        np.testing.assert_allclose(found.partials[..., s], expected, rtol=1e-12, atol=1e-13)
        ahead, behind = (operation(*jets(X + d * np.eye(S)[s])).partials for d in (h, -h))
        slope, scale = (ahead - behind) / (2 * h), np.abs(found.second).max()
        np.testing.assert_allclose(found.second[..., s], slope, atol=1e-8 * scale + 1e-8)
