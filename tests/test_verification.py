"""Each check must be able to fail: gaits with something wrong on purpose."""

import dataclasses

import numpy as np
import pytest
from walks import scenario

from human_gait.body.skeleton import SEGMENTS, index
from human_gait.checks import contents, ground, laws, motion
from human_gait.checks.check import Check, Kind
from human_gait.checks.engines import DrakeEngine, RecursionEngine
from human_gait.checks.verification import verify
from human_gait.problem.program import build_program
from human_gait.walk import contact_plan
from human_gait.walk.gait import Gait
from human_gait.walk.gait_file import make_record

PROGRAM = build_program(scenario())
GAIT = PROGRAM.gait(PROGRAM.guess())
SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])


def checks_of(gait):
    return {check.name: check for check in verify(make_record(gait))}


def failed(record):
    return {check.name for check in verify(record) if not check.passed}


RECORD = make_record(GAIT)
FOUND = {check.name: check for check in verify(RECORD)}
JOINTS, FOOTHOLDS, DEPTH = motion.JOINTS.name, motion.FOOTHOLDS.name, motion.DEPTH.name
ENGINES = [claim.name for claim in laws.TORQUES.values()]
SHARES = (ground.SHARES.name, ground.TOES.name, ground.IN_THE_AIR.name)
BALANCE = laws.BALANCE.name


def changed(**moved):
    """The gait with all control points of some joints moved."""
    P = GAIT.control_points.copy()
    for name, by in moved.items():
        P[:, index(name)] += by
    return Gait(GAIT.scenario, GAIT.breaks, P)


def instants():
    return GAIT.instants(np.linspace(0.0, GAIT.step_time, 25))


def test_physics_holds_for_any_motion_even_a_guess():
    for name in (
        JOINTS,
        BALANCE,
        *ENGINES,
        laws.NEXT_STEP.name,
        laws.MOMENTUM.name,
        laws.ENERGY.name,
        ground.PULL.name,
        laws.MEAN_FORCE.name,
        motion.POSTURE.name,
        motion.VELOCITY.name,
        *SHARES,
    ):
        assert FOUND[name].passed, name


def test_a_guess_is_not_taken_for_a_walk():
    """Its feet are centimetres off, and its ZMP is where the guess did not care."""
    assert not FOUND[FOOTHOLDS].passed
    assert not FOUND[ground.ZMP.name].passed


@pytest.mark.parametrize("per_interval", [1, 3])
def test_the_grid_is_ten_times_finer_than_the_constrained_one(per_interval):
    task = scenario(dynamics_per_interval=per_interval)
    times = make_record(Gait(task, GAIT.breaks, GAIT.control_points)).samples.t
    assert len(times) - 1 == 120 * per_interval
    assert (times[0], times[-1]) == (0.0, GAIT.step_time)


def scaled(name, *place, by=1.01):
    """The record of the guess with one number of its samples, masses or footholds changed."""
    source = RECORD.samples if hasattr(RECORD.samples, name) else RECORD
    array = getattr(source, name).copy()
    array[place] *= by
    tampered = dataclasses.replace(source, **{name: array})
    return tampered if source is RECORD else dataclasses.replace(RECORD, samples=tampered)


KNEE, K = index("knee_flexion_r"), 37
PELVIS_LINK, HEEL_L, TOES = SEGMENTS["pelvis"], (1, 0, 2), index("toe_extension_r")
TAMPERED = {
    "a torque": (("tau", K, KNEE), ENGINES[1]),
    "the torque of toes": (("tau", 3, TOES), ENGINES[2]),
    "a muscle torque": (("active", K, KNEE), laws.MUSCLES.name),
    "an angle": (("q", K, KNEE), contents.ANGLES.name),
    "a velocity": (("v", K, KNEE), contents.VELOCITIES.name),
    "an acceleration": (("a", K, KNEE), contents.ACCELERATIONS.name),
    "a foothold": (("footholds", *HEEL_L), contents.PLANNED.name),
    "a mass": (("mass", PELVIS_LINK), contents.MASSES.name),
    "a force": (("grf", K, 1, 1), BALANCE),
    "a moment": (("yaw_moment", K, 1), BALANCE),
    "a centre of pressure": (("cop", K, 1, 2), BALANCE),
    "a ZMP": (("zmp", K, 2), ground.ZMP_OF_FORCES.name),
    "a share of the toes": (("toe_share", 3, 0), ENGINES[0]),
    "a point of a foot": (("points", K, 0, 3, 2), motion.FEET.name),
}


