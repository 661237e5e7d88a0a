"""Turns, medians, ratios, claims and tables of the benchmark of speed, and its processes."""

import itertools
import os
import sys
import time
from collections import defaultdict
from pathlib import Path

import pytest
from walks import BACKPACK, scenario

from benchmarks import speed
from benchmarks.limit import counted, flops
from benchmarks.speed import HERE, Task, Worker, baseline, cpu, measured, run, tasks
from benchmarks.speed_table import (
    BEFORE,
    FASTER,
    NOW,
    PLAIN,
    SAME,
    Claim,
    claims,
    dearer,
    faster,
    grown,
    median,
    picture,
    ratio,
    report,
)
from benchmarks.speed_worker import TASKS, neighbour, task
from human_gait.problem.grid import Half
from human_gait.problem.program import build_program

SIDES = (BEFORE, NOW, PLAIN)


def runs_of(seconds, name="seconds"):
    return {
        key: {side: [{name: one} for one in each] for side, each in sides.items()}
        for key, sides in seconds.items()
    }


def all_of_them(rounds=3):
    """Return made-up answers of all tasks: the baseline takes ten times as long."""
    found = defaultdict(lambda: defaultdict(list))
    for number, one in itertools.product(range(rounds), tasks(rounds)):
        for side in one.sides:
            size = 10.0 if side == BEFORE else 1.0
            names = "seconds found_seconds iteration_ms iterations first_ms second_ms gemm_gflops"
            answered = dict.fromkeys([*names.split(), "walks", "memory_mb", "memory_then_mb"], size)
            rest = {"cost": 4000.0, "converged": True, "flops": 1e8, "not_found": 0.0}
            if number % one.every == 0:
                found[one.key][side].append(answered | rest)
    return found


# Numbers


def test_a_median_leaves_out_what_failed():
    runs = runs_of({"cold 8": {NOW: [9.0, 1.0, 2.0]}})
    runs["cold 8"][NOW].append({"error": "no memory"})
    assert median(runs, "cold 8", NOW, "seconds") == 2.0
    assert median(runs, "cold 8", BEFORE, "seconds") != median(runs, "cold 8", BEFORE, "seconds")


def test_ratios_are_those_of_one_round():
    runs = runs_of({"cold 8": {BEFORE: [20.0, 44.0, 27.0], NOW: [2.0, 4.0, 3.0]}})
    assert faster(runs, "cold 8") == 10.0
    runs["cold 8"][BEFORE][1] = {"error": "no memory"}
    assert ratio(runs, ("cold 8", BEFORE, "seconds"), ("cold 8", NOW, "seconds")) == 9.5


@pytest.mark.parametrize(("measure", "least", "held"), [(2.0, True, "yes"), (2.0, False, "NO")])
def test_what_must_hold_is_a_least_or_a_most(measure, least, held):
    assert Claim("", measure, 1.0, least).cells[3] == held
    assert Claim("", 1.0 / measure, 1.0, not least).cells[3] == held


def test_what_is_not_measured_holds_nothing():
    for none in (None, float("nan")):
        assert Claim("", none, 1.0).cells[1:4] == ["not measured", "at least 1", ""]


@pytest.mark.parametrize("change", [0.0, -0.1, 1e-3])
def test_a_cost_is_compared_where_both_converged(change):
    runs = all_of_them()
    for one in runs["cold 12"][NOW]:
        one["cost"] *= 1.0 + change
    assert dearer(runs, "cold 12") == pytest.approx(change)
    (claim,) = (claim for claim in claims(runs) if "cost" in claim.what)
    assert (claim.cells[3] == "yes") == (change <= SAME)
    runs["cold 12"][NOW][0]["converged"] = False
    assert dearer(runs, "cold 12") != dearer(runs, "cold 12")


def test_growth_goes_by_size():
    runs = runs_of(
        {f"instants normal {n}": {NOW: [ms]} for n, ms in {160: 40.0, 20: 4.0, 40: 9.0}.items()},
        "iteration_ms",
    )
    assert grown(runs, "instants", "normal") == {20: 4.0, 40: 9.0, 160: 40.0}
    (claim,) = (claim for claim in claims(runs) if "20 to 160 instants" in claim.what)
    assert (claim.measured, claim.wanted, claim.cells[3]) == (10.0, 8.0, "NO")


# What is measured


def test_every_task_has_a_name_of_its_own_and_an_answerer():
    names = [one.key for one in tasks(7)]
    assert len(names) == len(set(names))
    for one in tasks(7):
        if command := one.given.get("command"):
            assert set(command) >= set(one.sides)
        else:
            assert one.given["do"] in TASKS


def test_every_claim_is_measured_and_needs_the_baseline_only_to_compare():
    runs = all_of_them()
    assert all(claim.cells[3] for claim in claims(runs))
    for sides in runs.values():
        sides.pop(BEFORE, None)
    alone = [claim for claim in claims(runs) if not claim.cells[3]]
    assert alone
    assert all("faster" in claim.what or "baseline" in claim.what for claim in alone)


