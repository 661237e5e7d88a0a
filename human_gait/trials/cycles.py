"""Recordings cut into cycles of a leg, their mean and the band around it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import median_low

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import GRAVITY
from human_gait.exceptions import TrialError
from human_gait.trials.events import feet_of, strikes_of
from human_gait.trials.names import Reading, named
from human_gait.trials.reading import combined, resampled
from human_gait.trials.recording import Plate, Recording
from human_gait.trials.stated import Stated
from human_gait.values import Value
from human_gait.walk.gait_cycle import FORCES, PERCENT

_LONGEST, _SHORTEST = 3.0, 0.4  # [s]: a stride between two strikes
_MISSED = 1.5  # times the median stride: from there on a strike between was missed
_STOOD = 0.3  # of the weight: a foot that never carries so much was not on a plate
_VERTICAL = "vertical_up_BW"


@dataclass(frozen=True, eq=False, repr=False)
class Cycles(Value):
    """Cycles of one leg of own trials, and how they were read.

    Attributes
    ----------
    curves : mapping of str to (n, 101) array
        A row a cycle, in the units that the names end with.
    readings : tuple of Reading
        What each column was taken for.
    notes : tuple of str
        What was found and guessed, a sentence each.
    """

    curves: Mapping[str, FloatArray]
    readings: tuple[Reading, ...]
    notes: tuple[str, ...]


def cycles_of(parts: Sequence[Recording], stated: Stated) -> Cycles:
    """Cut a trial into cycles of the leg that counts.

    Parameters
    ----------
    parts : sequence of Recording
        Of the same trial: each is cut at its own times.
    stated : Stated

    Raises
    ------
    TrialError
        If no stride can be told, or none is whole.
    """
    trial = combined(parts)
    feet, guessed = feet_of(trial, stated)
    ours = [plate for plate in trial.plates if feet.get(plate.name) == stated.side]
    strikes = strikes_of(trial, ours, stated)
    strides, missed = _strides(strikes.times)
    mass, weighed = _mass(trial, strides, set(feet.values()), stated)
    curves, readings = _cut(parts, trial, strides, mass, stated)
    if ours and mass:
        curves |= _forces(ours, strides, mass * GRAVITY, stated.side)
        readings += _force_readings(parts, ours)
    elif ours:
        weighed = "forces are left out, since the mass is not known: give --mass"
    broken = [name for name, rows in curves.items() if not len(rows)]
    if len(broken) == len(curves):
        times = ", ".join(f"{time:.3f}" for time in strikes.times[:9])
        message = f"no cycle of the leg is whole: {strikes.source}, at {times} s"
        raise TrialError(f"{trial.source}: {message}, measured from {_span(parts)} s")
    gaps = f"not whole in any cycle, and left out: {', '.join(broken)}" if broken else ""
    curves = {name: rows for name, rows in curves.items() if len(rows)}
    most = max(map(len, curves.values()))
    told = f"{most} cycle{'s' if most > 1 else ''}, {strikes.source}"
    notes = (told, *trial.notes, *guessed, *filter(None, [missed, weighed, gaps]))
    return Cycles(curves, readings, tuple(f"{trial.source.name}: {note}" for note in notes))


def _strides(times: Sequence[float]) -> tuple[list[tuple[float, float]], str]:
    """Return the strides between strikes, and a note on those in which a strike was missed."""
    found = [(a, b) for a, b in pairwise(times) if _SHORTEST <= b - a <= _LONGEST]
    if not found:
        return [], ""
    usual = median_low([b - a for a, b in found])
    kept = [(a, b) for a, b in found if b - a <= _MISSED * usual]
    if len(kept) == len(found):
        return kept, ""
    long = ", ".join(f"{b - a:.2f} s from {a:.3f} s" for a, b in found if b - a > _MISSED * usual)
    why = f"more than {_MISSED:g} times the median of {usual:.2f} s"
    return kept, f"left out as two strides or more: {long}, {why}"


def pooled(parts: Sequence[Cycles]) -> Cycles:
    """Return all cycles of several recordings together."""
    names = dict.fromkeys(name for part in parts for name in part.curves)
    return Cycles(
        {
            name: np.concatenate([part.curves[name] for part in parts if name in part.curves])
            for name in names
        },
        tuple(reading for part in parts for reading in part.readings),
        tuple(note for part in parts for note in part.notes),
    )


def mean_and_sd(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean and standard deviation of cycles (n, 101); NaN is that of a single one."""
    if len(rows) < 2:
        return rows[0], np.full(rows.shape[1], np.nan)
    return rows.mean(axis=0), rows.std(axis=0, ddof=1)


