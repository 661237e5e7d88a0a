"""The motion of a trial in the coordinates of our body, by its angles or its markers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.dh import frames
from human_gait.body.person import make_body
from human_gait.body.skeleton import DOF_NAMES, N_DOF, SIDES, SIDES_IN_WORDS, index
from human_gait.exceptions import TrialError
from human_gait.export.events import FootEvent
from human_gait.export.markers import marker_set
from human_gait.scenario import Load, Subject
from human_gait.trials.events import swings
from human_gait.trials.inverse_kinematics import Postures, Seen, Tell, placed_at, postures
from human_gait.trials.marker_names import Site, segment_of, sites
from human_gait.trials.recording import Plate, Recording
from human_gait.trials.scaling import scaled
from human_gait.trials.steps import facing, turned_points
from human_gait.values import Value

_FEWEST_MARKERS = 8

_CARRY = ("pelvis", "hip", "knee", "ankle")  # joints that a walk is nothing without


@dataclass(frozen=True)
class Person:
    """What is known of who walked; what is None is found or usual.

    Attributes
    ----------
    sex : str or None
    stature : float or None, [m]
    mass : float or None, [kg]
        Without a load.
    """

    sex: str | None = None
    stature: float | None = None
    mass: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Moved(Value):
    """The motion of a trial in the coordinates of our body.

    Attributes
    ----------
    subject : Subject
    time : (K,) array, [s]
    q : (K, 55) array, [rad] and [m]
    plates : tuple of Plate
        In the axes of the motion.
    sites : tuple of Site
        Markers that it was found from; none where the file has angles.
    off : float, [m]
        How far markers are from the body's, root mean square.
    told : (55,) array
        How much of each joint is told, 0 to 1.
    left_out : int
        Frames of the trial whose markers do not tell pelvis and legs.
    """

    subject: Subject
    time: FloatArray
    q: FloatArray
    plates: tuple[Plate, ...]
    sites: tuple[Site, ...] = ()
    off: float = 0.0
    told: FloatArray = field(default_factory=lambda: np.ones(N_DOF))
    left_out: int = 0


def moved_body(
    trial: Recording,
    static: Recording | None,
    subject: Subject,
    load: Load,
    person: Person,
    marker_map: Mapping[str, str] | None,
    tell: Tell,
) -> Moved:
    """Return the motion by the angles of a file that has all of ours, else by its markers."""
    if not trial.markers:
        return Moved(subject, trial.time, _angles(trial), trial.plates)
    stature_known = person.stature is not None
    where: Sequence[Site]
    if static is None:
        where = _known(trial, subject, load, marker_map)
        seen, plates = _seen(trial, where)
        subject = scaled(subject, load, seen, stature_known=stature_known)
    else:
        subject, where = _stood(static, subject, load, marker_map, stature_known)
        seen, plates = _seen(trial, [site for site in where if site.name in trial.markers])
    found: Postures = postures(make_body(subject, load), seen, tell=tell)
    weights = seen.weights * (np.array([site.weight for site in seen.sites]) == 1.0)
    off = float(np.sqrt(np.nansum(weights * found.off**2) / max(weights.sum(), 1.0)))
    walks = np.array([name.startswith(_CARRY) for name in DOF_NAMES])
    known = ~found.lost[:, walks].any(axis=1)
    if not known.any():
        raise TrialError(f"{trial.source}: no frame has markers that tell both legs")
    t, q, n = trial.time[known], found.q[known], int((~known).sum())
    return Moved(subject, t, q, plates, seen.sites, off, found.told, n)


def _stood(
    static: Recording,
    subject: Subject,
    load: Load,
    marker_map: Mapping[str, str] | None,
    stature_known: bool,
) -> tuple[Subject, list[Site]]:
    """Return who stood, and where all markers are on the body that the known ones show."""
    where = _known(static, subject, load, marker_map)
    seen, _ = _seen(static, where)
    subject = scaled(subject, load, seen, stature_known=stature_known)
    body = make_body(subject, load)
    q = postures(body, seen).q
    found, known = [], {marker.name: marker for marker in marker_set(body)}
    yaw = facing(_to_the_right(where, seen.places, static))
    for name, places in static.markers.items():
        site = next((one for one in where if one.name == name), Site(name))
        on = known[site.ours[0]].segment if site.ours else segment_of(name)
        if on and np.isfinite(places).all(axis=1).any():
            found.append(replace(site, placed=placed_at(body, q, on, turned_points(places, yaw))))
    return subject, found


def _angles(trial: Recording) -> FloatArray:
    """Return the postures (K, 55) of a file that has our coordinates."""
    columns = {**trial.angles, **trial.translations}
    missing = [name for name in DOF_NAMES if name not in columns]
    if missing:
        raise TrialError(
            f"{trial.source}: no markers, and {len(missing)} of our {N_DOF} coordinates are "
            f"missing: {', '.join(missing[:6])}{' ...' if missing[6:] else ''}"
        )
    q = np.stack([columns[name] for name in DOF_NAMES], axis=1)
    if not np.isfinite(q).all():
        name = DOF_NAMES[int(np.argmax(~np.isfinite(q).all(axis=0)))]
        raise TrialError(f"{trial.source}: column {name} has gaps")
    return q


def _known(
    trial: Recording, subject: Subject, load: Load, marker_map: Mapping[str, str] | None
) -> tuple[Site, ...]:
    """Return the markers of a trial that are known by their names."""
    if not trial.markers:
        raise TrialError(f"{trial.source}: has no markers")
    known = sites(list(trial.markers), make_body(subject, load), marker_map)
    if len(known) < _FEWEST_MARKERS:
        raise TrialError(
            f"{trial.source}: {len(known)} of its {len(trial.markers)} markers are known, "
            f"it takes {_FEWEST_MARKERS}: name more of them (--map THEIRS=OURS)"
        )
    return known


def _seen(trial: Recording, where: Sequence[Site]) -> tuple[Seen, tuple[Plate, ...]]:
    """Return markers of a trial, and its plates, facing z."""
    if len(where) < _FEWEST_MARKERS:
        message = f"has {len(where)} markers of the standing trial, it takes {_FEWEST_MARKERS}"
        raise TrialError(f"{trial.source}: {message}")
    places = np.stack([trial.markers[site.name] for site in where], axis=1)
    yaw = facing(_to_the_right(where, places, trial))
    plates = tuple(
        replace(
            plate,
            force=turned_points(plate.force, yaw),
            point=turned_points(plate.point, yaw),
        )
        for plate in trial.plates
    )
    return Seen(tuple(where), turned_points(places, yaw)), plates


def _to_the_right(known: Sequence[Site], places: FloatArray, trial: Recording) -> FloatArray:
    """Return how far markers of the right side are from those of the left, (n, 3), [m]."""
    place_of = {site.ours: places[:, m] for m, site in enumerate(known)}
    pairs = [
        right - place_of[other]
        for ours, right in place_of.items()
        if ours
        and all(name.startswith("R") for name in ours)
        and (other := tuple("L" + name[1:] for name in ours)) in place_of
    ]
    if not pairs or not np.isfinite(np.concatenate(pairs)).all(axis=1).any():
        raise TrialError(f"{trial.source}: no marker is known on both sides: where is left?")
    apart = np.concatenate(pairs)
    return apart[np.isfinite(apart).all(axis=1)]


def strikes_by_motion(moved: Moved, load: Load) -> tuple[FootEvent, ...]:
    """Return strikes by the motion alone: the ankle is furthest ahead of the pelvis.

    Zeni et al., Gait & Posture 27 (2008) 710-714; they have markers of heel and sacrum.
    """
    P, _ = frames(make_body(moved.subject, load).table, moved.q)
    found = []
    for side, word in zip(SIDES, SIDES_IN_WORDS, strict=True):
        ahead = P[:, index(f"ankle_dorsiflexion_{side}"), 2, 3] - moved.q[:, index("pelvis_tz")]
        found += [FootEvent(t, word, strike=True) for t in swings(moved.time, ahead)]
    return tuple(found)
