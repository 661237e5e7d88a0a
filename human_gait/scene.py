"""The walk as a scene of MeshCat: commands that build, light and animate it.

The scene slides backwards at walking speed, so the walker stays in view; after every stride the
picture is the same again, which makes a loop endless.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import umsgpack  # type: ignore[import-untyped]  # comes with meshcat, without types
from meshcat import Visualizer
from meshcat.animation import Animation, AnimationClip, AnimationTrack
from meshcat.geometry import (
    Box,
    Cylinder,
    Geometry,
    MeshBasicMaterial,
    MeshLambertMaterial,
    TriangularMeshGeometry,
)
from scipy.spatial import ConvexHull

from human_gait.model import build_model
from human_gait.skeleton import GRAVITY, SEGMENTS
from human_gait.urdf import urdf_text

if TYPE_CHECKING:
    from human_gait.body import Body
    from human_gait.gait import Gait, Samples

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]

FRAMES_PER_STEP = 28
"""About 50 frames a second; the browser interpolates between them."""

ARROW_LENGTH = 0.45
"""Length of the arrow of a force of one body weight, of the stature."""

FEET = ("right", "left")
COLOURS = {"right": 0xD55E00, "left": 0x0072B2, "zmp": 0xE3008C}  # two of Okabe and Ito's
_FOOTHOLDS = {"right": 0xEBAF80, "left": 0x7DB4D4}
_GROUND, _TILE = 0xDDDAD3, 0xD1CDC4
_SKY = {"top_color": [0.77, 0.85, 0.92], "bottom_color": [0.93, 0.94, 0.94]}
_CAMERA = {"fov": 25.0, "near": 0.1, "position": [2.7, 0.75, 4.5]}

_LEAST_ARROW = 0.01  # [m]; what is shorter is not drawn
_STRIDES_OF_GROUND = 12  # before and behind the walker
_TILES_ACROSS = 21  # odd: a tile in the middle
_LAYER = 0.002  # height of one flat thing above another, [m]
_SPHERE_POINTS = 300
_TRUNK = ("spine1", "spine2", "spine3", "thorax")  # one shirt, from below

# From the model's axes (x left, y up, z forward) to MeshCat's (z up).
_TO_MESHCAT = np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


@dataclass
class _Recorder:
    """Takes the place of MeshCat's connection to a browser and keeps what is sent."""

    commands: list[str] = field(default_factory=list)

    def send(self, command: Any) -> None:
        """Keep a command as MeshCat packs it, in single precision, as text."""
        packed = umsgpack.packb(command.lower(), force_float_precision="single")
        self.commands.append(base64.b64encode(packed).decode("ascii"))


@dataclass
class _Command:
    """A command of the viewer for which MeshCat's Python side has no class."""

    content: dict[str, Any]

    def lower(self) -> dict[str, Any]:
        """Return what is sent."""
        return self.content


def scene_commands(gait: Gait, strides: int, repetitions: float) -> list[str]:
    """Return the commands that build and play the scene."""
    recorder = _Recorder()
    vis = Visualizer(window=recorder)
    _set_stage(vis)
    path = _walking_path(vis, gait.body.subject.stature)
    _draw_ground(path, gait)
    _draw_markers(path, gait.body.subject.stature)
    model = build_model(gait.body)
    joints = _draw_body(path["body"], model, gait.body)
    steps = 2 * strides
    instants = gait.instants(np.linspace(0, steps * gait.step_time, steps * FRAMES_PER_STEP + 1))
    motion = Animation(default_framerate=FRAMES_PER_STEP / gait.step_time)
    covered = gait.step_length / gait.step_time * instants.t
    _add_track(motion, path, "position", np.outer(-covered, [0.0, 0.0, 1.0]))
    _add_track(motion, path["zmp"], "position", instants.zmp)
    _animate_body(motion, path["body"], model, joints, instants.q)
    _animate_forces(motion, path["ground_reaction"], gait, instants)
    vis.set_animation(motion, repetitions=repetitions)
    return recorder.commands


def _walking_path(vis: Visualizer, stature: float) -> Visualizer:
    """Return the node that slides back under the walker, in the model's axes."""
    scene = vis["/human_gait"]
    lowered = _TO_MESHCAT.copy()
    lowered[2, 3] = -stature / 2  # the camera looks at the origin
    scene.set_transform(lowered)
    return scene["path"]


def _set_stage(vis: Visualizer) -> None:
    """Place camera and sun; hide MeshCat's own ground, axes and point lights."""
    for name in ("Grid", "Axes", "Lights/PointLightNegativeX", "Lights/PointLightPositiveX"):
        vis["/" + name].set_property("visible", False)
    for key, colour in _SKY.items():
        vis["/Background"].set_property(key, colour)
    for key, value in _CAMERA.items():
        vis["/Cameras/default/rotated/<object>"].set_property(key, value)
    vis.window.send(_Command({"type": "set_object", "path": "/Lights/Sun", "object": _sun()}))
    vis["/Lights/Sun/<object>"].set_property("position", [2.0, -2.5, 4.0])


