"""The command that shows what a study found."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from human_gait.terminal import say


def study_report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a study.")],
    limit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LIMIT",
            help="What is to be kept, such as 'knee_extension_peak < 1.0'; may be repeated.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Page, HTML, else report.html in DIR.")
    ] = None,
) -> None:
    """Write one page about a study: maps, limits, trade-offs, what matters, walks in motion."""
    from human_gait.findings.page import study_report as written

    say(f"wrote {written(folder, limit or (), out)}")
