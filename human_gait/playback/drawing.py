"""What pictures in MeshCat are made of: commands as text, materials, shapes and animated tracks.

All tracks of a scene last one unit of MeshCat's time, which is one stride: walks of different pace
are then at the same phase of it.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import umsgpack  # type: ignore[import-untyped]  # comes with meshcat, without types
from meshcat import Visualizer
from meshcat.animation import Animation, AnimationClip, AnimationTrack
from meshcat.geometry import (
    Geometry,
    MeshBasicMaterial,
    MeshLambertMaterial,
    TriangularMeshGeometry,
)
from scipy.spatial import ConvexHull

from human_gait.arrays import FloatArray, IntArray

_UUID = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")
COLOURS = {  # of a scene; the feet: two of Okabe and Ito's
    "right": 0xD55E00,
    "left": 0x0072B2,
    "zmp": 0xE3008C,
    "support": 0xF0C000,
}

_TRACK_TYPES = {
    "position": "vector3",
    "scale": "vector3",
    "quaternion": "quaternion",
    "visible": "bool",
}


@dataclass
class Recorder:
    """Takes the place of MeshCat's connection to a browser and keeps what is sent.

    MeshCat's random names become numbers, so that the same walk gives the same page.
    """

    commands: list[str] = field(default_factory=list)
    _names: dict[str, str] = field(default_factory=dict)

    def send(self, command: Any) -> None:
        """Keep a command as MeshCat packs it, in single precision, as text."""
        packed = umsgpack.packb(self._named(command.lower()), force_float_precision="single")
        self.commands.append(base64.b64encode(packed).decode("ascii"))

    def _named(self, part: Any) -> Any:
        """Return a part of a command with a number for every random name (UUID) in it."""
        if isinstance(part, dict):
            return {key: self._named(value) for key, value in part.items()}
        if isinstance(part, list):
            return [self._named(value) for value in part]
        if isinstance(part, str) and _UUID.fullmatch(part):
            return self._names.setdefault(part, f"object {len(self._names)}")
        return part


@dataclass
class Command:
    """A command of the viewer for which MeshCat's Python side has no class."""

    content: dict[str, Any]

    def lower(self) -> dict[str, Any]:
        """Return what is sent."""
        return self.content


def matte(colour: int) -> MeshLambertMaterial:
    """Return a material without gloss."""
    return MeshLambertMaterial(color=colour)


def glowing(colour: int) -> MeshBasicMaterial:
    """Return a material that shines through the body; transparent things are painted last."""
    return MeshBasicMaterial(color=colour, transparent=True, opacity=0.85, depthTest=False)


def sheer(colour: int, opacity: float) -> MeshBasicMaterial:
    """Return a material that the ground is seen through."""
    return MeshBasicMaterial(color=colour, transparent=True, opacity=opacity, depthWrite=False)


def flat(polygons: Iterable[FloatArray], height: float) -> Geometry:
    """Return convex polygons, (n, 2) of x and z [m], that lie at one height."""
    vertices: list[FloatArray] = []
    faces: list[list[int]] = []
    for corners in polygons:
        first, n = len(vertices), len(corners)
        vertices += [np.array([x, height, z]) for x, z in corners]
        faces += [[first, first + i, first + i + 1] for i in range(1, n - 1)]
    return TriangularMeshGeometry(vertices, faces)


def rounded(centres: FloatArray, radii: npt.ArrayLike, points_each: int = 300) -> Geometry:
    """Return the convex hull of balls: their centres (n, 3) and radii (n,) or one for all, [m]."""
    size = np.broadcast_to(np.asarray(radii, dtype=float), len(centres))
    points = (centres[:, None] + size[:, None, None] * _unit_sphere(points_each)).reshape(-1, 3)
    hull = ConvexHull(points)
    faces = np.searchsorted(np.sort(hull.vertices), hull.simplices)
    return TriangularMeshGeometry(points[np.sort(hull.vertices)], _outward(hull, faces))


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


def band(loop: FloatArray, axis: FloatArray, half_width: float, half_thickness: float) -> Geometry:
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
    return TriangularMeshGeometry(points, turned if volume > 0 else turned[:, ::-1])


def add_track(
    motion: Animation,
    node: Visualizer,
    name: str,
    values: npt.NDArray[Any],
    phases: Sequence[float] | FloatArray | None = None,
) -> None:
    """Animate one property of a node over the stride.

    Parameters
    ----------
    motion : Animation
    node : Visualizer
    name : str
        ``position``, ``scale``, ``quaternion`` or ``visible``.
    values : (K, ...) array
        Numbers are interpolated; ``visible`` changes at once.
    phases : (K,) array, optional
        Where in the stride the values hold, 0 to 1; otherwise evenly from its start to its end.
    """
    at = np.linspace(0.0, 1.0, len(values)) if phases is None else np.asarray(phases, dtype=float)
    clip = motion.clips.setdefault(node.path, AnimationClip(fps=1))
    clip.tracks[name] = AnimationTrack(name, _TRACK_TYPES[name], at.tolist(), values.tolist())
