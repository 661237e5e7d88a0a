"""A walker on the ground as a picture: what the page shows, drawn by `raster`.

The ground slides backwards at walking speed, as in the page, so that a stride ends as it began.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import GRAVITY, SIDES_IN_WORDS
from human_gait.playback.looks import ARROW_LENGTH, COLOURS, FOOTHOLDS
from human_gait.playback.parts import drawn_parts, link_poses
from human_gait.playback.raster import Camera, camera_axes, seen

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait

Image = npt.NDArray[np.uint8]
Drawn = npt.NDArray[np.float32]

VIEWS = {  # where the camera is from the walker: left, up, forward
    "side": (-1.0, 0.06, 0.0),
    "front": (0.0, 0.06, 1.0),
    "quarter": (-0.85, 0.14, 0.51),
}
"""Views of a walker, from the right side, the front or between them."""

_SLOPE = float(np.tan(np.deg2rad(12.5)))  # of half the angle of view
_MARGIN = 0.06  # around the walker, of the picture
_FINER = 2  # pixels are made of this many, each way
_SUN = np.array([-2.5, 4.0, 2.0]) / np.linalg.norm([-2.5, 4.0, 2.0])
_AMBIENT, _FROM_BELOW, _SUNLIGHT = 0.56, 0.40, 0.56
_TILES = np.array([[0xDE, 0xDB, 0xD4], [0xCF, 0xCB, 0xC2]], dtype=np.float32)
_HAZE, _SKY = np.array([0xE9, 0xED, 0xEF]), np.array([0xC4, 0xD8, 0xEA])
_FOOTHOLDS = 4  # before and behind the walker
_FAR = (7.0, 22.0)  # where the ground begins to fade, and has, [m]
_CELL = 0.012  # of the shadow on the ground, [m]
_SOFT, _DARK = 1.6, 0.42  # width of the edge of the shadow [cells], and how dark it is
_LEAST_ARROW = 0.01  # [m]
_PHASES, _SOME = 12, 3  # of the stride and of the vertices, for what a walker reaches


@dataclass(frozen=True, eq=False)
class Surface:
    """All surfaces of a walker as one.

    Attributes
    ----------
    vertices, normals : (n, 3) arrays
        In the frame of the link of each.
    link : (n,) int array
    faces : (m, 3) int array
    colours : (m, 3) array
        Red, green and blue of each face, 0 to 255.
    """

    vertices: FloatArray
    normals: FloatArray
    link: IntArray
    faces: IntArray
    colours: FloatArray


class Walker:
    """A walker who can be seen at any phase of the stride.

    Parameters
    ----------
    gait : Gait
    """

    def __init__(self, gait: Gait) -> None:
        self.gait = gait

    @cached_property
    def surface(self) -> Surface:
        """What is drawn of body and load."""
        parts = drawn_parts(self.gait.body)
        sizes = [len(part.mesh.vertices) for part in parts]
        starts = np.cumsum([0, *sizes])
        colours = [_rgb(part.colour) for part in parts]
        return Surface(
            np.concatenate([part.mesh.vertices for part in parts]),
            np.concatenate([part.mesh.normals for part in parts]),
            np.repeat([part.link for part in parts], sizes),
            np.concatenate([p.mesh.faces + at for p, at in zip(parts, starts, strict=False)]),
            np.repeat(np.array(colours, dtype=float), [len(p.mesh.faces) for p in parts], axis=0),
        )

    def travelled(self, phase: float) -> float:
        """Return how far the walk has gone at a phase of the stride, 0 to 1, [m]."""
        return float(self.gait.cycle.length * (1.0 + 2.0 * phase))

    def placed(self, phase: float) -> tuple[FloatArray, FloatArray]:
        """Return vertices and normals (n, 3) at a phase; the ground slides, the walker stays."""
        q = self.gait.q([self.gait.step_time * (1.0 + 2.0 * phase)])
        pose = link_poses(self.gait.body, q)[0][self.surface.link]
        vertices = np.einsum("nij,nj->ni", pose[:, :3, :3], self.surface.vertices) + pose[:, :3, 3]
        vertices[:, 2] -= self.travelled(phase)
        return vertices, np.einsum("nij,nj->ni", pose[:, :3, :3], self.surface.normals)

    def forces(self, phase: float) -> Iterator[tuple[str, FloatArray, FloatArray]]:
        """Yield side, centre of pressure and force (as long as its arrow) of loaded feet, [m]."""
        now = self.gait.instants([self.gait.step_time * (1.0 + 2.0 * phase)])
        subject = self.gait.body.subject
        unit = ARROW_LENGTH * subject.stature / (subject.mass * GRAVITY)
        for f, side in enumerate(SIDES_IN_WORDS):
            force = unit * now.grf[0, f]
            if np.linalg.norm(force) > _LEAST_ARROW:
                yield side, now.cop[0, f] - [0.0, 0.0, self.travelled(phase)], force

    @cached_property
    def reach(self) -> FloatArray:
        """Where body and load are in the stride, (n, 3), [m], with a place on the ground."""
        found = [self.placed(phase)[0][::_SOME] for phase in np.arange(_PHASES) / _PHASES]
        reached = np.concatenate([*found, np.zeros((1, 3))])
        low = [-np.inf, 0.0, -np.inf]  # nothing is seen below the ground
        return np.asarray(np.maximum(reached, low))


def stage_for(
    walkers: Sequence[Walker], view: str, size: tuple[int, int], plain: bool = False
) -> Stage:
    """Return a stage that has all of some walkers in pictures of a size, [px].

    What it draws is finer than that: see `downscaled`.
    """
    width, height = (_FINER * length for length in size)
    axes, away, middle, reach = _seen_from(walkers, view)
    right, up, ahead = axes @ (reach - middle).T
    slope = _SLOPE * (1.0 - _MARGIN)
    needed = np.maximum(abs(up), abs(right) * height / width) / slope - ahead
    return Stage(Camera(middle + needed.max() * away, middle, width, height, _SLOPE), plain)


def cell_width(walkers: Sequence[Walker], view: str, height: int) -> int:
    """Return how wide a picture of a height has to be for some walkers, [px]."""
    axes, _, middle, reach = _seen_from(walkers, view)
    right, up, _ = abs(axes @ (reach - middle).T)
    return int(np.ceil(height * np.clip(right.max() / up.max(), 0.3, 3.0)))


def _seen_from(
    walkers: Sequence[Walker], view: str
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return axes and direction of a camera, the middle of what walkers reach and all of it."""
    away = np.array(VIEWS[view]) / np.linalg.norm(VIEWS[view])
    reach = np.concatenate([walker.reach for walker in walkers])
    middle = (reach.min(axis=0) + reach.max(axis=0)) / 2
    return camera_axes(-away), away, middle, reach


