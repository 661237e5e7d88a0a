"""What a weighted sum of costs and constraints asks of the quantities of an instant."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import MIRROR_INDEX, MIRROR_SIGN, N_DOF

JOINTS = np.arange(6, N_DOF)
"""Indices of the DOF that have torques: all but the global ones."""

_BY_DOF = (
    *("torque", "torque_second", "torque_next", "torque_velocity", "velocity_second"),
    *("passive", "passive_second"),
)


@dataclass(frozen=True)
class Adjoint:
    """Derivatives of a weighted sum in what it is made of, at K instants.

    The objective and the constraints depend on the motion through few quantities; their second
    derivatives in the motion follow from these derivatives by the chain rule
    (`Walker.second_derivatives`).

    Attributes
    ----------
    torque, torque_second : (K, 55) array
        By the muscle torques; the second derivatives by each of them.
    torque_next : (K, 55) array
        By the torque of a joint and the same one at the next instant (`at_next`).
    torque_velocity, velocity_second : (K, 55) array
        By the torque and the velocity of a joint, and twice by its velocity.
    passive, passive_second : (K, 55) array
        The same by the torques of the tissues.
    ground, ground_second : (K, n) and (K, n, n) array
        By the variables of the ground (`GroundReaction`).
    position, velocity : (K, 2, 4, 3) array
        By position and velocity of the contact points, on which everything depends linearly.
    posture_second, posture_velocity : (K, 55, 55) array
        Second derivatives by q, and by q (rows) and v, where they enter as they are.
    products : list of two (K, r, 165) arrays
        Rows B, C of second derivatives B^T C + C^T B in q, v, a.
    pairs : list of two (K, r, 165) arrays
        Rows D of an instant and E of the next one of second derivatives D^T E + E^T D; after the
        last instant of a step that is its own mirror image comes T, in the state of the first one
        (`at_next`). Of any other step there are K - 1.
    """

    torque: FloatArray
    torque_second: FloatArray
    torque_next: FloatArray
    torque_velocity: FloatArray
    velocity_second: FloatArray
    passive: FloatArray
    passive_second: FloatArray
    ground: FloatArray
    ground_second: FloatArray
    position: FloatArray
    velocity: FloatArray
    posture_second: FloatArray
    posture_velocity: FloatArray
    products: list[tuple[FloatArray, FloatArray]] = field(default_factory=list)
    pairs: list[tuple[FloatArray, FloatArray]] = field(default_factory=list)

    @classmethod
    def none(cls, K: int, n: int) -> Adjoint:
        """Return an adjoint to add to, all zero, where the ground has n variables."""
        shapes = {
            **dict.fromkeys(_BY_DOF, (N_DOF,)),
            "ground": (n,),
            "ground_second": (n, n),
            **dict.fromkeys(("position", "velocity"), (2, 4, 3)),
            **dict.fromkeys(("posture_second", "posture_velocity"), (N_DOF, N_DOF)),
        }
        zeros: dict[str, Any] = {name: np.zeros((K, *shape)) for name, shape in shapes.items()}
        return cls(**zeros)


class Image(NamedTuple):
    """Which of some DOF each of them is at T, in a step that is its own mirror image, and its sign.

    Attributes
    ----------
    dof : (c,) int array
    sign : (c,) array
    """

    dof: IntArray
    sign: FloatArray


OF_ALL = Image(MIRROR_INDEX, MIRROR_SIGN)
"""Of all 55 DOF."""


def at_next(values: FloatArray, mirrored: bool, image: Image = OF_ALL) -> FloatArray:
    """Return a quantity of each DOF (K, c, ...) at the next instants.

    A step that is its own mirror image (Eq. 26) ends with the image of its beginning; of any other
    its last instant has no next one: there are K - 1.
    """
    if not mirrored:
        return values[1:]
    sign = image.sign.reshape(-1, *[1] * (values.ndim - 2))
    return np.concatenate([values[1:], (sign * values[0, image.dof])[None]])


def add_at_next(
    total: FloatArray, onward: FloatArray, mirrored: bool, image: Image = OF_ALL
) -> None:
    """Add what is of the next instants to the total (K, c) of all, the transpose of `at_next`."""
    total[1:] += onward[: len(total) - 1]
    if mirrored:
        total[0, image.dof] += image.sign * onward[-1]
