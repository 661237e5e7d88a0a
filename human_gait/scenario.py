"""Scenario: who walks, how fast, with what load, and how finely the motion is resolved."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any, ClassVar

from human_gait.exceptions import ScenarioError
from human_gait.schema import Section, section, text
from human_gait.sections import (
    STEP_HALF_ANGLE_DEG,
    Discretisation,
    DofRange,
    Ground,
    Limits,
    Load,
    Objective,
    Phases,
    Posture,
    Subject,
    Tolerances,
    Walk,
)

__all__ = [
    "STEP_HALF_ANGLE_DEG",
    "Discretisation",
    "DofRange",
    "Ground",
    "Limits",
    "Load",
    "Objective",
    "Phases",
    "Posture",
    "Scenario",
    "Subject",
    "Tolerances",
    "Walk",
    "check_reach",
    "load_scenario",
]


@section
class Scenario(Section):
    """Everything that defines one prediction."""

    root: ClassVar[bool] = True

    name: str = text(
        "what the result is called",
        r"\w[\w .+-]*",
        "a name of letters, digits, '_', '-', '.' and blanks",
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

    def __post_init__(self) -> None:
        """Check the values that depend on more than one section."""
        super().__post_init__()
        check_reach(self.subject, self.walk)
        if self.load.mass > 0.0 and self.load.position[0] != 0.0:
            rule = "must be in the middle (x = 0): left and right steps are mirror images"
            raise ScenarioError("load.position", rule, list(self.load.position))

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> Scenario:
        """Make a scenario from plain tables; inverse of `to_dict`."""
        return cls.from_table(table)

    def to_dict(self) -> dict[str, Any]:
        """Return the scenario as plain tables, lists, numbers and text."""
        return self.to_table()


def check_reach(subject: Subject, walk: Walk) -> None:
    """Refuse a step that the legs cannot span.

    Both legs straight at the angle s from the vertical span 2 l sin(s), l the leg length.

    Raises
    ------
    ScenarioError
        If the step is longer, with the longest possible one.
    """
    leg = subject.leg_length
    longest = 2.0 * leg * math.sin(math.radians(STEP_HALF_ANGLE_DEG))
    if walk.step_length > longest:
        rule = f"2 x {leg:.3f} m x sin({STEP_HALF_ANGLE_DEG:g} deg)"
        allowed = f"must be at most {longest:.2f} m, the reach of legs of {leg:.2f} m: {rule}"
        raise ScenarioError("walk.step_length", allowed, walk.step_length)


def load_scenario(path: str | Path) -> Scenario:
    """Read a scenario from a TOML file.

    Parameters
    ----------
    path : str or Path
        The file; its name without ending names the scenario unless it has a key ``name``.

    Returns
    -------
    Scenario

    Raises
    ------
    ScenarioError
        If the file cannot be read or a setting is unknown, missing, of wrong type or not allowed.
    """
    source = Path(path)
    try:
        return Scenario.from_dict({"name": source.stem, **_read_toml(source)})
    except ScenarioError as error:
        raise error.found_in(str(source)) from None


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        content = path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a path with a null character
        reason = error.strerror if isinstance(error, OSError) else error
        raise ScenarioError("", f"cannot be read: {reason}") from None
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise ScenarioError("", "is not a text file in UTF-8") from None
    except (ValueError, RecursionError) as error:
        raise ScenarioError("", f"is not TOML: {error}") from None
