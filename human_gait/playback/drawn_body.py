"""The body as one sees it: rounded parts with skin, hair and clothes, and the backpack with straps.

Nothing here is physics: shapes are those of ``data/capsules.csv``, joined to smooth hulls.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby, pairwise, product

import numpy as np
import pinocchio as pin
from meshcat import Visualizer
from meshcat.animation import Animation
from meshcat.geometry import Geometry, MeshLambertMaterial
from scipy.spatial import ConvexHull

from human_gait.arrays import FloatArray
from human_gait.body.dh import link_to_dh
from human_gait.body.links import anatomical_to_link
from human_gait.body.person import Body
from human_gait.body.skeleton import BRANCHES, PARENT, SEGMENTS
from human_gait.body.urdf import JOINT_NAMES
from human_gait.playback.drawing import add_track, band, matte, rounded

BACKPACK = "backpack"
"""Name of the node of the load, below that of the thorax."""

_TRUNK = ("spine1", "spine2", "spine3", "thorax")  # one shirt, from below
_POINTS, _HEAD_POINTS = 300, 1000  # of each ball
_ROUNDING = 0.14  # of the load's shortest edge
_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))  # of a cube
_STRAP_COLOUR, _STRAP_CORNERS = 0x39402A, 72
_STRAP_APART, _STRAP_HALF_WIDTH, _STRAP_HALF_THICKNESS = 0.046, 0.010, 0.0035  # of the stature
_STRAP_SLANT = 0.35  # outwards per way down
_UNDER_STRAPS = tuple(SEGMENTS[name] for name in ("thorax", "clavicle_r", "clavicle_l"))
# Places on the head, of the stature, in the axes of the body: x left, y up, z forward.
_FACE = {  # centre on the left side, radius, colour
    "eye": ((0.0150, 0.0300, 0.0470), 0.0030, 0x33261F),
    "ear": ((0.0450, 0.0230, 0.0040), 0.0080, 0xDEAD8C),
}


class DrawnBody:
    """The drawn body of one walker.

    Parameters
    ----------
    node : Visualizer
        Its parts go below this, each under the name of its joint.
    body : Body
    """

    def __init__(self, node: Visualizer, body: Body) -> None:
        self._node, self._body = node, body
        self._model = body.model
        self._data = self._model.createData()
        visuals = pin.buildGeomFromUrdfString(self._model, body.urdf, pin.GeometryType.VISUAL)
        pin.forwardKinematics(self._model, self._data, pin.neutral(self._model))
        self._neutral = [placement.copy() for placement in self._data.oMi]
        shapes = list(visuals.geometryObjects)
        self._joints = sorted({int(shape.parentJoint) for shape in shapes})
        self._draw_parts([shape for shape in shapes if not _is_box(shape)])
        self._draw_face()
        for box in filter(_is_box, shapes):
            self._draw_backpack(box, shapes)

    def animate(self, motion: Animation, q: FloatArray) -> None:
        """Move the parts through the postures (K, 55) of a stride."""
        poses = np.array([self._poses(posture) for posture in q])
        for j in self._joints:
            node = self._node[self._model.names[j]]
            add_track(motion, node, "position", poses[:, j, :3])
            add_track(motion, node, "quaternion", poses[:, j, 3:])

    def _poses(self, q: FloatArray) -> list[FloatArray]:
        """Return position and quaternion (x, y, z, w) of every joint of the model."""
        pin.forwardKinematics(self._model, self._data, q)
        return [pin.SE3ToXYZQUAT(placement) for placement in self._data.oMi]

    def _draw_parts(self, shapes: Sequence[pin.GeometryObject]) -> None:
        """Draw the shapes of one colour of one link as one surface."""
        balls = [shape for shape in [*shapes, *self._waist(shapes)] if _is_ball(shape)]
        balls.sort(key=lambda shape: int(shape.parentJoint))
        groups = groupby(balls, lambda shape: (shape.parentJoint, *shape.meshColor))
        for k, ((joint, *_), group) in enumerate(groups):
            part = list(group)
            node = self._node[f"{self._model.names[joint]}/part{k:02d}"]
            fine = _HEAD_POINTS if joint - 1 == SEGMENTS["head"] else _POINTS
            node.set_object(rounded(*_centres_and_radii(part), fine), _dyed(part[0]))

    def _waist(self, shapes: Sequence[pin.GeometryObject]) -> list[pin.GeometryObject]:
        """Return copies of the lowest capsule of each part of the trunk for the part below it.

        A part of the trunk then reaches up to the next one, and no seam shows between them.
        """
        copies = []
        for lower, upper in pairwise(1 + SEGMENTS[name] for name in _TRUNK):
            across = self._neutral[lower].actInv(self._neutral[upper])
            for shape in [shape for shape in shapes if shape.parentJoint == upper][:3]:
                copy = shape.copy()
                copy.parentJoint, copy.placement = lower, across * shape.placement
                copies.append(copy)
        return copies

    def _draw_face(self) -> None:
        """Draw both eyes and ears, whose places are those of the capsules' own axes."""
        head, table = SEGMENTS["head"], self._body.table
        place = link_to_dh(table)[head] @ anatomical_to_link(table)[head]
        for name, (centre, radius, colour) in _FACE.items():
            for side, sign in (("left", 1.0), ("right", -1.0)):
                point = self._body.subject.stature * np.array(centre) * [sign, 1.0, 1.0]
                ball = rounded(
                    (place @ [*point, 1.0])[None, :3], radius * self._body.subject.stature
                )
                self._node[f"{JOINT_NAMES[head]}/{name}_{side}"].set_object(ball, matte(colour))

    def _draw_backpack(self, box: pin.GeometryObject, shapes: list[pin.GeometryObject]) -> None:
        """Draw the load as a box with rounded edges, padded towards the back, and its straps."""
        node = self._node[f"{self._model.names[box.parentJoint]}/{BACKPACK}"]
        half, place = box.geometry.halfSide, box.placement
        radius = 2 * _ROUNDING * half.min()
        node["pack"].set_object(
            rounded(_placed(place, _CORNERS * (half - radius)), radius), _dyed(box)
        )
        straps = [self._strap(shapes, sign) for sign in (1.0, -1.0)]
        for side, strap in zip(("left", "right"), straps, strict=True):
            node[f"strap_{side}"].set_object(strap, matte(_STRAP_COLOUR))
        back = min(_seen_from(place, strap.vertices)[:, 2].min() for strap in straps)
        if back > half[2]:  # there is a gap
            corners = _CORNERS * (0.55 * half)
            corners[:, 2] = np.where(_CORNERS[:, 2] > 0, back + radius, half[2] - radius)
            node["padding"].set_object(
                rounded(_placed(place, corners), radius / 2), matte(_STRAP_COLOUR)
            )

    def _strap(self, shapes: list[pin.GeometryObject], sign: float) -> Geometry:
        """Return a band over a shoulder and under the arm where a slanting plane cuts the chest."""
        stature = self._body.subject.stature
        chest = [s for s in shapes if _is_ball(s) and int(s.parentJoint) - 1 in _UNDER_STRAPS]
        hull = rounded(*_centres_and_radii(chest, self._neutral))
        axis = np.array([sign, _STRAP_SLANT, 0.0]) / np.hypot(1.0, _STRAP_SLANT)
        top = np.array([sign * _STRAP_APART * stature, hull.vertices[:, 1].max(), 0.0])
        loop = _section(hull, axis, float(axis @ top))
        strap = band(loop, axis, _STRAP_HALF_WIDTH * stature, _STRAP_HALF_THICKNESS * stature)
        thorax = self._neutral[1 + SEGMENTS["thorax"]]
        strap.vertices = _seen_from(thorax, strap.vertices).astype(np.float32)
        return strap


