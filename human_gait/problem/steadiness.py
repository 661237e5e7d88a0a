"""What an unsteady trunk and head cost: people keep their eyes and the organs of balance still.

The orientation of a segment is moved by the joints on its chain from the world, whose axes w_j have
the world's directions; for i above or at j

    dw_j/dq_i = w_i x w_j,      angular velocity omega = sum_j w_j v_j.
"""

from __future__ import annotations

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import BRANCHES
from human_gait.dynamics.inverse_dynamics import symmetric
from human_gait.dynamics.spatial import cross, sum_below
from human_gait.problem.term import UNIT, Term
from human_gait.walk.adjoint import Adjoint, Block
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

    def value(now: Instants, spacing: FloatArray) -> float:
        omega = _angular_velocity(now)[0]
        return float(spacing @ (omega**2 @ by_axis))

    def add_to_adjoint(now: Instants, spacing: FloatArray, factor: float, adjoint: Adjoint) -> None:
        omega, rows = _angular_velocity(now)
        twice = 2.0 * factor * by_axis * spacing[:, None]
        adjoint.products.append((TRUNK, twice[..., None, None] / 2.0 * rows, rows))
        adjoint.state[..., TRUNK] += np.einsum("kx,kxoc->koc", twice * omega, rows)
        _add_angular_velocity(now, twice * omega, adjoint)

    return Term("unsteady trunk", UNIT, "", value, add_to_adjoint)


def steady_head(weight: float) -> Term:
    """Return the integral of the squared angle a of the head from upright, as 2 (1 - cos a).

    With the rotation R from upright 2 (1 - cos a) = 3 - tr R.

    Parameters
    ----------
    weight : float, [N^2 m^2/rad^2]
    """

    def value(now: Instants, spacing: FloatArray) -> float:
        return float(weight * spacing @ (3.0 - np.trace(now.head, axis1=1, axis2=2)))

    def add_to_adjoint(now: Instants, spacing: FloatArray, factor: float, adjoint: Adjoint) -> None:
        slope = 2.0 * factor * weight * spacing
        # d2 tr R / dq_i dq_j = tr([w_i][w_j] R) = w_i R w_j - (w_i w_j) tr R, i above or at j
        R, w = now.head, _axes(now, HEAD)
        adjoint.state[:, 0, HEAD] += slope[:, None] * (w @ _axial(R)[..., None])[..., 0]
        trace = np.trace(R, axis1=1, axis2=2)[:, None, None]
        second = trace * (w @ w.swapaxes(1, 2)) - w @ R @ w.swapaxes(1, 2)
        second = symmetric(second * slope[:, None, None] / 2.0)
        adjoint.blocks.append(Block(HEAD, second))

    return Term("unsteady head", UNIT, "", value, add_to_adjoint)


def _axes(now: Instants, chain: IntArray) -> FloatArray:
    """Return the directions (K, c, 3) of the joints of a chain."""
    return now.dynamics.axes[:, 3:, chain].swapaxes(1, 2)


def _axial(R: FloatArray) -> FloatArray:
    """Return a (K, 3) with tr([w] R) = - 2 a w."""
    ahead, behind = [2, 0, 1], [1, 2, 0]
    return np.asarray(R[:, ahead, behind] - R[:, behind, ahead]) / 2.0


def _angular_velocity(now: Instants) -> tuple[FloatArray, FloatArray]:
    """Return the angular velocity (K, 3) of the thorax and its partials (K, 3, 3, 18).

    By q, v, a of `TRUNK`.
    """
    w, v = _axes(now, TRUNK), now.v[:, TRUNK]
    moved = w * v[..., None]
    partials = np.zeros((len(v), 3, 3, len(TRUNK)))
    partials[:, :, 0] = cross(w, sum_below(moved)).swapaxes(1, 2)
    partials[:, :, 1] = w.swapaxes(1, 2)
    return moved.sum(axis=1), partials


def _add_angular_velocity(now: Instants, weights: FloatArray, adjoint: Adjoint) -> None:
    """Add the second derivatives of weights (K, 3) times the angular velocity of the thorax.

    By q_i and q_j, i above or at j: (w_i x (w_j x what turns below j)); by q_i and v_j, i above j:
    w_i x w_j.
    """
    w, v = _axes(now, TRUNK), now.v[:, TRUNK]
    turned = cross(w, sum_below(w * v[..., None]))
    sides = cross(weights[:, None], w)  # a (w_i x b) = (a x w_i) b
    second = symmetric(sides @ turned.swapaxes(1, 2))
    adjoint.blocks.append(Block(TRUNK, second, np.triu(sides @ w.swapaxes(1, 2), 1)))
