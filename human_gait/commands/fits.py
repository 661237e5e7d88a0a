"""The command that makes a result of a measured trial."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from human_gait.commands.arguments import NoPlots, check_writable, whole_number
from human_gait.commands.trials import Forward, Units, Up
from human_gait.exceptions import GaitError
from human_gait.terminal import say, screen

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait


def fit(  # noqa: PLR0913
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE", help="Of one trial: .trc, .c3d, .mot, .sto, .csv."),
    ],
    *,
    static: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A standing trial to scale the body to; else the walk."),
    ] = None,
    scenario: Annotated[
        Path | None,
        typer.Option(metavar="SCENARIO", help="Whose person, load and settings are taken."),
    ] = None,
    sex: Annotated[str | None, typer.Option(metavar="SEX", help="male or female.")] = None,
    stature: Annotated[
        float | None, typer.Option(metavar="M", help="Else found from the markers.")
    ] = None,
    mass: Annotated[
        float | None, typer.Option(metavar="KG", help="Else from the file, or its forces.")
    ] = None,
    speed: Annotated[float, typer.Option(metavar="M/S", help="Of the belt of a treadmill.")] = 0.0,
    marker: Annotated[
        list[str] | None,
        typer.Option("--map", metavar="THEIRS=OURS", help="A marker by hand; THEIRS= leaves out."),
    ] = None,
    strikes: Annotated[
        str, typer.Option(metavar="SIDE:S,S,S", help="Heel strikes: left:0.1,0.65,1.2.")
    ] = "",
    control_points: Annotated[
        int | None,
        typer.Option(parser=whole_number, metavar="N", help="Per DOF, else as a prediction has."),
    ] = None,
    units: Units = None,
    up: Up = "",
    forward: Forward = "",
    no_plots: NoPlots = False,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Result folder, else out/<name of FILE>.")
    ] = None,
) -> None:
    """Make a result of a measured trial: joint angles, mean step, torques under its forces."""
    folder = out or Path("out") / files[0].stem
    check_writable(folder)
    from rich.progress import Progress

    from human_gait.trials.calls import fit as fit_files

    terminal = screen(stderr=True)
    with Progress(console=terminal, transient=True, disable=not terminal.is_terminal) as shown:
        task = shown.add_task("joint angles from markers", total=None)
        gait = fit_files(
            files,
            static=static,
            scenario=scenario,
            sex=sex,
            stature=stature,
            mass=mass,
            speed=speed,
            markers=_pairs(marker or []),
            strikes=strikes,
            control_points=control_points,
            units=units or (),
            up=up,
            forward=forward,
            tell=lambda done, of: shown.update(task, completed=done, total=of),
        )
    gait.save(folder)
    if not no_plots:
        from human_gait.prediction import draw

        draw(gait, folder)
    _tell(gait, folder)


def _pairs(given: list[str]) -> dict[str, str]:
    """Return our markers by those of the file."""
    pairs = [one.partition("=") for one in given]
    for theirs, sign, ours in pairs:
        if not theirs or not sign:
            raise GaitError(f"--map {theirs}{ours}: must be THEIRS=OURS, such as R.ASIS=RASI")
    return {theirs.strip(): ours.strip() for theirs, _, ours in pairs}


def _tell(gait: Gait, folder: Path) -> None:
    """Print who walked, which names were guessed, what is lost and where the result is."""
    from human_gait.walk.described import gait_facts
    from human_gait.walk.measured import measured_words

    facts, found = gait_facts(gait), gait.solution["measured"]
    say(f"{facts['person']}; {facts['walk']}")
    guessed = [f"{theirs} as {ours}" for theirs, ours in found["markers"].items() if theirs != ours]
    if guessed:
        say(f"markers taken for ours: {', '.join(guessed)}")
    if found["left_out"]:
        say(f"markers left out: {', '.join(found['left_out'])} (--map NAME=OURS takes one)")
    say(measured_words(gait))
    say(f"result in {folder}")
