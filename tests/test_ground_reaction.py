"""Through Walker.at near a walk, and with wrenches made by hand."""

import numpy as np
import pytest
from walks import PEOPLE, central_difference, scenario, walking_states

from human_gait.body import dh
from human_gait.body.skeleton import SEGMENTS, index
from human_gait.dynamics.inverse_dynamics import FOOT_LINKS
from human_gait.dynamics.jet import Linearised
from human_gait.dynamics.recursive_lagrangian import ExternalLoad, inverse_dynamics
from human_gait.walk.contact_plan import LEFT, RIGHT
from human_gait.walk.ground_reaction import ground_reaction
from human_gait.walk.instant import Walker

TOES = [index("toe_extension_r"), index("toe_extension_l")]
XZ = [0, 2]


TASKS = PEOPLE | {"by least effort": scenario(ground={"sharing": "least_effort"})}


@pytest.fixture(params=TASKS.values(), ids=TASKS, scope="module")
def walker(request):
    return Walker(request.param)


@pytest.fixture(scope="module")
def now(walker):
    task = next(task for task in TASKS.values() if task.walk is walker.plan.walk)
    return walker.at(*walking_states(task))


def both(walker, now):
    return walker.plan.double_support(now.t)


def test_the_global_dof_are_free_of_torque(walker, now):
    """1e-10 of body weight times stature: far above rounding, far below what can be felt."""
    scale = walker.plan.weight * walker.body.subject.stature
    assert np.abs(now.torque[:, :6]).max() < 1e-10 * scale


def test_the_torques_are_those_of_the_recursion_under_the_same_forces(walker, now):
    """But for the toes, which share the load of the foot."""
    expected = inverse_dynamics(walker.body, now.q, now.v, now.a, loads_on_feet(walker, now))
    difference = np.delete(now.torque - expected, TOES, axis=1)
    assert np.abs(difference).max() < 1e-10 * np.abs(expected).max()


def loads_on_feet(walker, now):
    """The wrenches, each at the world's origin as a point of the link."""
    A = dh.frames(walker.body.table, now.q)[1][:, FOOT_LINKS[:, 0]]
    origin = -np.einsum("kfji,kfj->kfi", A[..., :3, :3], A[..., :3, 3])
    wrenches = [wrench.value for wrench in now.ground.wrenches]
    return [
        ExternalLoad(int(FOOT_LINKS[f, 0]), origin[:, f], wrenches[f][:, :3], wrenches[f][:, 3:])
        for f in (RIGHT, LEFT)
    ]


def test_the_feet_carry_together_what_the_body_needs(walker, now):
    """Their wrench holds the pelvis of a body without feet on the ground: tau_1..6 vanish."""
    right, left = (wrench.value for wrench in now.ground.wrenches)
    total = right + left
    A = dh.frames(walker.body.table, now.q)[1][:, SEGMENTS["pelvis"]]
    origin = -np.einsum("kji,kj->ki", A[:, :3, :3], A[:, :3, 3])
    load = ExternalLoad(SEGMENTS["pelvis"], origin, total[:, :3], total[:, 3:])
    rest = inverse_dynamics(walker.body, now.q, now.v, now.a, [load])[:, :6]
    assert np.abs(rest).max() < 1e-10 * walker.plan.weight
    np.testing.assert_allclose(total[:, :3], now.ground.force.value, rtol=1e-12)


def test_horizontal_moments_vanish_at_the_zero_moment_point(walker, now):
    total = sum(wrench.value for wrench in now.ground.wrenches)
    zmp = np.insert(now.ground.zmp.value, 1, 0.0, axis=1)
    moment = total[:, 3:] - np.cross(zmp, total[:, :3])
    assert np.abs(moment[:, XZ]).max() < 1e-10 * walker.plan.weight


def test_horizontal_moments_vanish_at_the_pressure_of_each_foot(walker, now):
    for pressure, wrench in zip(now.ground.pressure, now.ground.wrenches, strict=True):
        point = np.insert(pressure.value, 1, 0.0, axis=1)
        moment = wrench.value[:, 3:] - np.cross(point, wrench.value[:, :3])
        assert np.abs(moment[:, XZ]).max() < 1e-10 * walker.plan.weight


def test_shares_are_between_none_and_all(now):
    share = now.ground.leading_share.value
    assert share.min() >= 0.0
    assert share.max() <= 1.0


