"""What a weighted sum of costs and constraints asks of the quantities of an instant."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

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
    torque_next : (K, 55) array
        Second derivatives by a muscle torque and the same one at the next instant; at the last
        instant of a step that is its own mirror image, the one at the end T of the step.
    ground, ground_second : (K, n) and (K, n, n) array
        By the variables of the ground (`GroundReaction`).
    position, velocity : (K, 2, 4, 3) array
        By position and velocity of the contact points, on which everything depends linearly.
    posture_second : (K, 55, 55) array
        Second derivatives by q, where it enters as it is.
    squares : list of (K, r, 165) array
        Rows A of second derivatives A^T A in q, v, a.
    products : list of two (K, r, 165) arrays
        Rows B, C of second derivatives B^T C + C^T B in q, v, a.
    """

    torque: FloatArray
    torque_second: FloatArray
    torque_next: FloatArray
    ground: FloatArray
    ground_second: FloatArray
    position: FloatArray
    velocity: FloatArray
    posture_second: FloatArray
    squares: list[FloatArray] = field(default_factory=list)
    products: list[tuple[FloatArray, FloatArray]] = field(default_factory=list)

    @classmethod
    def none(cls, K: int, n: int) -> Adjoint:
        """Return an adjoint to add to, all zero, where the ground has n variables."""
        shapes = {
            **dict.fromkeys(("torque", "torque_second", "torque_next"), (N_DOF,)),
            "ground": (n,),
            "ground_second": (n, n),
            **dict.fromkeys(("position", "velocity"), (2, 4, 3)),
            "posture_second": (N_DOF, N_DOF),
        }
        zeros: dict[str, Any] = {name: np.zeros((K, *shape)) for name, shape in shapes.items()}
        return cls(**zeros)
