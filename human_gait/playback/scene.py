"""One walk, or two, as a scene of MeshCat: commands that build, light and animate it.

The scene slides backwards at walking speed, so the walker stays in view; after every stride the
picture is the same again, which makes a loop of one stride endless. The stride is the gait cycle of
the right leg, from its heel strike at t = T to the next at 3 T.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from meshcat import Visualizer
from meshcat.animation import Animation
from meshcat.geometry import Cylinder

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import GRAVITY, SIDES_IN_WORDS
from human_gait.playback.drawing import (
    Command,
    Recorder,
    add_track,
    flat,
    glowing,
    matte,
    sheer,
)
from human_gait.playback.drawn_body import DrawnBody

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait, Samples


FRAMES_PER_STEP = 30
"""About 50 frames a second; the browser interpolates between them."""

ARROW_LENGTH = 0.45
"""Length of the arrow of a force of one body weight, of the stature."""

ARROW_HEAD = 0.04
"""Length of its head, of the stature; a short arrow is smaller all over."""

WALKERS = ("first", "second")
"""Names of the nodes of the walkers below ``/human_gait``."""

COLOURS = {  # the feet: two of Okabe and Ito's
    "right": 0xD55E00,
    "left": 0x0072B2,
    "zmp": 0xE3008C,
    "support": 0xF0C000,
}
FOOTHOLDS = {"right": 0xEBAF80, "left": 0x7DB4D4}
_GROUND, _TILE = 0xDDDAD3, 0xD1CDC4
_CAMERA = {"fov": 25.0, "near": 0.1}
_LIGHTS = {"AmbientLight": 0.52, "FillLight": 0.3}
_SUN = 0.58

_LEAST_ARROW = 0.01  # [m]; what is shorter is not drawn
_STRIDES_OF_GROUND = 12  # before and behind the walker
_TILES_ACROSS = 21  # odd: a tile in the middle
_LAYER = 0.002  # height of one flat thing above another, [m]

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


def stride_of(gait: Gait) -> DrawnStride:
    """Return the stride from right heel strike, t = T, to the next, 3 T."""
    phase = np.linspace(0.0, 1.0, 2 * FRAMES_PER_STEP + 1)
    return DrawnStride(gait, gait.instants(gait.step_time * (1.0 + 2.0 * phase)))


def scene_commands(strides: Sequence[DrawnStride]) -> list[str]:
    """Return the commands that build the scene of one walker or two, and their animation.

    All of it lasts one unit of MeshCat's time, the phase of the stride.
    """
    recorder = Recorder()
    vis = Visualizer(window=recorder)
    _set_stage(vis)
    scene = vis["/human_gait"]
    lowered = _TO_MESHCAT.copy()
    # The camera looks at the origin, half-way up the tallest.
    lowered[2, 3] = -max(stride.gait.body.subject.stature for stride in strides) / 2
    scene.set_transform(lowered)
    motion = Animation()
    for name, stride in zip(WALKERS, strides, strict=False):
        _add_walker(motion, scene[f"{name}/path"], stride)
    vis.set_animation(motion, play=False, repetitions=float("inf"))
    return recorder.commands


def _add_walker(motion: Animation, path: Visualizer, stride: DrawnStride) -> None:
    """Draw a walker and a path that slides back under it, in the model's axes."""
    gait, instants = stride.gait, stride.instants
    _draw_ground(path, gait)
    _draw_markers(path, gait.body.subject.stature)
    drawn = DrawnBody(path["body"], gait.body)
    covered = gait.cycle.length / gait.cycle.period * instants.t
    add_track(motion, path, "position", np.outer(-covered, [0.0, 0.0, 1.0]))
    add_track(motion, path["zmp"], "position", instants.zmp)
    drawn.animate(motion, instants.q)
    _animate_support(motion, path["support"], gait)
    _animate_forces(motion, path["ground_reaction"], gait, instants)


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


def _draw_ground(path: Visualizer, gait: Gait) -> None:
    """Draw the ground, tiles as long as a step and the footholds of many strides."""
    repeats = _ahead(gait)
    plane, tiles = path["ground/plane"], path["ground/tiles"]
    plane.set_object(flat([_rectangle(0.0, 0.0, 160.0, 160.0)], -2 * _LAYER), matte(_GROUND))
    tiles.set_object(flat(_tiles(gait.cycle.length, repeats), -_LAYER), matte(_TILE))
    for step in (0, 1):
        side, outline = gait.plan.outline(step)
        copies = [outline[:, [0, 2]] + [0.0, ahead] for ahead in repeats]
        name = SIDES_IN_WORDS[int(side)]
        path[f"footholds/{name}"].set_object(flat(copies, 0.0), matte(FOOTHOLDS[name]))


def _ahead(gait: Gait) -> FloatArray:
    """Return how far ahead the strides begin that the ground is drawn for, [m]."""
    return 2 * gait.cycle.length * np.arange(-_STRIDES_OF_GROUND, _STRIDES_OF_GROUND + 1.0)


def _tiles(edge: float, repeats: Iterable[float]) -> list[FloatArray]:
    """Return the dark tiles of a chequered ground that repeats itself every two tiles."""
    across = np.arange(_TILES_ACROSS) - _TILES_ACROSS // 2
    return [
        _rectangle(x * edge, ahead + (x % 2) * edge, edge, edge)
        for ahead in repeats
        for x in across
    ]


def _rectangle(x: float, z: float, width: float, length: float) -> FloatArray:
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2
    return np.array([x, z]) + corners * [width, length]


def _draw_markers(path: Visualizer, stature: float) -> None:
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


def support_polygons(gait: Gait) -> Iterator[tuple[float, float, FloatArray]]:
    """Return the support polygons of the stride in their order.

    Yields
    ------
    start, end : float
        Phase of the stride, 0 to 1, from and to which it holds: a polygon changes only where a
        part of a foot comes down or goes up.
    polygon : (n, 2) array, [m]
        Corners x and z.
    """
    phases = gait.scenario.phases
    changes = {phases.double_support, phases.ball_off, phases.foot_flat, phases.heel_off}
    events = sorted({0.0, 1.0, *(event for event in changes if 0.0 < event < 1.0)})
    for step in (1, 2):  # t = T ... 3 T
        for start, end in pairwise(events):
            middle = (start + end) / 2 * gait.step_time
            corners = gait.plan.support_polygon(middle, _standing(gait, middle))
            placed = gait.cycle.placed(np.insert(corners, 1, 0.0, axis=1), step)
            yield (step - 1 + start) / 2, (step - 1 + end) / 2, placed[:, [0, 2]]


def _standing(gait: Gait, time: float) -> tuple[int, ...]:
    """Return the feet of which some part stands."""
    touching = gait.plan.contact(np.array([time]))[0]
    return tuple(f for f in range(len(SIDES_IN_WORDS)) if touching[f].any())


def _animate_support(motion: Animation, node: Visualizer, gait: Gait) -> None:
    """Show the support polygon of the instant: each is drawn once and is visible in its time."""
    for k, (start, end, corners) in enumerate(support_polygons(gait)):
        polygon = node[f"polygon{k:02d}"]
        polygon.set_object(flat([corners], _LAYER), sheer(COLOURS["support"], 0.75))
        shown = {0.0: start == 0.0, 1.0: False, start: True, end: False}
        phases = sorted(shown)
        add_track(motion, polygon, "visible", np.array([shown[at] for at in phases]), phases)


def _animate_forces(motion: Animation, parent: Visualizer, gait: Gait, instants: Samples) -> None:
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
