"""Tables that gait software of Vicon writes: sections with a rate, names, axes and units.

``Trajectories`` are markers, ``Model Outputs`` joint angles and moments; other sections are left
out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import TrialError, shown
from human_gait.trials.axes import axes_of, check_forward, check_upright
from human_gait.trials.recording import NEWTON_METRES, PER_MASS, Recording
from human_gait.trials.stated import ANGLE, LENGTH, MOMENT, Stated
from human_gait.trials.text import increasing, numbered, numbers

_READ = ("Trajectories", "Model Outputs")
_SECTIONS = (*_READ, "Devices", "Joints", "Segments", "Model Outputs - Modeled Markers")
_HEAD = 5  # lines of a section before its numbers


@dataclass(frozen=True)
class _Section:
    """One section.

    Attributes
    ----------
    time : (K,) array, [s]
    columns : mapping of (str, str) to (str, (K,) array)
        Unit and values by name and axis.
    """

    time: FloatArray
    columns: Mapping[tuple[str, str], tuple[str, FloatArray]]


def is_vicon(lines: Sequence[str]) -> bool:
    """Return whether the lines begin with a section."""
    first = next(line for line in lines if line.strip())
    return _title(first) in _SECTIONS


def read_vicon(path: Path, lines: Sequence[str], stated: Stated) -> Recording:
    """Return what the lines of a file hold.

    Raises
    ------
    TrialError
        If a section is not whole, or units or axes are open.
    """
    starts = [k for k, line in enumerate(lines) if _title(line) in _SECTIONS]
    ends = [*starts[1:], len(lines)]
    sections, ignored = {}, []
    for start, end in zip(starts, ends, strict=True):
        title = _title(lines[start])
        if title in _READ:
            sections[title] = _section(path, lines, start, end)
        else:
            ignored.append(f"section {title}")
    if not sections:
        raise TrialError(f"{path}: has no section {' or '.join(_READ)}")
    times = [section.time for section in sections.values()]
    if any(not np.array_equal(times[0], time) for time in times[1:]):
        raise TrialError(f"{path}: its sections have other frames: export them alike")
    columns = {key: one for section in sections.values() for key, one in section.columns.items()}
    return _recording(path, times[0], columns, ignored, stated)


def _title(line: str) -> str:
    return line.strip().rstrip(",").strip('"')


def _section(path: Path, lines: Sequence[str], start: int, end: int) -> _Section:
    if end - start <= _HEAD:
        raise TrialError(f"{path}: line {start + 1}: the section {_title(lines[start])} ends early")
    rate = _title(lines[start + 1])
    try:
        hertz = float(rate)
    except ValueError:
        hertz = 0.0
    if not hertz > 0.0:
        raise TrialError(f"{path}: line {start + 2}: {shown(rate)}: must be the frames a second")
    heads, axes, units = (_split(lines[start + k]) for k in (2, 3, 4))
    if len(axes) < 3 or axes[0].lower() != "frame":
        raise TrialError(f"{path}: line {start + 4}: must begin with Frame, Sub Frame and an axis")
    names = _of_one_subject(path, start + 3, _spread(heads, len(axes)))
    units += [""] * (len(axes) - len(units))
    labels = ["Frame", "Sub Frame", *(f"{a} {b}" for a, b in zip(names, axes, strict=True))][2:]
    rows = numbered(lines[:end], start + _HEAD)
    table = numbers(path, rows, ["Frame", "Sub Frame", *labels[2:]], _split)
    columns = {
        (names[k], axes[k].lower().removesuffix("'")): (units[k], table[:, k])
        for k in range(2, len(axes))
        if names[k]
    }
    return _Section(_times(path, table[:, 0], table[:, 1], hertz), columns)


def _times(path: Path, frame: FloatArray, sub: FloatArray, hertz: float) -> FloatArray:
    """Return the times of rows (K,), [s]: frames from 1 on, each of n sub-frames from 0 on.

    The rate is that of the rows, hertz: t = (n (frame - 1) + sub) / hertz.
    """
    sub = np.nan_to_num(sub)
    return increasing(path, ((sub.max() + 1.0) * (frame - 1.0) + sub) / hertz, "the time by Frame")


def _of_one_subject(path: Path, number: int, names: Sequence[str]) -> list[str]:
    """Return names without that of the subject.

    Raises
    ------
    TrialError
        If two subjects have the same, line `number` of the file.
    """
    whole: dict[str, str] = {}
    for name in names:
        other = whole.setdefault(name.rpartition(":")[2], name)
        if other != name:
            message = f"{shown(other)} and {shown(name)} are of two subjects"
            raise TrialError(f"{path}: line {number}: {message}: export one of them")
    return [name.rpartition(":")[2] for name in names]


def _split(line: str) -> list[str]:
    return [cell.strip().strip('"') for cell in line.split(",")]


def _spread(heads: Sequence[str], width: int) -> list[str]:
    """Return the name above each column: the last one on its left."""
    names, now = [], ""
    for k in range(width):
        now = (heads[k] if k < len(heads) else "") or now
        names.append(now)
    return names


def _recording(
    path: Path,
    time: FloatArray,
    columns: Mapping[tuple[str, str], tuple[str, FloatArray]],
    ignored: Sequence[str],
    stated: Stated,
) -> Recording:
    of: dict[str, dict[tuple[str, str], FloatArray]] = {"angle": {}, "place": {}, "moment": {}}
    left, per_mass = list(ignored), set()
    for (name, axis), (unit, values) in columns.items():
        word = unit.replace(".", "").replace(" ", "").replace("*", "")
        for kind, kinds in (("angle", ANGLE), ("place", LENGTH), ("moment", MOMENT)):
            if word in kinds and axis in "xyz":
                of[kind][name, axis] = values * kinds[word]
                per_mass |= {word.endswith("/kg")} if kind == "moment" else set()
                break
        else:
            left.append(f"{name}.{axis}")
    names = dict.fromkeys(name for name, _ in of["place"])
    whole = [name for name in names if all((name, axis) in of["place"] for axis in "xyz")]
    markers = {}
    if whole:
        axes = axes_of(path, stated.up, stated.forward, None)
        for name in whole:
            places = np.stack([of["place"][name, axis] for axis in "xyz"], axis=1)
            markers[name] = axes.here(places)
        if not stated.up:
            check_upright(path, markers, axes)
        if not stated.forward:
            check_forward(path, markers, axes)
    return Recording(
        path,
        time,
        angles={f"{name}.{axis}": x for (name, axis), x in of["angle"].items()},
        markers=markers,
        moments={f"{name}.{axis}": x for (name, axis), x in of["moment"].items()},
        moment_unit=PER_MASS if True in per_mass else NEWTON_METRES,
        ignored=tuple(left),
    )
