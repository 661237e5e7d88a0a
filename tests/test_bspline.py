import numpy as np
import pytest
from scipy.interpolate import BSpline
from walks import scenario

from human_gait.body.skeleton import N_DOF, index, mirror
from human_gait.problem.drake import bspline_trajectory
from human_gait.scenario import Walk
from human_gait.walk import bspline
from human_gait.walk.bspline import Basis
from human_gait.walk.cycle import step_cycle
from human_gait.walk.gait import Gait

T, L = 0.55, 0.66
STEP = step_cycle(Walk(speed=L / T, step_length=L))
BASES = {
    "six control points": Basis.uniform(STEP, 6),
    "nine control points": Basis.uniform(STEP, 9),
    "uneven pieces": Basis(T * np.array([0.0, 0.08, 0.3, 0.45, 0.8, 1.0]), STEP),
}
CLAMPED = {
    "the paper's five": Basis.uniform(STEP, 5, mirrored=False),
    "clamped, uneven": Basis(T * np.array([0.0, 0.2, 0.3, 1.0]), STEP, mirrored=False),
}
TIMES = np.linspace(0.0, T, 41)


@pytest.fixture(params=BASES.values(), ids=BASES)
def basis(request):
    return request.param


def random_free(basis, seed=0):
    return np.random.default_rng(seed).normal(size=(basis.n_free, N_DOF))


def test_there_are_as_many_functions_as_asked_for():
    for n in (6, 7, 12):
        basis = Basis.uniform(STEP, n)
        assert (basis.n_control_points, basis.n_free) == (n, n - bspline.DEGREE)
        assert basis.matrix(TIMES).shape == (len(TIMES), n)
        assert len(basis.knots) == n + bspline.DEGREE + 1


def test_the_functions_add_up_to_one_and_are_not_negative(basis):
    """With this the control points' hull holds the curve: joint limits bound them (Eq. 19)."""
    N = basis.matrix(TIMES)
    np.testing.assert_allclose(N.sum(axis=1), 1.0, atol=1e-14)
    assert N.min() >= -1e-16
    assert np.count_nonzero(N > 1e-15, axis=1).max() <= bspline.DEGREE + 1


def test_derivatives_are_the_slopes_of_the_functions(basis):
    """Central differences with 1e-5 s: their error is 1e-10 N''' and the rounding 1e-11."""
    h, inside = 1e-5, TIMES[1:-1]
    inside = inside[np.abs(inside[:, None] - basis.breaks).min(axis=1) > h]
    for order in (1, 2):
        after, before = (basis.matrix(inside + s * h, order - 1) for s in (1, -1))
        slope, found = (after - before) / (2 * h), basis.matrix(inside, order)
        np.testing.assert_allclose(found, slope, atol=1e-6 * np.abs(found).max())


@pytest.mark.parametrize("order", range(3))
def test_the_end_of_the_step_mirrors_its_start_for_any_free_control_points(basis, order):
    """Eq. (26) for posture, velocity and acceleration; 1e-13 of the largest is rounding."""
    first, last = basis.matrix(np.array([0.0, T]), order) @ basis.expand(random_free(basis))
    expected = mirror(first)
    if order == 0:
        expected[index("pelvis_tz")] += L
    np.testing.assert_allclose(last, expected, atol=1e-13 * np.abs(last).max())


def test_expanded_control_points_are_the_free_ones_and_their_mirror_images(basis):
    free = random_free(basis)
    P = basis.expand(free)
    np.testing.assert_array_equal(P[: basis.n_free], free)
    advanced = mirror(free[:3])
    advanced[:, index("pelvis_tz")] += L
    np.testing.assert_array_equal(P[basis.n_free :], advanced)


def test_folding_is_the_adjoint_of_expanding(basis):
    """<g, dP> of all control points equals <basis.fold(g), d free> of the free ones."""
    rng = np.random.default_rng(1)
    g = rng.normal(size=(5, basis.n_control_points, N_DOF))
    change = rng.normal(size=(basis.n_free, N_DOF))
    moved = basis.expand(change) - basis.expand(np.zeros_like(change))
    whole, folded = np.sum(g * moved, axis=(1, 2)), np.sum(basis.fold(g) * change, axis=(1, 2))
    np.testing.assert_allclose(folded, whole, atol=1e-12 * np.abs(g).sum())


def test_folding_leaves_its_argument_alone(basis):
    g = np.ones((2, basis.n_control_points, N_DOF))
    basis.fold(g)
    np.testing.assert_array_equal(g, 1.0)


@pytest.mark.parametrize("order", range(3))
def test_the_design_matrix_is_linear_in_the_free_control_points(basis, order):
    change = random_free(basis, seed=2)
    moved = basis.matrix(TIMES[::8], order) @ (basis.expand(change) - basis.expand(0 * change))
    found = basis.design(TIMES[::8], order) @ change.ravel()
    np.testing.assert_allclose(found, moved.ravel(), atol=1e-12 * np.abs(moved).max())


@pytest.mark.parametrize("basis", [*BASES.values(), *CLAMPED.values()])
def test_a_spline_is_fitted_exactly(basis):
    free = random_free(basis)
    fitted = basis.fit(TIMES, basis.matrix(TIMES) @ basis.expand(free))
    np.testing.assert_allclose(fitted, free, atol=1e-12)