def _sun() -> dict[str, Any]:
    """Return a light that throws shadows around the walker, as JSON of three.js."""
    view = {"left": -3, "right": 3, "top": 3, "bottom": -3, "near": 0.5, "far": 12}
    camera = {"uuid": "sun-camera", "type": "OrthographicCamera", **view}
    shadow = {"camera": camera, "mapSize": [2048, 2048], "bias": -0.0008, "radius": 3}
    light = {"uuid": "sun", "type": "DirectionalLight", "color": 0xFFFFFF, "intensity": 0.5}
    return {
        "metadata": {"version": 4.5, "type": "Object"},
        "object": {**light, "shadow": shadow},
    }


def _draw_ground(path: Visualizer, gait: Gait) -> None:
    """Draw the ground, tiles as long as a step and the footholds of many strides."""
    stride = 2 * gait.step_length
    repeats = stride * np.arange(-_STRIDES_OF_GROUND, _STRIDES_OF_GROUND + 1)
    plane, tiles = path["ground/plane"], path["ground/tiles"]
    plane.set_object(_flat([_rectangle(0.0, 0.0, 80.0, 80.0)], -2 * _LAYER), _matte(_GROUND))
    tiles.set_object(_flat(_tiles(gait.step_length, repeats), -_LAYER), _matte(_TILE))
    for step in (0, 1):
        side, outline = gait.plan.outline(step)
        copies = [outline[:, [0, 2]] + [0.0, ahead] for ahead in repeats]
        name = FEET[int(side)]
        path[f"footholds/{name}"].set_object(_flat(copies, 0.0), _matte(_FOOTHOLDS[name]))


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


def _flat(polygons: Iterable[FloatArray], height: float) -> Geometry:
    """Return convex polygons, (n, 2) of x and z [m], that lie at one height."""
    vertices: list[FloatArray] = []
    faces: list[list[int]] = []
    for corners in polygons:
        first, n = len(vertices), len(corners)
        vertices += [np.array([x, height, z]) for x, z in corners]
        faces += [[first, first + i, first + i + 1] for i in range(1, n - 1)]
    return TriangularMeshGeometry(vertices, faces)


def _matte(colour: int) -> MeshLambertMaterial:
    return MeshLambertMaterial(color=colour)


def _glowing(colour: int) -> MeshBasicMaterial:
    """Return a material that shines through the body; transparent things are painted last."""
    return MeshBasicMaterial(color=colour, transparent=True, opacity=0.85, depthTest=False)


def _draw_body(parent: Visualizer, model: pin.Model, body: Body) -> list[int]:
    """Draw the shapes of each link under the name of its joint; return the joints that have any."""
    visuals = pin.buildGeomFromUrdfString(model, urdf_text(body), pin.GeometryType.VISUAL)
    shapes = [*visuals.geometryObjects, *_waist(model, list(visuals.geometryObjects))]
    shapes.sort(key=lambda shape: int(shape.parentJoint))
    groups = groupby(shapes, lambda shape: (shape.parentJoint, *shape.meshColor))
    for k, ((joint, red, green, blue, _), part) in enumerate(groups):
        colour = bytes(round(255 * share) for share in (red, green, blue))
        node = parent[f"{model.names[joint]}/part{k:02d}"]
        _draw_part(node, list(part), int.from_bytes(colour))
    return sorted({int(shape.parentJoint) for shape in shapes})


def _waist(model: pin.Model, shapes: list[pin.GeometryObject]) -> list[pin.GeometryObject]:
    """Return copies of the lowest capsule of each part of the trunk for the part below it.

    A part of the trunk then reaches up to the next one, and no seam shows between them.
    """
    data = model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    copies = []
    for lower, upper in pairwise(1 + SEGMENTS[name] for name in _TRUNK):
        across = data.oMi[lower].actInv(data.oMi[upper])
        for shape in [shape for shape in shapes if shape.parentJoint == upper][:3]:
            copy = shape.copy()
            copy.parentJoint, copy.placement = lower, across * shape.placement
            copies.append(copy)
    return copies


def _draw_part(node: Visualizer, shapes: list[pin.GeometryObject], colour: int) -> None:
    """Draw the shapes of one colour as one rounded surface; a box as a box."""
    first = shapes[0]
    if isinstance(first.geometry, pin.coal.Box):
        node.set_object(Box((2 * first.geometry.halfSide).tolist()), _matte(colour))
        node.set_transform(first.placement.homogeneous)
    else:
        node.set_object(_rounded(shapes), _matte(colour))


