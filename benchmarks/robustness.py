"""How often a user who asks for a reasonable gait gets one.

    python benchmarks/robustness.py [--solver NAME] [--out DIR] [--workers N] [--first N] [--plain]

Solves a fixed design of 200 walks: speed 0.6 to 1.8 m/s, step 0.4 to 0.9 m, load 0 to 30 kg,
stature 1.50 to 1.95 m, mass 45 to 110 kg (a Sobol sequence in these five), women and men in turn,
each from a first guess that is disturbed at random, with --plain from the tool's own. Steps that
the legs cannot span are left out.
One process per core; a walk with a line in DIR/results.jsonl is not solved again. Prints success,
processor time and starts by region, every miss with its diagnosis; writes DIR/robustness.json,
DIR/robustness.png and every walk, for ``human-gait verify DIR/000`` and so on.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn
from rich.table import Table
from scipy.stats import qmc

from human_gait.exceptions import ScenarioError
from human_gait.problem.program import build_program
from human_gait.scenario import Scenario
from human_gait.solving.diagnosis import suggestions
from human_gait.solving.drake_solvers import SOLVERS
from human_gait.solving.starts import best, climb, disturbed
from human_gait.walk.gait_file import save_gait

SIZE = 200
_TURNED = 150  # neighbours of a Sobol sequence lie in opposite halves: from here on, the other sex
LOWEST = {"speed": 0.6, "step_length": 0.4, "load": 0.0, "stature": 1.50, "mass": 45.0}
HIGHEST = {"speed": 1.8, "step_length": 0.9, "load": 30.0, "stature": 1.95, "mass": 110.0}
UNITS = {"speed": "m/s", "step_length": "m", "load": "kg", "stature": "m", "mass": "kg"}


def design(size: int = SIZE) -> list[Scenario]:
    """Return the walks of the design; the first ones are the same for any size."""
    points = qmc.Sobol(len(LOWEST), seed=0).random_base2(int(np.ceil(np.log2(2 * size))))
    scaled = qmc.scale(points, list(LOWEST.values()), list(HIGHEST.values()))
    walks: list[Scenario] = []
    for row in np.round(scaled, 3):
        values = dict(zip(LOWEST, map(float, row), strict=True))
        turned = len(walks) >= _TURNED
        sex = ("male", "female")[(len(walks) + turned) % 2]
        table = {
            "name": f"walk {len(walks):03d}",
            "subject": {"sex": sex, "stature": values["stature"], "mass": values["mass"]},
            "walk": {"speed": values["speed"], "step_length": values["step_length"]},
            "load": {"mass": values["load"]},
        }
        try:
            walks.append(Scenario.from_dict(table))
        except ScenarioError:
            continue  # beyond the reach of the legs
    return walks[:size]


def solved(number: int, folder: Path, solver: str, plain: bool = False) -> dict[str, Any]:
    """Return what became of one walk of the design, and keep it in a folder of its own."""
    scenario, began = design()[number], time.process_time()
    program = build_program(scenario)
    guess = None if plain else disturbed(program, np.random.default_rng(number))
    attempts = climb(program, solver, seed=number, guess=guess)
    kept = best(attempts)
    place = folder / f"{number:03d}"
    place.mkdir(exist_ok=True)
    save_gait(kept.solution.gait, place)
    failed = [check for check in kept.checks if not check.passed]
    violated = [v for v in kept.solution.violations if v.value > 1e-4]
    tries = [] if kept.success else suggestions(kept.program, kept.solution, kept.checks)
    return {
        "number": number,
        "speed": scenario.walk.speed,
        "step_length": scenario.walk.step_length,
        "load": scenario.load.mass,
        "stature": scenario.subject.stature,
        "mass": scenario.subject.mass,
        "sex": scenario.subject.sex,
        "success": kept.success,
        "start": kept.start,
        "starts": len(attempts),
        "way": [f"{one.start}: {one.solution.status}" for one in attempts],
        "status": kept.solution.status,
        "seconds": time.process_time() - began,
        "evaluations": sum(attempt.solution.evaluations for attempt in attempts),
        "cost": kept.solution.cost,
        "violated": {v.name: [v.value, v.unit, v.time] for v in violated},
        "failed": {check.name: [check.value, check.limit, check.time] for check in failed},
        "engines_apart": max(c.value for c in kept.checks if "torques off" in c.name),
        "try": [f"{one.key}: {one.change} ({one.because})" for one in tries],
    }


def run(
    numbers: list[int], folder: Path, workers: int, solver: str = "newton", plain: bool = False
) -> list[dict[str, Any]]:
    """Return the results of some walks in the order of their numbers, those of before included."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "results.jsonl"
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    whole = text[: text.rfind("\n") + 1]  # a run that was killed leaves half a line
    path.write_text(whole, encoding="utf-8")
    results = {one["number"]: one for one in map(json.loads, whole.splitlines())}
    missing = [number for number in numbers if number not in results]
    bar = Progress(BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), "{task.description}")
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(threads, "1")  # the processes import numpy after this
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"))
    with bar, pool, path.open("a", encoding="utf-8") as file:
        task = bar.add_task("", total=len(numbers), completed=len(numbers) - len(missing))
        for done in as_completed(
            [pool.submit(solved, number, folder, solver, plain) for number in missing]
        ):
            one = done.result()
            results[one["number"]] = one
            file.write(json.dumps(one) + "\n")
            file.flush()
            misses = sum(not result["success"] for result in results.values())
            bar.update(task, advance=1, description=f"{misses} without a walk")
    return [results[number] for number in numbers]


