"""A load as an external force, as in Eq. (9): its weight at a point of the thorax.

The other way, a rigid body with inertia on the thorax, needs nothing here: it is part of the links
(`body`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.dh import frames, paths
from human_gait.body.links import GRAVITY
from human_gait.body.person import Body
from human_gait.body.skeleton import N_DOF, SEGMENTS
from human_gait.dynamics.inverse_dynamics import InverseDynamics, linearised_load
from human_gait.dynamics.jet import Linearised
from human_gait.dynamics.second_derivatives import TreeCurvature
from human_gait.dynamics.spatial import cross

THORAX = SEGMENTS["thorax"]


class CarriedForce:
    """The weight of the load of a body."""

    def __init__(self, body: Body) -> None:
        self._table = body.table
        self._point = np.append(body.load_com, 1.0)
        self._force = body.load.mass * GRAVITY
        self._chain = np.array(paths(body.table)[THORAX])
        self._curvature = TreeCurvature(body.table, _point_mass(body))

    def added(self, dynamics: InverseDynamics, q: FloatArray) -> InverseDynamics:
        """Return the inverse dynamics of a body that carries the force, at postures q (K, 55)."""
        load = linearised_load(dynamics.axes, self._chain, self._wrench(dynamics, q))
        value, partials = dynamics.torque.value.copy(), dynamics.torque.partials.copy()
        value[:, self._chain] -= load.value
        partials[:, self._chain] -= load.partials
        return replace(dynamics, torque=Linearised(value, partials))

    def hessian(
        self, q: FloatArray, axes: FloatArray, by_torque: FloatArray, by_wrench: FloatArray
    ) -> FloatArray:
        """Return what the force adds to the second derivatives by q, (K, 55, 55).

        Of torques and root wrench weighted as in `TreeCurvature.hessian`. A weight without inertia
        is a mass that rests: it is not moved, and it does not resist.
        """
        still = np.zeros_like(q)
        return self._curvature.hessian((q, still, still), axes, by_torque, by_wrench).qq

    def _wrench(self, dynamics: InverseDynamics, q: FloatArray) -> Linearised:
        """Return force and moment p x f (K, 6) about the origin; dp/dq_i = l_i + w_i x p."""
        _, A = frames(self._table, q)
        p = (A[:, THORAX] @ self._point)[:, :3]
        linear, angular = (part.swapaxes(1, 2) for part in np.split(dynamics.axes, 2, axis=1))
        moved = (linear + cross(angular, p[:, None]))[:, self._chain]
        force = np.broadcast_to(self._force, p.shape)
        partials = np.zeros((len(q), 6, 3 * N_DOF))
        partials[:, 3:, self._chain] = cross(moved, self._force).swapaxes(1, 2)
        return Linearised(np.concatenate([force, cross(p, force)], axis=1), partials)


def _point_mass(body: Body) -> FloatArray:
    """Return the pseudo-inertia (55, 4, 4) of the load's mass at its centre, all other links 0."""
    J, centre = np.zeros((N_DOF, 4, 4)), np.append(body.load_com, 1.0)
    J[THORAX] = body.load.mass * np.outer(centre, centre)
    return J
