"""A load as an external force, as in Eq. (9): its weight at a point of the thorax.

The other way, a rigid body with inertia on the thorax, needs nothing here: it is part of the links
(`body`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body import dh
from human_gait.body.links import GRAVITY
from human_gait.body.person import Body
from human_gait.body.skeleton import N_DOF, SEGMENTS
from human_gait.dynamics.inverse_dynamics import LINKS, InverseDynamics, linearised_load
from human_gait.dynamics.jet import Linearised
from human_gait.dynamics.second_derivatives import Tree
from human_gait.dynamics.spatial import cross

THORAX = SEGMENTS["thorax"]
_PLACE = int(np.searchsorted(LINKS, THORAX))


class CarriedForce:
    """The weight of the load of a body."""

    def __init__(self, body: Body) -> None:
        to_dh = dh.link_to_dh(body.table)[THORAX]
        self._point = to_dh @ np.append(body.load_com, 1.0)
        self._force = body.load.mass * GRAVITY
        self._chain = np.array(dh.paths(body.table)[THORAX])
        self._tree = Tree(body.table, _point_mass(body))

    def added(
        self, dynamics: InverseDynamics, wrench: Linearised
    ) -> tuple[InverseDynamics, Linearised]:
        """Return dynamics and wrench (K, 6) of all bodies, of a body that carries the force."""
        force = self._wrench(dynamics)
        load = linearised_load(dynamics.axes, self._chain, force)
        value, partials = dynamics.torque.value.copy(), dynamics.torque.partials.copy()
        value[:, self._chain] -= load.value
        partials[:, self._chain] -= load.partials
        return replace(dynamics, torque=Linearised(value, partials)), wrench - force

    def hessian(
        self, dynamics: InverseDynamics, by_torque: FloatArray, by_wrench: FloatArray
    ) -> FloatArray:
        """Return what the force adds to the second derivatives by q, (K, 55, 55).

        Of torques and root wrench weighted as in `Tree.second`. A weight without inertia is a mass
        that rests: it is not moved, and it does not resist.
        """
        still = np.zeros_like(by_torque)
        at_rest = self._tree.first(dynamics, still, still)
        return self._tree.second(at_rest, by_torque, by_wrench).by_posture()

    def _wrench(self, dynamics: InverseDynamics) -> Linearised:
        """Return force and moment p x f (K, 6) about the origin; dp/dq_i = l_i + w_i x p."""
        p = (dynamics.link_poses[:, _PLACE] @ self._point)[:, :3]
        linear, angular = (part.swapaxes(1, 2) for part in np.split(dynamics.axes, 2, axis=1))
        moved = (linear + cross(angular, p[:, None]))[:, self._chain]
        force = np.broadcast_to(self._force, p.shape)
        partials = np.zeros((len(p), 6, 3 * N_DOF))
        partials[:, 3:, self._chain] = cross(moved, self._force).swapaxes(1, 2)
        return Linearised(np.concatenate([force, cross(p, force)], axis=1), partials)


def _point_mass(body: Body) -> FloatArray:
    """Return the pseudo-inertia (55, 4, 4) of the load's mass at its centre, all other links 0."""
    J, centre = np.zeros((N_DOF, 4, 4)), np.append(body.load_com, 1.0)
    J[THORAX] = body.load.mass * np.outer(centre, centre)
    return J
