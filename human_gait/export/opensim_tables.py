"""The walk for OpenSim: motion, torques, ground reaction, and which bodies this acts on.

A column is a degree of freedom, with the name and sign that it has here, or an axis of a vector in
the axes of OpenSim.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.body.joints import WORLD
from human_gait.body.skeleton import DOF_NAMES, PRISMATIC, SIDES
from human_gait.export.notes import Note
from human_gait.export.opensim_format import add, document, to_opensim, write_xml
from human_gait.export.rules import check_names, check_numbers, check_times
from human_gait.results.names import OPENSIM_FORCES
from human_gait.walk.gait import Samples

_PARTS = ("foot", "toe")
_FORCES = "no", "s, m, N, N m"


def save_coordinates(now: Samples, note: Note, path: Path) -> None:
    """Write the motion: rotations in degrees, translations in metres."""
    values = np.where(PRISMATIC, now.q, np.rad2deg(now.q))
    columns = {"time": now.t} | dict(zip(DOF_NAMES, values.T, strict=True))
    _save_table("Coordinates", columns, ("yes", "s, m, deg"), note, path)


def save_torques(now: Samples, note: Note, path: Path) -> None:
    """Write the net joint torques, as OpenSim's inverse dynamics does: of muscles and tissues."""
    names = [f"{name}_{_torque_kind(i)}" for i, name in enumerate(DOF_NAMES)]
    columns = {"time": now.t} | dict(zip(names, now.tau.T, strict=True))
    _save_table("Inverse Dynamics Generalized Forces", columns, _FORCES, note, path)


def _torque_kind(i: int) -> str:
    return "force" if PRISMATIC[i] else "moment"


def _vector(name: str, values: FloatArray) -> dict[str, FloatArray]:
    """Return the columns of vectors (K, 3), turned into the axes of OpenSim."""
    return {f"{name}{axis}": x for axis, x in zip("xyz", to_opensim(values).T, strict=True)}


def save_ground_reaction(now: Samples, note: Note, path: Path) -> None:
    """Write force, centre of pressure and free moment of each foot, as a force plate has them.

    And what its two parts carry, at the same place: as external loads these give the torque of the
    toe joint, too.
    """
    columns = {"time": now.t}
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
    _save_table("ground_reaction", columns, _FORCES, note, path)


def _held(t: FloatArray, place: FloatArray, loaded: npt.NDArray[np.intp]) -> FloatArray:
    """Return places (K, 3) without jumps: where nothing acts, on the way to the next contact."""
    if not len(loaded):
        return place
    return np.stack([np.interp(t, t[loaded], column[loaded]) for column in place.T], axis=1)


def save_external_loads(note: Note, path: Path) -> None:
    """Write which columns of the ground reaction act on which bodies."""
    root = document(note)
    loads = ET.SubElement(root, "ExternalLoads", name="ground_reaction")
    objects = ET.SubElement(loads, "objects")
    for side in SIDES:
        for part in _PARTS:
            name = f"{part}_{side}"
            force = ET.SubElement(objects, "ExternalForce", name=name)
            add(force, "applied_to_body", name)
            add(force, "force_expressed_in_body", WORLD)
            add(force, "point_expressed_in_body", WORLD)
            add(force, "force_identifier", f"{name}_force_v")
            add(force, "point_identifier", f"ground_force_{side}_p")
            add(force, "torque_identifier", f"{name}_torque_")
            add(force, "data_source_name", OPENSIM_FORCES)
    add(loads, "datafile", OPENSIM_FORCES)
    write_xml(root, path)


def _save_table(
    title: str, columns: Mapping[str, FloatArray], measures: tuple[str, str], note: Note, path: Path
) -> None:
    """Write a table of OpenSim's (.mot, .sto): columns (K,) by name, the first of them the time.

    The measures are whether angles are in degrees, and the units.
    """
    check_names(path.name, columns, r"\s=")
    check_numbers(path.name, columns)
    table = np.column_stack(list(columns.values())) + 0.0
    in_degrees, units = measures
    header = [
        title,
        "version=1",
        f"nRows={len(table)}",
        f"nColumns={table.shape[1]}",
        f"inDegrees={in_degrees}",
        f"units: {units}",
        *note.lines(),
        "endheader",
        "\t".join(columns),
    ]
    rows = ["\t".join(f"{x:.12g}" for x in row) for row in table.tolist()]
    check_times(path.name, (row.split("\t", 1)[0] for row in rows))
    path.write_text("\n".join([*header, *rows, ""]), encoding="utf-8")
