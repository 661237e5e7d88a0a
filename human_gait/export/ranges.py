"""How far, how fast and how hard joints move, for formats with a place for it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from human_gait.arrays import BoolArray, FloatArray
from human_gait.body.limits import joint_limits, position_limits, torque_limits
from human_gait.body.skeleton import DOF_NAMES, DOF_UNITS
from human_gait.scenario import Scenario, Subject
from human_gait.values import Value
from human_gait.walk.gait import Samples

_ROUNDING = 1e-6  # [rad], [m]: a motion that is beyond a limit by less than this is at the limit
_NARROWEST = 1e-12  # [rad], [m]: MuJoCo takes a range of no width for none
_VELOCITY = 100.0  # [rad/s], [m/s]: none is known, and URDF demands one


@dataclass(frozen=True, eq=False, repr=False)
class JointRanges(Value):
    """The ranges of all joints.

    Attributes
    ----------
    lower, upper : (55,) array, [rad], [m]
    effort : (55,) array, [N m], [N]
        The greatest strength, more where the motion takes more; 0 for the pelvis' own six, which
        nothing drives.
    velocity : (55,) array, [rad/s], [m/s]
    held : (55,) bool array
        What is held in its place.
    of_position, of_drive : tuple of str
        What a reader has to know of the limits of position, and of those of effort and velocity.
    """

    lower: FloatArray
    upper: FloatArray
    effort: FloatArray
    velocity: FloatArray
    held: BoolArray
    of_position: tuple[str, ...]
    of_drive: tuple[str, ...]


def joint_ranges(
    subject: Subject, scenario: Scenario | None = None, motion: Samples | None = None
) -> JointRanges:
    """Return the ranges of a person's joints: a scenario's own, else those of the anatomy.

    Parameters
    ----------
    subject : Subject
    scenario : Scenario, optional
    motion : Samples, optional
        The motion that stands beside them: limits hold it, or the words say why not.
    """
    lower, upper = joint_limits(scenario) if scenario else position_limits()
    strength = np.abs(torque_limits(subject)).max(axis=0)
    driven = np.isfinite(strength)
    effort, velocity = np.where(driven, strength, 0.0), np.full(len(DOF_NAMES), _VELOCITY)
    held = lower == upper
    lower, upper = np.where(held, [lower - _NARROWEST, upper + _NARROWEST], [lower, upper])
    of_position, of_drive = _held(held), [_STRENGTH, _UNDRIVEN, _NO_VELOCITY]
    if motion is not None:
        of_position += _beyond(motion.q, lower, upper)
        lower, upper = _rounded_out(motion.q, lower, upper)
        peak = np.where(driven, np.abs(motion.tau).max(axis=0), 0.0)
        of_drive += _stronger(peak, effort)
        effort = np.where(peak > effort, np.ceil(peak * 10.0) / 10.0, effort)
        velocity = np.maximum(velocity, np.ceil(np.abs(motion.v).max(axis=0)))
    return JointRanges(lower, upper, effort, velocity, held, tuple(of_position), tuple(of_drive))


_STRENGTH = "effort: the greatest strength of the joint in either sense; a walk may take more"
_UNDRIVEN = (
    "effort 0: nothing drives the six joints of the pelvis; the ground reaction, which is no part "
    "of this file, holds the body"
)
_NO_VELOCITY = f"velocity {_VELOCITY:g}: no limit is known, and the format demands one"


def _held(held: BoolArray) -> list[str]:
    names = _listed(DOF_NAMES[i] for i in np.flatnonzero(held))
    return [f"held in place (a range of no width): {names}"] if names else []


def _beyond(q: FloatArray, lower: FloatArray, upper: FloatArray) -> list[str]:
    """Return which joints a motion (K, 55) takes beyond their limits, and by how much."""
    over = np.maximum(lower - q, q - upper).max(axis=0)
    joints = [
        f"{DOF_NAMES[i]} by {over[i]:.3g} {DOF_UNITS[i]}" for i in np.flatnonzero(over > _ROUNDING)
    ]
    return [f"the motion passes limits of position: {_listed(joints)}"] if joints else []


def _rounded_out(
    q: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return limits that hold what is at them to the last digit."""
    least, most = q.min(axis=0), q.max(axis=0)
    return (
        np.where(lower - least < _ROUNDING, np.minimum(lower, least), lower),
        np.where(most - upper < _ROUNDING, np.maximum(upper, most), upper),
    )


def _stronger(peak: FloatArray, strength: FloatArray) -> list[str]:
    joints = [
        f"{DOF_NAMES[i]} {peak[i]:.4g} N m (strength {strength[i]:.4g})"
        for i in np.flatnonzero(peak > strength)
    ]
    words = "the motion takes more effort than the greatest strength, and the limit holds it"
    return [f"{words}: {_listed(joints)}"] if joints else []


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names)
