"""Denavit-Hartenberg kinematics of the tree, Eqs. (1)-(5).

Frame j of the paper is index j - 1 here. On a tree A_j = A_p B_j T_j(q_j): p is the parent and B_j
a constant DH transformation, the identity except at the roots of the branches, because one row
cannot lead from a parent to several children. Joint j turns about (or slides along) z of A_p B_j.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from human_gait import data
from human_gait.arrays import FloatArray
from human_gait.body import skeleton
from human_gait.body.anthropometry import Anthropometry
from human_gait.values import Value

Array = npt.NDArray[Any]
"""Real, or complex where a complex step is taken through the formulas."""

# Q of T' = Q T for a revolute joint, and T' = E for a prismatic one.
_Q = np.array([[0.0, -1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0] * 4, [0.0] * 4])
_E = np.zeros((4, 4))
_E[2, 3] = 1.0


@dataclass(frozen=True, eq=False)
class DHTable(Value):
    """The DH parameters of one body.

    Attributes
    ----------
    parent : (55,) int array
        Index of the parent link, -1 for the world.
    prismatic : (55,) bool array
    theta_offset, alpha : (55,) array, [rad]
    d, a : (55,) array, [m]
    base : (55, 4, 4) array
        The constant B_j.
    """

    parent: npt.NDArray[np.intp]
    prismatic: npt.NDArray[np.bool_]
    theta_offset: FloatArray
    d: FloatArray
    a: FloatArray
    alpha: FloatArray
    base: FloatArray


def dh_table(measures: Anthropometry) -> DHTable:
    """Return the symbolic rows of ``data/dh_table.csv`` in the numbers of a subject."""
    rows = data.rows("dh_table")
    parameters = {(row["kind"], row["joint"]): _parameters(row, measures) for row in rows}
    theta_offset, d, a, alpha = np.array(
        [p for (kind, _), p in parameters.items() if kind == "joint"]
    ).T
    base = np.tile(np.eye(4), (skeleton.N_DOF, 1, 1))
    for (kind, joint), p in parameters.items():
        if kind == "fixed":
            base[int(joint) - 1] = constant(dh_matrix(*p))
    return DHTable(skeleton.PARENT, skeleton.PRISMATIC, theta_offset, d, a, alpha, base)


def _parameters(
    row: Mapping[str, str], measures: Anthropometry
) -> tuple[float, float, float, float]:
    theta, alpha = (
        float(np.deg2rad(float(row[column]))) for column in ("theta_offset_deg", "alpha_deg")
    )
    return theta, measures.length(row["d"]), measures.length(row["a"]), alpha


def dh_matrix(
    theta: npt.ArrayLike, d: npt.ArrayLike, a: npt.ArrayLike, alpha: npt.ArrayLike
) -> Array:
    """Return T = Rz(theta) Tz(d) Tx(a) Rx(alpha), Eq. (1), (..., 4, 4) for parameters (...)."""
    theta, d, a, alpha = np.broadcast_arrays(theta, d, a, alpha)
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    # [ c  -s ca   s sa  a c ]
    # [ s   c ca  -c sa  a s ]
    # [ 0     sa     ca    d ]
    # [ 0      0      0    1 ]
    T = np.zeros((*theta.shape, 4, 4), dtype=np.result_type(c, d))
    T[..., 0, 0], T[..., 0, 1], T[..., 0, 2], T[..., 0, 3] = c, -ca * s, sa * s, a * c
    T[..., 1, 0], T[..., 1, 1], T[..., 1, 2], T[..., 1, 3] = s, ca * c, -sa * c, a * s
    T[..., 2, 1], T[..., 2, 2], T[..., 2, 3] = sa, ca, d
    T[..., 3, 3] = 1.0
    return T


def constant(T: FloatArray) -> FloatArray:
    """Return a constant transformation with 0 where cos(pi / 2) leaves 6e-17."""
    return np.round(T, 15) + 0.0


def inverse(T: Array) -> Array:
    """Return the inverse of rigid transformations, (..., 4, 4)."""
    inverted = np.zeros_like(T)  # [R r; 0 1]^-1 = [R^T -R^T r; 0 1]
    inverted[..., :3, :3] = rotation = np.swapaxes(T[..., :3, :3], -1, -2)
    inverted[..., :3, 3] = -(rotation @ T[..., :3, 3:])[..., 0]
    inverted[..., 3, 3] = 1.0
    return inverted


def transforms(table: DHTable, q: Array) -> tuple[Array, Array, Array]:
    """Return T_j, dT_j/dq_j and d2T_j/dq_j2 of all joints, each (..., 55, 4, 4).

    Parameters
    ----------
    table : DHTable
    q : (..., 55) array, real or complex, [rad] and [m]

    Raises
    ------
    ValueError
        If the last axis of q is not 55 long.
    """
    T = _rows(table, q)
    slides = table.prismatic[:, None, None]
    dT = np.where(slides, _E, _Q @ T)  # T' = Q T: theta comes first in T; sliding, only d changes
    ddT = np.where(slides, 0.0, _Q @ dT)  # T'' = Q Q T; sliding, 0
    return T, dT, ddT


def _rows(table: DHTable, q: Array) -> Array:
    """Return T_j of all joints: q is theta of a revolute joint and d of a prismatic one."""
    if q.shape[-1] != skeleton.N_DOF:
        raise ValueError(f"q must have shape (..., {skeleton.N_DOF}), not {q.shape}")
    theta = table.theta_offset + np.where(table.prismatic, 0.0, q)
    return dh_matrix(theta, table.d + np.where(table.prismatic, q, 0.0), table.a, table.alpha)


def twists(table: DHTable) -> FloatArray:
    """Return the Q_j of dT_j/dq_j = T_j Q_j, (55, 4, 4): constant, the joint seen in its own frame.

    The motion comes first in a DH row, T_j = R(q_j) K_j, hence Q_j = K_j^-1 (Q or E) K_j.
    """
    T, dT, _ = transforms(table, np.zeros(skeleton.N_DOF))
    return constant(inverse(T) @ dT)


def paths(table: DHTable) -> list[list[int]]:
    """Return the joints that move each link, from the base to the link's own joint."""
    found: list[list[int]] = []
    for j, p in enumerate(table.parent):
        found.append([*(found[p] if p >= 0 else []), j])
    return found


