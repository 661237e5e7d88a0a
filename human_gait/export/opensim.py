"""The body and its walk for OpenSim: model, motion, ground reaction, external loads, torques.

Every coordinate of the model is a degree of freedom here, with its name and sign; all vectors are
in the axes of OpenSim (`opensim_axes`). The torque of a coordinate is then that of the degree of
freedom, and OpenSim's inverse dynamics of the files is that of this package.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.body.anthropometry import symmetric_inertia
from human_gait.body.joints import WORLD, SegmentJoint, segment_joints
from human_gait.body.limits import position_limits
from human_gait.body.links import GRAVITY
from human_gait.body.person import Body
from human_gait.body.skeleton import DOF_NAMES, PRISMATIC, SIDES
from human_gait.export.markers import marker_set
from human_gait.export.opensim_axes import tensor_to_opensim, to_opensim
from human_gait.export.opensim_shapes import add_box, add_capsules, numbers
from human_gait.results.names import FORCES
from human_gait.walk.gait import Samples

_VERSION = "40000"  # of the format: OpenSim 4.0 and later read it
_KINDS = ("rotation", "translation")
_PARTS = ("foot", "toe")


def save_model(body: Body, path: Path) -> None:
    """Write a body as OpenSim model: segments, joints, markers, the load."""
    root = ET.Element("OpenSimDocument", Version=_VERSION)
    model = ET.SubElement(root, "Model", name="human")
    _add(model, "gravity", to_opensim(GRAVITY))
    _add(model, "length_units", "m")
    _add(model, "force_units", "N")
    bodies = _objects(model, "BodySet", "bodyset")
    joints = _objects(model, "JointSet", "jointset")
    for joint in segment_joints(body):
        segment = body.measures.segments[joint.segment]
        element = _add_body(bodies, joint.segment, segment.mass, segment.com, segment.inertia)
        add_capsules(element, joint.segment, body.measures)
        _add_joint(joints, joint)
    _add_load(model, bodies, joints, body)
    _add_markers(model, body)
    _write(root, path)


def _add_body(
    bodies: ET.Element, name: str, mass: float, com: npt.ArrayLike, inertia: FloatArray
) -> ET.Element:
    """Add a body; com (3,) from its joint and inertia (3, 3) about com, both in the axes here."""
    element = ET.SubElement(bodies, "Body", name=name)
    turned = tensor_to_opensim(inertia)
    _add(element, "mass", mass)
    _add(element, "mass_center", to_opensim(com))
    _add(element, "inertia", [*np.diag(turned), turned[0, 1], turned[0, 2], turned[1, 2]])
    return element


def _add_joint(joints: ET.Element, joint: SegmentJoint) -> None:
    element = ET.SubElement(joints, "CustomJoint", name=f"{joint.segment}_joint")
    _add_sockets(element, joint.parent, joint.segment, joint.offset)
    coordinates = ET.SubElement(element, "coordinates")
    lower, upper = position_limits()
    for i in joint.dofs:
        coordinate = ET.SubElement(coordinates, "Coordinate", name=DOF_NAMES[i])
        _add(coordinate, "default_value", 0.0)
        _add(coordinate, "range", [lower[i], upper[i]])
    _add_transform(element, joint)


def _add_sockets(element: ET.Element, parent: str, child: str, offset: npt.ArrayLike) -> None:
    """Hang the frame of a child at a place of its parent, (3,), [m]."""
    _add(element, "socket_parent_frame", f"{parent}_offset")
    _add(element, "socket_child_frame", f"/bodyset/{child}")
    frames = ET.SubElement(element, "frames")
    frame = ET.SubElement(frames, "PhysicalOffsetFrame", name=f"{parent}_offset")
    _add(frame, "socket_parent", f"/{parent}" if parent == WORLD else f"/bodyset/{parent}")
    _add(frame, "translation", to_opensim(offset))
    _add(frame, "orientation", [0.0, 0.0, 0.0])


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
    _add(element, "coordinates", coordinate)
    _add(element, "axis", axis)
    if coordinate:
        _add(ET.SubElement(element, "LinearFunction", name="function"), "coefficients", [1.0, 0.0])
    else:
        _add(ET.SubElement(element, "Constant", name="function"), "value", 0.0)


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
    forces = _objects(model, "ForceSet", "forceset")
    force = ET.SubElement(forces, "PrescribedForce", name="backpack_weight")
    _add(force, "socket_frame", "/bodyset/thorax")
    _add(force, "pointIsGlobal", "false")
    _add(force, "forceIsGlobal", "true")
    weight, point = load.mass * GRAVITY, np.array(load.position)
    vectors = {"forceFunctions": weight, "pointFunctions": point}
    for name, vector in vectors.items():
        functions = _objects(force, "FunctionSet", name)
        for value in to_opensim(vector).tolist():
            _add(ET.SubElement(functions, "Constant"), "value", value)


def _add_markers(model: ET.Element, body: Body) -> None:
    markers = _objects(model, "MarkerSet", "markerset")
    for marker in marker_set(body):
        element = ET.SubElement(markers, "Marker", name=marker.name)
        _add(element, "socket_parent_frame", f"/bodyset/{marker.segment}")
        _add(element, "location", to_opensim(marker.position))


def save_coordinates(now: Samples, path: Path) -> None:
    """Write the motion: rotations in degrees, translations in metres."""
    values = np.where(PRISMATIC, now.q, np.rad2deg(now.q))
    _save_table("Coordinates", now.t, dict(zip(DOF_NAMES, values.T, strict=True)), path, True)


def save_torques(now: Samples, path: Path) -> None:
    """Write the net joint torques, as OpenSim's inverse dynamics does: of muscles and tissues."""
    names = [f"{name}_{_torque_kind(i)}" for i, name in enumerate(DOF_NAMES)]
    columns = dict(zip(names, now.tau.T, strict=True))
    _save_table("Inverse Dynamics Generalized Forces", now.t, columns, path, False)


