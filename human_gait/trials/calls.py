"""A measured walk from its files: what `human_gait.fit` and the command do."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

from human_gait.body.skeleton import SIDES_IN_WORDS
from human_gait.exceptions import ResultError, TrialError
from human_gait.export.events import FootEvent
from human_gait.results.names import MADE_FROM
from human_gait.results.reading import read_any_json
from human_gait.scenario import Scenario, scenario_of
from human_gait.trials.fitting import fitted
from human_gait.trials.inverse_kinematics import Tell
from human_gait.trials.motion import Person
from human_gait.trials.reading import read_trial
from human_gait.trials.recording import Recording
from human_gait.walk.gait import Gait

_STRIKES = re.compile(r"\s*(left|right)\s*:\s*(.+)", re.IGNORECASE)
_ON = "strikes of alternate feet, the side of the first one and times in seconds: left:0.1,0.65,1.2"


def fit(  # noqa: PLR0913, options that are given by name
    files: Recording | str | Path | Sequence[str | Path],
    *,
    static: Recording | str | Path | None = None,
    scenario: Scenario | str | Path | None = None,
    sex: str | None = None,
    stature: float | None = None,
    mass: float | None = None,
    speed: float = 0.0,
    markers: Mapping[str, str] | None = None,
    strikes: str = "",
    control_points: int | None = None,
    units: str | Iterable[str] = (),
    up: str = "",
    forward: str = "",
    tell: Tell = lambda *_: None,
) -> Gait:
    """Return a measured trial as a walk of our body.

    Lengths of the body are scaled to the markers, joint angles found by inverse kinematics, or
    taken where the files have them; the walk is the mean of all steps, those that the right foot
    leads mirrored, under the measured forces of the ground. ``gait.solution["measured"]`` tells
    what it is and what is lost; `verify`, `compare` and reports say that it is no prediction.

    Parameters
    ----------
    files : Recording, str, Path or a sequence of paths
        One trial, as `read_trial` returns it, or its files, .trc, .c3d, .mot, .sto or .csv: markers
        or angles of ours, and forces.
    static : Recording, str or Path, optional
        A trial of the same markers, standing, to scale the body to; else the walk itself.
    scenario : Scenario, str or Path, optional
        Whose person, load, phases and other settings are taken where the files do not tell.
    sex : str, optional
        ``male`` or ``female``.
    stature : float, optional, [m]
        Else found from the markers.
    mass : float, optional, [kg]
        Of the body; else from the file, or the mean force of the ground.
    speed : float, [m/s]
        Of the belt of a treadmill, along z.
    markers : mapping of str to str, optional
        Markers of ours by the names of the file, where these are not known; empty to leave one out.
    strikes : str
        When heels meet the ground, ``left:0.1,0.65,1.2``; else from the files, their forces, or the
        motion.
    control_points : int, optional
        Of the splines of each joint.
    units, up, forward : str
        As the files are to be read where they do not say it: ``mm``, ``z``, ``-x``.
    tell : function, optional
        Is told how many frames are done, and of how many.

    Returns
    -------
    Gait

    Raises
    ------
    TrialError
        If a file cannot be read, or has no whole stride of a walk.
    ScenarioError
        If it is no walk that a scenario can describe, or `scenario` cannot be read.
    """
    read: dict[str, Any] = {"units": units, "up": up, "forward": forward}
    trial = _recording(files, read)
    standing = _recording(static, read) if static is not None else None
    events, base = _own_export(trial.source)
    return fitted(
        trial,
        static=standing,
        person=Person(sex, stature, mass),
        base=base if scenario is None else scenario_of(scenario),
        speed=speed,
        marker_map=markers,
        strikes=strikes_given(strikes) or events,
        control_points=control_points,
        tell=tell,
    )


def _recording(
    given: Recording | str | Path | Sequence[str | Path], read: Mapping[str, Any]
) -> Recording:
    """Return a trial that is given itself or by its files."""
    if isinstance(given, Recording):
        return given
    return read_trial(*([given] if isinstance(given, str | Path) else given), **read)


def strikes_given(text: str) -> tuple[FootEvent, ...]:
    """Return strikes by a text such as ``left:0.1,0.65,1.2``; none of an empty one.

    Raises
    ------
    TrialError
        If it is no such text.
    """
    if not text:
        return ()
    match = _STRIKES.fullmatch(text)
    try:
        times = [float(one) for one in match[2].split(",")] if match else []
    except ValueError:
        times = []
    if match is None or len(times) < 3 or sorted(set(times)) != times:
        raise TrialError(f"strikes {text!r}: must be three or more {_ON}")
    first = SIDES_IN_WORDS.index(match[1].lower())
    sides = cycle((SIDES_IN_WORDS[first], SIDES_IN_WORDS[1 - first]))
    return tuple(FootEvent(t, side, strike=True) for t, side in zip(times, sides, strict=False))


def _own_export(file: Path) -> tuple[tuple[FootEvent, ...], Scenario | None]:
    """Return events and scenario of a file that this program exported, by what lies beside it."""
    about = file.parent / MADE_FROM
    if not about.is_file():
        return (), None
    try:
        told = read_any_json(about)
        if file.name not in told["files"]:
            return (), None
        events = tuple(FootEvent(**event) for event in told["events"])
        return events, Scenario.from_record(told["scenario"])
    except (ResultError, KeyError, TypeError, ValueError):
        return (), None
