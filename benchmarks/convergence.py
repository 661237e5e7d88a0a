"""What more control points give: cost, time, what is kept between the instants, and likeness.

    python benchmarks/convergence.py [--out DIR] [--images DIR]

Solves preferred walking with 8 to 24 control points per DOF by Newton's method, from the program's
own guess; with some numbers also by a posture path, from the walk with fewer, and from guesses that
are disturbed at random, which shows how far optima differ. A case with numbers in DIR is not solved
again.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from human_gait.checks import ground, motion
from human_gait.checks.verification import verify
from human_gait.people.reference import references_near, scores
from human_gait.problem.program import GaitProgram, build_program
from human_gait.scenario import load_scenario
from human_gait.solving.solver import POSTURE, Solution, solve
from human_gait.solving.starts import disturbed
from human_gait.solving.warm_start import adapted
from human_gait.walk.gait_cycle import gait_cycle
from human_gait.walk.gait_file import load_gait, make_record, save_gait

SCENARIO = Path(__file__).parent.parent / "scenarios" / "preferred.toml"
NUMBERS = (8, 10, 12, 14, 16, 20, 24)
GUESS, PATH, FEWER = "guess", "posture path", "walk with fewer"
STARTS = {14: (PATH, FEWER, "disturbed 1", "disturbed 2"), 20: (PATH, FEWER), 24: (FEWER,)}
DENSE = {
    "footholds": motion.FOOTHOLDS.name,
    "penetration": motion.DEPTH.name,
    "ZMP": ground.ZMP.name,
}
CURVES = {
    "hip": "hip_flexion_deg",
    "knee": "knee_flexion_deg",
    "ankle": "ankle_dorsiflexion_deg",
    "obliquity": "pelvis_obliquity_up_deg",
    "rotation": "pelvis_rotation_internal_deg",
    "adduction": "hip_adduction_deg",
    "hip moment": "hip_extension_Nm_per_kg",
    "knee moment": "knee_extension_Nm_per_kg",
    "ankle moment": "ankle_plantarflexion_Nm_per_kg",
    "vertical": "vertical_up_BW",
    "fore-aft": "foreaft_forward_BW",
}
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = "os^Dv<>"


def cases() -> Iterator[tuple[int, str]]:
    """Yield control points and start of every case."""
    yield from ((n, GUESS) for n in NUMBERS)
    yield from ((n, start) for n, starts in STARTS.items() for start in starts)


def solved(folder: Path, n: int, start: str) -> dict[str, Any]:
    """Return the numbers of one case, solved now or before."""
    case = folder / name_of(n, start)
    if (case / "case.json").is_file():
        return dict(json.loads((case / "case.json").read_text()))
    program = build_program(load_scenario(SCENARIO).replace(control_points=n))
    how = beginning(program, start, folder)
    begun = time.process_time()
    solution = solve(program, time_limit=None, **how)
    seconds = time.process_time() - begun
    numbers = {"control_points": n, "start": start, "time_s": seconds, **measured(solution)}
    case.mkdir(parents=True, exist_ok=True)
    save_gait(solution.gait, case)
    (case / "case.json").write_text(json.dumps(numbers, indent=2) + "\n")
    return numbers


def name_of(n: int, start: str) -> str:
    """Return the folder of a case."""
    return f"{n:02d}-{start.replace(' ', '-')}"


def beginning(program: GaitProgram, start: str, folder: Path) -> dict[str, Any]:
    """Return where `solve` starts."""
    if start == PATH:
        return {"weights": POSTURE}
    if start == FEWER:
        n = program.scenario.discretisation.control_points
        fewer = NUMBERS[NUMBERS.index(n) - 1]
        return {"start": adapted(load_gait(folder / name_of(fewer, GUESS)), program)}
    if start == GUESS:
        return {}
    seed = int(start.removeprefix("disturbed "))
    return {"guess": disturbed(program, np.random.default_rng(seed))}


def measured(solution: Solution) -> dict[str, Any]:
    """Return the numbers of one solve."""
    checks = {check.name: check for check in verify(make_record(solution.gait))}
    return {
        "variables": 55 * solution.gait.basis.n_free,
        "status": solution.status,
        "walk": solution.converged and all(check.passed for check in checks.values()),
        "not_kept": [name for name, check in checks.items() if not check.passed],
        "cost": solution.cost,
        "iterations": solution.iterations,
        "dense_mm": {name: 1e3 * checks[check].value for name, check in DENSE.items()},
        "r": likeness(solution),
    }


def likeness(solution: Solution) -> dict[str, float]:
    """Return the correlation of each curve with each measured mean."""
    gait = solution.gait
    near = references_near(gait.scenario.walk.speed)
    short = {curve: name for name, curve in CURVES.items()}
    return {
        f"{short[one.curve]}, {reference.name}": one.r
        for reference in near
        for one in scores(gait_cycle(gait), reference)
        if one.curve in short
    }


def table(found: list[dict[str, Any]]) -> Table:
    """Return all cases as a table."""
    columns = ("points", "start", "variables", "walk", "cost", "time [s]", "iterations")
    shown = Table(*columns, *(f"{name} [mm]" for name in DENSE), *found[0]["r"])
    for case in found:
        shown.add_row(
            *(str(case[key]) for key in ("control_points", "start", "variables", "walk")),
            *(f"{case['cost']:.0f}", f"{case['time_s']:.1f}", str(case["iterations"])),
            *(f"{value:.1f}" for value in case["dense_mm"].values()),
            *(f"{value:.2f}" for value in case["r"].values()),
        )
    return shown


def figure(found: list[dict[str, Any]]) -> Figure:
    """Return cost, time, what is kept between the instants, and likeness, of all optima."""
    drawn = Figure(figsize=(9.0, 6.4), layout="constrained")
    panels = drawn.subplots(2, 2, sharex=True).ravel()
    optima = [case for case in found if case["status"] == "optimal"]
    own = [case for case in optima if case["start"] == GUESS]
    others = [case for case in optima if case["start"] != GUESS]
    for panel, key, scale in ((panels[0], "cost", 1e3), (panels[1], "time_s", 1.0)):
        for cases, look in ((own, "o-"), (others, "x")):
            name = "other starts" if cases is others else "guess"
            n = [case["control_points"] for case in cases]
            panel.plot(n, [case[key] / scale for case in cases], look, color="#0072B2", label=name)
    n = [case["control_points"] for case in own]
    lines = (
        (panels[2], "dense_mm", {name: name for name in DENSE}),
        (panels[3], "r", {name: f"{name}, falisse2019_subject1" for name in FEW}),
    )
    for panel, key, shown in lines:
        for number, (name, at) in enumerate(shown.items()):
            line = {"color": COLOURS[number], "marker": MARKERS[number], "label": name}
            panel.plot(n, [case[key][at] for case in own], **line)
    panels[2].axhline(10.0, color="#222222", linestyle=":", label="limit")
    titles = (
        "cost",
        "processor time of solving",
        "worst between the instants",
        "likeness to Falisse et al.",
    )
    units = ("cost [kN$^2$ m$^2$ s]", "time [s]", "distance [mm]", "correlation")
    for panel, title, unit in zip(panels, titles, units, strict=True):
        panel.set_title(title, loc="left")
        panel.set_ylabel(unit)
        panel.grid(alpha=0.3)
        panel.legend(frameon=False, ncols=2)
    for panel in panels[2:]:
        panel.set_xlabel("control points per DOF")
    panels[0].set_ylim(bottom=0.0)
    panels[1].set_ylim(bottom=0.0)
    panels[2].set_ylim(0.0, 15.0)
    return drawn


FEW = ("knee", "ankle", "hip moment", "knee moment", "vertical", "obliquity", "rotation")


def main() -> None:
    """Solve what is missing, print the table and draw the plot."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/convergence"))
    parser.add_argument("--images", type=Path, help="folder for convergence.png and .svg")
    arguments = parser.parse_args()
    console, found = Console(width=250), []
    with console.status("solving") as status:
        for n, start in cases():
            status.update(f"{n} control points, start {start}")
            found.append(solved(arguments.out, n, start))
    console.print(table(found))
    (arguments.out / "convergence.json").write_text(json.dumps(found, indent=2) + "\n")
    images = arguments.images or arguments.out
    for suffix in ("png", "svg"):
        figure(found).savefig(images / f"convergence.{suffix}", dpi=150)


if __name__ == "__main__":
    main()
