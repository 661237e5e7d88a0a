"""Commands about scenarios: write one, list the settings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from human_gait.terminal import say


def init(
    name: Annotated[str, typer.Argument(metavar="[NAME]", help="Its name, else walk.")] = "",
    template: Annotated[
        str, typer.Option("--from", metavar="SCENARIO", help="Begin with this one: backpack-20.")
    ] = "",
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File to write, else NAME.toml.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
) -> None:
    """Write a new scenario that explains all of its settings."""
    from human_gait.settings import write_scenario

    say(f"wrote {write_scenario(name, out, template, force)}")


def settings(
    key: Annotated[str, typer.Argument(metavar="[KEY]", help="A setting or a section.")] = "",
    json_schema: Annotated[
        bool, typer.Option("--json-schema", help="Print the JSON schema, for editors.")
    ] = False,
) -> None:
    """List the settings of a scenario, or explain one: walk.speed, or all of a section: walk."""
    from human_gait.settings import explanation, listing, schema_text

    shown = explanation(key) if key else listing()
    say(schema_text() if json_schema else shown, end="" if json_schema else "\n")
