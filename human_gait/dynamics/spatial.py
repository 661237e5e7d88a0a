"""Spatial algebra about the world's origin: motions and forces (..., 6), linear part first.

The symbols are Featherstone's: m x n of two motions, m x* f of a motion and a force.

References
----------
R. Featherstone, "Rigid Body Dynamics Algorithms", Springer (2008), chapter 2.
"""

from __future__ import annotations

import numpy as np

from human_gait.arrays import FloatArray


def skew(r: FloatArray) -> FloatArray:
    """Return [r] of r x m = [r] m, (..., 3, 3)."""
    K = np.zeros((*r.shape, 3))
    x, y, z = r[..., 0], r[..., 1], r[..., 2]
    K[..., 0, 1], K[..., 0, 2], K[..., 1, 2] = -z, y, -x
    K[..., 1, 0], K[..., 2, 0], K[..., 2, 1] = z, -y, x
    return K


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
