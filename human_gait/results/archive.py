"""Archives of arrays, ``.npz``, read without trust: a file may ask for any memory."""

from __future__ import annotations

import os
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import ResultError, ScenarioError
from human_gait.results.reading import open_regular, parsed

LARGEST = 2**28
"""Bytes of an archive, packed and unpacked: the finest grid that can be asked for takes 80 MB."""

_MOST = 200  # arrays; a gait has 23, and each constraint of one's own has multipliers
_LONGEST_LIST = 2**16  # bytes of the list of what is in an archive
_PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_START, _END = b"PK\3\4", b"PK\5\6"
_END_SIZE = 22  # bytes, without a comment
_UNREADABLE = (  # what numpy, zipfile and zlib raise at a damaged file
    OSError,
    EOFError,
    ValueError,
    TypeError,
    LookupError,
    RuntimeError,
    MemoryError,
    SyntaxError,
    OverflowError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)


class Arrays(Mapping[str, Any]):
    """The arrays of an archive by name, each read when it is asked for."""

    def __init__(self, file: Mapping[str, Any]) -> None:
        self._file = file

    def __iter__(self) -> Iterator[str]:
        return iter(self._file)

    def __len__(self) -> int:
        return len(self._file)

    def __contains__(self, name: object) -> bool:
        return name in self._file

    def __getitem__(self, name: str) -> Any:
        """Return an array.

        Raises
        ------
        ValueError
            If there is none of the name, or it cannot be read, or holds Python's objects.
        """
        if name not in self._file:
            raise ValueError(f"it has no {name}")
        try:
            found = self._file[name]
        except Exception:  # noqa: BLE001, numpy parses what heads an array: it can raise anything
            found = None
        if isinstance(found, np.ndarray):
            return found
        raise ValueError(f"{_named(name)} is no array of numbers or text")


@contextmanager
def opened(path: Path, what: str) -> Iterator[Arrays]:
    """Yield the arrays of an archive by name.

    Raises
    ------
    ResultError
        If they, or what is made of them meanwhile, are not `what` was expected.
    """
    try:
        with open_regular(path) as stream:
            _check(stream)
            with np.load(stream, allow_pickle=False) as file:
                yield Arrays(file)
    except ScenarioError as error:
        raise ResultError(f"{path}: not {what} that can be read: {error.errors[0].line}") from None
    except OSError as error:
        why = error.strerror or str(error)
        raise ResultError(f"{path}: not {what} that can be read: {why}") from None
    except _UNREADABLE as error:
        raise ResultError(f"{path}: not {what} that can be read: {_in_a_line(error)}") from None


def numbers(file: Mapping[str, Any], name: str, shape: tuple[int, ...] | None = None) -> FloatArray:
    """Return an array of finite numbers of an archive, or raise TypeError or ValueError."""
    found = np.asarray(file[name])
    if found.dtype != np.float64:
        raise TypeError(f"{name} of type {found.dtype} are no numbers of double precision")
    if not np.all(np.isfinite(found)):
        raise ValueError(f"{name} holds what is not a finite number")
    if shape is not None and found.shape != shape:
        raise ValueError(f"{name} has the shape {found.shape}, expected {shape}")
    return found


def text(file: Mapping[str, Any], name: str) -> str:
    """Return a text of an archive, or raise ValueError."""
    found = file[name]
    if found.dtype.kind != "U" or found.ndim:
        raise ValueError(f"{name} is no text")
    return str(found)


def told(file: Mapping[str, Any], name: str) -> Any:
    """Return what a text of an archive, which is JSON, tells, or raise ValueError."""
    try:
        return parsed(text(file, name))
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def _check(stream: BinaryIO) -> None:
    """Refuse, before anything is unpacked, what is no archive of ours: it could fill the memory."""
    size = stream.seek(0, os.SEEK_END)
    if size > LARGEST:
        raise ValueError(f"it is larger than {LARGEST} bytes")
    _check_ends(stream, size)
    with zipfile.ZipFile(stream) as archive:
        members = archive.infolist()
        names = [member.filename for member in members]
        if twice := next((name for name in names if names.count(name) > 1), ""):
            raise ValueError(f"it holds {_named(twice)} twice")
        if sum(member.file_size for member in members) > LARGEST:
            raise ValueError(f"unpacked it is larger than {LARGEST} bytes")
        if any(member.compress_type not in _PACKINGS for member in members):
            raise ValueError("it is packed in another way than numpy does")
        if damaged := archive.testzip():  # numpy may stop short of the checksum
            raise ValueError(f"{_named(damaged)} is damaged")
    stream.seek(0)


def _check_ends(stream: BinaryIO, size: int) -> None:
    """Refuse what does not begin and end as an archive, or lists more than ours do.

    The end tells how many files there are and how long their list is, before anybody reads it.
    """
    stream.seek(0)
    start = stream.read(len(_START))
    stream.seek(max(size - _END_SIZE, 0))
    end = stream.read(_END_SIZE)
    if not start:
        raise ValueError("it is empty")
    if start != _START or len(end) < _END_SIZE or not end.startswith(_END):
        raise ValueError("it is no archive, or not all of one")
    count, length = struct.unpack("<10xHI6x", end)
    if count > _MOST or length > _LONGEST_LIST:
        raise ValueError(f"it holds too much: at most {_MOST} arrays can be")


def _named(name: str) -> str:
    return name if len(name) <= 60 else f"{name[:60]}..."


def _in_a_line(error: BaseException) -> str:
    """Return what is wrong in the user's terms; of Python's own terms none are left."""
    if isinstance(error, MemoryError):
        return "it takes more memory than there is"
    if isinstance(error, zipfile.BadZipFile | zlib.error | struct.error | NotImplementedError):
        return "it is no archive, or not all of one"
    if isinstance(error, RecursionError | SyntaxError | OverflowError | EOFError | LookupError):
        return "it is damaged"
    return str(error)
