"""Medians, ratios, tables and taking up again of the benchmark of speed; the clock of the parts."""

import argparse
import json
from itertools import pairwise

import pytest
from rich.console import Console
from walks import BACKPACK, scenario

from benchmarks.evaluation import PARTS, SEAM, Clock, budget, medians, parts_table, patched
from benchmarks.one_solve import neighbour
from benchmarks.speed import (
    CHANGES,
    GROWING,
    KEYS,
    Runs,
    arguments,
    cells,
    cold_table,
    growth,
    growth_table,
    ratio,
    report,
    run,
    summary,
    warm_table,
)
from human_gait.problem import drake, program
from human_gait.problem.transcription import Transcription
from human_gait.scenario import Scenario

NEWTON = ("cold", "normal", "newton", "pinocchio", 8, 20)
SNOPT = ("cold", "normal", "snopt", "pinocchio", 8, 20)
LARGE = ("cold", "normal", "newton", "pinocchio", 20, 20)
LONG = ("cold", "normal", "newton", "pinocchio", 8, 80)
WARM = ("speed", "normal", "newton", "pinocchio", 8, 20)
SLOW = ("speed", "normal", "snopt", "pinocchio", 8, 20)
SOLVERS = ("newton", "snopt")


def solve(seconds, success=True, **rest):
    effort = {"iterations": 50, "evaluations": 60, "cost": 4000.0, "status": "optimal"}
    times = {"seconds": seconds, "build_s": 0.5, "solve_s": seconds - 0.5}
    size = {"variables": 275, "instants": 40}
    return {"success": success, **effort, **times, **size, **rest}


def result(seconds, warm=None, **rest):
    solves = {"cold": solve(seconds, **rest)}
    if warm:
        solves = {"first": solve(seconds), **solves, "warm": solve(warm, iterations=10)}
    return {"solves": solves, "peak_mb": 300.0, "imported_mb": 200.0}


def made_up(folder, **by_name):
    runs = Runs(folder)
    for name, members in by_name.items():
        for one in members:
            runs.add(globals()[name], one)
    return runs


def printed(shown):
    console = Console(width=200)
    with console.capture() as text:
        console.print(shown)
    return text.get()


def test_every_cell_is_wanted_once_and_cold_ones_come_first():
    wanted = cells(arguments().parse_args([]))
    assert len(wanted) == len(set(wanted))
    kinds = [cell[0] for cell in wanted]
    assert kinds == sorted(kinds, key=lambda kind: kind != "cold")
    assert kinds.count("cold") == 2 * 4 * 2 * 3 + len(GROWING) - 1
    assert {NEWTON, SNOPT, LARGE, LONG, WARM, SLOW} <= set(wanted)


def test_one_thing_after_another_is_raised_for_newton_and_one_for_the_others():
    wanted = cells(arguments().parse_args([]))
    changed = {
        (cell[1], solver): {other[0] for other in wanted if other[1:3] == (cell[1], solver)}
        for cell in wanted
        for solver in ("newton", "snopt")
    }
    assert changed["normal", "newton"] == {"cold", "speed", "step length"}
    assert changed["backpack-40", "newton"] == {"cold", "speed", "step length", "load"}
    assert changed["normal", "snopt"] == changed["backpack-40", "snopt"] == {"cold", "speed"}


@pytest.mark.parametrize("change", CHANGES)
def test_a_neighbour_differs_in_one_thing(change):
    task = scenario(load=BACKPACK)
    near = neighbour(task, change)
    numbers = [
        {"speed": one.walk.speed, "step length": one.walk.step_length, "load": one.load.mass}
        for one in (task, near)
    ]
    ratios = {name: numbers[1][name] / numbers[0][name] for name in CHANGES}
    assert ratios == pytest.approx(dict.fromkeys(CHANGES, 1.0) | {change: 1.05})


def test_few_cells_can_be_asked_for():
    few = ["--scenarios", "normal", "--solvers", "snopt", "--control-points", "8"]
    assert cells(arguments().parse_args([*few, "--dynamics", "pinocchio"])) == [SNOPT, SLOW]


