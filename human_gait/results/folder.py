"""Results appear whole or not at all: what fails or is stopped leaves what was there before.

A folder is written beside its target and exchanged with it in one step of the file system. Where
the system has no such step, two renames take its place, and a kill between them leaves old and new
under hidden names. Where the folder cannot be renamed (a mount point, the current folder, a parent
that is read-only) its files are replaced one by one, each whole.
"""

from __future__ import annotations

import ctypes
import errno
import json
import os
import platform
import secrets
import shutil
import sys
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

from human_gait.exceptions import ResultError

T = TypeVar("T")

AGAIN = "predict it again"
"""What helps where a file of a result cannot be used."""

MARK = f".new-{platform.node()}-"
"""Part of the name of everything unfinished; the number of the process that writes it follows."""

_TRIES = 10  # others may be exchanging the same folder
_AT_FDCWD, _EXCHANGE = -100, 2


@contextmanager
def replaced_folder(
    folder: Path, derived: Collection[str] = (), solved: bool = True
) -> Iterator[Path]:
    """Yield an empty folder which replaces `folder` if nothing fails.

    Parameters
    ----------
    folder : Path
        Old files, also in sub-folders, that are neither written anew nor `derived` stay in it.
    derived : collection of str
        Files that were made from the old result, by whatever command, as paths in the folder
        (``export/motion.bvh``): they go with it, and so does a sub-folder that held nothing else.
    solved : bool
        Whether it took a solve to make what is written: if it cannot be written, that is lost.

    Raises
    ------
    ResultError
        If the new files cannot be written.
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
        why = f"cannot be written: {error.strerror or error}"
        fate = "the new result is lost" + (", the old one is as it was" if there else "")
        message = f"{folder}: the result {why}; {fate}" if solved else f"{folder}: {why}"
        raise ResultError(message) from error
    _sweep(target)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield the path of a file to write, which replaces `path` if nothing fails.

    The folders above it are made.

    Raises
    ------
    ResultError
        If it cannot be written.
    """
    target = Path(os.path.realpath(path))
    special = path.exists() and not path.is_file()  # a pipe is written, not replaced
    new = path if special else _unfinished(target)
    try:
        if not special:
            _make_folder(target.parent)
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


def read_json(path: Path, restore: Callable[[Any], T]) -> T:
    """Return what `restore` makes of the content of a JSON file of a result.

    Raises
    ------
    ResultError
        If the file is missing or cannot be read, or `restore` cannot make anything of it.
    """
    try:
        return restore(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise ResultError(f"{path.parent}: no {path.name}: {AGAIN}") from None
    except OSError as error:
        raise ResultError(f"{path}: cannot be read: {error.strerror}") from None
    except KeyError as error:
        raise ResultError(f"{path}: has no {error.args[0]}, {AGAIN}") from None
    except (AttributeError, TypeError, ValueError, ZeroDivisionError, RecursionError):
        raise ResultError(f"{path}: is damaged, {AGAIN}") from None


def _unfinished(target: Path) -> Path:
    unique = f"{os.getpid()}-{secrets.token_hex(4)}"
    return target.parent / f"{_prefix(target)}{unique}{target.suffix[:9]}"


def _prefix(target: Path) -> str:
    return f".{target.name[:30]}{MARK}"  # file systems have a longest name


def _make_folder(folder: Path) -> None:
    """Make a folder and those above it; a file in the place of one is no folder."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR)) from None


def _made(target: Path) -> Path:
    """Return a new empty folder beside the target, or in it if that cannot be renamed."""
    _make_folder(target.parent)
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
    if new.parent == target or not _exchanged(new, target, derived):
        _one_by_one(new, target, derived, names)


def _exchanged(new: Path, target: Path, derived: Collection[str]) -> bool:
    for _ in range(_TRIES):
        with suppress(OSError):
            if not target.is_dir():
                new.rename(target)
                return True
            _carry(target, new, derived)
            _exchange(new, target)
            with suppress(OSError):  # what was put there since
                _carry(new, target, derived)
            return True
    return False


def _carry(old: Path, new: Path, derived: Collection[str]) -> None:
    """Have in the new folder what is in the old one and neither written anew nor derived."""
    for path in old.iterdir():
        if MARK in path.name:
            continue
        if _is_folder(path):
            (new / path.name).mkdir(exist_ok=True)
            shutil.copystat(path, new / path.name)
            inner = _below(path.name, derived)
            _carry(path, new / path.name, inner)
            if inner:
                _remove_empty(new / path.name)
        elif path.name not in derived and not os.path.lexists(new / path.name):
            _link(path, new / path.name)


def _is_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()


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
    _make_folder(target)
    inner = new if new.parent == target else Path(shutil.move(new, target / new.name))
    replaced = False
    try:
        for name in names:
            if (inner / name).is_dir():
                _put(inner / name, target / name, _below(name, derived))
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
        if not _is_folder(path):
            if path.name in derived:
                path.unlink(missing_ok=True)
        elif inner := _below(path.name, derived):
            _discard(path, inner, ())
            _remove_empty(path)


def _remove(path: Path) -> None:
    if _is_folder(path):
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
