"""Torques of the tissues around the joints, which no muscle has to pay for.

Hip, knee and ankle in the sagittal plane: the elastic moments of Riener and Edrich (1999),
J Biomech 32:539-544, which couple the joints through the muscles that span two of them. All other
joints: linear stiffness and damping of ``data/passive_joints.csv``, ``measured`` or the softer ones
of the first versions, ``tissue``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from human_gait import data
from human_gait.arrays import FloatArray
from human_gait.body.skeleton import DOF_NAMES, N_DOF, SIDES, index
from human_gait.dynamics.jet import Linearised

# Moments exp(c0 + ch hip + ck knee + ca ankle), angles in degrees, flexion and dorsiflexion
# positive, and a constant; positive moments flex (ankle: dorsiflex). [N m]
_HIP = (((1, 1.4655, -0.0750, -0.0034, 0.0), (-1, 1.3403, 0.0305, -0.0226, 0.0)), 8.072)
_KNEE = (
    (
        (1, 1.800, 0.0217, -0.0352, 0.0460),
        (-1, -3.971, -0.0128, 0.0495, 0.0004),
        (1, 2.220, 0.0, -0.150, 0.0),
    ),
    -4.820,
)
_ANKLE = (((1, -7.9763, 0.0, 0.0008, -0.1949), (-1, 2.1016, 0.0, -0.0176, 0.0843)), 1.792)

_SAGITTAL = ("hip_flexion", "knee_flexion", "ankle_dorsiflexion")
_LEGS = tuple(np.array([index(f"{joint}_{side}") for joint in _SAGITTAL]) for side in SIDES)


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

    def torque(self, q: FloatArray, v: FloatArray) -> Linearised:
        """Return the passive torques (K, 55), [N m], at q, v (K, 55)."""
        value = -self.stiffness * (q - self.rest) - self.damping * v
        partials = np.zeros((*q.shape, 3 * N_DOF))
        i = np.arange(N_DOF)
        partials[:, i, i], partials[:, i, N_DOF + i] = -self.stiffness, -self.damping
        for leg in _LEGS:
            moments, slopes = _sagittal(q[:, leg])
            value[:, leg] += moments
            partials[:, leg[:, None], leg] += slopes
        return Linearised(value, partials)

    def hessian(self, q: FloatArray, weights: FloatArray) -> FloatArray:
        """Return the second derivatives (K, 55, 55) by q of the torques weighted by (K, 55)."""
        second = np.zeros((*q.shape, N_DOF))
        for leg in _LEGS:
            for joint, (terms, _) in enumerate((_HIP, _KNEE, _ANKLE)):
                for term in terms:
                    c = np.rad2deg(np.array(term[2:]))
                    size = weights[:, leg[joint]] * _term(term, q[:, leg])
                    second[:, leg[:, None], leg] += size[:, None, None] * np.outer(c, c)
        return second


def no_torque(q: FloatArray) -> Linearised:
    """Return no passive torques (K, 55): muscles pay for all."""
    return Linearised(0.0 * q, np.zeros((*q.shape, 3 * N_DOF)))


def _sagittal(angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return hip, knee and ankle moments (K, 3) and their slopes (K, 3, 3) at (K, 3) angles."""
    joints = (_HIP, _KNEE, _ANKLE)
    moments = np.stack([_moment(terms, offset, angles) for terms, offset in joints], axis=1)
    slopes = np.stack([_slope(terms, angles) for terms, _ in joints], axis=1)
    return moments, slopes


def _term(term: Any, angles: FloatArray) -> FloatArray:
    sign, c0, *c = term
    return np.asarray(sign * np.exp(c0 + np.rad2deg(angles) @ np.array(c)))


def _moment(terms: Any, offset: float, angles: FloatArray) -> FloatArray:
    return np.asarray(sum(_term(term, angles) for term in terms) + offset)


def _slope(terms: Any, angles: FloatArray) -> FloatArray:
    slopes = [_term(term, angles)[:, None] * np.rad2deg(np.array(term[2:])) for term in terms]
    return np.asarray(sum(slopes))


def _row(rows: Mapping[str, Mapping[str, str]], name: str) -> Mapping[str, str] | None:
    """Return the row of a DOF: of its joint, or of all of its kind; none of the global ones."""
    joint = name.removesuffix("_r").removesuffix("_l")
    kind = "".join(sign for sign in joint if not sign.isdigit())
    return rows.get(joint, rows.get(kind))


def _column(rows: list[Mapping[str, str] | None], key: str) -> FloatArray:
    return np.array([float(row[key]) if row else 0.0 for row in rows])