def test_in_single_support_the_left_foot_carries_everything_at_the_zmp(walker, now):
    single = ~both(walker, now)
    right, left = now.ground.wrenches
    np.testing.assert_array_equal(right.value[single], 0.0)
    np.testing.assert_array_equal(now.ground.leading_share.value[single], 1.0)
    np.testing.assert_array_equal(left.value[single, :3], now.ground.force.value[single])
    np.testing.assert_array_equal(
        now.ground.pressure[LEFT].value[single], now.ground.zmp.value[single]
    )


def test_partials_are_the_slopes(walker, now):
    """Every output in q, v, a; rounding of 1e3 N m over 1e-6 is some 1e-6 of the slopes."""
    rng = np.random.default_rng(0)
    state = np.stack([now.q, now.v, now.a], axis=1)
    directions = rng.normal(size=(*state.shape, 6))
    for name, output in OUTPUTS.items():

        def value(x, output=output):
            return output(walker.at(now.t, *x.swapaxes(0, 1))).value

        slopes = central_difference(value, state, np.moveaxis(directions, -1, 0).T)
        partials = output(now).partials
        by_direction = np.einsum(
            "k...s,ksd->k...d", partials, directions.reshape(len(state), 165, 6)
        )
        worst = np.abs(by_direction - slopes).max() / np.abs(slopes).max()
        assert worst < 1e-6, name


OUTPUTS = {
    "all that the ground gives": lambda x: x.ground.variables,
    "force": lambda x: x.ground.in_state(x.ground.force),
    "zmp": lambda x: x.ground.in_state(x.ground.zmp),
    "share": lambda x: x.ground.in_state(x.ground.leading_share),
    "pressure on the right foot": lambda x: x.ground.in_state(x.ground.pressure[0]),
    "pressure on the left foot": lambda x: x.ground.in_state(x.ground.pressure[1]),
    "wrench on the right foot": lambda x: x.ground.in_state(x.ground.wrenches[0]),
    "wrench on the left foot": lambda x: x.ground.in_state(x.ground.wrenches[1]),
    "muscle torque": lambda x: Linearised(x.muscle_torque, x.muscle_partials),
}

PLAN = Walker(scenario(ground={"sharing": "parallel"})).plan
PIVOT = Walker(scenario(ground={"sharing": "pivot", "pivot_height": 0.8})).plan
PIVOT_STATURE = scenario().subject.stature
MIDDLE = PLAN.phases.double_support / 2 * PLAN.walk.step_time
FORCE = np.array([30.0, 800.0, -60.0])


def by_hand(zmp, times, force=FORCE, yaw_moment=5.0, plan=PLAN):
    """The ground reaction for a zero moment point (K, 2) chosen freely."""
    point = np.insert(np.atleast_2d(zmp), 1, 0.0, axis=1)
    moment = np.cross(point, force) + np.array([0.0, yaw_moment, 0.0])
    wrench = np.concatenate([np.broadcast_to(force, point.shape), moment], axis=1)
    variables = Linearised(wrench, np.zeros((len(point), 6, 165)))
    return ground_reaction(variables, plan, np.broadcast_to(times, len(point)))


def along(fractions, time=MIDDLE):
    """Points on the line from A to B of Eq. (17)."""
    A, B = (point[0, XZ] for point in PLAN.transfer_points(np.array([time])))
    return A + np.multiply.outer(fractions, B - A)


def test_the_zmp_is_found_again():
    zmp = np.array([[0.03, -0.1], [-0.02, 0.4]])
    np.testing.assert_allclose(by_hand(zmp, MIDDLE).zmp.value, zmp, atol=1e-14)


def test_on_the_line_the_shares_are_those_of_the_paper():
    """R_1 : R_2 = d_2 : d_1, forces at A and B themselves (Eq. 17)."""
    fractions = np.linspace(0.1, 0.9, 9)
    ground = by_hand(along(fractions), MIDDLE)
    A, B = (point[0, XZ] for point in PLAN.transfer_points(np.array([MIDDLE])))
    d1, d2 = (np.linalg.norm(along(fractions) - end, axis=1) for end in (A, B))
    R1, R2 = (wrench.value[:, :3] for wrench in ground.wrenches)
    np.testing.assert_allclose(R1, np.outer(d2 / (d1 + d2), FORCE), rtol=1e-12)
    np.testing.assert_allclose(R2, np.outer(d1 / (d1 + d2), FORCE), rtol=1e-12)
    for pressure, end in zip(ground.pressure, (A, B), strict=True):
        np.testing.assert_allclose(pressure.value, np.broadcast_to(end, (9, 2)), atol=1e-13)


