"""What each constraint says, by postures made by hand."""

import numpy as np
import pytest
from walks import scenario

from human_gait.body import dh
from human_gait.body.links import CONTACT_POINTS, GRAVITY
from human_gait.body.skeleton import index
from human_gait.problem.balance_rows import (
    GROUND_PUSHES,
    LOAD_TRANSFER,
    SLIDING_FRICTION,
    TURNING_FRICTION,
    ZMP_STABILITY,
)
from human_gait.problem.constraints import friction_constraints, paper_constraints
from human_gait.problem.contact_rows import (
    CONTACT_POSITION,
    FEET_APART,
    GROUND_PENETRATION,
    SOFT_IMPACT,
)
from human_gait.problem.posture_rows import ARM_LEG_COUPLING, KNEE_AT_MID_SWING, PELVIC_VELOCITY
from human_gait.walk.contact_plan import LEFT, RIGHT
from human_gait.walk.instant import Walker

TASK = scenario()
WALKER = Walker(TASK)
PLAN = WALKER.plan
T, L = TASK.walk.step_time, TASK.walk.step_length
FLAT = np.array([(PLAN.phases.double_support + PLAN.phases.heel_unloading) / 2 * T])
POINTS = len(CONTACT_POINTS)
X, Y, Z = range(3)


def standing(**changes):
    """Upright, the left foot on its foothold: q (55,), changed by joint in rad or m."""
    lengths = WALKER.body.measures.lengths
    q = np.zeros(55)
    q[index("pelvis_ty")] = lengths["h_ank"] + lengths["L_sh"] + lengths["L_th"] + lengths["h_hip"]
    q[index("pelvis_tx")] = PLAN.ankles[LEFT, X] - lengths["w_hip"]
    q[index("pelvis_tz")] = PLAN.ankles[LEFT, Z]
    for name, change in changes.items():
        q[index(name)] += change
    return q


def demanded(demand, times=FLAT):
    """One constraint on a grid."""
    constraints = paper_constraints(TASK, PLAN, times) + friction_constraints(PLAN, times)
    return next(c for c in constraints if c.demand == demand)


def at_rest(q, times=FLAT, v=None, a=None):
    q = np.broadcast_to(q, (len(times), 55))
    v, a = (np.zeros(55) if x is None else x for x in (v, a))
    return WALKER.at(times, q, np.broadcast_to(v, q.shape), np.broadcast_to(a, q.shape))


def moving(**speeds):
    v = np.zeros(55)
    for name, speed in speeds.items():
        v[index(name)] = speed
    return v


def centre_of_mass(q):
    A = dh.frames(WALKER.body.table, q)[1]
    moments = np.einsum("iab,ib->ia", A, WALKER.body.pseudo_inertia()[:, :, 3])
    return moments.sum(axis=0)[:3] / WALKER.body.total_mass


def centred(x, z):
    """Standing with the centre of mass above a point of the ground."""
    q = standing()
    com = centre_of_mass(q)
    return standing(pelvis_tx=x - com[X], pelvis_tz=z - com[Z])


def kept(constraint, residual):
    """Whether each row is within its bounds but for rounding."""
    above = residual.value >= constraint.lower - 1e-12
    return above & (residual.value <= constraint.upper + 1e-12)


def test_a_foot_on_its_foothold_keeps_the_contact_position():
    constraint = demanded(CONTACT_POSITION)
    residual = constraint.evaluate(at_rest(standing()))
    assert residual.value.shape == (3 * POINTS,)  # the right foot swings
    np.testing.assert_allclose(residual.value, 0.0, atol=1e-13)


@pytest.mark.parametrize(("joint", "axis"), [("pelvis_tx", X), ("pelvis_ty", Y), ("pelvis_tz", Z)])
def test_a_standing_foot_moved_by_a_centimetre_is_a_centimetre_off(joint, axis):
    constraint = demanded(CONTACT_POSITION)
    residual = constraint.evaluate(at_rest(standing(**{joint: 0.01})))
    off = residual.value.reshape(POINTS, 3)
    np.testing.assert_allclose(off[:, axis], 0.01)
    np.testing.assert_allclose(np.delete(off, axis, axis=1), 0.0, atol=1e-13)
    assert not kept(constraint, residual).reshape(POINTS, 3)[:, axis].any()


def test_contact_may_be_missed_by_the_tolerance():
    constraint = demanded(CONTACT_POSITION)
    within = constraint.evaluate(at_rest(standing(pelvis_tz=0.99 * TASK.tolerances.contact)))
    beyond = constraint.evaluate(at_rest(standing(pelvis_tz=1.01 * TASK.tolerances.contact)))
    assert kept(constraint, within).all()
    assert not kept(constraint, beyond).all()