def test_sides_take_turns_and_what_takes_long_is_done_seldom():
    asked = []
    asks = {side: lambda one, side=side: asked.append((one.key, side)) or {} for side in SIDES[:2]}
    wanted = [Task("short", SIDES), Task("long", (NOW,), every=3)]
    runs = measured(wanted, 4, asks, lambda _: None)
    there = [("short", BEFORE), ("short", NOW)]
    back = there[::-1]
    assert asked == [*there, ("long", NOW), *back, *there, ("long", NOW), *back]
    assert [len(runs["short"][side]) for side in SIDES] == [4, 4, 0]


@pytest.mark.parametrize("change", ["speed", "step", "load"])
def test_a_neighbour_differs_in_one_thing(change):
    first = scenario(load=BACKPACK)
    numbers = [
        {"speed": one.walk.speed, "step": one.walk.step_length, "load": one.load.mass}
        for one in (first, neighbour(first, change))
    ]
    ratios = {name: numbers[1][name] / numbers[0][name] for name in numbers[0]}
    assert ratios == pytest.approx(dict.fromkeys(numbers[0], 1.0) | {change: 1.05})


def test_few_control_points_are_clamped():
    few, more = (build_program(task("paper-normal", n)) for n in (6, 8))
    assert not few.basis.mirrored
    assert more.basis.mirrored
    assert len(few.variables) > len(more.variables)


def test_operations_are_counted_and_nothing_is_left_behind():
    before = Half.add
    program = build_program(task("paper-normal", 8))
    once = flops(program)
    assert flops(program) == once > len(program.variables) ** 3 / 3
    with pytest.raises(ValueError, match="stop"), counted():
        raise ValueError("stop")
    assert Half.add is before


# Processes


def test_a_worker_answers_and_outlives_what_fails():
    with Worker(HERE, kernel=False) as worker:
        first = worker.ask({"do": "hello"})
        assert first == {"tree": str(HERE), "kernel": False}
        assert "KeyError" in worker.ask({"do": "nothing"})["error"]
        assert worker.ask({"do": "hello"}) == first


def test_a_worker_that_ends_is_told():
    with Worker(HERE) as worker:
        worker._process.kill()
        worker._process.wait()
        with pytest.raises(BrokenPipeError):
            [worker.ask({"do": "hello"}) for _ in range(2)]


def test_a_command_is_timed_until_it_tells_of_a_walk(tmp_path):
    spend = "import time\nwhile time.process_time() < {}: pass\n"
    told = "print('newton found a walk in 1.0 s; result in {out}', flush=True)\n"
    rest = "time.sleep(0.3)\n"
    found = run(["-c", spend.format(0.2) + told + rest + spend.format(0.5)], HERE, tmp_path)
    assert found["seconds"] >= 0.5
    assert found["found_wall"] < found["wall"]
    if Path("/proc").exists():
        assert 0.2 - 0.02 <= found["found_seconds"] < found["seconds"] - 0.2
    failed = run(["-c", "import sys; sys.exit('error: no room')"], HERE, tmp_path)
    assert failed == {"error": "error: no room"}


@pytest.mark.skipif(not Path("/proc").exists(), reason="only where there is /proc")
def test_cpu_seconds_of_a_process_are_its_own():
    assert cpu(os.getpid()) == pytest.approx(sum(os.times()[:4]), abs=0.1)
    assert time.process_time() <= cpu(os.getpid()) + 0.1


def test_without_the_commit_this_tree_is_measured_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(speed, "HERE", tmp_path)
    monkeypatch.setattr(speed, "BUILD", tmp_path / "build")
    assert baseline() is None
    monkeypatch.setenv("PATH", "")
    assert baseline() is None
    (tmp_path / "build" / speed.BASELINE).mkdir(parents=True)
    assert baseline() == tmp_path / "build" / speed.BASELINE


# What is written


def test_the_report_has_all_claims_and_what_failed():
    runs = all_of_them()
    runs["warm paper-normal speed 8"][NOW].append({"error": "LinAlgError: singular"})
    machine = {"processor": sys.platform, "cores": 2, "kernel": False}
    text = report(
        {"runs": runs, "machine": machine, "baseline": "abc", "rounds": 3, "took_s": 60.0}
    )
    assert "There is no compiled kernel" in text
    for claim in claims(runs):
        assert f"| {claim.what} |" in text
    assert "* warm paper-normal speed 8, now: LinAlgError: singular" in text
    tables = [line for line in text.splitlines() if line.startswith("|")]
    for _, rows in itertools.groupby(tables, key=lambda line: line.count("|")):
        assert len(list(rows)) > 2
    assert all(f"| {points} | 10.00, 10, 4000.00 |" in text for points in FASTER)


def test_the_picture_is_drawn(tmp_path):
    picture(all_of_them(), tmp_path / "speed.svg")
    assert (tmp_path / "speed.svg").read_text().startswith("<?xml")
    picture({}, tmp_path / "nothing.svg")