@pytest.mark.parametrize("force", [FORCE, np.array([0.0, 800.0, 0.0])])
def test_forces_of_both_feet_meet_at_the_pivot(force):
    """Each points from its foot to one point on the line of their sum, H above the ZMP."""
    zmp = along(np.linspace(0.1, 0.9, 5))
    ground = by_hand(zmp, MIDDLE, force=force, plan=PIVOT)
    pivot = np.insert(zmp, 1, 0.0, axis=1) + 0.8 * PIVOT_STATURE * force / force[1]
    for pressure, wrench in zip(ground.pressure, ground.wrenches, strict=True):
        to_pivot = pivot - np.insert(pressure.value, 1, 0.0, axis=1)
        missed = np.cross(to_pivot, wrench.value[:, :3])
        np.testing.assert_allclose(missed, 0.0, atol=1e-10)


def test_leaning_forces_cancel_in_the_sum():
    """Force and moment of both feet together, shares and pressure are those of Eq. (17)."""
    zmp = along(np.linspace(-0.1, 1.1, 7)) + np.array([0.01, 0.0])
    leaning, parallel = by_hand(zmp, MIDDLE, plan=PIVOT), by_hand(zmp, MIDDLE)
    sums = [sum(wrench.value for wrench in ground.wrenches) for ground in (leaning, parallel)]
    np.testing.assert_allclose(*sums, atol=1e-10)
    for name in ("zmp", "leading_share"):
        one, other = (getattr(ground, name).value for ground in (leaning, parallel))
        np.testing.assert_array_equal(one, other)
    apart = leaning.wrenches[0].value - parallel.wrenches[0].value
    assert np.abs(apart[3, 2]) > 10.0  # both feet push, and against each other
    np.testing.assert_allclose(apart[[0, -1]], 0.0, atol=1e-12)  # one foot has nothing to lean on


def test_the_vertical_moment_is_shared_like_the_force():
    ground = by_hand(along([0.3]), MIDDLE, yaw_moment=10.0)
    for pressure, wrench, share in zip(ground.pressure, ground.wrenches, (0.7, 0.3), strict=True):
        point = np.insert(pressure.value, 1, 0.0, axis=1)
        own = wrench.value[:, 3:] - np.cross(point, wrench.value[:, :3])
        np.testing.assert_allclose(own, [[0.0, 10.0 * share, 0.0]], atol=1e-11)


def test_beside_the_line_both_points_shift_alike():
    A, B = (point[0, XZ] for point in PLAN.transfer_points(np.array([MIDDLE])))
    across = np.array([(B - A)[1], -(B - A)[0]]) / np.linalg.norm(B - A)
    ground = by_hand(along([0.4]) + 0.02 * across, MIDDLE)
    for pressure, end in zip(ground.pressure, (A, B), strict=True):
        np.testing.assert_allclose(pressure.value[0] - end, 0.02 * across, atol=1e-13)


def test_the_share_bends_smoothly_into_none_and_all():
    """No jump in value or slope: steps of 1e-3 of the way change neither by much."""
    fractions = np.linspace(-0.3, 1.3, 1601)
    share = by_hand(along(fractions), MIDDLE).leading_share.value
    slope = np.diff(share) / np.diff(fractions)
    assert share.min() == 0.0
    assert share.max() == 1.0
    assert np.all(np.diff(share) >= 0.0)
    assert slope.max() < 1.0 + 1e-9
    assert np.abs(np.diff(slope)).max() < 0.05


def test_beyond_the_feet_no_foot_is_pulled():
    """Rounding must not leave 1e-16 of the weight: the sign of a force is checked exactly."""
    fractions = np.concatenate([np.linspace(-5, 0, 997), np.linspace(1, 6, 997)])
    for wrench in by_hand(along(fractions), MIDDLE).wrenches:
        assert wrench.value[:, 1].min() >= 0.0


def test_the_hand_over_has_no_jump_when_the_zmp_has_reached_the_leading_foot():
    T = PLAN.walk.step_time
    end = PLAN.phases.double_support * T
    times = np.array([end, end * (1 + 1e-6)])
    beyond = along(1.3, end)
    ground = by_hand(np.stack([beyond, beyond]), times)
    for wrench in ground.wrenches:
        np.testing.assert_allclose(wrench.value[0], wrench.value[1], atol=1e-10)
    pressure = ground.pressure[LEFT].value
    np.testing.assert_allclose(pressure[0], pressure[1], atol=1e-12)
