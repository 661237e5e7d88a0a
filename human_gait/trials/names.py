"""Which columns of a recording are which curves of the gait cycle, and in which sign.

What is taken for what, and why, is a `Reading`: nothing is renamed unsaid.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import TrialError
from human_gait.trials.known_names import (
    BY_VALUES,
    CURVES,
    ENDS,
    LEAN,
    LEANS,
    known_as,
    without_unit,
)
from human_gait.trials.recording import NEWTON_METRES, Recording
from human_gait.trials.stated import Stated

_CLEAR = 2.0
"""How many times as far a knee has to bend one way as the other, for its sign to be clear."""

_BENT = np.deg2rad(15.0)


@dataclass(frozen=True)
class Reading:
    """What a column was taken for.

    Attributes
    ----------
    source : str
        The file.
    column : str
        Of the source; several that are added up have a + between them.
    curve : str
        Of the gait cycle; empty where the column is left out.
    sign : float
        1 or -1.
    why : str
        Whose name it is, or why it is left out.
    """

    source: str
    column: str
    curve: str
    sign: float
    why: str


def named(
    recording: Recording, stated: Stated, mass: float | None, trial: Recording
) -> tuple[dict[str, FloatArray], tuple[Reading, ...]]:
    """Return the curves (K,) that the columns of a recording are, and how they were read.

    Parameters
    ----------
    recording : Recording
    stated : Stated
        Its names come first.
    mass : float or None, [kg]
        By which moments in N m are divided.
    trial : Recording
        The whole, whose angles tell in which sense a moment is.

    Returns
    -------
    dict
        In the units of the curves, deg and N m/kg.
    tuple of Reading

    Raises
    ------
    TrialError
        If a name is stated of a column or a curve that there is not.
    """
    found: dict[str, FloatArray] = {}
    readings: list[Reading] = []
    columns = _columns(recording)
    for name, sign, curve, why in _candidates(trial, columns, stated):
        if curve in found:
            continue
        kind, values = columns[name]
        if kind == "moment" and recording.moment_unit == NEWTON_METRES and mass is None:
            why, curve = "its mass is not known: give --mass", ""  # noqa: PLW2901
        elif not sign:
            why, curve = f"no sign can be told from it: give --map {curve}=-{name} or so", ""  # noqa: PLW2901
        if curve:
            found[curve] = sign * _scaled(kind, values, recording, mass)
        readings.append(Reading(str(recording.source), name, curve, sign, why))
    if LEAN not in found and (lean := _lean(recording)):
        columns_added, values, why = lean
        found[LEAN] = np.rad2deg(values)
        readings.append(Reading(str(recording.source), columns_added, LEAN, 1.0, why))
    used = {name for reading in readings for name in reading.column.split(" + ")}
    left = [name for name in (*columns, *recording.translations) if name not in used]
    unknown = [
        Reading(str(recording.source), name, "", 1.0, _reason(name, columns, stated))
        for name in left
    ]
    dropped = [
        Reading(str(recording.source), name, "", 1.0, "another kind of quantity")
        for name in recording.ignored
    ]
    return found, (*readings, *unknown, *dropped)


def check_names(recordings: Mapping[Path, frozenset[str]], stated: Stated) -> None:
    """Raise TrialError if a name is stated of a curve, or of a column, that is nowhere.

    Parameters
    ----------
    recordings : mapping of Path to frozenset of str
        The columns of each file.
    stated : Stated
    """
    known = sorted(set().union(*recordings.values()))
    for curve, (column, _) in stated.names.items():
        if curve not in CURVES:
            raise TrialError(f"--map {curve}: no curve is called so{_like(curve, CURVES)}")
        if column not in known:
            where = ", ".join(map(str, recordings)) or "no file with columns over time"
            raise TrialError(
                f"--map {curve}: no column is called {column} in {where}{_like(column, known)}"
            )


def columns_of(recording: Recording) -> frozenset[str]:
    """Return the columns that can be mapped."""
    return frozenset(_columns(recording))


def _reason(name: str, columns: Mapping[str, tuple[str, FloatArray]], stated: Stated) -> str:
    """Return why a column is left out."""
    base, kind = without_unit(name)[0], columns.get(name, ("", None))[0]
    other = "l" if stated.side == "r" else "r"
    if kind and known_as(base, kind, other) and not known_as(base, kind, stated.side):
        return "of the other leg"
    return "no curve here is called so"


def _like(name: str, names: object) -> str:
    near = difflib.get_close_matches(name, list(names), 3)  # type: ignore[call-overload]
    return f": did you mean {' or '.join(near)}?" if near else ""


def _columns(recording: Recording) -> dict[str, tuple[str, FloatArray]]:
    """Return kind and values of each column."""
    angles = {name: ("angle", values) for name, values in recording.angles.items()}
    moments = {name: ("moment", values) for name, values in recording.moments.items()}
    return {**angles, **moments}


def _candidates(
    trial: Recording, columns: Mapping[str, tuple[str, FloatArray]], stated: Stated
) -> Iterator[tuple[str, float, str, str]]:
    """Yield column, sign, curve and the reason, those that are stated first."""
    for curve, (column, sign) in stated.names.items():
        if column in columns and curve.endswith(ENDS[columns[column][0]]):
            yield column, sign, curve, "as stated"
    knee = _knee_sign(trial, stated.side)
    for name, (kind, _) in columns.items():
        if known := known_as(without_unit(name)[0], kind, stated.side):
            curve, sign, whose = known
            if sign != BY_VALUES:
                yield (
                    name,
                    sign,
                    curve,
                    f"{whose}'s name" if whose != "a curve of the gait cycle" else whose,
                )
            elif kind == "angle":
                yield name, knee[0], curve, knee[1]
            else:  # along the knee's coordinate: extends where this flexes
                yield name, -knee[0], curve, knee[1].replace("flexion is", "flexion was")


def _knee_sign(recording: Recording, side: str) -> tuple[float, str]:
    """Return the sign that makes the knee of OpenSim flex in the positive sense, 0 if unclear."""
    for name, values in recording.angles.items():
        if without_unit(name)[0] == f"knee_angle_{side}" and np.isfinite(values).any():
            low, high = float(np.nanmin(values)), float(np.nanmax(values))
            extent = f"it goes from {np.rad2deg(low):.0f} to {np.rad2deg(high):.0f} deg"
            if max(high, -low) < _BENT or max(high, -low) < _CLEAR * min(high, -low):
                return 0.0, extent
            word = "positive" if high > -low else "negative"
            return (1.0 if high > -low else -1.0), f"OpenSim's name; {extent}: flexion is {word}"
    return 0.0, f"there is no knee_angle_{side}"


def _scaled(kind: str, values: FloatArray, recording: Recording, mass: float | None) -> FloatArray:
    if kind == "angle":
        return np.asarray(np.rad2deg(values))
    if recording.moment_unit == NEWTON_METRES:
        return values / (mass or 1.0)
    return values


def _lean(recording: Recording) -> tuple[str, FloatArray, str] | None:
    """Return the columns that turn the trunk, its forward lean (K,) [rad] and the reason.

    The lean is the angle of the trunk's own long axis from the vertical, in the plane of walking.
    """
    by_name = {without_unit(name)[0]: name for name in recording.angles}
    for whose, turns in LEANS.items():
        if all(part in by_name for part, axis in turns if axis[-1] == "x"):
            known = [(by_name[part], axis) for part, axis in turns if part in by_name]
            upright = np.zeros((3, len(recording.time)))
            upright[1] = 1.0
            for name, axis in reversed(known):  # the last one turns it first
                sign = -1.0 if axis.startswith("-") else 1.0
                upright = _turned(upright, axis[-1], sign * recording.angles[name])
            why = f"{whose}'s names, whose turns lean the trunk"
            return " + ".join(name for name, _ in known), np.arctan2(upright[2], upright[1]), why
    return None


def _turned(vectors: FloatArray, axis: str, angle: FloatArray) -> FloatArray:
    """Return vectors (3, K) turned about an axis by angles (K,), [rad]."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    result = vectors.copy()
    result[j] = np.cos(angle) * vectors[j] - np.sin(angle) * vectors[k]
    result[k] = np.sin(angle) * vectors[j] + np.cos(angle) * vectors[k]
    return result
