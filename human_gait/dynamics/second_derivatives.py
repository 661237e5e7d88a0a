"""Derivatives on the tree, exact and without third-order arrays: from what each joint carries.

All bodies together need the wrench F = sum of f_k about the world's origin, f_k = I_k a_k +
v_k x* I_k v_k, gravity in a. Moved along with all that joint j carries, its bodies see no change of
their inertias, only of their motions, which are the same for all of them but for one term
(v = dq/dt):

    d_j v = v_j x S_j = b_j,   d_j a = a_j x S_j + v_j x b_j + b_j x v_k,

by q_j; by the velocity of the joint S_j and 2 b_j + S_j x v_k, by its acceleration S_j. With the
composites of what joint j carries, of the inertias I, of the forces f and of

    D(v) m = v x* I m + m x* I v - I (v x m),

the wrench, and the composite f of any joint above j, change by

    f_q = S_j x* f + I d_j a + D b_j,      f_v = 2 I b_j + D S_j,      f_a = I S_j.

A solver that takes Newton steps never needs the second derivatives of 55 torques in 165 variables,
only those of one sum of them, weighted with what a torque costs. Weights lambda of the torques and
mu of the wrench make a virtual motion of every body,

    u_k = mu + sum of S_i lambda_i over the joints i on the path of k,

whose power with the forces, sum of u_k^T f_k, is that sum, lambda^T tau + mu^T F. With
d_i u = u_i x S_i and the composites of P = I u and Q = D^T u its first derivatives are

    d_i u f + d_i a P + b_i Q,    2 b_i P + S_i Q,    S_i P,

and the second ones need the derivatives of f, P and Q by the joints further down. So a pair of
joints takes a scalar product of two short vectors, and all pairs one multiplication of matrices.

Spatial vectors are about the world's origin, linear part first. There the inertia of a body of mass
m with the first and second moments h and M of its mass is known by

    I m = (m m_l + m_w x h,  (tr M - M) m_w + h x m_l),

and with its momentum (p, L) = I v, the rate of M, and M' the rate of M along u,

    D m = (2 m_w x p,  (tr dM - dM) m_w + m_w x L),
    D^T u = (0,  2 p x u_l + (tr dM - dM) u_w + L x u_w),
    d(D^T u)/dv m = (0,  2 m_l x P_l + m_w x P_w - (tr M' - M') m_w).

References
----------
S. Singh, R. P. Russell and P. M. Wensing, "On second-order derivatives of rigid-body dynamics:
theory and implementation", IEEE Transactions on Robotics 40 (2024), for the derivatives of the
torques one by one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from human_gait import kernel
from human_gait.arrays import FloatArray, IntArray
from human_gait.body.dh import DHTable, link_to_dh, paths
from human_gait.body.links import GRAVITY
from human_gait.body.skeleton import N_DOF
from human_gait.dynamics.inverse_dynamics import LINKS, InverseDynamics
from human_gait.dynamics.jet import Linearised
from human_gait.dynamics.spatial import cross, cross_force, cross_motion

Run = Callable[..., None]

CARRIED = 33
"""Numbers of a `Carried`."""
_EVERY = np.arange(N_DOF)
POINTS = 4
"""Control points that the kernel takes products onto."""


class Moved(NamedTuple):
    """How motions and forces at K instants change along each joint.

    Attributes
    ----------
    S, b, by_a : (K, 55, 6) array
        Axes, d_j v and d_j a but for b_j x v_k.
    f_q, f_v, f_a : (K, 55, 6) array
        Derivatives of the wrench F, and of the composites f of all joints above.
    """

    S: FloatArray
    b: FloatArray
    by_a: FloatArray
    f_q: FloatArray
    f_v: FloatArray
    f_a: FloatArray


class Carried(NamedTuple):
    """Sums over bodies, or over the bodies that a joint carries, (..., n).

    Attributes
    ----------
    h : n = 3, [kg m]
        First moments of mass; the masses do not change.
    M : n = 9, [kg m^2]
        Second moments, 3 x 3.
    p, L : n = 3
        Momentum.
    M_rate : n = 9
        Rates of M.
    f : n = 6
        Forces of inertia and weight.
    """

    h: FloatArray
    M: FloatArray
    p: FloatArray
    L: FloatArray
    M_rate: FloatArray
    f: FloatArray

    @classmethod
    def of(cls, flat: FloatArray) -> Carried:
        """Return views of an array (..., 33)."""
        ends = [0, 3, 12, 15, 18, 27, CARRIED]
        return cls(*(flat[..., i:j] for i, j in pairwise(ends)))


class TreeHessian(NamedTuple):
    """Second derivatives at K instants as products of what is above with what is below.

    By the coordinates of a joint i and of a joint j below it, or the same, they are

        q_i q_j: d_i u f_q + d_i a P_q + b_i Q_q,     q_i v_j: d_i u f_v + b_i Q_v,
        v_i q_j: 2 b_i P_q + S_i Q_q,                 v_i v_j: S_i Q_v,
        q_i a_j: d_i u f_a,                           a_i q_j: S_i P_q.

    Attributes
    ----------
    moved : Moved
    by_u, P_q : (K, 55, 6) array
    Q_q, Q_v : (K, 55, 3) array
        Angular parts; Q has no others.
    above : (55, 55) array
        1 where the joint of the row is above that of the column, 1/2 where it is the same.
    """

    moved: Moved
    by_u: FloatArray
    P_q: FloatArray
    Q_q: FloatArray
    Q_v: FloatArray
    above: FloatArray

    def on_points(self, N: FloatArray, dofs: IntArray = _EVERY) -> tuple[FloatArray, FloatArray]:
        """Return X, Y (K, 15, p, n), of which the products that `above` lets through are a half.

        They are by control points of some DOF that have the weights N (3, K, p) in q, v, a: of the
        joint above and of that below it.
        """
        K, p, n = len(self.by_u), N.shape[2], len(dofs)
        X, Y = np.empty((2, K, 15, p, n))
        if (run := kernel.function("tree_on_points")) and p == POINTS:
            run(K, n, dofs, N, *self.moved, *self[1:5], into=(X, Y))
            return X, Y
        q, v, a = N[:, :, None, :, None]
        S, b, by_a, f_q, f_v, f_a, by_u, P_q, Q_q, Q_v = (
            np.ascontiguousarray(x.swapaxes(1, 2)[:, :, dofs])[:, :, None]
            for x in (*self.moved, *self[1:5])
        )
        X[:, :6] = q * by_u
        X[:, 6:12] = q * by_a + (2.0 * v) * b + a * S
        X[:, 12:] = q * b[:, 3:] + v * S[:, 3:]
        Y[:, :6] = q * f_q + v * f_v + a * f_a
        Y[:, 6:12] = q * P_q
        Y[:, 12:] = q * Q_q + v * Q_v
        return X, Y

    def by_posture(self) -> FloatArray:
        """Return those by q twice (K, 55, 55)."""
        return self.dense()[:, :N_DOF, :N_DOF]

    def dense(self) -> FloatArray:
        """Return them as matrices (K, 165, 165)."""
        K, unit = len(self.by_u), np.eye(3)
        N = np.broadcast_to(unit[:, None], (3, K, 3))
        X, Y = (rows.reshape(K, 15, -1) for rows in self.on_points(N))
        half = (X.swapaxes(1, 2) @ Y) * np.tile(self.above, (3, 3))
        return np.asarray(half + half.swapaxes(1, 2))


class Tree:
    """One set of rigid links.

    Parameters
    ----------
    table : DHTable
    pseudo_inertia : (55, 4, 4) array
        As `Body.pseudo_inertia`.
    """

    def __init__(self, table: DHTable, pseudo_inertia: FloatArray) -> None:
        self._parent = np.array(table.parent)
        self._path = np.zeros((N_DOF, N_DOF))
        """1 where the joint of the column is on the path of the link of the row."""
        for j, path in enumerate(paths(table)):
            self._path[j, path] = 1.0
        self.above = self._path.T - np.eye(N_DOF) / 2.0
        self._bodies = np.flatnonzero(pseudo_inertia[:, 3, 3] > 0.0)
        self._places = np.searchsorted(LINKS, self._bodies)
        to_dh = link_to_dh(table)[self._bodies]
        self._J = to_dh @ pseudo_inertia[self._bodies] @ to_dh.swapaxes(1, 2)
        self._mass = self._J[:, 3, 3]
        self._sum = np.ascontiguousarray(self._path[self._bodies].T)
        self._carried_mass = self._sum @ self._mass

    def first(self, dynamics: InverseDynamics, v: FloatArray, a: FloatArray) -> TreeMotion:
        """Return motions and forces at K instants with first derivatives, v, a (K, 55)."""
        S = np.ascontiguousarray(dynamics.axes.swapaxes(1, 2))
        if run := kernel.function("tree_first"):
            return self._first(run, S, v, a, dynamics.link_poses[:, self._places])
        # Motions (K, 55, 6) of the links: sums over the joints on their paths.
        by_path = self._path @ (S * v[..., None])
        b = cross_motion(by_path, S)
        rates = self._path @ (S * a[..., None] + b * v[..., None])
        rates[..., :3] -= GRAVITY  # weight is the force of inertia of a frame that accelerates up
        poses = dynamics.link_poses[:, self._places]
        flat = np.concatenate(self._bodies_of(poses, by_path, rates), axis=-1)
        sums = self._sum @ flat
        carried = Carried.of(sums)
        by_a = cross_motion(rates, S) + cross_motion(by_path, b)
        m = self._carried_mass
        f_q = cross_force(S, carried.f) + _inertia(m, carried, by_a) + _gyration(carried, b)
        f_v = 2.0 * _inertia(m, carried, b) + _gyration(carried, S)
        moved = Moved(S, b, by_a, f_q, f_v, _inertia(m, carried, S))
        return TreeMotion(moved, by_path, flat, sums)

    def second(self, at: TreeMotion, by_torque: FloatArray, by_wrench: FloatArray) -> TreeHessian:
        """Return the second derivatives of lambda^T tau + mu^T F.

        Parameters
        ----------
        at : TreeMotion
        by_torque : (K, 55) array
            lambda.
        by_wrench : (K, 6) array
            mu.
        """
        S, b, carried = at.moved.S, at.moved.b, Carried.of(at.sums)
        if run := kernel.function("tree_second"):
            return self._second(run, at, by_torque, by_wrench)
        u = self._path @ (S * by_torque[..., None]) + by_wrench[:, None]
        by_u = cross_motion(u, S)
        u = u[:, self._bodies]
        bodies = Carried.of(at.of_bodies)
        rate = _moment_rate(bodies, u)
        on_bodies = _inertia(self._mass, bodies, u), _virtual_rate(bodies, u), rate
        P, Q, rate = np.split(self._sum @ np.concatenate(on_bodies, axis=-1), [6, 9], axis=-1)
        P_q = cross_force(S, P) + _inertia(self._carried_mass, carried, by_u)
        Q_q = cross(S[..., 3:], Q) + _virtual_rate(carried, by_u) + _bent(P, rate, b)
        return TreeHessian(at.moved, by_u, P_q, Q_q, _bent(P, rate, S), self.above)

    def _first(
        self, run: Run, S: FloatArray, v: FloatArray, a: FloatArray, poses: FloatArray
    ) -> TreeMotion:
        """Return what `first` returns, by the kernel."""
        K, n = len(v), len(self._bodies)
        by_path, b, by_a, f_q, f_v, f_a = found = np.zeros((6, K, N_DOF, 6))
        bodies, carried = np.zeros((K, n, CARRIED)), np.zeros((K, N_DOF, CARRIED))
        of_tree = K, n, self._parent, self._bodies, self._J, self._carried_mass, GRAVITY
        run(*of_tree, S, v, a, poses, into=(*found, bodies, carried))
        moved = Moved(S, b, by_a, f_q, f_v, f_a)
        return TreeMotion(moved, by_path, bodies, carried)

    def _second(
        self, run: Run, at: TreeMotion, by_torque: FloatArray, by_wrench: FloatArray
    ) -> TreeHessian:
        """Return what `second` returns, by the kernel."""
        K, n = len(by_torque), len(self._bodies)
        (by_u, P_q), (Q_q, Q_v) = np.zeros((2, K, N_DOF, 6)), np.zeros((2, K, N_DOF, 3))
        of_tree = K, n, self._parent, self._bodies, self._J, self._carried_mass
        sums = at.of_bodies, at.sums
        weights, into = (by_torque, by_wrench), (by_u, P_q, Q_q, Q_v)
        run(*of_tree, at.moved.S, at.moved.b, *sums, *weights, into=into)
        return TreeHessian(at.moved, by_u, P_q, Q_q, Q_v, self.above)

    def _bodies_of(self, poses: FloatArray, v: FloatArray, a: FloatArray) -> Carried:
        """Return what is summed up, of the bodies in their poses (K, n, 4, 4)."""
        J = poses @ self._J @ poses.swapaxes(2, 3)  # in the world's axes
        v, a, m = v[:, self._bodies], a[:, self._bodies], self._mass
        M, none = J[..., :3, :3].reshape(*J.shape[:2], 9), np.zeros((*J.shape[:2], 3))
        at = Carried(np.ascontiguousarray(J[..., :3, 3]), M, none, none, M, none)
        momentum = _inertia(m, at, v)
        p, L = momentum[..., :3], momentum[..., 3:]
        f = _inertia(m, at, a) + cross_force(v, momentum)
        return Carried(at.h, M, p, L, _moment_rate(at, v), f)


@dataclass(frozen=True)
class TreeMotion:
    """The motion of a tree at K instants.

    Attributes
    ----------
    moved : Moved
    v : (K, 55, 6) array
        Velocities of the links.
    of_bodies : (K, n, 33) array
        The `Carried` of each body that has a mass.
    sums : (K, 55, 33) array
        Of all that each joint carries.
    """

    moved: Moved
    v: FloatArray
    of_bodies: FloatArray
    sums: FloatArray

    @property
    def wrench(self) -> Linearised:
        """F (K, 6) with partials (K, 6, 165)."""
        by = (x.swapaxes(1, 2) for x in (self.moved.f_q, self.moved.f_v, self.moved.f_a))
        return Linearised(Carried.of(self.sums).f[:, 0], np.concatenate([*by], axis=2))


def _inertia(m: FloatArray, of: Carried, x: FloatArray) -> FloatArray:
    """Return I x (..., 6), masses m."""
    linear, angular = x[..., :3], x[..., 3:]
    moment = _turned(of.M, angular) + cross(of.h, linear)
    return np.concatenate([m[:, None] * linear + cross(angular, of.h), moment], axis=-1)


def _gyration(of: Carried, x: FloatArray) -> FloatArray:
    """Return D x (..., 6)."""
    w = x[..., 3:]
    return np.concatenate([2.0 * cross(w, of.p), _turned(of.M_rate, w) + cross(w, of.L)], axis=-1)


def _virtual_rate(of: Carried, u: FloatArray) -> FloatArray:
    """Return the angular part (..., 3) of D^T u."""
    linear, w = u[..., :3], u[..., 3:]
    return 2.0 * cross(of.p, linear) + _turned(of.M_rate, w) + cross(of.L, w)


def _bent(P: FloatArray, rate: FloatArray, x: FloatArray) -> FloatArray:
    """Return the angular part (..., 3) of d(D^T u)/dv x, P = I u and M' flat."""
    linear, w = x[..., :3], x[..., 3:]
    return 2.0 * cross(linear, P[..., :3]) + cross(w, P[..., 3:]) - _turned(rate, w)


def _turned(M: FloatArray, w: FloatArray) -> FloatArray:
    """Return (tr M - M) w (..., 3) of second moments M (..., 9)."""
    trace = M[..., 0] + M[..., 4] + M[..., 8]
    by_row = (M.reshape(*M.shape[:-1], 3, 3) @ w[..., None])[..., 0]
    return np.asarray(trace[..., None] * w - by_row)


def _moment_rate(of: Carried, x: FloatArray) -> FloatArray:
    """Return the rate (..., 9) of the second moments of a body that moves along x."""
    linear, w = x[..., :3], x[..., 3:]
    M = of.M.reshape(*of.M.shape[:-1], 3, 3)
    half = linear[..., :, None] * of.h[..., None, :]
    half += cross(w[..., None, :], M).swapaxes(-1, -2)
    return (half + half.swapaxes(-1, -2)).reshape(of.M.shape)
