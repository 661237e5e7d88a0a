"""From a scenario to a result folder: build, solve, verify, write.

What was solved is written first and at once, `gait.npz` with its summary, and told. Pictures
follow, and so does the import of what draws them: what goes wrong there is a warning, and a signal
ends them alone. From the beginning of a solve on, a signal is no reason to end without a result
(`stopping`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from human_gait import console
from human_gait.arrays import FloatArray
from human_gait.checks.folder import folder_check
from human_gait.checks.verification import verify
from human_gait.exceptions import ResultError
from human_gait.faults import check_packages, told_of
from human_gait.late import late
from human_gait.problem.program import GaitProgram, build_program
from human_gait.problem.refinement import refined_program
from human_gait.problem.tracking import Tracking
from human_gait.results.folder import whole_file
from human_gait.results.names import (
    AGREEMENT,
    EXPLANATION,
    GAIT_CYCLE,
    PLAYBACK,
    PLOTS,
    SUMMARY,
    VERIFICATION,
    result_files,
)
from human_gait.results.ours import check_free, our_folder
from human_gait.results.reading import AGAIN
from human_gait.results.sealed import write_json
from human_gait.results.unfinished import refuges
from human_gait.scenario import Scenario
from human_gait.solving.drake_solvers import SOLVERS
from human_gait.solving.solver import posture
from human_gait.solving.starts import (
    GIVEN,
    OWN_GUESS,
    Attempt,
    Start,
    best,
    climb,
    from_walk,
    guess_of,
)
from human_gait.solving.summary import (
    checks_content,
    explanation_content,
    save_found,
    summary_content,
)
from human_gait.solving.warm_start import load_multipliers, save_multipliers
from human_gait.stopping import TIME_LIMIT, running, under_way
from human_gait.walk.described import gait_digest, no_walk
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import save_gait_cycle
from human_gait.walk.gait_file import load_gait, load_record

if TYPE_CHECKING:
    from rich.table import Table

_DRAWN_WITH = ("matplotlib", "meshcat")
OURS = result_files(SOLVERS)
"""Everything that a prediction, or a command about it, writes: it goes with the old result."""


def predict_to_folder(  # noqa: PLR0913
    scenario: Scenario,
    solver: str,
    folder: Path,
    dynamics: str = "pinocchio",
    seed: int = 0,
    warm_from: Path | None = None,
    time_limit: float | None = TIME_LIMIT,
    *,
    starts: int = 1,
    guess: Path | None = None,
    track: Tracking | None = None,
    plots: bool = True,
) -> bool:
    """Predict, verify and write a result, then draw it; return whether it is a walk.

    A solve that fails, is interrupted or has no time left (limit in s) leaves its best gait and
    says what is wrong with it. With `warm_from`, the folder of another result, it starts from that
    walk and its multipliers, and if that leads nowhere, as ever. With `guess` its motion is that of
    a result, a walk or not, instead of the own guess; `track` is followed. Of several `starts` the
    cheapest walk is kept. Without `plots` nothing is drawn.

    Raises
    ------
    ResultError
        If there is no gait to start from, or its multipliers cannot be read; if the result cannot
        be written to the folder.
    KeyboardInterrupt
        If it is interrupted before there is anything to keep.
    """
    check_packages(_DRAWN_WITH if plots else ())
    with running(time_limit):
        program = build_program(scenario, dynamics=dynamics, costs=[track] if track else [])
        start = _warm_start(warm_from, program) if warm_from else None
        free = guess_of(load_gait(guess), program) if guess else None
        kept = _solve_to_folder(
            program, solver, folder, start, seed, guess=free, starts=starts, plots=plots
        )
        return kept.success


def refine_to_folder(
    gait: Gait,
    n_control_points: int,
    solver: str,
    folder: Path,
    dynamics: str = "pinocchio",
    time_limit: float | None = TIME_LIMIT,
    *,
    plots: bool = True,
) -> bool:
    """Give a gait more control points, solve again from there, and write the new result.

    It ends as `predict_to_folder` does.

    Raises
    ------
    ScenarioError
        If the gait has as many control points, or more.
    """
    _warn_of(gait)
    check_packages(_DRAWN_WITH if plots else ())
    with running(time_limit):
        program, start = refined_program(gait, n_control_points, dynamics)
        return _solve_to_folder(program, solver, folder, Start(GIVEN, start), plots=plots).success


def _warm_start(folder: Path, program: GaitProgram) -> Start:
    """Return the walk of a result as the start of a program."""
    gait = load_gait(folder)
    _warn_of(gait)
    return from_walk(replace(gait, multipliers=load_multipliers(gait, folder)), program)


def _warn_of(start: Gait) -> None:
    """Say that what is started from is no walk, if it is none."""
    if why := no_walk(start):
        console.warn(f"{start.scenario.name}: {why} It is started from all the same.")


def predict_by_all_solvers(
    scenario: Scenario,
    folder: Path,
    dynamics: str = "pinocchio",
    time_limit: float | None = TIME_LIMIT,
    *,
    plots: bool = True,
) -> bool:
    """Solve one problem with every solver, each into a folder of its own, and compare.

    All start from the same posture path. Return whether every one found a walk. Each solver may
    take all of the time limit [s], and so may the posture path. An interruption ends it: the
    solvers that are left are not run and nothing is compared. The folder gets its results at the
    end, all at once.
    """
    solved: dict[str, list[Attempt]] = {}
    check_packages(_DRAWN_WITH if plots else ())
    with running() as run:
        program = build_program(scenario, dynamics=dynamics)
        with console.progress() as tell, running(time_limit):
            start = posture(program, tell(OWN_GUESS))
        with _kept_elsewhere(folder, solved), our_folder(folder, OURS) as new:
            for name in SOLVERS:
                given = Start(GIVEN, start)
                with running(time_limit):
                    kept = _solve_to_folder(
                        program, name, new / name, given, told=folder / name, plots=plots
                    )
                solved[name] = [kept]
                if run.asked.signal and name != SOLVERS[-1]:
                    return False
            with _not_needed(new / AGREEMENT, AGAIN):
                console.show(_compared(new))
    return all(kept.success for (kept,) in solved.values())


def _compared(folder: Path) -> Table:
    """Write how far the results of the solvers differ, and return it as a table."""
    table: Table = late("reporting.agreement", "agreement_to_folder")(folder, SOLVERS)
    return table


def _solve_to_folder(  # noqa: PLR0913, options that are given by name
    program: GaitProgram,
    solver: str,
    folder: Path,
    start: Start | None = None,
    seed: int = 0,
    *,
    told: Path | None = None,
    guess: FloatArray | None = None,
    starts: int = 1,
    plots: bool = True,
) -> Attempt:
    """Solve, verify, write, tell and, with `plots`, draw; return the attempt that was kept.

    `told` is what the user is told instead of the folder, if that is not its last name.
    """
    console.show_task(program, solver)
    asked = under_way().asked
    asked.hold()
    with console.progress() as tell:
        attempts = climb(program, solver, start, seed, tell, guess, starts=starts)
    before, kept = asked.times, best(attempts)
    with _kept_elsewhere(told or folder, {"": attempts}, seed):
        gait = _write(folder, kept, attempts, seed)
    console.show_outcome(kept, attempts, told or folder, gait)
    if plots:
        _draw(gait, folder, told or folder, hurry=asked.times > before)
    return kept


@contextmanager
def _kept_elsewhere(
    folder: Path, solved: Mapping[str, list[Attempt]], seed: int = 0
) -> Iterator[None]:
    """Write what was solved to another place if it cannot be written where it should be.

    Parameters
    ----------
    folder : Path
    solved : mapping of str to list of Attempt
        By the name of the folder within, empty for the folder itself.
    seed : int
    """
    try:
        yield
    except ResultError as error:
        other = _elsewhere(folder.name, solved, seed) if solved else None
        if other is None:
            raise
        why = getattr(error.__cause__, "strerror", None) or error
        message = f"{folder}: the result cannot be written here: {why}; it is in {other}"
        raise ResultError(message) from error


def _elsewhere(name: str, solved: Mapping[str, list[Attempt]], seed: int) -> Path | None:
    """Write what was solved wherever there is room, and return where."""
    for other in refuges(name):
        with suppress(ResultError):
            for inner, attempts in solved.items():
                kept = best(attempts)
                gait = _write(other / inner, kept, attempts, seed)
                console.show_outcome(kept, attempts, other / inner, gait)
            return other
    return None


def verify_folder(folder: Path) -> bool:
    """Check the gait of a result anew, from the file alone; return whether it is a walk.

    The other files of the folder have to belong to it; those that do not are named.
    Prints the table of checks and writes it to ``verification.json``; where that cannot be written
    it warns on standard error, in one line.

    Raises
    ------
    ResultError
        If there is no gait that can be read.
    """
    record = load_record(folder)
    checks = [*verify(record), folder_check(record.gait, folder)]
    console.show_checks(record, checks)
    try:
        check_free(folder, [VERIFICATION])
        with whole_file(folder / VERIFICATION) as path:
            write_json(path, checks_content(checks), gait_digest(record.gait))
    except ResultError as error:
        console.warn(error)
    return all(check.passed for check in checks)


def _write(folder: Path, kept: Attempt, attempts: list[Attempt], seed: int) -> Gait:
    """Write what was solved; return the gait of the attempt that is kept."""
    with our_folder(folder, OURS) as new:
        gait = save_found(kept, seed, new)
        save_multipliers(gait, new)
        run, digest = under_way(), gait_digest(gait)
        cut_short = not kept.success or len(attempts) > 1
        ended = {"time_limit_s": run.limit, "ended_by": (run.over or None) if cut_short else None}
        write_json(new / SUMMARY, summary_content(kept, attempts, seed, gait) | ended, digest)
        with _not_needed(new / EXPLANATION, AGAIN):
            write_json(new / EXPLANATION, explanation_content(kept.program, kept.solution), digest)
        with _not_needed(new / GAIT_CYCLE, AGAIN):
            save_gait_cycle(gait, new / GAIT_CYCLE)
    return gait


def draw(gait: Gait, folder: Path) -> int:
    """Write what is drawn of a gait into its folder, all or none. Count plots."""
    check_free(folder, (*PLOTS, PLAYBACK))
    with our_folder(folder, solved=False) as new:
        for make in _DRAWN.values():
            make(gait, new)
    return len(late("pictures.plots", "PLOTS"))


def _save_plots(gait: Gait, folder: Path) -> None:
    late("pictures.plots", "save_plots")(gait, folder)


def _save_page(gait: Gait, folder: Path) -> None:
    with whole_file(folder / PLAYBACK) as path:
        late("playback.page", "save_playback")(gait, path)


_DRAWN: Mapping[str, Callable[[Gait, Path], None]] = {"plots": _save_plots, PLAYBACK: _save_page}
"""What there is to draw, and what imports what draws it, 0.3 s each."""


def _draw(gait: Gait, folder: Path, told: Path, hurry: bool) -> None:
    """Draw what can be drawn; what cannot is a warning, and a signal ends it.

    `hurry` if there was one since the solve: nothing is drawn then.
    """
    later = f"human-gait plot {told} makes them"
    try:
        with under_way().asked.heeded():
            for what, make in () if hurry else _DRAWN.items():
                with _not_needed(what, later):
                    make(gait, folder)
    except KeyboardInterrupt:
        hurry = True
    if hurry:
        console.warn(f"plots and {PLAYBACK} are left out, interrupted: {later}")


@contextmanager
def _not_needed(what: str | Path, later: str) -> Iterator[None]:
    """Make a warning of whatever goes wrong: the walk is more than what is made of it.

    `what` is a file that would then be half written, or what else is not there.
    """
    try:
        yield
    except Exception as error:  # noqa: BLE001, of whatever kind
        if isinstance(what, Path):
            what.unlink(missing_ok=True)
            what = what.name
        console.warn(f"no {what}: {told_of(error)}: {later}")