def _cut(
    parts: Sequence[Recording],
    trial: Recording,
    strides: Sequence[tuple[float, float]],
    mass: float | None,
    stated: Stated,
) -> tuple[dict[str, FloatArray], tuple[Reading, ...]]:
    """Return the curves (n, 101) of all parts, the first that has one, and how they were read."""
    cut: dict[str, FloatArray] = {}
    readings: list[Reading] = []
    for part in parts:
        curves, found = named(part, stated, mass, trial)
        readings += found
        for name, values in curves.items():
            if name not in cut:
                cut[name] = _whole(_at(part.time, values, *stride) for stride in strides)
    return cut, tuple(readings)


def _span(parts: Sequence[Recording]) -> str:
    return ", ".join(dict.fromkeys(f"{part.time[0]:g} to {part.time[-1]:g}" for part in parts))


def _at(time: FloatArray, values: FloatArray, start: float, end: float) -> FloatArray:
    return resampled(time, values, start + PERCENT / 100.0 * (end - start))


def _whole(rows: Iterable[FloatArray]) -> FloatArray:
    """Return the rows without a gap, (n, 101)."""
    known = [row for row in rows if np.isfinite(row).all()]
    return np.array(known).reshape(len(known), len(PERCENT))


def _mass(
    recording: Recording, strides: Sequence[tuple[float, float]], feet: set[str], stated: Stated
) -> tuple[float | None, str]:
    """Return the mass, [kg], as stated, of the file, or weighed, and a note in the last case.

    Over a whole stride the vertical force on both feet is the weight, in the mean.
    """
    if stated.mass or recording.mass:
        return stated.mass or recording.mass, ""
    if not {"r", "l"} <= feet or not strides:
        return None, ""
    total = [_total(recording.plates, start, end) for start, end in strides]
    steady = [force for force in total if force.min() > _STOOD * force.mean()]
    if not steady:
        return None, ""
    mass = float(np.mean([force[:-1].mean() for force in steady])) / GRAVITY
    return mass, f"mass {mass:.1f} kg, by the mean vertical force of {len(steady)} strides"


def _total(plates: Sequence[Plate], start: float, end: float) -> FloatArray:
    """Return the vertical force on all plates over a stride, [N]; 0 where a plate is not read."""
    at = np.linspace(start, end, 1001)
    forces = [np.interp(at, plate.time, plate.force[:, 1], left=0.0, right=0.0) for plate in plates]
    return np.asarray(np.sum(forces, axis=0))


def _forces(
    plates: Sequence[Plate], strides: Sequence[tuple[float, float]], weight: float, side: str
) -> dict[str, FloatArray]:
    """Return the force on the foot of a side, [BW], of the strides in which it was on a plate."""
    kept: dict[str, list[FloatArray]] = {name: [] for name in FORCES}
    medial = np.array([1.0 if side == "r" else -1.0, 1.0, 1.0])  # the left is x
    for start, end in strides:
        at = start + PERCENT / 100.0 * (end - start)
        measured = [p for p in plates if p.time[0] <= start + 1e-9 and p.time[-1] >= end - 1e-9]
        if not measured:
            continue
        axes = [[np.interp(at, p.time, x) for x in p.force.T] for p in measured]
        force = np.sum(axes, axis=0).T * medial
        if np.max(force[:, 1]) > _STOOD * weight:
            for name, axis in FORCES.items():
                kept[name].append(force[:, axis] / weight)
    return {name: _whole(rows) for name, rows in kept.items()}


def _force_readings(parts: Sequence[Recording], plates: Sequence[Plate]) -> tuple[Reading, ...]:
    names = ", ".join(plate.name or "of no name" for plate in plates)
    source = next(str(part.source) for part in parts if part.plates)
    return tuple(
        Reading(source, f"force plate {names}", curve, 1.0, "the force on the foot")
        for curve in FORCES
    )
