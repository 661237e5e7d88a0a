"""All settings of a scenario as records, from their declarations."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import MISSING, dataclass
from typing import Any, get_args, get_origin

from human_gait.scenario import Scenario
from human_gait.schema import Section, allowed_values


@dataclass(frozen=True)
class Setting:
    """One setting, as it was declared.

    Parameters
    ----------
    section : str
        Table of the file that holds it, empty at the top of the file.
    key : str
        Name in that table; ``<joint>`` stands for the name of any DOF.
    meaning : str
        What it does, in one line.
    allowed : str
        The values that it can take, in words.
    default : float, int, str, tuple or None
        Value when it is left out; None if it then follows from others, see `default_words`.
    default_words : str
        The default as text: ``required``, or what it follows from.
    unit : str
        Unit, empty for text and pure numbers.
    low, high : float or None
        Range of a number, or of each number of a vector; None for text.
    choices : tuple of str
        The texts to choose from, empty where any other value is meant.
    source : str
        Where default or range come from; may be empty.
    count : int
        How many numbers: 1, or 3 for a vector.
    whole : bool
        Whether only whole numbers are allowed.
    """

    section: str
    key: str
    meaning: str
    allowed: str
    default: Any
    default_words: str
    unit: str = ""
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()
    source: str = ""
    count: int = 1
    whole: bool = False

    @property
    def dotted(self) -> str:
        """The key as it stands in messages, ``section.key``."""
        return f"{self.section}.{self.key}" if self.section else self.key

    @property
    def required(self) -> bool:
        """Whether a scenario has to give it."""
        return self.default_words == "required"


def all_settings() -> Iterator[Setting]:
    """Yield every setting, in the order of the sections."""
    for name, kind in Scenario.kinds().items():
        if isinstance(kind, type) and issubclass(kind, Section):
            yield from (_record(kind, name, key) for key in kind.kinds())
        else:
            yield _record(Scenario, "", name)


def sections() -> dict[str, type[Section]]:
    """Return the class of every section by its name."""
    kinds = Scenario.kinds().items()
    return {name: kind for name, kind in kinds if issubclass(kind, Section)}


def _record(owner: type[Section], section: str, key: str) -> Setting:
    kind, rule = owner.kinds()[key], owner.rule(key)
    low, high = rule.get("range", (None, None))
    default = _default(owner, key)
    return Setting(
        section,
        rule.get("key", key),
        rule["meaning"],
        rule.get("allowed") or allowed_values(kind, rule),
        default,
        rule.get("default_words") or ("required" if default is None else as_text(default)),
        rule.get("unit", ""),
        low,
        high,
        rule.get("choices", ()),
        rule.get("source", ""),
        len(get_args(kind)) if get_origin(kind) is tuple and "range" in rule else 1,
        kind is int,
    )


def _default(owner: type[Section], key: str) -> Any:
    found = next(field.default for field in dataclasses.fields(owner) if field.name == key)
    return None if found is MISSING else found


def as_text(value: Any) -> str:
    """Return a value as it stands in a TOML file."""
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(as_text, value)) + "]"
    return f'"{value}"' if isinstance(value, str) else repr(value)
