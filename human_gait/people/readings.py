"""What the columns of own trials were taken for, in lines for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path

from human_gait.people.own import Own
from human_gait.trials.names import Reading

_MOST = 8
"""Columns that are left out for one reason and named; of more the number is told."""


def readings_text(own: Own) -> str:
    """Return a line for each column that was read, and for those that were left out or kept."""
    sources = list(dict.fromkeys(reading.source for reading in own.readings))
    lines = ["Own trials: what was read as what"]
    for source, readings in groupby(
        sorted(own.readings, key=lambda one: sources.index(one.source)),
        key=lambda one: one.source,
    ):
        lines += [f"{Path(source).name}", *(f"  {line}" for line in _lines(list(readings)))]
    return "\n".join([*lines, *own.notes, ""])


def _lines(readings: Iterable[Reading]) -> Iterator[str]:
    kept, left = list[str](), dict[str, list[str]]()
    for reading in readings:
        if not reading.curve:
            left.setdefault(reading.why, []).append(reading.column)
        elif (reading.column, reading.sign) == (reading.curve, 1.0):
            kept.append(reading.column)
        else:
            sign = "-" if reading.sign < 0 else "+"
            yield f"{reading.column} -> {reading.curve}, sign {sign}: {reading.why}"
    if kept:
        yield f"as they are: {', '.join(kept)}"
    for why, columns in left.items():
        more = f" and {len(columns) - _MOST} more" if columns[_MOST:] else ""
        yield f"left out: {', '.join(columns[:_MOST])}{more}: {why}"
