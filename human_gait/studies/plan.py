"""The walks of a study: what each is asked, its key, and which other one it starts from."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.metadata import version
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from human_gait.exceptions import ScenarioError
from human_gait.people.population import Population
from human_gait.scenario import Scenario, Subject, Walk
from human_gait.scenario.nearness import NEAR, Place
from human_gait.studies.design import Point, n_points, points
from human_gait.studies.study_file import MOST_WALKS, StudyFile

MOST_TOGETHER = 24
"""Walks that start from one, itself included: few, so that they can be shared among workers."""

_LOOKED_AT = 96  # nearest walks of one, of which those that are free yet follow it
_DIGITS = 32
_SHORT = 0.3  # [m], a step that every leg can span


@dataclass(frozen=True)
class Job:
    """One walk of a study.

    Attributes
    ----------
    key : str
        32 hexadecimal digits of the scenario, without its name, and the version of the package.
    settings : mapping of str to value
        What is varied, by dotted key.
    person : int or None
        Of the population, from 0.
    scenario : Scenario or None
        None if it is not allowed.
    refused : str
        Why it is not.
    start : str
        The key of the walk that it starts from; empty if it is found from nothing.
    """

    key: str
    settings: Point
    person: int | None
    scenario: Scenario | None
    refused: str = ""
    start: str = ""


@dataclass(frozen=True)
class Plan:
    """All walks of a study, in its order; the same for the same file and version.

    Attributes
    ----------
    study : StudyFile
    jobs : tuple of Job
        Each key once.
    """

    study: StudyFile
    jobs: tuple[Job, ...]

    @property
    def n_cold(self) -> int:
        """How many are found from nothing."""
        return sum(1 for job in self.jobs if job.scenario and not job.start)

    def part(self, number: int, of: int) -> Plan:
        """Return one of several parts, numbered from 1: walks stay with the one they start from."""
        heads = [job.key for job in self.jobs if not job.start]
        mine = set(heads[number - 1 :: of])
        return Plan(self.study, tuple(job for job in self.jobs if (job.start or job.key) in mine))


@cache
def package_version() -> str:
    """Return the version that keys are made with: walks of another one are not the same."""
    return version("human-gait")


def n_walks(study: StudyFile) -> int:
    """Return how many walks a study file asks for, those that are the same counted each."""
    return n_points(study.vary, study.design) * (study.people.count if study.people else 1)


def plan_of(study: StudyFile) -> Plan:
    """Return all walks of a study, each with the one it starts from.

    Raises
    ------
    ScenarioError
        If there are too many, or none of them is allowed.
    """
    _check_people(study)
    if (count := n_walks(study)) > MOST_WALKS:
        raise ScenarioError("vary", f"makes {count} walks, at most {MOST_WALKS} can be", None)
    jobs = {job.key: job for job in _jobs(study)}
    if all(job.scenario is None for job in jobs.values()):
        first = next(iter(jobs.values()))
        raise ScenarioError("vary", f"no walk of the study is allowed: {first.refused}")
    listed = list(jobs.values())
    starts = _starts([job.scenario for job in listed])
    return Plan(
        study,
        tuple(
            job if start is None else _starting(job, listed[start].key)
            for job, start in zip(listed, starts, strict=True)
        ),
    )


def _check_people(study: StudyFile) -> None:
    """Refuse to vary what people are drawn with: their lengths belong to their stature."""
    kept = ("subject.strength",)
    for key in study.vary:
        if study.people and key.startswith("subject.") and key not in kept:
            rule = f"people are drawn with it: of a population only {kept[0]} can be varied"
            raise ScenarioError(f"vary.{key}", rule)


def _starting(job: Job, start: str) -> Job:
    return Job(job.key, job.settings, job.person, job.scenario, job.refused, start)


def _jobs(study: StudyFile) -> Iterator[Job]:
    number, digits = 0, len(str(n_walks(study)))
    for person, subject in _people(study):
        for point in points(study.vary, study.design):
            number += 1
            name = f"{study.name}-{number:0{digits}d}"
            try:
                scenario = _asked(study, subject, point, name)
            except ScenarioError as error:
                lines = "; ".join(one.line for one in error.errors)
                yield Job(_key([lines, _plain(point), person]), point, person, None, lines)
            else:
                yield Job(walk_key(scenario), point, person, scenario)


def _people(study: StudyFile) -> Iterator[tuple[int | None, Subject | None]]:
    """Yield the people of a study with their numbers; None for that of the scenario."""
    if study.people is None:
        yield None, None
        return
    given = study.people
    yield from enumerate(Population(given.sex, given.count, given.seed, strength=given.strength))


def _asked(study: StudyFile, subject: Subject | None, point: Point, name: str) -> Scenario:
    """Return the scenario of a walk: of whom, at which point, at the pace of the study."""
    base = study.scenario
    walk = {key: value for key, value in point.items() if not key.startswith("subject.")}
    who = {key: value for key, value in point.items() if key.startswith("subject.")}
    subject = _person(base, subject or base.subject, who)
    if study.pace == "given":
        return base.replace({"name": name, "subject": subject, **walk})
    # Dynamic similarity: v^2 / (g l) and L / l as those of the person of the scenario.
    pace = _pace(base, tuple((key, one) for key, one in walk.items() if key.startswith("walk.")))
    legs = subject.leg_length / base.subject.leg_length
    walk["walk.speed"] = round(pace.speed * math.sqrt(legs), 4)
    walk["walk.step_length"] = round(pace.step_length * legs, 4)
    return base.replace({"name": name, "subject": subject, **walk})


@lru_cache(maxsize=1024)
def _pace(base: Scenario, walk: tuple[tuple[str, Any], ...]) -> Walk:
    return base.replace(dict(walk)).walk


def _person(base: Scenario, person: Subject, who: Point) -> Subject:
    """Return who walks: a person, with the settings of a point.

    Another sex makes another person, at the same percentiles.
    """
    if not who:
        return person
    if "subject.sex" in who:
        own = {"percentile": person.percentile, "strength": person.strength}
        person = Subject.from_table({"sex": who["subject.sex"], **own})
    short = base.replace({"walk.step_length": _SHORT, "subject": person})
    return short.replace(who).subject


def walk_key(scenario: Scenario) -> str:
    """Return the key of a walk: the same wherever and in whatever study it is asked for."""
    table = scenario.to_dict()
    del table["name"]
    return _key(table)


def _key(content: Any) -> str:
    text = json.dumps([package_version(), content], sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]


def _plain(point: Mapping[str, Any]) -> dict[str, Any]:
    return {key: list(one) if isinstance(one, tuple) else one for key, one in point.items()}


def _starts(scenarios: Sequence[Scenario | None]) -> list[int | None]:
    """Return of each walk the number of the one that it starts from, None if from nothing.

    Whoever comes first leads those near it that have no leader yet. No walk waits for more than
    one other, and who leads whom is a matter of the file alone, not of who is quick.
    """
    starts: list[int | None] = [None] * len(scenarios)
    for members, numbers in _kinds(scenarios):
        tree, free = cKDTree(numbers), np.ones(len(members), dtype=bool)
        for i in range(len(members)):
            if not free[i]:
                continue
            free[i] = False
            _, near = tree.query(
                numbers[i], k=min(_LOOKED_AT, len(members)), distance_upper_bound=NEAR
            )
            followers = [j for j in np.atleast_1d(near) if j < len(members) and free[j]]
            for j in followers[: MOST_TOGETHER - 1]:
                free[j] = False
                starts[members[j]] = members[i]
    return starts


def _kinds(scenarios: Sequence[Scenario | None]) -> Iterator[tuple[list[int], Any]]:
    """Yield the walks that differ in numbers alone: which, and their places (n, settings)."""
    found: dict[tuple[object, ...], list[int]] = {}
    places = [None if scenario is None else Place.of(scenario) for scenario in scenarios]
    for i, place in enumerate(places):
        if place is not None:
            found.setdefault(place.kind, []).append(i)
    for members in found.values():
        yield members, np.array([places[i].numbers for i in members])  # type: ignore[union-attr]
