"""Power and work of the joints, as gait laboratories have them.

The power of a degree of freedom is P = tau v, tau the net joint torque: muscles and passive tissues
together. Work is the integral of its positive and of its negative part over one step, each degree
of freedom by itself; a stride has twice as much.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import DOF_NAMES

if TYPE_CHECKING:
    from human_gait.walk.gait import Samples

_PARTS = {  # how names of degrees of freedom begin
    "hip": ("hip_",),
    "knee": ("knee_",),
    "ankle": ("ankle_",),
    "toes": ("toe_",),
    "spine": ("spine",),
    "neck": ("neck_",),
    "shoulder": ("clavicle_", "shoulder_"),
    "elbow": ("elbow_",),
    "wrist": ("forearm_", "wrist_"),
}

JOINTS: Mapping[str, IntArray] = {
    joint: np.array([i for i, name in enumerate(DOF_NAMES) if name.startswith(beginnings)])
    for joint, beginnings in _PARTS.items()
}
"""Indices of the degrees of freedom of each joint, of both sides together."""

LEG = ("hip", "knee", "ankle")
"""Joints that share the work of the leg in the literature."""


@dataclass(frozen=True)
class JointWork:
    """Work of a joint, of both sides together, in one step.

    Attributes
    ----------
    joint : str
        One of ``JOINTS``.
    positive, negative : float, [J]
        Energy that the joint gives, and, below zero, what it takes up.
    """

    joint: str
    positive: float
    negative: float


def joint_power(now: Samples) -> FloatArray:
    """Return the power (K, 55) of the joints, [W]; that of the global DOF is zero."""
    return now.tau * now.v


def joint_work(now: Samples) -> tuple[JointWork, ...]:
    """Return the work of all joints over the time of some samples, which is to be one step."""
    power = joint_power(now)
    up, down = (np.trapezoid(part(power, 0.0), now.t, axis=0) for part in (np.maximum, np.minimum))
    return tuple(
        JointWork(joint, float(up[dofs].sum()), float(down[dofs].sum()))
        for joint, dofs in JOINTS.items()
    )