@pytest.mark.parametrize(("place", "name"), TAMPERED.values(), ids=TAMPERED)
def test_one_number_of_the_file_changed_by_a_hundredth_is_seen(place, name):
    assert name in failed(scaled(*place)) - failed(RECORD)


def test_every_number_that_is_changed_is_seen_somewhere():
    """Wherever it is: one of the 401 instants, one of the joints, drawn at random."""
    rng = np.random.default_rng(5)
    before = failed(RECORD)
    for _ in range(12):
        name = str(rng.choice(["q", "v", "a", "tau", "active"]))
        array = getattr(RECORD.samples, name)
        place = rng.integers(array.shape[0]), rng.integers(6, array.shape[1])
        if abs(array[place]) > 1e-3:
            assert failed(scaled(name, *place)) - before, (name, place)


@pytest.mark.parametrize(
    ("key", "value", "name"),
    [
        ("mass", 1.01, contents.MASSES.name),
        ("stature", 1.01, contents.PLANNED.name),
    ],
)
def test_another_person_in_the_scenario_is_seen(key, value, name):
    """The motion, forces and torques of one body, said to be those of another."""
    subject = dataclasses.replace(
        GAIT.scenario.subject, **{key: value * getattr(GAIT.scenario.subject, key)}
    )
    task = dataclasses.replace(GAIT.scenario, subject=subject)
    gait = Gait(task, GAIT.breaks, GAIT.control_points)
    tampered = dataclasses.replace(RECORD, gait=gait)
    assert {name, *ENGINES, BALANCE} <= failed(tampered)


def test_a_control_point_of_the_file_that_is_changed_is_seen():
    P = GAIT.control_points.copy()
    P[3, KNEE] *= 1.01
    tampered = dataclasses.replace(RECORD, gait=Gait(GAIT.scenario, GAIT.breaks, P))
    assert contents.ANGLES.name in failed(tampered)


def consistent(**changes):
    """The record with samples changed, torques and ZMP made to fit them: only one claim is left."""
    now = dataclasses.replace(RECORD.samples, **changes)
    tau = RecursionEngine(GAIT.body).torques((now.q, now.v, now.a), laws.loads_of(GAIT, now))
    active = now.active + tau - now.tau
    now = dataclasses.replace(now, tau=tau, active=active, zmp=ground.zmp_of_forces(now))
    return dataclasses.replace(RECORD, samples=now)


def added(name, place, by):
    """An array of the samples with something added at a place."""
    array = getattr(RECORD.samples, name).copy()
    array[place] += by
    return {name: array}


MIDDLE = slice(50, 70)  # single support: the right foot swings
CHEATS = {
    "moments against each other": (added("yaw_moment", slice(None), [50.0, -50.0]), SHARES[0]),
    "toes against the rear foot": (added("toe_share", (slice(None), 1), -40.0), SHARES[1]),
    "a push at the swinging foot": (added("grf", (MIDDLE, 0, 1), 20.0), SHARES[2]),
    "a moment on the swinging foot": (added("yaw_moment", (MIDDLE, 0), 5.0), SHARES[2]),
    "pressure above the ground": (added("cop", (MIDDLE, 1, 1), 0.05), ground.ON_GROUND.name),
    "pressure of a foot in the air": (added("cop", (MIDDLE, 0, 2), 0.02), ground.FREE.name),
}


@pytest.mark.parametrize(("changes", "name"), CHEATS.values(), ids=CHEATS)
def test_forces_that_engines_agree_with_but_no_ground_gives_are_seen(changes, name):
    assert name in failed(consistent(**changes))


def test_absurd_torques_at_the_root_do_not_hide_a_wrong_torque_elsewhere():
    tau = RECORD.samples.tau.copy()
    tau[5, 0] = 1e15
    tau[K, KNEE] *= 1.01
    found = failed(
        dataclasses.replace(RECORD, samples=dataclasses.replace(RECORD.samples, tau=tau))
    )
    assert {*ENGINES} <= found


