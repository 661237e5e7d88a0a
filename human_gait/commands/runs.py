"""Commands that solve, and the one that checks what was found."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from human_gait.commands.arguments import (
    DynamicsName,
    Engine,
    NoPlots,
    ResultFolder,
    ScenarioFile,
    SolverChoice,
    SolverName,
    TimeLimit,
    beside,
    check_result,
    check_writable,
    seed_number,
    starts_number,
    whole_number,
)
from human_gait.commands.exits import NO_SOLUTION
from human_gait.exceptions import ScenarioError
from human_gait.stopping import TIME_LIMIT
from human_gait.terminal import say

if TYPE_CHECKING:
    from human_gait.problem.tracking import Tracking


def predict(  # noqa: PLR0913
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
    starts: Annotated[
        int,
        typer.Option(
            parser=starts_number,
            metavar="N",
            help="Solve from N starts instead of one, and keep the cheapest walk.",
        ),
    ] = 1,
    time_limit: TimeLimit = TIME_LIMIT,
    *,
    guess: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Begin with the motion of a result, measured or not."),
    ] = None,
    track: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Follow the joint angles of a result; with a weight."),
    ] = None,
    track_weight: Annotated[
        float | None,
        typer.Option(metavar="W", help="Of the squared angles, N^2 m^2/rad^2: 1e4 is a start."),
    ] = None,
    no_plots: NoPlots = False,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Result folder, else out/<scenario>.")
    ] = None,
) -> None:
    """Predict the walk of a scenario and write the result."""
    from human_gait.scenario import load_scenario, scenario_file

    task, file = load_scenario(scenario), scenario_file(scenario)
    if file != scenario:
        say(f"scenario: {file}")
    given = {"--warm-from": warm_from, "--guess": guess, "--track": track}
    _check_given(given, {"--starts": starts > 1, **given} if solver is SolverChoice.ALL else {})
    tracking = _tracking(track, track_weight)
    folder, plots = out or Path("out") / task.name, not no_plots
    check_writable(folder, by_all=solver is SolverChoice.ALL)
    try:
        if solver is SolverChoice.ALL:
            from human_gait.prediction import predict_by_all_solvers

            found = predict_by_all_solvers(task, folder, dynamics.value, time_limit, plots=plots)
        else:
            from human_gait.prediction import predict_to_folder

            found = predict_to_folder(
                task,
                solver.value,
                folder,
                dynamics.value,
                seed,
                warm_from,
                time_limit,
                starts=starts,
                guess=guess,
                track=tracking,
                plots=plots,
            )
    except ScenarioError as error:
        raise error.found_in(str(file)) from None
    if not found:
        raise typer.Exit(NO_SOLUTION)


def _check_given(results: Mapping[str, Path | None], alone: Mapping[str, object]) -> None:
    """Refuse results that are none, two to begin with, and what is for one solver alone."""
    for option in (option for option, value in alone.items() if value):
        raise typer.BadParameter("not with --solver all: give one solver", param_hint=option)
    if results["--warm-from"] and results["--guess"]:
        raise typer.BadParameter("not with --warm-from: a guess is another", param_hint="--guess")
    for folder in filter(None, results.values()):
        check_result(folder)


def _tracking(track: Path | None, weight: float | None) -> Tracking | None:
    """Return what is to be followed, if anything is."""
    if track is None and weight is None:
        return None
    if track is None:
        raise typer.BadParameter("needs a result, --track DIR", param_hint="--track-weight")
    if weight is None:
        raise typer.BadParameter("needs a weight, --track-weight 1e4", param_hint="--track")
    from human_gait.problem.tracking import Tracking
    from human_gait.walk.gait_file import load_gait

    try:
        return Tracking(load_gait(track), weight)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--track-weight") from None


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
    no_plots: NoPlots = False,
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
    given = solver.value, target, dynamics.value, time_limit
    if not refine_to_folder(gait, n, *given, plots=not no_plots):
        raise typer.Exit(NO_SOLUTION)


def verify(folder: ResultFolder) -> None:
    """Check from its file alone whether a result is a walk: exit code 0, else 1.

    The table goes to verification.json, too; a folder that cannot be written is a warning.
    """
    check_result(folder)
    from human_gait.prediction import verify_folder

    if not verify_folder(folder):
        raise typer.Exit(NO_SOLUTION)
