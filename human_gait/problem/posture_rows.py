"""How the walker holds itself: pelvis, knee, arms, Eqs. (23), (25), (27), and its strength."""

from __future__ import annotations

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.limits import strength_limits
from human_gait.body.skeleton import DOF_NAMES, N_DOF, SIDES_IN_WORDS, in_words, index
from human_gait.problem.residual import Constraint, Demand, Residual, Tolerance, same_words
from human_gait.scenario import Scenario
from human_gait.walk.adjoint import Adjoint, Block
from human_gait.walk.instant import Instants

PELVIC_VELOCITY = Demand(
    name="pelvic velocity",
    equation="23",
    meaning="the pelvis has to keep to the walking speed",
    tolerance=Tolerance("pelvis_speed", upwards=True),
)
KNEE_AT_MID_SWING = Demand(
    name="knee at mid-swing",
    equation="25",
    meaning="the swinging knee has to bend by 60 deg",
    tolerance=Tolerance("knee_flexion_deg", upwards=True),
)
ARM_LEG_COUPLING = Demand(
    name="arm-leg coupling",
    equation="27",
    meaning="arms have to swing against the legs",
    tolerance=Tolerance("arm_leg", upwards=True),
)

STRENGTH = Demand(
    name="strength",
    meaning="muscles are as strong as the person's",
)

_PELVIS = index("pelvis_tz")
_STRENGTH_USED = 0.95  # at the constrained instants: between them it is more


def pelvic_velocity(scenario: Scenario, on: IntArray) -> Constraint:
    """The pelvis moves forward at the walking speed, Eq. (23)."""
    tolerance = np.full(len(on), scenario.tolerances.pelvis_speed)
    speed, one = scenario.walk.speed, np.ones((len(on), 1))

    def evaluate(now: Instants) -> Residual:
        return Residual(now.v[on, _PELVIS] - speed, 0 * one, one, 0 * one)

    def to_adjoint(_: Instants, __: FloatArray, curvature: FloatArray, adjoint: Adjoint) -> None:
        adjoint.velocity_second[on, _PELVIS] += curvature

    return Constraint(
        demand=PELVIC_VELOCITY,
        unit="m/s",
        lower=-tolerance,
        upper=tolerance,
        instants=on,
        columns=np.full((len(on), 1), _PELVIS),
        what=same_words(on, "pelvis, forward"),
        evaluate=evaluate,
        to_adjoint=to_adjoint,
        linear=True,
    )


def knee_at_mid_swing(scenario: Scenario, times: FloatArray) -> Constraint:
    """The knee of the swing leg is bent by 60 degrees at mid-swing, Eq. (25)."""
    knee = index("knee_flexion_r")
    middle = scenario.phases.mid_swing * scenario.walk.step_time
    k = np.array([np.argmin(np.abs(times - middle))])
    tolerance, one = np.deg2rad([scenario.tolerances.knee_flexion_deg]), np.ones((1, 1))

    def evaluate(now: Instants) -> Residual:
        return Residual(now.q[k, knee] - np.deg2rad(60.0), one, 0 * one, 0 * one)

    def to_adjoint(_: Instants, __: FloatArray, curvature: FloatArray, adjoint: Adjoint) -> None:
        adjoint.own[k, 0, knee] += curvature

    return Constraint(
        demand=KNEE_AT_MID_SWING,
        unit="rad",
        lower=-tolerance,
        upper=tolerance,
        instants=k,
        columns=np.array([[knee]]),
        what=same_words(k, "right knee, flexion"),
        evaluate=evaluate,
        to_adjoint=to_adjoint,
        linear=True,
    )


def within_strength(scenario: Scenario, times: FloatArray) -> Constraint:
    """No muscle torque is beyond the person's strength, in both directions of each joint."""
    lower, upper = strength_limits(scenario.subject)
    joints = np.flatnonzero(np.isfinite(lower))
    k, i = np.repeat(np.arange(len(times)), len(joints)), np.tile(joints, len(times))

    def evaluate(now: Instants) -> Residual:
        return Residual(now.muscle_torque[k, i], *np.split(now.muscle_partials[k, i], 3, axis=1))

    def to_adjoint(
        _: Instants, multipliers: FloatArray, curvature: FloatArray, adjoint: Adjoint
    ) -> None:
        adjoint.torque[:, joints] += multipliers.reshape(len(times), -1)
        adjoint.torque_second[:, joints] += curvature.reshape(len(times), -1)

    return Constraint(
        demand=STRENGTH,
        unit="N m",
        lower=_STRENGTH_USED * lower[i],
        upper=_STRENGTH_USED * upper[i],
        instants=k,
        columns=np.tile(np.arange(N_DOF), (len(k), 1)),
        what=np.tile([in_words(DOF_NAMES[joint]) for joint in joints], len(times)),
        evaluate=evaluate,
        to_adjoint=to_adjoint,
    )


def arm_leg_coupling(scenario: Scenario, on: IntArray) -> Constraint:
    """Arm and leg of a side swing in opposite directions, Eq. (27): product of flexions <= 0.

    Relaxed by a small amount: where both angles pass zero together the gradient vanishes.
    """
    joints = ("shoulder_flexion", "hip_flexion")
    pairs = np.array([[index(f"{joint}_{side}") for joint in joints] for side in "rl"])
    k = np.repeat(on, 2)
    columns = np.tile(pairs, (len(on), 1))
    upper = np.full(len(k), scenario.tolerances.arm_leg)

    def evaluate(now: Instants) -> Residual:
        angles = now.q[k[:, None], columns]
        dq = angles[:, ::-1]  # d(x y) = y dx + x dy
        return Residual(angles.prod(axis=1), dq, 0.0 * dq, 0.0 * dq)

    def to_adjoint(
        now: Instants, multipliers: FloatArray, curvature: FloatArray, adjoint: Adjoint
    ) -> None:
        for side, joints_of in enumerate(pairs):
            rows = slice(side, None, len(pairs))
            dq = now.q[on[:, None], joints_of[::-1]]
            second = np.zeros((len(now.q), 2, 2))
            second[on] = (curvature[rows, None] * dq)[:, :, None] * dq[:, None]
            second[on] += multipliers[rows, None, None] * (1.0 - np.eye(2))
            adjoint.blocks.append(Block(joints_of, second))

    return Constraint(
        demand=ARM_LEG_COUPLING,
        unit="rad^2",
        lower=upper - np.inf,
        upper=upper,
        instants=k,
        columns=columns,
        what=np.tile([f"{side} shoulder against {side} hip" for side in SIDES_IN_WORDS], len(on)),
        evaluate=evaluate,
        to_adjoint=to_adjoint,
    )
