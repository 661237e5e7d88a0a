"""Position and velocity of the contact points of the feet, with partials.

On the chain from the world to a point p, joint i with the axis (linear part l_i, angular part w_i
about the world's origin) moves it by J_i = l_i + w_i x p, and for i above or at j

    dJ_j/dq_i = dJ_i/dq_j = w_i x J_j .
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from human_gait import kernel
from human_gait.arrays import FloatArray
from human_gait.body.dh import link_to_dh
from human_gait.body.person import Body
from human_gait.body.skeleton import SIDES
from human_gait.dynamics.inverse_dynamics import (
    CHAINS,
    FOOT_LINKS,
    LINKS,
    InverseDynamics,
    symmetric,
)
from human_gait.dynamics.spatial import cross
from human_gait.values import Value


@dataclass(frozen=True, eq=False)
class FootMotion(Value):
    """Contact points of one foot at K instants.

    Attributes
    ----------
    position, velocity : (K, 4, 3) array, [m], [m/s]
    jacobian : (K, 4, 3, 13) array
        d position / dq = d velocity / dv, in the DOF of the chain from the world to the toes.
    velocity_dq : (K, 4, 3, 13) array
    """

    position: FloatArray
    velocity: FloatArray
    jacobian: FloatArray
    velocity_dq: FloatArray

    def squares(
        self, by_position: FloatArray, by_velocity: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return second derivatives of half the weighted squares of positions and velocities.

        Where these themselves are zero: J^T w J, weights (K, 4, 3), by q and q, q and v, v and v.
        """
        K = len(by_position)
        J, J_rate = (x.reshape(K, 12, -1) for x in (self.jacobian, self.velocity_dq))
        places, speeds = (w.reshape(K, 1, 12) for w in (by_position, by_velocity))
        J_T, J_rate_T = J.swapaxes(1, 2), J_rate.swapaxes(1, 2) * speeds
        qq = (J_T * places) @ J + J_rate_T @ J_rate
        return qq, J_rate_T @ J, (J_T * speeds) @ J


class Feet:
    """The contact points of one body, on the links that carry them; `ball` as `Links.standing`."""

    def __init__(self, body: Body, ball: str = "foot") -> None:
        contact = body.standing(ball)
        to_dh = link_to_dh(body.table)[contact.links]
        points = np.concatenate([contact.points, np.ones((2, 4, 1))], axis=-1)
        self._points = np.einsum("fpij,fpj->fpi", to_dh, points)
        self._on_toes = contact.links == FOOT_LINKS[:, 1:]
        self._places = np.searchsorted(LINKS, contact.links)

    def motion(self, dynamics: InverseDynamics, v: FloatArray) -> tuple[FootMotion, FootMotion]:
        """Return the motion of the right and of the left foot, velocities v (K, 55)."""
        poses = dynamics.link_poses[:, self._places]  # (K, 2, 4, 4, 4)
        place = (poses @ self._points[..., None])[..., :3, 0]
        parts = place, *self._moved(dynamics.axes, v, place)
        right, left = (FootMotion(*(part[:, f] for part in parts)) for f in range(len(SIDES)))
        return right, left

    def _moved(
        self, axes: FloatArray, v: FloatArray, place: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return velocity, Jacobian and its rate (K, 2, 4, 3, ...) of points at places."""
        K, n = len(place), CHAINS[0].size
        if run := kernel.function("feet_motion"):
            shapes = (K, 2, 4, 3), (K, 2, 4, 3, n), (K, 2, 4, 3, n)
            velocity, J, J_rate = found = tuple(np.empty(shape) for shape in shapes)
            run(K, np.array(CHAINS), self._on_toes, axes.swapaxes(1, 2), v, place, into=found)
            return velocity, J, J_rate
        chains = np.array(CHAINS)
        S, speed = axes.swapaxes(1, 2)[:, chains], v[:, chains]  # (K, 2, 13, 6), (K, 2, 13)
        linear, angular = S[:, :, None, :, :3], S[:, :, None, :, 3:]
        moving = np.ones((2, 4, n, 1))
        moving[~self._on_toes, -1] = 0.0  # the toe joint does not move the rear foot
        J = (linear + cross(angular, place[:, :, :, None])) * moving
        moved = J * speed[:, :, None, :, None]
        turned = np.cumsum(angular * speed[:, :, None, :, None], axis=3)  # joints above and at j
        below = np.flip(np.cumsum(np.flip(moved, 3), axis=3), 3) - moved
        J_rate = (cross(turned, J) + cross(angular, below)) * moving
        return moved.sum(axis=3), J.swapaxes(3, 4), J_rate.swapaxes(3, 4)

    def add_hessian(
        self,
        axes: FloatArray,
        v: FloatArray,
        feet: tuple[FootMotion, FootMotion],
        weights: Sequence[FloatArray],
        into: Sequence[FloatArray],
    ) -> None:
        """Add second derivatives of functions of positions and velocities of the contact points.

        Parameters
        ----------
        axes, v, feet
            As of `motion`.
        weights : four (K, 2, 4, 3) arrays
            Derivatives of the functions by positions and by velocities, and the second derivatives
            by each of these.
        into : three (K, 20, 20) arrays
            By q and q, by q and v, by v and v of the first DOF, those of the legs.

        Notes
        -----
        With d2 p/dq_i dq_j = w_i x J_j the sum over the points of weights c is w_i . sum J_j x c;
        for velocities it enters by q and v, and its rate by q twice.
        """
        if run := kernel.function("feet_second"):
            motion = (
                np.stack([foot.jacobian for foot in feet], axis=1),
                np.stack([foot.velocity_dq for foot in feet], axis=1),
            )
            run(len(v), np.array(CHAINS), axes.swapaxes(1, 2), v, *motion, *weights, into=into)
            return
        for f, chain in enumerate(CHAINS):
            on = slice(None), chain[:, None], chain
            by_position, by_velocity, *squares = (weight[:, f] for weight in weights)
            w = axes[:, 3:, chain].swapaxes(1, 2)
            parts = feet[f].jacobian, feet[f].velocity_dq
            J, J_rate = (x.transpose(0, 3, 1, 2) for x in parts)
            turned = np.cumsum(w * v[:, chain, None], axis=1)
            w_rate = cross(turned, w)
            places, speeds = by_position[:, None], by_velocity[:, None]
            at, moving, onward = (
                cross(*pair).sum(axis=2).swapaxes(1, 2)
                for pair in ((J, places), (J, speeds), (J_rate, speeds))
            )
            curved = symmetric(w @ (at + onward) + w_rate @ moving), symmetric(w @ moving)
            for total, found in zip(into, curved, strict=False):
                total[on] += found
            for total, found in zip(into, feet[f].squares(*squares), strict=True):
                total[on] += found
