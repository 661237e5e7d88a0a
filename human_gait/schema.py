"""Settings declared once: type, unit, allowed range and source stand with the field.

A section of a scenario is a frozen dataclass derived from `Section`. A new setting is one line
in it; the check of its values, the loader, the error messages and the way back to a table follow
from the declaration.
"""

from __future__ import annotations

import dataclasses
import difflib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass
from numbers import Integral, Real
from typing import (
    Any,
    ClassVar,
    Self,
    TypeVar,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

from human_gait.exceptions import ScenarioError

S = TypeVar("S")

REQUIRED: Any = MISSING
SHOWN_NAMES = 10  # the sections of a scenario, or the settings of any one section


def number(
    meaning: str,
    unit: str,
    low: float,
    high: float,
    *,
    default: Any = REQUIRED,
    default_words: str = "",
    source: str = "",
) -> Any:
    """Declare a number, a whole number or a vector of numbers.

    Parameters
    ----------
    meaning : str
        What it does, in one line of plain words.
    unit : str
        Unit as shown to the user, ``""`` for a pure number.
    low, high : float
        Allowed range of every component, ends included.
    default : float or tuple, optional
        Value when the setting is left out; without it the setting is required.
    default_words : str, optional
        What the default follows from where it depends on other settings.
    source : str, optional
        Where the default or the range comes from.
    """
    metadata: dict[str, Any] = {
        "meaning": meaning,
        "unit": unit,
        "range": (low, high),
        "source": source,
    }
    metadata["default_words"] = default_words
    return dataclasses.field(default=default, metadata=metadata)


def choice(
    meaning: str,
    *choices: str,
    default: Any = REQUIRED,
    default_words: str = "",
    source: str = "",
) -> Any:
    """Declare a text setting that has to be one of `choices`."""
    pattern = "|".join(map(re.escape, choices))
    metadata: dict[str, Any] = {
        "meaning": meaning,
        "choices": choices,
        "pattern": pattern,
        "source": source,
    }
    metadata["default_words"] = default_words
    return dataclasses.field(default=default, metadata=metadata)


def text(
    meaning: str, pattern: str, allowed: str, default: Any = REQUIRED, default_words: str = ""
) -> Any:
    """Declare a text that has to match the regular expression `pattern`, `allowed` in words."""
    metadata = {"meaning": meaning, "pattern": pattern, "allowed": allowed}
    metadata["default_words"] = default_words
    return dataclasses.field(default=default, metadata=metadata)


def free(
    meaning: str, allowed: str, key: str, *, default: Any = REQUIRED, default_words: str = ""
) -> Any:
    """Declare what a section reads in its own way, under keys for which `key` stands."""
    metadata = {"meaning": meaning, "allowed": allowed, "key": key, "default_words": default_words}
    return dataclasses.field(default=default, metadata=metadata)


@dataclass_transform(
    frozen_default=True, field_specifiers=(number, choice, text, free, dataclasses.field)
)
def section(cls: type[S]) -> type[S]:
    """Make a frozen dataclass whose fields are declared by `number`, `choice` and `text`."""
    return dataclass(frozen=True)(cls)


@section
class Section:
    """A table of settings whose values are checked whenever one is made."""

    root: ClassVar[bool] = False

    def __post_init__(self) -> None:
        """Replace every value by its checked form (an integer becomes a float, a list a tuple)."""
        for name, kind in self.kinds().items():
            if not _is_section(kind):
                value = checked(self.dotted(name), getattr(self, name), kind, self.rule(name))
                object.__setattr__(self, name, value)

    @classmethod
    def dotted(cls, name: str) -> str:
        """Return the key as the user knows it, ``section.name``."""
        return name if cls.root else f"{cls.__name__.lower()}.{name}"

    @classmethod
    def rule(cls, name: str) -> Mapping[str, Any]:
        """Return the metadata of one setting: unit, range or choices, and source."""
        return next(item.metadata for item in dataclasses.fields(cls) if item.name == name)

    @classmethod
    def from_table(cls, table: object) -> Self:
        """Make the section from a table as read from a file.

        Raises
        ------
        ScenarioError
            On an unknown or missing key and on a value of wrong type or out of range.
        """
        if not isinstance(table, Mapping):
            raise ScenarioError(cls.__name__.lower(), "must be a table of settings", table)
        settings = cls.with_defaults(table)
        kinds = cls.kinds()
        for name in settings:
            if name not in kinds:
                raise unknown(cls.dotted(name), name, [*kinds, *cls._inner_keys()], "setting")
        return cls(
            **{name: cls._taken(settings, name) for name in kinds if cls._given(settings, name)}
        )

    @classmethod
    def with_defaults(cls, table: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return `table` with defaults that depend on other settings; nothing to add here."""
        return table

    def to_table(self) -> dict[str, Any]:
        """Return the section as plain tables, lists, numbers and text; inverse of `from_table`."""
        return {name: _plain(getattr(self, name)) for name in self.kinds()}

    @classmethod
    def kinds(cls) -> dict[str, Any]:
        """Return the type of every setting by name."""
        hints = get_type_hints(cls)
        return {field.name: hints[field.name] for field in dataclasses.fields(cls)}

    @classmethod
    def _inner_keys(cls) -> list[str]:
        """Return the dotted keys of the sections inside this one."""
        sections = [kind for kind in cls.kinds().values() if _is_section(kind)]
        return [kind.dotted(name) for kind in sections for name in kind.kinds()]

    @classmethod
    def _given(cls, settings: Mapping[str, Any], name: str) -> bool:
        """Tell whether a value is to be passed on; raise if it is required and missing."""
        kind = cls.kinds()[name]
        if name in settings or _is_section(kind):
            return True
        if cls.__dataclass_fields__[name].default is MISSING:
            needed = allowed_values(kind, cls.rule(name))
            raise ScenarioError(cls.dotted(name), f"is missing, {needed} is required")
        return False

    @classmethod
    def _taken(cls, settings: Mapping[str, Any], name: str) -> Any:
        """Return one value of a table, or the section made from a table in the table."""
        kind = cls.kinds()[name]
        return kind.from_table(settings.get(name, {})) if _is_section(kind) else settings[name]


def unknown(key: str, name: str, known: Sequence[str], what: str) -> ScenarioError:
    """Return the error for a name that nobody knows, with the nearest known one or the first."""
    nearest = difflib.get_close_matches(name, known, n=1)
    known_names = ", ".join(known[:SHOWN_NAMES]) + (", ..." if len(known) > SHOWN_NAMES else "")
    hint = f"did you mean {nearest[0]}?" if nearest else f"known are {known_names}"
    return ScenarioError(key, f"unknown {what}, {hint}")


def checked(key: str, value: object, kind: Any, rule: Mapping[str, Any]) -> Any:
    """Return `value` as `kind` if the rule of its setting allows it.

    Raises
    ------
    ScenarioError
        Naming key, value and what is allowed.
    """
    try:
        if get_origin(kind) is tuple:
            return _as_vector(value, kind, rule)
        return _SCALARS[kind](value, rule)
    except (TypeError, ValueError):
        raise ScenarioError(key, f"must be {allowed_values(kind, rule)}", value) from None


def allowed_values(kind: Any, rule: Mapping[str, Any]) -> str:
    """Describe in words the values that a setting can take."""
    if "choices" in rule:
        return "one of " + ", ".join(rule["choices"])
    if kind is str:
        return str(rule["allowed"])
    low, high = rule["range"]
    limits = f"from {low:g} to {high:g} {rule['unit']}".rstrip()
    if get_origin(kind) is tuple:
        return f"{len(get_args(kind))} numbers, each {limits}"
    return f"a {'whole ' if kind is int else ''}number {limits}"


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


def _is_section(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Section)


def _plain(value: Any) -> Any:
    if isinstance(value, Section):
        return value.to_table()
    return list(value) if isinstance(value, tuple) else value
