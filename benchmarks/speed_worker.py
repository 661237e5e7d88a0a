"""A process that measures a tree of the package: what `speed.py` starts, one for each tree.

PYTHONPATH says which tree: this one or the baseline, whose package has no folders. Reads tasks
from standard input, a line of JSON each, ``{"do": NAME, ...}``, and answers each with a line of
JSON. Times are CPU seconds of the process, without imports.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

import human_gait
from human_gait.scenario import Scenario, load_scenario

try:
    from human_gait.problem.program import GaitProgram
    from human_gait.solving.solver import Solution, solve
    from human_gait.solving.warm_start import adapted, fitting
except ImportError:  # the baseline
    from human_gait.program import GaitProgram
    from human_gait.solver import Solution, solve
    from human_gait.warm_start import adapted, fitting

TREE = Path(human_gait.__file__).parent.parent
FEW = 6  # up to here clamped splines: mirrored ones leave too little freedom
MORE = 1.05
ESTIMATES = 6
SPREAD = 0.08  # of speed and step of neighbouring walks, each way
Answer = dict[str, Any]


def file_of(name: str) -> Path:
    """Return the file of a scenario; the baseline knows the paper's formulation only."""
    folder = TREE / "scenarios"
    path = folder / f"{name}.toml"
    return path if path.exists() else folder / f"{name.removeprefix('paper-')}.toml"


def task(
    scenario: str, points: int | None = None, intervals: int | None = None, change: str = ""
) -> Scenario:
    """Return a problem, with so many control points and intervals, and something 5 % larger."""
    found = load_scenario(file_of(scenario))
    grid: dict[str, Any] = {"control_points": points, "intervals": intervals}
    if points is not None and points <= FEW:
        grid["periodicity"] = "velocity"
    grid = {name: value for name, value in grid.items() if value is not None}
    found = replace(found, discretisation=replace(found.discretisation, **grid))
    return neighbour(found, change) if change else found


def neighbour(scenario: Scenario, change: str, factor: float = MORE) -> Scenario:
    """Return a problem nearby: faster, with longer steps or with more load."""
    walk, load = scenario.walk, scenario.load
    if change == "load":
        return replace(scenario, load=replace(load, mass=factor * load.mass))
    name = {"speed": "speed", "step": "step_length"}[change]
    return replace(scenario, walk=replace(walk, **{name: factor * getattr(walk, name)}))


def hello() -> Answer:
    """Return which tree this is, and whether it has its kernel."""
    try:
        kernel = import_module("human_gait.kernel").function("dense") is not None
    except ImportError:  # the baseline
        kernel = False
    return {"tree": str(TREE), "kernel": kernel}


def cold(**which: Any) -> Answer:
    """Build and solve a problem from nothing."""
    return _solved(lambda: GaitProgram(task(**which)), lambda _: {})


def warm(scenario: str, points: int, change: str) -> Answer:
    """Solve a problem from the walk that it is a change of, which is found before.

    What the program of that walk knows is kept where the package can.
    """
    before, like = _walk(scenario, points)
    near = task(scenario, points, change=change)

    def built() -> GaitProgram:
        moved = getattr(before, "moved_to", None)
        return moved(near) if moved else GaitProgram(near)

    def start(program: GaitProgram) -> dict[str, Any]:
        multipliers = fitting(like.multipliers, program)
        return {"start": adapted(like.gait, program), "multipliers": multipliers}

    return _solved(built, start)


@cache
def _walk(scenario: str, points: int) -> tuple[GaitProgram, Solution]:
    program = GaitProgram(task(scenario, points))
    return program, solve(program)


def _solved(
    built: Callable[[], GaitProgram], start: Callable[[GaitProgram], dict[str, Any]]
) -> Answer:
    began = time.process_time()
    program = built()
    ready = time.process_time()
    solution = solve(program, "newton", **start(program))
    ended = time.process_time()
    return {
        "seconds": ended - began,
        "iteration_ms": 1e3 * (ended - ready) / max(solution.iterations, 1),
        "iterations": solution.iterations,
        "cost": solution.cost,
        "converged": solution.converged,
        "variables": len(program.variables),
    }


def iteration(most: int, **which: Any) -> Answer:
    """Time an iteration: the first ones of a cold solve."""
    program = GaitProgram(task(**which))
    began = time.process_time()
    solution = solve(program, most_iterations=most)
    spent = time.process_time() - began
    return {"iteration_ms": 1e3 * spent / solution.iterations, "variables": len(program.variables)}


@cache
def _predictor(scenario: str) -> Any:
    predictor = human_gait.Predictor()
    predictor.predict(task(scenario))
    predictor.estimate(task(scenario, change="speed"))
    return predictor


def estimate(scenario: str) -> Answer:
    """Time estimates of walks that are a little faster, from one that is known."""
    predictor, spent, found = _predictor(scenario), [], []
    for factor in np.linspace(1.01, MORE, ESTIMATES):
        near = neighbour(task(scenario), "speed", float(factor))
        began = time.process_time()
        gait = predictor.estimate(near)
        spent.append(time.process_time() - began)
        found.append(gait.solution["estimate"]["largest_violation"])
    return {"seconds": float(np.median(spent)), "largest_violation": max(found)}


def many(scenario: str, walks: int) -> Answer:
    """Predict walks of other speeds and steps nearby, every one verified, and hold memory [MB]."""
    random, first, predictor = np.random.default_rng(0), task(scenario), human_gait.Predictor()
    held, not_found, began = [], 0, time.process_time()
    for _ in range(walks):
        speed, step = 1.0 + random.uniform(-SPREAD, SPREAD, 2)
        near = neighbour(neighbour(first, "speed", float(speed)), "step", float(step))
        try:
            predictor.predict(near)
        except human_gait.NoSolutionFound:
            not_found += 1
        held.append(resident())
    spent = time.process_time() - began
    memory = {"memory_then_mb": held[walks // 3 - 1], "memory_mb": held[-1]}
    return {"seconds": spent / walks, "walks": walks, "not_found": not_found, **memory}


def resident() -> float:
    """Return how much memory the process holds, [MB]; nan where there is no /proc."""
    pages = Path("/proc/self/statm")
    return int(pages.read_text().split()[1]) * 4096 / 1e6 if pages.exists() else float("nan")


def flops(**which: Any) -> Answer:
    """Count the operations of a Newton step."""
    program = GaitProgram(task(**which))
    return {"flops": import_module("limit").flops(program), "instants": len(program.times)}


def limit(folder: str, instants: int) -> Answer:
    """Time what cannot be done without: bare Pinocchio and products of matrices."""
    return dict(import_module("limit").measured(Path(folder), instants))


TASKS: dict[str, Callable[..., Answer]] = {
    one.__name__: one for one in (hello, cold, warm, iteration, estimate, many, flops, limit)
}


def answer(line: str) -> str:
    """Return what a task found, or why it found nothing."""
    given = json.loads(line)
    try:
        found = TASKS[given.pop("do")](**given)
    except Exception as error:  # noqa: BLE001, told and left out
        found = {"error": f"{type(error).__name__}: {error}"}
    return json.dumps(found)


if __name__ == "__main__":
    for request in sys.stdin:
        sys.stdout.write(answer(request) + "\n")
        sys.stdout.flush()
