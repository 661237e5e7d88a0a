import ast
from pathlib import Path

import numpy as np
import pytest
from bodies import LOADED, MALE, at_instant, complex_step, random_loads, random_states

import human_gait.dynamics.recursive_lagrangian as rl
from human_gait.body import dh, skeleton
from human_gait.body.links import GRAVITY


def test_standing_still_the_global_forces_carry_the_weight():
    zero = np.zeros(55)
    tau = rl.inverse_dynamics(LOADED, zero, zero, zero)
    weight = LOADED.total_mass * skeleton.GRAVITY
    np.testing.assert_allclose(tau[:3], [0, 0, weight], atol=1e-12)


def test_falling_freely_takes_no_torque():
    zero = np.zeros(55)
    falling = zero.copy()
    falling[skeleton.index("pelvis_ty")] = GRAVITY[1]
    np.testing.assert_allclose(rl.inverse_dynamics(LOADED, zero, zero, falling), 0, atol=1e-12)


def test_leading_axes_are_instants():
    q, v, a = random_states(6)
    loads = random_loads(6)
    batch = rl.inverse_dynamics(MALE, q, v, a, loads)
    assert batch.shape == (6, 55)
    for k in range(6):
        alone = rl.inverse_dynamics(MALE, q[k], v[k], a[k], at_instant(loads, k))
        np.testing.assert_allclose(batch[k], alone, rtol=1e-12, atol=1e-11)
    folded = [x.reshape(2, 3, 55) for x in (q, v, a)]
    unloaded = rl.inverse_dynamics(MALE, q, v, a).reshape(2, 3, 55)
    np.testing.assert_allclose(rl.inverse_dynamics(MALE, *folded), unloaded, rtol=1e-12, atol=1e-11)


def test_loads_do_virtual_work():
    """tau changes by -J^T f - (axes)^T h, J by complex step of the loaded point."""
    q, v, a = (x[0] for x in random_states(1))
    (load, *_) = at_instant(random_loads(1), 0)
    change = rl.inverse_dynamics(MALE, q, v, a, [load]) - rl.inverse_dynamics(MALE, q, v, a)

    def point(x):
        return np.einsum(
            "...ij,j->...i", dh.frames(MALE.table, x)[1][..., load.link, :3, :], padded
        )

    padded = np.append(load.point, 1.0)
    P, _ = dh.frames(MALE.table, q)
    path = _path(load.link)
    moment = np.zeros(55)
    moment[path] = P[path, :3, 2] @ load.moment
    moment[skeleton.PRISMATIC] = 0
    expected = -complex_step(point, q).T @ load.force - moment
    np.testing.assert_allclose(change, expected, atol=1e-11)


def test_loads_reach_only_the_joints_between_them_and_the_world():
    q, v, a = (x[0] for x in random_states(1))
    (load, *_) = at_instant(random_loads(1), 0)
    change = rl.inverse_dynamics(MALE, q, v, a, [load]) - rl.inverse_dynamics(MALE, q, v, a)
    others = np.setdiff1d(np.arange(55), _path(load.link))
    np.testing.assert_array_equal(change[others], 0)


def _path(link):
    path = []
    while link >= 0:
        path.append(link)
        link = int(skeleton.PARENT[link])
    return path


def test_a_complex_step_leaves_the_torques_alone():
    q, v, a = random_states(2)
    tau = rl.inverse_dynamics(MALE, q, v, a)
    stepped = rl.inverse_dynamics(MALE, q + 1e-30j, v, a)
    np.testing.assert_allclose(stepped.real, tau, rtol=1e-13, atol=1e-11)


@pytest.fixture(params=[False, True], ids=["unloaded", "loaded"], scope="module")
def derived(request):
    """A body, states, loads and the torques with their sensitivities."""
    state, loads = random_states(5), random_loads(5) if request.param else []
    return LOADED, state, loads, rl.inverse_dynamics_derivatives(LOADED, *state, loads)


def test_the_torques_beside_the_sensitivities_are_the_torques(derived):
    body, state, loads, found = derived
    np.testing.assert_array_equal(found.tau, rl.inverse_dynamics(body, *state, loads))


