"""Whether the parameters of a C3D file are whole: a library that follows broken ones may crash.

A record is the length of its name, its group (negative for the group itself), the name, the way to
the next record and, of a parameter, type, dimensions and data; a description ends it.
"""

from __future__ import annotations

import math
import struct
from pathlib import Path

from human_gait.exceptions import TrialError

_BLOCK = 512
_MAGIC = 0x50
_BIG_ENDIAN = 86
_PROCESSORS = (84, 85, _BIG_ENDIAN)
_TYPES = (-1, 1, 2, 4)  # text, bytes, whole numbers, numbers: bytes of an element


def check_c3d(path: Path, content: bytes) -> None:
    """Raise TrialError if a content is not that of a C3D file with whole parameters."""
    if len(content) < 2 * _BLOCK or content[1] != _MAGIC:
        raise TrialError(f"{path}: is no C3D file: byte 2 must be 80")
    start = (content[0] - 1) * _BLOCK
    if not _BLOCK <= start <= len(content) - _BLOCK or content[start + 3] not in _PROCESSORS:
        raise TrialError(f"{path}: is no whole C3D file: its parameters are nowhere")
    order = ">" if content[start + 3] == _BIG_ENDIAN else "<"
    try:
        _follow(content, start + 4, order)
    except (_Broken, IndexError, struct.error) as error:
        message = f"is no whole C3D file: its parameters end early{_at(error)}"
        raise TrialError(f"{path}: {message}") from None


class _Broken(Exception):
    """A record that cannot be: at which byte, and its name."""


def _at(error: Exception) -> str:
    return f", at {error}" if isinstance(error, _Broken) else ""


def _follow(content: bytes, at: int, order: str) -> None:
    """Follow the records from a byte on to the last."""
    groups, used = set[int](), set[int]()
    while length := abs(_signed(content, at)):
        group = _signed(content, at + 1)
        name = content[at + 2 : at + 2 + length]
        here = at + 2 + length
        way = struct.unpack_from(f"{order}h", content, here)[0]
        told = f"byte {at}, {name!r}"
        if not group or not all(32 <= sign < 127 for sign in name) or way < 0:
            raise _Broken(told)
        size = 2 + (0 if group < 0 else _size(content, here + 2, told))
        size += 1 + content[here + size]
        (groups if group < 0 else used).add(abs(group))
        if way == 0 and here + size <= len(content):
            break
        if size > way or here + way >= len(content) or any(content[here + size : here + way]):
            raise _Broken(told)
        at = here + way
    if used - groups:
        raise _Broken(f"group {min(used - groups)}, which is not there")


def _size(content: bytes, at: int, told: str) -> int:
    """Return how many bytes type, dimensions and data of a parameter have."""
    kind, count = _signed(content, at), content[at + 1]
    if kind not in _TYPES or count > 7 or (kind == -1 and not count):
        raise _Broken(told)
    return 2 + count + abs(kind) * math.prod(content[at + 2 : at + 2 + count])


def _signed(content: bytes, at: int) -> int:
    return int(struct.unpack_from("b", content, at)[0])
