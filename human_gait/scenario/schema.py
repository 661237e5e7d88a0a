"""Settings declared once: meaning, type, unit, allowed range and source stand with the field.

A section of a scenario is a frozen dataclass derived from `Section`. A new setting is one
declaration in it; the check of its values, the loader, the error messages, the way back to a table,
the lists of settings and the schema for editors follow from it.
"""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from contextlib import contextmanager
from copy import copy
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

HUMAN = "human"
"""The formulation that scenarios have by default."""

SHOWN_NAMES = 10  # the sections of a scenario, or the settings of any one section
_LONGEST_REPR = 100
_MOST_UNKNOWN = 50  # of one table: more are no slips, and to look up each takes time


@dataclass_transform(
    frozen_default=True, field_specifiers=(number, choice, text, free, dataclasses.field)
)
def section(cls: type[S]) -> type[S]:
    """Make a frozen dataclass whose fields are declared by `number`, `choice` and `text`."""
    return dataclass(frozen=True, repr=False)(cls)


@dataclass(frozen=True)
class About:
    """What the defaults of a section follow from in the others of a scenario.

    Attributes
    ----------
    formulation : str
    speed : float, [m/s]
        Of walking.
    stature : float, [m]
    """

    formulation: str = HUMAN
    speed: float = 1.2
    stature: float = 1.755


ALONE = About()
"""Of a section that is part of no scenario yet."""

_FIRST = About(formulation="effort")


@section
class Section:
    """A table of settings whose values are checked whenever one is made."""

    root: ClassVar[bool] = False
    leads: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Settings that others follow from, and give way to where they are changed."""
    _given: ClassVar[frozenset[str]] = frozenset()  # of each instance its own

    def __new__(cls, *args: object, **named: object) -> Self:
        """Remember which settings are given: what is left out follows from the rest."""
        new = object.__new__(cls)
        given = [*list(cls.kinds())[: len(args)], *(n for n in named if named[n] is not None)]
        object.__setattr__(new, "_given", frozenset(given))
        return new

    def __post_init__(self) -> None:
        """Replace every value by its checked form (an integer becomes a float, a list a tuple)."""
        given: dict[str, Any] = {}
        errors: list[ScenarioError] = []
        for name in self.kinds():
            if name in self._given:
                with gathered(errors):
                    given[name] = self._checked(name, getattr(self, name))
        values = self._whole(given, self.kinds().keys() - self._given, errors)
        refuse([*errors, *self.conflicts(values)])
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def completed(self, about: About) -> Self:
        """Return the section with what was left out as it follows from the rest of a scenario.

        Raises
        ------
        ScenarioError
            If that does not fit to what was given.
        """
        given = {name: getattr(self, name) for name in self.kinds() if name in self._given}
        values = {**self.defaults(given, about), **given}
        refuse([*self.conflicts(values)])
        if all(getattr(self, name) == value for name, value in values.items()):
            return self
        whole = copy(self)
        for name, value in values.items():
            object.__setattr__(whole, name, value)
        return whole

    @classmethod
    def _whole(
        cls, given: Mapping[str, Any], left_out: Set[str], _errors: list[ScenarioError]
    ) -> dict[str, Any]:
        """Return the values that are given and right, and those of the settings left out."""
        defaults = cls.defaults(given, ALONE)
        return {**{name: defaults[name] for name in left_out if name in defaults}, **given}

    @classmethod
    def defaults(cls, _given: Mapping[str, Any], about: About) -> dict[str, Any]:
        """Return the settings that can be left out, as they then are.

        Parameters
        ----------
        _given : mapping of str to value
            The settings that are not.
        about : About
            What they follow from in other sections.
        """
        defaults = {name: default_of(cls, name, about.formulation) for name in cls.kinds()}
        return {name: value for name, value in defaults.items() if value is not MISSING}

    def __repr__(self) -> str:
        """Return the section as it can be made again, without what is as by default."""
        shown = [f"{name}={getattr(self, name)!r}" for name in self.kinds() if self._shown(name)]
        line = f"{type(self).__name__}({', '.join(shown)})"
        if not self.root or len(line) <= _LONGEST_REPR:
            return line
        return "\n    ".join([f"{type(self).__name__}(", *(f"{each}," for each in shown)]) + "\n)"

    def _shown(self, name: str) -> bool:
        value, usual = getattr(self, name), default_of(type(self), name)
        own = usual is MISSING or value != usual or bool(self.rule(name).get("others"))
        own = own or value != self.usual(name, ALONE)
        return name in self._given and own

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
        given: dict[str, Any] = {}
        for name in cls.kinds():
            if name in table:
                with gathered(errors):
                    given[name] = cls._checked(name, table[name])
        left_out = {name for name in cls.kinds() if name not in table}
        values = cls._whole(given, left_out, errors)
        for name in cls.kinds():
            needed = name not in values and default_of(cls, name) is MISSING
            if needed and name in left_out - meant:
                with gathered(errors):
                    cls._missing(name)
        refuse([*errors, *cls.conflicts(values)] if errors else [])
        required = {name: values[name] for name in values if default_of(cls, name) is MISSING}
        return cls(**{**required, **given})

    def usual(self, name: str, about: About) -> object:
        """Return what a setting would be if it were left out and the others were given."""
        others = {key: getattr(self, key) for key in self.kinds() if key != name}
        return self.defaults(others, about).get(name, MISSING)

    def follows(self, name: str, about: About) -> bool:
        """Tell whether a setting would be the same if it were left out."""
        return bool(self.usual(name, about) == getattr(self, name))

    @classmethod
    def conflicts(cls, _values: Mapping[str, Any]) -> Iterable[ScenarioError]:
        """Return what does not fit together among the values that are right by themselves."""
        return ()

    def to_table(self) -> dict[str, Any]:
        """Return the section as plain tables, lists, numbers and text; inverse of `from_table`."""
        return {name: _plain(getattr(self, name)) for name in self.kinds()}

    def own_table(self) -> dict[str, Any]:
        """Return what is not as in the first versions: the same for a scenario in all to come."""
        table = self.to_table()
        for name, kind in self.kinds().items():
            value, default = getattr(self, name), default_of(type(self), name, _FIRST.formulation)
            if _is_section(kind) and default is not MISSING:
                default = kind.first(default)
            if default is not MISSING and value == default:
                table.pop(name, None)
            elif isinstance(value, Section):
                table[name] = value.own_table()
        return table

    @classmethod
    def first(cls, default: Self) -> Self:
        """Return a section by default as it was in the first versions."""
        return default.completed(_FIRST)

    def place(self, name: str) -> object:
        """Return a setting as it counts where scenarios are compared: as it is."""
        return getattr(self, name)

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
    def _missing(cls, name: str) -> None:
        """Raise the error for a setting that has to be given; of a section for those inside."""
        kind = cls.kinds()[name]
        if _is_section(kind):
            kind.from_table({})
        needed = allowed_values(kind, cls.rule(name))
        raise ScenarioError(cls.dotted(name), f"is missing, {needed} is required")

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


def default_of(cls: type[Section], name: str, formulation: str = HUMAN) -> Any:
    """Return the default of a setting in one of the formulations, MISSING if it has none."""
    field = cls.__dataclass_fields__[name]
    others = field.metadata.get("others", {})
    if formulation in others:
        return others[formulation]
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
