"""Text files of laboratories: lines whatever wrote them, and rows of numbers told by line."""

from __future__ import annotations

import codecs
from array import array
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import TrialError, shown
from human_gait.results.reading import read_regular

LARGEST = 2**31
"""Bytes of a file that is read."""

Split = Callable[[str], list[str]]
Lines = Iterable[tuple[int, str]]

_MISSING = {"", "-", "--", "na", "n/a", "null", "none", "-nan", "1.#qnan", "-1.#ind", "-nan(ind)"}
_BYTE_ORDER = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"))
_MARKS = (*_BYTE_ORDER, (codecs.BOM_UTF16_BE, "utf-16"))


def lines_of(path: Path) -> list[str]:
    """Return the lines of a text file without their ends: UTF-8 or Latin-1, by whatever system.

    Raises
    ------
    TrialError
        If it cannot be read, is empty or is no text.
    """
    content = bytes_of(path)
    encoding = next((name for mark, name in _MARKS if content.startswith(mark)), "utf-8")
    if encoding != "utf-16" and b"\0" in content:
        raise TrialError(f"{path}: is no text: it has a byte 0 at {content.index(0)}")
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if not any(map(str.strip, lines)):
        raise TrialError(f"{path}: is empty")
    return lines


def bytes_of(path: Path) -> bytes:
    """Return the content of a file.

    Raises
    ------
    TrialError
        If it cannot be read or is too large.
    """
    try:
        content = read_regular(path, LARGEST)
    except OSError as error:
        raise TrialError(f"{path}: cannot be read: {error.strerror or error}") from None
    if len(content) > LARGEST:
        raise TrialError(f"{path}: is larger than {LARGEST} bytes")
    return content


def cells_of(line: str) -> list[str]:
    """Return the cells of a line that tabs part, or blanks where it has no tab."""
    return [cell.strip() for cell in line.split("\t")] if "\t" in line else line.split()


def numbers(path: Path, lines: Lines, names: Sequence[str], split: Split = cells_of) -> FloatArray:
    """Return the numbers (K, n) of lines with their numbers; what is missing is NaN.

    Cells that are empty behind the last column do not count, and a row that is shorter by cells
    that are empty, as spreadsheets and markers out of sight leave it, is filled.

    Raises
    ------
    TrialError
        Of a cell that is no number, a row of another length, or no row at all.
    """
    found, width, rows = array("d"), len(names), 0
    for number, line in lines:
        cells = split(line)
        if len(cells) != width:
            cells = _fitted(path, number, cells, names)
        try:
            found.extend(map(float, cells))
        except ValueError:
            del found[rows * width :]
            found.extend(_each(path, number, cells, names))
        rows += 1
    if not rows:
        raise TrialError(f"{path}: has no row of numbers")
    table = np.frombuffer(found, dtype=np.float64).reshape(rows, width)
    if np.isinf(table).any():
        row, column = np.argwhere(np.isinf(table))[0]
        raise TrialError(f"{path}: row {row + 1}, column {names[column]}: is infinite")
    return table


def numbered(lines: Sequence[str], first: int) -> Lines:
    """Yield the lines from one on with their numbers, without empty ones and comments."""
    for number, line in enumerate(lines[first:], start=first + 1):
        if line.strip() and not line.lstrip().startswith(("#", "//", "%")):
            yield number, line


def check_columns(path: Path, names: Sequence[str], number: int) -> None:
    """Raise TrialError if a column of a header, line `number`, has no name or that of another."""
    seen = set[str]()
    for k, name in enumerate(names, start=1):
        if not name:
            raise TrialError(f"{path}: line {number}: column {k} has no name")
        if name in seen:
            raise TrialError(f"{path}: line {number}: the column {shown(name)} is there twice")
        seen.add(name)


def increasing(path: Path, time: FloatArray, what: str = "time") -> FloatArray:
    """Return times (K,) that increase.

    Raises
    ------
    TrialError
        If one is missing or not after the last.
    """
    if not np.isfinite(time).all():
        raise TrialError(f"{path}: {what} in row {int(np.argmin(np.isfinite(time))) + 1}: missing")
    steps = np.diff(time)
    if len(steps) and not (steps > 0.0).all():
        row = int(np.argmin(steps > 0.0)) + 2
        message = f"{what} = {time[row - 1]:g} in row {row}"
        raise TrialError(f"{path}: {message}: must be after {time[row - 2]:g}, of the row before")
    return np.array(time)


def _fitted(path: Path, number: int, cells: list[str], names: Sequence[str]) -> list[str]:
    """Return the cells of a row that has more or less of them than columns, if that may be."""
    width = len(names)
    while len(cells) > width and not cells[-1]:
        cells = cells[:-1]
    if len(cells) < width and cells and not cells[-1]:  # it ends in a cell that is empty
        cells = [*cells, *[""] * (width - len(cells))]
    if len(cells) != width:
        blanks = " ".join(cells).split()
        if len(blanks) == width:  # parted by tabs and blanks
            return blanks
        message = f"line {number}: has {len(cells)} columns, the header has {width}"
        raise TrialError(f"{path}: {message}: is the file whole?")
    return cells


def _each(path: Path, number: int, cells: Sequence[str], names: Sequence[str]) -> list[float]:
    values = []
    for cell, name in zip(cells, names, strict=True):
        if cell.lower() in _MISSING:
            values.append(np.nan)
            continue
        try:
            values.append(float(cell))
        except ValueError:
            message = f"line {number}, column {name}: {shown(cell)}"
            raise TrialError(f"{path}: {message}: must be a number") from None
    return values
