"""Inverse dynamics and its gradients at many instants, by Pinocchio or by the paper's recursion.

Forces that are constant in the world enter through the spatial axes of the joints: axis S_i (the
motion of the body points at the world's origin, linear part first, then angular) takes the torque
S_i^T F from a wrench F about the origin, and moves with the joints k below it in the tree as
dS_i/dq_k = S_k x S_i.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from human_gait.arrays import FloatArray
from human_gait.body import dh
from human_gait.body.person import Body
from human_gait.body.skeleton import BRANCHES, N_DOF, SEGMENTS, SIDES
from human_gait.dynamics.jet import Linearised
from human_gait.dynamics.recursive_lagrangian import inverse_dynamics_derivatives
from human_gait.dynamics.spatial import cross, cross_force, cross_motion, sum_below
from human_gait.values import Value

ENGINES = ("pinocchio", "dh")
"""What the dynamics can be computed with: Pinocchio, or the paper's recursion on the DH table."""

ROOT = np.array(BRANCHES["virtual"])
"""Indices of the six global DOF."""

CHAINS = tuple(
    np.array(BRANCHES["virtual"] + BRANCHES[branch]) for branch in ("right_leg", "left_leg")
)
"""Indices of the DOF that move a foot, from the world to the toes: right, left."""

LINKS = np.array(list(SEGMENTS.values()))
"""(23,) links that carry a segment: all that has a shape."""

FOOT_LINKS = np.array([[SEGMENTS[f"foot_{side}"], SEGMENTS[f"toe_{side}"]] for side in SIDES])
"""(2, 2) links of a foot: rear foot and toes."""


@dataclass(frozen=True, eq=False)
class InverseDynamics(Value):
    """Torques without ground reaction, and where the joints are.

    Attributes
    ----------
    torque : Linearised (K, 55), [N m] and [N]
        Partials (K, 55, 165) in q, v, a.
    axes : (K, 6, 55) array
        Spatial joint axes about the world's origin.
    link_poses : (K, 23, 4, 4) array
        Links of ``LINKS`` (URDF link frames) in the world.
    """

    torque: Linearised
    axes: FloatArray
    link_poses: FloatArray


class Dynamics(Protocol):
    """The dynamics of one body."""

    def inverse(self, q: FloatArray, v: FloatArray, a: FloatArray) -> InverseDynamics:
        """Return torques and partials at K instants, q, v, a (K, 55)."""


def make_dynamics(body: Body, engine: str) -> Dynamics:
    """Return the dynamics of a body by one of ``ENGINES``.

    Raises
    ------
    ValueError
        If there is no such engine.
    """
    if engine not in ENGINES:
        raise ValueError(f"no dynamics is called {engine!r}: choose one of {', '.join(ENGINES)}")
    return PinocchioDynamics(body) if engine == "pinocchio" else RecursiveDynamics(body)


_PAIRS = np.triu_indices(N_DOF, 1)


class PinocchioDynamics:
    """The Pinocchio model of one body."""

    def __init__(self, body: Body) -> None:
        self.model = body.model
        self._data = data = self.model.createData()
        # arrays in the memory of `data`: what is computed next is found in them
        self._found = data.tau, data.J.T, data.dtau_dq, data.dtau_dv, data.M
        placements = [data.oMi[int(link) + 1] for link in LINKS]
        self._turned = [placement.rotation for placement in placements]
        self._moved = [placement.translation for placement in placements]

    def inverse(self, q: FloatArray, v: FloatArray, a: FloatArray) -> InverseDynamics:
        """Return torques and partials at K instants, q, v, a (K, 55)."""
        K = len(q)
        tau, partials = np.empty((K, N_DOF)), np.empty((K, N_DOF, 3, N_DOF))
        axes, poses = np.empty((K, N_DOF, 6)), np.tile(np.eye(4), (K, len(LINKS), 1, 1))
        for k in range(K):
            pin.computeRNEADerivatives(self.model, self._data, q[k], v[k], a[k])
            tau[k], axes[k], partials[k, :, 0], partials[k, :, 1], partials[k, :, 2] = self._found
            poses[k, :, :3, :3], poses[k, :, :3, 3] = self._turned, self._moved
        above, below = _PAIRS  # of M only the upper triangle is filled
        partials[:, below, 2, above] = partials[:, above, 2, below]
        torque = Linearised(tau, partials.reshape(K, N_DOF, -1))
        return InverseDynamics(torque, axes.swapaxes(1, 2), poses)


