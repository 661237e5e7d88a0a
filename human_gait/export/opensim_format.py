"""What files for OpenSim have in common: axes, numbers and elements of XML.

From the axes here (x left, y up, z forward) to those of OpenSim (x forward, y up, z right) it is a
turn by a right angle about the vertical: x' = z, y' = y, z' = -x. It holds for every vector and for
the axes of segments, of forces and of markers, in all files for OpenSim and in TRC and C3D.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.export.notes import Note

TURN: FloatArray = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""(3, 3) rotation from the axes here to those of OpenSim."""

AXES = {"forward": "+X", "up": "+Y", "right": "+Z"}
"""Where OpenSim's axes point."""


def to_opensim(vectors: npt.ArrayLike) -> FloatArray:
    """Return vectors (..., 3) in the axes of OpenSim."""
    return np.asarray(vectors, dtype=np.float64) @ TURN.T + 0.0  # no -0


def tensor_to_opensim(tensor: FloatArray) -> FloatArray:
    """Return a tensor of inertia (3, 3) in the axes of OpenSim."""
    return TURN @ tensor @ TURN.T + 0.0


def numbers(values: npt.ArrayLike) -> str:
    """Return numbers that read back exactly."""
    return " ".join(map(repr, np.ravel(np.asarray(values, dtype=np.float64)).tolist()))


def document(note: Note, words: Iterable[str] = ()) -> ET.Element:
    """Return the root of a file of OpenSim 4.0, which later versions read, too, with a comment."""
    root = ET.Element("OpenSimDocument", Version="40000")
    root.append(ET.Comment(note.xml(words)))
    return root


def add_objects(parent: ET.Element, kind: str, name: str) -> ET.Element:
    """Add an empty set of objects and return what they go into."""
    return ET.SubElement(ET.SubElement(parent, kind, name=name), "objects")


def add(parent: ET.Element, tag: str, value: str | float | Sequence[float] | FloatArray) -> None:
    """Add an element with a text, or with numbers that read back exactly."""
    ET.SubElement(parent, tag).text = value if isinstance(value, str) else numbers(value)


def write_xml(root: ET.Element, path: Path) -> None:
    """Write a document with a line for every element."""
    ET.indent(root)
    ET.ElementTree(root).write(path, encoding="UTF-8", xml_declaration=True)