def test_medians_count_the_walks(tmp_path):
    runs = made_up(tmp_path, NEWTON=[result(3.0), result(9.0, success=False), result(4.0)])
    found = summary(runs, NEWTON)
    assert found["runs"] == 3
    assert found["solves"]["cold"]["seconds"] == 4.0
    assert found["solves"]["cold"]["solve_s"] == 3.5
    assert found["solves"]["cold"]["walks"] == 2
    assert "no walk 1/3" in printed(cold_table(runs, [NEWTON], SOLVERS))
    assert "solves" not in summary(runs, SNOPT)


def test_ratios_are_those_of_one_round(tmp_path):
    newton, snopt = [2.0, 4.0, 3.0], [20.0, 44.0, 27.0]
    runs = made_up(tmp_path, NEWTON=[result(s) for s in newton], SNOPT=[result(s) for s in snopt])
    assert ratio(runs, SNOPT, NEWTON) == (10.0, False)
    assert "10.0" in printed(cold_table(runs, [NEWTON, SNOPT], SOLVERS))
    assert ratio(runs, NEWTON, LARGE) is None


def test_a_cell_over_the_limit_bounds_the_ratio(tmp_path):
    runs = made_up(tmp_path, NEWTON=[result(4.0)], SNOPT=[{"over": 120.0}])
    assert ratio(runs, SNOPT, NEWTON) == (30.0, True)
    text = printed(cold_table(runs, [NEWTON, SNOPT], SOLVERS))
    assert "over 120" in text
    assert "> 30.0" in text
    assert "over 120" in printed(warm_table(runs, [SLOW]))


def test_warm_solves_are_compared_side_by_side(tmp_path):
    runs = made_up(tmp_path, WARM=[result(4.0, 1.0), result(6.0, 2.0), result(10.0, 2.5)])
    assert summary(runs, WARM)["warm_ratio"] == 4.0
    text = printed(warm_table(runs, [WARM]))
    assert "6.00" in text
    assert "10/60" in text


def test_growth_starts_from_the_smallest(tmp_path):
    long = result(12.0, iterations=75, instants=160)
    runs = made_up(tmp_path, NEWTON=[result(4.0)], LARGE=[result(15.0)], LONG=[long])
    rows = growth(runs, [LARGE, LONG, NEWTON, SNOPT])
    assert [(row["grows"], row["size"]) for row in rows] == [
        *(("control points", size) for size in (8, 20)),
        *(("instants", size) for size in (40, 160)),
    ]
    points, instants = rows[1], rows[3]
    assert points["against_linear"] == pytest.approx(15.0 / 4.0 / 2.5)
    assert instants["relative"] == 3.0
    assert instants["linear"] == 4.0
    assert instants["step_against_linear"] == pytest.approx(3.0 / 1.5 / 4.0)
    assert "3.75" in printed(growth_table(rows))


def test_a_run_goes_on_where_it_was_stopped(tmp_path):
    """Round by round, each cell in turn; half a line is done again."""
    asked = []

    def runner(cell, _):
        asked.append(cell)
        if len(asked) == 4:
            raise KeyboardInterrupt
        return result(3.0)

    wanted = [NEWTON, LARGE]
    with pytest.raises(KeyboardInterrupt):
        run(wanted, Runs(tmp_path), 3, 120.0, runner)
    with (tmp_path / "runs.jsonl").open("a") as file:
        file.write('{"kind": "cold"')
    run(wanted, Runs(tmp_path), 3, 120.0, runner)
    assert asked == [NEWTON, LARGE, NEWTON, LARGE, LARGE, NEWTON, LARGE]
    lines = [json.loads(line) for line in (tmp_path / "runs.jsonl").read_text().splitlines()]
    assert [tuple(line[key] for key in KEYS) for line in lines] == wanted * 3
    run(wanted, Runs(tmp_path), 3, 120.0, runner)
    assert len(asked) == 7


def test_what_is_over_the_limit_is_not_run_again(tmp_path):
    """Nor warm, but with a higher limit."""
    asked = []

    def runner(cell, limit):
        asked.append(cell)
        return result(3.0) if limit > 120.0 else {"over": limit}

    run([SNOPT, SLOW], Runs(tmp_path), 3, 120.0, runner)
    assert asked == [SNOPT]
    run([SNOPT, SLOW], Runs(tmp_path), 1, 100.0, runner)
    assert asked == [SNOPT]
    run([SNOPT], Runs(tmp_path), 2, 300.0, runner)
    assert asked == [SNOPT] * 3


