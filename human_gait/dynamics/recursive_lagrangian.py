"""The paper's recursive Lagrangian dynamics, Eqs. (5)-(16), on the tree.

An independent engine: numpy and the DH table, nothing else. Subscripts in the code are those of the
paper, with index 0 for the base. Where the printed equations need care:

* parents and children take the place of j - 1 and i + 1, and X_j = B_j T_j carries from parent to
  child; the paper's velocity matrix B_j is called V here, because B_j is the constant root row;
* gravity and loads that act *on* the body enter Eq. (9) with a minus;
* several loads need the 4 x 4 matrix W_i = sum of r f^T where the paper has F_i f_k^T. It and
  E_i g^T recur as D_i does, so one matrix H_i = D_i - E_i g^T - W_i is carried towards the base;
* a moment does no work on a translation, and joint i turns about z of A_p B_i, not of A_{i-1}.

A frame depends on the joints of its path alone, the d_j joints from the base to j. What is
differentiated in them is stacked, d_j blocks of rows, and takes one multiplication per joint:

* A, V, C are kept side by side by their upper three rows, [A V C] (3 x 12). With X' = B T' and
  X'' = B T'' the recursions (5)-(7) are [A V C]_j = [A V C]_p M_j,

          [ X   X' v   X'' v^2 + X' a ]
      M = [ 0   X      2 X' v         ] ;
          [ 0   0      X              ]

* H_i is kept transposed (3 x 4), and so takes X^T from the right;
* T'_j = T_j Q_j with Q_j constant. So the derivatives of A_k, V_k, C_k by q_k, where the forward
  recursions of the sensitivities start, are A_k Q_k, V_k Q_k, C_k Q_k;
* A is a function of q, V and C its time derivatives: dC/da = dV/dv = dA/dq and dC/dv = 2 dV/dq.

Nothing here takes an absolute value or a conjugate, so that a complex step passes through.

References
----------
R. W. Toogood, "Efficient robot inverse and direct dynamics algorithms using micro-computer based
symbolic generation", IEEE International Conference on Robotics and Automation (1989).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from human_gait.body import dh
from human_gait.body.links import GRAVITY, Links
from human_gait.values import Value

Array = npt.NDArray[Any]


@dataclass(frozen=True, eq=False)
class ExternalLoad(Value):
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


class TorqueDerivatives(NamedTuple):
    """Joint torques and their sensitivities, torque i in row i.

    Attributes
    ----------
    tau : (..., 55) array, [N m] and [N]
    dtau_dq, dtau_dv, dtau_da : (..., 55, 55) array
        Eqs. (14), (15) and (16); the last is the mass matrix.
    """

    tau: Array
    dtau_dq: Array
    dtau_dv: Array
    dtau_da: Array


@dataclass(frozen=True, eq=False)
class _Motion(Value):
    """What the backward recursion needs of the forward one; index 0 of the lists is the base."""

    Q: Array  # dT_j/dq_j = T_j Q_j, (55, 4, 4)
    M: Array  # (..., 55, 12, 12)
    AVC: list[Array]  # (..., 3, 12)
    A_q: list[Array]  # dA_j/dq_j, (..., 3, 4)
    z: list[Array]  # axis of joint j in the world, (..., 3); 0 for a prismatic joint

    def X(self, j: int) -> Array:  # noqa: N802, the paper's symbol
        """Return X_j = B_j T_j."""
        return self.M[..., j - 1, :4, :4]


def inverse_dynamics(
    body: Links, q: Array, v: Array, a: Array, loads: Sequence[ExternalLoad] = ()
) -> Array:
    """Return the joint torques (and forces, along the global translations) of a motion, Eq. (9).

    Parameters
    ----------
    body : Links
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
    return _torques(motion, *_backward(body, motion, loads))


