"""How long a walk takes: every solver, cold and warm, and how the time grows with the problem.

    python benchmarks/speed.py [--scenarios NAME ...] [--solvers NAME ...] [--dynamics NAME ...]
        [--control-points N ...] [--runs N] [--limit SECONDS] [--out DIR]

Every solve has a process of its own (`one_solve.py`); its time is that of building and solving the
program, without imports. In each of N rounds all cells take their turn, so that ratios compare what
was measured side by side; medians over the rounds are reported. A solve that takes longer than the
limit is stopped, and its cell is not run again.

Every result is kept in DIR/runs.jsonl as soon as it is there: a run that was stopped goes on where
it was, and another folder starts anew. Prints three tables and writes DIR/bench.json.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn
from rich.table import Table

SCENARIOS = ("normal", "backpack-40")
SOLVERS = ("newton", "snopt", "ipopt")
ENGINES = ("pinocchio", "dh")
CHANGES = ("speed", "step length", "load")
LADEN = ("backpack-40",)
CONTROL_POINTS = (6, 8, 12, 20)
INTERVALS = 20  # of two instants each
GROWING = (12, 20, 40, 80)  # intervals, with this many control points:
GROWING_POINTS = 8
PACKAGES = ("human-gait", "daqp", "drake", "pin", "numpy", "scipy")
ONE_SOLVE = Path(__file__).with_name("one_solve.py")
WIDTH = 170
KEYS = ("kind", "scenario", "solver", "dynamics", "control_points", "intervals")
MEDIANS = ("seconds", "build_s", "solve_s", "iterations", "evaluations", "cost")
Cell = tuple[str, str, str, str, int, int]  # in the order of KEYS
Run = dict[str, Any]
Runner = Callable[[Cell, float], Run]


def cells(wanted: argparse.Namespace) -> list[Cell]:
    """Return what is to be measured: cold, then with more instants, then warm."""
    matrix = list(product(wanted.scenarios, wanted.control_points, wanted.dynamics, wanted.solvers))
    cold = [("cold", s, solver, d, n, INTERVALS) for s, n, d, solver in matrix]
    warm = [
        (change, s, solver, d, n, INTERVALS)
        for s, n, d, solver in matrix
        for change in changes(s, solver)
    ]
    grown = [
        ("cold", s, "newton", d, GROWING_POINTS, n)
        for s, d, n in product(wanted.scenarios[:1], wanted.dynamics[:1], GROWING)
        if "newton" in wanted.solvers and GROWING_POINTS in wanted.control_points
    ]
    return list(dict.fromkeys([*cold, *grown, *warm]))


def changes(scenario: str, solver: str) -> Sequence[str]:
    """Return what is raised by 5 % for a warm start; for `newton` everything that there is."""
    all_of_them = CHANGES if scenario in LADEN else CHANGES[:-1]
    return all_of_them if solver == "newton" else all_of_them[:1]


def in_own_process(cell: Cell, limit: float) -> Run:
    """Return the numbers of a cell; its process is stopped after the limit for each solve."""
    command = [sys.executable, str(ONE_SOLVE), json.dumps(dict(zip(KEYS, cell, strict=True)))]
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    allowed = limit * (1 if cell[0] == "cold" else 3)
    try:
        environment = threads | os.environ
        done = subprocess.run(
            command, check=False, capture_output=True, text=True, timeout=allowed, env=environment
        )
    except subprocess.TimeoutExpired:
        return {"over": limit}
    if done.returncode:
        return {"error": done.stderr.strip()[-500:]}
    return dict(json.loads(done.stdout.splitlines()[-1]))


class Runs:
    """All runs in a folder.

    Parameters
    ----------
    folder : Path
        Is made if it is not there.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._path = folder / "runs.jsonl"
        text = self._path.read_text(encoding="utf-8") if self._path.exists() else ""
        whole = text[: text.rfind("\n") + 1]  # a run that was killed leaves half a line
        self._path.write_text(whole, encoding="utf-8")
        self.by_cell: dict[Cell, list[Run]] = defaultdict(list)
        for one in map(json.loads, whole.splitlines()):
            self.by_cell[tuple(one[key] for key in KEYS)].append(one)

    def add(self, cell: Cell, run: Run) -> None:
        """Keep a run, in the file too."""
        one = {**dict(zip(KEYS, cell, strict=True)), **run}
        self.by_cell[cell].append(one)
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(one) + "\n")

    def good(self, cell: Cell) -> list[Run]:
        """Return the runs of a cell that came to an end."""
        return [run for run in self.by_cell.get(cell, []) if "solves" in run]

    def over(self, cell: Cell, limit: float = 0.0) -> float | None:
        """Return the limit that a cell, or its cold part, has gone over, from some limit on."""
        cold = ("cold", *cell[1:])
        gone = [
            run["over"]
            for one in dict.fromkeys((cell, cold))
            for run in self.by_cell.get(one, [])
            if run.get("over", -1.0) >= limit
        ]
        return max(gone, default=None)

    def missing(self, wanted: Iterable[Cell], rounds: int) -> Iterable[tuple[int, Cell]]:
        """Return what has not been run yet, round by round."""
        for number in range(rounds):
            for cell in wanted:
                done = [run for run in self.by_cell.get(cell, []) if "over" not in run]
                if len(done) <= number:
                    yield number, cell


