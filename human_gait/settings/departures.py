"""Settings that are not as by default, and so move what a walk is held against."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import MISSING, dataclass, replace
from typing import Any

import numpy as np

from human_gait.body.limits import joint_limits
from human_gait.body.skeleton import DOF_NAMES, index
from human_gait.scenario import Scenario
from human_gait.scenario.limits import Limits, range_rule
from human_gait.scenario.problem import Posture
from human_gait.scenario.schema import About, Section

_TASK = ("walk.speed", "walk.step_length", "load.mass", "discretisation.control_points")
"""What is asked for, told beside every result, and how freely it may move: no limits."""


@dataclass(frozen=True)
class Departure:
    """A setting that is not as by default.

    Attributes
    ----------
    key : str
        Dotted, as in messages: ``tolerances.contact_speed``.
    value, default : float, str or list
        In `unit`.
    unit : str
        Empty for text and pure numbers.
    """

    key: str
    value: Any
    default: Any
    unit: str

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.key} = {_text(self.value)}{unit}, default {_text(self.default)}"


def departures(scenario: Scenario) -> list[Departure]:
    """Return every setting that is not as by default and moves what a walk is held against.

    Not those of the person, and of the task that is told with every result: speed, step length and
    mass of the load. A joint's own range counts if it is not the joint's usual one.
    """
    found: list[Departure] = []
    for name in Scenario.sections():
        section = getattr(scenario, name)
        if isinstance(section, Limits):
            found += _of_joints(scenario)
        elif name != "subject":
            found += _of_section(section, scenario.about)
    return found


def _of_section(section: Section, about: About) -> Iterator[Departure]:
    for key, value in section.to_table().items():
        default = section.usual(key, about)
        default = list(default) if isinstance(default, tuple) else default
        if default is not MISSING and value != default and section.dotted(key) not in _TASK:
            yield Departure(section.dotted(key), value, default, section.rule(key).get("unit", ""))


def _of_joints(scenario: Scenario) -> Iterator[Departure]:
    """Yield joints that are frozen or have a range of their own, beside their usual range."""
    usual = joint_limits(replace(scenario, posture=Posture(), limits=Limits()))
    own = {name: [0.0, 0.0] for name in scenario.limits.frozen}
    own |= {limited.name: [limited.lower, limited.upper] for limited in scenario.limits.ranges}
    for name in sorted(own, key=DOF_NAMES.index):
        unit = range_rule(name)["unit"]
        ends = [float(end[index(name)]) for end in usual]
        default = [round(float(np.rad2deg(x)) if unit == "deg" else x, 9) for x in ends]
        if own[name] != default:
            yield Departure(f"limits.{name}", own[name], default, unit)


def _text(value: Any) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(map(_text, value)) + "]"
    return f"{value:.12g}" if isinstance(value, float) else str(value)
