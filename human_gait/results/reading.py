"""Files of a result that are read, and what is said where one cannot be."""

from __future__ import annotations

import errno
import io
import json
import os
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

from human_gait.exceptions import ResultError
from human_gait.results.sealed import is_broken
from human_gait.results.shapes import Shape, faults

AGAIN = "predict it again"
"""What helps where a file of a result cannot be used."""

LARGEST = 2**24
"""Bytes of a JSON file or a table that is read; ours have some ten thousand."""


def read_json(path: Path, shape: Shape) -> Any:
    """Return the content of a JSON file of a result, which is of a shape.

    Parameters
    ----------
    path : Path
    shape : Shape
        What has to be in it; what else there is may be anything.

    Raises
    ------
    ResultError
        If the file is missing, cannot be read, is not of the shape, or was changed since it was
        written.
    """
    content = read_any_json(path)
    if wrong := next(faults(content, shape), ""):
        raise ResultError(f"{path}: {wrong}: it is damaged, {AGAIN}")
    if is_broken(content):
        raise ResultError(f"{path}: was changed since it was written: {AGAIN}")
    return content


def read_any_json(path: Path) -> Any:
    """Return the content of a JSON file of a result, whatever it is.

    Raises
    ------
    ResultError
        If the file is missing or cannot be read.
    """
    try:
        return parsed(read_text(path))
    except ValueError as error:
        raise ResultError(f"{path}: it is damaged, {error}: {AGAIN}") from None


def read_text(path: Path) -> str:
    """Return the text of a file of a result.

    Raises
    ------
    ResultError
        If it is missing, no regular file, larger than `LARGEST` bytes, or no text.
    """
    try:
        content = read_regular(path, LARGEST)
    except FileNotFoundError:
        raise ResultError(f"{path.parent}: no {path.name}: {AGAIN}") from None
    except OSError as error:
        raise ResultError(f"{path}: cannot be read: {error.strerror or error}") from None
    if len(content) > LARGEST:
        raise ResultError(f"{path}: is larger than {LARGEST} bytes, which no such file is")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        raise ResultError(f"{path}: is damaged, it is no text in UTF-8: {AGAIN}") from None


def read_regular(path: Path, most: int) -> bytes:
    """Return the first bytes of a file, one more than `most` at the most.

    Raises
    ------
    OSError
        If it cannot be read, or is a folder, a pipe or a device, which might never end.
    """
    with open_regular(path) as file:
        return file.read(most + 1)


def open_regular(path: Path) -> io.BufferedReader:
    """Return a file, open for reading bytes, which is not waited for.

    Raises
    ------
    OSError
        If it cannot be opened, or is a folder, a pipe or a device.
    """
    file = io.FileIO(path, opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK))
    if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        return io.BufferedReader(file)
    file.close()
    raise OSError(errno.EINVAL, "it is no file but a folder, a pipe or a device", str(path))


def parsed(text: str) -> Any:
    """Return what a JSON text tells, strictly: each key once, numbers that are numbers.

    Raises
    ------
    ValueError
        If it cannot be told, in plain words.
    """
    if text.startswith("\ufeff"):
        raise ValueError("it starts with a byte order mark")
    try:
        return json.loads(text, object_pairs_hook=_each_once, parse_constant=_no_number)
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        raise ValueError(f"it is no JSON at {where}") from None
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except _Refused as error:
        raise ValueError(str(error)) from None
    except ValueError:
        raise ValueError("it holds a number of thousands of digits") from None


class _Refused(Exception):
    """What JSON allows, or Python's does, and no file of ours has."""


def _each_once(pairs: list[tuple[str, Any]]) -> Mapping[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in table if names.count(name) > 1)
        raise _Refused(f"it has the key {twice[:40]!r} twice")
    return table


def _no_number(name: str) -> NoReturn:
    raise _Refused(f"it holds {name}, which is no number")
