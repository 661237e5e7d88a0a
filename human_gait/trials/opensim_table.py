"""Tables of OpenSim, .mot and .sto: motions, generalised forces, ground reaction, states.

The header is that of versions 1 to 3 (``name=value`` up to ``endheader``) or of SIMM (``datarows
451``). It says whether angles are in degrees. Vectors are in the axes of OpenSim.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import TrialError, shown
from human_gait.trials.axes import OPENSIM, axes_of
from human_gait.trials.force_columns import check_vertical, force_column, on_the_foot, plates_of
from human_gait.trials.recording import Plate, Recording
from human_gait.trials.stated import ANGLE, Stated
from human_gait.trials.text import cells_of, check_columns, increasing, lines_of, numbered, numbers

_ENTRY = re.compile(r"\s*(\w+)\s*(?:=|\s)\s*(.*?)\s*")
_TRANSLATION = re.compile(r"(?:.*_)?t[xyz]|.*_beta", re.IGNORECASE)
_STATE = re.compile(r"/?(?:[^/]+/)*([^/]+)/(value|speed)")
_FORCE = re.compile(r"(.+)_(moment|force)")
_OF_OTHERS = re.compile(
    r".*/.*|.*\.(?:activation|fiber_length|excitation)|.*_u|.*_activation"
    r"|.*_(?:force_[vp]|torque_)[xyz]"
)
_JOINT = re.compile(r".*(?:pelvis|hip|knee|ankle|lumbar|trunk|spine|shoulder|elbow|arm_|neck).*")
_VERSIONS = ("1", "2", "3")
_LARGEST_TURN = 4.0 * np.pi
"""No joint turns so far: what does is in degrees."""


@dataclass(frozen=True)
class _Header:
    entries: Mapping[str, str]
    names: Sequence[str]
    rows_from: int


def read_opensim_table(path: Path, stated: Stated) -> Recording:
    """Read a .mot or .sto file.

    Raises
    ------
    TrialError
        If it cannot be read, or does not say whether its angles are in degrees.
    """
    lines = lines_of(path)
    header = _header(path, lines)
    names = header.names
    table = numbers(path, numbered(lines, header.rows_from), names)
    at = next((k for k, name in enumerate(names) if name.lower() == "time"), None)
    if at is None:
        raise TrialError(f"{path}: line {header.rows_from}: no column is called time")
    time = increasing(path, table[:, at])
    columns = {name: table[:, k] for k, name in enumerate(names) if k != at}
    return _sorted(path, time, columns, header, stated)


def _header(path: Path, lines: Sequence[str]) -> _Header:
    end = next((k for k, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
    if end is None:
        raise TrialError(f"{path}: has no line 'endheader', which ends the header of OpenSim")
    entries = {}
    for line in lines[:end]:
        if matched := _ENTRY.fullmatch(line):
            entries[matched[1].lower()] = matched[2]
    version = entries.get("version", "1")
    if version not in _VERSIONS:
        raise TrialError(f"{path}: version = {shown(version)}: must be 1, 2 or 3")
    if entries.get("datatype", "double").lower() not in ("double", "float"):
        message = "must be double: vectors and rotations in one column are not read"
        raise TrialError(f"{path}: DataType = {shown(entries['datatype'])}: {message}")
    at = next((k for k in range(end + 1, len(lines)) if lines[k].strip()), None)
    if at is None:
        raise TrialError(f"{path}: has no line of column names behind 'endheader'")
    names = cells_of(lines[at].strip())
    check_columns(path, names, at + 1)
    return _Header(entries, names, at + 1)


def _sorted(
    path: Path, time: FloatArray, columns: dict[str, FloatArray], header: _Header, stated: Stated
) -> Recording:
    """Return the columns as what they are."""
    ground = {name: x for name, x in columns.items() if force_column(name)}
    rest = {name: x for name, x in columns.items() if name not in ground}
    forces = {name: x for name, x in rest.items() if _FORCE.fullmatch(name)}
    moments = {name: x for name, x in forces.items() if name.endswith("_moment")}
    rest = {name: x for name, x in rest.items() if name not in forces}
    values = {name: x for name, x in rest.items() if _is_coordinate(name)}
    shifts = {name: x for name, x in values.items() if _TRANSLATION.fullmatch(_short(name))}
    angles = {name: x for name, x in values.items() if name not in shifts}
    notes = _counted(time, header)
    if not stated.unit(ANGLE) and "indegrees" not in header.entries:  # of joints at least
        angles = {name: x for name, x in angles.items() if _JOINT.fullmatch(_short(name))}
    factor = 1.0
    if angles:
        factor, said = _angle_unit(path, angles, header.entries.get("indegrees", ""), stated)
        notes += said
    plates: tuple[Plate, ...] = ()
    told = ""
    if ground:
        axes = axes_of(path, stated.up, stated.forward, OPENSIM)
        plates, told = on_the_foot(plates_of(path, time, ground, axes))
        if not stated.up:
            check_vertical(path, plates, axes)
    used = {*ground, *angles, *shifts, *moments}
    return Recording(
        path,
        time,
        angles={_short(name): factor * x for name, x in angles.items()},
        translations={_short(name): x.copy() for name, x in shifts.items()},
        plates=plates,
        moments={name: x.copy() for name, x in moments.items()},
        ignored=tuple(name for name in columns if name not in used),
        notes=(*notes, *filter(None, [told])),
    )


def _is_coordinate(name: str) -> bool:
    state = _STATE.fullmatch(name)
    return state[2] == "value" if state else not _OF_OTHERS.fullmatch(name)


def _short(name: str) -> str:
    """Return the coordinate of a state, ``/jointset/knee_r/knee_angle_r/value``, or the name."""
    state = _STATE.fullmatch(name)
    return state[1] if state else name


def _counted(time: FloatArray, header: _Header) -> tuple[str, ...]:
    """Return notes where the header counts other rows and columns than there are."""
    notes = []
    for what, keys, found in (
        ("rows", ("nrows", "datarows"), len(time)),
        ("columns", ("ncolumns", "datacolumns"), len(header.names)),
    ):
        said = next((header.entries[key] for key in keys if key in header.entries), "")
        if said and said != str(found):
            notes.append(f"the header says {said} {what}, there are {found}: is the file whole?")
    return tuple(notes)


def _angle_unit(
    path: Path, angles: Mapping[str, FloatArray], in_degrees: str, stated: Stated
) -> tuple[float, tuple[str, ...]]:
    """Return what turns the angles into radians, and notes."""
    said = {"yes": "deg", "no": "rad"}.get(in_degrees.lower(), "")
    if in_degrees and not said:
        raise TrialError(f"{path}: inDegrees = {shown(in_degrees)}: must be yes or no")
    unit = stated.unit(ANGLE) or said
    if not unit:
        message = "does not say whether its angles are in degrees (inDegrees=yes)"
        raise TrialError(f"{path}: {message}: give --units deg or --units rad")
    reached = {
        name: float(np.nanmax(np.abs(x), initial=0.0))
        for name, x in angles.items()
        if _JOINT.fullmatch(_short(name))
    }
    largest = max(reached, key=lambda name: reached[name], default="")
    reach = reached.get(largest, 0.0)
    if unit == "rad" and reach > _LARGEST_TURN and not stated.unit(ANGLE):
        message = f"says that angles are in radians, but {largest} reaches {reach:.0f}"
        raise TrialError(f"{path}: {message}: give --units deg (or --units rad if that is so)")
    notes = []
    if said and said != unit:
        notes.append(f"angles are taken in {unit}, as stated, not in {said}, as the header has it")
    if unit == "deg" and len(reached) > 3 and reach < np.pi / 2 and not stated.unit(ANGLE):
        notes.append(f"no angle exceeds {reach:.1f} deg: if these are radians, give --units rad")
    return ANGLE[unit], tuple(notes)
