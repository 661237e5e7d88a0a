"""Surfaces of triangles, for whoever draws them: hulls of balls, bands, flat polygons."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull

from human_gait.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Mesh:
    """A surface.

    Attributes
    ----------
    vertices : (n, 3) array, [m]
    faces : (m, 3) int array
        Corners, counter-clockwise seen from outside.
    """

    vertices: FloatArray
    faces: IntArray

    @property
    def normals(self) -> FloatArray:
        """The direction that each vertex faces, (n, 3): the mean of its faces, by their area."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        across = np.cross(b - a, c - a)
        total = np.zeros_like(self.vertices)
        for k in range(3):
            np.add.at(total, self.faces[:, k], across)
        return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12))

    def moved(self, turn: FloatArray, by: FloatArray) -> Mesh:
        """Return the surface turned by a rotation (3, 3), then moved by a vector (3,), [m]."""
        return Mesh(self.vertices @ turn.T + by, self.faces)


def flat(polygons: Iterable[FloatArray], height: float) -> Mesh:
    """Return convex polygons, (n, 2) of x and z [m], that lie at one height."""
    vertices: list[FloatArray] = []
    faces: list[list[int]] = []
    for corners in polygons:
        first, n = len(vertices), len(corners)
        vertices += [np.array([x, height, z]) for x, z in corners]
        faces += [[first, first + i, first + i + 1] for i in range(1, n - 1)]
    return Mesh(np.array(vertices), np.array(faces))


def rounded(centres: FloatArray, radii: npt.ArrayLike, points_each: int = 150) -> Mesh:
    """Return the convex hull of balls: their centres (n, 3) and radii (n,) or one for all, [m]."""
    size = np.broadcast_to(np.asarray(radii, dtype=float), len(centres))
    points = (centres[:, None] + size[:, None, None] * _unit_sphere(points_each)).reshape(-1, 3)
    hull = ConvexHull(points)
    faces = np.searchsorted(np.sort(hull.vertices), hull.simplices)
    return Mesh(points[np.sort(hull.vertices)], _outward(hull, faces))


def _outward(hull: ConvexHull, faces: IntArray) -> IntArray:
    """Return the faces of a hull with corners that turn counter-clockwise seen from outside."""
    a, b, c = (hull.points[hull.simplices[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    return np.where(inward[:, None], faces[:, ::-1], faces)


@cache
def _unit_sphere(n: int) -> FloatArray:
    """Return n points spread evenly over the unit sphere, along a spiral of golden angles."""
    height = 1 - (2 * np.arange(n) + 1) / n
    turn = np.pi * (3 - np.sqrt(5)) * np.arange(n)
    ring = np.sqrt(1 - height**2)
    return np.stack([ring * np.cos(turn), height, ring * np.sin(turn)], axis=1)


def section(hull: Mesh, axis: FloatArray, offset: float, corners: int) -> FloatArray:
    """Return the loop (n, 3), evenly spaced, in which the plane axis . p = offset cuts a hull."""
    ends = hull.vertices[np.concatenate([hull.faces[:, [a, (a + 1) % 3]] for a in range(3)])]
    height = ends @ axis - offset
    cut = (height[:, 0] < 0) & (height[:, 1] >= 0)
    share = height[cut, 0] / (height[cut, 0] - height[cut, 1])
    points = ends[cut, 0] + share[:, None] * (ends[cut, 1] - ends[cut, 0])
    around = points[ConvexHull(points[:, 1:]).vertices]
    closed = np.concatenate([around, around[:1]])
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1)))
    even = np.linspace(0.0, length[-1], corners, endpoint=False)
    return np.stack([np.interp(even, length, closed[:, k]) for k in range(3)], axis=1)


def band(loop: FloatArray, axis: FloatArray, half_width: float, half_thickness: float) -> Mesh:
    """Return a closed band around a loop (n, 3) in a plane with the unit normal `axis`, [m]."""
    n = len(loop)
    tangent = np.roll(loop, -1, axis=0) - np.roll(loop, 1, axis=0)
    outward = np.cross(tangent, axis)
    outward *= half_thickness / np.linalg.norm(outward, axis=1, keepdims=True)
    if np.sum(outward * (loop - loop.mean(axis=0))) < 0:
        outward = -outward
    side = half_width * axis
    corners = [outward - side, outward + side, -outward + side, -outward - side]
    here, there = np.arange(n), (np.arange(n) + 1) % n
    faces = []
    for k in range(4):
        a, b, c, d = (r % 4 * n + i for r in (k, k + 1) for i in (here, there))
        faces += [np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)]
    points, turned = np.concatenate([loop + corner for corner in corners]), np.concatenate(faces)
    volume = np.linalg.det(points[turned] - points.mean(axis=0)).sum()
    return Mesh(points, turned if volume > 0 else turned[:, ::-1])
