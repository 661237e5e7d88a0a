"""What an unsteady trunk and head cost: people keep their eyes and the organs of balance still.

The orientation of a segment is moved by the joints on its chain from the world, whose axes w_j have
the world's directions; for i above or at j

    dw_j/dq_i = w_i x w_j,      angular velocity omega = sum_j w_j v_j.
"""

from __future__ import annotations

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import BRANCHES, N_DOF
from human_gait.dynamics.inverse_dynamics import symmetric
from human_gait.dynamics.spatial import cross, sum_below
from human_gait.problem.term import UNIT, Term
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.instant import Instants

TRUNK = np.array([*BRANCHES["virtual"], *BRANCHES["spine"]])
"""The DOF that move the thorax."""

HEAD = np.array([*TRUNK, *BRANCHES["head"]])
"""The DOF that move the head."""


def steady_trunk(weights: FloatArray) -> Term:
    """Return the integral of the squared angular velocity of the thorax.

    A rate: it does not punish who leans, as under a backpack.

    Parameters
    ----------
    weights : (3,) array, [N^2 m^2 s^2/rad^2]
        Of pitch about x, roll about z, yaw about y, the axes of the world.
    """
    by_axis = np.asarray(weights)[[0, 2, 1]]  # x: pitch, y: yaw, z: roll

    def evaluate(now: Instants, spacing: FloatArray) -> tuple[float, FloatArray]:
        omega, rows = _angular_velocity(now)
        weighted = by_axis * spacing[:, None] * omega
        return float(np.sum(weighted * omega)), 2.0 * (weighted[:, None] @ rows)[:, 0]

    def add_to_adjoint(now: Instants, spacing: FloatArray, factor: float, adjoint: Adjoint) -> None:
        omega, rows = _angular_velocity(now)
        twice = 2.0 * factor * by_axis * spacing[:, None]
        adjoint.products.append((twice[..., None] / 2.0 * rows, rows))
        _add_angular_velocity(now, twice * omega, adjoint)

    return Term("unsteady trunk", UNIT, "", evaluate, add_to_adjoint)


def steady_head(weight: float) -> Term:
    """Return the integral of the squared angle a of the head from upright, as 2 (1 - cos a).

    With the rotation R from upright 2 (1 - cos a) = 3 - tr R.

    Parameters
    ----------
    weight : float, [N^2 m^2/rad^2]
    """

    def evaluate(now: Instants, spacing: FloatArray) -> tuple[float, FloatArray]:
        R, w = now.head, _axes(now, HEAD)
        by = np.zeros((len(spacing), 3 * N_DOF))
        by[:, HEAD] = 2.0 * weight * spacing[:, None] * (w @ _axial(R)[..., None])[..., 0]
        return float(weight * spacing @ (3.0 - np.trace(R, axis1=1, axis2=2))), by

    def add_to_adjoint(now: Instants, spacing: FloatArray, factor: float, adjoint: Adjoint) -> None:
        # d2 tr R / dq_i dq_j = tr([w_i][w_j] R) = w_i R w_j - (w_i w_j) tr R, i above or at j
        R, w = now.head, _axes(now, HEAD)
        trace = np.trace(R, axis1=1, axis2=2)[:, None, None]
        second = trace * (w @ w.swapaxes(1, 2)) - w @ R @ w.swapaxes(1, 2)
        second = symmetric(second * (factor * weight * spacing)[:, None, None])
        adjoint.posture_second[:, HEAD[:, None], HEAD] += second

    return Term("unsteady head", UNIT, "", evaluate, add_to_adjoint)


def _axes(now: Instants, chain: IntArray) -> FloatArray:
    """Return the directions (K, c, 3) of the joints of a chain."""
    return now.dynamics.axes[:, 3:, chain].swapaxes(1, 2)


def _axial(R: FloatArray) -> FloatArray:
    """Return a (K, 3) with tr([w] R) = - 2 a w."""
    ahead, behind = [2, 0, 1], [1, 2, 0]
    return np.asarray(R[:, ahead, behind] - R[:, behind, ahead]) / 2.0


def _angular_velocity(now: Instants) -> tuple[FloatArray, FloatArray]:
    """Return the angular velocity (K, 3) of the thorax and its partials (K, 3, 165)."""
    w, v = _axes(now, TRUNK), now.v[:, TRUNK]
    moved = w * v[..., None]
    partials = np.zeros((len(v), 3, 3 * N_DOF))
    partials[:, :, TRUNK] = cross(w, sum_below(moved)).swapaxes(1, 2)
    partials[:, :, N_DOF + TRUNK] = w.swapaxes(1, 2)
    return moved.sum(axis=1), partials


def _add_angular_velocity(now: Instants, weights: FloatArray, adjoint: Adjoint) -> None:
    """Add the second derivatives of weights (K, 3) times the angular velocity of the thorax.

    By q_i and q_j, i above or at j: (w_i x (w_j x what turns below j)); by q_i and v_j, i above j:
    w_i x w_j.
    """
    w, v = _axes(now, TRUNK), now.v[:, TRUNK]
    turned = cross(w, sum_below(w * v[..., None]))
    sides = cross(weights[:, None], w)  # a (w_i x b) = (a x w_i) b
    chain = TRUNK[:, None], TRUNK
    adjoint.posture_second[:, *chain] += symmetric(sides @ turned.swapaxes(1, 2))
    adjoint.posture_velocity[:, *chain] += np.triu(sides @ w.swapaxes(1, 2), 1)
