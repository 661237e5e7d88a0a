"""What more control points give: cost, time, what is kept between the instants, and likeness.

    python benchmarks/convergence.py [--out DIR] [--images DIR]

Solves preferred walking with 5 to 12 control points per DOF: cold, from the program's own guess,
and warm, by knot insertion from the warm result with one less (as ``human-gait refine`` does). 5
and 6 are clamped, with velocities tied and the wider tolerances of ``paper-275``: mirrored splines
of 3 free control points cannot follow the feet. A case with numbers in DIR is not solved again.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from human_gait.checks import ground, motion
from human_gait.checks.verification import verify
from human_gait.exceptions import ResultError
from human_gait.people.reference import references_near, scores
from human_gait.problem.program import build_program
from human_gait.problem.refinement import refined_program
from human_gait.scenario import Scenario, load_scenario
from human_gait.solving.solver import Solution, solve
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import gait_cycle
from human_gait.walk.gait_file import load_gait, make_record, save_gait

SOLVER = "snopt"  # that the page on convergence was made with
SCENARIOS = Path(__file__).parent.parent / "scenarios"
NUMBERS = range(5, 13)
FEW = 6  # up to here clamped splines
DENSE = {
    "footholds": motion.FOOTHOLDS.name,
    "penetration": motion.DEPTH.name,
    "ZMP": ground.ZMP.name,
}
CURVES = {
    "hip": "hip_flexion_deg",
    "knee": "knee_flexion_deg",
    "ankle": "ankle_dorsiflexion_deg",
    "vertical force": "vertical_up_BW",
}
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
MARKERS = "os^D"


def task(n: int) -> Scenario:
    """Return preferred walking with n control points per DOF."""
    scenario, paper = (load_scenario(SCENARIOS / f"{x}.toml") for x in ("preferred", "paper-275"))
    like = paper if n <= FEW else scenario
    periodicity = like.discretisation.periodicity
    grid = replace(scenario.discretisation, control_points=n, periodicity=periodicity)
    return replace(scenario, discretisation=grid, tolerances=like.tolerances)


def measured(n: int, start: str, solution: Solution) -> dict[str, Any]:
    """Return the numbers of one solve."""
    checks = {check.name: check for check in verify(make_record(solution.gait))}
    return {
        "control_points": n,
        "start": start,
        "variables": 55 * solution.gait.basis.n_free,
        "status": solution.status,
        "walk": solution.converged and all(check.passed for check in checks.values()),
        "cost": solution.cost,
        "time_s": solution.wall_time,
        "evaluations": solution.iterations,
        "dense_mm": {name: 1e3 * checks[check].value for name, check in DENSE.items()},
        "r": likeness(solution.gait),
    }


def likeness(gait: Gait) -> dict[str, float]:
    """Return the least correlation of each curve with the measured means."""
    cycle = gait_cycle(gait)
    near = references_near(gait.scenario.walk.speed)
    found = [score for reference in near for score in scores(cycle, reference)]
    return {name: min(s.r for s in found if s.curve == curve) for name, curve in CURVES.items()}


def solved(folder: Path, n: int, start: str) -> dict[str, Any] | None:
    """Return the numbers of one case, solved now or before; None if there is nothing to refine."""
    case, file = folder / f"{n:02d}-{start}", "case.json"
    if (case / file).is_file():
        return dict(json.loads((case / file).read_text()))
    program, free = build_program(task(n)), None
    if start == "warm":
        coarser = coarser_walk(folder, n)
        if coarser is None:
            return None
        program, free = refined_program(coarser, n)
    solution = solve(program, SOLVER, start=free, time_limit=None)
    numbers = measured(n, start, solution)
    case.mkdir(parents=True, exist_ok=True)
    save_gait(solution.gait, case)
    (case / file).write_text(json.dumps(numbers, indent=2) + "\n")
    return numbers


def coarser_walk(folder: Path, n: int) -> Gait | None:
    """Return the walk with one control point less, warm if there is one, of the same problem."""
    if n <= FEW + 1:  # another kind of spline, or other tolerances
        return None
    for start in ("warm", "cold"):
        try:
            return load_gait(folder / f"{n - 1:02d}-{start}")
        except ResultError:
            continue
    return None


def table(cases: list[dict[str, Any]]) -> Table:
    """Return all cases as a table."""
    columns = ("points", "start", "variables", "walk", "cost", "time [s]", "evaluations", "status")
    shown = Table(*columns, *(f"{name} [mm]" for name in DENSE), *(f"r {name}" for name in CURVES))
    for case in cases:
        shown.add_row(
            *(str(case[key]) for key in ("control_points", "start", "variables", "walk")),
            *(f"{case['cost']:.0f}", f"{case['time_s']:.1f}", str(case["evaluations"])),
            case["status"],
            *(f"{value:.1f}" for value in case["dense_mm"].values()),
            *(f"{value:.2f}" for value in case["r"].values()),
        )
    return shown


def figure(cases: list[dict[str, Any]]) -> Figure:
    """Return cost, time, what is kept between the instants, and likeness over control points."""
    drawn = Figure(figsize=(9.0, 6.4), layout="constrained")
    panels = drawn.subplots(2, 2, sharex=True).ravel()
    for number, start in enumerate(("cold", "warm")):
        rows = [case for case in cases if case["start"] == start]
        n = [case["control_points"] for case in rows]
        line = {"color": COLOURS[number], "marker": MARKERS[number], "label": start}
        panels[0].plot(n, [case["cost"] / 1e3 for case in rows], **line)
        panels[1].semilogy(n, [case["time_s"] for case in rows], **line)
    cold = [case for case in cases if case["start"] == "cold"]
    n = [case["control_points"] for case in cold]
    for panel, key in ((panels[2], "dense_mm"), (panels[3], "r")):
        for number, name in enumerate(cold[0][key]):
            line = {"color": COLOURS[number], "marker": MARKERS[number], "label": name}
            panel.plot(n, [case[key][name] for case in cold], **line)
    panels[2].axhline(10.0, color="#222222", linestyle=":", label="limit")
    titles = ("cost", "time of solving", "worst between the instants, cold", "likeness, cold")
    units = ("cost [kN$^2$ m$^2$ s]", "time [s]", "distance [mm]", "least correlation with people")
    for panel, title, unit in zip(panels, titles, units, strict=True):
        panel.set_title(title, loc="left")
        panel.set_ylabel(unit)
        panel.grid(alpha=0.3)
        panel.legend(frameon=False, ncols=2 if panel is panels[2] else 1)
    for panel in panels[2:]:
        panel.set_xlabel("control points per DOF")
    panels[0].set_ylim(bottom=0.0)
    panels[2].set_ylim(0.0, 15.0)
    return drawn


def main() -> None:
    """Solve what is missing, print the table and draw the plot."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/convergence"))
    parser.add_argument("--images", type=Path, help="folder for convergence.png and .svg")
    arguments = parser.parse_args()
    console, cases = Console(width=180), []
    with console.status("solving") as status:
        for n in NUMBERS:
            for start in ("cold", "warm"):
                status.update(f"{n} control points, {start}")
                cases.append(solved(arguments.out, n, start))
    found = [case for case in cases if case]
    console.print(table(found))
    (arguments.out / "convergence.json").write_text(json.dumps(found, indent=2) + "\n")
    images = arguments.images or arguments.out
    for suffix in ("png", "svg"):
        figure(found).savefig(images / f"convergence.{suffix}", dpi=150)


if __name__ == "__main__":
    main()
