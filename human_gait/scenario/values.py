"""One value of a setting: is it allowed, and what is it in the setting's own type and unit."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from numbers import Integral, Real
from typing import Any, get_args, get_origin

from human_gait.exceptions import ScenarioError
from human_gait.scenario.units import DIMENSIONS, QuantityError, in_unit

_LONGEST_VECTOR = 3


def checked(key: str, value: object, kind: Any, rule: Mapping[str, Any]) -> Any:
    """Return `value` as `kind` if the rule of its setting allows it.

    A quantity, such as ``"40 lb"``, becomes a number in the unit of the setting.

    Raises
    ------
    ScenarioError
        Naming key, value and what is allowed.
    """
    number = value
    try:
        number = _in_its_unit(value, rule)
        if get_origin(kind) is tuple:
            return _as_vector(number, kind, rule)
        return _SCALARS[kind](number, rule)
    except QuantityError as error:
        raise ScenarioError(key, str(error), value) from None
    except (TypeError, ValueError):
        words = f"must be {allowed_values(kind, rule)}"
        if number is not value:
            words = _converted(value, number, rule) + words
        elif isinstance(value, str):
            words += or_quantity(rule)
        raise ScenarioError(key, words, value) from None


def allowed_values(kind: Any, rule: Mapping[str, Any]) -> str:
    """Describe in words the values that a setting can take."""
    if "choices" in rule:
        return "one of " + ", ".join(rule["choices"])
    if "allowed" in rule:
        return str(rule["allowed"])
    low, high = rule["range"]
    limits = f"from {low:g} to {high:g} {rule['unit']}".rstrip()
    if get_origin(kind) is tuple:
        return f"{len(get_args(kind))} numbers, each {limits}"
    return f"a {'whole ' if kind is int else ''}number {limits}"


def or_quantity(rule: Mapping[str, Any]) -> str:
    """Return in words that a number can be given in other units; nothing if it has no dimension."""
    dimension = DIMENSIONS.get(rule.get("unit", ""))
    return f", or with its unit, such as {dimension.example}" if dimension else ""


def _in_its_unit(value: object, rule: Mapping[str, Any]) -> object:
    """Return a number for a quantity, also in a list; anything else as it is."""
    unit = rule.get("unit")
    if unit not in DIMENSIONS:
        return value
    if isinstance(value, list | tuple) and len(value) <= _LONGEST_VECTOR:
        return [in_unit(part, unit) if isinstance(part, str) else part for part in value]
    return in_unit(value, unit) if isinstance(value, str) else value


def _converted(value: object, number: object, rule: Mapping[str, Any]) -> str:
    """Return in words what a quantity is in the unit of the setting; nothing for plain numbers."""
    parts = value if isinstance(value, list | tuple) else [value]
    if not any(isinstance(part, str) for part in parts):
        return ""
    numbers = number if isinstance(number, list) else [number]
    shown = ", ".join(f"{part:.4g}" if isinstance(part, float) else str(part) for part in numbers)
    return f"is {shown} {rule['unit']}, "


def _as_float(value: object, rule: Mapping[str, Any]) -> float:
    low, high = rule["range"]
    if isinstance(value, bool) or not isinstance(value, Real):
        raise TypeError
    if not low <= value <= high:  # nor is any comparison with NaN true
        raise ValueError
    return float(value)


def _as_int(value: object, rule: Mapping[str, Any]) -> int:
    if not isinstance(value, Integral):
        raise TypeError
    return int(_as_float(value, rule))


def _as_text(value: object, rule: Mapping[str, Any]) -> str:
    if not isinstance(value, str):
        raise TypeError
    if not re.fullmatch(rule["pattern"], value):
        raise ValueError
    return value


def _as_vector(value: object, kind: Any, rule: Mapping[str, Any]) -> tuple[float, ...]:
    if not isinstance(value, list | tuple) or len(value) != len(get_args(kind)):
        raise TypeError
    return tuple(_as_float(component, rule) for component in value)


_SCALARS: dict[Any, Callable[[object, Mapping[str, Any]], Any]] = {
    float: _as_float,
    int: _as_int,
    str: _as_text,
}
