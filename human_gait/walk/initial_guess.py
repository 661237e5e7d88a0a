"""A first guess of the walk from the plan alone: the feet go where they must, the legs follow.

The pelvis glides at walking speed; the foot rolls over heel and ball and swings in an arc; hip,
knee and ankle follow by plane inverse kinematics. No recorded motion is used. The shares and
angles below shape a guess, not a result.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.body.person import Body
from human_gait.body.skeleton import N_DOF, SIDES, index
from human_gait.scenario import Scenario
from human_gait.walk.bspline import Basis
from human_gait.walk.contact_plan import LEFT, ContactPlan

_STRIKE, _PUSH_OFF = np.deg2rad(18.0), np.deg2rad(-55.0)  # pitch of the foot, toes up positive
_CLEARANCE = 0.035  # of the stature: extra height of the ankle at mid-swing
_CROUCH = 0.975  # height of the hips against the highest that the step allows
_BOB = 0.007  # of the stature: amplitude of the vertical motion of the pelvis
_STRETCH = 0.998  # largest extension of a leg
_ARM_SWING, _ELBOW = 0.5, np.deg2rad(20.0)
_SAMPLES = 60


def initial_guess(scenario: Scenario, body: Body, plan: ContactPlan, basis: Basis) -> FloatArray:
    """Return free control points (m, 55) of a walk that nearly meets the plan."""
    f = np.linspace(0.0, 1.0, _SAMPLES)
    q = np.zeros((_SAMPLES, N_DOF))
    hips = _hips(scenario, body, plan, f)
    q[:, index("pelvis_ty")], q[:, index("pelvis_tz")] = hips.T
    for side, since_strike in (("r", f + 1.0), ("l", f)):
        _set_leg(q, side, _leg(since_strike, hips, body, plan, side))
        q[:, index(f"hip_abduction_{side}")] = _abduction(scenario, body)
        hip = q[:, index(f"hip_flexion_{side}")]
        q[:, index(f"shoulder_flexion_{side}")] = -_ARM_SWING * (hip - hip.mean())
        q[:, index(f"elbow_flexion_{side}")] = _ELBOW
    return basis.fit(f * scenario.walk.step_time, q)


def _hips(scenario: Scenario, body: Body, plan: ContactPlan, f: FloatArray) -> FloatArray:
    """Return height and forward position (K, 2) of the hips; highest in mid-stance."""
    lengths, step = body.measures.lengths, scenario.walk.step_length
    leg = lengths["L_th"] + lengths["L_sh"]
    highest = np.sqrt(max(leg**2 - (0.35 * step) ** 2, (0.5 * leg) ** 2))
    lift = _BOB * body.subject.stature
    bob = -lift * np.cos(4 * np.pi * (f - plan.phases.double_support / 2))
    return np.stack([lengths["h_ank"] + _CROUCH * highest + bob, step * f], axis=1)


def _abduction(scenario: Scenario, body: Body) -> float:
    lengths = body.measures.lengths
    aside = scenario.walk.step_width / 2 - lengths["w_hip"]
    return float(aside / (lengths["L_th"] + lengths["L_sh"]))


def _set_leg(q: FloatArray, side: str, angles: FloatArray) -> None:
    joints = ("hip_flexion", "knee_flexion", "ankle_dorsiflexion", "toe_extension")
    q[:, [index(f"{joint}_{side}") for joint in joints]] = angles


def _leg(
    since_strike: FloatArray, hips: FloatArray, body: Body, plan: ContactPlan, side: str
) -> FloatArray:
    """Return hip, knee, ankle and toe angles (K, 4) from the steps since the foot's strike."""
    foothold = plan.ankles[SIDES.index(side), 2]
    foot = np.array([_foot(s, body, plan) for s in since_strike])
    reach = foot[:, :2] + [0.0, foothold] - hips
    thigh, shank = body.measures.lengths["L_th"], body.measures.lengths["L_sh"]
    r = np.minimum(np.hypot(*reach.T), _STRETCH * (thigh + shank))
    knee = np.pi - np.arccos(np.clip(_cosine(thigh, shank, r), -1.0, 1.0))
    hip = np.arctan2(reach[:, 1], -reach[:, 0]) + np.arccos(
        np.clip(_cosine(thigh, r, shank), -1.0, 1.0)
    )
    return np.stack([hip, knee, foot[:, 2] - (hip - knee), foot[:, 3]], axis=1)


def _cosine(a: npt.ArrayLike, b: npt.ArrayLike, opposite: npt.ArrayLike) -> FloatArray:
    """Return the cosine of the angle between sides a and b of a triangle."""
    a, b, c = np.asarray(a), np.asarray(b), np.asarray(opposite)
    return np.asarray((a**2 + b**2 - c**2) / (2 * a * b))


def _foot(s: float, body: Body, plan: ContactPlan) -> tuple[float, float, float, float]:
    """Return ankle height, ankle forward of the foothold, pitch and toe extension."""
    toe_off = 1.0 + plan.phases.double_support
    if s <= toe_off:
        return _standing(s, body, plan)
    up, ahead, pitch, toes = _standing(toe_off, body, plan)
    up_next, ahead_next, pitch_next, _ = _standing(0.0, body, plan)
    u = (s - toe_off) / (2.0 - toe_off)
    lift = _CLEARANCE * body.subject.stature * np.sin(np.pi * u) ** 2
    distance = ahead_next + 2.0 * plan.walk.step_length - ahead
    return (
        up + (up_next - up) * _ease(u) + lift,
        ahead + distance * (_ease(u) + u) / 2.0,
        pitch + (pitch_next - pitch) * _ease(u / 0.75),
        toes * (1.0 - _ease(u / 0.4)),
    )


def _standing(s: float, body: Body, plan: ContactPlan) -> tuple[float, float, float, float]:
    """Return the same for a foot that stands: it pivots on its heel, then on its ball."""
    phases, sole = plan.phases, plan.feet[LEFT]
    landing = _STRIKE * (1.0 - _ease(s / phases.foot_flat))
    leaving = _ease((s - phases.heel_off) / (1.0 + phases.double_support - phases.heel_off))
    pitch = landing + _PUSH_OFF * leaving**1.3
    up, ahead = _pivoted(pitch, sole.heel if pitch > 0 else sole.ball, body)
    return up, ahead, pitch, max(-pitch, 0.0)


def _pivoted(pitch: float, pivot: float, body: Body) -> tuple[float, float]:
    """Return where the ankle is when the foot turns about a point of its sole."""
    height = body.measures.lengths["h_ank"]
    c, s = np.cos(pitch), np.sin(pitch)
    return height * c - pivot * s, pivot - height * s - pivot * c


def _ease(u: float) -> float:
    """Return a smooth step from 0 to 1."""
    u = min(max(u, 0.0), 1.0)
    return u * u * (3.0 - 2.0 * u)
