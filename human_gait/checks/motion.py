"""The motion: feet that stand stay, feet that swing pass, and the walk is the one asked for."""

from __future__ import annotations

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.limits import joint_limits, strength_limits
from human_gait.body.skeleton import SIDES, index
from human_gait.checks.check import BETWEEN, EQUAL, Check, Claim, Kind
from human_gait.checks.engines import Mechanics
from human_gait.walk.contact_plan import HEEL, LEFT, RIGHT, TOE, ContactPlan
from human_gait.walk.gait import Gait, Samples, onward
from human_gait.walk.gait_file import Record

FEET = Claim("feet off Drake's", "m", Kind.LAWS)
FOOTHOLDS = Claim("standing points off their footholds", "m", Kind.INSTANTS, "20, 21")
RESTING = Claim("speed of standing points", "m/s", Kind.INSTANTS, "24")
SLIDING = Claim("foot sliding while it stands", "m", Kind.INSTANTS)
PASSING = Claim("feet too close in passing", "m", Kind.PASSING)
DEPTH = Claim("depth below the ground", "m", Kind.INSTANTS, "20")
JOINTS = Claim("joint limits exceeded", "deg", Kind.WALK, "19")
PELVIS = Claim("limits of the pelvis exceeded", "m", Kind.WALK, "19")
SPEED = Claim("pelvis off the walking speed", "m/s", Kind.INSTANTS, "23")
KNEE = Claim("knee off 60 deg at mid-swing", "deg", Kind.WALK, "25")
ARMS = Claim("arms swinging with the legs", "rad2", Kind.INSTANTS, "27")
STRENGTH = Claim("muscle torque against strength", "of strength", Kind.STRENGTH)
POSTURE = Claim("posture not periodic", "rad, m", Kind.WALK, "26")
VELOCITY = Claim("velocity not periodic", "rad/s, m/s", Kind.TIES, "26")

_ANKLE_BREADTH = 0.06  # [m]


def feet_checks(record: Record, found: Mechanics) -> list[Check]:
    """Feet stand still on their footholds, pass each other, and are never below the ground."""
    gait, now = record.gait, record.samples
    depth = np.maximum(-now.points[..., 1], 0.0)
    return [
        FEET.apart(now.points, found.points, now.t),
        on_footholds(gait.plan, now, record.footholds),
        soft_impact(gait, now, found),
        slip(gait, now),
        crossing(gait.plan, now),
        DEPTH.worst(0.01, depth, now.t),  # Eq. (20)
    ]


def on_footholds(plan: ContactPlan, now: Samples, footholds: FloatArray) -> Check:
    """Points that stand are where they were put down, Eq. (21)."""
    distance = np.linalg.norm(now.points - footholds, axis=-1)
    standing = np.where(plan.contact(now.t), distance, 0.0)
    return FOOTHOLDS.worst(0.01, standing, now.t)


def soft_impact(gait: Gait, now: Samples, found: Mechanics) -> Check:
    """Points that stand hardly move, Eq. (24)."""
    limit = BETWEEN * gait.scenario.tolerances.contact_speed
    allowed = BETWEEN * gait.plan.allowed_speed(now.t)
    beyond = np.abs(found.velocities).max(axis=-1) * limit / allowed
    standing = np.where(gait.plan.contact(now.t), beyond, 0.0)
    return RESTING.worst(limit, standing, now.t)


def crossing(plan: ContactPlan, now: Samples) -> Check:
    """The swing foot passes beside the standing leg: heels and toe tips keep its breadth apart."""
    apart = now.points[:, LEFT, :, 0] - now.points[:, RIGHT, :, 0]
    short = np.maximum(_ANKLE_BREADTH - apart[:, [HEEL, TOE]].min(axis=1), 0.0)
    swing = ~plan.double_support(now.t)
    return PASSING.worst(0.015, np.where(swing, short, 0.0), now.t)


