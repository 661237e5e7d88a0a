"""From a scenario to a result folder: build, solve, verify, write, and tell how it goes."""

from __future__ import annotations

import json
import platform
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from human_gait.agreement import agreement_to_folder
from human_gait.exceptions import NoSolutionFound
from human_gait.gait import Gait
from human_gait.gait_cycle import save_gait_cycle
from human_gait.gait_file import load_record, make_record, save_gait
from human_gait.program import GaitProgram, build_program, refined_program
from human_gait.scenario import Scenario
from human_gait.solver import FEASIBLE, SOLVERS, Iterate, Solution, posture, solve
from human_gait.verification import Check, verify

FloatArray = npt.NDArray[np.float64]

SUMMARY, VERIFICATION = "summary.json", "verification.json"
PACKAGES = ("human-gait", "drake", "pin", "numpy", "scipy")
_LINE_EVERY = 25


def predict(scenario: Scenario, solver: str = "snopt", dynamics: str = "pinocchio") -> Gait:
    """Return the predicted gait of a scenario.

    Parameters
    ----------
    scenario : Scenario
    solver : str
        ``snopt`` or ``ipopt``.
    dynamics : str
        ``pinocchio``, or ``dh`` for the paper's own recursion.

    Raises
    ------
    NoSolutionFound
        If the solver did not converge or a check fails; it carries the best gait so far, the
        constraints that are not kept and the checks that failed.
    """
    solution = solve(build_program(scenario, dynamics=dynamics), solver)
    failed = [check for check in verify(make_record(solution.gait)) if not check.passed]
    if not solution.converged or failed:
        raise NoSolutionFound(
            f"{solution.solver} stopped: {solution.status}",
            solution.gait,
            [*(worst for worst in solution.violations if worst.value > FEASIBLE), *failed],
        )
    return solution.gait


def predict_to_folder(
    scenario: Scenario, solver: str, folder: Path, dynamics: str = "pinocchio"
) -> bool:
    """Predict, verify and write a result; return whether it is a walk.

    A solve that fails or is interrupted leaves its best gait and says what is wrong with it.
    """
    return _solve_to_folder(build_program(scenario, dynamics=dynamics), solver, folder)[0]


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
    return _solve_to_folder(program, solver, folder, start)[0]


def predict_by_all_solvers(scenario: Scenario, folder: Path, dynamics: str = "pinocchio") -> bool:
    """Solve one problem with every solver, each into a folder of its own, and compare.

    All start from the same posture path. Return whether every one found a walk. An interruption
    ends it: the solvers that are left are not run and nothing is compared.
    """
    program = build_program(scenario, dynamics=dynamics)
    console = Console(highlight=False)
    with _progress(console) as tell:
        start = posture(program, tell)
    found = []
    for name in SOLVERS:
        success, solution = _solve_to_folder(program, name, folder / name, start)
        if solution.interrupted:
            return False
        found.append(success)
    console.print(agreement_to_folder(folder, SOLVERS))
    return all(found)


def _solve_to_folder(
    program: GaitProgram, solver: str, folder: Path, start: FloatArray | None = None
) -> tuple[bool, Solution]:
    """Solve, verify, write and tell; return whether the result is a walk, and the solution."""
    console = Console(highlight=False)
    console.print(
        f"{program.scenario.name}: {len(program.variables)} variables, "
        f"{program.n_constraint_rows} constraints, {solver}, dynamics by {program.dynamics}"
    )
    with _progress(console) as tell:
        solution = solve(program, solver, start, tell)
    checks = verify(make_record(solution.gait))
    success = solution.converged and all(check.passed for check in checks)
    summary = _summary(program, solution, checks, success)
    _write(folder, solution.gait, summary)
    console.print(_check_table(checks))
    console.print(_verdict(solution, success, folder))
    if not success:
        console.print(_failures(solution, checks))
    return success, solution


def verify_folder(folder: Path) -> bool:
    """Check the gait of a result anew, from the file alone; return whether it is a walk.

    Prints the table of checks and writes it to ``verification.json``.

    Raises
    ------
    ResultError
        If there is no gait that can be read.
    """
    checks = verify(load_record(folder))
    found = json.dumps(_by_name(checks), indent=2)
    (folder / VERIFICATION).write_text(found + "\n", encoding="utf-8")
    Console(highlight=False).print(_check_table(checks))
    return all(check.passed for check in checks)