def test_the_report_has_machine_runs_and_medians(tmp_path):
    runs = made_up(tmp_path, NEWTON=[result(4.0), {"error": "no memory"}])
    found = json.loads(json.dumps(report(runs, [NEWTON, LARGE], 120.0)))
    assert found["machine"]["versions"]["pin"]
    assert [one["runs"] for one in found["medians"]] == [1, 0]
    assert found["medians"][0]["errors"] == ["no memory"]
    assert len(found["runs"]) == 2


def test_the_limit_and_the_number_of_runs_can_be_chosen():
    chosen = arguments().parse_args(["--runs", "7", "--limit", "30"])
    assert isinstance(chosen, argparse.Namespace)
    assert (chosen.runs, chosen.limit) == (7, 30.0)


# The clock


class Hands:
    """A clock that is moved by hand."""

    def __init__(self):
        self.time = 0.0

    def __call__(self):
        return self.time


def test_the_parts_of_the_clock_add_up():
    """A part does not count what the parts that it calls take, not even itself."""
    hands = Hands()
    clock = Clock(hands)

    def inner(seconds):
        hands.time += seconds

    inner_timed = clock.timed("inner", inner)

    def outer(depth):
        hands.time += 1.0
        inner_timed(10.0)
        if depth:
            outer_timed(depth - 1)
        hands.time += 2.0

    outer_timed = clock.timed("outer", outer)
    hands.time += 500.0  # outside
    with clock.part("all"):
        hands.time += 0.5
        outer_timed(2)
    hands.time += 500.0
    assert clock.spent == {"all": 0.5, "outer": 9.0, "inner": 30.0}
    assert sum(clock.spent.values()) == hands.time - 1000.0
    assert clock.calls == {"all": 1, "outer": 3, "inner": 3}


def test_the_clock_keeps_in_step_when_a_part_fails():
    hands = Hands()
    clock = Clock(hands)

    def fails():
        hands.time += 3.0
        raise ValueError("late")

    with clock.part("all"):
        with pytest.raises(ValueError, match="late"):
            clock.timed("part", fails)()
        hands.time += 1.0
    assert clock.spent == {"all": 1.0, "part": 3.0}


def test_functions_are_timed_only_while_they_are_patched():
    walk = {"speed": 1.2, "step_length": 0.7}
    scenario = Scenario.from_dict({"name": "walk", "walk": walk})
    before = Transcription.motion, drake._seam
    clock = Clock()
    with patched(clock):
        task = program.build_program(scenario)
        clock.clear()
        with clock.part("all"):
            task.cost(task.guess())
            task.torques.prog.EvalBindings(
                task.torques.prog.GetAllCosts(), task.guess() / task.unit
            )
    assert (Transcription.motion, drake._seam) == before
    for part in ("dynamics", "feet", "chain rule, first derivatives", "objective", "all"):
        assert clock.spent[part] > 0.0
        assert clock.calls[part] >= 1
    assert clock.calls[SEAM] == len(task.terms)
    assert set(clock.spent) <= {*PARTS, SEAM, "all"}


def test_the_budget_is_the_bare_derivatives_of_all_iterations():
    us = {"bare_first_cpp": 50.0, "bare_second_cpp": 450.0}
    counts = {"iterations": 50, "evaluations": 60}
    parts = {"newton": {"tree": 2.0, "rest": 1.0}}
    found = {"solves": {"newton": counts}, "instants": 40, "cold_newton_s": 3.0, "parts_s": parts}
    assert budget({**found, "per_instant_us": {}}) is None
    bare = budget({**found, "per_instant_us": us})
    assert bare == {"states": 2000, "bare_s": pytest.approx(1.0), "ratio": pytest.approx(3.0)}
    text = printed(parts_table({**found, "budget": bare}, "newton"))
    assert [text.index(name) for name in ("tree", "rest", "together")] == sorted(
        text.index(name) for name in ("tree", "rest", "together")
    )
    assert "66.7" in text
    assert "of bare" not in printed(parts_table({**found, "budget": None}, "newton"))


def test_medians_take_what_a_run_lacks_for_nothing():
    found = medians([{"a": 1.0}, {"a": 3.0, "b": 5.0}, {"a": 2.0, "b": 4.0}])
    assert found == {"a": 2.0, "b": 4.0}
    assert all(low <= high for low, high in pairwise(sorted(found.values())))
