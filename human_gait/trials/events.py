"""When a heel meets the ground: as given, from the file, from forces or from a marker.

References
----------
J. A. Zeni, J. G. Richards, J. S. Higginson, "Two simple methods for determining gait events during
treadmill and overground walking using kinematic data", Gait & Posture 27 (2008) 710-714.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import SIDES, SIDES_IN_WORDS
from human_gait.exceptions import TrialError
from human_gait.trials.contacts import standing
from human_gait.trials.reading import resampled
from human_gait.trials.recording import Plate, Recording
from human_gait.trials.stated import Stated

_SIDES = dict(zip(SIDES, SIDES_IN_WORDS, strict=True))
_STRIDE = 0.4  # [s]: no stride is shorter
_SWUNG = 0.1  # [m] by which a heel swings forward past the pelvis, at least
_BACK = 0.02  # [m] by which it is seen to go back then: a trial may end soon after
_ASIDE = 0.02  # [m] between the places of two feet, from which on it is clear which is which
_HEEL = re.compile(
    r"(?P<a>r|l|right|left)[._ ]?(?:hee|heel|hel|cal|calc|calcn|calcaneus)|"
    r"(?:hee|heel|cal|calc)[._ ]?(?P<b>r|l|right|left)",
    re.IGNORECASE,
)
_PELVIS = re.compile(r".*(?:asi|psi|sacr|pelvis).*", re.IGNORECASE)


@dataclass(frozen=True)
class Strikes:
    """When the heel of a side meets the ground, and how that is known.

    Attributes
    ----------
    times : tuple of float, [s]
    source : str
        In words.
    """

    times: tuple[float, ...]
    source: str


def strikes_of(recording: Recording, plates: Sequence[Plate], stated: Stated) -> Strikes:
    """Return the strikes of the heel on the side that counts, at least two.

    Parameters
    ----------
    recording : Recording
    plates : sequence of Plate
        Those below the foot of that side.
    stated : Stated
        Times in it come first, then events of the file, forces, the marker on the heel.

    Raises
    ------
    TrialError
        If nothing tells two strikes.
    """
    if stated.strikes:
        return Strikes(stated.strikes, "strikes as given")
    word = _SIDES[stated.side]
    told = [e.time for e in recording.events if e.side == word and e.strike]
    if len(told) > 1:
        return Strikes(tuple(told), "strikes from the events of the file")
    loaded = sorted(t for plate in plates for t in _contacts(plate, stated.threshold))
    if len(loaded) > 1:
        source = f"strikes from the vertical force of the {word} foot, above {stated.threshold:g} N"
        return Strikes(tuple(loaded), source)
    heel = heels(recording).get(stated.side, "")
    seen = swings(recording.time, _before_the_pelvis(recording, heel)) if heel else []
    if len(seen) > 1:
        why = "forces tell no stride" if plates else "there are no forces"
        return Strikes(
            tuple(seen), f"strikes from the marker {heel}, since {why} of the {word} foot"
        )
    found = f"{len(loaded)} from forces" if plates else "no forces"
    marker = f"the marker {heel} tells no stride" if heel else f"no marker on the {word} heel"
    other = "l" if stated.side == "r" else "r"
    message = f"no two strikes of the {word} foot ({found}, {marker})"
    raise TrialError(
        f"{recording.source}: {message}: give --events, such as 0.52,1.63 [s], or --side {other}"
    )


def feet_of(recording: Recording, stated: Stated) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return which foot is on each plate, ``r`` or ``l`` by its name, and notes on what is guessed.

    A plate that nobody stands on has none.

    Raises
    ------
    TrialError
        If a plate is stated that there is not, or nothing tells.
    """
    names = [plate.name for plate in recording.plates]
    _check_stated(recording, names, stated)
    loaded = [p for p in recording.plates if (p.force[:, 1] > stated.threshold).any()]
    feet = {p.name: stated.feet.get(p.name, p.name) for p in loaded}
    known = {name: foot for name, foot in feet.items() if foot in ("r", "l")}
    unknown = [plate for plate in loaded if plate.name not in known]
    if not unknown:
        return known, ()
    if len(unknown) == 1 and len(known) == 1:
        other = "l" if "r" in known.values() else "r"
        return {**known, unknown[0].name: other}, (_told(unknown[0].name, other, "the other is"),)
    by_heel = _by_heels(recording, unknown)
    if by_heel is None:
        by_heel = _by_place(unknown)
    if by_heel is None:
        plate = unknown[0].name
        message = f"nothing tells which foot is on force plate {plate or 'of no name'}"
        raise TrialError(f"{recording.source}: {message}: give --feet {plate}=r or {plate}=l")
    guessed, why = by_heel
    return {**known, **guessed}, tuple(_told(name, foot, why) for name, foot in guessed.items())