def downscaled(drawn: Drawn) -> Image:
    """Return a picture of `Stage.draw` in its size, without jags."""
    height, width, _ = drawn.shape
    cells = drawn.reshape(height // _FINER, _FINER, width // _FINER, _FINER, 3)
    return np.asarray(cells.mean(axis=(1, 3)).round().clip(0, 255).astype(np.uint8))


class Stage:
    """The ground and the sky before a camera.

    Parameters
    ----------
    camera : Camera
        Above the ground.
    plain : bool
        White, for printing, instead of tiles and sky.
    """

    def __init__(self, camera: Camera, plain: bool = False) -> None:
        self.camera, self._plain = camera, plain
        rays = camera.rays()
        length = np.linalg.norm(rays, axis=-1)
        slope = rays[..., 1] / length
        self._sky = _HAZE + np.clip(2.5 * slope, 0, 1)[..., None] * (_SKY - _HAZE)
        if plain:
            self._sky[:] = 255.0
        below = slope < -1e-4
        self._horizon = int(np.argmax(below.any(axis=1))) if below.any() else camera.height
        ground = rays[self._horizon :]
        reach = -camera.eye[1] / ground[..., 1]
        self._x, self._z = (
            (camera.eye[k] + reach * ground[..., k]).astype(np.float32) for k in (0, 2)
        )
        far = length[self._horizon :] * reach
        fade = np.clip((far - _FAR[0]) / (_FAR[1] - _FAR[0]), 0, 1)[..., None]
        colours = np.full((2, 3), 255.0) if plain else _TILES
        sky = self._sky[self._horizon :]
        self._tiles = [(colour + fade * (sky - colour)).astype(np.float32) for colour in colours]

    def draw(self, walker: Walker, phase: float) -> Drawn:
        """Return the picture (height, width, 3), 0 to 255, of a walker at a phase."""
        vertices, normals = walker.placed(phase)
        camera, surface = self.camera, walker.surface
        picture: Drawn = self._sky.astype(np.float32)
        picture[self._horizon :] = self._ground(walker, phase, vertices)
        found = seen(camera.project(vertices), surface.faces, camera.width, camera.height)
        facing = np.einsum("ij,ijk->ik", found.weights, normals[surface.faces[found.face]])
        facing /= np.linalg.norm(facing, axis=1, keepdims=True)
        picture.reshape(-1, 3)[found.pixel] = surface.colours[found.face] * _light(facing)[:, None]
        if not self._plain:
            self._draw_forces(picture.reshape(-1, 3), walker, phase)
        return picture

    def _ground(self, walker: Walker, phase: float, vertices: FloatArray) -> Drawn:
        """Return what is seen below the horizon, from there on."""
        edge, on = walker.gait.cycle.length, walker.travelled(phase)
        tiles = np.floor(self._x / edge + 0.5) + np.floor((self._z + on) / edge + 0.5)
        picture: Drawn = np.where((tiles.astype(np.int32) & 1)[..., None], *self._tiles)
        if not self._plain:
            self._paint_footholds(picture, walker, phase)
        self._darken(picture, vertices, walker.surface.faces)
        return picture

    def _paint_footholds(self, picture: Drawn, walker: Walker, phase: float) -> None:
        """Paint where the feet stand."""
        plan, camera = walker.gait.plan, self.camera
        now, flat = int(2 * phase) + 1, picture.reshape(-1, 3)
        for step in range(now - _FOOTHOLDS, now + _FOOTHOLDS + 2):
            side, outline = plan.outline(step)
            corners = outline - [0.0, 0.0, walker.travelled(phase)]
            fan = np.array([[0, i, i + 1] for i in range(1, len(corners) - 1)])
            faces = np.concatenate([fan, fan[:, ::-1]])
            found = seen(camera.project(corners), faces, camera.width, camera.height)
            place = found.pixel - self._horizon * camera.width
            flat[place[place >= 0]] = _rgb(FOOTHOLDS[SIDES_IN_WORDS[int(side)]])

    def _draw_forces(self, picture: Drawn, walker: Walker, phase: float) -> None:
        """Draw the ground reaction as an arrow at each foot; it shines through the body."""
        for side, start, force in walker.forces(phase):
            tail, tip = self.camera.project(np.stack([start, start + force]))[:, :2]
            points, faces = _arrow(tail, tip, self.camera.height)
            found = seen(points, faces, self.camera.width, self.camera.height)
            picture[found.pixel] += 0.85 * (_rgb(COLOURS[side]) - picture[found.pixel])

    def _darken(self, picture: Drawn, vertices: FloatArray, faces: IntArray) -> None:
        """Darken the ground where the walker keeps the sun from it."""
        cast = (vertices - np.outer(vertices[:, 1] / _SUN[1], _SUN))[:, [0, 2]] / _CELL
        low = np.floor(cast.min(axis=0)) - 4 * _SOFT
        width, height = np.ceil(cast.max(axis=0) - low + 4 * _SOFT).astype(int)
        dark = np.zeros((height, width), dtype=np.float32)
        points = np.column_stack([cast - low, np.ones(len(cast))])
        dark.flat[seen(points, faces, width, height).pixel] = _DARK
        column, row = self._x / _CELL - low[0] - 0.5, self._z / _CELL - low[1] - 0.5
        under = (column > 0) & (column < width) & (row > 0) & (row < height)
        lost = _between(_softened(dark), row[under], column[under])
        picture[under] *= 1.0 - lost[:, None]


def _softened(dark: Drawn) -> FloatArray:
    """Return a shadow (m, n) with soft edges: blurred by a Gaussian of `_SOFT` cells."""
    apart = (np.subtract.outer(np.arange(n), np.arange(n)) / _SOFT for n in dark.shape)
    down, across = (np.exp(-(d**2) / 2.0) / (np.sqrt(2.0 * np.pi) * _SOFT) for d in apart)
    return np.asarray(down @ dark @ across)


def _between(grid: FloatArray, row: FloatArray, column: FloatArray) -> FloatArray:
    """Return what is at places within a grid (m, n), linearly from the four cells around."""
    m, n = grid.shape
    i, k = np.minimum(row.astype(int), m - 2), np.minimum(column.astype(int), n - 2)
    down, right = row - i, column - k
    upper, lower = (grid[j, k] + right * (grid[j, k + 1] - grid[j, k]) for j in (i, i + 1))
    return np.asarray(upper + down * (lower - upper))


def _arrow(tail: FloatArray, tip: FloatArray, height: int) -> tuple[FloatArray, IntArray]:
    """Return an arrow from place to place, [px], as corners and faces."""
    along = tip - tail
    length = max(float(np.linalg.norm(along)), 1e-3)
    thick, head = 0.006 * height, min(0.036 * height, length / 2)
    along = along / length
    across, neck = np.array([-along[1], along[0]]), tip - head * along
    shaft = [place + sign * thick / 2 * across for place in (tail, neck) for sign in (-1, 1)]
    flat = np.array([*shaft, neck - 0.4 * head * across, neck + 0.4 * head * across, tip])
    faces = np.array([[0, 1, 2], [1, 3, 2], [4, 5, 6]])
    return np.column_stack([flat, np.ones(len(flat))]), np.concatenate([faces, faces[:, ::-1]])


def _rgb(colour: int) -> FloatArray:
    return np.array(list(colour.to_bytes(3)), dtype=float)


def _light(facing: FloatArray) -> FloatArray:
    """Return how bright a surface is that faces a direction (n, 3)."""
    sky = (1.0 + facing[:, 1]) / 2
    ambient = _FROM_BELOW + sky * (_AMBIENT - _FROM_BELOW)
    return np.asarray(ambient + _SUNLIGHT * np.maximum(facing @ _SUN, 0.0))
