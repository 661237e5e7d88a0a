"""A measured trial as a walk of our body: joint angles, mean step, forces, and what is lost."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from human_gait.body.person import make_body
from human_gait.body.skeleton import GRAVITY, SIDES_IN_WORDS
from human_gait.exceptions import TrialError
from human_gait.export.events import FootEvent
from human_gait.scenario import Load, Scenario, Subject
from human_gait.scenario.whole import lawful_name
from human_gait.trials.feet_forces import by_foot, mean_forces, strikes_by_forces
from human_gait.trials.inverse_kinematics import TOLD, Tell
from human_gait.trials.losses import left_over, off_markers, off_the_mean
from human_gait.trials.motion import Moved, Person, moved_body, strikes_by_motion
from human_gait.trials.recording import Plate, Recording
from human_gait.trials.smoothing import smooth_fit
from human_gait.trials.steps import STRIDE, Steps, cut, longest_run, told_by_both
from human_gait.walk.bspline import Basis
from human_gait.walk.cycle import step_cycle
from human_gait.walk.described import with_story
from human_gait.walk.gait import Gait
from human_gait.walk.measured import MEASURED, GroundForces

_DOUBLE_SUPPORT = (0.05, 0.34)  # of a step: what phases can hold
_FASTEST = 3.0  # [m/s], of a belt
_UNKNOWN = Person()


def fitted(  # noqa: PLR0913, options that are given by name
    trial: Recording,
    *,
    static: Recording | None = None,
    person: Person = _UNKNOWN,
    base: Scenario | None = None,
    speed: float = 0.0,
    marker_map: Mapping[str, str] | None = None,
    strikes: Sequence[FootEvent] = (),
    control_points: int | None = None,
    tell: Tell = lambda *_: None,
) -> Gait:
    """Return a trial as a walk: the mirrored mean of its steps, under its measured forces.

    Parameters
    ----------
    trial : Recording
        With markers, or with all angles of ours.
    static : Recording, optional
        Of the same markers, from which lengths are found instead.
    person : Person
    base : Scenario, optional
        Whose person, load, phases and other settings are taken where nothing else is known.
    speed : float, [m/s]
        Of the belt of a treadmill.
    marker_map : mapping of str to str, optional
        Our markers by names of the file.
    strikes : sequence of FootEvent, optional
        Else those of the file, of its forces, or of the motion: the first with a whole stride.
    control_points : int, optional
        Of the splines of each joint; else as many as a prediction has.
    tell : function, optional
        Is told how many frames are done, and of how many.

    Raises
    ------
    TrialError
        If the trial has neither enough markers nor angles, or no whole stride.
    ScenarioError
        If it is no walk that a scenario can describe.
    """
    began, source = time.perf_counter(), str(trial.source)
    if not abs(speed) <= _FASTEST:
        raise TrialError(f"--speed = {speed:g}: must be at most {_FASTEST:g} m/s")
    load = base.load if base else Load()
    moved = moved_body(trial, static, _subject(person, base), load, person, marker_map, tell)
    feet = by_foot(make_body(moved.subject, load), moved.time, moved.q, moved.plates)
    events, told_by = _strikes(strikes, trial, feet, moved, load)
    steps = cut(make_body(moved.subject, load), moved.time, moved.q, events, speed, source)
    forces, n_forces = mean_forces(feet, steps)
    subject = _weighed(moved.subject, load, trial, person, forces)
    scenario = _scenario(
        lawful_name(trial.source.stem), base, subject, steps, events, control_points
    )
    parts = steps.samples(moved.time, moved.q)
    parts = told_by_both(parts, steps, moved.told >= TOLD)
    basis = _basis(scenario)
    t = np.concatenate([share for share, _ in parts]) * steps.time
    points = basis.expand(smooth_fit(basis, t, np.concatenate([q for _, q in parts])))
    gait = Gait(scenario, basis.breaks, points, forces=forces)
    story = {
        "what": _what(trial, steps, told_by, n_forces),
        "files": [str(trial.source)],
        "not_kept": [*off_the_mean(gait, steps, parts), *off_markers(moved), *left_over(gait)],
        "markers": {site.name: site.in_words for site in moved.sites},
        "left_out": sorted(set(trial.markers) - {site.name for site in moved.sites}),
    }
    return _told(gait, story, time.perf_counter() - began)


def _strikes(
    given: Sequence[FootEvent],
    trial: Recording,
    feet: Sequence[Plate],
    moved: Moved,
    load: Load,
) -> tuple[Sequence[FootEvent], str]:
    """Return strikes and offs of the first source that tells a whole stride, and which it is.

    What is given is taken as it is; of sources that all tell less, the one that tells most.
    """
    if given:
        return given, "as given"
    sources = {
        "from the events of the file": trial.events,
        "from the forces": strikes_by_forces(feet),
        "from the motion": strikes_by_motion(moved, load),
    }
    runs = {name: len(longest_run(moved.time, events)) for name, events in sources.items()}
    best = next((name for name in runs if runs[name] >= STRIDE), max(runs, key=lambda k: runs[k]))
    return sources[best], best


def _told(gait: Gait, story: Mapping[str, Any], seconds: float) -> Gait:
    found = {"solver": MEASURED, "status": story["what"], "wall_time_s": seconds}
    return with_story(
        replace(gait, solution=found),
        success=False,
        start=MEASURED,
        dynamics="pinocchio",
        seed=0,
        iterations=0,
        evaluations=0,
        **{MEASURED: story},
    )


def _subject(person: Person, base: Scenario | None) -> Subject:
    """Return who is begun with."""
    known = {key: value for key, value in vars(person).items() if value is not None}
    if base and (person.sex is None or person.sex == base.subject.sex):
        return replace(base.subject, **known)
    return Subject.from_table(known)


def _weighed(
    subject: Subject, load: Load, trial: Recording, person: Person, forces: GroundForces | None
) -> Subject:
    """Return the person with the mass that is given, told by the file, or on the ground."""
    mass = person.mass or trial.mass
    if mass is None and forces is not None:
        up = forces.force[..., 1].sum(axis=1)
        mass = float(np.trapezoid(up, np.linspace(0.0, 1.0, len(up)))) / GRAVITY - load.mass
    return subject if mass is None else replace(subject, mass=mass)


def _scenario(
    name: str,
    base: Scenario | None,
    subject: Subject,
    steps: Steps,
    events: Sequence[FootEvent],
    control_points: int | None,
) -> Scenario:
    walk = {"speed": steps.length / steps.time, "step_length": steps.length}
    walk["step_width"] = min(steps.width, 0.4)
    if base:
        task = base.replace(name=name, walk=walk, subject=subject)
    else:
        both = _double_support(steps, events)
        phases = {} if both is None else {"double_support": both}
        task = Scenario(name, walk=walk, subject=subject, phases=phases)  # type: ignore[arg-type]
    if control_points is None:
        return task
    return task.replace({"discretisation.control_points": control_points})


def _double_support(steps: Steps, events: Sequence[FootEvent]) -> float | None:
    """Return how long both feet stand, of a step, if anybody has seen feet leave the ground."""
    shares = []
    for step in steps.steps:
        trailing = SIDES_IN_WORDS[1 if step.mirrored else 0]
        for event in events:
            if not event.strike and event.side == trailing and step.start < event.time < step.end:
                shares.append((event.time - step.start) / (step.end - step.start))
                break
    if not shares:
        return None
    return round(float(np.clip(np.mean(shares), *_DOUBLE_SUPPORT)), 4)


def _basis(scenario: Scenario) -> Basis:
    grid = scenario.discretisation
    return Basis.uniform(step_cycle(scenario.walk), grid.control_points, grid.mirrored)


def _what(trial: Recording, steps: Steps, told_by: str, n_forces: int) -> str:
    by = f"forces measured in {n_forces}" if n_forces else "without measured forces"
    mean = f"the mean of {len(steps.steps)} steps of {trial.source.name}, mirrored"
    return f"{mean}; strikes {told_by}; {by}"
