"""What the commands take about measured trials: their files, and what these do not say."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

WithTrials = Annotated[
    list[Path] | None,
    typer.Option("--with", metavar="FILE...", help="Own trials: .mot, .sto, .trc, .c3d, .csv."),
]
MoreTrials = Annotated[
    list[Path] | None, typer.Argument(metavar="FILE", help="More files of --with.")
]
Units = Annotated[
    list[str] | None,
    typer.Option("--units", metavar="UNIT", help="Of files that do not say it: deg, rad, mm, m."),
]
Up = Annotated[str, typer.Option("--up", metavar="AXIS", help="Axis of the files: y, z, -y, ...")]
Forward = Annotated[
    str, typer.Option("--forward", metavar="AXIS", help="Axis along which one walks: x, -x, z, ...")
]
NameMap = Annotated[
    list[str] | None,
    typer.Option(
        "--map", metavar="CURVE=COLUMN", help="A column by hand: knee_flexion_deg=-knee_angle_r."
    ),
]
Events = Annotated[
    str, typer.Option("--events", metavar="S,S", help="Strikes of the foot in seconds: 0.52,1.63.")
]
Feet = Annotated[
    list[str] | None,
    typer.Option("--feet", metavar="PLATE=r|l", help="Which foot is on a force plate: 1=r."),
]
Mass = Annotated[
    float | None, typer.Option("--mass", metavar="KG", help="Of who walked, where no file has it.")
]
Side = Annotated[str, typer.Option("--side", metavar="r|l", help="The leg whose cycles count.")]


def trial_files(more: list[Path] | None, given: list[Path] | None) -> list[Path]:
    """Return all files of ``--with``, which takes what follows it.

    Raises
    ------
    typer.BadParameter
        If there are files without the option.
    """
    if more and not given:
        raise typer.BadParameter(f"unexpected {more[0]}: files of own trials follow --with")
    return [*(given or []), *(more or [])]