@pytest.mark.parametrize("basis", [*BASES.values(), *CLAMPED.values()])
def test_a_fitted_spline_is_the_nearest_one(basis):
    """Of curves that are no splines: what is left is normal to every change of the spline."""
    q = np.random.default_rng(4).standard_normal((len(TIMES), N_DOF))
    fitted = basis.fit(TIMES, q)
    left = basis.matrix(TIMES) @ basis.expand(fitted) - q
    slope = basis.design(TIMES).T @ left.ravel()
    assert np.abs(left).max() > 0.1
    np.testing.assert_allclose(slope, 0.0, atol=1e-10)


def test_the_knots_go_on_periodically(basis):
    np.testing.assert_allclose(basis.knots[3:-3], basis.breaks)
    spacing = np.diff(basis.knots)
    m = basis.n_free
    np.testing.assert_allclose(spacing[m : m + 3], spacing[:3], atol=1e-15)


@pytest.mark.parametrize("order", range(3))
def test_a_drake_trajectory_is_the_same_motion(basis, order):
    """Rounding: Drake evaluates by de Boor, we by the basis functions."""
    gait = Gait(scenario(L / T, L), basis.breaks, basis.expand(random_free(basis)))
    trajectory = bspline_trajectory(gait)
    assert (trajectory.start_time(), trajectory.end_time()) == (0.0, pytest.approx(T))
    expected = basis.matrix(TIMES[:-1], order) @ gait.control_points
    found = [trajectory.EvalDerivative(t, order)[:, 0] for t in TIMES[:-1]]
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("order", range(4))
@pytest.mark.parametrize("basis", [*BASES.values(), *CLAMPED.values()])
def test_basis_functions_and_their_derivatives_are_scipys(basis, order):
    """At breaks and at the end, too; rounding grows with the size of the derivatives."""
    times = np.sort(np.concatenate([TIMES, basis.breaks]))
    scipys = BSpline(basis.knots, np.eye(basis.n_control_points), bspline.DEGREE)
    found, expected = basis.matrix(times, order), scipys(times, nu=order)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-14 * np.abs(expected).max())


@pytest.mark.parametrize("basis", CLAMPED.values(), ids=CLAMPED)
def test_knots_are_inserted_as_scipy_does(basis):
    P, finer = random_free(basis), basis.refined(basis.n_control_points + 5)
    expected = BSpline(basis.knots, P, bspline.DEGREE)
    for knot in np.setdiff1d(finer.breaks, basis.breaks):
        expected = expected.insert_knot(knot)
    np.testing.assert_allclose(basis.insert(finer, P), expected.c, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("basis", CLAMPED.values(), ids=CLAMPED)
def test_a_clamped_basis_starts_and_ends_at_its_control_points(basis):
    free = random_free(basis)
    assert basis.n_free == basis.n_control_points
    ends = basis.matrix(np.array([0.0, T])) @ basis.expand(free)
    np.testing.assert_allclose(ends, free[[0, -1]], atol=1e-14)


@pytest.mark.parametrize("basis", CLAMPED.values(), ids=CLAMPED)
@pytest.mark.parametrize("order", range(2))
def test_the_rows_of_symmetry_are_what_eq_26_leaves(basis, order):
    free = random_free(basis)
    first, last = basis.matrix(np.array([0.0, T]), order) @ free
    found = basis.symmetry(order) @ free.ravel()
    np.testing.assert_allclose(found, last - mirror(first), atol=1e-12 * np.abs(last).max())


def test_a_mirrored_basis_leaves_nothing_of_eq_26(basis):
    for order in range(3):
        rows = basis.symmetry(order)
        scale = np.abs(basis.matrix(np.zeros(1), order)).max()
        np.testing.assert_allclose(rows, 0.0, atol=1e-13 * scale)


def test_the_longest_pieces_are_halved():
    finer = Basis(np.array([0.0, 0.1, 0.3, 0.4]), STEP).refined(8)
    np.testing.assert_allclose(finer.breaks, [0.0, 0.05, 0.1, 0.2, 0.3, 0.4])
    np.testing.assert_allclose(
        Basis.uniform(STEP, 7).refined(11).breaks, Basis.uniform(STEP, 11).breaks
    )


@pytest.mark.parametrize("basis", [*BASES.values(), *CLAMPED.values()])
@pytest.mark.parametrize("more", [1, 2, 9])
def test_inserted_knots_leave_the_curves_as_they_are(basis, more):
    P = basis.expand(random_free(basis))
    finer = basis.refined(basis.n_control_points + more)
    Q = basis.insert(finer, P)
    assert Q.shape == (basis.n_control_points + more, N_DOF)
    for order in range(3):
        before, after = basis.matrix(TIMES, order) @ P, finer.matrix(TIMES, order) @ Q
        np.testing.assert_allclose(after, before, atol=1e-12 * np.abs(before).max())
    free = Q[: finer.n_free]
    np.testing.assert_allclose(finer.expand(free), Q, atol=1e-13)
