"""The ground of a scene: tiles, footholds, and the support polygon of the instant."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from meshcat import Visualizer
from meshcat.animation import Animation

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import SIDES_IN_WORDS
from human_gait.playback.drawing import add_track, geometry, matte, sheer
from human_gait.playback.looks import COLOURS, FOOTHOLDS
from human_gait.playback.shapes import flat

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait

_GROUND, _TILE = 0xDDDAD3, 0xD1CDC4
_STRIDES_OF_GROUND = 12  # before and behind the walker
_TILES_ACROSS = 21  # odd: a tile in the middle
_LAYER = 0.002  # height of one flat thing above another, [m]


def draw_ground(path: Visualizer, gait: Gait) -> None:
    """Draw the ground, tiles as long as a step and the footholds of many strides."""
    repeats = _ahead(gait)
    plane, tiles = path["ground/plane"], path["ground/tiles"]
    everywhere = flat([_rectangle(0.0, 0.0, 160.0, 160.0)], -2 * _LAYER)
    plane.set_object(geometry(everywhere), matte(_GROUND))
    tiles.set_object(geometry(flat(_tiles(gait.cycle.length, repeats), -_LAYER)), matte(_TILE))
    for step in (0, 1):
        side, outline = gait.plan.outline(step)
        copies = [outline[:, [0, 2]] + [0.0, ahead] for ahead in repeats]
        name = SIDES_IN_WORDS[int(side)]
        path[f"footholds/{name}"].set_object(geometry(flat(copies, 0.0)), matte(FOOTHOLDS[name]))


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


def animate_support(motion: Animation, node: Visualizer, gait: Gait) -> None:
    """Show the support polygon of the instant: each is drawn once and is visible in its time."""
    for k, (start, end, corners) in enumerate(support_polygons(gait)):
        polygon = node[f"polygon{k:02d}"]
        polygon.set_object(geometry(flat([corners], _LAYER)), sheer(COLOURS["support"], 0.75))
        shown = {0.0: start == 0.0, 1.0: False, start: True, end: False}
        phases = sorted(shown)
        add_track(motion, polygon, "visible", np.array([shown[at] for at in phases]), phases)
