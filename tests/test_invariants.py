import numpy as np
import pinocchio as pin
import pytest
from bodies import BODIES, FEMALE, MALE, at_instant, random_loads, random_states

from human_gait.body import dh, skeleton
from human_gait.body.links import GRAVITY
from human_gait.dynamics.recursive_lagrangian import ExternalLoad, inverse_dynamics

STEP = 1e-30


@pytest.fixture(params=BODIES.values(), ids=BODIES)
def body(request):
    return request.param


def mass_matrix(body, q):
    """(..., 55, 55): what each unit acceleration adds to the torques of rest."""
    q = q[..., None, :]
    rest = np.zeros_like(q)
    return inverse_dynamics(body, q, rest, np.eye(55)) - inverse_dynamics(body, q, rest, rest)


def energy(body, q, v):
    """Kinetic and potential energy, [J]."""
    rest = np.zeros_like(v)
    momentum = inverse_dynamics(body, q, rest, v) - inverse_dynamics(body, q, rest, rest)
    _, A = dh.frames(body.table, q)
    height = np.einsum("...ijk,ik->...j", A, body.pseudo_inertia()[:, :, 3])[..., :3]
    return np.sum(momentum * v, axis=-1) / 2 - height @ GRAVITY


def test_the_mass_matrix_is_symmetric_and_positive_definite(body):
    M = mass_matrix(body, random_states(10)[0])
    np.testing.assert_allclose(M, np.swapaxes(M, -1, -2), atol=1e-11)
    assert np.linalg.eigvalsh(M).min() > 0


def test_the_mass_matrix_is_pinocchios(body):
    model = body.pinocchio_model()
    q = random_states(1)[0][0]
    upper = np.triu(pin.crba(model, model.createData(), q))
    np.testing.assert_allclose(np.triu(mass_matrix(body, q)), upper, atol=1e-11)


def test_torques_are_linear_in_acceleration(body):
    """1e-9 N m: rounding of torques of some 1e3 N m."""
    q, v, a = random_states(10)
    _, _, b = random_states(10, seed=3)
    at_rest = inverse_dynamics(body, q, v, 0 * a)
    parts = [inverse_dynamics(body, q, v, x) - at_rest for x in (a, b, 2 * a - 3 * b)]
    np.testing.assert_allclose(parts[2], 2 * parts[0] - 3 * parts[1], atol=1e-9)


def test_power_is_the_rate_of_energy(body):
    q, v, a = random_states(10)
    power = np.sum(inverse_dynamics(body, q, v, a) * v, axis=-1)
    rate = energy(body, q + 1j * STEP * v, v + 1j * STEP * a).imag / STEP
    np.testing.assert_allclose(rate, power, rtol=1e-11, atol=1e-9 * np.abs(power).max())


def test_the_global_forces_are_the_rate_of_momentum(body):
    """tau_1..3 = m (acceleration of the centre of mass - g) along z, x, y, however it moves."""
    q, v, a = random_states(10)
    J = body.pseudo_inertia()[:, :, 3]

    def momentum(q, v):
        A = dh.frames(body.table, q + 1j * STEP * v)[1]
        return np.einsum("...ijk,ik->...j", A, J)[..., :3].imag / STEP

    h = 1e-6  # central difference: error about 1e-10 of accelerations up to 1e3
    rate = (
        momentum(q + h * v + h * h / 2 * a, v + h * a)
        - momentum(q - h * v + h * h / 2 * a, v - h * a)
    ) / (2 * h)
    force = rate - body.total_mass * GRAVITY
    tau = inverse_dynamics(body, q, v, a)[:, :3]
    np.testing.assert_allclose(tau, force[:, [2, 0, 1]], rtol=1e-6, atol=1e-6 * np.abs(force).max())


@pytest.mark.parametrize("symmetric", [MALE, FEMALE])
def test_the_mirrored_motion_has_the_mirrored_torques(symmetric):
    motion = random_states(10)
    tau = inverse_dynamics(symmetric, *motion)
    mirrored = inverse_dynamics(symmetric, *(skeleton.mirror(x) for x in motion))
    np.testing.assert_allclose(mirrored, skeleton.mirror(tau), atol=1e-10 * np.abs(tau).max())


def test_mirrored_loads_have_mirrored_torques():
    """A force on the right sole against its mirror image on the left; moments are pseudovectors."""
    q, v, a = (x[0] for x in random_states(1))
    load = at_instant(random_loads(1), 0)[0]
    right, left = skeleton.SEGMENTS["foot_r"], skeleton.SEGMENTS["foot_l"]
    _, A = dh.frames(MALE.table, np.zeros(55))
    across = A[right, :3, :3] @ load.point + A[right, :3, 3]
    point = dh.inverse(A[left])[:3] @ np.append(across * [-1, 1, 1], 1.0)
    other = ExternalLoad(left, point, load.force * [-1, 1, 1], load.moment * [1, -1, -1])
    tau = inverse_dynamics(MALE, q, v, a, [load])
    mirrored = inverse_dynamics(MALE, *(skeleton.mirror(x) for x in (q, v, a)), [other])
    np.testing.assert_allclose(mirrored, skeleton.mirror(tau), atol=1e-10 * np.abs(tau).max())
