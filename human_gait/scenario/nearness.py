"""How near two scenarios are: which walk is the best start of another one."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from human_gait.scenario.limits import range_rule
from human_gait.scenario.schema import Section
from human_gait.scenario.whole import Scenario

NEAR = 0.1
"""Distance within which a walk is a start: 0.2 m/s, 0.18 m of the step, 9 kg."""


class Place(NamedTuple):
    """Where a scenario is among those that differ from it in numbers alone.

    Attributes
    ----------
    kind : tuple
        All settings that are choices, and the grid: walks of another kind are no start.
    numbers : tuple of float
        Each as a part of the range that its setting may have.
    """

    kind: tuple[object, ...]
    numbers: tuple[float, ...]

    @classmethod
    def of(cls, scenario: Scenario) -> Place:
        """Return the place of a scenario; its name does not count."""
        kind: list[object] = [scenario.discretisation, scenario.limits.frozen]
        numbers: list[float] = []
        for name in scenario.sections():
            if name not in ("discretisation", "limits"):
                _sort(getattr(scenario, name), kind, numbers)
        for limited in scenario.limits.ranges:
            kind.append(limited.name)
            numbers += _parts((limited.lower, limited.upper), *range_rule(limited.name)["range"])
        return cls(tuple(kind), tuple(numbers))

    def distance(self, other: Place) -> float:
        """Return the Euclidean distance of the numbers; infinite between different kinds."""
        return math.dist(self.numbers, other.numbers) if self.kind == other.kind else math.inf


def _sort(section: Section, kind: list[object], numbers: list[float]) -> None:
    """Add each setting of a section to what it belongs to."""
    for name in section.kinds():
        value: Any = section.place(name)
        rule = section.rule(name)
        if "range" in rule:
            numbers += _parts(value if isinstance(value, tuple) else (value,), *rule["range"])
        else:
            kind.append(value)


def _parts(values: tuple[float, ...], low: float, high: float) -> Iterator[float]:
    return (value / (high - low) for value in values)
