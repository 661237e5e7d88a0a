"""Marker files of Motion Analysis and OpenSim, .trc."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from human_gait.exceptions import TrialError, shown
from human_gait.trials.axes import OPENSIM, axes_of, check_forward, check_upright
from human_gait.trials.recording import Recording
from human_gait.trials.stated import LENGTH, Stated
from human_gait.trials.text import check_columns, increasing, lines_of, numbered, numbers

_TIMES = ("time", "times", "time(s)", "time (s)")


def read_trc(path: Path, stated: Stated) -> Recording:
    """Read a .trc file, in the axes of OpenSim unless others are stated.

    Raises
    ------
    TrialError
        If it cannot be read, has no unit, or the markers contradict the axes.
    """
    lines = lines_of(path)
    counts, at = _counts(path, lines)
    markers = _markers(path, lines[at], at + 1)
    names = ["Frame#", "Time", *(f"{name} {axis}" for name in markers for axis in "XYZ")]
    table = numbers(path, numbered(lines, _first_row(lines, at + 1)), names, _cells)
    time = increasing(path, table[:, 1], "Time")
    unit = stated.unit(LENGTH) or counts.get("units", "")
    if unit.lower() not in LENGTH:
        message = f"Units = {shown(unit)}: must be one of {', '.join(LENGTH)}"
        raise TrialError(f"{path}: {message}: give --units mm or --units m")
    axes = axes_of(path, stated.up, stated.forward, OPENSIM)
    measured = table[:, 2:].reshape(len(time), -1, 3) * LENGTH[unit.lower()]
    measured[(measured == 0.0).all(axis=2)] = np.nan  # out of sight, as some programs write it
    places = axes.here(measured)
    found = {name: places[:, k] for k, name in enumerate(markers)}
    if not stated.up:
        check_upright(path, found, axes)
    if not stated.forward:
        check_forward(path, found, axes)
    return Recording(path, time, markers=found, notes=_notes(counts, len(time), len(markers)))


def _counts(path: Path, lines: Sequence[str]) -> tuple[dict[str, str], int]:
    """Return the counts of the header by their names in small letters, and the line of markers."""
    at = next((k for k, line in enumerate(lines) if _cells(line)[0].lower() == "frame#"), None)
    if at is None:
        raise TrialError(f"{path}: has no line that begins with 'Frame#': is no TRC file")
    keys = next((k for k in range(at) if "units" in lines[k].lower().split()), None)
    if keys is None or keys + 1 >= at:
        return {}, at
    return dict(zip(lines[keys].lower().split(), lines[keys + 1].split(), strict=False)), at


def _markers(path: Path, line: str, number: int) -> list[str]:
    """Return the names of the markers, each above the first of its three columns."""
    cells = _cells(line)
    if len(cells) < 3 or cells[1].lower() not in _TIMES:
        raise TrialError(f"{path}: line {number}: must begin with Frame#, Time and a marker")
    names = [cell for cell in cells[2:] if cell]
    axes = ("_x", "_y", "_z")
    if len(names) % 3 == 0 and all(n.lower().endswith(axes[k % 3]) for k, n in enumerate(names)):
        names = [name[:-2] for name in names[::3]]
    check_columns(path, names, number)
    return names


def _first_row(lines: Sequence[str], start: int) -> int:
    """Return the first line of numbers: behind that of X1, Y1, ..., if there is one."""
    for k in range(start, len(lines)):
        cells = lines[k].split()
        if cells:
            return k + 1 if cells[0][:1].upper() == "X" else k
    return len(lines)


def _cells(line: str) -> list[str]:
    cells = [cell.strip() for cell in line.split("\t")] if "\t" in line else line.split()
    return cells or [""]


def _notes(counts: dict[str, str], frames: int, markers: int) -> tuple[str, ...]:
    notes = []
    for key, what, found in (
        ("numframes", "frames", frames),
        ("nummarkers", "markers", markers),
    ):
        said = counts.get(key, "")
        if said and said != str(found):
            notes.append(f"the header says {said} {what}, there are {found}: is the file whole?")
    return tuple(notes)