def _torque_kind(i: int) -> str:
    return "force" if PRISMATIC[i] else "moment"


def _vector(name: str, values: FloatArray) -> dict[str, FloatArray]:
    """Return the columns of vectors (K, 3), turned into the axes of OpenSim."""
    return {f"{name}{axis}": x for axis, x in zip("xyz", to_opensim(values).T, strict=True)}


def save_ground_reaction(now: Samples, path: Path) -> None:
    """Write force, centre of pressure and free moment of each foot, as a force plate has them.

    And what its two parts carry, at the same place: as external loads these give the torque of the
    toe joint, too.
    """
    columns: dict[str, FloatArray] = {}
    for f, side in enumerate(SIDES):
        force, moment = now.grf[:, f], np.outer(now.yaw_moment[:, f], [0.0, 1.0, 0.0])
        place = _held(now.t, now.cop[:, f], np.flatnonzero(force.any(axis=1)))
        columns |= _vector(f"ground_force_{side}_v", force)
        columns |= _vector(f"ground_force_{side}_p", place)
        columns |= _vector(f"ground_torque_{side}_", moment)
        toes = now.toe_share[:, f, None]
        for part, share in zip(_PARTS, (1.0 - toes, toes), strict=True):
            columns |= _vector(f"{part}_{side}_force_v", share * force)
            columns |= _vector(f"{part}_{side}_torque_", share * moment)
    _save_table("ground_reaction", now.t, columns, path, False)


def _held(t: FloatArray, place: FloatArray, loaded: npt.NDArray[np.intp]) -> FloatArray:
    """Return places (K, 3) without jumps: where nothing acts, on the way to the next contact."""
    if not len(loaded):
        return place
    return np.stack([np.interp(t, t[loaded], column[loaded]) for column in place.T], axis=1)


def save_external_loads(path: Path) -> None:
    """Write which columns of the ground reaction act on which bodies."""
    root = ET.Element("OpenSimDocument", Version=_VERSION)
    loads = ET.SubElement(root, "ExternalLoads", name="ground_reaction")
    objects = ET.SubElement(loads, "objects")
    for side in SIDES:
        for part in _PARTS:
            name = f"{part}_{side}"
            force = ET.SubElement(objects, "ExternalForce", name=name)
            _add(force, "applied_to_body", name)
            _add(force, "force_expressed_in_body", WORLD)
            _add(force, "point_expressed_in_body", WORLD)
            _add(force, "force_identifier", f"{name}_force_v")
            _add(force, "point_identifier", f"ground_force_{side}_p")
            _add(force, "torque_identifier", f"{name}_torque_")
            _add(force, "data_source_name", FORCES)
    _add(loads, "datafile", FORCES)
    _write(root, path)


def _save_table(
    title: str, t: FloatArray, columns: Mapping[str, FloatArray], path: Path, in_degrees: bool
) -> None:
    """Write a table of OpenSim's (.mot, .sto) with K rows at times t (K,)."""
    table = np.column_stack([t, *columns.values()]) + 0.0
    header = [
        title,
        "version=1",
        f"nRows={len(t)}",
        f"nColumns={table.shape[1]}",
        f"inDegrees={'yes' if in_degrees else 'no'}",
        f"units: s, m, {'deg' if in_degrees else 'N, N m'}",
        "endheader",
        "\t".join(["time", *columns]),
    ]
    rows = ["\t".join(f"{x:.12g}" for x in row) for row in table.tolist()]
    path.write_text("\n".join([*header, *rows, ""]), encoding="utf-8")


def _objects(parent: ET.Element, kind: str, name: str) -> ET.Element:
    return ET.SubElement(ET.SubElement(parent, kind, name=name), "objects")


def _add(parent: ET.Element, tag: str, value: str | float | Sequence[float] | FloatArray) -> None:
    """Add an element with a text, or with numbers that read back exactly."""
    ET.SubElement(parent, tag).text = value if isinstance(value, str) else numbers(value)


def _write(root: ET.Element, path: Path) -> None:
    ET.indent(root)
    ET.ElementTree(root).write(path, encoding="UTF-8", xml_declaration=True)