def walk_check(name, **changed):
    """One check of the walk after its samples have been changed."""
    now = dataclasses.replace(RECORD.samples, **changed)
    return next(check for check in motion.walk_checks(GAIT, now) if check.name == name)


@pytest.mark.parametrize(
    ("name", "array", "dof", "by", "value"),
    [
        (motion.SPEED.name, "v", "pelvis_tz", 0.5, 0.5),
        (motion.KNEE.name, "q", "knee_flexion_r", np.deg2rad(30.0), 30.0),
        (motion.ARMS.name, "q", "shoulder_flexion_r", 1.0, 0.2),
        (motion.PELVIS.name, "q", "pelvis_ty", 30.0, 20.0),
    ],
)
def test_a_walk_that_does_not_do_its_part_is_seen(name, array, dof, by, value):
    before = walk_check(name)
    changed = getattr(RECORD.samples, array).copy()
    changed[:, index(dof)] += by
    check = walk_check(name, **{array: changed})
    assert not check.passed
    assert check.value > max(before.value, 0.5 * value)


def test_feet_that_pass_through_each_other_are_seen():
    now = RECORD.samples
    points = now.points.copy()
    points[MIDDLE, 0, :, 0] = points[MIDDLE, 1, :, 0]
    check = motion.crossing(GAIT.plan, dataclasses.replace(now, points=points))
    assert not check.passed
    assert check.value == pytest.approx(0.06)
    assert now.t[50] <= check.time <= now.t[70]


def test_a_foot_that_moves_while_it_stands_is_seen():
    now = RECORD.samples
    found = DrakeEngine(GAIT.body).mechanics((now.q, now.v, now.a), laws.loads_of(GAIT, now))
    rates = np.gradient(found.points, now.t, axis=0)
    np.testing.assert_allclose(found.velocities[2:-2], rates[2:-2], atol=0.05)
    resting = dataclasses.replace(found, velocities=0.0 * found.velocities)
    assert motion.soft_impact(GAIT, now, resting).value == 0.0
    velocities = resting.velocities.copy()
    velocities[60, 1, 2, 2] = 1.0
    check = motion.soft_impact(GAIT, now, dataclasses.replace(found, velocities=velocities))
    assert (check.passed, check.value, check.time) == (False, 1.0, now.t[60])


def test_what_is_no_number_fails():
    assert ENGINES[1] in failed(scaled("tau", K, KNEE, by=np.nan))


def test_a_joint_beyond_its_limit_is_seen_by_how_much_and_when():
    _, upper = PROGRAM.limits
    knee = index("knee_flexion_r")
    P = GAIT.control_points.copy()
    P[3, knee] = upper[knee] + 2.0
    gait = Gait(GAIT.scenario, GAIT.breaks, P)
    check = checks_of(gait)[JOINTS]
    assert not check.passed
    most = np.rad2deg(gait.q(check.time)[knee] - upper[knee])
    assert check.value == pytest.approx(most)


@pytest.mark.parametrize(("joint", "name"), [("pelvis_ty", DEPTH), ("pelvis_tx", FOOTHOLDS)])
def test_a_sunken_or_shifted_body_is_seen(joint, name):
    """Everything 10 cm down, or to the right: at least what is left of it after the guess."""
    found = checks_of(changed(**{joint: -0.1}))[name]
    assert not found.passed
    assert 0.05 < found.value < 0.15


def test_a_foothold_elsewhere_is_seen():
    """The same motion held against a plan with wider steps."""
    wider = scenario(step_width=0.2)
    gait = Gait(wider, GAIT.breaks, GAIT.control_points)
    found = checks_of(gait)[FOOTHOLDS]
    assert found.value > FOUND[FOOTHOLDS].value + 0.01


def test_a_zmp_that_leaves_the_feet_is_seen():
    """Half a metre beside the left heel."""
    now = instants()
    aside = dataclasses.replace(now, zmp=now.points[:, 1, 0] + np.array([0.5, 0.0, 0.0]))
    check = ground.zmp_inside(GAIT.plan, aside)
    assert not check.passed
    assert 0.4 < check.value < 0.55