def frames(table: DHTable, q: Array) -> tuple[Array, Array]:
    """Return P_j = A_p B_j, about whose z axis joint j moves, and A_j = P_j T_j, Eq. (5).

    Parameters
    ----------
    table : DHTable
    q : (..., 55) array, [rad] and [m]

    Returns
    -------
    P, A : (..., 55, 4, 4) arrays
        Frames in the world. The origin of P_j is the centre of the proximal joint of link j.
    """
    T = np.moveaxis(_rows(table, q), -3, 0)
    P, A = np.empty_like(T), np.empty_like(T)
    turned = np.any(table.base != np.eye(4), axis=(1, 2))
    for j, p in enumerate(table.parent):
        P[j] = A[p] if p >= 0 else np.eye(4)
        if turned[j]:
            P[j] = P[j] @ table.base[j]
        A[j] = P[j] @ T[j]
    return np.moveaxis(P, 0, -3), np.moveaxis(A, 0, -3)


def link_to_dh(table: DHTable) -> FloatArray:
    """Return the K_i of A_i = U_i K_i, (55, 4, 4): the part of a DH row after the motion."""
    # T = Rz(theta) Tz(d) Tx(a) Rx(alpha): where d does not move it belongs to what comes after.
    after = np.where(table.prismatic, 0.0, table.d)
    return constant(dh_matrix(0.0, after, table.a, table.alpha))


def joint_origins(table: DHTable) -> FloatArray:
    """Return K_p B_i Rz(theta_offset) of each joint, (55, 4, 4): from link p to link i at q = 0."""
    before = np.where(table.prismatic, table.d, 0.0)
    offset = constant(dh_matrix(table.theta_offset, before, 0.0, 0.0))
    of_parent = np.concatenate([link_to_dh(table), np.eye(4)[None]])[table.parent]  # -1: world
    return constant(of_parent @ table.base @ offset)
