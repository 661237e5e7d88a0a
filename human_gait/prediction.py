"""From a scenario to a result folder: build, solve, verify, write."""

from __future__ import annotations

from pathlib import Path

from human_gait import console
from human_gait.checks.folder import folder_checks
from human_gait.checks.verification import verify
from human_gait.exceptions import ResultError
from human_gait.problem.program import GaitProgram, build_program
from human_gait.problem.refinement import refined_program
from human_gait.reporting.agreement import agreement_to_folder
from human_gait.results.folder import replaced_folder, whole_file
from human_gait.results.names import (
    EXPLANATION,
    GAIT_CYCLE,
    PLAYBACK,
    SUMMARY,
    VERIFICATION,
    result_files,
)
from human_gait.results.sealed import write_json
from human_gait.scenario import Scenario
from human_gait.solving.drake_solvers import SOLVERS
from human_gait.solving.solver import posture
from human_gait.solving.starts import GIVEN, OWN_GUESS, WARM, Attempt, Start, best, climb
from human_gait.solving.summary import (
    checks_content,
    explanation_content,
    save_verified,
    summary_content,
)
from human_gait.solving.warm_start import adapted, fitting, load_multipliers, save_multipliers
from human_gait.walk.described import gait_digest, no_walk
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import save_gait_cycle
from human_gait.walk.gait_file import load_gait, load_record

OURS = result_files(SOLVERS)
"""Everything that a prediction, or a command about it, writes: it goes with the old result."""


def predict_to_folder(
    scenario: Scenario,
    solver: str,
    folder: Path,
    dynamics: str = "pinocchio",
    seed: int = 0,
    warm_from: Path | None = None,
) -> bool:
    """Predict, verify and write a result; return whether it is a walk.

    A solve that fails or is interrupted leaves its best gait and says what is wrong with it. With
    `warm_from`, the folder of another result, it starts from that walk and its multipliers, and if
    that leads nowhere, as ever.

    Raises
    ------
    ResultError
        If there is no gait to start from, or its multipliers cannot be read.
    """
    program = build_program(scenario, dynamics=dynamics)
    start = _warm_start(warm_from, program) if warm_from else None
    return _solve_to_folder(program, solver, folder, start, seed).success


def refine_to_folder(
    gait: Gait, n_control_points: int, solver: str, folder: Path, dynamics: str = "pinocchio"
) -> bool:
    """Give a gait more control points, solve again from there, and write the new result.

    Raises
    ------
    ScenarioError
        If the gait has as many control points, or more.
    """
    _warn_of(gait)
    program, start = refined_program(gait, n_control_points, dynamics)
    return _solve_to_folder(program, solver, folder, Start(GIVEN, start)).success


def _warm_start(folder: Path, program: GaitProgram) -> Start:
    """Return the walk of a result as the start of a program."""
    gait = load_gait(folder)
    _warn_of(gait)
    multipliers = fitting(load_multipliers(gait, folder), program)
    return Start(WARM, adapted(gait, program), multipliers, alone=False)


def _warn_of(start: Gait) -> None:
    """Say that what is started from is no walk, if it is none."""
    if why := no_walk(start):
        console.warn(f"{start.scenario.name}: {why} It is started from all the same.")


def predict_by_all_solvers(scenario: Scenario, folder: Path, dynamics: str = "pinocchio") -> bool:
    """Solve one problem with every solver, each into a folder of its own, and compare.

    All start from the same posture path. Return whether every one found a walk. An interruption
    ends it: the solvers that are left are not run and nothing is compared. The folder gets its
    results at the end, all at once.
    """
    program = build_program(scenario, dynamics=dynamics)
    with console.progress() as tell:
        start = posture(program, tell(OWN_GUESS))
    found = []
    with replaced_folder(folder, OURS) as new:
        for name in SOLVERS:
            given = Start(GIVEN, start)
            kept = _solve_to_folder(program, name, new / name, given, told=folder / name)
            if kept.solution.interrupted:
                return False
            found.append(kept.success)
        console.show(agreement_to_folder(new, SOLVERS))
    return all(found)


def _solve_to_folder(
    program: GaitProgram,
    solver: str,
    folder: Path,
    start: Start | None = None,
    seed: int = 0,
    told: Path | None = None,
) -> Attempt:
    """Solve, verify, write and tell; return the attempt that was kept.

    `told` is what the user is told instead of the folder, if that is not its last name.
    """
    console.show_task(program, solver)
    with console.progress() as tell:
        attempts = climb(program, solver, start, seed, tell)
    kept = _write(folder, best(attempts), attempts, seed)
    console.show_outcome(kept, attempts, told or folder)
    return kept


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
    files, wrong = folder_checks(record.gait, folder)
    checks = [*verify(record), *files]
    console.show_checks(record.gait.scenario, checks)
    for one in wrong:
        console.tell(one)
    try:
        with whole_file(folder / VERIFICATION) as path:
            write_json(path, checks_content(checks), gait_digest(record.gait))
    except ResultError as error:
        console.warn(error)
    return all(check.passed for check in checks)


def _write(folder: Path, kept: Attempt, attempts: list[Attempt], seed: int) -> Attempt:
    """Write a result; return the attempt with the checks of the file that was written."""
    from human_gait.pictures.plots import save_plots  # noqa: PLC0415, the same
    from human_gait.playback.page import save_playback  # noqa: PLC0415, half a second to import

    with replaced_folder(folder, OURS) as new:
        kept, gait = save_verified(kept, seed, new)
        save_multipliers(gait, new)
        contents = {
            SUMMARY: summary_content(kept, attempts, seed),
            EXPLANATION: explanation_content(kept.program, kept.solution),
        }
        for name, content in contents.items():
            write_json(new / name, content, gait_digest(gait))
        save_gait_cycle(gait, new / GAIT_CYCLE)
        save_plots(gait, new)
        save_playback(gait, new / PLAYBACK)
    return kept
