"""What a setting says of itself where it is declared."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

REQUIRED: Any = dataclasses.MISSING


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
