"""Each check must be able to fail: gaits with something wrong on purpose."""

import dataclasses

import numpy as np
import pytest
from walks import scenario

from human_gait import verification as room
from human_gait.gait import Gait
from human_gait.program import build_program
from human_gait.skeleton import index
from human_gait.verification import verify

PROGRAM = build_program(scenario())
GAIT = PROGRAM.gait(PROGRAM.guess())
SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])


def checks_of(gait):
    return {check.name: check for check in verify(gait)}


FOUND = checks_of(GAIT)
JOINTS = "joint limits exceeded"
FOOTHOLDS = "standing points off their footholds"
DEPTH = "depth below the ground"
ZMP = "ZMP outside the foot support region"
BALANCE = "forces and moments left at the root"
ENGINES = "torques of the two engines apart"
PULL = "ground pulling at a foot"
PRESSURE, FRICTION = "pressure outside its foot", "friction needed"
MEAN = "mean vertical force against weight"
POSTURE, VELOCITY = "posture not periodic", "velocity not periodic"


def changed(**moved):
    """The gait with all control points of some joints moved."""
    P = GAIT.control_points.copy()
    for name, by in moved.items():
        P[:, index(name)] += by
    return Gait(GAIT.scenario, GAIT.breaks, P)


def instants():
    return GAIT.instants(np.linspace(0.0, GAIT.step_time, 25))


def test_physics_holds_for_any_motion_even_a_guess():
    for name in (JOINTS, BALANCE, ENGINES, PULL, MEAN, POSTURE, VELOCITY):
        assert FOUND[name].passed, name


def test_a_guess_is_not_taken_for_a_walk():
    """Its feet are centimetres off, and its ZMP is where the guess did not care."""
    assert not FOUND[FOOTHOLDS].passed
    assert not FOUND[ZMP].passed


def test_the_grid_is_ten_times_finer_than_the_constrained_one(monkeypatch):
    asked, original = [], Gait.instants

    def spy(gait, t):
        asked.append(t)
        return original(gait, t)

    monkeypatch.setattr(Gait, "instants", spy)
    for per_interval in (1, 3):
        task = scenario(dynamics_per_interval=per_interval)
        verify(Gait(task, GAIT.breaks, GAIT.control_points))
    assert [len(t) - 1 for t in asked] == [120, 360]
    assert [t[-1] for t in asked] == [GAIT.step_time] * 2


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
    check = room._zmp(GAIT.plan, aside)
    assert not check.passed
    assert 0.4 < check.value < 0.55


def test_a_torque_of_another_engine_is_seen():
    now = instants()
    torques = room._recursion(GAIT, now)
    assert room._torques(now, torques).passed
    scaled = dataclasses.replace(now, tau=now.tau * (1 + 1e-6))
    assert not room._torques(scaled, torques).passed


@pytest.mark.parametrize(
    "wrong",
    [
        lambda now: {"grf": 1.001 * now.grf},
        lambda now: {"cop": now.cop + 1e-3 * np.array([1.0, 0.0, 0.0])},
        lambda now: {"yaw_moment": now.yaw_moment + 1.0},
        lambda now: {"q": now.q + 1e-3},
        lambda now: {"a": now.a + 1e-2},
    ],
    ids=["force", "pressure", "yaw moment", "posture", "acceleration"],
)
def test_a_ground_reaction_that_does_not_fit_the_motion_is_seen(wrong):
    now = dataclasses.replace(instants(), **wrong(instants()))
    assert not room._balance(GAIT, now, room._recursion(GAIT, now)).passed


def test_a_ground_that_pulls_is_seen():
    now = instants()
    grf = now.grf.copy()
    grf[7, 0, 1] = -0.01 * GAIT.plan.weight
    check = room._no_pull(GAIT, dataclasses.replace(now, grf=grf))
    assert not check.passed
    assert check.value == pytest.approx(0.01)
    assert check.time == now.t[7]


def test_a_slippery_force_is_seen():
    """Half as much again as a dry floor holds, on the left foot in the middle of the step."""
    now = instants()
    grf, k = now.grf.copy(), 12
    grf[..., [0, 2]] = 0.0
    assert room._friction(GAIT.plan, dataclasses.replace(now, grf=grf)).value == 0.0
    grf[k, 1, 2] = -1.5 * room.FRICTION * grf[k, 1, 1]
    check = room._friction(GAIT.plan, dataclasses.replace(now, grf=grf))
    assert not check.passed
    assert check.value == pytest.approx(1.5 * room.FRICTION)
    assert check.time == now.t[k]


@pytest.mark.parametrize(("foot", "k"), [(1, 12), (0, 2)])
def test_pressure_beside_a_foot_is_seen(foot, k):
    """Half of the weight 20 cm beside the middle of a foot; without load it is nothing."""
    now = instants()
    cop, grf = GAIT.plan.footholds.mean(axis=1) + np.zeros((25, 2, 3)), 0.0 * now.grf
    cop[:, 0, 2] = GAIT.plan.footholds[0, 3, 2] - 0.01  # the trailing foot stands on its toes
    grf[k, foot, 1] = 0.5 * GAIT.plan.weight
    put = dataclasses.replace(now, cop=cop, grf=grf)
    assert room._pressure(GAIT.plan, put).passed
    cop[k, foot, 0] += 0.2
    check = room._pressure(GAIT.plan, dataclasses.replace(now, cop=cop, grf=grf))
    assert not check.passed
    assert 0.14 < check.value < 0.19
    assert check.time == now.t[k]
    assert room._pressure(GAIT.plan, dataclasses.replace(now, cop=cop, grf=0.0 * grf)).passed


def test_a_ground_that_carries_too_much_is_seen():
    now = instants()
    check = room._mean_force(GAIT, dataclasses.replace(now, grf=1.02 * now.grf))
    assert not check.passed
    assert check.value == pytest.approx(0.02, abs=2e-3)


def test_an_end_that_does_not_fit_the_start_is_seen():
    """At T, q = (P_1 + 4 P_2 + P_3) / 6 and v = (P_3 - P_1) / 2h of the last three."""
    pelvis, h = index("pelvis_tz"), np.diff(GAIT.breaks)[0]
    shifted, faster = GAIT.control_points.copy(), GAIT.control_points.copy()
    shifted[-3:, pelvis] += 1e-3
    faster[-3:, pelvis] += [-1e-3, 0.0, 1e-3]
    shifted, faster = (checks_of(Gait(GAIT.scenario, GAIT.breaks, P)) for P in (shifted, faster))
    assert shifted[POSTURE].value == pytest.approx(1e-3)
    assert faster[VELOCITY].value == pytest.approx(1e-3 / h)
    assert (shifted[POSTURE].passed, shifted[VELOCITY].passed) == (False, True)
    assert (faster[POSTURE].passed, faster[VELOCITY].passed) == (True, False)


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
        assert room._distance_outside(polygon, np.array(point)) == pytest.approx(distance)


def test_values_up_to_the_limit_pass_and_nothing_else():
    check = room.Check("length", "m", 0.01, 0.01, 0.0)
    assert check.passed
    assert not dataclasses.replace(check, value=0.0101).passed
    assert not dataclasses.replace(check, value=np.nan).passed