def run(wanted: list[Cell], runs: Runs, rounds: int, limit: float, solver: Runner) -> None:
    """Run all that is missing, and tell how far it is."""
    todo = list(runs.missing(wanted, rounds))
    columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), "{task.description}")
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=len(wanted) * rounds)
        bar.update(task, completed=len(wanted) * rounds - len(todo))
        for number, cell in todo:
            bar.update(task, description=f"round {number + 1}: {words(cell)}")
            if runs.over(cell, limit) is None:
                runs.add(cell, solver(cell, limit))
            bar.advance(task)


def words(cell: Cell) -> str:
    """Return a cell in words."""
    kind, scenario, solver, dynamics, points, intervals = cell
    kind = kind if kind == "cold" else f"{kind} + 5 % of"
    return f"{kind} {scenario}, {solver}, {dynamics}, {points} points, {2 * intervals} instants"


def summary(runs: Runs, cell: Cell) -> dict[str, Any]:
    """Return the medians of a cell, of every solve in it."""
    good = runs.good(cell)
    found: dict[str, Any] = {
        **dict(zip(KEYS, cell, strict=True)),
        "runs": len(good),
        "over": runs.over(cell),
        "errors": [one["error"] for one in runs.by_cell.get(cell, []) if "error" in one],
    }
    if not good:
        return found
    solves: dict[str, Any] = {}
    for name, first in good[0]["solves"].items():
        each = [one["solves"][name] for one in good]
        solves[name] = {key: float(np.median([one[key] for one in each])) for key in MEDIANS}
        solves[name] |= {key: first[key] for key in ("variables", "instants", "status")}
        solves[name]["walks"] = sum(one["success"] for one in each)
    memory = {key: float(np.median([x[key] for x in good])) for key in ("peak_mb", "imported_mb")}
    return {**found, **memory, "solves": solves, "warm_ratio": warm_ratio(good)}


def warm_ratio(good: list[Run]) -> float | None:
    """Return how many times as long the cold solves took as the warm ones, side by side."""
    pairs = [(one["solves"]["cold"], one["solves"].get("warm")) for one in good]
    ratios = [cold["seconds"] / warm["seconds"] for cold, warm in pairs if warm]
    return float(np.median(ratios)) if ratios else None


def ratio(runs: Runs, slow: Cell, fast: Cell) -> tuple[float, bool] | None:
    """Return how many times as long a cell takes as another, in the same round.

    And whether that is only the least that it can be, the slow one having gone over its limit.
    """
    seconds = [[one["solves"]["cold"]["seconds"] for one in runs.good(c)] for c in (slow, fast)]
    if all(seconds):
        return float(np.median([a / b for a, b in zip(*seconds, strict=False)])), False
    limit = runs.over(slow)
    return (limit / float(np.median(seconds[1])), True) if limit and seconds[1] else None


