"""What `speed.py` measured, as tables and as a picture."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

BEFORE, NOW, PLAIN = "before", "now", "without kernel"
"""Sides: the baseline, this tree, this tree without its kernel."""

Runs = Mapping[str, Mapping[str, Sequence[Mapping[str, Any]]]]
"""Answers by task and side, one of each round."""

FASTER = {6: 3.5, 8: 3.5, 12: 2.5, 20: 2.0, 40: 4.0}
"""How many times as fast cold solves must be, by control points."""
PLAIN_FASTER = 1.6
SAME = 1e-6  # of the cost
AT = 8  # control points of what warm starts are compared at with the baseline
WARM_FASTER, THAN_COLD, OF_CELLS = 3.0, 4.0, 0.9
ESTIMATE_MS = 30.0
OF_LIMIT = 3.0
FOUND_FASTER, DRAWN_FASTER, IMPORT_S, HELP_S = 3.0, 2.0, 0.1, 0.2
WALKS, CORE_HOURS, MORE_MEMORY = 1000, 0.15, 1.05
FORMULATIONS = {"paper-normal": "effort", "normal": "human"}
SIZES = {"points": "control points", "instants": "instants"}

Of = tuple[str, str, str]  # task, side, number


class Claim(NamedTuple):
    """A line of what must hold; measured is None where something is missing."""

    what: str
    measured: float | None
    wanted: float
    least: bool = True  # else it is the most
    more: str = ""

    @property
    def cells(self) -> list[str]:
        """Return the cells of its row."""
        wanted = f"{'at least' if self.least else 'at most'} {self.wanted:g}"
        if self.measured is None or np.isnan(self.measured):
            return [self.what, "not measured", wanted, "", self.more]
        off = (self.measured - self.wanted) * (1 if self.least else -1)
        return [self.what, f"{self.measured:.3g}", wanted, "yes" if off >= 0 else "NO", self.more]


def numbers(runs: Runs, of: Of) -> list[float]:
    """Return a number of every round, nan where there is none."""
    task, side, name = of
    answers = runs.get(task, {}).get(side, [])
    return [float(answer.get(name, np.nan)) for answer in answers]


def median(runs: Runs, *of: str) -> float:
    """Return the median of a number over the rounds; nan if there is none."""
    found = np.array(numbers(runs, (of[0], of[1], of[2])))
    found = found[~np.isnan(found)]
    return float(np.median(found)) if len(found) else float("nan")


def ratio(runs: Runs, slow: Of, fast: Of) -> float:
    """Return how many times as long something takes as another one: the median of the rounds'."""
    pairs = zip(numbers(runs, slow), numbers(runs, fast), strict=False)
    found = [a / b for a, b in pairs if not np.isnan(a / b)]
    return float(np.median(found)) if found else float("nan")


def faster(runs: Runs, task: str, side: str = NOW, name: str = "seconds") -> float:
    """Return how many times as fast as the baseline something is."""
    return ratio(runs, (task, BEFORE, name), (task, side, name))


def dearer(runs: Runs, task: str) -> float:
    """Return by which part the cost is above the baseline's; nan unless both converged."""
    both = [runs.get(task, {}).get(side, []) for side in (BEFORE, NOW)]
    if not all(one and one[0].get("converged") for one in both):
        return float("nan")
    return median(runs, task, NOW, "cost") / median(runs, task, BEFORE, "cost") - 1.0


def claims(runs: Runs) -> list[Claim]:
    """Return every line of what must hold."""
    return [
        *_cold(runs),
        *_warm(runs),
        *_default(runs),
        *_command(runs),
        *_many(runs),
        *_growth(runs),
    ]


def _cold(runs: Runs) -> Iterator[Claim]:
    for points, wanted in FASTER.items():
        seconds = median(runs, f"cold {points}", NOW, "seconds")
        what = f"cold, {points} control points: times faster"
        yield Claim(what, faster(runs, f"cold {points}"), wanted, more=f"{seconds:.2f} s")
    for points in (6, 8, 12):
        what = f"cold, {points} control points, without kernel: times faster"
        yield Claim(what, faster(runs, f"cold {points}", PLAIN), PLAIN_FASTER)
    worst = [dearer(runs, f"cold {points}") for points in FASTER]
    most = max((one for one in worst if not np.isnan(one)), default=None)
    yield Claim("cold: cost above that of the baseline, as a part of it", most, SAME, least=False)


def cells(runs: Runs) -> list[str]:
    """Return the names of warm cells: scenario, change, control points."""
    return [task.removeprefix("warm ") for task in runs if task.startswith("warm ")]


def than_cold(runs: Runs, cell: str) -> float:
    """Return how many times as long as warm the same problem takes cold, both here."""
    return ratio(runs, (f"raised {cell}", NOW, "seconds"), (f"warm {cell}", NOW, "seconds"))