@pytest.mark.parametrize("by", range(3), ids=["q", "v", "a"])
def test_sensitivities_are_those_of_a_complex_step(derived, by):
    """1e-12 of the largest: rounding of sums of some hundred terms."""
    body, state, loads, found = derived
    for k in range(5):
        now, carried = [x[k] for x in state], at_instant(loads, k)

        def torques(x, now=now, carried=carried):
            return rl.inverse_dynamics(body, *now[:by], x, *now[by + 1 :], carried)

        expected = complex_step(torques, now[by])
        tolerance = 1e-12 * np.abs(expected).max()
        np.testing.assert_allclose(found[1 + by][k], expected, rtol=0, atol=tolerance)


def test_sensitivities_by_acceleration_are_the_mass_matrix(derived):
    body, (q, _, _), _, found = derived
    rest, q = np.zeros(55), q[:, None]
    unit, none = (rl.inverse_dynamics(body, q, rest, a) for a in (np.eye(55), rest))
    np.testing.assert_allclose(found.dtau_da, unit - none, atol=1e-11)
    np.testing.assert_allclose(found.dtau_da, np.swapaxes(found.dtau_da, 1, 2), atol=1e-12)


def test_separate_branches_do_not_know_of_each_other(derived):
    *_, found = derived
    related = np.zeros((55, 55), dtype=bool)
    for j in range(55):
        related[j, _path(j)] = related[_path(j), j] = True
    assert not related[skeleton.index("knee_flexion_r"), skeleton.index("knee_flexion_l")]
    for by in found[1:]:
        np.testing.assert_array_equal(by[:, ~related], 0)
        knee, ankle = skeleton.index("knee_flexion_r"), skeleton.index("ankle_dorsiflexion_r")
        assert np.all(by[:, knee, ankle] != 0)
        assert np.all(by[:, ankle, knee] != 0)


def test_leading_axes_of_sensitivities_are_instants():
    q, v, a = random_states(6)
    loads = random_loads(6)
    batch = rl.inverse_dynamics_derivatives(MALE, q, v, a, loads)
    folded = rl.inverse_dynamics_derivatives(MALE, *(x.reshape(2, 3, 55) for x in (q, v, a)))
    unloaded = rl.inverse_dynamics_derivatives(MALE, q, v, a)
    for k in range(6):
        alone = rl.inverse_dynamics_derivatives(MALE, q[k], v[k], a[k], at_instant(loads, k))
        for together, one in zip(batch, alone, strict=True):
            np.testing.assert_allclose(together[k], one, rtol=1e-12, atol=1e-11)
    for together, one in zip(folded, unloaded, strict=True):
        np.testing.assert_allclose(together.reshape(one.shape), one, rtol=1e-12, atol=1e-11)


def test_one_state_may_be_held_against_many_loads():
    q, v, a = (x[0] for x in random_states(1))
    loads = random_loads(4)
    many = rl.inverse_dynamics_derivatives(MALE, q, v, a, loads)
    for k in range(4):
        alone = rl.inverse_dynamics_derivatives(MALE, q, v, a, at_instant(loads, k))
        for together, one in zip(many, alone, strict=True):
            np.testing.assert_allclose(together[k], one, rtol=1e-12, atol=1e-11)


def test_the_engine_is_independent():
    """Only the standard library, numpy, the DH table and the body."""
    imported = set()
    for node in ast.walk(ast.parse(Path(rl.__file__).read_text())):
        if isinstance(node, ast.Import):
            imported |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            imported |= {f"{node.module}.{name.name}" for name in node.names}
    ours = {name for name in imported if name.startswith("human_gait")}
    assert ours == {
        "human_gait.body.dh",
        "human_gait.body.links.GRAVITY",
        "human_gait.body.links.Links",
        "human_gait.values.Value",
    }
    assert not {name for name in imported if name.startswith(("pinocchio", "pydrake"))}


def test_a_wrong_number_of_dof_is_refused():
    with pytest.raises(ValueError, match="55"):
        rl.inverse_dynamics(MALE, np.zeros(6), np.zeros(6), np.zeros(6))
