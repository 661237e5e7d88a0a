"""What a setting says of itself where it is declared."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

REQUIRED: Any = dataclasses.MISSING


def number(  # noqa: PLR0913, what a setting says of itself
    meaning: str,
    unit: str,
    low: float,
    high: float,
    *,
    default: Any = REQUIRED,
    effort: Any = None,
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
    effort : float or tuple, optional
        The default of the formulations ``effort`` and ``paper``, where it is another.
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
        "default_words": default_words or _words(default, effort, effort),
        "others": _others(effort, effort),
    }
    return dataclasses.field(default=default, metadata=metadata)


def choice(
    meaning: str,
    *choices: str,
    default: Any = REQUIRED,
    effort: str | None = None,
    paper: str | None = None,
    default_words: str = "",
    source: str = "",
) -> Any:
    """Declare a text setting that has to be one of `choices`.

    `effort` and `paper` are the defaults of the formulations of these names, where they are others.
    """
    pattern = "|".join(map(re.escape, choices))
    metadata: dict[str, Any] = {
        "meaning": meaning,
        "choices": choices,
        "pattern": pattern,
        "source": source,
        "default_words": default_words or _words(default, effort, paper or effort),
        "others": _others(effort, paper or effort),
    }
    return dataclasses.field(default=default, metadata=metadata)


def _others(effort: Any, paper: Any) -> dict[str, Any]:
    """Return the defaults of the formulations that are not the usual one, where they differ."""
    return {
        name: value for name, value in (("effort", effort), ("paper", paper)) if value is not None
    }


def _words(default: Any, effort: Any, paper: Any) -> str:
    """Return a default that depends on the formulation in words; nothing for any other."""
    if default is REQUIRED or (effort is None and paper is None):
        return ""
    told = [_value(default)]
    told += [f"{_value(effort)} for effort"] if effort is not None else []
    told += [f"{_value(paper)} for paper"] if paper != effort else []
    return ", ".join(told)


def _value(value: Any) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    return f'"{value}"' if isinstance(value, str) else repr(value)


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