def _rounded(shapes: list[pin.GeometryObject]) -> Geometry:
    """Return the convex hull of the spheres that end the capsules of a part."""
    balls = [shape for shape in shapes if isinstance(shape.geometry, pin.coal.Sphere)]
    points = np.concatenate(
        [ball.placement.translation + ball.geometry.radius * _UNIT_SPHERE for ball in balls]
    )
    hull = ConvexHull(points)
    faces = np.searchsorted(np.sort(hull.vertices), hull.simplices)
    return TriangularMeshGeometry(points[np.sort(hull.vertices)], _outward(hull, faces))


def _outward(hull: ConvexHull, faces: IntArray) -> IntArray:
    """Return the faces of a hull with corners that turn counter-clockwise seen from outside."""
    a, b, c = (hull.points[hull.simplices[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    return np.where(inward[:, None], faces[:, ::-1], faces)


def _unit_sphere(n: int) -> FloatArray:
    """Return n points spread evenly over the unit sphere, along a spiral of golden angles."""
    height = 1 - (2 * np.arange(n) + 1) / n
    turn = np.pi * (3 - np.sqrt(5)) * np.arange(n)
    ring = np.sqrt(1 - height**2)
    return np.stack([ring * np.cos(turn), height, ring * np.sin(turn)], axis=1)


_UNIT_SPHERE = _unit_sphere(_SPHERE_POINTS)


def _draw_markers(path: Visualizer, stature: float) -> None:
    """Draw the zero moment point and, along y from the origin, an arrow for each foot."""
    path["zmp/dot"].set_object(Cylinder(0.004, 0.022), _glowing(COLOURS["zmp"]))
    thick, head = 0.008 * stature, 0.04 * stature
    for name in FEET:
        arrow, colour = path[f"ground_reaction/{name}"], _glowing(COLOURS[name])
        arrow["shaft/rod"].set_object(Cylinder(1.0, thick), colour)
        arrow["shaft/rod"].set_transform(_raised(0.5))
        cone = Cylinder(head, radiusTop=0.0, radiusBottom=2.2 * thick)
        arrow["tip/cone"].set_object(cone, colour)
        arrow["tip/cone"].set_transform(_raised(head / 2))


def _raised(height: float) -> FloatArray:
    transform = np.eye(4)
    transform[1, 3] = height
    return transform


def _animate_body(
    motion: Animation, parent: Visualizer, model: pin.Model, joints: list[int], q: FloatArray
) -> None:
    """Move the links (their joints' numbers in the model) through the postures (K, 55)."""
    data = model.createData()
    poses = np.array([_joint_poses(model, data, posture) for posture in q])
    for j in joints:
        node = parent[model.names[j]]
        _add_track(motion, node, "position", poses[:, j, :3])
        _add_track(motion, node, "quaternion", poses[:, j, 3:])


def _joint_poses(model: pin.Model, data: pin.Data, q: FloatArray) -> list[FloatArray]:
    """Return position and quaternion (x, y, z, w) of every joint of the model."""
    pin.forwardKinematics(model, data, q)
    return [pin.SE3ToXYZQUAT(placement) for placement in data.oMi]


def _animate_forces(motion: Animation, parent: Visualizer, gait: Gait, instants: Samples) -> None:
    """Let the arrows follow the ground reaction forces."""
    subject = gait.body.subject
    unit = ARROW_LENGTH * subject.stature / (subject.mass * GRAVITY)
    for f, name in enumerate(FEET):
        _animate_arrow(motion, parent[name], unit * instants.grf[:, f], instants.cop[:, f])


def _animate_arrow(
    motion: Animation, arrow: Visualizer, vector: FloatArray, start: FloatArray
) -> None:
    """Let an arrow follow a vector (K, 3) at its start (K, 3), [m]; hide it where it is short."""
    length = np.linalg.norm(vector, axis=1)
    shown = length > _LEAST_ARROW
    held = _nearest(shown)  # where it is hidden: else it would fly there between two frames
    length = np.maximum(length, _LEAST_ARROW)
    ones = np.ones_like(length)
    _add_track(motion, arrow, "visible", shown)
    _add_track(motion, arrow, "position", start[held])
    _add_track(motion, arrow, "quaternion", _from_y((vector / length[:, None])[held]))
    _add_track(motion, arrow["shaft"], "scale", np.stack([ones, length, ones], axis=1))
    _add_track(motion, arrow["tip"], "position", np.outer(length, [0.0, 1.0, 0.0]))


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


_TRACK_TYPES = {
    "position": "vector3",
    "scale": "vector3",
    "quaternion": "quaternion",
    "visible": "bool",
}


def _add_track(motion: Animation, node: Visualizer, name: str, values: npt.NDArray[Any]) -> None:
    """Animate one property of a node with one value per frame."""
    clip = motion.clips.setdefault(node.path, AnimationClip(fps=motion.default_framerate))
    frames = list(range(len(values)))
    clip.tracks[name] = AnimationTrack(name, _TRACK_TYPES[name], frames, values.tolist())
