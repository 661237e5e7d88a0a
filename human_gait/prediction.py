"""From a scenario to a result folder: build, solve, verify, write, and tell how it goes."""

from __future__ import annotations

import json
import platform
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from human_gait.checks.check import Check
from human_gait.checks.verification import verify
from human_gait.exceptions import NoSolutionFound, ResultError
from human_gait.people.agreement import FILE as AGREEMENT
from human_gait.people.agreement import agreement_to_folder
from human_gait.problem.program import GaitProgram, build_program, refined_program
from human_gait.results import names as export_names
from human_gait.results.explanation import FILE as EXPLANATION
from human_gait.results.explanation import diagnosis_text
from human_gait.results.folder import replaced_folder, whole_file
from human_gait.scenario import Scenario
from human_gait.solving.diagnosis import check_text, not_kept, suggestions, violation_text
from human_gait.solving.shadow_prices import influences
from human_gait.solving.solver import SOLVERS, Iterate, Solution, posture
from human_gait.solving.starts import GIVEN, OWN_GUESS, WARM, Attempt, Start, best, climb
from human_gait.solving.warm_start import FILE as MULTIPLIERS
from human_gait.solving.warm_start import adapted, fitting, load_multipliers, save_multipliers
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import save_gait_cycle
from human_gait.walk.gait_file import FILE, load_gait, load_record, save_gait

SUMMARY, VERIFICATION = "summary.json", "verification.json"
_RESULT = (
    *(FILE, SUMMARY, EXPLANATION, VERIFICATION, "gait_cycle.csv", "playback.html"),
    *("compare.json", "compare.csv", "compare.png", "report.html", MULTIPLIERS),
    *("stick_diagram.png", "zmp.png"),
    *("joint_angles.png", "joint_torques.png", "ground_reaction.png"),
    *(f"{export_names.FOLDER}/{name}" for name in export_names.FILES),
)
OURS = (
    *(*_RESULT, AGREEMENT),
    *(f"{solver}/{name}" for solver in SOLVERS for name in _RESULT),
)
"""Everything that a prediction, or a command about it, writes: it goes with the old result."""
PACKAGES = ("human-gait", "drake", "daqp", "pin", "numpy", "scipy")
_LINE_EVERY = 25


def predict(
    scenario: Scenario, solver: str = "newton", dynamics: str = "pinocchio", seed: int = 0
) -> Gait:
    """Return the predicted gait of a scenario.

    Parameters
    ----------
    scenario : Scenario
    solver : str
        ``newton``, ``snopt`` or ``ipopt``.
    dynamics : str
        ``pinocchio``, or ``dh`` for the paper's own recursion.
    seed : int
        Of the random starts, where the others fail (`ladder`).

    Raises
    ------
    NoSolutionFound
        If the solver did not converge or a check fails; it carries the best gait so far and, as
        its report, the constraints that are not kept, the checks that failed and what to try.
    """
    program = build_program(scenario, dynamics=dynamics)
    kept = best(climb(program, solver, seed=seed))
    solution, checks = kept.solution, kept.checks
    if not kept.success:
        failed = [check for check in checks if not check.passed]
        broken = not_kept(scenario, solution.violations)
        raise NoSolutionFound(
            f"{solution.solver} stopped: {solution.status}",
            solution.gait,
            [*broken, *failed, *suggestions(kept.program, solution, checks)],
        )
    return solution.gait


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
    program, start = refined_program(gait, n_control_points, dynamics)
    return _solve_to_folder(program, solver, folder, Start(GIVEN, start)).success


def _warm_start(folder: Path, program: GaitProgram) -> Start:
    """Return the walk of a result as the start of a program."""
    multipliers = fitting(load_multipliers(folder), program)
    return Start(WARM, adapted(load_gait(folder), program), multipliers, alone=False)


