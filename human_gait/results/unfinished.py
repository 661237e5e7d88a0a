"""What is written beside its target until it is whole, and what killed runs have left of it."""

from __future__ import annotations

import errno
import os
import platform
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

MARK = f".new-{platform.node()}="
"""Part of the name of everything unfinished; the number of the process that writes it follows."""


def unfinished(target: Path) -> Path:
    """Return a new name, beside the target, for what is to replace it."""
    unique = f"{os.getpid()}-{secrets.token_hex(4)}"
    return target.parent / f"{_prefix(target)}{unique}{target.suffix[:9]}"


def _prefix(target: Path) -> str:
    return f".{target.name[:30]}{MARK}"  # file systems have a longest name


def make_folder(folder: Path) -> None:
    """Make a folder and those above it; a file in the place of one is no folder."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR)) from None


def refuges(name: str) -> Iterator[Path]:
    """Yield new places for what cannot be written where it should be; who has room stays at one."""
    for base in (tempfile.gettempdir, lambda: "/var/tmp", Path.home, Path.cwd):
        with suppress(OSError, RuntimeError):
            place = Path(tempfile.mkdtemp(prefix="human-gait-", dir=base()))
            yield place / name
            shutil.rmtree(place, ignore_errors=True)  # there was none


def is_folder(path: Path) -> bool:
    """Tell whether a path is a folder itself, no link to one."""
    return path.is_dir() and not path.is_symlink()


def _remove(path: Path) -> None:
    if is_folder(path):
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def sweep(target: Path) -> None:
    """Remove what killed runs have left unfinished of a target that is whole now."""
    for folder in (target.parent, target):
        with suppress(OSError):
            for path in folder.iterdir():
                if path.name.startswith(_prefix(target)) and not _lives(path.name):
                    _remove(path)


def sweep_folder(folder: Path) -> None:
    """Remove what killed runs of this computer have left unfinished in a folder, of any target."""
    with suppress(OSError):
        for path in folder.iterdir():
            if path.name.startswith(".") and MARK in path.name and not _lives(path.name):
                _remove(path)


def _lives(name: str) -> bool:
    number = name.rpartition(MARK)[2].partition("-")[0]
    try:
        os.kill(int(number), 0)
    except (ProcessLookupError, ValueError, OverflowError):
        return False
    except PermissionError:
        return True
    return True