@contextmanager
def _progress(console: Console) -> Iterator[Any]:
    """Yield a function that shows iterates: a live line on a terminal, else a line now and then."""
    if not console.is_terminal:

        def tell(now: Iterate) -> None:
            if now.number % _LINE_EVERY == 1:
                console.print(_line(now), soft_wrap=True)

        yield tell
        return
    with Live(console=console, refresh_per_second=8, transient=False) as live:
        yield lambda now: live.update(_line(now))


def _line(now: Iterate) -> Text:
    worst = now.worst
    return Text(
        f"{now.stage:>8} {now.number:5d}  {now.elapsed:6.1f} s  cost {now.cost:10.1f} N2 m2 s  "
        f"worst: {worst.name} (Eq. {worst.equation}) {worst.value:.1e} {worst.unit}"
    )


def _summary(
    program: GaitProgram, solution: Solution, checks: list[Check], success: bool
) -> dict[str, Any]:
    scenario = program.scenario
    return {
        "success": success,
        "solver": solution.solver,
        "dynamics": program.dynamics,
        "solver_status": solution.status,
        "wall_time_s": solution.wall_time,
        "attempts": solution.attempts,
        "iterations": solution.iterations,
        "evaluations": solution.evaluations,
        "cost": solution.cost,
        "cost_unit": "N^2 m^2 s",
        "n_variables": len(program.variables),
        "n_constraints": program.n_constraint_rows,
        "violations": {
            worst.name: {
                "value": worst.value,
                "unit": worst.unit,
                "time_s": worst.time,
                "equation": worst.equation,
            }
            for worst in solution.violations
        },
        "checks": _by_name(checks),
        "walking_speed_m_per_s": scenario.walk.speed,
        "step_length_m": scenario.walk.step_length,
        "body_mass_kg": scenario.subject.mass,
        "load_kg": scenario.load.mass,
        "scenario": scenario.to_dict(),
        "versions": {"python": platform.python_version()}
        | {package: version(package) for package in PACKAGES},
    }


def _by_name(checks: list[Check]) -> dict[str, dict[str, Any]]:
    return {check.name: {**asdict(check), "passed": check.passed} for check in checks}


def _write(folder: Path, gait: Gait, summary: dict[str, Any]) -> None:
    from human_gait.playback import save_playback  # noqa: PLC0415, half a second to import
    from human_gait.plots import save_plots  # noqa: PLC0415, the same

    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder, prefix=".writing-") as temporary:
        new = Path(temporary)  # what is interrupted leaves the old result as it was
        save_gait(gait, new)
        save_gait_cycle(gait, new / "gait_cycle.csv")
        (new / SUMMARY).write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
        save_plots(gait, new)
        save_playback(gait, new / "playback.html")
        for path in new.iterdir():
            path.replace(folder / path.name)


def _check_table(checks: list[Check]) -> Table:
    table = Table(title="The walk on a grid ten times finer", title_justify="left")
    for column, side in (("check", "left"), ("found", "right"), ("limit", "right"), ("", "left")):
        table.add_column(column, justify=side)  # type: ignore[arg-type]
    for check in checks:
        found, limit = f"{check.value:.1e} {check.unit}", f"{check.limit:.0e}"
        table.add_row(check.name, found, limit, "ok" if check.passed else "FAILED")
    return table


def _verdict(solution: Solution, success: bool, folder: Path) -> str:
    outcome = "found a walk" if success else "found no walk"
    return (
        f"{solution.solver} {outcome} in {solution.wall_time:.1f} s ({solution.status}); "
        f"result in {folder}"
    )


def _failures(solution: Solution, checks: list[Check]) -> str:
    """Return which constraints and checks failed, when and by how much."""
    lines = [
        f"  {worst.name} (Eq. {worst.equation}): {worst.value:.2e} {worst.unit} "
        f"at t = {worst.time:.3f} s"
        for worst in solution.violations
        if worst.value > FEASIBLE
    ]
    lines += [
        f"  {check.name}: {check.value:.2e} {check.unit} at t = {check.time:.3f} s, "
        f"allowed {check.limit:g}"
        for check in checks
        if not check.passed
    ]
    return (
        "\n".join(["not kept:", *lines])
        if lines
        else "every constraint is kept, but the solver stopped before the optimum"
    )
