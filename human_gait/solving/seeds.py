"""The seed of the random starts: a number that is looked at before minutes of solving."""

from __future__ import annotations

from numbers import Integral

LARGEST_SEED = 2**32 - 1
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
    given: object = seed
    if isinstance(given, bool) or not isinstance(given, Integral):
        raise TypeError(f"a seed is a whole number, not a {type(seed).__name__}")
    if not 0 <= seed <= LARGEST_SEED:
        shown = str(seed) if abs(seed) < _SHOWN else "a seed"
        raise ValueError(f"{shown} must be from 0 to {LARGEST_SEED}")
    return int(seed)
