"""Position and velocity of the contact points of the feet, with partials.

On the chain from the world to a point p, joint i with the axis (linear part l_i, angular part w_i
about the world's origin) moves it by J_i = l_i + w_i x p, and for i above or at j

    dJ_j/dq_i = dJ_i/dq_j = w_i x J_j .
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
from human_gait.dynamics.spatial import cross, sum_below
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
        right, left = (self._foot(f, dynamics, v) for f in range(len(SIDES)))
        return right, left

    def hessian(
        self,
        dynamics: InverseDynamics,
        motion: FootMotion,
        v: FloatArray,
        f: int,
        by_position: FloatArray,
        by_velocity: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Return second derivatives of weighted positions and velocities of one foot's points.

        Parameters
        ----------
        dynamics, motion, v
            As of `motion`, of the foot.
        f : int
            0 for the right, 1 for the left foot.
        by_position, by_velocity : (K, 4, 3) array
            The weights.

        Returns
        -------
        by q and q, by q and v : (K, 13, 13) array
            On the chain of the foot; by v twice they vanish.

        Notes
        -----
        With d2 p/dq_i dq_j = w_i x J_j the sum over the points of weights c is w_i . sum J_j x c;
        for velocities it enters by q and v, and its rate by q twice.
        """
        w = dynamics.axes[:, 3:, CHAINS[f]].swapaxes(1, 2)
        J, J_rate = (x.transpose(0, 3, 1, 2) for x in (motion.jacobian, motion.velocity_dq))
        turned = np.cumsum(w * v[:, CHAINS[f], None], axis=1)
        w_rate = cross(turned, w)
        places, speeds = by_position[:, None], by_velocity[:, None]
        at, moving, onward = (
            cross(*pair).sum(axis=2).swapaxes(1, 2)
            for pair in ((J, places), (J, speeds), (J_rate, speeds))
        )
        return symmetric(w @ (at + onward) + w_rate @ moving), symmetric(w @ moving)

    def _foot(self, f: int, dynamics: InverseDynamics, v: FloatArray) -> FootMotion:
        S, speed = dynamics.axes[:, :, CHAINS[f]], v[:, CHAINS[f]]
        linear, angular = (part.swapaxes(1, 2) for part in (S[:, :3], S[:, 3:]))
        points = [
            self._point(dynamics.link_poses[:, place] @ point, linear, angular, speed, toes)
            for point, place, toes in zip(
                self._points[f], self._places[f], self._on_toes[f], strict=True
            )
        ]
        return FootMotion(*(np.stack(parts, axis=1) for parts in zip(*points, strict=True)))

    def _point(
        self,
        place: FloatArray,
        linear: FloatArray,
        angular: FloatArray,
        speed: FloatArray,
        on_toes: bool,
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return position, velocity and their partials of one point (K, 4) at K instants."""
        p = place[:, :3]
        J = linear + cross(angular, p[:, None])
        if not on_toes:
            J[:, -1] = 0.0  # the toe joint does not move the rear foot
        moved = J * speed[..., None]
        turned = np.cumsum(angular * speed[..., None], axis=1)  # joints above and at j
        below = sum_below(moved)
        dv = cross(turned, J) + cross(angular, below)
        if not on_toes:
            dv[:, -1] = 0.0
        return p, moved.sum(axis=1), J.swapaxes(1, 2), dv.swapaxes(1, 2)
