"""Triangles to pixels in numpy: a camera, and what it sees of a surface.

It needs no display, browser or graphics card, and is the same everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from human_gait.arrays import FloatArray, IntArray

_UP = np.array([0.0, 1.0, 0.0])
_NEAR = 0.05  # [m]


class Seen(NamedTuple):
    """What is seen: for n pixels which face, and where in it.

    Attributes
    ----------
    pixel : (n,) int array
        Place in the flattened picture.
    face : (n,) int array
    weights : (n, 3) array
        Shares of the corners of the face.
    """

    pixel: IntArray
    face: IntArray
    weights: FloatArray


@dataclass(frozen=True, eq=False)
class Camera:
    """Where a picture is taken from.

    Attributes
    ----------
    eye, target : (3,) arrays, [m]
    width, height : int, [px]
    slope : float
        Tangent of half the vertical angle of view.
    """

    eye: FloatArray
    target: FloatArray
    width: int
    height: int
    slope: float

    @property
    def axes(self) -> FloatArray:
        """Unit vectors (3, 3): to the right, up, ahead, as rows."""
        return camera_axes(self.target - self.eye)

    def project(self, points: FloatArray) -> FloatArray:
        """Return columns and rows [px] and inverse depth [1/m] of points (n, 3), as (n, 3)."""
        right, up, ahead = (self.axes @ (points - self.eye).T).astype(np.float32)
        nearness = 1.0 / np.maximum(ahead, _NEAR)
        scale = self.height / 2 / self.slope
        x = self.width / 2 + scale * right * nearness
        y = self.height / 2 - scale * up * nearness
        return np.stack([x, y, nearness], axis=1)

    def rays(self) -> FloatArray:
        """Return the directions (height, width, 3) of all pixels; `ahead` of each is 1."""
        right, up, ahead = self.axes
        x = (np.arange(self.width) + 0.5 - self.width / 2) * 2 * self.slope / self.height
        y = (self.height / 2 - np.arange(self.height) - 0.5) * 2 * self.slope / self.height
        return np.asarray(ahead + x[None, :, None] * right + y[:, None, None] * up)


def camera_axes(ahead: FloatArray) -> FloatArray:
    """Return unit vectors to the right, up and ahead, as rows."""
    forward = ahead / np.linalg.norm(ahead)
    right = np.cross(forward, _UP)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(right, forward), forward])


def seen(points: FloatArray, faces: IntArray, width: int, height: int) -> Seen:
    """Return what is seen of a surface.

    Parameters
    ----------
    points : (n, 3) array
        Column and row, [px], and nearness: of two faces the one with the larger is in front.
    faces : (m, 3) int array
        Corners, counter-clockwise seen from outside (rows count downwards): the back of a face is
        not seen.
    width, height : int, [px]
    """
    corners = points.astype(np.float32)[faces]  # (m, 3, 3)
    origin, ends = corners[:, 0, :2], corners[:, 1:, :2] - corners[:, :1, :2]
    area = ends[:, 0, 0] * ends[:, 1, 1] - ends[:, 0, 1] * ends[:, 1, 0]
    low = np.ceil(corners[:, :, :2].min(axis=1) - 0.5).clip(0).astype(np.int32)
    high = np.floor(corners[:, :, :2].max(axis=1) - 0.5)
    high = high.clip(-1, [width - 1, height - 1]).astype(np.int32)
    shown = np.flatnonzero((area < 0) & (high >= low).all(axis=1))
    low, span = low[shown], (high - low + 1)[shown]
    count = span[:, 0] * span[:, 1]

    def spread(of_face: Any) -> Any:
        """Return what belongs to each face for all places of its rectangle."""
        return np.repeat(of_face, count)

    place = np.arange(count.sum(), dtype=np.int32) - spread((np.cumsum(count) - count).astype("i"))
    broad = spread(span[:, 0])
    row = place // broad
    column = place - row * broad + spread(low[:, 0])
    row += spread(low[:, 1])
    # Shares of the second and the third corner: linear in column and row.
    slopes = ends[shown][:, ::-1, ::-1] * [[1, -1], [-1, 1]] / area[shown, None, None]
    start = -np.einsum("ijk,ik->ij", slopes, origin[shown] - 0.5)
    second, third = (
        spread(slopes[:, k, 0].astype("f")) * column.astype("f")
        + spread(slopes[:, k, 1].astype("f")) * row.astype("f")
        + spread(start[:, k].astype("f"))
        for k in (0, 1)
    )
    inside = np.flatnonzero((second >= 0) & (third >= 0) & (second + third <= 1))
    second, third = second[inside], third[inside]
    weights = np.stack([1 - second - third, second, third], axis=1)
    face, pixel = spread(shown)[inside], (row * width + column)[inside]
    nearness = np.einsum("ij,ij->i", weights, corners[face, :, 2])
    return _nearest(Seen(pixel, face, weights), nearness, width * height)


def _nearest(found: Seen, nearness: FloatArray, n_pixels: int) -> Seen:
    order = np.argsort(nearness, kind="stable").astype(np.int32)
    last = np.full(n_pixels, -1, dtype=np.int32)
    last[found.pixel[order]] = order  # of those for one pixel the last is kept: the nearest
    kept = last[last >= 0]
    return Seen(found.pixel[kept], found.face[kept], found.weights[kept])
