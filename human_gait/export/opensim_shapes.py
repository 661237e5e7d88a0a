"""The body as OpenSim draws it: the capsules of ``data/capsules.csv``, a box for the load."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.body.anthropometry import Anthropometry
from human_gait.body.figure import capsules
from human_gait.body.urdf import COLOURS
from human_gait.export.opensim_format import numbers, to_opensim


def add_capsules(body: ET.Element, segment: str, measures: Anthropometry) -> None:
    """Add the shapes of a segment to its body: a cylinder with balls at both ends for each."""
    components = ET.SubElement(body, "components")
    drawn = [capsule for capsule in capsules(measures) if capsule.segment == segment]
    for number, capsule in enumerate(drawn, start=1):
        ends = [to_opensim(end) for end in capsule.ends]
        radius, along = capsule.radius, ends[1] - ends[0]
        half = float(np.sqrt(along @ along)) / 2
        name, colour = f"{segment}_shape{number}", capsule.colour
        size = {"radius": radius, "half_height": half}
        middle, turn = (ends[0] + ends[1]) / 2, _from_y(along)
        _add_shape(components, (f"{name}_side", "Cylinder", colour), (middle, turn), size)
        for end, place in zip("ab", ends, strict=True):
            what = f"{name}_{end}", "Sphere", colour
            _add_shape(components, what, (place, np.zeros(3)), {"radius": radius})


def add_box(body: ET.Element, size: npt.ArrayLike) -> None:
    """Add a box of a size (3,), [m], to left, up and forward, about the origin of a body."""
    half = np.abs(to_opensim(size)) / 2
    components, still = ET.SubElement(body, "components"), (np.zeros(3), np.zeros(3))
    _add_shape(components, ("box", "Brick", "backpack"), still, {"half_lengths": half})


def _add_shape(
    components: ET.Element,
    what: tuple[str, str, str],
    where: tuple[FloatArray, FloatArray],
    size: Mapping[str, float | FloatArray],
) -> None:
    """Add a shape: its name, kind and colour; place and turn; sizes by their names."""
    name, kind, colour = what
    frame = ET.SubElement(components, "PhysicalOffsetFrame", name=name)
    geometry = ET.SubElement(ET.SubElement(frame, "attached_geometry"), kind, name="shape")
    ET.SubElement(geometry, "socket_frame").text = ".."
    look = ET.SubElement(geometry, "Appearance")
    red_green_blue, opacity = COLOURS[colour].rsplit(" ", 1)
    ET.SubElement(look, "opacity").text = opacity
    ET.SubElement(look, "color").text = red_green_blue
    for key, value in size.items():
        ET.SubElement(geometry, key).text = numbers(value)
    ET.SubElement(frame, "socket_parent").text = ".."
    for key, vector in zip(("translation", "orientation"), where, strict=True):
        ET.SubElement(frame, key).text = numbers(vector)


def _from_y(along: FloatArray) -> FloatArray:
    """Return the angles of Rx Ry Rz, (3,), [rad], that turn y along a vector."""
    x, y, z = along
    return np.array([np.arctan2(z, y), 0.0, -np.arctan2(x, np.hypot(y, z))])