def cold_table(runs: Runs, wanted: list[Cell], solvers: Sequence[str]) -> Table:
    """Return the cold solves, the solvers side by side."""
    shown = Table(title="Cold solves: medians", title_justify="left")
    for column in ("scenario", "points", "dynamics"):
        shown.add_column(column)
    for solver in solvers:
        for column in (escape(f"{solver} [s]"), "iter./eval.", "cost", "MB"):
            shown.add_column(column, justify="right")
    both = {"newton", "snopt"} <= set(solvers)
    if both:
        shown.add_column("snopt / newton", justify="right")
    rows = dict.fromkeys((c[1], *c[3:]) for c in wanted if c[0] == "cold" and c[5] == INTERVALS)
    for scenario, *rest in rows:
        by_solver = {solver: ("cold", scenario, solver, *rest) for solver in solvers}
        entries = [entry for cell in by_solver.values() for entry in cold_entries(runs, cell)]
        if both:
            entries.append(shown_ratio(ratio(runs, by_solver["snopt"], by_solver["newton"])))
        shown.add_row(scenario, str(rest[1]), rest[0], *entries)
    return shown


def cold_entries(runs: Runs, cell: Cell) -> list[str]:
    """Return time, iterations, cost and memory of a cold cell."""
    found = summary(runs, cell)
    if "solves" not in found:
        return [nothing(found), "", "", ""]
    cold = found["solves"]["cold"]
    return [seconds(cold, found["runs"]), *effort(cold, cell), f"{found['peak_mb']:.0f}"]


def effort(solve: dict[str, Any], cell: Cell) -> tuple[str, str]:
    """Return iterations, which Drake does not tell, and evaluations; and the cost."""
    steps = f"{solve['iterations']:.0f}" if cell[2] == "newton" else "-"
    return f"{steps}/{solve['evaluations']:.0f}", f"{solve['cost']:.1f}"


def seconds(solve: dict[str, Any], runs: int) -> str:
    """Return the time of a solve, with a word on it if it did not end with a walk."""
    miss = "" if solve["walks"] == runs else f" no walk {runs - solve['walks']}/{runs}"
    return f"{solve['seconds']:.2f}{miss}"


def nothing(found: dict[str, Any]) -> str:
    """Return why a cell has no numbers."""
    if found["over"]:
        return f"over {found['over']:.0f}"
    return "error" if found["errors"] else "not run"


def shown_ratio(found: tuple[float, bool] | None) -> str:
    """Return a ratio as it is shown."""
    return "" if found is None else f"{'> ' if found[1] else ''}{found[0]:.1f}"


def warm_table(runs: Runs, wanted: list[Cell]) -> Table:
    """Return the warm solves."""
    shown = Table(title="One thing raised by 5 %, cold and warm: medians", title_justify="left")
    for column in ("scenario", "change", "points", "dynamics", "solver"):
        shown.add_column(column)
    for kind in ("cold", "warm"):
        for column in (escape(f"{kind} [s]"), "iter./eval.", "cost"):
            shown.add_column(column, justify="right")
    shown.add_column("cold / warm", justify="right")
    for cell in wanted:
        change, scenario, solver, dynamics, points, _ = cell
        if change != "cold":
            which = scenario, change, str(points), dynamics, solver
            shown.add_row(*which, *warm_entries(runs, cell))
    return shown


def warm_entries(runs: Runs, cell: Cell) -> list[str]:
    """Return time, iterations and cost of both solves of a warm cell, and their ratio."""
    found = summary(runs, cell)
    if "solves" not in found:
        return [nothing(found), *[""] * 6]
    both = [found["solves"][kind] for kind in ("cold", "warm")]
    parts = [part for one in both for part in (seconds(one, found["runs"]), *effort(one, cell))]
    return [*parts, f"{found['warm_ratio']:.1f}"]


def growth(runs: Runs, wanted: list[Cell]) -> list[dict[str, Any]]:
    """Return how the time grows with control points and with instants, from the smallest on."""
    cold = [cell for cell in wanted if cell[0] == "cold" and runs.good(cell)]
    series: dict[tuple[str, ...], list[Cell]] = defaultdict(list)
    for cell in cold:
        what = f"{cell[1]}, {cell[2]}, {cell[3]}"
        if cell[5] == INTERVALS:
            series["control points", what].append(cell)
        if cell[4] == GROWING_POINTS:
            series["instants", what].append(cell)
    rows = []
    for (size, what), members in series.items():
        if len(members) > 1:
            at = 4 if size == "control points" else 5
            ordered = sorted(members, key=lambda cell, at=at: cell[at])
            rows += [grown(runs, size, what, at, (cell, ordered[0])) for cell in ordered]
    return rows