def test_in_double_support_both_feet_have_footholds():
    phases = PLAN.phases
    both_flat = phases.foot_flat * T  # the trailing ball is still down at its last instant
    assert phases.foot_flat <= phases.ball_off
    constraint = demanded(CONTACT_POSITION, np.array([both_flat]))
    off = constraint.evaluate(at_rest(standing(), times=np.zeros(1))).value.reshape(-1, 3)
    assert len(off) == 3 + POINTS  # ball and toe of the right foot, all of the left
    np.testing.assert_allclose(off[:3, Z], L, atol=1e-13)  # the right foot stands beside the left
    np.testing.assert_allclose(off[3:], 0.0, atol=1e-13)


@pytest.mark.parametrize(
    ("x", "z", "edge"), [(1, 0, "outer"), (-1, 0, "inner"), (0, 1, "front"), (0, -1, "rear")]
)
def test_rows_of_the_zmp_name_the_edge_that_is_passed(x, z, edge):
    """The centre of mass half a metre from the standing left foot; x points left, z forward."""
    constraint = demanded(ZMP_STABILITY)
    foot = PLAN.ankles[LEFT]
    residual = constraint.evaluate(at_rest(centred(foot[X] + 0.5 * x, foot[Z] + 0.5 * z)))
    worst = constraint.what[np.argmin(residual.value - constraint.lower)]
    assert worst == f"left foot, {edge} edge"


def test_a_swinging_foot_in_the_ground_is_penetration():
    constraint = demanded(GROUND_PENETRATION)
    assert len(constraint.lower) == POINTS  # the points of the right foot
    level = constraint.evaluate(at_rest(standing()))
    sunken = constraint.evaluate(at_rest(standing(pelvis_ty=-0.01)))
    lifted = constraint.evaluate(at_rest(standing(knee_flexion_r=0.5, hip_flexion_r=0.6)))
    np.testing.assert_allclose(level.value, 0.0, atol=1e-13)
    np.testing.assert_allclose(sunken.value, -0.01)
    assert not kept(constraint, sunken).any()
    assert np.all(lifted.value > 0.01)
    assert kept(constraint, lifted).all()


def test_every_point_either_stands_or_is_kept_above_the_ground():
    times = np.arange(12) * T / 12
    above, on = demanded(GROUND_PENETRATION, times), demanded(CONTACT_POSITION, times)
    assert len(above.lower) + len(on.lower) / 3 == 2 * POINTS * len(times)


def test_feet_pass_each_other_at_a_distance():
    """Standing, heel and toe are as far apart as the hips; crossed legs are refused."""
    constraint = demanded(FEET_APART)
    apart = constraint.evaluate(at_rest(standing()))
    np.testing.assert_allclose(apart.value, 2 * WALKER.body.measures.lengths["w_hip"])
    crossed = constraint.evaluate(at_rest(standing(hip_abduction_r=-0.25)))
    assert kept(constraint, apart).all()
    assert not kept(constraint, crossed).any()


def test_motion_is_constrained_on_the_coarser_grid_and_forces_on_the_finer():
    task = scenario(dynamics_per_interval=3)
    times = np.arange(36) * T / 36
    instants = {c.demand: set(c.instants) for c in paper_constraints(task, PLAN, times)}
    for demand in (CONTACT_POSITION, PELVIC_VELOCITY, ARM_LEG_COUPLING):
        assert instants[demand] == set(range(0, 36, 3))
    for demand in (ZMP_STABILITY, GROUND_PUSHES):
        assert instants[demand] == set(range(36))


def test_standing_points_do_not_slip():
    constraint = demanded(SOFT_IMPACT)
    still = constraint.evaluate(at_rest(standing()))
    slipping = constraint.evaluate(at_rest(standing(), v=moving(pelvis_tz=0.5)))
    np.testing.assert_allclose(still.value, 0.0, atol=1e-15)
    np.testing.assert_allclose(slipping.value.reshape(-1, 3), [[0.0, 0.0, 0.5]] * POINTS)
    assert not kept(constraint, slipping).reshape(-1, 3)[:, Z].any()


def test_the_swinging_leg_may_move():
    constraint = demanded(SOFT_IMPACT)
    swinging = constraint.evaluate(at_rest(standing(), v=moving(hip_flexion_r=4.0)))
    np.testing.assert_allclose(swinging.value, 0.0, atol=1e-15)


def middle_of_the_left_foot():
    return PLAN.pressure_region(FLAT)[0, LEFT].mean(axis=0)