def predict_by_all_solvers(scenario: Scenario, folder: Path, dynamics: str = "pinocchio") -> bool:
    """Solve one problem with every solver, each into a folder of its own, and compare.

    All start from the same posture path. Return whether every one found a walk. An interruption
    ends it: the solvers that are left are not run and nothing is compared. The folder gets its
    results at the end, all at once.
    """
    program = build_program(scenario, dynamics=dynamics)
    console = Console(highlight=False)
    with _progress(console) as tell:
        start = posture(program, tell(OWN_GUESS))
    found = []
    with replaced_folder(folder, OURS) as new:
        for name in SOLVERS:
            given = Start(GIVEN, start)
            kept = _solve_to_folder(program, name, new / name, given, told=folder / name)
            if kept.solution.interrupted:
                return False
            found.append(kept.success)
        console.print(agreement_to_folder(new, SOLVERS))
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
    console = Console(highlight=False)
    console.print(
        f"{program.scenario.name}: {len(program.variables)} variables, "
        f"{program.n_constraint_rows} constraints, {solver}, dynamics by {program.dynamics}"
    )
    with _progress(console) as tell:
        attempts = climb(program, solver, start, seed, tell)
    kept = _write(folder, best(attempts), attempts, seed)
    console.print(_check_table(kept.checks))
    console.print(_verdict(kept, attempts, told or folder))
    if not kept.success:
        diagnosis = _diagnosis(kept.program, kept.solution, kept.checks)
        console.print(diagnosis_text(diagnosis), soft_wrap=True, markup=False)
    return kept


def verify_folder(folder: Path) -> bool:
    """Check the gait of a result anew, from the file alone; return whether it is a walk.

    Prints the table of checks and writes it to ``verification.json``; where that cannot be written
    it warns on standard error, in one line.

    Raises
    ------
    ResultError
        If there is no gait that can be read.
    """
    record = load_record(folder)
    checks, console = verify(record), Console(highlight=False)
    console.print(_asked_for(record.gait.scenario), markup=False)
    console.print(_check_table(checks))
    found = json.dumps(_by_name(checks), indent=2)
    try:
        with whole_file(folder / VERIFICATION) as path:
            path.write_text(found + "\n", encoding="utf-8")
    except ResultError as error:
        told = Console(stderr=True, highlight=False)
        told.print(f"warning: {error}", soft_wrap=True, markup=False)
    return all(check.passed for check in checks)


def _asked_for(scenario: Scenario) -> str:
    """Return the claims that a walk is held against, in one line."""
    walk, subject, limits = scenario.walk, scenario.subject, scenario.limits
    own = [*limits.frozen, *(limited.name for limited in limits.ranges)]
    return (
        f"{scenario.name}: {walk.speed:g} m/s, step {walk.step_length:g} m; {subject.sex}, "
        f"{subject.stature:g} m, {subject.mass:g} kg, load {scenario.load.mass:g} kg; "
        f"friction {scenario.ground.friction:g}; joints with limits of their own: {len(own)}"
    )


@contextmanager
def _progress(console: Console) -> Iterator[Callable[[str], Callable[[Iterate], None]]]:
    """Yield a function that takes the name of a start and returns one that shows iterates.

    On a terminal there is one live line, else a line now and then.
    """

    def some(now: Iterate) -> None:
        if now.number % _LINE_EVERY == 1:
            console.print(_line(now), soft_wrap=True)

    def begin(start: str, show: Callable[[Iterate], None]) -> Callable[[Iterate], None]:
        if start not in (OWN_GUESS, GIVEN, WARM):
            console.print(f"no walk yet; next start: {start}")
        return show

    if not console.is_terminal:
        yield lambda start: begin(start, some)
        return
    with Live(console=console, refresh_per_second=8, transient=False) as live:
        yield lambda start: begin(start, lambda now: live.update(_line(now)))


def _line(now: Iterate) -> Text:
    worst = now.worst
    equation = f" (Eq. {worst.equation})" if worst.equation else ""
    return Text(
        f"{now.stage:>8} {now.number:5d}  {now.elapsed:6.1f} s  cost {now.cost:10.1f} N2 m2 s  "
        f"worst: {worst.name}{equation} {worst.value:.1e} {worst.unit}"
    )


def _summary(kept: Attempt, attempts: list[Attempt], seed: int) -> dict[str, Any]:
    program, solution, checks = kept.program, kept.solution, kept.checks
    scenario = program.scenario
    return {
        "success": kept.success,
        "start": kept.start,
        "seed": seed,
        "solver": solution.solver,
        "dynamics": program.dynamics,
        "solver_status": solution.status,
        "wall_time_s": sum(attempt.solution.wall_time for attempt in attempts),
        "attempts": [_attempt(attempt) for attempt in attempts],
        "iterations": solution.iterations,
        "evaluations": solution.evaluations,
        "cost": solution.cost,
        "cost_unit": "N^2 m^2 s",
        "n_variables": len(program.variables),
        "n_constraints": program.n_constraint_rows,
        "violations": {
            worst.name: {
                "what": worst.what,
                "value": worst.value,
                "unit": worst.unit,
                "time_s": worst.time,
                "equation": worst.equation,
            }
            for worst in solution.violations
        },
        "checks": _by_name(checks),
        "diagnosis": None if kept.success else _diagnosis(program, solution, checks),
        "walking_speed_m_per_s": scenario.walk.speed,
        "step_length_m": scenario.walk.step_length,
        "body_mass_kg": scenario.subject.mass,
        "load_kg": scenario.load.mass,
        "scenario": scenario.to_dict(),
        "versions": {"python": platform.python_version()}
        | {package: version(package) for package in PACKAGES},
    }


