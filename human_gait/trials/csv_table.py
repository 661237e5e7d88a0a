"""Plain tables, .csv: a header with units in its names, rows over time or over percent.

``knee_flexion_deg``, ``knee_angle_r (deg)``, ``LASI_x_mm``: the unit ends the name. Columns without
one are read where it is stated. The tables that gait software of Vicon writes are read, too.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import TrialError
from human_gait.trials.axes import OPENSIM, OURS, Axes, axes_of, check_forward, check_upright
from human_gait.trials.force_columns import check_vertical, force_column, on_the_foot, plates_of
from human_gait.trials.known_names import is_known, without_unit
from human_gait.trials.profile import Profile, is_percent, profile_of
from human_gait.trials.recording import NEWTON_METRES, PER_MASS, Recording
from human_gait.trials.stated import ANGLE, LENGTH, MOMENT, Stated
from human_gait.trials.text import (
    Split,
    check_columns,
    increasing,
    lines_of,
    numbered,
    numbers,
)
from human_gait.trials.vicon_table import is_vicon, read_vicon

_PLACE = re.compile(r"(?P<marker>.+?)[_. :](?P<axis>[xyz])", re.IGNORECASE)
_SECONDS = {"s": 1.0, "ms": 1e-3}
_TIMES = ("time", "t")
_SLOW = 0.5  # [s]: rows that are further apart are counted in something else
_OURS = re.compile(r"(right|left)_(force|pressure|free_moment)_.*")


@dataclass(frozen=True)
class _Column:
    """A column of a table, with what its name says.

    Attributes
    ----------
    base, unit : str
        The name without its unit, and this, which may be empty.
    values : (K,) array
    """

    base: str
    unit: str
    values: FloatArray


def read_csv(path: Path, stated: Stated) -> Recording | Profile:
    """Read a table.

    Raises
    ------
    TrialError
        If it cannot be read, or leaves units or axes open.
    """
    lines = lines_of(path)
    if is_vicon(lines):
        return read_vicon(path, lines, stated)
    at = next((number for number, _ in numbered(lines, 0)), 0)
    if not at:
        raise TrialError(f"{path}: has no line but comments")
    split = _split(lines[at - 1])
    names = [name.strip() for name in split(lines[at - 1])]
    while names and not names[-1]:
        names.pop()
    check_columns(path, names, at)
    table = numbers(path, numbered(lines, at), names, split)
    columns = {name: table[:, k] for k, name in enumerate(names)}
    if is_percent(names[0]):
        return profile_of(path, columns)
    return _recording(path, columns, stated)


def _split(header: str) -> Split:
    """Return how lines are parted: by what parts the header most often."""
    mark = max(",;\t", key=header.count)
    if not header.count(mark):
        return str.split

    def plain(line: str) -> list[str]:
        cells = next(csv.reader([line], delimiter=mark)) if '"' in line else line.split(mark)
        return [cell.strip() for cell in cells]

    if mark == ";":  # of a country with decimal commas
        return lambda line: [cell.replace(",", ".") for cell in plain(line)]
    return plain


def _recording(path: Path, columns: Mapping[str, FloatArray], stated: Stated) -> Recording:
    known = {name: _column(name, values) for name, values in columns.items()}
    at = next((name for name, one in known.items() if one.base.lower() in _TIMES), None)
    if at is None:
        message = f"no column is called time_s or gait_cycle_percent, but {', '.join(known)}"
        raise TrialError(f"{path}: {message[:200]}")
    time = _time(path, known.pop(at))
    ground = {name: one for name, one in known.items() if force_column(_plain(name, one))}
    rest = {name: one for name, one in known.items() if name not in ground}
    markers, used = _markers(path, rest, stated)
    rest = {name: one for name, one in rest.items() if name not in used}
    angles = _of_kind(path, rest, ANGLE, stated)
    shifts = _of_kind(path, rest, LENGTH, stated)
    moments = _of_kind(path, rest, MOMENT, stated)
    per_mass = {_said(rest[name], MOMENT, stated).endswith("/kg") for name in moments}
    if len(per_mass) > 1:
        raise TrialError(f"{path}: some moments are in N m and some in N m/kg: must be one unit")
    plates, told = _plates(path, time, ground, stated)
    taken = {*ground, *used, *angles, *shifts, *moments}
    return Recording(
        path,
        time,
        angles=angles,
        translations=shifts,
        markers=markers,
        plates=plates,
        moments=moments,
        moment_unit=PER_MASS if True in per_mass else NEWTON_METRES,
        ignored=tuple(name for name in known if name not in taken),
        notes=(told,) if told else (),
    )


def _column(name: str, values: FloatArray) -> _Column:
    return _Column(*without_unit(name), values)


def _plain(name: str, one: _Column) -> str:
    return name if _OURS.fullmatch(name) else one.base


def _time(path: Path, column: _Column) -> FloatArray:
    time = increasing(path, column.values * _SECONDS.get(column.unit, 1.0), column.base)
    if not column.unit and len(time) > 1 and float(np.median(np.diff(time))) > _SLOW:
        message = f"{column.base} goes up by {np.median(np.diff(time)):g} from row to row"
        raise TrialError(f"{path}: {message}: name the column time_s, time_ms or so")
    return time


def _said(column: _Column, kinds: Mapping[str, float], stated: Stated) -> str:
    return column.unit if column.unit in kinds else stated.unit(kinds)


def _of_kind(
    path: Path, columns: Mapping[str, _Column], kinds: Mapping[str, float], stated: Stated
) -> dict[str, FloatArray]:
    """Return the columns of a kind of unit, in SI units.

    Of those without unit the angles of joints are asked for; what is none is not.
    """
    found = {}
    mapped = {column for column, _ in stated.names.values()}
    for name, column in columns.items():
        unit = column.unit
        if not unit and kinds is ANGLE and (is_known(column.base) or name in mapped):
            unit = stated.unit(kinds)
            if not unit:
                message = f"{path}: column {name}: its name has no unit, as in {name}_deg"
                raise TrialError(f"{message}: give --units deg or --units rad")
        if unit in kinds:
            found[name] = column.values * kinds[unit]
    return found


def _markers(
    path: Path, columns: Mapping[str, _Column], stated: Stated
) -> tuple[dict[str, FloatArray], set[str]]:
    """Return markers (K, 3), [m], by name, and their columns."""
    parts: dict[str, dict[str, str]] = {}
    for name, column in columns.items():
        matched = _PLACE.fullmatch(column.base)
        if matched and column.unit in ("", *LENGTH):
            parts.setdefault(matched["marker"], {})[matched["axis"].lower()] = name
    whole = {marker: part for marker, part in parts.items() if len(part) == 3}
    if not whole:
        return {}, set()
    axes = axes_of(path, stated.up, stated.forward, None)
    found = {}
    for marker, part in whole.items():
        unit = columns[part["x"]].unit or stated.unit(LENGTH)
        if not unit:
            message = f"{path}: column {part['x']}: its name has no unit, as in {part['x']}_mm"
            raise TrialError(f"{message}: give --units mm or --units m")
        places = np.stack([columns[part[axis]].values for axis in "xyz"], axis=1)
        found[marker] = axes.here(places * LENGTH[unit])
    _check(path, found, axes, stated)
    return found, {name for part in whole.values() for name in part.values()}


def _check(path: Path, markers: Mapping[str, FloatArray], axes: Axes, stated: Stated) -> None:
    if not stated.up:
        check_upright(path, markers, axes)
    if not stated.forward:
        check_forward(path, markers, axes)


def _plates(
    path: Path, time: FloatArray, columns: Mapping[str, _Column], stated: Stated
) -> tuple[tuple, str]:  # type: ignore[type-arg]
    """Return the plates, in the axes of who names them so: OpenSim's, or ours."""
    if not columns:
        return (), ""
    own = all(_OURS.fullmatch(name) for name in columns)
    axes = axes_of(path, stated.up, stated.forward, OURS if own else OPENSIM)
    named = {_plain(name, one): one.values for name, one in columns.items()}
    plates, told = on_the_foot(plates_of(path, time, named, axes))
    if not stated.up:
        check_vertical(path, plates, axes)
    return plates, told
