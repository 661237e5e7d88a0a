"""A load as an external force, as in Eq. (9): its weight at a point of the thorax.

The other way, a rigid body with inertia on the thorax, needs nothing here: it is part of the links
(`body`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from human_gait.body import GRAVITY, Body
from human_gait.dh import frames, paths
from human_gait.dynamics import InverseDynamics, load_jet
from human_gait.jet import Jet
from human_gait.skeleton import N_DOF, SEGMENTS

FloatArray = npt.NDArray[np.float64]

THORAX = SEGMENTS["thorax"]


class CarriedForce:
    """The weight of the load of a body."""

    def __init__(self, body: Body) -> None:
        self._table = body.table
        self._point = np.append(body.load_com, 1.0)
        self._force = body.load.mass * GRAVITY
        self._chain = np.array(paths(body.table)[THORAX])

    def added(self, dynamics: InverseDynamics, q: FloatArray) -> InverseDynamics:
        """Return the inverse dynamics of a body that carries the force, at postures q (K, 55)."""
        load = load_jet(dynamics.axes, self._chain, self._wrench(dynamics, q))
        value, partials = dynamics.torque.value.copy(), dynamics.torque.partials.copy()
        value[:, self._chain] -= load.value
        partials[:, self._chain] -= load.partials
        return replace(dynamics, torque=Jet(value, partials))

    def _wrench(self, dynamics: InverseDynamics, q: FloatArray) -> Jet:
        """Return force and moment p x f (K, 6) about the origin; dp/dq_i = l_i + w_i x p."""
        _, A = frames(self._table, q)
        p = (A[:, THORAX] @ self._point)[:, :3]
        linear, angular = (part.swapaxes(1, 2) for part in np.split(dynamics.axes, 2, axis=1))
        moved = (linear + np.cross(angular, p[:, None]))[:, self._chain]
        force = np.broadcast_to(self._force, p.shape)
        partials = np.zeros((len(q), 6, 3 * N_DOF))
        partials[:, 3:, self._chain] = np.cross(moved, self._force).swapaxes(1, 2)
        return Jet(np.concatenate([force, np.cross(p, force)], axis=1), partials)