def slip(gait: Gait, now: Samples) -> Check:
    """A point does not slide from where it touched the ground, over the whole stance of a foot.

    The left foot stands through this step and, trailing, through the double support of the next.
    """
    second = onward(now, np.ones(len(now.t), dtype=int), gait.cycle)
    points = np.concatenate([now.points[:, LEFT], second.points[:, LEFT]])
    leading, trailing = gait.plan.contact(now.t).swapaxes(0, 1)[::-1]
    standing = np.concatenate([leading, trailing])
    first = points[np.argmax(standing, axis=0), np.arange(points.shape[1])]
    slid = np.linalg.norm((points - first)[..., [0, 2]], axis=-1)
    times = np.concatenate([now.t, now.t + gait.step_time])
    return SLIDING.worst(0.015, np.where(standing, slid, 0.0), times)


def walk_checks(gait: Gait, now: Samples) -> list[Check]:
    """Joints keep their limits, the pelvis its speed, the knee and the arms their part."""
    return [
        *within_limits(gait, now),
        pelvis_speed(gait, now),
        *([knee(gait, now)] if gait.scenario.posture.swing_knee == "bent" else []),
        arms(gait, now),
        *([strength(gait, now)] if gait.scenario.posture.torques == "strength" else []),
        *periodicity(gait, now),
    ]


def within_limits(gait: Gait, now: Samples) -> list[Check]:
    """Joint angles stay within their limits, and the pelvis aside and in height, Eq. (19)."""
    lower, upper = joint_limits(gait.scenario)
    outside = np.maximum(np.maximum(lower - now.q, now.q - upper), 0.0)
    return [
        JOINTS.worst(EQUAL, np.rad2deg(outside[:, 3:]), now.t),
        PELVIS.worst(EQUAL, outside[:, 1:3], now.t),
    ]


def strength(gait: Gait, now: Samples) -> Check:
    """No muscle gives more than the person can, in either direction of a joint."""
    lower, upper = strength_limits(gait.scenario.subject)
    return STRENGTH.worst(1.0, np.maximum(now.active / lower, now.active / upper), now.t)


def pelvis_speed(gait: Gait, now: Samples) -> Check:
    """The pelvis moves forward at the walking speed, Eq. (23)."""
    off = np.abs(now.v[:, index("pelvis_tz")] - gait.scenario.walk.speed)
    limit = BETWEEN * gait.scenario.tolerances.pelvis_speed
    return SPEED.worst(limit, off, now.t)


def knee(gait: Gait, now: Samples) -> Check:
    """The knee of the swing leg is bent by 60 degrees at mid-swing, Eq. (25)."""
    middle = gait.scenario.phases.mid_swing * gait.step_time
    k = int(np.argmin(np.abs(now.t - middle)))
    off = np.abs(np.rad2deg(now.q[k : k + 1, index("knee_flexion_r")]) - 60.0)
    limit = BETWEEN * gait.scenario.tolerances.knee_flexion_deg
    return KNEE.worst(limit, off, now.t[k : k + 1])


def arms(gait: Gait, now: Samples) -> Check:
    """Arm and leg of a side swing in opposite directions, Eq. (27)."""
    flexions = [
        [now.q[:, index(f"{joint}_{side}")] for joint in ("shoulder_flexion", "hip_flexion")]
        for side in SIDES
    ]
    together = np.maximum([arm * leg for arm, leg in flexions], 0.0).T
    limit = BETWEEN * gait.scenario.tolerances.arm_leg
    return ARMS.worst(limit, together, now.t)


def periodicity(gait: Gait, now: Samples) -> list[Check]:
    """Step joins step, and the stride closes: q(T) = mirror(q(0)) + L, q(2T) = q(0) + 2L, Eq. (26).

    With the next step the mirror image, what is left at 2T is what was left at T, mirrored.
    """
    cycle = gait.cycle
    posture = np.abs(now.q[-1] - cycle.turned(now.q[0]) - cycle.advance).max()
    velocity = np.abs(now.v[-1] - cycle.turned(now.v[0])).max()
    T = gait.step_time
    return [
        POSTURE.found(float(posture), 1e-6, T),
        VELOCITY.found(float(velocity), 1e-6, T),
    ]
