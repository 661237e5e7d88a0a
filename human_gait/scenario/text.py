"""The text of a scenario file: of a size, depth and kind that its reader can take in no time.

Python's reader of TOML takes time that grows with the square of the parts of a dotted key, and
recurses into brackets. What no scenario has is refused before it is read.
"""

from __future__ import annotations

import os
import re
import select
import stat
import time
import tomllib
from pathlib import Path
from typing import Any

from human_gait.exceptions import ScenarioError

LARGEST_FILE = 1_000_000
"""Bytes that a scenario file may have."""

LONGEST_WAIT = 10.0
"""For who writes to a pipe to begin and to end, [s]."""

MOST_PARTS, MOST_DEPTH, MOST_DIGITS = 20, 20, 400

_KINDS = {stat.S_ISDIR: "is a folder", stat.S_ISCHR: "is a device", stat.S_ISBLK: "is a device"}
_TOKEN = re.compile(  # each ends where it fails to close: the text is gone through once
    r'"""(?:[^"\\]|\\.|"(?!""))*+(?:"""|\Z)'
    r"|'''(?:[^']|'(?!''))*+(?:'''|\Z)"
    r'|"(?:[^"\\\n]|\\.)*+"?'
    r"|'[^'\n]*+'?"
    r"|\#[^\n]*+"
    r"|[\w+-]++"
    r"|[ \t]++"
    r"|.",
    re.DOTALL,
)
_PART_OR_BLANK = re.compile(r"[\w+\-\"' \t]")
_NUMBER = re.compile(r"[+-]?[0-9_]+")
_OPEN, _CLOSED = ("[", "{"), ("]", "}")
_TOO_MANY = (
    f"a key of more than {MOST_PARTS} parts",
    f"more than {MOST_DEPTH} brackets in each other",
    f"a number of more than {MOST_DIGITS} digits",
)


def read_toml(path: Path) -> dict[str, Any]:
    """Return the tables of a TOML file.

    Raises
    ------
    ScenarioError
        If it is no file or pipe, too large, no text in UTF-8, no TOML, or deeper than any scenario.
    OSError, ValueError
        If it cannot be read at all; ValueError: its name has a null character.
    """
    try:
        text = _content(path).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ScenarioError("", "is not a text file in UTF-8") from None
    _check_depth(text)
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        reason = "it is too deep" if isinstance(error, RecursionError) else error
        raise ScenarioError("", f"is not TOML: {reason}") from None


def _content(path: Path) -> bytes:
    """Return the bytes of a file, or of a pipe until its end."""
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    file = os.open(path, flags)  # of a named pipe it returns at once
    try:
        mode = os.fstat(file).st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISFIFO(mode)):
            kind = next((words for of, words in _KINDS.items() if of(mode)), "is no file")
            raise ScenarioError("", f"cannot be read: it {kind}, give a TOML file")
        return _whole(file, waits=stat.S_ISFIFO(mode))
    finally:
        os.close(file)


def _whole(file: int, waits: bool) -> bytes:
    parts, size, end = list[bytes](), 0, time.monotonic() + LONGEST_WAIT
    while size <= LARGEST_FILE:
        if waits and not select.select([file], [], [], max(end - time.monotonic(), 0.0))[0]:
            raise ScenarioError("", f"cannot be read: a pipe, not ended after {LONGEST_WAIT:g} s")
        part = os.read(file, LARGEST_FILE + 1)
        if not part:
            return b"".join(parts)
        parts.append(part)
        size += len(part)
    raise ScenarioError("", f"is larger than {LARGEST_FILE / 1e6:g} MB, which no scenario is")


def _check_depth(text: str) -> None:
    """Raise ScenarioError on keys of many parts, deep brackets or numbers of many digits."""
    dots = depth = 0
    for found in _TOKEN.finditer(text):
        token = found[0]
        if token == ".":
            dots += 1
        elif not _PART_OR_BLANK.match(token):
            dots = 0
        depth += (token in _OPEN) - (token in _CLOSED)
        digits = len(token) if _NUMBER.fullmatch(token) else 0
        sizes = (dots, MOST_PARTS - 1), (depth, MOST_DEPTH), (digits, MOST_DIGITS)
        for (size, most), what in zip(sizes, _TOO_MANY, strict=True):
            if size > most:
                line = text.count("\n", 0, found.start()) + 1
                raise ScenarioError("", f"cannot be a scenario: {what} in line {line}")
