"""The body for OpenSim: segments, joints, markers, the load.

Every coordinate of the model is a degree of freedom here, with its name and sign; all vectors are
in the axes of OpenSim. The torque of a coordinate is then that of the degree of freedom, and
OpenSim's inverse dynamics of the files is that of this package.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.body.anthropometry import symmetric_inertia
from human_gait.body.joints import WORLD, SegmentJoint, segment_joints
from human_gait.body.links import GRAVITY
from human_gait.body.person import Body
from human_gait.body.skeleton import DOF_NAMES, PRISMATIC
from human_gait.export.markers import marker_set
from human_gait.export.notes import Note
from human_gait.export.opensim_format import (
    add,
    add_objects,
    document,
    tensor_to_opensim,
    to_opensim,
    write_xml,
)
from human_gait.export.opensim_shapes import add_box, add_capsules
from human_gait.export.ranges import JointRanges

_KINDS = ("rotation", "translation")


def save_model(body: Body, ranges: JointRanges, note: Note, path: Path) -> None:
    """Write a body as OpenSim model: segments, joints with their ranges, markers, the load."""
    root = document(note, ranges.of_position)
    model = ET.SubElement(root, "Model", name="human")
    add(model, "gravity", to_opensim(GRAVITY))
    add(model, "length_units", "m")
    add(model, "force_units", "N")
    bodies = add_objects(model, "BodySet", "bodyset")
    joints = add_objects(model, "JointSet", "jointset")
    for joint in segment_joints(body):
        segment = body.measures.segments[joint.segment]
        element = _add_body(bodies, joint.segment, segment.mass, segment.com, segment.inertia)
        add_capsules(element, joint.segment, body.measures)
        _add_joint(joints, joint, ranges)
    _add_load(model, bodies, joints, body)
    _add_markers(model, body)
    write_xml(root, path)


def _add_body(
    bodies: ET.Element, name: str, mass: float, com: npt.ArrayLike, inertia: FloatArray
) -> ET.Element:
    """Add a body; com (3,) from its joint and inertia (3, 3) about com, both in the axes here."""
    element = ET.SubElement(bodies, "Body", name=name)
    turned = tensor_to_opensim(inertia)
    add(element, "mass", mass)
    add(element, "mass_center", to_opensim(com))
    add(element, "inertia", [*np.diag(turned), turned[0, 1], turned[0, 2], turned[1, 2]])
    return element


def _add_joint(joints: ET.Element, joint: SegmentJoint, ranges: JointRanges) -> None:
    """Add a joint; what is held in its place is locked, where it rests is within its range."""
    element = ET.SubElement(joints, "CustomJoint", name=f"{joint.segment}_joint")
    _add_sockets(element, joint.parent, joint.segment, joint.offset)
    coordinates = ET.SubElement(element, "coordinates")
    for i in joint.dofs:
        coordinate = ET.SubElement(coordinates, "Coordinate", name=DOF_NAMES[i])
        lower, upper = ranges.lower[i], ranges.upper[i]
        add(coordinate, "default_value", float(np.clip(0.0, lower, upper)))
        add(coordinate, "range", [lower, upper])
        add(coordinate, "locked", "true" if ranges.held[i] else "false")
    _add_transform(element, joint)


def _add_sockets(element: ET.Element, parent: str, child: str, offset: npt.ArrayLike) -> None:
    """Hang the frame of a child at a place of its parent, (3,), [m]."""
    add(element, "socket_parent_frame", f"{parent}_offset")
    add(element, "socket_child_frame", f"/bodyset/{child}")
    frames = ET.SubElement(element, "frames")
    frame = ET.SubElement(frames, "PhysicalOffsetFrame", name=f"{parent}_offset")
    add(frame, "socket_parent", f"/{parent}" if parent == WORLD else f"/bodyset/{parent}")
    add(frame, "translation", to_opensim(offset))
    add(frame, "orientation", [0.0, 0.0, 0.0])


def _add_transform(element: ET.Element, joint: SegmentJoint) -> None:
    """Add the axes in their order: first all translations, then all rotations.

    Axes without a coordinate complete the three of their kind and stay at zero.
    """
    transform = ET.SubElement(element, "SpatialTransform")
    for kind in _KINDS:
        slides = kind == "translation"
        moving = [
            (DOF_NAMES[i], axis)
            for i, axis in zip(joint.dofs, to_opensim(joint.axes), strict=True)
            if PRISMATIC[i] == slides
        ]
        unused = [axis for axis in np.eye(3) if not any(axis @ used for _, used in moving)]
        still = [("", axis) for axis in unused[: 3 - len(moving)]]
        for number, (name, axis) in enumerate([*moving, *still], start=1):
            _add_axis(transform, f"{kind}{number}", name, axis)


def _add_axis(transform: ET.Element, label: str, coordinate: str, axis: FloatArray) -> None:
    element = ET.SubElement(transform, "TransformAxis", name=label)
    add(element, "coordinates", coordinate)
    add(element, "axis", axis)
    if coordinate:
        add(ET.SubElement(element, "LinearFunction", name="function"), "coefficients", [1.0, 0.0])
    else:
        add(ET.SubElement(element, "Constant", name="function"), "value", 0.0)


def _add_load(model: ET.Element, bodies: ET.Element, joints: ET.Element, body: Body) -> None:
    """Add the load: a body welded to the thorax, or its weight alone at a point of the thorax."""
    load = body.load
    if load.mass == 0:
        return
    if load.model == "rigid":
        box = symmetric_inertia(load.mass, np.square(load.size) / 12)
        add_box(_add_body(bodies, "backpack", load.mass, np.zeros(3), box), load.size)
        weld = ET.SubElement(joints, "WeldJoint", name="backpack_joint")
        _add_sockets(weld, "thorax", "backpack", load.position)
        return
    forces = add_objects(model, "ForceSet", "forceset")
    force = ET.SubElement(forces, "PrescribedForce", name="backpack_weight")
    add(force, "socket_frame", "/bodyset/thorax")
    add(force, "pointIsGlobal", "false")
    add(force, "forceIsGlobal", "true")
    weight, point = load.mass * GRAVITY, np.array(load.position)
    vectors = {"forceFunctions": weight, "pointFunctions": point}
    for name, vector in vectors.items():
        functions = add_objects(force, "FunctionSet", name)
        for value in to_opensim(vector).tolist():
            add(ET.SubElement(functions, "Constant"), "value", value)


def _add_markers(model: ET.Element, body: Body) -> None:
    markers = add_objects(model, "MarkerSet", "markerset")
    for marker in marker_set(body):
        element = ET.SubElement(markers, "Marker", name=marker.name)
        add(element, "socket_parent_frame", f"/bodyset/{marker.segment}")
        add(element, "location", to_opensim(marker.position))
