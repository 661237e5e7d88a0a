"""Everything that defines one prediction, checked as a whole."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterator, Mapping, Set
from dataclasses import field
from typing import Any, ClassVar, Self

import tomli_w

from human_gait.exceptions import ScenarioError
from human_gait.scenario.declarations import text
from human_gait.scenario.limits import Limits
from human_gait.scenario.person import Load, Subject
from human_gait.scenario.problem import Discretisation, Ground, Objective, Posture, Tolerances
from human_gait.scenario.replacing import changed_table
from human_gait.scenario.schema import ALONE, About, Section, gathered, section
from human_gait.scenario.step import Phases, Walk

STEP_HALF_ANGLE_DEG = 35.0  # hip extension limit 30 deg + rising onto the toes, pelvis rotation
UNNAMED = "scenario"
"""Name of a scenario that was given none."""

_LONGEST_NAME = 100
_NAME = rf"\w[\w .+-]{{0,{_LONGEST_NAME - 1}}}"


def lawful_name(text: str) -> str:
    """Return a name that a scenario may have for one that it may not: ``walk-1`` for ``walk (1)``.

    Signs that are no letters or digits become hyphens.
    """
    if re.fullmatch(_NAME, text):
        return text
    plain = re.sub(r"[\s-]*[^\w .+-][^\w.+]*", "-", unicodedata.normalize("NFC", text))
    cut = plain.lstrip(" .+-")[:_LONGEST_NAME]
    return cut.rstrip(" .+-") or UNNAMED


@section
class Scenario(Section):
    """Everything that defines one prediction.

    Sections can be given as plain tables: ``Scenario("slow", {"speed": 0.8, "step_length": 0.5})``.

    Raises
    ------
    ScenarioError
        With everything that is wrong.
    """

    root: ClassVar[bool] = True

    name: str = text(
        "what the result is called",
        _NAME,
        f"a name of at most {_LONGEST_NAME} letters, digits, '_', '-', '.' and blanks",
        default_words="the name of the file",
    )
    walk: Walk
    subject: Subject = field(default_factory=Subject.default)
    phases: Phases = field(default_factory=Phases)
    load: Load = field(default_factory=Load)
    discretisation: Discretisation = field(default_factory=Discretisation)
    tolerances: Tolerances = field(default_factory=Tolerances)
    ground: Ground = field(default_factory=Ground)
    objective: Objective = field(default_factory=Objective)
    posture: Posture = field(default_factory=Posture)
    limits: Limits = field(default_factory=Limits)

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> Iterator[ScenarioError]:
        """Yield what does not fit together across sections."""
        if {"subject", "walk"} <= values.keys():
            yield from _out_of_reach(values["subject"], values["walk"])
        load = values.get("load")
        if load and load.mass > 0.0 and load.position[0] != 0.0:
            rule = "must be in the middle (x = 0): left and right steps are mirror images"
            yield ScenarioError("load.position", rule, list(load.position))

    @classmethod
    def defaults(cls, given: Mapping[str, Any], about: About) -> dict[str, Any]:
        """Return a name, and the sections that can be left out."""
        return {**super().defaults(given, about), "name": UNNAMED}

    @classmethod
    def _whole(
        cls, given: Mapping[str, Any], left_out: Set[str], errors: list[ScenarioError]
    ) -> dict[str, Any]:
        values = super()._whole(given, left_out, errors)
        about = about_sections(values)
        for name in cls.sections():
            if name in values:
                with gathered(errors):
                    values[name] = values[name].completed(about)
        return values

    @property
    def about(self) -> About:
        """What the defaults of the sections follow from."""
        return about_sections(vars(self))

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> Scenario:
        """Make a scenario from plain tables; inverse of `to_dict`."""
        return cls.from_table(table)

    @classmethod
    def from_record(cls, table: object) -> Scenario:
        """Make the scenario of a result from the tables that are stored with it.

        Those of results that are older than the formulations name none: it is ``effort``. Who is
        not named is the person of the first versions.
        """
        if not isinstance(table, Mapping):
            return cls.from_table(table)
        whole = dict(table)
        objective, subject = (table.get(name, {}) for name in ("objective", "subject"))
        if isinstance(objective, Mapping):
            whole["objective"] = {"formulation": "effort", **objective}
        if isinstance(subject, Mapping):
            whole["subject"] = Subject.recorded(subject)
        return cls.from_table(whole)

    def to_dict(self) -> dict[str, Any]:
        """Return the scenario as plain tables, lists, numbers and text."""
        return self.to_table()

    def to_toml(self) -> str:
        """Return the scenario as the text of a file that loads back equal, defaults included."""
        return tomli_w.dumps(self.to_table())

    def replace(self, changes: Mapping[str, Any] | None = None, /, **more: Any) -> Self:
        """Return the scenario with some settings changed, all others as they are.

        Another sex leaves stature and mass as they are: ``subject=Subject.default("female")``.

        Parameters
        ----------
        changes, **more
            Settings by their dotted key (``{"walk.speed": 1.0}``), by their own name where only
            one section has it (``speed=1.0``), or whole sections (``walk=Walk(1.0, 0.5)``).

        Raises
        ------
        ScenarioError
            If a key is unknown or could mean several settings, or the result is not allowed.
        """
        given = [*(changes or {}).items(), *more.items()]
        return self.from_table(changed_table(self, self.about, given))


def about_sections(values: Mapping[str, Any]) -> About:
    """Return what the defaults of sections follow from, as far as it is known."""
    walk, subject, objective = (values.get(name) for name in ("walk", "subject", "objective"))
    return About(
        formulation=objective.formulation if objective else ALONE.formulation,
        speed=walk.speed if walk else ALONE.speed,
        stature=subject.stature if subject else ALONE.stature,
    )


def _out_of_reach(subject: Subject, walk: Walk) -> Iterator[ScenarioError]:
    """Yield an error for a step that the legs cannot span.

    Both legs straight at the angle s from the vertical span 2 l sin(s), l the leg length.
    """
    leg = subject.leg_length
    longest = 2.0 * leg * math.sin(math.radians(STEP_HALF_ANGLE_DEG))
    if walk.step_length > longest:
        rule = f"2 x {leg:.3f} m x sin({STEP_HALF_ANGLE_DEG:g} deg)"
        allowed = f"must be at most {longest:.2f} m, the reach of legs of {leg:.2f} m: {rule}"
        yield ScenarioError("walk.step_length", allowed, walk.step_length)
