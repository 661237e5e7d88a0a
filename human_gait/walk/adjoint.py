"""What a weighted sum of costs and constraints asks of the quantities of an instant."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import MIRROR_INDEX, MIRROR_SIGN, N_DOF

_BY_DOF = (
    *("torque", "torque_second", "torque_velocity"),
    *("torque_next", "torque_velocity_next", "velocity_torque_next", "velocity_next"),
    *("passive", "passive_second"),
)
_OF_CONTACT = (
    *("contact_position", "contact_velocity"),
    *("contact_position_second", "contact_velocity_second"),
)


class Block(NamedTuple):
    """Second derivatives at K instants where some DOF enter as they are.

    Attributes
    ----------
    dofs : (c,) int array
    qq, qv, vv : (K, c, c) array or None
        By q and q, by q (rows) and v, by v and v.
    """

    dofs: IntArray
    qq: FloatArray | None = None
    qv: FloatArray | None = None
    vv: FloatArray | None = None

    def add_to(self, dense: FloatArray) -> None:
        """Add them to matrices (K, 3, 55, 3, 55)."""
        rows, columns = self.dofs[:, None], self.dofs
        for (i, j), block in zip(((0, 0), (0, 1), (1, 1)), self[1:], strict=True):
            if block is not None:
                dense[:, i, rows, j, columns] += block
                if i != j:
                    dense[:, j, rows, i, columns] += block.swapaxes(1, 2)


@dataclass(frozen=True)
class Adjoint:
    """Derivatives of a weighted sum in what it is made of, at K instants.

    The objective and the constraints depend on the motion through few quantities; their derivatives
    in the motion follow from these by the chain rule (`Walker.gradient`,
    `Walker.second_derivatives`).

    Attributes
    ----------
    state : (K, 3, 55) array
        By q, v, a where they enter as they are.
    torque, torque_second : (K, 55) array
        By the muscle torques; the second derivatives by each of them.
    torque_velocity : (K, 55) array
        By the torque and the velocity of a joint.
    torque_next, velocity_next : (K, 55) array
        By the torque of a joint and the same one at the next instant (`at_next`); by its velocities
        at both.
    torque_velocity_next, velocity_torque_next : (K, 55) array
        By its torque and its velocity at the next instant, and the other way round. These two and
        `velocity_next` are only for joints of the legs.
    passive, passive_second : (K, 55) array
        By the torques of the tissues; the second derivatives by each of them.
    ground, ground_second : (K, n) and (K, n, n) array
        By the variables of the ground (`GroundReaction`).
    contact_position, contact_velocity : (K, 2, 4, 3) array
        By position and velocity of the contact points.
    contact_position_second, contact_velocity_second : (K, 2, 4, 3) array
        Twice by each of their coordinates.
    own : (K, 3, 55) array
        Second derivatives by q twice, q and v, v twice of single DOF, where they enter as they are.
    blocks : list of Block
        Those of some DOF.
    first_only : bool
        Whether nobody asks for second derivatives.
    products : list of (c,) int array and two (K, r, 3, c) arrays
        Some DOF, and rows B, C of second derivatives B^T C + C^T B in q, v, a of them.
    """

    state: FloatArray
    torque: FloatArray
    torque_second: FloatArray
    torque_velocity: FloatArray
    torque_next: FloatArray
    torque_velocity_next: FloatArray
    velocity_torque_next: FloatArray
    velocity_next: FloatArray
    passive: FloatArray
    passive_second: FloatArray
    ground: FloatArray
    ground_second: FloatArray
    contact_position: FloatArray
    contact_velocity: FloatArray
    contact_position_second: FloatArray
    contact_velocity_second: FloatArray
    own: FloatArray
    first_only: bool = False
    blocks: list[Block] = field(default_factory=list)
    products: list[tuple[IntArray, FloatArray, FloatArray]] = field(default_factory=list)

    @classmethod
    def none(cls, K: int, n: int, first_only: bool = False) -> Adjoint:
        """Return an adjoint to add to, all zero, where the ground has n variables."""
        shapes = {
            **dict.fromkeys(("state", "own"), (3, N_DOF)),
            **dict.fromkeys(_BY_DOF, (N_DOF,)),
            "ground": (n,),
            "ground_second": (n, n),
            **dict.fromkeys(_OF_CONTACT, (2, 4, 3)),
        }
        zeros: dict[str, Any] = {name: np.zeros((K, *shape)) for name, shape in shapes.items()}
        return cls(**zeros, first_only=first_only)

    @property
    def velocity_second(self) -> FloatArray:
        """Second derivatives by the velocity of a DOF twice (K, 55)."""
        return self.own[:, 2]


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
