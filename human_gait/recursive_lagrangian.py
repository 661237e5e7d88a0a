"""The paper's recursive Lagrangian dynamics, Eqs. (5)-(13), on the tree.

An independent engine: numpy and the DH table, nothing else. Subscripts in the code are those of the
paper, with index 0 for the base. Where the printed equations need care:

* parents and children take the place of j - 1 and i + 1, and X_j = B_j T_j carries from parent to
  child; the paper's velocity matrix B_j is called V here, because B_j is the constant root row;
* gravity and loads that act *on* the body enter Eq. (9) with a minus;
* several loads need the 4 x 4 matrix W_i = sum of r f^T where the paper has F_i f_k^T. It and
  E_i g^T recur as D_i does, so one matrix H_i = D_i - E_i g^T - W_i is carried towards the base;
* a moment does no work on a translation, and joint i turns about z of A_p B_i, not of A_{i-1}.

Nothing here takes an absolute value or a conjugate, so that a complex step passes through.

References
----------
R. W. Toogood, "Efficient robot inverse and direct dynamics algorithms using micro-computer based
symbolic generation", IEEE International Conference on Robotics and Automation (1989).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from human_gait import dh
from human_gait.body import GRAVITY, Body

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class ExternalLoad:
    """A force and a moment that act on the body, constant in the world.

    Attributes
    ----------
    link : int
        Index (from 0) of the link they act on.
    point : (..., 3) array, [m]
        Where the force acts, in the DH frame of the link.
    force : (..., 3) array, [N]
    moment : (..., 3) array, [N m]
        In the world's axes.
    """

    link: int
    point: Array
    force: Array
    moment: Array


@dataclass(frozen=True)
class _Motion:
    """What the backward recursion needs of the forward one; index 0 is the base."""

    X: list[Array]  # B_j T_j
    A_q: list[Array]  # dA_j/dq_j
    C: list[Array]  # second time derivative of A_j
    z: list[Array]  # axis of joint j in the world, (..., 3)


def inverse_dynamics(
    body: Body, q: Array, v: Array, a: Array, loads: Sequence[ExternalLoad] = ()
) -> Array:
    """Return the joint torques (and forces, along the global translations) of a motion, Eq. (9).

    Parameters
    ----------
    body : Body
    q, v, a : (..., 55) arrays, real or complex, [rad] and [m], their rates per s and per s^2
        The leading axes, such as instants, broadcast among each other and with those of the loads.
    loads : sequence of ExternalLoad
        What acts on the body besides gravity.

    Returns
    -------
    (..., 55) array, [N m] and [N]

    Notes
    -----
    tau_i = tr(dA_i H_i) - G_i^T z_i, without the moment for a prismatic joint.
    """
    motion = _forward(body.table, q, v, a)
    H, G = _backward(body, motion, loads)
    tau = [
        np.einsum("...kl,...lk->...", motion.A_q[i], H[i])
        - (0.0 if slides else np.einsum("...k,...k->...", G[i], motion.z[i]))
        for i, slides in enumerate(body.table.prismatic, start=1)
    ]
    return np.stack(np.broadcast_arrays(*tau), axis=-1)


def _forward(table: dh.DHTable, q: Array, v: Array, a: Array) -> _Motion:
    """Position, velocity and acceleration from the base to the tips, Eqs. (5)-(7)."""
    transforms = dh.transforms(table, q)
    zero = np.zeros((4, 4))
    A, V, C, X, dA, z = [np.eye(4)], [zero], [zero], [np.eye(4)], [zero], [np.zeros(3)]
    for j, (p, B) in enumerate(zip(table.parent + 1, table.base, strict=True), start=1):
        T, dT, ddT = (t[..., j - 1, :, :] for t in transforms)
        v_j, a_j = v[..., j - 1, None, None], a[..., j - 1, None, None]
        P, VB, CB = A[p] @ B, V[p] @ B, C[p] @ B
        A.append(P @ T)  # (5)
        V.append(VB @ T + P @ dT * v_j)  # (6)
        C.append(CB @ T + 2 * VB @ dT * v_j + P @ (ddT * v_j**2 + dT * a_j))  # (7)
        X.append(B @ T)
        dA.append(P @ dT)
        z.append(P[..., :3, 2])
    return _Motion(X, dA, C, z)


def _backward(
    body: Body, motion: _Motion, loads: Sequence[ExternalLoad]
) -> tuple[list[Array], list[Array]]:
    """Return H_i = D_i - E_i g^T - W_i and G_i, from the tips to the base, Eqs. (10)-(13)."""
    H, G = _own_terms(body, motion, loads)
    for i in range(len(H) - 1, 0, -1):
        p = body.table.parent[i - 1] + 1
        H[p] = H[p] + motion.X[i] @ H[i]  # (10)-(12)
        G[p] = G[p] + G[i]  # (13)
    return H, G


def _own_terms(
    body: Body, motion: _Motion, loads: Sequence[ExternalLoad]
) -> tuple[list[Array], list[Array]]:
    """Return the terms of Eqs. (10)-(13) that belong to each link itself."""
    g = np.append(GRAVITY, 0.0)
    H: list[Array] = [np.zeros((4, 4))]
    G: list[Array] = [np.zeros(3) for _ in motion.C]
    for J, C in zip(body.pseudo_inertia(), motion.C[1:], strict=True):
        H.append(J @ np.swapaxes(C, -1, -2) - np.outer(J[:, 3], g))  # J_i C_i^T, m_i r_i g^T
    for load in loads:
        k = load.link + 1
        r, f = _padded(load.point, 1.0), _padded(load.force, 0.0)
        H[k] = H[k] - r[..., :, None] * f[..., None, :]  # r_f f^T
        G[k] = G[k] + load.moment
    return H, G


def _padded(vector: Array, last: float) -> Array:
    """Return the augmented vector of Eq. (2)."""
    return np.concatenate([vector, np.full((*vector.shape[:-1], 1), last)], axis=-1)