def _warm(runs: Runs) -> Iterator[Claim]:
    for cell in cells(runs):
        if cell.endswith(f" {AT}"):
            seconds = median(runs, f"warm {cell}", NOW, "seconds")
            what = f"warm, 5 % more: {cell} control points: times faster"
            yield Claim(what, faster(runs, f"warm {cell}"), WARM_FASTER, more=f"{seconds:.3f} s")
    found = [than_cold(runs, cell) for cell in cells(runs)]
    share = float(np.mean([one >= THAN_COLD for one in found])) if found else None
    what = f"warm: part of {len(found)} cells {THAN_COLD:g} times as fast as cold here"
    yield Claim(what, share, OF_CELLS)
    for scenario, words in FORMULATIONS.items():
        spent = 1e3 * median(runs, f"estimate {scenario}", NOW, "seconds")
        yield Claim(f"an estimate, formulation {words}: ms", spent, ESTIMATE_MS, least=False)


def limits(runs: Runs, scenario: str) -> dict[str, float]:
    """Return what an iteration takes at least, [ms], in words."""
    first = median(runs, "limit", NOW, "first_ms")
    second = median(runs, "limit", NOW, "second_ms")
    flops = median(runs, f"flops {scenario}", NOW, "flops")
    products = flops / median(runs, "limit", NOW, "gemm_gflops") / 1e6
    return {
        "first and second derivatives by Pinocchio alone": first + second,
        "first derivatives by Pinocchio, own products at the speed of gemm": first + products,
    }


def _iterations(runs: Runs) -> dict[str, float]:
    """Return the time of an iteration by scenario, [ms]."""
    tasks = {"paper-normal": "cold 8", "normal": "default"}
    return {name: median(runs, task, NOW, "iteration_ms") for name, task in tasks.items()}


def _default(runs: Runs) -> Iterator[Claim]:
    seconds = median(runs, "default", NOW, "seconds")
    of = ("cold 8", BEFORE, "seconds"), ("default", NOW, "seconds")
    what = "default formulation, cold: times faster than the baseline's `normal`"
    yield Claim(what, ratio(runs, *of), 1.0, more=f"{seconds:.2f} s")
    spent = _iterations(runs)["normal"]
    for words, limit in limits(runs, "normal").items():
        what = f"default formulation, an iteration in parts of the limit: {words}"
        more = f"{spent:.1f} of {limit:.1f} ms"
        yield Claim(what, spent / limit, OF_LIMIT, least=False, more=more)


def _command(runs: Runs) -> Iterator[Claim]:
    task = "predict paper-normal"
    for name, word, wanted in (
        ("found_seconds", "until a walk is found", FOUND_FASTER),
        ("seconds", "until all is drawn", DRAWN_FASTER),
    ):
        both = " and ".join(f"{median(runs, task, side, name):.2f}" for side in (BEFORE, NOW))
        what = f"`predict paper-normal` {word}: times faster"
        yield Claim(what, faster(runs, task, name=name), wanted, more=f"{both} s")
        of = (task, BEFORE, name), ("predict normal", NOW, name)
        more = f"{median(runs, 'predict normal', NOW, name):.2f} s"
        yield Claim(f"`predict normal` {word}: times faster", ratio(runs, *of), wanted, more=more)
    for task, words, most in (
        ("import", "`import human_gait`: s", IMPORT_S),
        ("help", "`--help`: s", HELP_S),
    ):
        more = f"baseline {median(runs, task, BEFORE, 'seconds'):.2f} s"
        yield Claim(words, median(runs, task, NOW, "seconds"), most, least=False, more=more)


def _many(runs: Runs) -> Iterator[Claim]:
    for scenario, words in FORMULATIONS.items():
        task = f"many {scenario}"
        each, walks, missing = (
            median(runs, task, NOW, name) for name in ("seconds", "walks", "not_found")
        )
        what = f"{WALKS} neighbouring walks, verified, formulation {words}: core-hours"
        more = f"from {walks:.0f}, {missing:.0f} of them not found; {each:.2f} s each"
        yield Claim(what, WALKS * each / 3600.0, CORE_HOURS, least=False, more=more)
        then, now = (median(runs, task, NOW, name) for name in ("memory_then_mb", "memory_mb"))
        what = f"the same, formulation {words}: memory at their end / at a third of them"
        yield Claim(what, now / then, MORE_MEMORY, least=False, more=f"{then:.0f} and {now:.0f} MB")


def grown(runs: Runs, size: str, scenario: str) -> dict[int, float]:
    """Return the time of an iteration [ms] by control points or instants."""
    start = f"{size} {scenario} "
    found = {int(task.removeprefix(start)): task for task in runs if task.startswith(start)}
    times = {n: median(runs, found[n], NOW, "iteration_ms") for n in sorted(found)}
    return {n: time for n, time in times.items() if not np.isnan(time)}


def _growth(runs: Runs) -> Iterator[Claim]:
    for scenario, words in FORMULATIONS.items():
        for size, name in SIZES.items():
            times = grown(runs, size, scenario)
            if len(times) > 1:
                (least, first), *_, (most, last) = times.items()
                what = f"an iteration, formulation {words}, {least} to {most} {name}: times as long"
                more = ", ".join(f"{n}: {time:.1f}" for n, time in times.items()) + " ms"
                yield Claim(what, last / first, most / least, least=False, more=more)


