"""Second derivatives of weighted torques on the tree, exact and without third-order arrays.

A solver that takes Newton steps never needs the second derivatives of 55 torques in 165 variables,
only those of one sum of them, weighted with what a torque costs. Weights lambda of the torques and
mu of the wrench F that all the bodies need about the world's origin make a virtual motion of every
body,

    u_k = mu + sum of S_i lambda_i over the joints i on the path of k,

whose power with the forces of inertia and weight, f_k = I_k a_k + v_k x* I_k v_k, is that sum:

    lambda^T tau + mu^T F = sum over the bodies of u_k^T f_k .

Moved along with all that joint i carries, its bodies see no change of their inertias, only of their
motions, which are the same for all of them but for one term (v = dq/dt, a with gravity in it):

    d_i u = u_i x S_i,   d_i v = v_i x S_i = b_i,   d_i a = a_i x S_i + v_i x b_i + b_i x v_k,

by q_i; by the velocity of the joint S_i and 2 b_i + S_i x v_k, by its acceleration S_i. With the
composites of what joint i carries, of the inertias I, of the forces f and of P = sum of I u,
D(v) m = v x* I m + m x* I v - I (v x m), Q = sum of D^T u, the first derivatives are

    (u_i x S_i) f + (a_i x S_i + v_i x b_i) P + b_i Q,    2 b_i P + S_i Q,    S_i P,

and the second ones need the derivatives of f, P and Q by the joints further down. So a pair of
joints takes a scalar product of two short vectors, and all pairs one multiplication of matrices.

Spatial vectors are about the world's origin, linear part first.

References
----------
S. Singh, R. P. Russell and P. M. Wensing, "On second-order derivatives of rigid-body dynamics:
theory and implementation", IEEE Transactions on Robotics 40 (2024), for the derivatives of the
torques one by one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.dh import DHTable, frames, paths
from human_gait.body.links import GRAVITY
from human_gait.body.skeleton import N_DOF
from human_gait.dynamics.spatial import (
    cross_force,
    cross_force_matrix,
    cross_motion,
    inertia_rate,
    spatial_inertia,
    times,
)


class StateHessian(NamedTuple):
    """Second derivatives at K instants; a does not meet v or itself, the rest is symmetric.

    Attributes
    ----------
    qq, qv, qa, vv : (K, 55, 55) array
        By q and q, by q (rows) and v (columns), ...
    """

    qq: FloatArray
    qv: FloatArray
    qa: FloatArray
    vv: FloatArray

    def dense(self) -> FloatArray:
        """Return them as matrices (K, 165, 165)."""
        qq, qv, qa, vv = self
        vq, aq = qv.swapaxes(1, 2), qa.swapaxes(1, 2)
        none = np.zeros_like(qq)
        rows = (qq, qv, qa), (vq, vv, none), (aq, none, none)
        return np.concatenate([np.concatenate(row, axis=2) for row in rows], axis=1)


class TreeCurvature:
    """Second derivatives of weighted torques of one set of rigid links.

    Parameters
    ----------
    table : DHTable
    pseudo_inertia : (55, 4, 4) array
        As `Body.pseudo_inertia`.
    """

    def __init__(self, table: DHTable, pseudo_inertia: FloatArray) -> None:
        self._table = table
        above = np.zeros((N_DOF, N_DOF))
        for j, path in enumerate(paths(table)):
            above[j, path] = 1.0
        self._above = above
        """(55, 55): 1 where the joint of the column is on the path of the link of the row."""
        self._bodies = np.flatnonzero(pseudo_inertia[:, 3, 3] > 0.0)
        self._J = pseudo_inertia[self._bodies]

    def hessian(
        self,
        state: tuple[FloatArray, FloatArray, FloatArray],
        axes: FloatArray,
        by_torque: FloatArray,
        by_wrench: FloatArray,
    ) -> StateHessian:
        """Return the second derivatives of lambda^T tau + mu^T F in q, v, a.

        Parameters
        ----------
        state : three (K, 55) arrays
            q, v, a.
        axes : (K, 6, 55) array
            Spatial joint axes about the world's origin.
        by_torque : (K, 55) array
            lambda.
        by_wrench : (K, 6) array
            mu.
        """
        q, qd, qdd = state
        S = axes.swapaxes(1, 2)
        # Motions (K, 55, 6) of the links: sums over the joints on their paths.
        v = self._above @ (S * qd[..., None])
        b = cross_motion(v, S)  # the rate of S_i, and d_i v
        a = self._above @ (S * qdd[..., None] + b * qd[..., None])
        a[..., :3] -= GRAVITY  # weight is the force of inertia of a frame that accelerates upwards
        u = self._above @ (S * by_torque[..., None]) + by_wrench[:, None]
        # What q_i adds to u, and to a but for b_i x v_k, which is in D: d_i u, d_i a.
        by_u, by_a = cross_motion(u, S), cross_motion(a, S) + cross_motion(v, b)
        f, P, Q, I, D, E = self._composites(q, u, v, a)
        # Derivatives of the composites f, P and Q of any joint above j by q_j, v_j and a_j: all
        # that j carries turns about S_j (S x*), and what moves it changes by d_j u, d_j v, d_j a.
        f_q = cross_force(S, f) + times(I, by_a) + times(D, b)
        f_v = 2.0 * times(I, b) + times(D, S)
        f_a = times(I, S)
        P_q = cross_force(S, P) + times(I, by_u)  # P does not depend on v and a
        Q_q = cross_force(S, Q) + times(D.swapaxes(-1, -2), by_u) + times(E, b)
        Q_v = times(E, S)  # Q does not depend on a
        # With j below i the motions of i stay: the first derivatives by i, (d_i u) f + (d_i a) P
        # + b_i Q by q_i, 2 b_i P + S_i Q by v_i and S_i P by a_i, change with f, P, Q alone.
        return StateHessian(
            qq=self._both(_products((by_u, by_a, b), (f_q, P_q, Q_q))),
            qv=self._both(
                _products((by_u, b), (f_v, Q_v)),  # q_i, then v_j below
                _products((2.0 * b, S), (P_q, Q_q)),  # v_i, then q_j below
            ),
            qa=self._both(_products((by_u,), (f_a,)), _products((S,), (P_q,))),
            vv=self._both(_products((S,), (Q_v,))),
        )

    def _both(self, xy: FloatArray, yx: FloatArray | None = None) -> FloatArray:
        """Return a block (K, 55, 55) by x_i and y_j from what holds where j is below or at i.

        What holds on the other side is the same with x and y exchanged, `yx`.
        """
        above = yx if yx is not None else xy
        return xy * self._above.T + above.swapaxes(1, 2) * (self._above - np.eye(N_DOF))

    def _composites(
        self, q: FloatArray, u: FloatArray, v: FloatArray, a: FloatArray
    ) -> tuple[FloatArray, ...]:
        """Return f, P, Q (K, 55, 6) and I, D, E (K, 55, 6, 6) of all that each joint carries.

        E m = D(m)^T u.
        """
        on = self._bodies
        _, A = frames(self._table, q)
        A = A[:, on]
        I = spatial_inertia(A @ self._J @ A.swapaxes(-1, -2))  # J in the world's axes: A J A^T
        u, v, a = u[:, on], v[:, on], a[:, on]
        Iu, Iv = times(I, u), times(I, v)
        turning, leaning = inertia_rate(I, v), inertia_rate(I, u)
        # D m = (v x* I - I v x) m + m x* I v, and D(m)^T u with m and u exchanged by the triple
        # product, (m x* I u) - (u x* I - I u x) m: linear in m too.
        D = turning + cross_force_matrix(Iv)
        E = cross_force_matrix(Iu) - leaning
        f = times(I, a) + cross_force(v, Iv)
        Q = times(D.swapaxes(-1, -2), u)
        # Composites: sums over the bodies that a joint carries, all six quantities at once.
        flat = [part.reshape(*part.shape[:2], -1) for part in (f, Iu, Q, I, D, E)]
        summed = self._above[on].T @ np.concatenate(flat, axis=-1)
        f, P, Q, I, D, E = np.split(summed, [6, 12, 18, 54, 90], axis=-1)
        I, D, E = (part.reshape(*part.shape[:2], 6, 6) for part in (I, D, E))
        return f, P, Q, I, D, E


def _products(motions: tuple[FloatArray, ...], forces: tuple[FloatArray, ...]) -> FloatArray:
    """Return sums of scalar products of motions of joints i and forces of joints j, (K, 55, 55)."""
    return np.asarray(
        np.concatenate(motions, axis=-1) @ np.concatenate(forces, axis=-1).swapaxes(1, 2)
    )
