"""What a walk repeats, Eq. (26): after each step its mirror image, further on by the step length.

Everything that goes on from one step to the next asks the cycle how: the splines, the postures of
later steps, the forces on the feet, the checks, exports and pictures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from human_gait.arrays import BoolArray, FloatArray, IntArray
from human_gait.body.skeleton import MIRROR_INDEX, MIRROR_SIGN, N_DOF, index
from human_gait.scenario import Walk
from human_gait.values import Value

_FORWARD = index("pelvis_tz")
_REFLECTED = np.array([-1.0, 1.0, 1.0])  # at x = 0, the plane between left and right


@dataclass(frozen=True, eq=False)
class Cycle(Value):
    """How the motion goes on after a period T: q(t + T) = S q(t) + advance, v(t + T) = S v(t).

    S puts DOF ``index[i]``, times ``sign[i]``, in the place of DOF i. Twice it is the identity, so
    S is its own inverse and its own transpose.

    Attributes
    ----------
    period : float, [s]
    index : (55,) int array
    sign : (55,) array
        1 or -1.
    advance : (55,) array, [rad] and [m]
        The way that the global DOF go in a period.

    Raises
    ------
    ValueError
        If S twice is not the identity.
    """

    period: float
    index: IntArray
    sign: FloatArray
    advance: FloatArray

    def __post_init__(self) -> None:
        """Refuse an S that is not its own inverse."""
        twice = self.turned(self.turned(np.arange(1.0, len(self.index) + 1.0)))
        if not np.array_equal(twice, np.arange(1.0, len(self.index) + 1.0)):
            raise ValueError("a cycle must lead back to itself when it is gone through twice")

    @property
    def length(self) -> float:
        """The way forward in a period, [m]."""
        return float(self.advance[_FORWARD])

    def swaps(self, cycles: npt.ArrayLike = 1) -> BoolArray:
        """Return whether left and right have changed places after so many cycles (...)."""
        mirrored = not np.array_equal(self.index, np.arange(len(self.index)))
        return np.asarray(mirrored & (np.asarray(cycles) % 2 == 1))

    def turned(self, v: FloatArray, cycles: npt.ArrayLike = 1) -> FloatArray:
        """Return velocities, accelerations or torques some cycles later: S v.

        Parameters
        ----------
        v : (K, ..., 55) or (..., 55) array
        cycles : (K,) int array or int
            Before, if negative.
        """
        return np.where(_rows(cycles, v) % 2 == 1, v[..., self.index] * self.sign, v)

    def image(self, q: FloatArray, cycles: npt.ArrayLike = 1) -> FloatArray:
        """Return postures some cycles later, as in `turned`: S q + advance, [rad] and [m]."""
        return self.turned(q, cycles) + _rows(cycles, q) * self.advance

    def reflected(self, vectors: FloatArray, cycles: npt.ArrayLike = 1) -> FloatArray:
        """Return forces and other vectors of the world (K, ..., 3) some cycles later."""
        return np.where(self.swaps(_rows(cycles, vectors)), vectors * _REFLECTED, vectors)

    def placed(self, points: FloatArray, cycles: npt.ArrayLike = 1) -> FloatArray:
        """Return points of the world (K, ..., 3) some cycles later, further on too, [m]."""
        further = _rows(cycles, points) * np.array([0.0, 0.0, self.length])
        return np.asarray(self.reflected(points, cycles) + further)

    def exchanged(self, of_feet: FloatArray, cycles: npt.ArrayLike = 1) -> FloatArray:
        """Return what belongs to right and left foot (K, 2, ...) some cycles later."""
        return np.where(self.swaps(_rows(cycles, of_feet)), of_feet[:, ::-1], of_feet)


def step_cycle(walk: Walk) -> Cycle:
    """Return the cycle of one step: the next one is its mirror image, a step length further on."""
    advance = np.zeros(N_DOF)
    advance[_FORWARD] = walk.step_length
    return Cycle(walk.step_time, MIRROR_INDEX, MIRROR_SIGN, advance)


def _rows(cycles: npt.ArrayLike, values: FloatArray) -> IntArray:
    """Return cycles (K,) with as many axes as values (K, ...); one number as it is."""
    cycles = np.asarray(cycles)
    return cycles.reshape(*cycles.shape, *[1] * (values.ndim - cycles.ndim))
