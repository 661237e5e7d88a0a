"""Joint ranges of a scenario, in degrees (or metres) until they are asked for in SI."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

from human_gait.exceptions import ScenarioError
from human_gait.scenario.declarations import free
from human_gait.scenario.schema import Section, gathered, refuse, section, unknown
from human_gait.scenario.values import checked

TRANSLATION_DOFS = ("pelvis_tz", "pelvis_tx", "pelvis_ty")
NOT_FROZEN = {"pelvis_tz", "pelvis_ty"}
_MOST_NAMES = 100  # to look up the meaning of each unknown one takes time


def range_rule(name: str) -> dict[str, Any]:
    """Return unit and allowed range of the limits of a DOF."""
    if name in TRANSLATION_DOFS:
        return {"unit": "m", "range": (-20.0, 20.0)}
    return {"unit": "deg", "range": (-180.0, 180.0)}


@dataclass(frozen=True)
class DofRange:
    """Own range of one DOF, in degrees (metres for the translations of the pelvis).

    Raises
    ------
    ScenarioError
        If the limits are no numbers or quantities in range, or the lower is above the upper.
    """

    name: str
    lower: float
    upper: float

    def __post_init__(self) -> None:
        """Replace the limits by their checked form, a quantity by its number."""
        lower, upper = _range(self.name, [self.lower, self.upper])
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)


@section
class Limits(Section):
    """Exceptions to the joint limits: DOF held at zero and DOF with a range of their own.

    In the file ``frozen = ["name", ...]`` and, for each range, ``name = [lower, upper]``.

    Raises
    ------
    ScenarioError
        With everything that is wrong, but for names that no DOF has: these are known to the body.
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

    @classmethod
    def from_table(cls, table: object) -> Self:
        """Make the section from the list ``frozen`` and one range per further key."""
        if not isinstance(table, Mapping):
            raise ScenarioError("limits", "must be a table of joint ranges", table)
        if len(table) > _MOST_NAMES:
            raise ScenarioError("limits", f"has {len(table)} keys, a body has fewer joints")
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
    def _checked(cls, name: str, value: object) -> Any:
        return _names(value) if name == "frozen" else _ranges(value)

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> Iterator[ScenarioError]:
        """Yield what is frozen and must move, and what has two ranges."""
        frozen = values.get("frozen", ())
        for name in sorted(set(frozen) & NOT_FROZEN):
            yield ScenarioError("limits.frozen", "cannot hold the pelvis at the origin", name)
        for name, times in Counter(limited.name for limited in values.get("ranges", ())).items():
            if name in frozen:
                yield ScenarioError(cls.dotted(name), "is frozen and cannot have a range")
            if times > 1:
                yield ScenarioError(cls.dotted(name), "is given twice")

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
    if len(value) > _MOST_NAMES:
        raise ScenarioError("limits.frozen", f"has {len(value)} names, a body has fewer joints")
    return tuple(value)


def _ranges(value: object) -> tuple[DofRange, ...]:
    if not isinstance(value, list | tuple) or not all(isinstance(one, DofRange) for one in value):
        words = 'must be a list of ranges, such as [DofRange("knee_flexion_r", 0, 70)]'
        raise ScenarioError("limits.ranges", words, value)
    if len(value) > _MOST_NAMES:
        raise ScenarioError("limits.ranges", f"has {len(value)} ranges, a body has fewer joints")
    return tuple(value)


def _dof_range(name: str, value: object) -> DofRange:
    return DofRange(name, *_range(name, value))


def _range(name: object, value: object) -> tuple[float, float]:
    """Return the lower and the upper limit of a DOF as plain numbers."""
    if not isinstance(name, str):
        raise ScenarioError("limits", "must have each range under the name of a joint", name)
    key, rule = Limits.dotted(name), range_rule(name)
    if name in Limits.kinds():
        words = "is no joint: a range stands under the name of one, such as limits.knee_flexion_r"
        raise ScenarioError(key, words)
    lower, upper = checked(key, value, tuple[float, float], rule)
    if lower > upper:
        raise ScenarioError(key, "must be [lower, upper] with lower not above upper", value)
    return lower, upper


def _in_si(limited: DofRange) -> tuple[float, float]:
    unit = 1.0 if limited.name in TRANSLATION_DOFS else math.radians(1.0)
    return limited.lower * unit, limited.upper * unit