def inverse_dynamics_derivatives(
    body: Links, q: Array, v: Array, a: Array, loads: Sequence[ExternalLoad] = ()
) -> TorqueDerivatives:
    """Return the joint torques and their derivatives in the state, Eqs. (14)-(16).

    Parameters
    ----------
    body : Links
    q, v, a : (..., 55) arrays, [rad] and [m], their rates per s and per s^2
        As for `inverse_dynamics`.
    loads : sequence of ExternalLoad
        Constant in the world, at points that are fixed in the links.

    Notes
    -----
    Let A_jj = dA_j/dq_j and A_jk = d2A_j/dq_j dq_k. For k on the path of j, j itself included,

        dtau_j/dq_k = tr(A_jk H_j) + tr(A_jj dD_j/dq_k) - G_j^T dz_j/dq_k
        dtau_k/dq_j = tr(A_jk H_j) + tr(dA_j/dq_k dD_j/dq_j),

    the same in v and a without H and G, and zero between separate branches. The second line is the
    lower half of Eq. (14): what it carries from j to k by multiplications with X, from the left, is
    multiplied here with dA_k/dq_k, from the right, which makes dA_j/dq_k of it.
    """
    motion = _forward(body.table, q, v, a)
    H, G = _backward(body, motion, loads)
    tau = _torques(motion, H, G)
    S = _forward_sensitivities(body.table, motion)
    dD = _backward_sensitivities(body, motion, S)
    n = tau.shape[-1]
    dtau = np.zeros((*tau.shape[:-1], 3, n, n))  # by a, half by v, by q: the order of A, V, C
    for j, (path, Q) in enumerate(zip(dh.paths(body.table), motion.Q, strict=True)):
        dA, D = _flat(S[j + 1][..., :4], 12), _flat(dD[j + 1], 36)
        bent, turned = _tilted(dA, Q, H[j + 1], G[j + 1])
        dtau[..., path, j] = np.swapaxes(dA @ _own(D), -1, -2)
        dtau[..., j, path] = np.swapaxes(D @ _thrice(motion.A_q[j + 1]), -1, -2)
        dtau[..., 2, path, j] += bent
        dtau[..., 2, j, path[:-1]] += (bent - turned)[..., :-1]  # joint j does not tilt itself
    return TorqueDerivatives(tau, dtau[..., 2, :, :], 2 * dtau[..., 1, :, :], dtau[..., 0, :, :])


def _forward(table: dh.DHTable, q: Array, v: Array, a: Array) -> _Motion:
    """Position, velocity and acceleration from the base to the tips, Eqs. (5)-(7)."""
    M, twists = _steps(table, q, v, a), dh.twists(table)
    AVC, A_q, z = [np.eye(3, 12)], [np.zeros((3, 4))], [np.zeros(3)]
    for j, (p, Q) in enumerate(zip(table.parent + 1, twists, strict=True)):
        AVC.append(AVC[p] @ M[..., j, :, :])
        A = AVC[-1][..., :4]
        A_q.append(A @ Q)
        z.append(A @ _axis(Q))
    return _Motion(twists, M, AVC, A_q, z)


def _steps(table: dh.DHTable, q: Array, v: Array, a: Array) -> Array:
    """Return the M_j that lead from parents to children, (..., 55, 12, 12)."""
    X, dX, ddX = (table.base @ T for T in dh.transforms(table, q))
    v, a = v[..., None, None], a[..., None, None]
    first, second = dX * v, ddX * v**2 + dX * a
    M = np.zeros((*second.shape[:-2], 12, 12), dtype=second.dtype)
    M[..., :4, :4] = M[..., 4:8, 4:8] = M[..., 8:, 8:] = X
    M[..., :4, 4:8], M[..., :4, 8:], M[..., 4:8, 8:] = first, second, 2 * first
    return M


def _backward(
    body: Links, motion: _Motion, loads: Sequence[ExternalLoad]
) -> tuple[list[Array], list[Array]]:
    """Return H_i^T = (D_i - E_i g^T - W_i)^T and G_i, from the tips to the base, Eqs. (10)-(13)."""
    H, G = _own_terms(body, motion, loads)
    for i in range(len(H) - 1, 0, -1):
        p = body.table.parent[i - 1] + 1
        H[p] = H[p] + H[i] @ np.swapaxes(motion.X(i), -1, -2)  # (10)-(12)
        G[p] = G[p] + G[i]  # (13)
    return H, G


