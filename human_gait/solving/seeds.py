"""The seed of the random starts, and how many starts: looked at before minutes of solving."""

from __future__ import annotations

from numbers import Integral

LARGEST_SEED = 2**32 - 1
MOST_STARTS = 100
_SHOWN = 10**20


def checked_seed(seed: int) -> int:
    """Return a seed.

    Raises
    ------
    ValueError
        If it is not from 0 to `LARGEST_SEED`.
    TypeError
        If it is no whole number.
    """
    return _within(seed, "a seed", 0, LARGEST_SEED)


def checked_starts(starts: int) -> int:
    """Return a number of starts.

    Raises
    ------
    ValueError
        If it is not from 1 to `MOST_STARTS`.
    TypeError
        If it is no whole number.
    """
    return _within(starts, "a number of starts", 1, MOST_STARTS)


def _within(number: int, what: str, least: int, most: int) -> int:
    given: object = number
    if isinstance(given, bool) or not isinstance(given, Integral):
        raise TypeError(f"{what} is a whole number, not a {type(given).__name__}")
    if not least <= number <= most:
        shown = f" is {number}," if abs(number) < _SHOWN else ""
        raise ValueError(f"{what}{shown} must be from {least} to {most}")
    return int(number)