def heels(recording: Recording) -> dict[str, str]:
    """Return the markers on the heels, by ``r`` and ``l``."""
    found: dict[str, str] = {}
    for name in recording.markers:
        if matched := _HEEL.fullmatch(name):
            found.setdefault((matched["a"] or matched["b"])[0].lower(), name)
    return found


def _check_stated(recording: Recording, names: Sequence[str], stated: Stated) -> None:
    for name in stated.feet:
        if names and name not in names:
            there = ", ".join(map(repr, names))
            raise TrialError(f"{recording.source}: --feet {name}: the force plates are {there}")


def _told(name: str, foot: str, why: str) -> str:
    return f"force plate {name or 'of no name'} is taken for the {_SIDES[foot]} foot: {why}"


def _by_heels(recording: Recording, plates: Sequence[Plate]) -> tuple[dict[str, str], str] | None:
    """Return which heel is nearer to the pressure on each plate."""
    markers = heels(recording)
    if len(markers) < 2:
        return None
    found = {}
    for plate in plates:
        distance = {side: _distance(recording, marker, plate) for side, marker in markers.items()}
        if not all(map(np.isfinite, distance.values())):
            return None
        found[plate.name] = min(distance, key=lambda side: distance[side])
    return found, "its heel is nearest"


def _distance(recording: Recording, marker: str, plate: Plate) -> float:
    """Return how far a marker is from the pressure, over the ground, in the mean, [m]."""
    seen = np.isfinite(plate.point).all(axis=1)
    if not seen.any():
        return float("nan")
    place = recording.markers[marker]
    at = [resampled(recording.time, place[:, i], plate.time[seen]) for i in (0, 2)]
    off = np.hypot(at[0] - plate.point[seen, 0], at[1] - plate.point[seen, 2])
    return float(np.nanmean(off)) if np.isfinite(off).any() else float("nan")


def _by_place(plates: Sequence[Plate]) -> tuple[dict[str, str], str] | None:
    """Return which of two plates is further to the right, -x, by their pressures."""
    if len(plates) != 2 or any(not np.isfinite(p.point[:, 0]).any() for p in plates):
        return None
    places = [float(np.nanmean(plate.point[:, 0])) for plate in plates]
    if abs(places[0] - places[1]) < _ASIDE:
        return None
    right = int(np.argmin(places))
    why = f"its pressure is {100 * abs(places[0] - places[1]):.0f} cm beside the other's"
    return {plates[right].name: "r", plates[1 - right].name: "l"}, why


def _contacts(plate: Plate, threshold: float) -> list[float]:
    """Return when a foot comes down on a plate, [s]: the crossings of the threshold."""
    vertical, time = plate.force[:, 1], plate.time
    stands = standing(time, vertical > threshold)
    up = np.flatnonzero(~stands[:-1] & stands[1:])
    share = np.clip(
        (threshold - vertical[up]) / np.where(d := vertical[up + 1] - vertical[up], d, 1.0), 0, 1
    )
    return list((time[up] + share * (time[up + 1] - time[up])).tolist())


def swings(time: FloatArray, ahead: FloatArray) -> list[float]:
    """Return when a foot is furthest before the pelvis, [s] (Zeni et al.).

    Parameters
    ----------
    time : (K,) array, [s]
    ahead : (K,) array, [m]
        How far the foot is before the pelvis; NaN where it was not seen.
    """
    known = np.isfinite(ahead)
    if known.sum() < 4:
        return []
    time, ahead = time[known], ahead[known]
    apart = max(1, int(_STRIDE / float(np.median(np.diff(time)))))
    peaks, about = find_peaks(ahead, distance=apart, prominence=_BACK)
    swung = ahead[peaks] - ahead[about["left_bases"]] > _SWUNG
    return list(time[peaks[swung]].tolist())


def _before_the_pelvis(recording: Recording, heel: str) -> FloatArray:
    """Return how far a heel is before the pelvis, (K,), [m]."""
    return np.asarray(recording.markers[heel][:, 2] - _middle(recording.markers)[:, 2])


def _middle(markers: Mapping[str, FloatArray]) -> FloatArray:
    """Return the middle of the markers on the pelvis, or of all, (K, 3)."""
    pelvis = [places for name, places in markers.items() if _PELVIS.fullmatch(name)]
    return np.asarray(np.mean(pelvis or list(markers.values()), axis=0))
