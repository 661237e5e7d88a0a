"""Results appear whole or not at all: what fails or is stopped leaves what was there before.

A folder or a file is written beside its target (`unfinished`) and then takes its place
(`exchange`).
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from human_gait.exceptions import ResultError
from human_gait.results.exchange import put
from human_gait.results.names import AGREEMENT, GAIT_FILE
from human_gait.results.unfinished import make_folder, sweep, unfinished
from human_gait.stopping import uninterrupted

_MANY = 1000  # files and folders


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
        new = _place(target)
        try:  # an interruption may come as soon as the folder is there
            _make(new, target)
            yield new
            _sync(new)
            with uninterrupted():
                put(new, target, _going(derived, new, target))
        finally:
            shutil.rmtree(new, ignore_errors=True)  # it holds the old result if they were exchanged
    except OSError as error:
        why = f"cannot be written: {error.strerror or error}"
        fate = "the new result is lost" + (", the old one is as it was" if there else "")
        message = f"{folder}: the result {why}; {fate}" if solved else f"{folder}: {why}"
        raise ResultError(message) from error
    sweep(target)


def _going(derived: Collection[str], new: Path, target: Path) -> list[str]:
    """Return what goes with the old folder: results in folders of their own may be somebody's.

    Those of several solvers belong to it if it says how far they agree.
    """
    results = {path.rpartition("/")[0] for path in derived if path.endswith(f"/{GAIT_FILE}")}
    stay = {one for one in results if not (new / one).is_dir()}
    if (target / AGREEMENT).is_file():
        stay = set()
    return [path for path in derived if path.partition("/")[0] not in stay]


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
    new = path if special else unfinished(target)
    try:
        if not special:
            make_folder(target.parent)
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
    sweep(target)


def try_folder(folder: Path, names: Collection[str], room: int) -> None:
    """See that files can be written where a folder is to be, and leave everything as it was.

    Parameters
    ----------
    folder : Path
        It is made if it is not there, and taken away again.
    names : collection of str
        Of the files, as paths in it.
    room : int
        Bytes that there should be.

    Raises
    ------
    OSError
        If it cannot be done: a name that is too long, a disk that is full, rights that are missing.
    """
    target = Path(os.path.realpath(folder))
    with suppress(FileNotFoundError, NotADirectoryError):
        os.lstat(target / max(names, key=len))  # of a path that is too long it tells
    above = [path for path in (target, *target.parents) if not os.path.lexists(path)]
    made: list[Path] = []
    try:
        for path in reversed(above):
            path.mkdir()
            made.append(path)
        make_folder(target)
        new = _place(target)
        try:
            _make(new, target)
            (new / max((Path(name).name for name in names), key=len)).write_bytes(bytes(room))
        finally:
            shutil.rmtree(new, ignore_errors=True)
    finally:
        for path in reversed(made):
            with suppress(OSError):  # somebody else has put something there
                path.rmdir()


def _place(target: Path) -> Path:
    """Return where a new folder is to be: beside the target, or in it if that cannot be renamed."""
    make_folder(target.parent)
    new = unfinished(target)
    if target.is_dir() and not (can_move(target) and _is_small(target)):
        return target / new.name
    return new


def _make(new: Path, target: Path) -> None:
    """Make a new empty folder, open to those who may see the target."""
    new.mkdir()
    if target.is_dir():
        shutil.copymode(target, new)


def can_move(folder: Path) -> bool:
    """Tell whether a folder can be renamed without pulling it from under who stands in it."""
    try:
        here = Path.cwd()
    except FileNotFoundError:  # it has been replaced or removed
        here = folder.parent
    in_use = os.path.ismount(folder) or here.is_relative_to(folder)
    with suppress(RuntimeError):  # nobody's home is known
        in_use |= folder == Path.home().resolve()  # we cannot see who stands there
    return not in_use and os.access(folder.parent, os.W_OK)


def _is_small(folder: Path) -> bool:
    """Tell whether a folder holds little enough to be made anew with all that is in it."""
    seen, waiting = 0, [folder]
    while waiting:
        try:
            found = list(os.scandir(waiting.pop()))
        except OSError:  # it is not for us to read
            return False
        seen += len(found)
        if seen > _MANY or any(map(os.path.ismount, found)):
            return False
        waiting += [Path(entry) for entry in found if entry.is_dir(follow_symlinks=False)]
    return True


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
