"""Cells and tables of a report, and what several of its tables have in common."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from human_gait.reporting.results import Result
from human_gait.walk.gait_cycle import label_and_unit

_MINUS = "\N{MINUS SIGN}"


@dataclass(frozen=True)
class Cell:
    """A cell of a table.

    Attributes
    ----------
    text : str
        As it is shown.
    value : float or None
        The number itself, with all its digits; None for words.
    mark : str
        ``good``, ``bad`` or ``differs``: how it is set off.
    """

    text: str
    value: float | None = None
    mark: str = ""


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes
    ----------
    columns : tuple of str
    rows : tuple of tuple of Cell
    groups : tuple of (str, int)
        What stands above the columns, and above how many; may be empty.
    names : int
        Cells, from the first, that say together what a row is about.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    groups: tuple[tuple[str, int], ...] = ()
    names: int = 1

    @property
    def starts(self) -> frozenset[int]:
        """Return the columns, from 0, that a group begins with."""
        spans = [0, *(span for _, span in self.groups)]
        return frozenset(sum(spans[: k + 1]) for k in range(1, len(spans) - 1))


def number(value: float, form: str = ".3g", mark: str = "") -> Cell:
    """Return a cell with a number."""
    if math.isnan(value):
        return Cell("\N{EN DASH}", mark=mark)
    return Cell(format(value, form).replace("-", _MINUS), float(value), mark)


Row = tuple[str, Callable[[Result], Cell]]
"""What a row is about, and the cell of a result in it."""


def by_result(heading: str, results: Sequence[Result], rows: Sequence[Row]) -> Table:
    """Return a table with a column for each result."""
    cells = tuple((Cell(name), *(cell(one) for one in results)) for name, cell in rows)
    return Table((heading, *(one.label for one in results)), cells)


def groups(own: int, results: Sequence[Result], span: int) -> tuple[tuple[str, int], ...]:
    """Return headings of the columns of each result, after some columns of the table's own."""
    if len(results) == 1:
        return ()
    return ("", own), *((one.label, span) for one in results)


def curve_cells(column: str, *before: Cell) -> tuple[Cell, ...]:
    """Return cells that name a curve and its unit."""
    label, unit = label_and_unit(column)
    return (*before, Cell(label), Cell(unit.replace(" ", "\N{NO-BREAK SPACE}")))


def form_of(column: str, digits: int = 2) -> str:
    """Return how numbers of a curve are written: degrees with one digit after the point."""
    return ".1f" if column.endswith("_deg") else f".{digits}f"
