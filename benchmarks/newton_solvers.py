"""Our interior-point method beside IPOPT, both with the same exact second derivatives.

    python benchmarks/newton_solvers.py [--scenarios NAME ...] [--control-points N ...] [--runs N]

Both start from the program's own guess, in turn, N times in one process with one BLAS thread.
Prints medians: seconds of solving, iterations, cost, and what is spent outside our functions.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi_ipopt
import numpy as np
from one_solve import task
from rich.console import Console
from rich.table import Table
from speed import CONTROL_POINTS, INTERVALS, SCENARIOS
from threadpoolctl import threadpool_limits

from human_gait.newton import interior_point
from human_gait.newton.nonlinear_program import NonlinearProgram
from human_gait.problem.program import build_program
from human_gait.solving.mathematical_program import ProgramFunctions

METHODS = {"ours": interior_point.minimise, "IPOPT": casadi_ipopt.minimise}
FUNCTIONS = ("cost", "gradient", "rows", "jacobian", "hessian")


class Timed:
    """A problem whose functions are timed, [s]."""

    def __init__(self, problem: NonlinearProgram) -> None:
        self.spent = 0.0
        functions = {name: self._timed(getattr(problem, name)) for name in FUNCTIONS}
        self.problem = replace(problem, **functions)

    def _timed(self, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*given: Any) -> Any:
            began = time.perf_counter()
            try:
                return function(*given)
            finally:
                self.spent += time.perf_counter() - began

        return call


def one(scenario: str, control_points: int, method: str) -> tuple[float, int, float, float]:
    """Return seconds, iterations, cost and seconds outside our functions of one solve."""
    cell = {"scenario": scenario, "control_points": control_points, "intervals": INTERVALS}
    program = build_program(task(cell))
    timed = Timed(ProgramFunctions(program.torques.prog).problem())
    began = time.perf_counter()
    end = METHODS[method](timed.problem, program.guess() / program.unit)
    seconds = time.perf_counter() - began
    if not end.solved:
        return (np.nan,) * 4
    return seconds, end.iterations, program.cost(end.x * program.unit)[0], seconds - timed.spent


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenarios", nargs="+", default=SCENARIOS)
    parser.add_argument("--control-points", nargs="+", type=int, default=CONTROL_POINTS)
    parser.add_argument("--runs", type=int, default=3)
    wanted = parser.parse_args()
    table = Table("scenario", "points", "method", "s", "iterations", "cost", "outside, ms each")
    console = Console()
    with console.status("solving"), threadpool_limits(1, "blas"):
        for scenario in wanted.scenarios:
            for points in wanted.control_points:
                rounds = [
                    {method: one(scenario, points, method) for method in METHODS}
                    for _ in range(wanted.runs)
                ]
                for method in METHODS:
                    s, n, cost, outside = np.median([r[method] for r in rounds], axis=0)
                    numbers = f"{s:.2f}", f"{n:.0f}", f"{cost:.1f}", f"{1e3 * outside / n:.1f}"
                    table.add_row(scenario, str(points), method, *numbers)
                    console.print(scenario, points, method, *numbers)
    console.print(table)


if __name__ == "__main__":
    main()
