"""Joint ranges of a scenario, in degrees (or metres) until they are asked for in SI."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

from human_gait.exceptions import ScenarioError
from human_gait.scenario.declarations import free
from human_gait.scenario.schema import Section, gathered, refuse, section, unknown
from human_gait.scenario.values import checked

TRANSLATION_DOFS = ("pelvis_tz", "pelvis_tx", "pelvis_ty")
NOT_FROZEN = {"pelvis_tz", "pelvis_ty"}


def range_rule(name: str) -> dict[str, Any]:
    """Return unit and allowed range of the limits of a DOF."""
    if name in TRANSLATION_DOFS:
        return {"unit": "m", "range": (-20.0, 20.0)}
    return {"unit": "deg", "range": (-180.0, 180.0)}


@dataclass(frozen=True)
class DofRange:
    """Own range of one DOF, in degrees (metres for the translations of the pelvis)."""

    name: str
    lower: float
    upper: float


@section
class Limits(Section):
    """Exceptions to the joint limits: DOF held at zero and DOF with a range of their own.

    In the file ``frozen = ["name", ...]`` and, for each range, ``name = [lower, upper]``.
    """

    frozen: tuple[str, ...] = free(
        "joints held at zero", "a list of names of DOF", "frozen", default=()
    )
    ranges: tuple[DofRange, ...] = free(
        "own range of a joint, in the place of the usual one",
        "[lower, upper] in deg, from -180 to 180; of pelvis_tz, _tx, _ty in m, from -20 to 20",
        "<joint>",
        default=(),
        default_words="the usual range of the joint",
    )

    def __post_init__(self) -> None:
        """Leave the check of names and numbers to `from_table` and to the known DOF."""

    @classmethod
    def from_table(cls, table: object) -> Self:
        """Make the section from the list ``frozen`` and one range per further key."""
        if not isinstance(table, Mapping):
            raise ScenarioError("limits", "must be a table of joint ranges", table)
        errors: list[ScenarioError] = []
        frozen: tuple[str, ...] = ()
        ranges = []
        with gathered(errors):
            frozen = _names(table.get("frozen", []))
        for name in table:
            if name != "frozen":
                with gathered(errors):
                    ranges.append(_dof_range(str(name), table[name]))
        refuse([*errors, *cls.conflicts({"frozen": frozen, "ranges": ranges})])
        return cls(frozen, tuple(ranges))

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> Iterator[ScenarioError]:
        """Yield what is frozen and must move."""
        for name in sorted(set(values["frozen"]) & NOT_FROZEN):
            yield ScenarioError("limits.frozen", "cannot hold the pelvis at the origin", name)
        for limited in values["ranges"]:
            if limited.name in values["frozen"]:
                yield ScenarioError(cls.dotted(limited.name), "is frozen and cannot have a range")

    def to_table(self) -> dict[str, Any]:
        """Return the section as it stands in a file."""
        ranges = {limited.name: [limited.lower, limited.upper] for limited in self.ranges}
        return {"frozen": list(self.frozen), **ranges}

    def frozen_dofs(self, dof_names: Sequence[str]) -> tuple[str, ...]:
        """Return the names of the DOF held at zero, all of them among `dof_names`."""
        strange = [name for name in self.frozen if name not in dof_names]
        refuse([unknown("limits.frozen", name, dof_names, f"DOF {name!r}") for name in strange])
        return self.frozen

    def ranges_si(self, dof_names: Sequence[str]) -> dict[str, tuple[float, float]]:
        """Return lower and upper limit [rad] or [m] by name, all of them among `dof_names`."""
        strange = [limited.name for limited in self.ranges if limited.name not in dof_names]
        refuse([unknown(self.dotted(name), name, dof_names, "DOF") for name in strange])
        return {limited.name: _in_si(limited) for limited in self.ranges}


def _names(value: object) -> tuple[str, ...]:
    if not isinstance(value, list | tuple) or not all(isinstance(name, str) for name in value):
        raise ScenarioError("limits.frozen", "must be a list of names of DOF", value)
    return tuple(value)


def _dof_range(name: str, value: object) -> DofRange:
    key, rule = Limits.dotted(name), range_rule(name)
    lower, upper = checked(key, value, tuple[float, float], rule)
    if lower > upper:
        raise ScenarioError(key, "must be [lower, upper] with lower not above upper", value)
    return DofRange(name, lower, upper)


def _in_si(limited: DofRange) -> tuple[float, float]:
    unit = 1.0 if limited.name in TRANSLATION_DOFS else math.radians(1.0)
    return limited.lower * unit, limited.upper * unit
