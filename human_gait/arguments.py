"""What the commands take: types of their arguments and options, and folders that must do."""

from __future__ import annotations

import tempfile
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from human_gait.exceptions import ResultError
from human_gait.results.names import GAIT_FILE
from human_gait.results.unfinished import MARK
from human_gait.stopping import checked_limit


class SolverName(StrEnum):
    """The solvers to choose from."""

    NEWTON = "newton"
    SNOPT = "snopt"
    IPOPT = "ipopt"


class SolverChoice(StrEnum):
    """One solver, or all of them on the same problem."""

    NEWTON = "newton"
    SNOPT = "snopt"
    IPOPT = "ipopt"
    ALL = "all"


class DynamicsName(StrEnum):
    """What the dynamics is computed with."""

    PINOCCHIO = "pinocchio"
    DH = "dh"


class FormatName(StrEnum):
    """What a walk can be exported as."""

    OSIM = "osim"
    MOT = "mot"
    GRF = "grf"
    STO = "sto"
    TRC = "trc"
    C3D = "c3d"
    BVH = "bvh"
    CSV = "csv"
    URDF = "urdf"


def format_named(text: str) -> FormatName:
    """Return the format of a name."""
    try:
        return FormatName(text)
    except ValueError:
        each = "; give --format once for each" if set(text) & set(", ") else ""
        raise typer.BadParameter(f"{text!r} is not one of {', '.join(FormatName)}{each}") from None


def seconds(given: str) -> float:
    """Return a time limit."""
    try:
        limit = float(given)
    except ValueError:
        raise typer.BadParameter(f"{given!r} is not a number of seconds") from None
    try:
        checked_limit(limit)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    return limit


ScenarioFile = Annotated[
    Path, typer.Argument(metavar="SCENARIO", help="A file, TOML, or a name: normal.")
]
Engine = Annotated[
    DynamicsName, typer.Option(help="Dynamics: Pinocchio, or the paper's recursion (dh).")
]
TimeLimit = Annotated[
    float,
    typer.Option(
        "--time-limit",
        metavar="S",
        parser=seconds,
        help="Seconds to look for a walk; then the best attempt is kept. With all: of each solver.",
    ),
]
ResultFolder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a result.")]


def check_result(folder: Path) -> None:
    """Raise ResultError unless `folder` holds a result."""
    if folder.is_file():
        raise ResultError(f"{folder}: is a file, give the folder of a result")
    if not (folder / GAIT_FILE).is_file():
        message = f"{folder}: no result here (no {GAIT_FILE}), make one with human-gait predict"
        raise ResultError(message)


def check_writable(folder: Path) -> None:
    """Raise ResultError, before minutes of solving, if no result can be written to `folder`."""
    parent = next(path for path in (folder.absolute(), *folder.absolute().parents) if path.exists())
    try:
        with tempfile.TemporaryDirectory(dir=parent, prefix=MARK):
            pass
    except OSError as error:
        message = f"{folder}: a result cannot be written here: {parent}: {error.strerror}"
        raise ResultError(message) from None
