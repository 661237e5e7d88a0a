"""The command ``human-gait``: predict, verify, explain, play, plot, compare, report, export ...

Exit codes: 0 done, 1 no walk (the best attempt is kept, of an interrupted solve too), 2 bad input,
a result that cannot be written or a fault of the environment, 3 what was not foreseen, 130 or 143
(128 and the number of the signal) interrupted with nothing changed. An error is one line; of a
scenario, each has one.
Solvers, plots and viewers are imported by the command that needs them: ``--help`` stays quick.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer

from human_gait import command
from human_gait.arguments import (
    DynamicsName,
    Engine,
    FormatName,
    ResultFolder,
    ScenarioFile,
    SolverChoice,
    SolverName,
    TimeLimit,
    beside,
    check_result,
    check_writable,
    format_named,
    no_empty,
    seed_number,
    whole_number,
)
from human_gait.exceptions import GaitError, ScenarioError
from human_gait.exits import NO_SOLUTION, exit_code
from human_gait.faults import BAD_INPUT
from human_gait.results.folder import whole_file
from human_gait.results.names import COMPARISON, EXPORT, PLAYBACK, ROBOT
from human_gait.results.ours import check_free
from human_gait.scenario import load_scenario, scenario_file
from human_gait.stopping import JOB_SIGNALS, TIME_LIMIT, running
from human_gait.terminal import careful, screen

__all__ = ["BAD_INPUT", "NO_SOLUTION", "app", "main", "run"]

app = typer.Typer(
    help="Predict human walking by optimisation, with a skeleton of 55 degrees of freedom.",
    pretty_exceptions_enable=False,
)


_COMPLETION = "_HUMAN_GAIT_COMPLETE"


def show_version(wanted: bool) -> None:
    """Print the version and stop, if wanted."""
    if wanted:
        typer.echo(f"human-gait {version('human-gait')}")
        raise typer.Exit


@app.callback()
def options(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """Take the options that stand before a command."""


@app.command()
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

    typer.echo(f"wrote {write_scenario(name, out, template, force)}")


@app.command()
def settings(
    key: Annotated[str, typer.Argument(metavar="[KEY]", help="A setting or a section.")] = "",
    json_schema: Annotated[
        bool, typer.Option("--json-schema", help="Print the JSON schema, for editors.")
    ] = False,
) -> None:
    """List the settings of a scenario, or explain one: walk.speed, or all of a section: walk."""
    from human_gait.settings import explanation, listing, schema_text

    shown = explanation(key) if key else listing()
    typer.echo(schema_text() if json_schema else shown, nl=not json_schema)


@app.command()
def predict(
    scenario: ScenarioFile,
    solver: Annotated[
        SolverChoice, typer.Option(help="Optimiser; all compares them.")
    ] = SolverChoice.NEWTON,
    dynamics: Engine = DynamicsName.PINOCCHIO,
    seed: Annotated[
        int,
        typer.Option(
            parser=seed_number,
            metavar="N",
            help="Which random starts to try where the usual ones fail; no matter with all.",
        ),
    ] = 0,
    warm_from: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Start from the walk of another result.")
    ] = None,
    time_limit: TimeLimit = TIME_LIMIT,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Result folder, else out/<scenario>.")
    ] = None,
) -> None:
    """Predict the walk of a scenario and write the result."""
    task, file = load_scenario(scenario), scenario_file(scenario)
    if file != scenario:
        typer.echo(f"scenario: {file}")
    if warm_from:
        if solver is SolverChoice.ALL:
            raise typer.BadParameter(
                "not with --solver all: give one solver", param_hint="--warm-from"
            )
        check_result(warm_from)
    folder = out or Path("out") / task.name
    check_writable(folder, by_all=solver is SolverChoice.ALL)
    try:
        if solver is SolverChoice.ALL:
            from human_gait.prediction import predict_by_all_solvers

            found = predict_by_all_solvers(task, folder, dynamics.value, time_limit)
        else:
            from human_gait.prediction import predict_to_folder

            found = predict_to_folder(
                task, solver.value, folder, dynamics.value, seed, warm_from, time_limit
            )
    except ScenarioError as error:
        raise error.found_in(str(file)) from None
    if not found:
        raise typer.Exit(NO_SOLUTION)


@app.command()
def refine(
    folder: ResultFolder,
    control_points: Annotated[
        int | None,
        typer.Option(
            parser=whole_number,
            metavar="N",
            help="Control points per DOF, else two more.",
        ),
    ] = None,
    solver: Annotated[SolverName, typer.Option(help="Optimiser.")] = SolverName.NEWTON,
    dynamics: Engine = DynamicsName.PINOCCHIO,
    time_limit: TimeLimit = TIME_LIMIT,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Result folder, else DIR-refined.")
    ] = None,
) -> None:
    """Insert knots into a result, which leaves the motion as it is, and solve again from there."""
    check_result(folder)
    target = out or beside(folder, "-refined")
    check_writable(target)
    from human_gait.prediction import refine_to_folder
    from human_gait.walk.gait_file import load_gait

    gait = load_gait(folder)
    n = gait.basis.n_control_points + 2 if control_points is None else control_points
    if not refine_to_folder(gait, n, solver.value, target, dynamics.value, time_limit):
        raise typer.Exit(NO_SOLUTION)


@app.command()
def verify(folder: ResultFolder) -> None:
    """Check from its file alone whether a result is a walk: exit code 0, else 1.

    The table goes to verification.json, too; a folder that cannot be written is a warning.
    """
    check_result(folder)
    from human_gait.prediction import verify_folder

    if not verify_folder(folder):
        raise typer.Exit(NO_SOLUTION)


@app.command()
def explain(folder: ResultFolder) -> None:
    """Tell what shapes the walk of a result, or why there is none and what to try."""
    check_result(folder)
    from human_gait.results.explanation import explained
    from human_gait.walk.belonging import own_gait

    own_gait(folder)
    shown = explained(folder)
    screen().print(shown, soft_wrap=isinstance(shown, str))


def _loaded(folder: Path) -> Any:
    """Return the gait of a result; where that is no walk, a note says so."""
    from human_gait.walk.described import no_walk
    from human_gait.walk.gait_file import load_gait

    gait = load_gait(folder)
    if why := no_walk(gait):
        typer.echo(f"note: {folder}: {why}", err=True)
    return gait


@app.command()
def play(
    folder: ResultFolder,
    second: Annotated[
        Path | None, typer.Argument(metavar="[DIR2]", help="A result to show beside it.")
    ] = None,
    overlay: Annotated[
        bool, typer.Option("--overlay", help="In one place: DIR solid, DIR2 translucent.")
    ] = False,
    save: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the page there instead, HTML.")
    ] = None,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Listen there; else this computer alone.")
    ] = "127.0.0.1",
) -> None:
    """Show a result in the browser, walking endlessly, or two at the same phase of the stride."""
    check_result(folder)
    if second:
        check_result(second)
    elif overlay:
        raise typer.BadParameter("needs a second result, DIR2", param_hint="--overlay")
    gait = _loaded(folder)
    pair: dict[str, Any] = {}
    if second:
        pair = {"second": _loaded(second), "overlay": overlay}
    if save:
        from human_gait.playback.page import save_playback

        with whole_file(save) as path:
            save_playback(gait, path, **pair)
        typer.echo(f"wrote {save}")
    else:
        from human_gait.playback.page import play as play_live

        play_live(gait, host=host, **pair)


@app.command()
def film(
    folder: ResultFolder,
    second: Annotated[
        Path | None, typer.Argument(metavar="[DIR2]", help="A result to show beside it.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A .gif, .mp4 or .png (phases), else walk.gif in DIR."),
    ] = None,
    view: Annotated[
        str, typer.Option(metavar="VIEW", help="From the side, the front or a quarter.")
    ] = "quarter",
    size: Annotated[
        str, typer.Option(metavar="WIDTHxHEIGHT", help="Of the film, [px].", show_default=False)
    ] = "",
) -> None:
    """Write a result as a film or a picture, without a browser or a screen."""
    both = [folder, *([second] if second else [])]
    for given in both:
        check_result(given)
    from rich.console import Console
    from rich.progress import Progress

    from human_gait.playback.film import film as write_film
    from human_gait.playback.film import size_named
    from human_gait.walk.described import no_walk
    from human_gait.walk.gait_file import load_gait

    pixels = size_named(size) if size else None
    terminal = Console(stderr=True)
    with Progress(console=terminal, transient=True, disable=not terminal.is_terminal) as shown:
        task = shown.add_task("drawing", total=None)

        def tell(done: int, of: int) -> None:
            shown.update(task, completed=done, total=of)

        target = write_film(folder, out, view, pixels, second, tell)
    for failed in filter(None, (no_walk(load_gait(given)) for given in both)):
        typer.echo(f"note: {failed}", err=True)
    typer.echo(f"wrote {target}")


@app.command()
def plot(folder: ResultFolder) -> None:
    """Draw the plots of a result again, and its animation, playback.html."""
    check_result(folder)
    from human_gait.prediction import draw

    n_plots = draw(_loaded(folder), folder)
    typer.echo(f"wrote {n_plots} plots and {PLAYBACK} to {folder}")


@app.command()
def compare(folder: ResultFolder) -> None:
    """Score a result against measured people; write table and plot beside it."""
    check_result(folder)
    from human_gait.people.comparison import compare_to_folder

    screen().print(compare_to_folder(folder))
    typer.echo(f"wrote {', '.join(COMPARISON)} to {folder}")


@app.command()
def report(
    folders: Annotated[
        list[Path], typer.Argument(metavar="DIR", help="Folders of results, in their order.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Page, else report.html in DIR, or in out for several."),
    ] = None,
) -> None:
    """Write one page about a result, or about several side by side: figures, tables, checks."""
    for folder in folders:
        check_result(folder)
    from human_gait.reporting.page import report_to_file

    typer.echo(f"wrote {report_to_file(folders, out)}")


@app.command()
def figures(
    results: Annotated[
        Path, typer.Argument(metavar="RESULTS_DIR", help="Folder of the result folders.")
    ] = Path("out"),
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder to write to, else RESULTS_DIR/figures."),
    ] = None,
) -> None:
    """Draw figures 7 to 12 of the paper from the results of its walks."""
    from human_gait.pictures.paper_figures import failed_results, save_figures

    folder = out or results / "figures"
    files = save_figures(results, folder)
    for failed in failed_results(results):
        typer.echo(f"note: {failed}: no walk was found, its best attempt is drawn", err=True)
    typer.echo(f"wrote {len(files)} files to {folder}")


@app.command()
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
    files = export_gait(_loaded(folder), target, names, rate)
    typer.echo(f"wrote {len(files)} files to {target}")


@app.command()
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

    target = out or Path("urdf") / ROBOT
    if out is None:
        check_free(target.parent, [target.name])
    text = scenario_robot(load_scenario(scenario) if scenario else None)
    with whole_file(target) as path:
        path.write_text(text, encoding="utf-8")
    typer.echo(f"wrote {target}")


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
    whole = typer.main.get_command(app)
    words = list(arguments) or ["--help"]

    def invoked() -> int | None:
        no_empty(words)
        try:
            context = whole.make_context("human-gait", words)
        except SystemExit as end:  # Typer's own, of completion
            return int(end.code or 0)
        with context:
            whole.invoke(context)
        return None

    if _COMPLETION in os.environ:  # a shell asks what could follow
        whole.main(words, "human-gait", complete_var=_COMPLETION)
    with careful(), running(signals=JOB_SIGNALS):
        return exit_code(invoked)


def main() -> None:
    """Run the command line of this process; handlers of signals are then put back."""
    with running(signals=JOB_SIGNALS):
        code = command.ended()
    sys.exit(code)


if __name__ == "__main__":
    command.main()
