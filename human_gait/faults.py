"""Errors that nobody foresaw, and faults of the environment: what they are, in one line.

Packages of other environments (ROS sets ``PYTHONPATH``), packages that are missing and libraries
that do not load are told as such; of anything else the traceback is kept in a file.
"""

from __future__ import annotations

import os
import platform
import signal
import sys
import tempfile
import traceback
from collections.abc import Iterable
from contextlib import suppress
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path

from human_gait.exceptions import GaitError
from human_gait.stopping import INTERRUPTED, under_way
from human_gait.terminal import complain

BAD_INPUT = 2
UNFORESEEN = 3

DEBUG = "HUMAN_GAIT_DEBUG"
"""Variable of the environment: the traceback is printed, too."""

PACKAGES = {
    "daqp": "daqp",
    "pydrake": "drake",
    "ezc3d": "ezc3d",
    "jinja2": "jinja2",
    "matplotlib": "matplotlib",
    "meshcat": "meshcat",
    "numpy": "numpy",
    "pinocchio": "pin",
    "rich": "rich",
    "scipy": "scipy",
    "threadpoolctl": "threadpoolctl",
    "tomli_w": "tomli-w",
    "typer": "typer",
    "yourdfpy": "yourdfpy",
    "example_robot_data": "example-robot-data",
}
"""What is imported, and what has to be installed for it."""

_LONGEST = 200  # signs of an error in a line that says more


def told_of(error: BaseException) -> str:
    """Return what an error says, in a line without its traceback."""
    if fault := environment_fault(error):
        return fault
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    said = " ".join(str(error).split())
    if isinstance(error, GaitError):
        return said
    return ": ".join(part for part in (type(error).__name__, said[:_LONGEST]) if part)


def failed(error: BaseException) -> int:
    """Print the line of an error that nobody's input is to blame for; return the exit code.

    A package that is interrupted while it is imported may say that it cannot be.
    """
    if under_way().asked.raised:
        return interrupted()
    if fault := environment_fault(error):
        return complain(fault, BAD_INPUT)
    return complain(unforeseen(error), UNFORESEEN)


def interrupted() -> int:
    """Say that a signal ended the command; return its exit code as shells know it."""
    return complain(INTERRUPTED, 128 + (under_way().asked.signal or signal.SIGINT))


def unforeseen(error: BaseException) -> str:
    """Return the line for an error that nobody foresaw, and keep its traceback in a file."""
    report = _report(error)
    if os.environ.get(DEBUG, "0") != "0":
        sys.stderr.write(report)
    what = f"{told_of(error)}: this was not foreseen, please report it"
    try:
        file, name = tempfile.mkstemp(prefix="human-gait-error-", suffix=".txt")
        with os.fdopen(file, "w", encoding="utf-8", errors="backslashreplace") as stream:
            stream.write(report)
    except OSError:
        return f"{what} with what {DEBUG}=1 prints"
    return f"{what} with the file {name}"


def environment_fault(error: BaseException) -> str:
    """Return what is wrong with the environment, and the remedy; nothing if it is not to blame."""
    if isinstance(error, GaitError | OSError | KeyboardInterrupt):
        return ""
    failed = [one for one in (error, error.__cause__) if isinstance(one, ImportError)]
    for name in (*(_top(one.name) for one in failed), *PACKAGES):
        if foreign := _foreign(name):
            return f"another {name} is in the way: {foreign}"
    for one in failed:
        name = _top(one.name)
        if name in PACKAGES and _spec(name) is None:
            return f"the package {PACKAGES[name]} is missing: {_pip(PACKAGES[name])}"
        if name != __package__:
            return f"a package cannot be loaded: {_library(one)}"
    return ""


def check_packages(names: Iterable[str]) -> None:
    """See, before they are imported, that packages are there, and of this environment.

    Raises
    ------
    ImportError
        If one is not; `failed` tells the remedy.
    """
    for name in names:
        if _spec(name) is None or _foreign(name):
            raise ImportError(f"{name} cannot be imported", name=name)


def _top(name: str | None) -> str:
    return (name or "").partition(".")[0]


def _foreign(name: str) -> str:
    """Return where a package comes from and the remedy, if it is not of this environment."""
    spec = _spec(name) if name and name != __package__ else None
    if spec is None or not spec.origin or name in sys.stdlib_module_names:
        return ""
    origin, given = Path(spec.origin), os.environ.get("PYTHONPATH", "").split(os.pathsep)
    if any(origin.is_relative_to(prefix) for prefix in {sys.prefix, sys.base_prefix}):
        return ""
    if any(origin.is_relative_to(Path(part).absolute()) for part in given if part):
        return f"{origin}, by PYTHONPATH: env -u PYTHONPATH human-gait ... does without"
    return f"{origin} is not of the environment {sys.prefix}: move it, or work in another folder"


def _spec(name: str) -> ModuleSpec | None:
    return PathFinder.find_spec(name)


def _library(error: ImportError) -> str:
    """Return what an import says that failed for other reasons than that nothing is there."""
    said, name = " ".join(str(error).split())[:_LONGEST], _top(error.name)
    if os.environ.get("LD_LIBRARY_PATH"):
        return f"{said}: try env -u LD_LIBRARY_PATH human-gait ..."
    return f"{said}: {_pip('--force-reinstall ' + PACKAGES.get(name, name or 'human-gait'))}"


def _pip(what: str) -> str:
    return f"{sys.executable} -m pip install {what}"


def _report(error: BaseException) -> str:
    """Return all that is needed to find the reason."""
    from importlib.metadata import PackageNotFoundError, version  # noqa: PLC0415, hardly ever

    versions = [f"python {platform.python_version()}", platform.platform()]
    for package in ("human-gait", *PACKAGES.values()):
        with suppress(PackageNotFoundError):
            versions.append(f"{package} {version(package)}")
    lines = ["".join(traceback.format_exception(error)), f"command: {sys.argv}", *versions]
    return "\n".join([*lines, ""])
