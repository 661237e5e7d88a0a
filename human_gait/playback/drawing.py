"""What pictures in MeshCat are made of: commands as text, materials, shapes and animated tracks.

All tracks of a scene last one unit of MeshCat's time, which is one stride: walks of different pace
are then at the same phase of it.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
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

from human_gait.arrays import FloatArray
from human_gait.playback.shapes import Mesh

_UUID = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")
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


def geometry(mesh: Mesh) -> Geometry:
    """Return a surface as MeshCat takes it."""
    return TriangularMeshGeometry(mesh.vertices, mesh.faces)


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
