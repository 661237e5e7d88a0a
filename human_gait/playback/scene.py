"""One walk, or two, as a scene of MeshCat: commands that build, light and animate it.

The scene slides backwards at walking speed, so the walker stays in view; after every stride the
picture is the same again, which makes a loop of one stride endless. The stride is the gait cycle of
the right leg, from its heel strike at t = T to the next at 3 T.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from meshcat import Visualizer
from meshcat.animation import Animation

from human_gait.arrays import FloatArray
from human_gait.playback.drawing import (
    Command,
    Recorder,
    add_track,
)
from human_gait.playback.drawn_body import animate_body, draw_body
from human_gait.playback.forces import animate_forces, draw_markers
from human_gait.playback.ground import animate_support, draw_ground
from human_gait.playback.picture import Walker

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait, Samples


FRAMES_PER_STEP = 30
"""About 50 frames a second; the browser interpolates between them."""


WALKERS = ("first", "second", "third", "fourth", "fifth", "sixth")
"""Names of the nodes of the walkers below ``/human_gait``."""

_CAMERA = {"fov": 25.0, "near": 0.1}
_LIGHTS = {"AmbientLight": 0.52, "FillLight": 0.3}
_SUN = 0.58


# From the model's axes (x left, y up, z forward) to MeshCat's (z up).
_TO_MESHCAT = np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


@dataclass(frozen=True)
class DrawnStride:
    """A walk over the gait cycle of its right leg.

    Attributes
    ----------
    gait : Gait
    instants : Samples
        At `FRAMES_PER_STEP` intervals in each of the two steps, both ends included.
    """

    gait: Gait
    instants: Samples

    @cached_property
    def reach(self) -> FloatArray:
        """How far body and load reach from the origin below the walker, (3,), [m]."""
        return np.asarray(abs(Walker(self.gait).reach).max(axis=0))


def stride_of(gait: Gait) -> DrawnStride:
    """Return the stride from right heel strike, t = T, to the next, 3 T."""
    phase = np.linspace(0.0, 1.0, 2 * FRAMES_PER_STEP + 1)
    return DrawnStride(gait, gait.instants(gait.step_time * (1.0 + 2.0 * phase)))


def extent(strides: Sequence[DrawnStride]) -> FloatArray:
    """Return how much room walkers and loads take: across, up and along, (3,), [m].

    Across and along are twice the greatest distance from the middle; up is at least the stature.
    """
    reach = np.array([stride.reach for stride in strides]).max(axis=0)
    statures = [stride.gait.body.subject.stature for stride in strides]
    return np.array([2 * reach[0], max(reach[1], *statures), 2 * reach[2]])


def scene_commands(strides: Sequence[DrawnStride]) -> list[str]:
    """Return the commands that build the scene of walkers, and their animation.

    All of it lasts one unit of MeshCat's time, the phase of the stride.
    """
    recorder = Recorder()
    vis = Visualizer(window=recorder)
    _set_stage(vis)
    scene = vis["/human_gait"]
    lowered = _TO_MESHCAT.copy()
    # The camera looks at the origin, half-way up the tallest.
    lowered[2, 3] = -extent(strides)[1] / 2
    scene.set_transform(lowered)
    motion = Animation()
    for name, stride in zip(WALKERS, strides, strict=False):
        _add_walker(motion, scene[f"{name}/path"], stride)
    vis.set_animation(motion, play=False, repetitions=float("inf"))
    return recorder.commands


def _add_walker(motion: Animation, path: Visualizer, stride: DrawnStride) -> None:
    """Draw a walker and a path that slides back under it, in the model's axes."""
    gait, instants = stride.gait, stride.instants
    draw_ground(path, gait)
    draw_markers(path, gait.body.subject.stature)
    draw_body(path["body"], gait.body)
    covered = gait.cycle.length / gait.cycle.period * instants.t
    add_track(motion, path, "position", np.outer(-covered, [0.0, 0.0, 1.0]))
    add_track(motion, path["zmp"], "position", instants.zmp)
    animate_body(motion, path["body"], gait.body, instants.q)
    animate_support(motion, path["support"], gait)
    animate_forces(motion, path["ground_reaction"], gait, instants)


def _set_stage(vis: Visualizer) -> None:
    """Place camera and sun; hide MeshCat's own ground, axes and point lights."""
    for name in ("Grid", "Axes", "Lights/PointLightNegativeX", "Lights/PointLightPositiveX"):
        vis["/" + name].set_property("visible", False)
    for name, intensity in _LIGHTS.items():
        vis[f"/Lights/{name}/<object>"].set_property("intensity", intensity)
    for key, value in _CAMERA.items():
        vis["/Cameras/default/rotated/<object>"].set_property(key, value)
    vis.window.send(Command({"type": "set_object", "path": "/Lights/Sun", "object": _sun()}))
    vis["/Lights/Sun/<object>"].set_property("position", [2.0, -2.5, 4.0])


def _sun() -> dict[str, Any]:
    """Return a light that throws shadows around the walker, as JSON of three.js."""
    view = {"left": -2, "right": 2, "top": 2, "bottom": -2, "near": 0.5, "far": 12}
    camera = {"uuid": "sun-camera", "type": "OrthographicCamera", **view}
    shadow = {"camera": camera, "mapSize": [1024, 1024], "bias": -0.0015, "radius": 3}
    light = {"uuid": "sun", "type": "DirectionalLight", "color": 0xFFFFFF, "intensity": _SUN}
    return {
        "metadata": {"version": 4.5, "type": "Object"},
        "object": {**light, "shadow": shadow},
    }
