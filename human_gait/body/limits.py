"""How far joints turn and how strong they are: Eq. (19) and what the torques of Eq. (18) weigh.

The paper prints neither: they are those of ``data/joint_limits.csv``.
"""

from __future__ import annotations

from collections.abc import Mapping
from statistics import NormalDist

import numpy as np

from human_gait import data
from human_gait.arrays import FloatArray
from human_gait.body.skeleton import (
    BRANCHES,
    DOF_NAMES,
    GRAVITY,
    MIRROR_INDEX,
    N_DOF,
    PRISMATIC,
    SIDES,
    SIDES_IN_WORDS,
    index,
    mirror,
)
from human_gait.exceptions import ScenarioError
from human_gait.scenario import Scenario, Subject

REFERENCE_STRENGTH = 100.0
"""Strength of a joint whose torques count as they are, [N m]."""

SPREAD = 0.23
"""Standard deviation of strength, of the mean: that of hip, knee and ankle (Anderson 2007)."""

_ROWS = data.rows("joint_limits")
_ARMS = [*BRANCHES["right_arm"], *BRANCHES["left_arm"]]
_KNEES = [index(f"knee_flexion_{side}") for side in SIDES]


def position_limits() -> tuple[FloatArray, FloatArray]:
    """Return the lower and the upper limits of all DOF, each (55,), [rad] and [m]."""
    unit = [np.deg2rad(1.0) if row["unit"] == "deg" else 1.0 for row in _ROWS]
    lower, upper = (np.array([float(row[side]) for row in _ROWS]) for side in ("lower", "upper"))
    return lower * unit, upper * unit


def joint_limits(scenario: Scenario) -> tuple[FloatArray, FloatArray]:
    """Return the limits of Eq. (19), each (55,): anatomy, an upright trunk, the scenario's own.

    Returns
    -------
    lower, upper : (55,) array, [rad] and [m]

    Raises
    ------
    ScenarioError
        If the scenario names a DOF that does not exist or leaves one without range.
    """
    lower, upper = position_limits()
    for i, name in enumerate(DOF_NAMES):
        middle, reach = _held(name, scenario)
        lower[i], upper[i] = max(lower[i], middle - reach), min(upper[i], middle + reach)
    for name, (low, high) in scenario.limits.ranges_si(DOF_NAMES).items():
        lower[index(name)], upper[index(name)] = low, high
    frozen = [index(name) for name in scenario.limits.frozen_dofs(DOF_NAMES)]
    lower[frozen] = upper[frozen] = 0.0
    return _on_both_sides(lower, upper)


def mirrored_limits(scenario: Scenario) -> list[str]:
    """Return in words what limits of a scenario say of more than the joint that they are given for.

    The next step is the mirror image of this one, so that a limit of one side holds for the other
    too, and of two that differ what both allow.
    """
    given = scenario.limits.ranges_si(DOF_NAMES)
    own = [*scenario.limits.frozen_dofs(DOF_NAMES), *given]
    found = []
    for name in own:
        i = index(name)
        other = DOF_NAMES[MIRROR_INDEX[i]]
        key = f"limits.{name}" if name in given else f"limits.frozen: {name}"
        ends = np.array([limit[i] for limit in joint_limits(scenario)])
        if other not in own:
            side = SIDES_IN_WORDS[SIDES.index(other[-1])]
            found.append(f"{key} holds for the {side} too, since steps are mirror images")
        elif not np.allclose(given.get(name, 0.0), ends):
            scale, unit = (1.0, "m") if PRISMATIC[i] else (np.rad2deg(1.0), "deg")
            low, high = scale * ends + 0.0
            held = f"{low:.4g} to {high:.4g} {unit}"
            found.append(f"{key} holds as {held}, since steps are mirror images")
    return found