class RecursiveDynamics:
    """The paper's recursion on the DH table of one body, without Pinocchio."""

    def __init__(self, body: Body) -> None:
        self.body = body
        self._to_links = dh.inverse(dh.link_to_dh(body.table))

    def inverse(self, q: FloatArray, v: FloatArray, a: FloatArray) -> InverseDynamics:
        """Return torques and partials at K instants, q, v, a (K, 55)."""
        tau, *by_state = inverse_dynamics_derivatives(self.body, q, v, a)
        P, A = dh.frames(self.body.table, q)
        poses = A[:, LINKS] @ self._to_links[LINKS]
        torque = Linearised(tau, np.concatenate(by_state, axis=-1))
        return InverseDynamics(torque, self._axes(P), poses)

    def _axes(self, P: FloatArray) -> FloatArray:
        """Return the spatial axes (K, 6, 55): z of P_j = A_p B_j, through the origin of P_j."""
        z, origin = P[..., :3, 2], P[..., :3, 3]
        slides = self.body.table.prismatic[:, None]
        linear, angular = np.where(slides, z, cross(origin, z)), np.where(slides, 0.0, z)
        return np.concatenate([linear, angular], axis=-1).swapaxes(1, 2)


def symmetric(M: FloatArray) -> FloatArray:
    """Return matrices (..., n, n) from their upper triangles."""
    below = np.tri(M.shape[-1], k=-1, dtype=bool)
    return np.where(below, M.swapaxes(-1, -2), M)


def load_torques(axes: FloatArray, wrench: FloatArray) -> FloatArray:
    """Return S_i^T F (K, c) of c joints for wrenches F (K, 6) about the world's origin."""
    return np.asarray((wrench[:, None] @ axes)[:, 0])


def load_torques_dq(axes: FloatArray, wrench: FloatArray) -> FloatArray:
    """Return d(S_i^T F)/dq_j (K, c, c) on one chain of joints, F constant in the world.

    (S_j x S_i)^T F = - S_i^T (S_j x* F) for j above i.
    """
    S = axes.swapaxes(1, 2)
    turned = S @ cross_force(S, wrench[:, None]).swapaxes(1, 2)
    return np.asarray(-np.tril(turned, -1))


def linearised_load(
    axes: FloatArray, chain: npt.NDArray[np.intp], wrench: Linearised
) -> Linearised:
    """Return the torques of a wrench that itself depends on the state, on one chain of joints."""
    S = axes[:, :, chain]
    partials = S.swapaxes(1, 2) @ wrench.partials
    partials[:, :, chain] += load_torques_dq(S, wrench.value)
    return Linearised(load_torques(S, wrench.value), partials)


def load_hessian(axes: FloatArray, moved: FloatArray, wrench: FloatArray) -> FloatArray:
    """Return the second derivatives of sum w_i S_i^T F by q on one chain of joints, (K, c, c).

    Parameters
    ----------
    axes : (K, 6, c) array
    moved : (K, 6, c) array
        The d_j, from `weighted_axes_dq` with the constant weights w_i.
    wrench : (K, 6) array
        F, constant in the world.

    Notes
    -----
    d2/dq_i dq_j = F^T (S_i x d_j), d_j = S_j x sum of w_k S_k below j, for i above j or equal.
    """
    S = axes.swapaxes(1, 2)
    upper = -cross_force(S, wrench[:, None]) @ moved
    return symmetric(upper)


def weighted_axes_dq(axes: FloatArray, weights: FloatArray) -> FloatArray:
    """Return d(sum of w_i S_i)/dq_j (K, 6, c) on one chain of joints."""
    S = axes.swapaxes(1, 2)
    moved = S * weights[..., None]
    return cross_motion(S, sum_below(moved)).swapaxes(1, 2)
