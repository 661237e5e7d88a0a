"""The guess is near the plan for people and walks of all kinds, without any recorded motion."""

import numpy as np
import pytest
from walks import PEOPLE, scenario

from human_gait.body.limits import joint_limits
from human_gait.body.skeleton import N_DOF, index
from human_gait.problem.program import build_program
from human_gait.walk.bspline import Basis
from human_gait.walk.cycle import step_cycle
from human_gait.walk.initial_guess import initial_guess
from human_gait.walk.instant import Walker

WALKS = {
    **PEOPLE,
    "slow": scenario(0.8, 0.5),
    "fast": scenario(1.6, 0.74),
    "long steps": scenario(1.2, 0.75),
    "short steps": scenario(1.0, 0.5),
    "narrow": scenario(step_width=0.05),
    "wide": scenario(step_width=0.2),
    "six control points": scenario(control_points=6),
    "many control points": scenario(control_points=14, intervals=24),
    "short double support": scenario(phases={"double_support": 0.18, "foot_flat": 0.12}),
}


@pytest.fixture(params=WALKS.values(), ids=WALKS, scope="module")
def program(request):
    return build_program(request.param)


@pytest.fixture(scope="module")
def gait(program):
    return program.gait(program.guess())


@pytest.fixture(scope="module")
def now(gait):
    return gait.instants(np.linspace(0.0, gait.step_time, 60, endpoint=False))


def test_it_is_finite(program):
    assert np.all(np.isfinite(program.guess()))


def test_standing_points_are_near_their_footholds(gait, now):
    """5 cm: near enough that the posture stage needs a few dozen evaluations."""
    distance = np.linalg.norm(now.points - gait.plan.footholds, axis=-1)
    assert distance[gait.plan.contact(now.t)].max() < 0.05


def test_no_foot_is_deep_in_the_ground(now):
    assert now.points[..., 1].min() > -0.05


def test_joints_are_within_their_limits(program, now):
    lower, upper = joint_limits(program.scenario)
    rotations = slice(3, None)
    assert np.all(now.q[:, rotations] >= lower[rotations] - 1e-12)
    assert np.all(now.q[:, rotations] <= upper[rotations] + 1e-12)


def test_the_pelvis_glides_at_walking_speed(program, now):
    speed = now.v[:, index("pelvis_tz")]
    np.testing.assert_allclose(speed, program.scenario.walk.speed, rtol=0.02)


def test_the_swinging_knee_bends_and_does_not_bend_backwards(now):
    knee = now.q[:, index("knee_flexion_r")]
    assert np.deg2rad(40) < knee.max() < np.deg2rad(85)
    assert now.q[:, [index("knee_flexion_r"), index("knee_flexion_l")]].min() > -1e-12


def test_arms_swing_against_the_legs(now):
    for side in "rl":
        arm, leg = (now.q[:, index(f"{j}_{side}")] for j in ("shoulder_flexion", "hip_flexion"))
        assert np.corrcoef(arm, leg)[0, 1] < -0.9


def test_it_does_not_push_itself_off_the_ground(now):
    assert now.grf[..., 1].sum(axis=1).min() > 0.0


def test_it_is_the_spline_nearest_to_the_plan():
    """The finer the spline, the closer the feet come to what the plan says."""
    worst = []
    for control_points in (6, 10, 20):
        walker = Walker(scenario())
        basis = Basis.uniform(step_cycle(walker.plan.walk), control_points)
        free = initial_guess(scenario(), walker.body, walker.plan, basis)
        assert free.shape == (control_points - 3, N_DOF)
        gait = build_program(scenario(control_points=control_points, intervals=20)).gait(
            free.ravel()
        )
        now = gait.instants(np.linspace(0.0, gait.step_time, 40, endpoint=False))
        distance = np.linalg.norm(now.points - gait.plan.footholds, axis=-1)
        worst.append(distance[gait.plan.contact(now.t)].max())
    assert worst[0] > worst[1] > worst[2]
