"""Spatial algebra about the world's origin: motions and forces (..., 6), linear part first.

The symbols are Featherstone's: m x n of two motions, m x* f of a motion and a force.

References
----------
R. Featherstone, "Rigid Body Dynamics Algorithms", Springer (2008), chapter 2.
"""

from __future__ import annotations

import numpy as np

from human_gait.arrays import FloatArray


def spatial_inertia(J: FloatArray) -> FloatArray:
    """Return the inertia (..., 6, 6) about the world's origin from pseudo-inertias (..., 4, 4)."""
    I = np.zeros((*J.shape[:-2], 6, 6))
    moment = skew(J[..., :3, 3])
    S = J[..., :3, :3]
    I[..., :3, :3] = J[..., 3, 3, None, None] * np.eye(3)
    I[..., :3, 3:], I[..., 3:, :3] = -moment, moment
    I[..., 3:, 3:] = np.trace(S, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - S
    return I


def skew(r: FloatArray) -> FloatArray:
    """Return [r] of r x m = [r] m, (..., 3, 3)."""
    K = np.zeros((*r.shape, 3))
    x, y, z = r[..., 0], r[..., 1], r[..., 2]
    K[..., 0, 1], K[..., 0, 2], K[..., 1, 2] = -z, y, -x
    K[..., 1, 0], K[..., 2, 0], K[..., 2, 1] = z, -y, x
    return K


def inertia_rate(I: FloatArray, m: FloatArray) -> FloatArray:
    """Return how an inertia changes that moves along m, m x* I - I m x: symmetric."""
    linear, angular = skew(m[..., :3]), skew(m[..., 3:])
    X = np.zeros_like(I)  # m x* as a matrix
    X[..., :3, :3] = X[..., 3:, 3:] = angular
    X[..., 3:, :3] = linear
    half = X @ I
    return half + half.swapaxes(-1, -2)


def cross_force_matrix(h: FloatArray) -> FloatArray:
    """Return the matrix of m -> m x* h, (..., 6, 6): antisymmetric."""
    B = np.zeros((*h.shape, 6))
    B[..., :3, 3:] = B[..., 3:, :3] = -skew(h[..., :3])
    B[..., 3:, 3:] = -skew(h[..., 3:])
    return B


def times(M: FloatArray, m: FloatArray) -> FloatArray:
    """Return products of matrices (..., 6, 6) and vectors (..., 6)."""
    return np.asarray((M @ m[..., None])[..., 0])


def cross_motion(m: FloatArray, n: FloatArray) -> FloatArray:
    """Return m x n of spatial motions (..., 6)."""
    linear = cross(m[..., 3:], n[..., :3]) + cross(m[..., :3], n[..., 3:])
    return np.concatenate([linear, cross(m[..., 3:], n[..., 3:])], axis=-1)


def cross_force(m: FloatArray, f: FloatArray) -> FloatArray:
    """Return m x* f of a spatial motion and a spatial force (..., 6)."""
    moment = cross(m[..., :3], f[..., :3]) + cross(m[..., 3:], f[..., 3:])
    return np.concatenate([cross(m[..., 3:], f[..., :3]), moment], axis=-1)


def sum_below(moved: FloatArray) -> FloatArray:
    """Return what the joints below each one on a chain add up to, of (K, c, ...)."""
    return np.asarray(np.flip(np.cumsum(np.flip(moved, 1), axis=1), 1) - moved)


def cross(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the cross product; ``np.cross`` takes four times as long on short axes."""
    a, b, c = x[..., 0], x[..., 1], x[..., 2]
    d, e, f = y[..., 0], y[..., 1], y[..., 2]
    first = b * f - c * e
    found = np.empty((*first.shape, 3))
    found[..., 0], found[..., 1], found[..., 2] = first, c * d - a * f, a * e - b * d
    return found
