"""The command ``human-gait``: predict, verify, explain, play, plot, compare, report, export ...

Exit codes: 0 done, 1 no walk (the best attempt is kept, of an interrupted solve too), 2 bad input,
a result that cannot be written or a fault of the environment, 3 what was not foreseen, 130 or 143
(128 and the number of the signal) interrupted with nothing changed. An error is one line; of a
scenario, each has one.
Solvers, plots and viewers are imported by the command that needs them: ``--help`` stays quick.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from human_gait import command
from human_gait.commands import files, findings, fits, runs, scenarios, studies, views
from human_gait.commands.arguments import (
    no_empty,
)
from human_gait.commands.exits import NO_SOLUTION, exit_code, invoked
from human_gait.faults import BAD_INPUT
from human_gait.stopping import JOB_SIGNALS, running
from human_gait.terminal import careful, say

__all__ = ["BAD_INPUT", "NO_SOLUTION", "app", "main", "run"]

app = typer.Typer(
    help="Predict human walking by optimisation, with a skeleton of 55 degrees of freedom.",
    pretty_exceptions_enable=False,
)


def show_version(wanted: bool) -> None:
    """Print the version and stop, if wanted."""
    if wanted:
        from importlib.metadata import version  # noqa: PLC0415, --help does without

        say(f"human-gait {version('human-gait')}")
        raise typer.Exit


@app.callback()
def options(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """Take the options that stand before a command."""


for one in (
    *(scenarios.init, scenarios.settings, runs.predict, runs.refine, runs.verify),
    *(views.explain, views.play, views.film, views.plot, views.compare, views.report),
    *(views.figures, files.export, files.urdf, fits.fit),
    *(studies.study, findings.study_report),
):
    app.command()(one)


def run(arguments: Sequence[str]) -> int:
    """Run one command.

    Parameters
    ----------
    arguments : sequence of str
        The command line without the name of the program; none at all asks for help.

    Returns
    -------
    int
        Exit code, as above.
    """
    whole, words = typer.main.get_command(app), list(arguments) or ["--help"]

    def typed() -> int | None:
        no_empty(words)
        return invoked(whole, words)

    with careful(), running(signals=JOB_SIGNALS):
        return exit_code(typed)


def main() -> None:
    """Run the command line of this process; handlers of signals are then put back."""
    with running(signals=JOB_SIGNALS):
        code = command.ended()
    sys.exit(code)


if __name__ == "__main__":
    command.main()
