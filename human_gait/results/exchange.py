"""How a new folder takes the place of an old one.

It is exchanged with the old one in one step of the file system. Where the system has no such step,
two renames take its place, and a kill between them leaves old and new under hidden names. Where the
folder cannot be renamed (a mount point, the current folder, a parent that is read-only) its files
are replaced one by one, each whole.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import sys
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path

from human_gait.exceptions import ResultError
from human_gait.results.unfinished import MARK, is_folder, make_folder, unfinished

_TRIES = 10  # others may be exchanging the same folder
_AT_FDCWD, _EXCHANGE = -100, 2  # of renameat2, and the flag of it and of renamex_np


def put(new: Path, target: Path, derived: Collection[str]) -> None:
    """Put a new folder in the place of its target, in one step or file by file.

    Parameters
    ----------
    new : Path
        Beside the target, or in it if the target cannot be renamed.
    target : Path
    derived : collection of str
        Files that go with the old folder, as paths in it; others stay unless written anew.

    Raises
    ------
    OSError
        If that fails; the target is then as it was.
    ResultError
        If it fails after some of the files were replaced.
    """
    names = sorted(path.name for path in new.iterdir())
    if new.parent == target or not _exchanged(new, target, derived):
        _one_by_one(new, target, derived, names)


def _exchanged(new: Path, target: Path, derived: Collection[str]) -> bool:
    for _ in range(_TRIES):
        with suppress(OSError):
            if not target.is_dir():
                new.rename(target)
                return True
            carry(target, new, derived)
            exchange(new, target)
            with suppress(OSError):  # what was put there since
                carry(new, target, derived)
            return True
    return False


def carry(old: Path, new: Path, derived: Collection[str]) -> None:
    """Have in the new folder what is in the old one and neither written anew nor derived."""
    for path in old.iterdir():
        if MARK in path.name:
            continue
        if is_folder(path):
            (new / path.name).mkdir(exist_ok=True)
            shutil.copystat(path, new / path.name)
            inner = _below(path.name, derived)
            carry(path, new / path.name, inner)
            if inner:
                _remove_empty(new / path.name)
        elif path.name not in derived and not os.path.lexists(new / path.name):
            _link(path, new / path.name)


def _below(folder: str, paths: Collection[str]) -> list[str]:
    """Return those of the paths that lead into a folder, as seen from there."""
    start = f"{folder}/"
    return [path.removeprefix(start) for path in paths if path.startswith(start)]


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):  # it is not empty
        folder.rmdir()


def _link(source: Path, target: Path) -> None:
    try:
        os.link(source, target, follow_symlinks=False)
    except OSError:  # a file system without hard links, or somebody else's file
        shutil.copy2(source, target, follow_symlinks=False)


def exchange(new: Path, target: Path) -> None:
    """Let two folders change names."""
    library = ctypes.CDLL(None, use_errno=True)
    one, other = os.fsencode(new), os.fsencode(target)
    try:
        if sys.platform == "darwin":
            failed = library.renamex_np(one, other, _EXCHANGE)
        else:
            failed = library.renameat2(_AT_FDCWD, one, _AT_FDCWD, other, _EXCHANGE)
    except AttributeError:
        failed = True
    if failed:
        rename_both(new, target)


def rename_both(new: Path, target: Path) -> None:
    """Let two folders change names where the system cannot exchange them."""
    old = unfinished(target)
    try:
        target.rename(old)
        new.rename(target)
    except BaseException:
        with suppress(OSError):
            old.rename(target)
        raise
    with suppress(OSError):
        old.rename(new)  # where it will be removed


def _one_by_one(new: Path, target: Path, derived: Collection[str], names: list[str]) -> None:
    make_folder(target)
    inner = new if new.parent == target else Path(shutil.move(new, target / new.name))
    replaced = False
    try:
        for name in names:
            if (inner / name).is_dir():
                put(inner / name, target / name, _below(name, derived))
            else:
                (inner / name).replace(target / name)
            replaced = True
        _discard(target, set(derived), names)
    except OSError as error:
        if not replaced:
            raise
        why = f"cannot be replaced whole: {error.strerror or error}"
        raise ResultError(f"{target}: {why}; some of its files are old, some new") from error
    finally:
        shutil.rmtree(inner, ignore_errors=True)


def _discard(folder: Path, derived: Collection[str], names: Collection[str]) -> None:
    """Remove what is derived, but for what is ours by `names`, and folders that held only that."""
    for path in list(folder.iterdir()):
        if path.name in names or MARK in path.name:
            continue
        if not is_folder(path):
            if path.name in derived:
                path.unlink(missing_ok=True)
        elif inner := _below(path.name, derived):
            _discard(path, inner, ())
            _remove_empty(path)
