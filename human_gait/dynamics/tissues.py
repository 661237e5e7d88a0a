"""Torques of the tissues around the joints, which no muscle has to pay for.

Hip, knee and ankle in the sagittal plane: the elastic moments of Riener and Edrich (1999),
J Biomech 32:539-544, which couple the joints through the muscles that span two of them. All other
joints: linear stiffness and damping of ``data/passive_joints.csv``, ``measured`` or the softer ones
of the first versions, ``tissue``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from human_gait import data
from human_gait.arrays import FloatArray
from human_gait.body.skeleton import DOF_NAMES, SIDES, index

# Moments exp(c0 + ch hip + ck knee + ca ankle), angles in degrees, flexion and dorsiflexion
# positive, and a constant; positive moments flex (ankle: dorsiflex). [N m]
_TERMS = (
    (0, 1, 1.4655, -0.0750, -0.0034, 0.0),  # hip
    (0, -1, 1.3403, 0.0305, -0.0226, 0.0),
    (1, 1, 1.800, 0.0217, -0.0352, 0.0460),  # knee
    (1, -1, -3.971, -0.0128, 0.0495, 0.0004),
    (1, 1, 2.220, 0.0, -0.150, 0.0),
    (2, 1, -7.9763, 0.0, 0.0008, -0.1949),  # ankle
    (2, -1, 2.1016, 0.0, -0.0176, 0.0843),
)
_CONSTANTS = np.array([8.072, -4.820, 1.792])
_OF_JOINT = np.eye(3)[[term[0] for term in _TERMS]]  # (7, 3)
_SIGN, _AT_ZERO = np.array(_TERMS)[:, 1:3].T
_SLOPES = np.rad2deg(np.array(_TERMS)[:, 3:])  # (7, 3), by radians

_SAGITTAL = ("hip_flexion", "knee_flexion", "ankle_dorsiflexion")
_LEGS = np.array([[index(f"{joint}_{side}") for joint in _SAGITTAL] for side in SIDES])


@dataclass(frozen=True, eq=False)
class PassiveTorque:
    """Torques of tissues at K instants.

    Attributes
    ----------
    value : (K, 55) array, [N m]
    by_angle, by_velocity : (55,) array
        Slopes of each by its own joint, without those of the muscles that span two.
    sagittal : (K, 2, 3, 3) array
        Further slopes, of hip, knee and ankle of both legs by these.
    """

    value: FloatArray
    by_angle: FloatArray
    by_velocity: FloatArray
    sagittal: FloatArray

    def gradient(self, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the gradient (K, 55) by q, and that by v, of torques weighted by (K, 55)."""
        by_q = weights * self.by_angle
        for f, leg in enumerate(_LEGS):
            by_q[:, leg] += (weights[:, None, leg] @ self.sagittal[:, f])[:, 0]
        return by_q, weights * self.by_velocity

    def subtract_from(self, partials: FloatArray, joints: slice, first: int) -> None:
        """Subtract the slopes of some joints from partials (K, j, 3, c) of theirs, in place.

        The c DOF are any and, from the `first` one on, these joints.
        """
        n = partials.shape[1]
        own, place = np.arange(n), first + np.arange(n)
        partials[:, own, 0, place] -= self.by_angle[joints]
        partials[:, own, 1, place] -= self.by_velocity[joints]
        for f, leg in enumerate(_LEGS):
            inner = leg - joints.start
            if inner.min() >= 0 and inner.max() < n:
                partials[:, inner[:, None], 0, first + inner] -= self.sagittal[:, f]

    def add_squares(self, weights: FloatArray, own: FloatArray, lower: FloatArray) -> None:
        """Add the second derivatives J^T w J of squares of the torques, weights (K, 55), in place.

        To those of single DOF (K, 3, 55), by q twice, q and v, v twice; what couples joints of the
        legs to those of the first DOF (3, K, n, n).
        """
        if not weights.any():
            return
        k, d = self.by_angle, self.by_velocity
        own += weights[:, None] * np.stack([k * k, k * d, d * d])
        for f, leg in enumerate(_LEGS):
            J, w = self.sagittal[:, f], weights[:, leg, None]
            on = slice(None), leg[:, None], leg
            mixed = J.swapaxes(1, 2) * (weights[:, leg] * k[leg])[:, None]  # J^T w k
            lower[0][on] += J.swapaxes(1, 2) @ (w * J) + mixed + mixed.swapaxes(1, 2)
            lower[1][on] += J.swapaxes(1, 2) * (weights[:, leg] * d[leg])[:, None]


class PassiveJoints:
    """Passive torques of all joints; none for the global DOF.

    Parameters
    ----------
    kind : str
        ``tissue`` or ``measured``, as `Objective.passive_torques`.
    """

    def __init__(self, kind: str = "tissue") -> None:
        rows = {row["joint"]: row for row in data.rows("passive_joints")}
        chosen = [_row(rows, name) for name in DOF_NAMES]
        prefix = "measured_" if kind == "measured" else ""
        columns = (_column(chosen, prefix + key) for key in ("stiffness", "damping"))
        self.stiffness, self.damping = columns
        self.rest = np.deg2rad(_column(chosen, "rest_deg"))

    def torque(self, q: FloatArray, v: FloatArray) -> PassiveTorque:
        """Return the passive torques at q, v (K, 55)."""
        value = -self.stiffness * (q - self.rest) - self.damping * v
        moments = _moments(q)
        value[:, _LEGS] += moments @ _OF_JOINT + _CONSTANTS
        slopes = (moments[..., None, :] * _OF_JOINT.T) @ _SLOPES
        return PassiveTorque(value, -self.stiffness, -self.damping, slopes)

    def add_hessian(self, q: FloatArray, weights: FloatArray, into: FloatArray) -> None:
        """Add the second derivatives by q of the torques weighted by (K, 55), in place.

        To those by the first DOF (K, n, n), legs among them: others have none.
        """
        sizes = (weights[:, _LEGS] @ _OF_JOINT.T) * _moments(q)  # of each term (K, 2, 7)
        curved = (sizes[..., None, :] * _SLOPES.T) @ _SLOPES
        for f, leg in enumerate(_LEGS):
            into[:, leg[:, None], leg] += curved[:, f]


def no_torque(q: FloatArray) -> PassiveTorque:
    """Return no passive torques (K, 55): muscles pay for all."""
    none, slopes = np.zeros(q.shape[1]), np.zeros((len(q), len(_LEGS), 3, 3))
    return PassiveTorque(0.0 * q, none, none, slopes)


def _moments(q: FloatArray) -> FloatArray:
    """Return the exponential moments of both legs (K, 2, 7) at q (K, 55)."""
    return np.asarray(_SIGN * np.exp(_AT_ZERO + q[:, _LEGS] @ _SLOPES.T))


def _row(rows: Mapping[str, Mapping[str, str]], name: str) -> Mapping[str, str] | None:
    """Return the row of a DOF: of its joint, or of all of its kind; none of the global ones."""
    joint = name.removesuffix("_r").removesuffix("_l")
    kind = "".join(sign for sign in joint if not sign.isdigit())
    return rows.get(joint, rows.get(kind))


def _column(rows: list[Mapping[str, str] | None], key: str) -> FloatArray:
    return np.array([float(row[key]) if row else 0.0 for row in rows])
