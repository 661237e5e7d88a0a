"""Limits that a user gives: ``knee_extension_peak < 1.0``, in the unit of the column."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from human_gait.arrays import BoolArray, FloatArray
from human_gait.exceptions import GaitError, shown

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_LIMIT = re.compile(rf"\s*([A-Za-z]\w*)\s*(<=|>=|<|>)\s*({_NUMBER})\s*", re.ASCII)
_LARGEST = 1e300
_SIGNS = {"<": np.less, "<=": np.less_equal, ">": np.greater, ">=": np.greater_equal}


@dataclass(frozen=True)
class Limit:
    """What a number of each walk is to keep.

    Attributes
    ----------
    name : str
        Of a column of the index.
    sign : str
        ``<``, ``<=``, ``>`` or ``>=``.
    bound : float
        In the unit of the column.
    """

    name: str
    sign: str
    bound: float

    def __str__(self) -> str:
        return f"{self.name} {self.sign} {self.bound:g}"

    def exceeded(self, values: FloatArray) -> BoolArray:
        """Return which of some numbers do not keep it; of NaN nothing is known, False."""
        kept = _SIGNS[self.sign](values, self.bound)
        return np.asarray(~kept & np.isfinite(values))


def parse_limits(given: Iterable[str], known: Sequence[str]) -> tuple[Limit, ...]:
    """Return limits that were given as texts.

    Parameters
    ----------
    given : iterable of str
        Such as ``"knee_extension_peak < 1.0"``.
    known : sequence of str
        Columns with numbers that a limit can be about.

    Raises
    ------
    GaitError
        If one is no limit, or is about a column that is not there.
    """
    return tuple(_parsed(text, known) for text in given)


def _parsed(text: str, known: Sequence[str]) -> Limit:
    match = _LIMIT.fullmatch(text)
    if not match:
        raise GaitError(
            f"limit {shown(text)}: must be NAME < NUMBER (or <=, >, >=), "
            "such as 'knee_extension_peak < 1.0'"
        )
    name, sign, bound = match[1], match[2], float(match[3])
    if name not in known:
        raise GaitError(f"limit {shown(text)}: no number is called {name}, {_hint(name, known)}")
    if not abs(bound) < _LARGEST:
        raise GaitError(f"limit {shown(text)}: the number must be finite")
    return Limit(name, sign, bound)


def _hint(name: str, known: Sequence[str]) -> str:
    """Return what may have been meant, else all that is known."""
    near = difflib.get_close_matches(name, known, n=3)
    near += [one for one in known if name.casefold() in one.casefold() and one not in near]
    if near:
        return f"did you mean {' or '.join(near[:4])}?"
    return f"there are {', '.join(known)}" if known else "the study has none"
