"""Commands that write files for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from human_gait.commands.arguments import (
    FormatName,
    ResultFolder,
    check_result,
    format_named,
    loaded_gait,
    whole_number,
)
from human_gait.exceptions import GaitError
from human_gait.results.names import EXPORT, ROBOT
from human_gait.terminal import say


def export(
    folder: ResultFolder,
    formats: Annotated[
        list[FormatName] | None,
        typer.Option(
            "--format",
            parser=format_named,
            metavar=f"[{'|'.join(FormatName)}]",
            help="What to write, also several times; else everything.",
        ),
    ] = None,
    rate: Annotated[
        int | None,
        typer.Option(
            parser=whole_number,
            metavar="HZ",
            help="Samples per second, else 100, and 1000 in OpenSim's tables.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Folder to write to, else DIR/export.")
    ] = None,
) -> None:
    """Write one stride of a result for OpenSim, motion capture, animation and robot programs."""
    check_result(folder)
    from human_gait.export.formats import FORMATS, RATES, export_gait

    if rate is not None and not RATES[0] <= rate <= RATES[1]:
        raise GaitError(f"--rate = {rate}: must be from {RATES[0]} to {RATES[1]} Hz")

    target = out or folder / EXPORT
    names = [name.value for name in formats] if formats else list(FORMATS)
    files = export_gait(loaded_gait(folder), target, names, rate)
    say(f"wrote {len(files)} files to {target}")


def urdf(
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File to write, else urdf/human.urdf.")
    ] = None,
    scenario: Annotated[
        Path | None, typer.Option(metavar="SCENARIO", help="Whose body; else the median male.")
    ] = None,
) -> None:
    """Write the body, with the limits of the scenario, as a URDF file for other programs."""
    from human_gait.export.robot import scenario_robot
    from human_gait.results.folder import whole_file
    from human_gait.results.ours import check_free
    from human_gait.scenario import load_scenario

    target = out or Path("urdf") / ROBOT
    if out is None:
        check_free(target.parent, [target.name])
    text = scenario_robot(load_scenario(scenario) if scenario else None)
    with whole_file(target) as path:
        path.write_text(text, encoding="utf-8")
    say(f"wrote {target}")
