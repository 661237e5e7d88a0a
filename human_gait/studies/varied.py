"""The values that a study gives to a setting: a list, or steps between two ends."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_origin

import numpy as np

from human_gait.exceptions import ScenarioError
from human_gait.scenario import Scenario
from human_gait.scenario.replacing import full_key
from human_gait.scenario.schema import gathered, refuse, unknown
from human_gait.scenario.values import checked

MOST_VALUES = 100_000
_RANGE = ("from", "to", "count", "step")
_ROUNDING = 1e-9  # of the end that steps have to meet


@dataclass(frozen=True)
class Values:
    """What a setting is varied over.

    Attributes
    ----------
    steps : tuple of value
        Those of a grid; of a range that is only drawn from, its ends.
    between : bool
        Whether what lies between is meant, too, where a design draws points.
    """

    steps: tuple[Any, ...]
    between: bool = False

    def drawn(self, share: float) -> Any:
        """Return the value at a share, 0 to 1, of the way: between the ends, or one of a list."""
        if self.between:
            low, high = self.steps[0], self.steps[-1]
            value = low + share * (high - low)
            return round(value) if isinstance(low, int) and isinstance(high, int) else value
        return self.steps[min(int(share * len(self.steps)), len(self.steps) - 1)]

    def to_plain(self) -> Any:
        """Return it as it stands in a file."""
        if self.between:
            return {"from": self.steps[0], "to": self.steps[-1], "count": len(self.steps)}
        return [list(one) if isinstance(one, tuple) else one for one in self.steps]


def values_of(table: object) -> dict[str, Values]:
    """Return what is varied by the dotted key of each setting.

    Parameters
    ----------
    table : mapping
        ``[vary]`` of a study file: keys as `Scenario.replace` takes them, with or without quotes.

    Raises
    ------
    ScenarioError
        For keys that no setting has, and for values that are not allowed.
    """
    if not isinstance(table, Mapping):
        raise ScenarioError("vary", "must be a table of settings", table)
    found: dict[str, Values] = {}
    errors: list[ScenarioError] = []
    for name, given in _flat(table, ""):
        with gathered(errors):
            key = _setting(name)
            if key in found:
                raise ScenarioError(f"vary.{key}", "is given twice")
            found[key] = _values(key, given)
    refuse(errors)
    return found


def _flat(table: Mapping[str, Any], before: str) -> Iterator[tuple[str, Any]]:
    """Yield settings with their dotted keys: ``walk.speed = ..`` is a table in a table of TOML."""
    for name, given in table.items():
        if isinstance(given, Mapping) and not set(given) & set(_RANGE):
            yield from _flat(given, f"{before}{name}.")
        else:
            yield f"{before}{name}", given


def _setting(name: str) -> str:
    """Return the dotted key of a setting of a section."""
    try:
        key = full_key(Scenario, name)
    except ScenarioError as error:
        raise ScenarioError(f"vary.{name}", error.allowed) from None
    section, dot, setting = key.partition(".")
    if not dot:
        raise ScenarioError(f"vary.{name}", "is no single setting: vary walk.speed, say")
    if "." in setting and section != "limits":
        whole = f"{section}.{setting.partition('.')[0]}"
        raise ScenarioError(f"vary.{name}", f"is a part of a setting: give lists for {whole}")
    kinds = Scenario.sections()[section].kinds()
    if section != "limits" and setting not in kinds:
        raise unknown(f"vary.{key}", setting, list(kinds), "setting")
    return key


def _values(key: str, given: object) -> Values:
    """Return the values of one setting, each allowed by itself."""
    if isinstance(given, Mapping):
        return _range(key, given)
    listed: Sequence[Any] = given if isinstance(given, list) else [given]
    if not listed or len(listed) > MOST_VALUES:
        raise ScenarioError(f"vary.{key}", f"must have 1 to {MOST_VALUES} values", given)
    steps: list[Any] = []
    errors: list[ScenarioError] = []
    for one in listed:
        with gathered(errors):
            steps.append(_allowed(key, one))
    refuse(errors)
    if twice := [one for k, one in enumerate(steps) if one in steps[:k]]:
        raise ScenarioError(f"vary.{key}", "is given twice", twice[0])
    return Values(tuple(steps))


def _allowed(key: str, value: object) -> Any:
    """Return a value of a setting, checked, in its unit."""
    section, _, setting = key.partition(".")
    kind = Scenario.sections()[section]
    if section == "limits":  # read in its own way, by the scenario
        return value
    found = kind.kinds()[setting]
    if isinstance(found, type) and hasattr(found, "kinds"):
        raise ScenarioError(f"vary.{key}", "is no single setting", value)
    return checked(f"vary.{key}", value, found, kind.rule(setting))


def _range(key: str, given: Mapping[str, Any]) -> Values:
    """Return the steps from one end to the other, both included."""
    name = f"vary.{key}"
    refuse(
        [
            unknown(f"{name}.{one}", one, _RANGE, "key of a range")
            for one in given
            if one not in _RANGE
        ]
    )
    if missing := [end for end in ("from", "to") if end not in given]:
        raise ScenarioError(name, f"has no {missing[0]}: {{ from = 1.0, to = 1.4, count = 5 }}")
    section, _, setting = key.partition(".")
    kinds = Scenario.sections()[section].kinds()
    if kinds.get(setting) not in (float, int) or get_origin(kinds.get(setting)) is tuple:
        raise ScenarioError(name, "has no range, only numbers have: give a list of values")
    low, high = (_allowed(key, given[end]) for end in ("from", "to"))
    if not low < high:
        raise ScenarioError(name, f"must go up, from {low:g} to more than that", high)
    return Values(_steps(name, given, low, high, kinds[setting]), between=True)


def _steps(
    name: str, given: Mapping[str, Any], low: float, high: float, kind: type
) -> tuple[Any, ...]:
    if {"count", "step"} <= given.keys():
        raise ScenarioError(name, "has a count and a step: give one of them")
    if "step" in given:
        step = given["step"]
        allowed = isinstance(step, int | float) and not isinstance(step, bool) and step > 0
        if not allowed or (high - low) / step > MOST_VALUES:
            raise ScenarioError(
                f"{name}.step", f"must be above 0, at most {MOST_VALUES} steps", step
            )
        if (count := round((high - low) / step)) < 1 or abs(low + count * step - high) > _ROUNDING:
            raise ScenarioError(f"{name}.step", f"does not lead from {low:g} to {high:g}", step)
        steps = np.linspace(low, high, count + 1)
    else:
        count = given.get("count", 2)
        whole = isinstance(count, int) and not isinstance(count, bool)
        if not whole or not 2 <= count <= MOST_VALUES:
            raise ScenarioError(
                f"{name}.count", f"must be a whole number from 2 to {MOST_VALUES}", count
            )
        steps = np.linspace(low, high, count)
    rounded = [float(f"{value:.12g}") for value in steps.tolist()]  # 1.2, not 1.2000000000000002
    if kind is int:
        rounded = list(dict.fromkeys(round(value) for value in rounded))
    return tuple(rounded)