def test_energy_that_comes_from_nowhere_is_seen():
    """A weak motor at one joint, all the time: the torques do more than the body gains."""
    now = RECORD.samples
    found = DrakeEngine(GAIT.body).mechanics((now.q, now.v, now.a), laws.loads_of(GAIT, now))
    assert laws.energy(now, found).passed
    tau = now.tau.copy()
    tau[:, KNEE] += 0.5 * np.sign(now.v[:, KNEE])
    assert not laws.energy(dataclasses.replace(now, tau=tau), found).passed


def test_work_of_the_ground_is_what_feet_do_against_its_forces():
    """Only where loads move: with the ground's force at feet that stand still there is none."""
    now = RECORD.samples
    found = DrakeEngine(GAIT.body).mechanics((now.q, now.v, now.a), laws.loads_of(GAIT, now))
    check = laws.ground_work(now, found)
    free = RecursionEngine(GAIT.body).torques((now.q, now.v, now.a), [])
    power = np.sum((free - now.tau) * now.v, axis=1)
    work, joints = (
        np.trapezoid(power, now.t),
        np.trapezoid(np.maximum(now.tau * now.v, 0.0).sum(axis=1), now.t),
    )
    assert check.value == pytest.approx(abs(work) / joints, rel=1e-6)
    assert f"{work:+.1f} J a step" in check.what
    resting = dataclasses.replace(found, loads_power=0.0 * found.loads_power)
    assert laws.ground_work(now, resting).value == 0.0


def test_a_ground_that_drives_the_walk_is_refused():
    """The energy adds up, whoever does the work: that check alone sees nothing of it."""
    now = RECORD.samples
    found = DrakeEngine(GAIT.body).mechanics((now.q, now.v, now.a), laws.loads_of(GAIT, now))
    joints = np.trapezoid(np.maximum(now.tau * now.v, 0.0).sum(axis=1), now.t)
    driven = 0.3 * joints / GAIT.step_time + np.zeros((len(now.t), 1))
    power = np.concatenate([driven, 0.0 * found.loads_power[:, 1:]], axis=1)
    gained = np.sum(now.tau * now.v, axis=1) + power.sum(axis=1)
    energy = np.concatenate([[0.0], np.cumsum((gained[1:] + gained[:-1]) / 2 * np.diff(now.t))])
    driving = dataclasses.replace(found, loads_power=power, energy=energy)
    assert laws.energy(now, driving).passed
    check = laws.ground_work(now, driving)
    assert not check.passed
    assert check.value == pytest.approx(0.3)
    braking = dataclasses.replace(driving, loads_power=-power)
    assert laws.ground_work(now, braking).what.startswith("-")
    assert laws.ground_work(now, braking).value == check.value


def test_a_load_that_is_a_force_is_not_the_ground():
    task = scenario(load={"mass": 18.0, "model": "force"})
    gait = Gait(task, GAIT.breaks, GAIT.control_points)
    now = gait.fine_samples
    found = DrakeEngine(gait.body).mechanics((now.q, now.v, now.a), laws.loads_of(gait, now))
    moved = found.loads_power.copy()
    moved[:, 4] += 1e6
    other = dataclasses.replace(found, loads_power=moved)
    assert laws.ground_work(now, other) == laws.ground_work(now, found)


@pytest.mark.parametrize("axis", range(3))
def test_an_impulse_that_moves_nothing_is_seen(axis):
    """A hundredth of the weight more, all the time, in one direction."""
    now = RECORD.samples
    grf = now.grf.copy()
    grf[:, 1, axis] += 0.01 * GAIT.plan.weight
    pushed = dataclasses.replace(now, grf=grf)
    found = DrakeEngine(GAIT.body).mechanics((now.q, now.v, now.a), laws.loads_of(GAIT, pushed))
    assert not laws.momentum(GAIT, now, found).passed


def test_a_body_that_is_not_its_own_mirror_image_is_seen():
    """Torques of the right knee that the left one does not repeat."""
    now = RECORD.samples
    drake, peak = DrakeEngine(GAIT.body), 100.0
    assert laws.next_step(GAIT, now, drake, peak).passed
    yaw = now.yaw_moment + np.array([1.0, 0.0])
    assert not laws.next_step(GAIT, dataclasses.replace(now, yaw_moment=yaw), drake, peak).passed


