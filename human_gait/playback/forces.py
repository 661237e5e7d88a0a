"""What acts on a walker in a scene: the zero moment point and an arrow of force at each foot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from meshcat import Visualizer
from meshcat.animation import Animation
from meshcat.geometry import Cylinder

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import GRAVITY, SIDES_IN_WORDS
from human_gait.playback.drawing import add_track, glowing
from human_gait.playback.looks import ARROW_LENGTH, COLOURS

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait, Samples

ARROW_HEAD = 0.04
"""Length of its head, of the stature; a short arrow is smaller all over."""

_LEAST_ARROW = 0.01  # [m]; what is shorter is not drawn


def draw_markers(path: Visualizer, stature: float) -> None:
    """Draw the zero moment point and, along y from the origin, an arrow for each foot."""
    path["zmp/dot"].set_object(Cylinder(0.004, 0.022), glowing(COLOURS["zmp"]))
    thick, head = 0.008 * stature, ARROW_HEAD * stature
    for name in SIDES_IN_WORDS:
        arrow, colour = path[f"ground_reaction/{name}"], glowing(COLOURS[name])
        arrow["shaft/rod"].set_object(Cylinder(1.0, thick), colour)
        arrow["shaft/rod"].set_transform(_raised(0.5))
        cone = Cylinder(head, radiusTop=0.0, radiusBottom=2.2 * thick)
        arrow["tip/cone"].set_object(cone, colour)
        arrow["tip/cone"].set_transform(_raised(head / 2))


def _raised(height: float) -> FloatArray:
    transform = np.eye(4)
    transform[1, 3] = height
    return transform


def animate_forces(motion: Animation, parent: Visualizer, gait: Gait, instants: Samples) -> None:
    """Let the arrows follow the ground reaction forces."""
    subject = gait.body.subject
    unit = ARROW_LENGTH * subject.stature / (subject.mass * GRAVITY)
    head = ARROW_HEAD * subject.stature
    for f, name in enumerate(SIDES_IN_WORDS):
        _animate_arrow(motion, parent[name], unit * instants.grf[:, f], instants.cop[:, f], head)


def _animate_arrow(
    motion: Animation, arrow: Visualizer, vector: FloatArray, start: FloatArray, head: float
) -> None:
    """Let an arrow follow a vector (K, 3) at its start (K, 3), [m]; hide it where it is short."""
    length = np.linalg.norm(vector, axis=1)
    shown = length > _LEAST_ARROW
    held = _nearest(shown)  # where it is hidden: else it would fly there between two frames
    length = np.maximum(length, _LEAST_ARROW)
    size = np.minimum(1.0, length / (2 * head))
    shaft = length - size * head
    add_track(motion, arrow, "visible", shown)
    add_track(motion, arrow, "position", start[held])
    add_track(motion, arrow, "quaternion", _from_y((vector / length[:, None])[held]))
    add_track(motion, arrow["shaft"], "scale", np.stack([size, shaft, size], axis=1))
    add_track(motion, arrow["tip"], "position", np.outer(shaft, [0.0, 1.0, 0.0]))
    add_track(motion, arrow["tip"], "scale", np.outer(size, [1.0, 1.0, 1.0]))


def _nearest(valid: npt.NDArray[np.bool_]) -> IntArray:
    """Return for each index the nearest index that is valid (itself if none is)."""
    (among,) = np.nonzero(valid)
    index = np.arange(len(valid))
    return among[abs(index[:, None] - among).argmin(axis=1)] if len(among) else index


def _from_y(direction: FloatArray) -> FloatArray:
    """Return the quaternions (K, 4), as x, y, z, w, that turn the y axis to directions (K, 3)."""
    x, y, z = direction.T
    quaternion = np.stack([z, np.zeros_like(x), -x, 1.0 + y], axis=1)
    return np.asarray(quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True))
