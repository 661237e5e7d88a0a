"""One cell of the table of speeds, in a process of its own: what `speed.py` starts.

    python benchmarks/one_solve.py '{"kind": "cold", "scenario": "normal", "solver": "newton",
        "dynamics": "pinocchio", "control_points": 8, "intervals": 20}'

Prints JSON: for each solve time, iterations, cost and whether it is a walk that passes every check,
and the largest memory of the process. Imports are not timed. ``cold`` starts from the program's own
guess; ``speed``, ``step length`` and ``load`` solve a problem so, and then one in which that is 5 %
more, twice: cold, and warm from the first walk, which `newton` is given with its multipliers.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from human_gait.checks.verification import verify
from human_gait.problem.program import GaitProgram, build_program
from human_gait.scenario import Scenario, load_scenario
from human_gait.solving.solver import Solution, solve
from human_gait.solving.warm_start import adapted, fitting
from human_gait.walk.gait_file import make_record

SCENARIOS = Path(__file__).parent.parent / "scenarios"
FEW = 6  # up to here clamped splines: mirrored ones leave too little freedom
MORE = 1.05
Cell = Mapping[str, Any]


def task(cell: Cell) -> Scenario:
    """Return the problem of a cell."""
    scenario, n = load_scenario(SCENARIOS / f"{cell['scenario']}.toml"), cell["control_points"]
    grid = replace(scenario.discretisation, control_points=n, intervals=cell["intervals"])
    if n <= FEW:
        grid = replace(grid, periodicity="velocity")
    return replace(scenario, discretisation=grid)


def neighbour(scenario: Scenario, change: str) -> Scenario:
    """Return a problem nearby: faster, with longer steps or with more load."""
    walk, load = scenario.walk, scenario.load
    if change == "load":
        return replace(scenario, load=replace(load, mass=MORE * load.mass))
    name = {"speed": "speed", "step length": "step_length"}[change]
    return replace(scenario, walk=replace(walk, **{name: MORE * getattr(walk, name)}))


def solved(
    cell: Cell, scenario: Scenario, like: Solution | None = None
) -> tuple[Solution, dict[str, Any]]:
    """Return a solution, from another one if there is one, and its numbers without the checks."""
    began = time.perf_counter()
    program = build_program(scenario, dynamics=cell["dynamics"])
    built = time.perf_counter()
    start = {} if like is None else warm_start(cell, program, like)
    solution = solve(program, cell["solver"], time_limit=None, **start)
    ended = time.perf_counter()
    return solution, {
        "success": solution.converged,
        "status": solution.status,
        "iterations": solution.iterations,
        "evaluations": solution.evaluations,
        "cost": solution.cost,
        "seconds": ended - began,
        "build_s": built - began,
        "solve_s": ended - built,
        "variables": len(program.variables),
        "instants": len(program.times),
    }


def warm_start(cell: Cell, program: GaitProgram, like: Solution) -> dict[str, Any]:
    """Return where to start from a walk, with its multipliers for `newton`."""
    start: dict[str, Any] = {"start": adapted(like.gait, program)}
    if cell["solver"] == "newton":
        start["multipliers"] = fitting(like.multipliers, program)
    return start


def measured(cell: Cell) -> dict[str, Any]:
    """Return the numbers of all solves of a cell, and the memory, [MB]."""
    scenario, imported = task(cell), memory()
    first = solved(cell, scenario)
    found = {"cold": first}
    if cell["kind"] != "cold":
        near = neighbour(scenario, cell["kind"])
        found = {
            "first": first,
            "cold": solved(cell, near),
            "warm": solved(cell, near, first[0]),
        }
    peak = memory()
    for solution, numbers in found.values():
        checks = verify(make_record(solution.gait))
        numbers["failed"] = [check.name for check in checks if not check.passed]
        numbers["success"] &= not numbers["failed"]
    solves = {name: numbers for name, (_, numbers) in found.items()}
    return {"solves": solves, "peak_mb": peak, "imported_mb": imported}


def memory() -> float:
    """Return the most that the process has held so far, [MB]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 2 ** (20 if sys.platform == "darwin" else 10)  # bytes there, kB elsewhere


if __name__ == "__main__":
    sys.stdout.write(json.dumps(measured(json.loads(sys.argv[1]))) + "\n")