def test_a_ground_that_pulls_is_seen():
    now = instants()
    grf = now.grf.copy()
    grf[7, 0, 1] = -0.01 * GAIT.plan.weight
    check = ground.no_pull(GAIT.plan, dataclasses.replace(now, grf=grf))
    assert not check.passed
    assert check.value == pytest.approx(0.01)
    assert check.time == now.t[7]


def test_a_slippery_force_is_seen():
    """Half as much again as a dry floor holds, on the left foot in the middle of the step."""
    now = instants()
    grf, k = now.grf.copy(), 12
    grf[..., [0, 2]] = 0.0
    assert ground.sliding_friction(GAIT.plan, dataclasses.replace(now, grf=grf)).value == 0.0
    grf[k, 1, 2] = -1.5 * GAIT.plan.friction * grf[k, 1, 1]
    check = ground.sliding_friction(GAIT.plan, dataclasses.replace(now, grf=grf))
    assert not check.passed
    assert check.value == pytest.approx(1.5 * GAIT.plan.friction)
    assert check.time == now.t[k]


@pytest.mark.parametrize(("foot", "k"), [(1, 12), (0, 2)])
def test_pressure_beside_a_foot_is_seen(foot, k):
    """Half of the weight 20 cm beside the middle of a foot; without load it is nothing."""
    now = instants()
    cop, grf = GAIT.plan.footholds.mean(axis=1) + np.zeros((25, 2, 3)), 0.0 * now.grf
    cop[:, 0, 2] = GAIT.plan.footholds[0, 3, 2] - 0.01  # the trailing foot stands on its toes
    grf[k, foot, 1] = 0.5 * GAIT.plan.weight
    put = dataclasses.replace(now, cop=cop, grf=grf)
    assert ground.pressure_inside(GAIT.plan, put).passed
    cop[k, foot, 0] += 0.2
    check = ground.pressure_inside(GAIT.plan, dataclasses.replace(now, cop=cop, grf=grf))
    assert not check.passed
    assert 0.14 < check.value < 0.19
    assert check.time == now.t[k]
    unloaded = dataclasses.replace(now, cop=cop, grf=0.0 * grf)
    assert ground.pressure_inside(GAIT.plan, unloaded).passed


def test_a_foot_that_has_to_turn_is_seen():
    """Single support at mid-step: the moment that a dry floor holds, and half as much again."""
    now, k = instants(), 12
    polygon = GAIT.plan.support_polygon(now.t[k])
    radius = contact_plan.radius_of_gyration(polygon)
    assert 0.05 < radius < 0.1
    yaw = now.yaw_moment * 0.0
    yaw[k, 1] = 1.5 * GAIT.plan.friction * radius * now.grf[k, :, 1].sum()
    grf = now.grf * [0.0, 1.0, 0.0]
    check = ground.turning_friction(GAIT.plan, dataclasses.replace(now, yaw_moment=yaw, grf=grf))
    assert not check.passed
    assert check.value == pytest.approx(1.5 * GAIT.plan.friction, rel=1e-3)
    assert check.time == now.t[k]


def test_a_foot_that_slides_while_it_stands_is_seen():
    """The left foot, 3 cm forward in its stance, before or after the right one strikes."""
    still = RECORD.samples
    points = np.broadcast_to(GAIT.plan.footholds, still.points.shape).copy()
    still = dataclasses.replace(still, points=points)
    assert motion.slip(GAIT, still).value < 1e-12
    moved = points.copy()
    moved[60, 1, 1, 2] += 0.03
    check = motion.slip(GAIT, dataclasses.replace(still, points=moved))
    assert (check.value, check.time) == (pytest.approx(0.03), still.t[60])
    moved = points.copy()
    moved[5, 0, 3, 2] += 0.03
    check = motion.slip(GAIT, dataclasses.replace(still, points=moved))
    assert (check.value, check.time) == (pytest.approx(0.03), still.t[5] + GAIT.step_time)


@pytest.mark.parametrize("corners", [SQUARE, SQUARE[::-1], np.roll(SQUARE, 1, axis=0) + 7.0])
def test_the_radius_of_gyration_of_a_rectangle(corners):
    """r^2 = (a^2 + b^2) / 12."""
    assert contact_plan.radius_of_gyration(corners) == pytest.approx(np.sqrt(5.0 / 12.0))


