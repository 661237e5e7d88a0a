"""Results appear whole or not at all: what fails or is stopped leaves what was there before.

A folder is written beside its target and exchanged with it in one step of the file system. Where
the system has no such step, two renames take its place, and a kill between them leaves old and new
under hidden names. Where the folder cannot be renamed (a mount point, the current folder, a parent
that is read-only) its files are replaced one by one, each whole.
"""

from __future__ import annotations

import ctypes
import os
import platform
import secrets
import shutil
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from human_gait.exceptions import ResultError

MARK = f".new-{platform.node()}-"
"""Part of the name of everything unfinished; the number of the process that writes it follows."""

_TRIES = 10  # others may be exchanging the same folder
_AT_FDCWD, _EXCHANGE = -100, 2


@contextmanager
def replaced_folder(folder: Path, derived: Collection[str] = ()) -> Iterator[Path]:
    """Yield an empty folder which replaces `folder` if nothing fails.

    Parameters
    ----------
    folder : Path
        Old files, also in sub-folders, that are neither written anew nor `derived` stay in it.
    derived : collection of str
        Names of what was made from the old result, by whatever command: they go with it.

    Raises
    ------
    ResultError
        If the new result cannot be written.
    """
    target = Path(os.path.realpath(folder))
    there = target.is_dir()
    try:
        new = _made(target)
        try:
            yield new
            _sync(new)
            _put(new, target, derived)
        finally:
            shutil.rmtree(new, ignore_errors=True)  # it holds the old result if they were exchanged
    except OSError as error:
        fate = "the new result is lost" + (", the old one is as it was" if there else "")
        message = f"{folder}: the result cannot be written: {error.strerror or error}; {fate}"
        raise ResultError(message) from error
    _sweep(target)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield the path of a file to write, which replaces `path` if nothing fails.

    Raises
    ------
    ResultError
        If it cannot be written.
    """
    target = Path(os.path.realpath(path))
    special = path.exists() and not path.is_file()  # a pipe is written, not replaced
    new = path if special else _unfinished(target)
    try:
        try:
            yield new
            if not special:
                _sync(new)
                new.replace(target)
        finally:
            if not special:
                new.unlink(missing_ok=True)
    except OSError as error:
        raise ResultError(f"{path}: cannot be written: {error.strerror or error}") from error
    _sweep(target)


def _unfinished(target: Path) -> Path:
    unique = f"{os.getpid()}-{secrets.token_hex(4)}"
    return target.parent / f"{_prefix(target)}{unique}{target.suffix[:9]}"


def _prefix(target: Path) -> str:
    return f".{target.name[:30]}{MARK}"  # file systems have a longest name


def _made(target: Path) -> Path:
    """Return a new empty folder beside the target, or in it if that cannot be renamed."""
    target.parent.mkdir(parents=True, exist_ok=True)
    new = _unfinished(target)
    if target.is_dir() and not _can_move(target):
        new = target / new.name
    new.mkdir()
    if target.is_dir():
        shutil.copymode(target, new)
    return new


def _can_move(folder: Path) -> bool:
    """Tell whether a folder can be renamed without pulling it from under who stands in it."""
    try:
        here = Path.cwd()
    except FileNotFoundError:  # it has been replaced or removed
        here = folder.parent
    in_use = os.path.ismount(folder) or here.is_relative_to(folder)
    return not in_use and os.access(folder.parent, os.W_OK)


def _sync(path: Path) -> None:
    """Have a file, or a folder with everything in it, on the disk before it is renamed."""
    if path.is_dir():
        for inner in path.iterdir():
            _sync(inner)
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _put(new: Path, target: Path, derived: Collection[str]) -> None:
    names = sorted(path.name for path in new.iterdir())
    if new.parent == target or not _exchanged(new, target, derived, names):
        _one_by_one(new, target, derived, names)


def _exchanged(new: Path, target: Path, derived: Collection[str], names: Collection[str]) -> bool:
    for _ in range(_TRIES):
        with suppress(OSError):
            if not target.is_dir():
                new.rename(target)
                return True
            _carry(target, new, derived, names)
            _exchange(new, target)
            with suppress(OSError):  # what was put there since
                _carry(new, target, derived, names)
            return True
    return False


def _carry(old: Path, new: Path, derived: Collection[str], names: Collection[str]) -> None:
    """Have in the new folder what is in the old one and neither ours, by `names`, nor derived."""
    for path in old.iterdir():
        if path.name in derived or MARK in path.name:
            continue
        if path.is_dir() and not path.is_symlink():
            (new / path.name).mkdir(exist_ok=True)
            shutil.copystat(path, new / path.name)
            ours = path.name in names
            _carry(path, new / path.name, derived if ours else (), names if ours else ())
        elif not os.path.lexists(new / path.name):
            _link(path, new / path.name)


def _link(source: Path, target: Path) -> None:
    try:
        os.link(source, target, follow_symlinks=False)
    except OSError:  # a file system without hard links, or somebody else's file
        shutil.copy2(source, target, follow_symlinks=False)


def _exchange(new: Path, target: Path) -> None:
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
        _rename_both(new, target)


def _rename_both(new: Path, target: Path) -> None:
    old = _unfinished(target)
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
    target.mkdir(exist_ok=True)
    inner = new if new.parent == target else Path(shutil.move(new, target / new.name))
    replaced = False
    try:
        for name in names:
            if (inner / name).is_dir():
                _put(inner / name, target / name, derived)
            else:
                (inner / name).replace(target / name)
            replaced = True
        for name in set(derived) - set(names):
            _remove(target / name)
    except OSError as error:
        if not replaced:
            raise
        why = f"cannot be replaced whole: {error.strerror or error}"
        raise ResultError(f"{target}: {why}; some of its files are old, some new") from error
    finally:
        shutil.rmtree(inner, ignore_errors=True)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _sweep(target: Path) -> None:
    """Remove what runs that were killed have left unfinished; only now is it needed no more."""
    for folder in (target.parent, target):
        with suppress(OSError):
            for path in folder.iterdir():
                if path.name.startswith(_prefix(target)) and not _lives(path.name):
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