def report(found: Mapping[str, Any]) -> str:
    """Return all tables as Markdown."""
    runs, machine, baseline = found["runs"], found["machine"], found["baseline"]
    kernel = "" if machine["kernel"] else " There is no compiled kernel: both trees are in numpy."
    told = (
        f"{machine['processor']}, {machine['cores']} cores; medians of {found['rounds']} rounds, "
        f"CPU seconds, one thread; it took {found['took_s'] / 60:.0f} minutes. The baseline is "
        f"{baseline}, on its own formulation, in turns.{kernel}"
    )
    parts = [
        f"# Speed\n\n{told}\n",
        _table(["", "measured", "wanted", "held", ""], (claim.cells for claim in claims(runs))),
        "## Cold solves: `paper-normal`, and `normal` as it is\n",
        _table(
            ["control points", "baseline: s, iterations, cost", "here", "without kernel"],
            [
                *(_cold_row(runs, points) for points in FASTER),
                ["14, `normal`, default formulation", "", _solve(runs, "default", NOW), ""],
            ],
        ),
        "## Something 5 % more, from the walk before\n",
        _table(
            ["", "baseline: s, iterations, cost", "here", "here, cold", "faster", "cold / warm"],
            (_warm_row(runs, cell) for cell in cells(runs)),
        ),
        "## An iteration and the limit\n",
        _table(["", "ms"], _limit_rows(runs)),
    ]
    wrong = [
        f"* {task}, {side}: {answer['error']}\n"
        for task, sides in runs.items()
        for side, answers in sides.items()
        for answer in answers
        if "error" in answer
    ]
    return "\n".join([*parts, *(["## What failed\n", *dict.fromkeys(wrong)] if wrong else [])])


def _table(head: list[str], rows: Iterable[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _solve(runs: Runs, task: str, side: str) -> str:
    """Return seconds, iterations and cost of a solve in words."""
    seconds, steps, cost = (
        median(runs, task, side, name) for name in ("seconds", "iterations", "cost")
    )
    if np.isnan(seconds):
        return ""
    answers = runs[task][side]
    word = "" if all(one.get("converged", False) for one in answers) else ", not converged"
    return f"{seconds:.2f}, {steps:.0f}, {cost:.2f}{word}"


def _cold_row(runs: Runs, points: int) -> list[str]:
    return [str(points), *(_solve(runs, f"cold {points}", side) for side in (BEFORE, NOW, PLAIN))]


def _warm_row(runs: Runs, cell: str) -> list[str]:
    warm = f"warm {cell}"
    solves = (
        _solve(runs, warm, BEFORE),
        _solve(runs, warm, NOW),
        _solve(runs, f"raised {cell}", NOW),
    )
    return [cell, *solves, f"{faster(runs, warm):.2f}", f"{than_cold(runs, cell):.2f}"]


def _limit_rows(runs: Runs) -> Iterator[list[str]]:
    for name, words in (
        ("first_ms", "first derivatives at 40 instants by Pinocchio, from Python"),
        ("second_ms", "second derivatives at 40 instants by Pinocchio, in C++"),
    ):
        yield [words, f"{median(runs, 'limit', NOW, name):.2f}"]
    for answer in runs.get("limit", {}).get(NOW, [])[:1]:
        if why := answer.get("no_second"):
            yield [f"no second derivatives by Pinocchio: {why}", ""]
    speed = median(runs, "limit", NOW, "gemm_gflops")
    for scenario, words in FORMULATIONS.items():
        flops = median(runs, f"flops {scenario}", NOW, "flops")
        what = f"formulation {words}: {flops / 1e6:.0f} MFLOP in products, {speed:.0f} GFLOP/s"
        yield [what, f"{flops / speed / 1e6:.2f}"]
        yield [f"formulation {words}: an iteration", f"{_iterations(runs)[scenario]:.2f}"]
    yield [
        "baseline, 8 control points: an iteration",
        f"{median(runs, 'cold 8', BEFORE, 'iteration_ms'):.2f}",
    ]


def picture(runs: Runs, path: Path) -> None:
    """Draw how an iteration grows with the problem, beside straight lines through the origin."""
    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    of_baseline = {n: median(runs, f"cold {n}", BEFORE, "iteration_ms") for n in FASTER}
    for axes, (size, label) in zip(
        figure.subplots(1, 2),
        {"points": "control points", "instants": "instants"}.items(),
        strict=True,
    ):
        for k, (scenario, words) in enumerate(FORMULATIONS.items()):
            times = grown(runs, size, scenario)
            if not times:
                continue
            n, ms = list(times), list(times.values())
            axes.plot(n, ms, "o-", color=f"C{k}", markersize=4, label=words)
            axes.plot([0, n[-1]], [0, ms[0] / n[0] * n[-1]], ":", color=f"C{k}", label="linear")
        if size == "points":
            axes.plot(
                list(of_baseline), list(of_baseline.values()), "s", color="0.5", label="baseline"
            )
        axes.set(xlabel=label, ylabel="an iteration [ms]", xlim=(0, None), ylim=(0, None))
        if axes.lines:
            axes.legend(frameon=False)
    figure.savefig(path)