def test_a_ground_that_carries_too_much_is_seen():
    now = instants()
    check = laws.mean_force(GAIT, dataclasses.replace(now, grf=1.02 * now.grf))
    assert not check.passed
    assert check.value == pytest.approx(0.02, abs=2e-3)


def test_an_end_that_does_not_fit_the_start_is_seen():
    """At T, q = (P_1 + 4 P_2 + P_3) / 6 and v = (P_3 - P_1) / 2h of the last three."""
    pelvis, h = index("pelvis_tz"), np.diff(GAIT.breaks)[0]
    shifted, faster = GAIT.control_points.copy(), GAIT.control_points.copy()
    shifted[-3:, pelvis] += 1e-3
    faster[-3:, pelvis] += [-1e-3, 0.0, 1e-3]
    shifted, faster = (checks_of(Gait(GAIT.scenario, GAIT.breaks, P)) for P in (shifted, faster))
    posture, velocity = motion.POSTURE.name, motion.VELOCITY.name
    assert shifted[posture].value == pytest.approx(1e-3)
    assert faster[velocity].value == pytest.approx(1e-3 / h)
    assert (shifted[posture].passed, shifted[velocity].passed) == (False, True)
    assert (faster[posture].passed, faster[velocity].passed) == (True, False)


@pytest.mark.parametrize(
    ("point", "distance"),
    [
        ((1.0, 0.5), 0.0),
        ((0.0, 0.0), 0.0),
        ((2.0, 0.3), 0.0),
        ((1.0, 1.25), 0.25),
        ((-0.5, 0.5), 0.5),
        ((2.3, 1.4), 0.5),
        ((-3.0, -4.0), 5.0),
    ],
)
def test_distance_from_a_polygon(point, distance):
    """To the nearest edge or corner, 0 inside and on the boundary, whichever way it goes round."""
    for polygon in (SQUARE, SQUARE[::-1], np.roll(SQUARE, 1, axis=0)):
        assert ground.distance_outside(polygon, np.array(point)) == pytest.approx(distance)


def test_distances_of_many_points_are_those_of_each():
    points = np.random.default_rng(2).normal(1.0, 2.0, (3, 7, 2))
    alone = [[float(ground.distance_outside(SQUARE, point)) for point in row] for row in points]
    np.testing.assert_array_equal(ground.distance_outside(SQUARE, points), alone)


def test_values_up_to_the_limit_pass_and_nothing_else():
    check = Check("length", "m", 0.01, 0.01, 0.0)
    assert check.passed
    assert not dataclasses.replace(check, value=0.0101).passed
    assert not dataclasses.replace(check, value=np.nan).passed


def person(**changes):
    """Return the walk as that of somebody whose muscles have an end to their strength."""
    strong = {"posture.torques": "strength", **changes}
    return Gait(GAIT.scenario.replace(strong), GAIT.breaks, GAIT.control_points)


def test_every_kind_of_check_is_there():
    assert {check.kind for check in checks_of(person()).values()} == set(Kind)
    assert {check.kind for check in FOUND.values()} == set(Kind) - {Kind.STRENGTH}


def test_a_walk_takes_a_smaller_share_of_a_stronger_person():
    found = [checks_of(person(**{"subject.strength": part})) for part in (1.0, 99.0)]
    weak, strong = (next(c for c in one.values() if c.kind is Kind.STRENGTH) for one in found)
    assert weak.value > 1.5 * strong.value > 0.0
    assert weak.limit == strong.limit == 1.0


def test_the_checks_of_friction_are_those_whose_limit_is_the_floor():
    ice = dataclasses.replace(GAIT.scenario.ground, friction=GAIT.scenario.ground.friction / 2)
    task = dataclasses.replace(GAIT.scenario, ground=ice)
    found = checks_of(Gait(task, GAIT.breaks, GAIT.control_points))
    changed = {name for name, check in found.items() if check.limit != FOUND[name].limit}
    assert changed == {name for name, check in FOUND.items() if check.kind is Kind.FRICTION}


def test_what_is_constrained_at_the_instants_is_what_a_constraint_says_or_the_package_adds():
    stated = {c.equation for c in PROGRAM.constraints}
    checked = {check.equation for check in FOUND.values() if check.kind is Kind.INSTANTS}
    assert checked <= stated | {""}
    assert len(checked) > 4