def regions(results: list[dict[str, Any]]) -> list[tuple[str, list[dict[str, Any]]]]:
    """Return the results by thirds of each range, by sex, and all of them."""
    parts = [("all", results)]
    for name, low in LOWEST.items():
        edges = np.linspace(low, HIGHEST[name], 4)
        for a, b in pairwise(edges):
            members = [one for one in results if a <= one[name] < b or one[name] == b == edges[-1]]
            parts.append((f"{name.replace('_', ' ')} {a:.3g} to {b:.3g} {UNITS[name]}", members))
    sexes = ("female", "male")
    return parts + [(sex, [one for one in results if one["sex"] == sex]) for sex in sexes]


def summary(part: list[dict[str, Any]]) -> dict[str, float]:
    """Return how many walks of a part were found, how fast, and from how many starts."""
    seconds = [one["seconds"] for one in part] or [0.0]
    return {
        "walks": len(part),
        "found": sum(one["success"] for one in part),
        "median_seconds": float(np.median(seconds)),
        "ninth_decile_seconds": float(np.quantile(seconds, 0.9)),
        "more_than_one_start": sum(one["starts"] > 1 for one in part),
        "largest_engines_apart": max((one["engines_apart"] for one in part), default=0.0),
    }


def picture(results: list[dict[str, Any]]) -> Figure:
    """Return a figure of all walks by speed and step: how long each took and how it was found."""
    figure = Figure(figsize=(6.4, 4.4), layout="constrained")
    ax = figure.subplots()
    kinds = {
        "at the first attempt": [one for one in results if one["success"] and one["starts"] == 1],
        "after more attempts": [one for one in results if one["success"] and one["starts"] > 1],
        "not found": [one for one in results if not one["success"]],
    }
    seconds = [one["seconds"] for one in results]
    ends = min(seconds), max(seconds)
    for (kind, members), marker in zip(kinds.items(), "oDX", strict=True):
        at = [[one[name] for one in members] for name in ("speed", "step_length", "seconds")]
        style = {"marker": marker, "cmap": "viridis_r", "edgecolors": "0.3", "linewidths": 0.5}
        dots = ax.scatter(
            at[0], at[1], c=at[2], label=f"{kind}: {len(members)}", norm=LogNorm(*ends), **style
        )
    scale = figure.colorbar(dots, label="processor time [s]", format="{x:g}")
    scale.ax.yaxis.set_minor_formatter(NullFormatter())
    ax.set(xlabel="speed [m/s]", ylabel="step length [m]")
    figure.legend(loc="outside upper center", ncols=3, frameon=False)
    return figure


def main() -> None:
    """Solve, print and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/robustness"))
    parser.add_argument("--solver", default="newton", choices=SOLVERS)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--first", type=int, default=SIZE, choices=range(1, SIZE + 1), metavar="N")
    parser.add_argument("--plain", action="store_true", help="from the tool's own first guess")
    options = parser.parse_args()
    numbers = list(range(options.first))
    results = run(numbers, options.out, options.workers, options.solver, options.plain)
    table = Table(title="Walks found", title_justify="left")
    for column in ("region", "found", "%", "median s", "90 % s", "more attempts"):
        table.add_column(column, justify="left" if column == "region" else "right")
    found = {name: summary(part) for name, part in regions(results)}
    for name, one in found.items():
        share = f"{100 * one['found'] / max(one['walks'], 1):.1f}"
        times = f"{one['median_seconds']:.1f}", f"{one['ninth_decile_seconds']:.1f}"
        count = f"{one['found']:.0f}/{one['walks']:.0f}"
        table.add_row(name, count, share, *times, f"{one['more_than_one_start']:.0f}")
    console = Console()
    console.print(table)
    misses = [one for one in results if not one["success"]]
    for one in misses:
        console.print(one, soft_wrap=True)
    text = json.dumps({"regions": found, "misses": misses}, indent=2)
    (options.out / "robustness.json").write_text(text + "\n", encoding="utf-8")
    picture(results).savefig(options.out / "robustness.png", dpi=150)


if __name__ == "__main__":
    main()
