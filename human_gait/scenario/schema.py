"""Settings declared once: meaning, type, unit, allowed range and source stand with the field.

A section of a scenario is a frozen dataclass derived from `Section`. A new setting is one
declaration in it; the check of its values, the loader, the error messages, the way back to a table,
the lists of settings and the schema for editors follow from it.
"""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, dataclass
from functools import cache
from typing import (
    Any,
    ClassVar,
    Self,
    TypeVar,
    dataclass_transform,
    get_type_hints,
)

from human_gait.exceptions import ScenarioError
from human_gait.scenario.declarations import choice, free, number, text
from human_gait.scenario.values import allowed_values, checked

S = TypeVar("S")

SHOWN_NAMES = 10  # the sections of a scenario, or the settings of any one section
_LONGEST_REPR = 100
_MOST_UNKNOWN = 50  # of one table: more are no slips, and to look up each takes time


@dataclass_transform(
    frozen_default=True, field_specifiers=(number, choice, text, free, dataclasses.field)
)
def section(cls: type[S]) -> type[S]:
    """Make a frozen dataclass whose fields are declared by `number`, `choice` and `text`."""
    return dataclass(frozen=True, repr=False)(cls)


@section
class Section:
    """A table of settings whose values are checked whenever one is made."""

    root: ClassVar[bool] = False

    def __post_init__(self) -> None:
        """Replace every value by its checked form (an integer becomes a float, a list a tuple)."""
        values: dict[str, Any] = {}
        errors: list[ScenarioError] = []
        for name in self.kinds():
            with gathered(errors):
                values[name] = self._checked(name, getattr(self, name))
        refuse([*errors, *self.conflicts(values)])
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        """Return the section as it can be made again, without what is as by default."""
        shown = [f"{name}={getattr(self, name)!r}" for name in self.kinds() if self._differs(name)]
        line = f"{type(self).__name__}({', '.join(shown)})"
        if not self.root or len(line) <= _LONGEST_REPR:
            return line
        return "\n    ".join([f"{type(self).__name__}(", *(f"{each}," for each in shown)]) + "\n)"

    def _differs(self, name: str) -> bool:
        default = default_of(type(self), name)
        return default is MISSING or getattr(self, name) != default

    @classmethod
    def dotted(cls, name: str) -> str:
        """Return the key as the user knows it, ``section.name``."""
        return name if cls.root else f"{cls.__name__.lower()}.{name}"

    @classmethod
    def rule(cls, name: str) -> Mapping[str, Any]:
        """Return the metadata of one setting: meaning, unit, range or choices, and source."""
        return next(item.metadata for item in dataclasses.fields(cls) if item.name == name)

    @classmethod
    def from_table(cls, table: object) -> Self:
        """Make the section from a table as read from a file.

        Raises
        ------
        ScenarioError
            On unknown and missing keys and on values of wrong type or out of range: all of them.
        """
        if not isinstance(table, Mapping):
            raise ScenarioError(cls.__name__.lower(), "must be a table of settings", table)
        errors, meant = cls._unknown_keys(table)
        values: dict[str, Any] = {}
        settings = cls.with_defaults(table)
        for name in cls.kinds():
            if name in table or name not in meant:
                with gathered(errors):
                    values[name] = cls._taken(settings, name)
        refuse([*errors, *cls.conflicts(values)])
        return cls(**values)

    @classmethod
    def with_defaults(cls, table: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return `table` with defaults that depend on other settings; nothing to add here."""
        return table

    @classmethod
    def conflicts(cls, _values: Mapping[str, Any]) -> Iterable[ScenarioError]:
        """Return what does not fit together among the values that are right by themselves."""
        return ()

    def to_table(self) -> dict[str, Any]:
        """Return the section as plain tables, lists, numbers and text; inverse of `from_table`."""
        return {name: _plain(getattr(self, name)) for name in self.kinds()}

    def own_table(self) -> dict[str, Any]:
        """Return what is not as by default: the same for a scenario in all versions to come."""
        table = self.to_table()
        for name in self.kinds():
            value = getattr(self, name)
            if not self._differs(name):
                table.pop(name, None)
            elif isinstance(value, Section):
                table[name] = value.own_table()
        return table

    @classmethod
    def kinds(cls) -> dict[str, Any]:
        """Return the type of every setting by name."""
        owner: Any = cls  # mypy takes the hash of the instances for that of the class
        return _kinds(owner)

    @classmethod
    def sections(cls) -> dict[str, type[Section]]:
        """Return the sections inside this one by name."""
        return {name: kind for name, kind in cls.kinds().items() if _is_section(kind)}

    @classmethod
    def inner_keys(cls) -> list[str]:
        """Return the dotted keys of the sections inside this one, as far as they are fixed."""
        return [
            kind.dotted(name)
            for kind in cls.sections().values()
            for name in kind.kinds()
            if kind.rule(name).get("key", name) == name
        ]

    @classmethod
    def _unknown_keys(cls, table: Mapping[str, Any]) -> tuple[list[ScenarioError], set[str]]:
        """Return the errors for keys that nobody knows, and what they were probably meant to be."""
        kinds = cls.kinds()
        known = [*kinds, *cls.inner_keys()]
        names = [str(name) for name in table if name not in kinds][:_MOST_UNKNOWN]
        errors = [unknown(cls.dotted(name), name, known, "setting") for name in names]
        return errors, {key for name in names for key in nearest(name, known)}

    @classmethod
    def _taken(cls, settings: Mapping[str, Any], name: str) -> Any:
        """Return the checked value of one setting, given or by default."""
        if name in settings:
            return cls._checked(name, settings[name])
        kind, default = cls.kinds()[name], default_of(cls, name)
        if _is_section(kind):
            return kind.from_table({})
        if default is MISSING:
            needed = allowed_values(kind, cls.rule(name))
            raise ScenarioError(cls.dotted(name), f"is missing, {needed} is required")
        return default

    @classmethod
    def _checked(cls, name: str, value: object) -> Any:
        """Return one value as its type wants it; a plain table becomes a section."""
        kind = cls.kinds()[name]
        if _is_section(kind):
            return value if isinstance(value, kind) else kind.from_table(value)
        return checked(cls.dotted(name), value, kind, cls.rule(name))


@cache
def _kinds(cls: Any) -> dict[str, Any]:
    hints = get_type_hints(cls)
    return {field.name: hints[field.name] for field in dataclasses.fields(cls)}


def default_of(cls: type[Section], name: str) -> Any:
    """Return the default of a setting, MISSING if it has none."""
    field = cls.__dataclass_fields__[name]
    return field.default if field.default_factory is MISSING else field.default_factory()


@contextmanager
def gathered(errors: list[ScenarioError]) -> Iterator[None]:
    """Add to `errors` what is refused inside, and go on."""
    try:
        yield
    except ScenarioError as error:
        errors.extend(error.errors)


def refuse(errors: Sequence[ScenarioError]) -> None:
    """Raise all the errors as one, if there are any."""
    if errors:
        raise ScenarioError.of(errors)


def nearest(name: str, known: Sequence[str]) -> list[str]:
    """Return the known name that looks most like `name`, if any does."""
    return difflib.get_close_matches(name, known, n=1)


def unknown(key: str, name: str, known: Sequence[str], what: str) -> ScenarioError:
    """Return the error for a name that nobody knows, with the nearest known one or the first."""
    near = nearest(name, known)
    known_names = ", ".join(known[:SHOWN_NAMES]) + (", ..." if len(known) > SHOWN_NAMES else "")
    hint = f"did you mean {near[0]}?" if near else f"known are {known_names}"
    return ScenarioError(key, f"unknown {what}, {hint}")


def _is_section(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Section)


def _plain(value: Any) -> Any:
    if isinstance(value, Section):
        return value.to_table()
    return list(value) if isinstance(value, tuple) else value
