"""All settings of a scenario as records, from their declarations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import MISSING, dataclass
from typing import Any, get_args, get_origin

from human_gait.scenario import Scenario
from human_gait.scenario.schema import Section, default_of
from human_gait.scenario.values import allowed_values


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
    pattern : str
        Regular expression that a text has to match.
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
    pattern: str = ""

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
    sections = Scenario.sections()
    for name in Scenario.kinds():
        if name in sections:
            yield from (_record(sections[name], name, key) for key in sections[name].kinds())
        else:
            yield _record(Scenario, "", name)


def _record(owner: type[Section], section: str, key: str) -> Setting:
    kind, rule, default = owner.kinds()[key], owner.rule(key), default_of(owner, key)
    low, high = rule.get("range", (None, None))
    given = None if default is MISSING else default
    return Setting(
        section,
        rule.get("key", key),
        rule["meaning"],
        allowed_values(kind, rule),
        given,
        rule.get("default_words") or ("required" if given is None else as_text(given)),
        rule.get("unit", ""),
        low,
        high,
        rule.get("choices", ()),
        rule.get("source", ""),
        len(get_args(kind)) if get_origin(kind) is tuple and "range" in rule else 1,
        kind is int,
        rule.get("pattern", ""),
    )


def as_text(value: Any) -> str:
    """Return a value as it stands in a TOML file."""
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(as_text, value)) + "]"
    return f'"{value}"' if isinstance(value, str) else repr(value)
