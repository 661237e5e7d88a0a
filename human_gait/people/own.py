"""Own trials as references, beside the measured curves that come with the package."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import TrialError
from human_gait.people.reference import MeasuredCurve, Reference, references
from human_gait.trials.cycles import Cycles, cycles_of, mean_and_sd, pooled
from human_gait.trials.known_names import CURVES
from human_gait.trials.names import Reading, check_names, columns_of
from human_gait.trials.profile import Profile
from human_gait.trials.profile_names import ProfileCurve, profile_curves
from human_gait.trials.reading import read_trials
from human_gait.trials.recording import Recording
from human_gait.trials.stated import Stated
from human_gait.values import Value
from human_gait.walk.gait_cycle import PERCENT

NAME = "own"
_LICENCE = "own data"


@dataclass(frozen=True, eq=False, repr=False)
class Own(Value):
    """Own trials.

    Attributes
    ----------
    references : tuple of Reference
        One of all cycles over time, and one of each table of means with their SD.
    readings : tuple of Reading
        What each column was taken for.
    notes : tuple of str
        What was found and guessed, a sentence each.
    """

    references: tuple[Reference, ...] = ()
    readings: tuple[Reading, ...] = ()
    notes: tuple[str, ...] = ()


def own_trials(files: Sequence[str | Path], stated: Stated) -> Own:
    """Read own trials: recordings over time, cut into cycles, and tables over percent.

    Parameters
    ----------
    files : sequence of str or Path
        Those about one trial follow each other.
    stated : Stated

    Raises
    ------
    TrialError
        If a file cannot be read or cut, leaves something open, or holds no curve.
    """
    paths = [Path(file) for file in files]
    trials = read_trials(paths, stated)
    _check_names(trials, stated)
    cycles: list[Cycles] = []
    tables: list[Reference] = []
    readings: list[Reading] = []
    for trial in trials:
        recordings = [one for one in trial if isinstance(one, Recording)]
        profiles = [one for one in trial if isinstance(one, Profile)]
        if recordings:
            cycles.append(cycles_of(recordings, stated))
            continue
        curves, read = _curves(profiles, stated)
        if any(np.isfinite(curve.sd).any() for _, curve in curves.values()):
            tables.append(_table(profiles, curves, [*tables, *references()]))
            readings += read
        elif profiles[0].stance_only:
            message = "curves of stance need an SD: a column such as vertical_up_sd_BW"
            raise TrialError(f"{profiles[0].source}: {message}")
        else:
            cycles.append(_single(curves, read))
    if cycles:
        whole = pooled(cycles)
        found = (_pool(whole, len(cycles), paths), *tables)
        return Own(found, (*whole.readings, *readings), whole.notes)
    return Own(tuple(tables), tuple(readings))


def _check_names(trials: Iterable[Sequence[Recording | Profile]], stated: Stated) -> None:
    known = {
        one.source: columns_of(one) if isinstance(one, Recording) else frozenset(one.mean)
        for trial in trials
        for one in trial
    }
    check_names(known, stated)


Curves = Mapping[str, tuple[FloatArray, ProfileCurve]]


def _curves(profiles: Sequence[Profile], stated: Stated) -> tuple[Curves, tuple[Reading, ...]]:
    """Return percent, mean and SD of the curves of tables, and how they were read."""
    found: dict[str, tuple[FloatArray, ProfileCurve]] = {}
    readings: list[Reading] = []
    for profile in profiles:
        curves, read = profile_curves(profile, stated)
        found |= {name: (profile.percent, curve) for name, curve in curves.items()}
        readings += read
    if not found:
        names = ", ".join(reading.column for reading in readings)
        message = f"no curve of the gait cycle is called so: {names}"[:150]
        raise TrialError(f"{profiles[0].source}: {message}: give --map knee_flexion_deg=... or so")
    return found, tuple(readings)


def _table(profiles: Sequence[Profile], curves: Curves, others: Sequence[Reference]) -> Reference:
    """Return a table of means as a reference, whose name no other has."""
    stem = profiles[0].source.stem
    taken = {other.name for other in others}
    name = next(n for n in (stem, *(f"{stem}-{k}" for k in range(2, 999))) if n not in taken)
    return _reference(
        name,
        f"{name} (own)",
        [profile.source for profile in profiles],
        {c: MeasuredCurve(percent, one.mean, one.sd) for c, (percent, one) in curves.items()},
        stance_only=profiles[0].stance_only,
    )


def _single(curves: Curves, readings: tuple[Reading, ...]) -> Cycles:
    """Return a table without SD as one cycle."""
    rows = {
        name: np.interp(PERCENT, percent, one.mean)[None] for name, (percent, one) in curves.items()
    }
    return Cycles(rows, readings, ())


def _pool(cycles: Cycles, trials: int, paths: Sequence[Path]) -> Reference:
    """Return all cycles as a reference: their mean and the standard deviation between them."""
    most = max(map(len, cycles.curves.values()))
    counted = [f"{trials} trial{'s' * (trials > 1)}", f"{most} cycle{'s' * (most > 1)}"]
    curves = {}
    for name in CURVES:
        if name in cycles.curves:
            curves[name] = MeasuredCurve(PERCENT, *mean_and_sd(cycles.curves[name]))
    return _reference(NAME, f"own: {' and '.join(counted)}", paths, curves)


def _reference(
    name: str,
    label: str,
    paths: Sequence[Path],
    curves: Mapping[str, MeasuredCurve],
    *,
    stance_only: bool = False,
) -> Reference:
    files = ", ".join(path.name for path in paths)
    return Reference(name, label, files, _LICENCE, stance_only, None, curves)
