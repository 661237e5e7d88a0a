"""What surrounds this process has no say in our pictures: matplotlib is imported undisturbed.

At its import matplotlib reads a file and variables of the user (``matplotlibrc``, ``MPLBACKEND``)
and looks for a folder to keep its list of fonts in. Any of these can stop it, or have it print
lines that nobody asked for. `human_gait.canvas` sees to what they say of how pictures look.
"""

from __future__ import annotations

import atexit
import codecs
import locale
import logging
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path

_FILE = "matplotlibrc"
_LONGEST_FILE = 2**20  # bytes
_VARIABLES = ("MPLBACKEND", "MATPLOTLIBRC", "MPLCONFIGDIR", "FREETYPE_PROPERTIES")
_DATE = "SOURCE_DATE_EPOCH"

_ours: list[bool] = []


def process_is_ours() -> None:
    """Say that nobody else's code runs in this process: packages need not be as others want.

    Drake reads its own files in the encoding of the locale, numpy and matplotlib ask what the date
    is to be (``SOURCE_DATE_EPOCH``): neither can be what they do not expect.
    """
    _ours.append(True)
    if codecs.lookup(locale.getencoding()).name != "utf-8":
        with suppress(locale.Error):
            locale.setlocale(locale.LC_CTYPE, "C.UTF-8")
    try:
        datetime.fromtimestamp(int(os.environ.get(_DATE, "0")), UTC)
    except (ValueError, OverflowError, OSError):
        del os.environ[_DATE]


@contextmanager
def importing_matplotlib() -> Iterator[None]:
    """Have matplotlib imported whatever the user's settings are, and without a word.

    In a process that is not ours it gets these settings, as ever, if they can be read.
    """
    if "matplotlib" in sys.modules:
        yield
        return
    with _quiet(), _variables() as given:
        if _ours or not _can_be_read(_settings_file(given)):
            with _nobodys_settings():
                yield
        else:
            for name in ("MATPLOTLIBRC", "MPLCONFIGDIR"):
                os.environ.update({name: given[name]} if name in given else {})
            if not all(map(_can_be_written, _usual_folders())):
                os.environ["MPLCONFIGDIR"] = str(_own_folder())
            yield
    if not _ours and given.get("MPLBACKEND"):
        with suppress(ValueError):  # there is none of this name: matplotlib would not start
            sys.modules["matplotlib"].rcParams["backend"] = given["MPLBACKEND"]


@contextmanager
def _quiet() -> Iterator[None]:
    logger = logging.getLogger("matplotlib")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        if not _ours:
            logger.setLevel(level)


@contextmanager
def _variables() -> Iterator[dict[str, str]]:
    """Take away the variables that matplotlib reads, and put them back."""
    given = {name: os.environ.pop(name) for name in _VARIABLES if name in os.environ}
    try:
        yield given
    finally:
        for name in _VARIABLES:
            os.environ.pop(name, None)
        os.environ.update(given)


@contextmanager
def _nobodys_settings() -> Iterator[None]:
    """Have matplotlib find no file of settings: it looks in the current folder first."""
    folder = _own_folder()
    os.environ["MPLCONFIGDIR"] = str(folder)
    if not os.path.lexists(_FILE):
        yield
        return
    here = os.open(".", os.O_RDONLY)
    os.chdir(folder)
    try:
        yield
    finally:
        os.fchdir(here)
        os.close(here)


def _settings_file(given: dict[str, str]) -> Path | None:
    """Return the file that matplotlib would read; None if there is none but its own."""
    places = [Path(_FILE)]
    if named := given.get("MATPLOTLIBRC"):
        places += [Path(named), Path(named, _FILE)]
    folder = given.get("MPLCONFIGDIR")
    places.append(Path(folder or _usual_folders()[0], _FILE))
    return next((path for path in places if _is_there(path)), None)


def _is_there(path: Path) -> bool:
    try:
        return not stat.S_ISDIR(path.stat().st_mode)
    except (OSError, ValueError):
        return False


def _can_be_read(path: Path | None) -> bool:
    """Tell whether a file is text that can be read, and neither endless nor a pipe."""
    try:
        if path:
            found = path.stat()
            if not stat.S_ISREG(found.st_mode) or found.st_size > _LONGEST_FILE:
                return False
            path.read_text(encoding="utf-8")
    except (OSError, ValueError):
        return False
    return True


def _home(*below: str) -> Path:
    with suppress(RuntimeError):
        return Path.home().joinpath(*below)
    return Path(os.devnull)  # nobody's: nothing can be written there


def _usual_folders() -> list[Path]:
    """Return where matplotlib has settings and lists of fonts."""
    if named := os.environ.get("MPLCONFIGDIR"):
        return [Path(named)]
    if sys.platform == "darwin":
        return [_home(".matplotlib")]
    bases = {"XDG_CONFIG_HOME": ".config", "XDG_CACHE_HOME": ".cache"}
    return [
        Path(os.environ.get(variable) or _home(usual), "matplotlib")
        for variable, usual in bases.items()
    ]


def _can_be_written(folder: Path) -> bool:
    with suppress(OSError, ValueError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    return False


def _own_folder() -> Path:
    """Return a folder of ours for lists of fonts: kept from run to run, where that can be."""
    kept = Path(os.environ.get("XDG_CACHE_HOME") or _home(".cache"), "human-gait")
    if _can_be_written(kept):
        return kept
    user = os.getuid()
    shared = Path(tempfile.gettempdir(), f"human-gait-{user}")
    if not shared.is_symlink() and _can_be_written(shared) and shared.stat().st_uid == user:
        return shared
    once = Path(tempfile.mkdtemp(prefix="human-gait-"))
    atexit.register(shutil.rmtree, once, ignore_errors=True)
    return once