def grown(runs: Runs, size: str, what: str, at: int, pair: tuple[Cell, Cell]) -> dict[str, Any]:
    """Return one row of `growth`: a cell and the smallest one."""
    cell, first = pair
    cold, least = (summary(runs, one)["solves"]["cold"] for one in pair)
    times = ratio(runs, cell, first)
    linear = cell[at] / first[at]
    relative = times[0] if times else float("nan")
    steps = (cold["seconds"] / cold["iterations"], least["seconds"] / least["iterations"])
    return {
        "what": what,
        "grows": size,
        "size": cell[at] if size == "control points" else cold["instants"],
        "variables": cold["variables"],
        "seconds": cold["seconds"],
        "iterations": cold["iterations"],
        "relative": relative,
        "linear": linear,
        "against_linear": relative / linear,
        "step_against_linear": steps[0] / steps[1] / linear,
    }


def growth_table(rows: list[dict[str, Any]]) -> Table:
    """Return the growth as a table."""
    shown = Table(title="Growth: cold solves, against the first of each", title_justify="left")
    for column in ("of", "grows"):
        shown.add_column(column)
    heads = ("to", "variables", escape("[s]"), "iterations", "times", "linear", "times / linear")
    for column in (*heads, "one iteration / linear"):
        shown.add_column(column, justify="right")
    for row in rows:
        counts = (f"{row[key]:.0f}" for key in ("size", "variables"))
        ratios = ("relative", "linear", "against_linear", "step_against_linear")
        numbers = (f"{row[key]:.2f}" for key in ratios)
        time = f"{row['seconds']:.2f}", f"{row['iterations']:.0f}"
        shown.add_row(row["what"], row["grows"], *counts, *time, *numbers)
    return shown


def machine() -> dict[str, Any]:
    """Return what the times depend on."""
    lines = Path("/proc/cpuinfo")
    text = lines.read_text(encoding="utf-8") if lines.exists() else ""
    models = [line.partition(":")[2].strip() for line in text.splitlines() if "model name" in line]
    return {
        "processor": models[0] if models else platform.processor(),
        "cpu_count": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "versions": {name: version(name) for name in PACKAGES},
    }


def report(runs: Runs, wanted: list[Cell], limit: float) -> dict[str, Any]:
    """Return all that is written to ``bench.json``."""
    return {
        "machine": machine(),
        "limit_s": limit,
        "medians": [summary(runs, cell) for cell in wanted],
        "growth": growth(runs, wanted),
        "runs": [one for cell in wanted for one in runs.by_cell.get(cell, [])],
    }


def arguments() -> argparse.ArgumentParser:
    """Return the options."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    names = {"scenarios": SCENARIOS, "solvers": SOLVERS, "dynamics": ENGINES}
    for name, all_of_them in names.items():
        parser.add_argument(f"--{name}", nargs="+", choices=all_of_them, default=all_of_them)
    parser.add_argument("--control-points", nargs="+", type=int, default=CONTROL_POINTS)
    parser.add_argument("--runs", type=int, default=5, help="of every cell; an odd number is best")
    parser.add_argument("--limit", type=float, default=120.0, help="for a solve, seconds")
    parser.add_argument("--out", type=Path, default=Path("out/bench"))
    return parser


def main() -> None:
    """Solve what is missing, print the tables and write the numbers."""
    options = arguments().parse_args()
    wanted, runs, console = cells(options), Runs(options.out), Console()
    if not console.is_terminal:
        console.width = WIDTH
    run(wanted, runs, options.runs, options.limit, in_own_process)
    for shown in (
        cold_table(runs, wanted, options.solvers),
        warm_table(runs, wanted),
        growth_table(growth(runs, wanted)),
    ):
        if shown.rows:
            console.print(shown)
    text = json.dumps(report(runs, wanted, options.limit), indent=2)
    (options.out / "bench.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
