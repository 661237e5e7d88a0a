"""Files of measured trials: each is read by its ending, those about one trial become one value."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

from human_gait.arrays import FloatArray
from human_gait.exceptions import TrialError
from human_gait.trials.c3d import read_c3d
from human_gait.trials.csv_table import read_csv
from human_gait.trials.opensim_table import read_opensim_table
from human_gait.trials.profile import Profile
from human_gait.trials.recording import Recording
from human_gait.trials.stated import Stated, stated
from human_gait.trials.trc import read_trc

Reader = Callable[[Path, Stated], Recording | Profile]

READERS: Mapping[str, Reader] = {
    ".mot": read_opensim_table,
    ".sto": read_opensim_table,
    ".trc": read_trc,
    ".c3d": read_c3d,
    ".csv": read_csv,
}
"""By the ending of the file."""

_ORDER = 3  # of the splines between samples


def read_trial(
    *files: str | Path,
    units: str | Iterable[str] = (),
    up: str = "",
    forward: str = "",
) -> Recording:
    """Read one measured trial, of one file or of several about the same.

    Parameters
    ----------
    files : str or Path
        .mot, .sto, .trc, .c3d or .csv.
    units : str or iterable of str
        ``deg``, ``rad``, ``mm``, ``m``, ... where the files do not say it.
    up, forward : str
        Along which axis of the files, or against it, where they do not say it: ``z``, ``-x``.

    Returns
    -------
    Recording
        In SI units and the axes here.

    Raises
    ------
    TrialError
        If a file cannot be read, leaves something open, or is about another trial.
    """
    if not files:
        raise TrialError("no file of a trial is given")
    given = stated(units=units, up=up, forward=forward)
    read = [read_file(Path(file), given) for file in files]
    recordings = [one for one in read if isinstance(one, Recording)]
    if len(recordings) < len(read):
        odd = next(one.source for one in read if isinstance(one, Profile))
        raise TrialError(f"{odd}: holds curves over percent and no trial over time")
    first, *others = recordings
    for other in others:
        if not belongs(other, first):
            message = "is about another trial: it has the same kind of data, or other times"
            raise TrialError(f"{other.source}: {message} than {first.source}")
        first = combined([first, other])
    return first


def read_file(path: Path, given: Stated) -> Recording | Profile:
    """Read one file by its ending.

    Raises
    ------
    TrialError
        If it cannot be read.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        message = f"its name must end with {', '.join(READERS)}"
        raise TrialError(f"{path}: no such kind of file is read: {message}")
    return reader(path, given)


def read_trials(paths: Sequence[Path], given: Stated) -> list[list[Recording] | list[Profile]]:
    """Read files, and put those that follow each other about one trial, or source, together.

    A file joins those before if it holds other kinds of data over the same time, or other curves.

    Raises
    ------
    TrialError
        If one cannot be read.
    """
    trials: list[list[Recording] | list[Profile]] = []
    profiles: list[Profile] = []
    recordings: list[Recording] = []
    for path in paths:
        one = read_file(path, given)
        if isinstance(one, Profile):
            if not (profiles and _adds(one, profiles)):
                trials.append(profiles := [])
            profiles.append(one)
            recordings = []
        else:
            if not (recordings and all(belongs(one, other) for other in recordings)):
                trials.append(recordings := [])
            recordings.append(one)
            profiles = []
    return trials


def belongs(one: Recording, other: Recording) -> bool:
    """Return whether a recording holds other kinds of data than another, over the same time."""
    return not (_kinds(one) & _kinds(other)) and _overlap(one, other)


def combined(recordings: Sequence[Recording]) -> Recording:
    """Return several recordings of one trial as one, at the times of the markers, or of the first.

    Between samples of the others lies a cubic spline; where they do not reach there is NaN. Plates
    keep their times.
    """
    base = next((one for one in recordings if one.markers), recordings[0])

    def at(one: Recording, values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        if one is base or np.array_equal(one.time, base.time):
            return dict(values)
        return {name: resampled(one.time, x, base.time) for name, x in values.items()}

    merged: dict[str, dict[str, FloatArray]] = {"angles": {}, "translations": {}, "moments": {}}
    for one in recordings:
        for kind, values in merged.items():
            values.update(at(one, getattr(one, kind)))
    masses = [one.mass for one in recordings if one.mass is not None]
    return replace(
        base,
        source=recordings[0].source,
        angles=merged["angles"],
        translations=merged["translations"],
        moments=merged["moments"],
        plates=tuple(plate for one in recordings for plate in one.plates),
        moment_unit=next((one.moment_unit for one in recordings if one.moments), base.moment_unit),
        mass=masses[0] if masses else None,
        events=next((one.events for one in recordings if one.events), ()),
        ignored=tuple(name for one in recordings for name in one.ignored),
        notes=tuple(note for one in recordings for note in one.notes),
    )


def resampled(time: FloatArray, values: FloatArray, at: FloatArray) -> FloatArray:
    """Return values (K,) of some times at others (n,): cubic, NaN outside and in gaps."""
    known = np.isfinite(values)
    if known.sum() < _ORDER + 1:
        return np.full(len(at), np.nan)
    found = np.asarray(make_interp_spline(time[known], values[known], k=_ORDER)(at))
    after = np.clip(np.searchsorted(time, at), 1, len(time) - 1)
    slack = 1e-9 * max(1.0, float(np.abs(time).max()))
    outside = (at < time[0] - slack) | (at > time[-1] + slack)
    exact = np.abs(time[after] - at) <= slack
    gap = ~(known[after] & (known[after - 1] | exact))
    return np.where(outside | gap, np.nan, found)


def _kinds(one: Recording) -> set[str]:
    parts = {
        "angles": one.angles or one.translations,
        "markers": one.markers,
        "forces": one.plates,
        "moments": one.moments,
    }
    return {name for name, held in parts.items() if held}


def _overlap(one: Recording, other: Recording) -> bool:
    ends = [_times(one), _times(other)]
    return bool(max(end[0] for end in ends) < min(end[1] for end in ends))


def _times(one: Recording) -> tuple[float, float]:
    return float(one.time[0]), float(one.time[-1])


def _adds(one: Profile, others: Sequence[Profile]) -> bool:
    known = {name for other in others for name in other.mean}
    alike = (one.stance_only, bool(one.sd)) == (others[0].stance_only, bool(others[0].sd))
    return alike and not (known & set(one.mean))
