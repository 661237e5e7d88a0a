"""What the commands take: types of their arguments and options, and folders that must do."""

from __future__ import annotations

import re
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from human_gait.exceptions import GaitError, ResultError, shown
from human_gait.results.names import GAIT_FILE, INDEX, PREDICTED, result_files
from human_gait.solving.seeds import checked_seed, checked_starts
from human_gait.stopping import checked_limit
from human_gait.terminal import say

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait

_ROOM = 2**21  # bytes: a result takes about 1 MB, its pictures and the animation 3 more


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


def whole_number(text: str | int) -> int:
    """Return the whole number of an option; its range is the business of who takes it."""
    if isinstance(text, int):  # its default
        return text
    if not re.fullmatch(r"\s*[+-]?[0-9]{1,18}\s*", text):
        raise typer.BadParameter(f"{shown(text)} must be a whole number")
    return int(text)


def seed_number(text: str | int) -> int:
    """Return the seed of an option."""
    try:
        return checked_seed(whole_number(text))
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None


def starts_number(text: str | int) -> int:
    """Return the number of starts of an option."""
    try:
        return checked_starts(whole_number(text))
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None


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
        help="Seconds that each solver may look for a walk; then the best attempt is kept.",
    ),
]
NoPlots = Annotated[
    bool, typer.Option("--no-plots", help="Draw nothing now; human-gait plot does it later.")
]
ResultFolder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a result.")]
SecondResult = Annotated[
    Path | None, typer.Argument(metavar="[DIR2]", help="A result to show beside it.")
]


def no_empty(words: Sequence[str]) -> None:
    """Refuse an argument without a sign: as a path it would mean the current folder.

    It comes from a variable of the shell that is not set.
    """
    for k, word in enumerate(words):
        option, given, value = word.partition("=")
        if not word or (given and not value and option.startswith("--")):
            before = words[k - 1] if k and words[k - 1].startswith("--") else ""
            what = (option or before or "an argument").removesuffix("=")
            raise GaitError(f"{what} is empty: give a name, or '.' for the current folder")


def check_result(folder: Path) -> None:
    """Raise ResultError unless `folder` holds a result."""
    if folder.is_file():
        raise ResultError(f"{folder}: is a file, give the folder of a result")
    if not (folder / GAIT_FILE).is_file():
        make = "make one with human-gait predict"
        if (folder / INDEX).is_file():
            make = "but a study: hg.open_study(DIR).gait(KEY).save(RESULT) makes one of a walk"
        message = f"{folder}: no result here (no {GAIT_FILE}), {make}"
        raise ResultError(message)


def beside(folder: Path, more: str) -> Path:
    """Return a folder beside another one, called like it and something more."""
    named = folder if folder.name not in ("", "..") else folder.resolve()
    return named.with_name(f"{named.name}{more}")


def check_writable(folder: Path, *, by_all: bool = False) -> None:
    """Raise ResultError, before minutes of solving, if no result can be written to `folder`.

    Parameters
    ----------
    folder : Path
    by_all : bool
        Whether it will hold a result of each solver.
    """
    from human_gait.results.folder import try_folder
    from human_gait.results.ours import check_free

    solvers = [name.value for name in SolverName]
    written = [f"{name}/{GAIT_FILE}" for name in solvers] if by_all else PREDICTED
    removed = result_files(solvers)
    try:
        try_folder(folder, removed, _ROOM)
        check_free(folder, written, removed)
    except OSError as error:
        why = error.strerror or error
        raise ResultError(f"{folder}: a result cannot be written here: {why}") from None


def loaded_gait(folder: Path) -> Gait:
    """Return the gait of a result; where that is no walk, a note says so."""
    from human_gait.walk.described import no_walk
    from human_gait.walk.gait_file import load_gait

    gait = load_gait(folder)
    if why := no_walk(gait):
        say(f"note: {folder}: {why}", error=True)
    return gait
