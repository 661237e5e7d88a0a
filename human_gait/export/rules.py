"""What the formats cannot hold, refused by the name of the file before it is written."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import ResultError


def check_names(file: str, names: Iterable[str], forbidden: str, longest: int = 255) -> None:
    """Refuse names that are empty, twice, too long, not ASCII, or have a forbidden character.

    Parameters
    ----------
    file : str
        Its name, for the message.
    names : iterable of str
    forbidden : str
        Characters, as in the brackets of a regular expression.
    longest : int
        How many characters a name may have.

    Raises
    ------
    ResultError
    """
    seen = set[str]()
    for name in names:
        if (
            not name
            or len(name) > longest
            or not name.isascii()
            or re.search(f"[{forbidden}]", name)
        ):
            rule = f"must be 1 to {longest} ASCII characters, none of {forbidden!r}"
            raise ResultError(f"{file}: the name {name!r} {rule}")
        if name in seen:
            raise ResultError(f"{file}: the name {name!r} is there twice")
        seen.add(name)


def check_numbers(file: str, columns: Mapping[str, FloatArray], largest: float = np.inf) -> None:
    """Refuse values that are no numbers, or larger than a format can hold.

    Parameters
    ----------
    file : str
        Its name, for the message.
    columns : mapping of str to (K, ...) array
    largest : float

    Raises
    ------
    ResultError
    """
    for name, values in columns.items():
        bad = ~(np.abs(values) <= largest) | ~np.isfinite(values)
        if bad.any():
            row = int(np.argwhere(bad)[0, 0])
            value = float(np.asarray(values)[bad].flat[0])
            rule = "a number" if np.isinf(largest) else f"a number up to {largest:g}"
            raise ResultError(f"{file}: {name} = {value} in row {row + 1}: must be {rule}")


def check_times(file: str, written: Iterable[str]) -> None:
    """Refuse times that do not grow from row to row, as they stand in the file.

    Raises
    ------
    ResultError
    """
    times = np.array([float(time) for time in written])
    if not (np.diff(times) > 0.0).all():
        row = int(np.argmin(np.diff(times) > 0.0)) + 2
        raise ResultError(f"{file}: time = {times[row - 1]} in row {row}: must be after the last")


def check_count(file: str, what: str, number: int, most: int, advice: str = "") -> None:
    """Refuse more of something than a format can count.

    Raises
    ------
    ResultError
    """
    if number > most:
        hint = f"; {advice}" if advice else ""
        raise ResultError(f"{file}: {number} {what}: the format holds {most}{hint}")