def _attempt(attempt: Attempt) -> dict[str, Any]:
    solution = attempt.solution
    return {
        "start": attempt.start,
        "solver": solution.solver,
        "solver_status": solution.status,
        "converged": solution.converged,
        "success": attempt.success,
        "failed_checks": [check.name for check in attempt.checks if not check.passed],
        "wall_time_s": solution.wall_time,
        "evaluations": solution.evaluations,
        "cost": solution.cost,
    }


def _by_name(checks: list[Check]) -> dict[str, dict[str, Any]]:
    return {check.name: {**asdict(check), "passed": check.passed} for check in checks}


def _write(folder: Path, kept: Attempt, attempts: list[Attempt], seed: int) -> Attempt:
    """Write a result; return the attempt with the checks of the file that was written."""
    from human_gait.pictures.plots import save_plots  # noqa: PLC0415, the same
    from human_gait.playback.page import save_playback  # noqa: PLC0415, half a second to import

    gait = kept.solution.gait
    with replaced_folder(folder, OURS) as new:
        save_gait(gait, new)
        save_multipliers(kept.solution.multipliers, new)
        kept = replace(kept, checks=verify(load_record(new)))
        contents = {
            SUMMARY: _summary(kept, attempts, seed),
            EXPLANATION: _explanation(kept.program, kept.solution),
        }
        for name, content in contents.items():
            (new / name).write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        save_gait_cycle(gait, new / "gait_cycle.csv")
        save_plots(gait, new)
        save_playback(gait, new / "playback.html")
    return kept


def _check_table(checks: list[Check]) -> Table:
    table = Table(box=None, padding=(0, 1, 0, 0), title="The walk, on a grid ten times finer")
    table.title_justify = "left"
    for column in ("check", "found", "limit", "unit", r"t \[s]", ""):
        side: Literal["left", "right"] = "right" if column in ("found", "limit") else "left"
        table.add_column(column, justify=side, no_wrap=True)
    for check in checks:
        found, limit, at = f"{check.value:.2g}", f"{check.limit:g}", f"{check.time:.3f}"
        table.add_row(check.name, found, limit, check.unit, at, "ok" if check.passed else "FAIL")
    return table


def _verdict(kept: Attempt, attempts: list[Attempt], folder: Path) -> str:
    solution, outcome = kept.solution, "found a walk" if kept.success else "found no walk"
    if all(check.passed for check in kept.checks) and not kept.success:
        outcome = "found a walk that is not the cheapest: it stopped before the optimum,"
    seconds = sum(attempt.solution.wall_time for attempt in attempts)
    starts = f", {len(attempts)} starts, kept: {kept.start}" if len(attempts) > 1 else ""
    return (
        f"{solution.solver} {outcome} in {seconds:.1f} s ({solution.status}{starts}); "
        f"result in {folder}"
    )


def _diagnosis(program: GaitProgram, solution: Solution, checks: list[Check]) -> dict[str, Any]:
    """Return which constraints and checks failed, when and by how much, and what to try."""
    scenario, T = program.scenario, program.basis.step_time
    broken = [violation_text(worst, T) for worst in not_kept(scenario, solution.violations)]
    failed = [check_text(check, T) for check in checks if not check.passed]
    tries = [asdict(one) for one in suggestions(program, solution, checks)]
    return {"not_kept": broken + failed, "try": tries}


def _explanation(program: GaitProgram, solution: Solution) -> dict[str, Any]:
    """Return what shapes a gait, the most costly bound first; nothing unless it converged."""
    return {
        "cost": solution.cost,
        "cost_unit": "N^2 m^2 s",
        "price_unit": "N^2 m^2 s per unit of the bound",
        "step_time_s": program.basis.step_time,
        "shapes": [one.to_dict() for one in influences(program, solution)],
    }
