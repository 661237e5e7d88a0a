"""How long the dynamics takes, by Pinocchio and by the paper's recursion.

    python benchmarks/dynamics.py [--scenario FILE] [--repeat N] [--out FILE]

Two times for 20, 40 and 80 instants of a step, and their ratios: of the inverse dynamics with its
derivatives alone, and of one whole evaluation of the program (`GaitProgram.instants` at a point
that it has not seen): dynamics, ground reaction, feet, passive joints and all partial derivatives.
The engines take turns, so that a busy machine slows both, and medians are reported. Run it with
OMP_NUM_THREADS=1: the matrices are small.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from rich.console import Console
from rich.table import Table

from human_gait.dynamics.inverse_dynamics import ENGINES, make_dynamics
from human_gait.problem.program import build_program
from human_gait.scenario import Scenario, load_scenario

FloatArray = npt.NDArray[np.float64]
Action = Callable[[], object]

INSTANTS = (20, 40, 80)
NORMAL = Path(__file__).parent.parent / "scenarios" / "normal.toml"


def main() -> None:
    """Measure, print a table and, if asked, write JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenario", type=Path, default=NORMAL, help="whose walk, TOML")
    parser.add_argument("--repeat", type=int, default=41, help="runs of each, an odd number")
    parser.add_argument("--out", type=Path, help="JSON file to write")
    wanted = parser.parse_args()
    scenario = load_scenario(wanted.scenario)
    rows = [row for n in INSTANTS for row in measured(scenario, n, wanted.repeat)]
    Console().print(table(rows))
    if wanted.out:
        wanted.out.write_text(json.dumps(rows, indent=2) + "\n", encoding="utf-8")


def measured(scenario: Scenario, n: int, repeat: int) -> list[dict[str, object]]:
    """Return the times of both quantities at n instants."""
    grid = replace(scenario.discretisation, intervals=n, dynamics_per_interval=1)
    task = replace(scenario, discretisation=grid)
    actions = {
        "inverse dynamics": {engine: inverse_dynamics(task, engine) for engine in ENGINES},
        "whole evaluation": {engine: evaluation(task, engine) for engine in ENGINES},
    }
    return [
        {"instants": n, "what": what, "repeat": repeat, **medians(of, repeat)}
        for what, of in actions.items()
    ]


def inverse_dynamics(task: Scenario, engine: str) -> Action:
    """Return what computes torques and partial derivatives of the first guess."""
    program = build_program(task)
    now = program.instants(program.guess())
    dynamics = make_dynamics(program.gait(program.guess()).body, engine)
    return lambda: dynamics.inverse(now.q, now.v, now.a)


def evaluation(task: Scenario, engine: str) -> Action:
    """Return what evaluates the program, every time at another point near the first guess."""
    program, random = build_program(task, dynamics=engine), np.random.default_rng(0)
    guess = program.guess()
    return lambda: program.instants(guess + random.uniform(-0.02, 0.02, guess.shape))


def medians(actions: dict[str, Action], repeat: int) -> dict[str, float]:
    """Return the median time of each engine, [ms], and how much slower the second one is."""
    times: dict[str, list[float]] = {engine: [] for engine in actions}
    for action in actions.values():
        action()  # the first run allocates
    for _ in range(repeat):
        for engine, action in actions.items():
            start = time.perf_counter()
            action()
            times[engine].append(1e3 * (time.perf_counter() - start))
    by_engine = {f"{engine}_ms": float(np.median(spent)) for engine, spent in times.items()}
    pinocchio, native = (by_engine[f"{engine}_ms"] for engine in ENGINES)
    return {**by_engine, "ratio": native / pinocchio}


def table(rows: list[dict[str, object]]) -> Table:
    """Return the times as a table."""
    shown = Table(title="Median times", title_justify="left")
    for column in ("instants", "what", "pinocchio [ms]", "dh [ms]", "dh / pinocchio"):
        shown.add_column(column, justify="left" if column == "what" else "right")
    for row in rows:
        times = (f"{row[key]:.2f}" for key in ("pinocchio_ms", "dh_ms", "ratio"))
        shown.add_row(str(row["instants"]), str(row["what"]), *times)
    return shown


if __name__ == "__main__":
    main()
