"""How fast walks are predicted, beside an older version of the package and beside the limit.

    python -m benchmarks.speed [--rounds N] [--out DIR]

The older version is `BASELINE`, taken from the repository into build/bench; without it this tree
alone is measured. A process of each tree, and one of this tree without its kernel, answer tasks
(`speed_worker.py`) in turns; the command line runs as whole processes. Everything is done in N
rounds, few things that take long in every third one. Times are CPU seconds, with one thread for
products of matrices; medians are told, and of ratios the median of those of one round.

Writes speed.json, speed.md and speed.svg to DIR. Takes under half an hour on a machine that does
nothing else, which it should.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import platform
import subprocess
import sys
import tarfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from rich.console import Console

from benchmarks.speed_table import BEFORE, NOW, PLAIN, Runs, picture, report

BASELINE = "6730a85"
"""Commit that everything is compared with."""

HERE = Path(__file__).parents[1]
BUILD = HERE / "build" / "bench"
WORKER = Path(__file__).with_name("speed_worker.py")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
PACKAGES = ("drake", "pin", "numpy", "scipy", "daqp")

POINTS = (6, 8, 12, 20, 40)
FEW = (6, 8, 12)
MANY = 40
CHANGES = {"paper-normal": ("speed", "step"), "paper-backpack-40": ("speed", "step", "load")}
INTERVALS = (12, 20, 40, 80)  # of two instants each
ITERATIONS = 12
SELDOM = 3  # every so many rounds
FOUND = "found a walk in"
PROGRAM = {BEFORE: ["-c", "from human_gait.cli import main; main()"], NOW: ["-m", "human_gait"]}

Answer = dict[str, Any]
Measure = Callable[[str], Answer]


@dataclass(frozen=True)
class Task:
    """Something to measure.

    Attributes
    ----------
    key : str
    sides : tuple of str
        Which trees: ``BEFORE``, ``NOW``, ``PLAIN``.
    given : dict
        To a worker, or a ``command`` to run, by side or for all.
    every : int
        In which rounds: every so many, from the first one on.
    """

    key: str
    sides: tuple[str, ...]
    given: dict[str, Any] = field(default_factory=dict)
    every: int = 1


def tasks(rounds: int) -> list[Task]:
    """Return everything that is measured in so many rounds."""
    both, three = (BEFORE, NOW), (BEFORE, NOW, PLAIN)
    found = [Task("limit", (NOW,), {"do": "limit", "folder": str(BUILD), "instants": 40})]
    for points in POINTS:
        given = {"do": "cold", "scenario": "paper-normal", "points": points}
        every = SELDOM if points == MANY else 1
        found.append(Task(f"cold {points}", three if points in FEW else both, given, every))
    for scenario, changes in CHANGES.items():
        for points in FEW:
            for change in changes:
                given = {"scenario": scenario, "points": points, "change": change}
                cell = f"{scenario} {change} {points}"
                found.append(Task(f"warm {cell}", both, {"do": "warm", **given}))
                found.append(Task(f"raised {cell}", (NOW,), {"do": "cold", **given}))
    found.append(Task("default", (NOW,), {"do": "cold", "scenario": "normal"}))
    for scenario in ("paper-normal", "normal"):
        for what, every in {"estimate": 1, "flops": rounds}.items():
            given = {"do": what, "scenario": scenario}
            found.append(Task(f"{what} {scenario}", (NOW,), given, every))
    return [*found, *_growth(), *_commands(), *_neighbours(rounds)]


def _growth() -> Iterable[Task]:
    for scenario, points in (("paper-normal", 8), ("normal", 14)):
        of = {"do": "iteration", "most": ITERATIONS, "scenario": scenario}
        for n in sorted({6, 8, 12, 16, 20, 30, 40, points}):
            yield Task(f"points {scenario} {n}", (NOW,), {**of, "points": n})
        for n in INTERVALS:
            given = {**of, "points": points, "intervals": n}
            yield Task(f"instants {scenario} {2 * n}", (NOW,), given)


def _commands() -> Iterable[Task]:
    def predict(side: str, scenario: str) -> list[str]:
        return [*PROGRAM[side], "predict", f"scenarios/{scenario}.toml", "--out", "{out}"]

    both = (BEFORE, NOW)
    paper = {BEFORE: predict(BEFORE, "normal"), NOW: predict(NOW, "paper-normal")}
    yield Task("predict paper-normal", both, {"command": paper})
    yield Task("predict normal", (NOW,), {"command": {NOW: predict(NOW, "normal")}})
    yield Task("import", both, {"command": {side: ["-c", "import human_gait"] for side in both}})
    yield Task("help", both, {"command": {side: [*PROGRAM[side], "--help"] for side in both}})


def _neighbours(rounds: int) -> Iterable[Task]:
    for scenario, walks in {"paper-normal": 60, "normal": 30}.items():
        given = {"do": "many", "scenario": scenario, "walks": walks}
        yield Task(f"many {scenario}", (NOW,), given, rounds)


class Worker:
    """A process that measures a tree.

    Parameters
    ----------
    tree : Path
    kernel : bool
        Whether to use the compiled kernel, if there is one.
    """

    def __init__(self, tree: Path, kernel: bool = True) -> None:
        self._process = subprocess.Popen(
            [sys.executable, str(WORKER)],
            env=environment(tree) | ({} if kernel else {"HUMAN_GAIT_KERNEL": "0"}),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: BaseException | TracebackType | None):
        if kind:
            self._process.kill()
        self._process.communicate()

    def ask(self, given: Mapping[str, Any]) -> Answer:
        """Return the answer to a task."""
        self._process.stdin.write(json.dumps(given) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        return dict(json.loads(line)) if line else {"error": "the process has ended"}


def environment(tree: Path) -> dict[str, str]:
    """Return the environment of processes that use a tree."""
    return os.environ | dict.fromkeys(THREADS, "1") | {"PYTHONPATH": str(tree)}


def run(command: list[str], tree: Path, out: Path) -> Answer:
    """Run a command of a tree.

    Returns CPU and wall seconds, and those until it tells of a walk; as a terminal, it is told
    everything at once.
    """
    command = [sys.executable, *(part.format(out=out) for part in command)]
    surroundings = environment(tree) | {"PYTHONUNBUFFERED": "1"}
    began, found = time.perf_counter(), {}
    process = subprocess.Popen(
        command,
        cwd=tree,
        env=surroundings,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    last = ""
    with process.stdout as lines:
        for line in lines:
            last = line.strip() or last
            if FOUND in line:
                found = {
                    "found_wall": time.perf_counter() - began,
                    "found_seconds": cpu(process.pid),
                }
    _, status, spent = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        return {"error": last}
    seconds = spent.ru_utime + spent.ru_stime
    return {"seconds": seconds, "wall": time.perf_counter() - began, **found}


def cpu(pid: int) -> float:
    """Return the CPU seconds of a process up to now; nan where there is no /proc."""
    path = Path(f"/proc/{pid}/stat")
    if not path.exists():
        return float("nan")
    ticks = path.read_text().rpartition(")")[2].split()[11:15]  # own and those of its children
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


def baseline() -> Path | None:
    """Return the tree of the older version, taken from the repository if need be; None if not."""
    tree = BUILD / BASELINE
    if not tree.exists():
        command = ["git", "-C", str(HERE), "archive", BASELINE, "human_gait", "scenarios"]
        try:
            done = subprocess.run(command, capture_output=True, check=True)
        except (OSError, subprocess.CalledProcessError):
            return None
        with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
            archive.extractall(tree, filter="data")
    return tree


def measured(
    wanted: list[Task], rounds: int, asks: Mapping[str, Callable[[Task], Answer]], tell: Measure
) -> Runs:
    """Measure all in turns; return the answers by task and side, a list of those of the rounds."""
    runs: Runs = defaultdict(lambda: defaultdict(list))
    for number in range(rounds):
        for task in wanted if number % 2 == 0 else reversed(wanted):
            if number % task.every:
                continue
            for side in [side for side in task.sides if side in asks][:: 1 - 2 * (number % 2)]:
                tell(f"round {number + 1} of {rounds}: {task.key}, {side}")
                runs[task.key][side].append(asks[side](task))
    return runs


def machine() -> dict[str, Any]:
    """Return what the times depend on."""
    lines = Path("/proc/cpuinfo")
    text = lines.read_text(encoding="utf-8") if lines.exists() else ""
    models = [line.partition(":")[2].strip() for line in text.splitlines() if "model name" in line]
    return {
        "processor": models[0] if models else platform.processor(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "versions": {name: version(name) for name in PACKAGES},
    }


def asking(worker: Worker, side: str, tree: Path, out: Path) -> Callable[[Task], Answer]:
    """Return what answers tasks for a side."""

    def ask(task: Task) -> Answer:
        if command := task.given.get("command"):
            return run(command[side], tree, out / side)
        return worker.ask(task.given)

    return ask


def main() -> None:
    """Measure everything and write it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7, help="an odd number is best")
    parser.add_argument("--out", type=Path, default=Path("out/bench"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    BUILD.mkdir(parents=True, exist_ok=True)
    console, began, before = Console(stderr=True), time.perf_counter(), baseline()
    if before is None:
        console.print(f"{BASELINE} is not in the repository: this tree alone is measured")
    trees = {BEFORE: before, NOW: HERE, PLAIN: HERE}
    with ExitStack() as stack, console.status("") as status:
        workers = {
            side: stack.enter_context(Worker(tree, side != PLAIN))
            for side, tree in trees.items()
            if tree
        }
        kernel = workers[NOW].ask({"do": "hello"})["kernel"]
        asks = {side: asking(one, side, trees[side], BUILD) for side, one in workers.items()}
        runs = measured(tasks(options.rounds), options.rounds, asks, status.update)
    found = {
        "machine": machine() | {"kernel": kernel},
        "baseline": BASELINE,
        "rounds": options.rounds,
        "took_s": time.perf_counter() - began,
        "runs": runs,
    }
    (options.out / "speed.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    text = report(found)
    (options.out / "speed.md").write_text(text, encoding="utf-8")
    picture(runs, options.out / "speed.svg")
    sys.stdout.write(text)


if __name__ == "__main__":
    main()
