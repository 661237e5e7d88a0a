"""Commands that show results: in words, in motion, as pictures, beside people."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from human_gait.commands.arguments import (
    ResultFolder,
    SecondResult,
    check_result,
    loaded_gait,
)
from human_gait.commands.trials import (
    Events,
    Feet,
    Forward,
    Mass,
    MoreTrials,
    NameMap,
    Side,
    Units,
    Up,
    WithTrials,
    trial_files,
)
from human_gait.results.names import COMPARISON, PLAYBACK
from human_gait.terminal import say, screen


def explain(folder: ResultFolder) -> None:
    """Tell what shapes the walk of a result, or why there is none and what to try."""
    check_result(folder)
    from human_gait.results.explanation import explained
    from human_gait.walk.belonging import own_gait
    from human_gait.walk.measured import measured_words

    shown = explained(folder, measured_words(own_gait(folder)))
    screen().print(shown, soft_wrap=isinstance(shown, str))


def play(
    folder: ResultFolder,
    second: SecondResult = None,
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
    gait = loaded_gait(folder)
    pair: dict[str, Any] = {}
    if second:
        pair = {"second": loaded_gait(second), "overlay": overlay}
    if save:
        from human_gait.playback.page import save_playback
        from human_gait.results.folder import whole_file

        with whole_file(save) as path:
            save_playback(gait, path, **pair)
        say(f"wrote {save}")
    else:
        from human_gait.playback.page import play as play_live

        play_live(gait, host=host, **pair)


def film(
    folder: ResultFolder,
    second: SecondResult = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A .gif, .mp4 or .png (phases), else walk.gif in DIR."),
    ] = None,
    view: Annotated[
        str, typer.Option(metavar="VIEW", help="From the side, the front or a quarter.")
    ] = "quarter",
    size: Annotated[
        str, typer.Option(metavar="WIDTHxHEIGHT", help="Of the film, in px.", show_default=False)
    ] = "",
) -> None:
    """Write a result as a film or a picture, without a browser or a screen."""
    both = [folder, *([second] if second else [])]
    for given in both:
        check_result(given)
    from rich.progress import Progress

    from human_gait.playback.film import film as write_film
    from human_gait.playback.film import size_named
    from human_gait.walk.described import no_walk
    from human_gait.walk.gait_file import load_gait

    pixels = size_named(size) if size else None
    terminal = screen(stderr=True)
    with Progress(console=terminal, transient=True, disable=not terminal.is_terminal) as shown:
        task = shown.add_task("drawing", total=None)

        def tell(done: int, of: int) -> None:
            shown.update(task, completed=done, total=of)

        target = write_film(folder, out, view, pixels, second, tell)
    for failed in filter(None, (no_walk(load_gait(given)) for given in both)):
        say(f"note: {failed}", error=True)
    say(f"wrote {target}")


def plot(folder: ResultFolder) -> None:
    """Draw the plots of a result again, and its animation, playback.html."""
    check_result(folder)
    from human_gait.prediction import draw

    n_plots = draw(loaded_gait(folder), folder)
    say(f"wrote {n_plots} plots and {PLAYBACK} to {folder}")


def compare(  # noqa: PLR0913, PLR0917, each is an option
    folder: ResultFolder,
    more: MoreTrials = None,
    with_: WithTrials = None,
    units: Units = None,
    up: Up = "",
    forward: Forward = "",
    map_: NameMap = None,
    events: Events = "",
    feet: Feet = None,
    mass: Mass = None,
    side: Side = "r",
) -> None:
    """Score a result against measured people, and own trials; write table and plot beside it."""
    check_result(folder)
    from human_gait.people.comparison import compare_to_folder

    trials: dict[str, Any] = {}
    if files := trial_files(more, with_):
        from human_gait.people.own import own_trials
        from human_gait.people.readings import readings_text
        from human_gait.trials.stated import stated

        given = stated(
            units=units or (),
            up=up,
            forward=forward,
            map=map_ or (),
            events=events,
            feet=feet or (),
            mass=mass,
            side=side,
        )
        trials["own"] = own_trials(files, given)
        say(readings_text(trials["own"]))
    screen().print(compare_to_folder(folder, **trials))
    say(f"wrote {', '.join(COMPARISON)} to {folder}")


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

    say(f"wrote {report_to_file(folders, out)}")


def figures(
    results: Annotated[
        Path, typer.Argument(metavar="RESULTS_DIR", help="Folder of the result folders.")
    ] = Path("out"),
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder to write to, else RESULTS_DIR/figures."),
    ] = None,
    paper: Annotated[
        bool,
        typer.Option(
            "--paper", help="Of paper-normal, ...: formulation of the study; to figures-paper."
        ),
    ] = False,
) -> None:
    """Draw figures 7 to 12 of the paper from the results of its walks."""
    from human_gait.pictures.paper_figures import PAPER, failed_results, save_figures

    prefix = PAPER if paper else ""
    folder = out or results / ("figures-paper" if paper else "figures")
    files = save_figures(results, folder, prefix)
    for failed in failed_results(results, prefix):
        say(f"note: {failed}: no walk was found, its best attempt is drawn", error=True)
    say(f"wrote {len(files)} files to {folder}")