def _own_terms(
    body: Links, motion: _Motion, loads: Sequence[ExternalLoad]
) -> tuple[list[Array], list[Array]]:
    """Return the terms of Eqs. (10)-(13) that belong to each link itself."""
    H: list[Array] = [np.zeros((3, 4))]
    G: list[Array] = [np.zeros(3) for _ in motion.AVC]
    for J, AVC in zip(body.pseudo_inertia(), motion.AVC[1:], strict=True):
        H.append(AVC[..., 8:] @ J - np.outer(GRAVITY, J[:, 3]))  # C_i J_i^T, g m_i r_i^T
    for load in loads:
        k = load.link + 1
        H[k] = H[k] - load.force[..., :, None] * _padded(load.point, 1.0)[..., None, :]  # f r_f^T
        G[k] = G[k] + load.moment
    return H, G


def _torques(motion: _Motion, H: list[Array], G: list[Array]) -> Array:
    """Return all tau_i, Eq. (9)."""
    tau = [
        np.einsum("...rc,...rc->...", A_q, H_i) - np.einsum("...r,...r->...", G_i, z)
        for A_q, H_i, G_i, z in zip(motion.A_q[1:], H[1:], G[1:], motion.z[1:], strict=True)
    ]
    return np.stack(np.broadcast_arrays(*tau), axis=-1)


def _forward_sensitivities(table: dh.DHTable, motion: _Motion) -> list[Array]:
    """Return d[A_j V_j C_j]/dq_k for k on the path of j, (..., 3 d_j, 12), the base first."""
    S: list[Array] = [np.empty((*motion.M.shape[:-3], 0, 12))]
    for j, (p, Q) in enumerate(zip(table.parent + 1, motion.Q, strict=True), start=1):
        parts = motion.AVC[j].reshape(*motion.M.shape[:-3], 9, 4)
        own = (parts @ Q).reshape(*motion.M.shape[:-3], 3, 12)
        S.append(np.concatenate([S[p] @ motion.M[..., j - 1, :, :], own], axis=-2))
    return S


def _backward_sensitivities(body: Links, motion: _Motion, S: list[Array]) -> list[Array]:
    """Return what D_i^T becomes with dA, dV, dC in place of C_i, (..., 9 d_i, 4), the base first.

    They are the derivatives of D_i^T by a, half of those by v, and those by q.
    """
    dD = [_flat(S_i, 4) @ J for S_i, J in zip(S[1:], body.pseudo_inertia(), strict=True)]
    dD.insert(0, np.zeros((*motion.M.shape[:-3], 0, 4)))
    for i in range(len(dD) - 1, 0, -1):
        p = body.table.parent[i - 1] + 1
        dD[p] += dD[i][..., :-9, :] @ np.swapaxes(motion.X(i), -1, -2)
    return dD


def _tilted(dA: Array, Q: Array, H: Array, G: Array) -> tuple[Array, Array]:
    """Return tr(A_jk H_j) and G_j^T dz_j/dq_k for k on the path of a joint, (..., d_j).

    A_jk = dA_j/dq_k Q_j, and z_j = A_j times the axis in frame j.
    """
    moment = G[..., :, None] * _axis(Q)
    return (dA @ _flat(H @ Q.T, 1))[..., 0], (dA @ _flat(moment, 1))[..., 0]


def _flat(blocks: Array, n: int) -> Array:
    """Return matrices row by row, in rows of n: 4 for every row, 12 or 36 for every joint."""
    return blocks.reshape(*blocks.shape[:-2], -1, n)


def _own(D: Array) -> Array:
    """Return the last of (..., d, 36), which is by q_j itself, as columns for A, V, C, (12, 3)."""
    own = D[..., -1, :].reshape(*D.shape[:-2], 3, 3, 4)
    return np.swapaxes(own, -1, -2).reshape(*D.shape[:-2], 12, 3)


def _thrice(A: Array) -> Array:
    """Return (..., 36, 3): what contracts rows of [A V C] with a matrix (..., 3, 4), one by one."""
    each = A[..., :, None, :, None] * np.eye(3)[:, None, :]
    return each.reshape(*A.shape[:-2], 36, 3)


def _axis(Q: Array) -> Array:
    """Return the axis of a joint in its own frame, augmented, (4,); 0 for a prismatic joint."""
    return np.array([Q[2, 1], Q[0, 2], Q[1, 0], 0.0])


def _padded(vector: Array, last: float) -> Array:
    """Return the augmented vector of Eq. (2)."""
    return np.concatenate([vector, np.full((*vector.shape[:-1], 1), last)], axis=-1)
