"""What a weighted sum of costs and constraints asks of the quantities of an instant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import N_DOF


@dataclass(frozen=True)
class Adjoint:
    """Derivatives of a weighted sum in what it is made of, at K instants.

    The objective and the constraints depend on the motion through few quantities; their second
    derivatives in the motion follow from these derivatives by the chain rule
    (`Walker.second_derivatives`).

    Attributes
    ----------
    torque, torque_second : (K, 55) array
        By the muscle torques; the second derivatives by each of them, others being none.
    wrench, wrench_second : (K, 6) and (K, 6, 6) array
        By the wrench of the ground about the world's origin.
    position, velocity : (K, 2, 4, 3) array
        By position and velocity of the contact points, on which everything depends linearly.
    posture_second : (K, 55, 55) array
        Second derivatives by q, where it enters as it is.
    """

    torque: FloatArray
    torque_second: FloatArray
    wrench: FloatArray
    wrench_second: FloatArray
    position: FloatArray
    velocity: FloatArray
    posture_second: FloatArray

    @classmethod
    def none(cls, K: int) -> Adjoint:
        """Return an adjoint to add to, all zero."""
        shapes = (N_DOF,), (N_DOF,), (6,), (6, 6), (2, 4, 3), (2, 4, 3), (N_DOF, N_DOF)
        return cls(*(np.zeros((K, *shape)) for shape in shapes))