def test_above_the_middle_of_the_foot_the_zmp_is_stable():
    constraint = demanded(ZMP_STABILITY)
    residual = constraint.evaluate(at_rest(centred(*middle_of_the_left_foot())))
    lower, upper = PLAN.pressure_region(FLAT)[0, LEFT]
    half = (upper - lower) / 2
    np.testing.assert_allclose(residual.value, [*half, *half], atol=1e-12)
    assert kept(constraint, residual).all()


@pytest.mark.parametrize("row", range(4), ids=["medially", "behind", "laterally", "ahead"])
def test_outside_the_foot_the_zmp_is_unstable_by_its_distance(row):
    """At rest R_y is the weight, and the row is the distance from the bound."""
    side, axis = divmod(row, 2)
    point = middle_of_the_left_foot()
    point[axis] = PLAN.pressure_region(FLAT)[0, LEFT, side, axis] + (0.02 if side else -0.02)
    constraint = demanded(ZMP_STABILITY)
    residual = constraint.evaluate(at_rest(centred(*point)))
    assert residual.value[row] == pytest.approx(-0.02, abs=1e-12)
    np.testing.assert_array_equal(np.flatnonzero(~kept(constraint, residual)), [row])


def test_in_double_support_the_pressure_of_both_feet_is_bounded():
    times = np.array([0.5 * (PLAN.phases.foot_flat + PLAN.phases.double_support) * T])
    A, B = (point[0, [X, Z]] for point in PLAN.transfer_points(times))
    constraint = demanded(ZMP_STABILITY, times)
    between = constraint.evaluate(at_rest(centred(*(A + B) / 2), times))
    beside = constraint.evaluate(at_rest(centred(*(A + B) / 2 + [0.2, 0.0]), times))
    assert len(constraint.lower) == 8
    assert kept(constraint, between).all()
    assert not kept(constraint, beside)[:4].all()
    assert not kept(constraint, beside)[4:].all()


def handing_over(done, share):
    """Residual of the load transfer: ZMPs that give a share to the leading foot, at rest."""
    times = np.atleast_1d(done) * PLAN.phases.double_support * T
    A, B = (point[:, [X, Z]] for point in PLAN.transfer_points(times))
    zmp = A + np.atleast_1d(share)[:, None] * (B - A)
    constraint = demanded(LOAD_TRANSFER, times)
    now = at_rest(np.array([centred(*point) for point in zmp]), times)
    return kept(constraint, constraint.evaluate(now)).reshape(2, -1).all(axis=0)


def test_load_is_handed_over_evenly():
    done = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
    tolerance = TASK.tolerances.load_transfer
    assert handing_over(done, done).all()
    middle = done[1:-1]
    assert handing_over(middle, middle + 0.9 * tolerance).all()
    assert handing_over(middle, middle - 0.9 * tolerance).all()
    assert not handing_over(middle, middle + 1.1 * tolerance).any()
    assert not handing_over(middle, middle - 1.1 * tolerance).any()


def test_all_load_is_behind_at_first_and_in_front_at_last():
    """Whatever the tolerance: a foot that takes load in a jump makes the torques jump."""
    assert handing_over([0.0, 1.0], [-0.05, 1.05]).all()
    assert not handing_over([0.0, 1.0], [0.02, 0.98]).any()


def test_who_stands_presses_with_the_weight_and_who_falls_not_at_all():
    constraint = demanded(GROUND_PUSHES)
    weight = constraint.evaluate(at_rest(standing()))
    a = moving(pelvis_ty=GRAVITY[1])
    falling = constraint.evaluate(at_rest(standing(), a=0.999 * a))
    assert weight.value.item() == pytest.approx(1.0)
    assert falling.value.item() == pytest.approx(0.001)
    assert not kept(constraint, falling).any()


@pytest.mark.parametrize(("share", "holds"), [(0.9, True), (1.1, False)])
def test_a_foot_slides_when_it_is_pushed_aside_too_hard(share, holds):
    """The whole body accelerates to the side, at a share of what friction gives."""
    constraint = demanded(SLIDING_FRICTION)
    a = moving(pelvis_tx=share * 0.95 * TASK.ground.friction * -GRAVITY[1])
    now = constraint.evaluate(at_rest(standing(), a=a))
    assert now.value.item() == pytest.approx((1 - share) * 0.95 * TASK.ground.friction, abs=2e-3)
    assert kept(constraint, now).all() == holds