def torque_limits(subject: Subject, deviations: float = 2.0) -> tuple[FloatArray, FloatArray]:
    """Return the lower and the upper strength limits, each (55,), [N m].

    Parameters
    ----------
    subject : Subject
        Where the source gives strength per body weight times stature, it is scaled by both.
    deviations : float
        Standard deviations above the mean strength, where the source has them: walking alone
        takes about the mean strength of the ankle.

    Returns
    -------
    tuple of (55,) arrays
        Infinite for the global DOF, which the ground reaction balances.
    """
    lower = [_strength(row, "min", -deviations, subject) for row in _ROWS]
    upper = [_strength(row, "max", deviations, subject) for row in _ROWS]
    return np.array(lower), np.array(upper)


def strength_limits(subject: Subject) -> tuple[FloatArray, FloatArray]:
    """Return how strong a person is in both directions of each DOF, two (55,) arrays, [N m].

    By the person's percentile: mean + z SD. Where the source has no SD it is `SPREAD` of the mean;
    joints whose strength nobody has measured are infinitely strong.
    """
    z = NormalDist().inv_cdf(subject.strength / 100.0)
    known = np.array([row["torque_origin"] not in ("", "assumed") for row in _ROWS])
    mean, spread = (
        [np.where(known, side, 0.0) for side in torque_limits(subject, deviations)]
        for deviations in (0.0, 1.0)
    )
    lower, upper = (
        np.where(known, weak + z * np.where(strong == weak, SPREAD * weak, strong - weak), side)
        for weak, strong, side in zip(mean, spread, (-np.inf, np.inf), strict=True)
    )
    return lower, upper


def torque_weights(scenario: Scenario) -> FloatArray:
    """Return the weights w_i (55,) of the squared torques.

    ``strength``: (100 N m / strength_i)^2, the mean strength of the joint's two directions. Effort
    is then relative to what a joint can give: 10 N m are little for a hip and much for a wrist.
    ``none``: 1, the objective of the paper. Those of the knees are times `objective.knee`,
    of the arms `objective.arms`.
    """
    weights = np.ones(N_DOF)
    if scenario.objective.weighting == "strength":
        lower, upper = torque_limits(scenario.subject, deviations=0.0)
        weights = (2.0 * REFERENCE_STRENGTH / (upper - lower)) ** 2
    weights[_KNEES] *= scenario.objective.knee
    weights[_ARMS] *= scenario.objective.arms
    return weights


def _on_both_sides(lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the limits that a posture keeps together with its mirror image, the next step's."""
    ends, given = (mirror(lower), mirror(upper)), np.stack([lower, upper])
    lower, upper = np.maximum(lower, np.minimum(*ends)), np.minimum(upper, np.maximum(*ends))
    for i in np.flatnonzero(lower > upper):
        remedy = "one with 0 in it" if MIRROR_INDEX[i] == i else "the same on both sides"
        allowed = f"leaves no range that a walk and its mirror image share; try {remedy}"
        value = [
            float(f"{end:.4g}") for end in given[:, i] * (1.0 if PRISMATIC[i] else np.rad2deg(1.0))
        ]
        raise ScenarioError(f"limits.{DOF_NAMES[i]}", allowed, value)
    return lower, upper


def _held(name: str, scenario: Scenario) -> tuple[float, float]:
    """Return the middle of a DOF of the upper body, and how far it may depart from it, [rad]."""
    posture = scenario.posture
    ranges = {
        "pelvis_r": (0.0, posture.pelvis_deg),
        "spine": (0.0, posture.spine_deg),
        "neck": (0.0, posture.neck_deg),
        "clavicle": (0.0, posture.arms_deg / 3.0),
        "shoulder": (0.0, posture.arms_deg),
        "elbow": (20.0, posture.arms_deg),
        "forearm": (0.0, posture.arms_deg),
        "wrist": (0.0, posture.arms_deg),
    }
    held = [ranges[part] for part in ranges if name.startswith(part)]
    middle, reach = np.deg2rad(held[0]) if held else (0.0, np.inf)
    return float(middle), float(reach)


def _strength(row: Mapping[str, str], side: str, deviations: float, subject: Subject) -> float:
    if not row["torque_unit"]:
        return float("-inf") if side == "min" else float("inf")
    unit = subject.mass * GRAVITY * subject.stature if row["torque_unit"] == "BW H" else 1.0
    return unit * (float(row[f"torque_{side}"]) + deviations * float(row[f"torque_{side}_sd"]))