def torque_sizes(tau: FloatArray) -> dict[str, FloatArray]:
    """Return how large the torques of the joint above each drawn segment are.

    Parameters
    ----------
    tau : (K, 55) array, [N m]
        Joint torques.

    Returns
    -------
    dict of (K,) array, [N m]
        By the name of the segment's node: the root of the sum of squares over the axes of its
        joint. The pelvis has no joint above it.
    """
    return {
        JOINT_NAMES[link]: np.linalg.norm(tau[:, _joint_above(link)], axis=1)
        for link in SEGMENTS.values()
        if link not in BRANCHES["virtual"]
    }


def _joint_above(link: int) -> list[int]:
    """Return the degrees of freedom between a segment and the next one above."""
    dofs = [link]
    while (above := int(PARENT[dofs[-1]])) not in SEGMENTS.values():
        dofs.append(above)
    return dofs


def _is_box(shape: pin.GeometryObject) -> bool:
    return isinstance(shape.geometry, pin.coal.Box)


def _is_ball(shape: pin.GeometryObject) -> bool:
    """Return whether a shape is one of the balls that end a capsule."""
    return isinstance(shape.geometry, pin.coal.Sphere)


def _centres_and_radii(
    balls: Sequence[pin.GeometryObject], poses: Sequence[pin.SE3] | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return centres (n, 3) and radii (n,) of balls on their links, or placed by the joints."""
    centres = [
        (poses[ball.parentJoint] * ball.placement if poses else ball.placement).translation
        for ball in balls
    ]
    return np.array(centres), np.array([ball.geometry.radius for ball in balls])


def _placed(pose: pin.SE3, points: FloatArray) -> FloatArray:
    return np.asarray(points @ pose.rotation.T + pose.translation)


def _seen_from(pose: pin.SE3, points: FloatArray) -> FloatArray:
    return np.asarray((points - pose.translation) @ pose.rotation)


def _dyed(shape: pin.GeometryObject) -> MeshLambertMaterial:
    return matte(int.from_bytes(bytes(round(255 * share) for share in shape.meshColor[:3])))


def _section(hull: Geometry, axis: FloatArray, offset: float) -> FloatArray:
    """Return the loop (n, 3), evenly spaced, in which the plane axis . p = offset cuts a hull."""
    ends = hull.vertices[np.concatenate([hull.faces[:, [a, (a + 1) % 3]] for a in range(3)])]
    height = ends @ axis - offset
    cut = (height[:, 0] < 0) & (height[:, 1] >= 0)
    share = height[cut, 0] / (height[cut, 0] - height[cut, 1])
    points = ends[cut, 0] + share[:, None] * (ends[cut, 1] - ends[cut, 0])
    corners = points[ConvexHull(points[:, 1:]).vertices]
    closed = np.concatenate([corners, corners[:1]])
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1)))
    even = np.linspace(0.0, length[-1], _STRAP_CORNERS, endpoint=False)
    return np.stack([np.interp(even, length, closed[:, k]) for k in range(3)], axis=1)