@pytest.mark.parametrize("turn", [-1.0, 1.0])
def test_a_foot_turns_when_the_body_spins_too_fast(turn):
    """Twice the angular acceleration that takes all the moment: one side holds, one does not."""
    constraint = demanded(TURNING_FRICTION)
    spin = turn * moving(pelvis_ry=1.0)
    still, spun = (constraint.evaluate(at_rest(standing(), a=a)).value for a in (0 * spin, spin))
    assert still[0] == pytest.approx(still[1], abs=1e-6)
    per_spin = abs(spun[0] - spun[1]) / 2
    most = constraint.evaluate(at_rest(standing(), a=2 * still[0] / per_spin * spin))
    assert kept(constraint, most).sum() == 1
    assert min(most.value) == pytest.approx(-still[0], rel=0.05)


def test_a_slippery_floor_allows_less():
    floors = {mu: scenario(ground={"friction": mu}) for mu in (0.1, 0.5)}
    grid = np.arange(12) * T / 12
    rows = {}
    for mu, task in floors.items():
        walker = Walker(task)
        now = walker.at(grid, *(np.zeros((12, 55)) + x for x in (standing(), 0.0, 0.0)))
        found = friction_constraints(walker.plan, grid)
        rows[mu] = {constraint.demand: constraint.evaluate(now).value for constraint in found}
    for demand in (SLIDING_FRICTION, TURNING_FRICTION):
        assert np.all(rows[0.1][demand] < rows[0.5][demand] + 1e-12)


def test_the_pelvis_moves_at_the_walking_speed():
    constraint = demanded(PELVIC_VELOCITY)
    slow = constraint.evaluate(at_rest(standing(), v=moving(pelvis_tz=TASK.walk.speed - 0.3)))
    right = constraint.evaluate(at_rest(standing(), v=moving(pelvis_tz=TASK.walk.speed)))
    assert slow.value.item() == pytest.approx(-0.3)
    assert not kept(constraint, slow).any()
    assert kept(constraint, right).all()


def test_the_swinging_knee_is_bent_by_60_degrees_at_mid_swing():
    times = np.arange(20) * T / 20
    constraint = demanded(KNEE_AT_MID_SWING, times)
    (k,) = constraint.instants
    assert abs(times[k] / T - PLAN.phases.mid_swing) <= 0.025 + 1e-9  # half an interval
    postures = np.tile(standing(), (20, 1))
    postures[k, index("knee_flexion_r")] = np.deg2rad(60.0)
    assert constraint.evaluate(at_rest(postures, times)).value.item() == pytest.approx(0.0)
    straight = constraint.evaluate(at_rest(standing(), times))
    assert straight.value.item() == pytest.approx(-np.deg2rad(60.0))
    assert not kept(constraint, straight).any()


def test_arm_and_leg_of_a_side_swing_against_each_other():
    constraint = demanded(ARM_LEG_COUPLING)
    q = standing(shoulder_flexion_r=0.2, hip_flexion_r=0.9, shoulder_flexion_l=-0.2)
    q[index("hip_flexion_l")] = 0.9
    residual = constraint.evaluate(at_rest(q))
    np.testing.assert_allclose(residual.value, [0.18, -0.18])
    np.testing.assert_array_equal(kept(constraint, residual), [False, True])


def test_every_equation_of_the_paper_is_there_once_by_name():
    constraints = paper_constraints(TASK, PLAN, np.arange(12) * T / 12)
    names = [constraint.name for constraint in constraints]
    assert len(set(names)) == len(names)
    numbers = {n.strip() for constraint in constraints for n in constraint.equation.split(",")}
    assert numbers >= {str(n) for n in range(20, 28)} - {"26"}  # 26 holds by construction


def test_rows_know_their_instants_bounds_and_units():
    times = np.arange(12) * T / 12
    now = at_rest(np.tile(standing(), (12, 1)), times)
    for constraint in [*paper_constraints(TASK, PLAN, times), *friction_constraints(PLAN, times)]:
        residual = constraint.evaluate(now)
        rows = len(constraint.lower)
        assert np.all(constraint.lower <= constraint.upper)
        assert (
            residual.value.shape == constraint.upper.shape == constraint.instants.shape == (rows,)
        )
        shapes = {residual.dq.shape, residual.dv.shape, residual.da.shape, constraint.columns.shape}
        assert len(shapes) == 1
        assert np.all((constraint.instants >= 0) & (constraint.instants < 12))
        assert constraint.unit


def test_right_and_left_are_the_feet():
    assert (RIGHT, LEFT) == (0, 1)
    now = at_rest(standing(knee_flexion_r=1.0))
    assert now.feet[RIGHT].position[..., Y].min() > 0.05
    assert now.feet[LEFT].position[..., Y].max() < 1e-12
