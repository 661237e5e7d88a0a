"""The order of starts, what is recorded and what is kept; solves are replaced or cut short."""

import dataclasses
import signal
from pathlib import Path

import numpy as np
import pytest
from walks import BACKPACK, STILL, scenario

import human_gait as hg
from human_gait import console
from human_gait.checks.check import Check, Kind
from human_gait.problem.balance_rows import SLIDING_FRICTION, TURNING_FRICTION
from human_gait.problem.program import build_program
from human_gait.solving import neighbours
from human_gait.solving import starts as room
from human_gait.solving.drake_solvers import SOLVERS
from human_gait.solving.neighbours import NEIGHBOURS
from human_gait.solving.solver import POSTURE, Solution
from human_gait.solving.starts import (
    GIVEN,
    OWN_GUESS,
    WARM,
    Start,
    best,
    climb,
    disturbed,
    on_the_way,
)
from human_gait.solving.summary import spread
from human_gait.solving.warm_start import adapted
from human_gait.solving.watch import FEASIBLE

TASK = scenario(control_points=6, load=BACKPACK)
PROGRAM = build_program(TASK)
PATHS = 4  # rungs of newton before the continuation, whose three solves follow


@pytest.fixture
def solves(monkeypatch):
    """Replace solve and verify: what the ladder asks for, and answers given in turn."""
    return Solves(monkeypatch)


class Solves:
    """Answers in turn: walk, feasible, failed, rejected (by a check), slips, interrupted."""

    def __init__(self, monkeypatch):
        self.asked, self.answers, self.cost = [], [], 100.0
        monkeypatch.setattr(room, "solve", self.solve)
        monkeypatch.setattr(neighbours, "solve", self.solve)
        monkeypatch.setattr(room, "make_record", lambda gait: gait)
        monkeypatch.setattr(room, "verify", self.verify)

    def solve(self, program, solver, start=None, tell=None, **given):
        if tell:
            tell(None)
        answer = self.answers.pop(0) if self.answers else "failed"
        self.asked.append((program, solver, start, given))
        self.cost -= 1.0
        violations = program.violations(program.guess())[:1]
        value = 0.0 if answer in ("walk", "feasible", "rejected", "slips") else 1.0
        violations = [dataclasses.replace(violations[0], value=value)]
        done = answer in ("walk", "rejected", "slips")
        gait = program.gait(program.guess(), answer=answer)
        numbers = (1, 1, self.cost, 0.5, violations)
        return Solution(gait, done, answer == "interrupted", solver, answer, *numbers)

    @staticmethod
    def verify(gait):
        answer = gait.solution["answer"]
        kind = Kind.FRICTION if answer == "slips" else Kind.WALK
        check = Check("a claim", "m", 0.0, 1.0, 0.0, kind)
        wrong = answer in ("rejected", "slips")
        return [dataclasses.replace(check, value=2.0) if wrong else check]


def starts(attempts):
    return [attempt.start for attempt in attempts]


def test_the_first_walk_ends_it(solves):
    solves.answers = ["walk"]
    attempts = climb(PROGRAM)
    assert starts(attempts) == [OWN_GUESS]
    assert attempts[0].success


@pytest.mark.parametrize("solver", SOLVERS)
def test_every_rung_is_tried_and_recorded_before_giving_up(solves, solver):
    told = []
    attempts = climb(PROGRAM, solver, seed=7, tell=told.append)
    others = [other for other in SOLVERS if other != solver]
    assert starts(attempts) == [
        OWN_GUESS,
        *(["own guess, by a posture path"] if solver == "newton" else []),
        "own guess, freer",
        "own guess, more gently",
        "continuation",
        "random start 1 of seed 7",
        "random start 2 of seed 7",
        *(f"{other} instead" for other in others),
    ]
    assert told == starts(attempts)
    assert not any(attempt.success for attempt in attempts)
    weights = [given["weights"] for *_, given in solves.asked if "weights" in given]
    assert weights[0] is None  # the solver's own way
    assert len(set(weights)) == len(weights) == 3 + (solver == "newton")
    assert (POSTURE in weights) == (solver == "newton")  # the others' own way is by this path
    asked = [asked for _, asked, *_ in solves.asked]
    assert asked == [solver] * (len(asked) - 2) + others


def test_a_walk_that_a_check_refuses_is_no_walk(solves):
    solves.answers = ["rejected", "walk"]
    attempts = climb(PROGRAM)
    assert [attempt.success for attempt in attempts] == [False, True]


def test_what_ends_feasible_is_taken_up_again_where_it_ended(solves):
    solves.answers = ["feasible", "walk"]
    attempts = climb(PROGRAM)
    assert starts(attempts) == [OWN_GUESS, f"{OWN_GUESS}, taken up again"]
    np.testing.assert_array_equal(solves.asked[1][2], PROGRAM.guess())


def test_a_walk_that_slips_is_taken_up_with_friction(solves):
    solves.answers = ["slips", "walk"]
    attempts = climb(PROGRAM)
    assert starts(attempts) == [OWN_GUESS, f"{OWN_GUESS}, held by friction"]
    plain, held = ({one.demand for one in each.program.constraints} for each in attempts)
    assert held - plain == {SLIDING_FRICTION, TURNING_FRICTION}
    assert attempts[1].success


def test_a_given_start_is_the_only_one(solves):
    start = PROGRAM.guess()
    attempts = climb(PROGRAM, "ipopt", Start(GIVEN, start))
    assert starts(attempts) == [GIVEN]
    assert solves.asked == [(PROGRAM, "ipopt", start, {"multipliers": {}, "most_iterations": None})]


def test_a_start_that_is_not_alone_comes_before_all_others(solves):
    """With its multipliers; what follows does not know of it."""
    start, multipliers = PROGRAM.guess(), {"any": np.ones(3)}
    given = Start(WARM, start, multipliers, alone=False, most_iterations=9)
    attempts = climb(PROGRAM, "newton", given)
    assert starts(attempts) == [WARM, *starts(climb(PROGRAM, "newton"))]
    how = {"multipliers": multipliers, "most_iterations": 9}
    assert solves.asked[0] == (PROGRAM, "newton", start, how)
    assert all("multipliers" not in given for *_, given in solves.asked[1:])
    solves.answers = ["walk"]
    assert starts(climb(PROGRAM, "newton", given)) == [WARM]


def test_a_guess_that_is_given_is_that_of_the_first_rungs(solves):
    guess = PROGRAM.guess() + 0.01
    climb(PROGRAM, guess=guess)
    given = [given.get("guess") for *_, given in solves.asked]
    assert all(one is guess for one in given[:4])
    assert not any(one is guess for one in given[4:])


def test_an_interruption_ends_it(solves):
    solves.answers = ["failed", "interrupted"]
    attempts = climb(PROGRAM)
    assert len(attempts) == 2


@pytest.mark.parametrize("n", [1, 2])
def test_ctrl_c_on_the_way_of_the_continuation_keeps_what_there_is(solves, n):
    """Walks on the way belong to other scenarios: none of them is returned."""
    solves.answers = ["failed"] * (PATHS - 1 + n) + ["interrupted"]
    attempts = climb(PROGRAM)
    assert len(attempts) == PATHS
    assert {attempt.solution.gait.scenario.name for attempt in attempts} == {TASK.name}


def test_ctrl_c_before_anything_is_there_stops_like_any_program(monkeypatch):
    def press(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(room, "solve", press)
    with pytest.raises(KeyboardInterrupt):
        climb(PROGRAM)


def test_ctrl_c_in_what_follows_an_attempt_keeps_the_attempt(solves, monkeypatch):
    solves.answers = ["feasible"]
    answer = solves.solve

    def solve(*given, **named):
        if not solves.answers:
            raise KeyboardInterrupt
        return answer(*given, **named)

    monkeypatch.setattr(room, "solve", solve)
    assert starts(climb(PROGRAM)) == [OWN_GUESS]


def test_the_continuation_goes_from_comfortable_to_what_is_asked_for(solves):
    climb(PROGRAM)
    strides = solves.asked[PATHS : PATHS + 3]
    programs = [program for program, *_ in strides]
    tasks = [program.scenario for program in programs]
    assert tasks[2] == TASK
    assert [task.load.mass for task in tasks] == [0.0, 9.0, 18.0]
    speeds = [task.walk.speed for task in tasks]
    assert speeds[1] == pytest.approx((speeds[0] + speeds[2]) / 2)
    guesses = [given["guess"] for *_, given in strides]
    assert guesses[0] is None
    for guess, program in zip(guesses[1:], programs[1:], strict=True):
        basis = program.basis
        ends = basis.matrix(np.array([0.0, basis.step_time])) @ basis.expand(guess.reshape(-1, 55))
        length = program.scenario.walk.step_length
        assert ends[1, 0] - ends[0, 0] == pytest.approx(length, abs=1e-9)


def test_comfortable_walking_is_what_people_of_this_size_prefer():
    """1.2 to 1.3 m/s in steps of about 0.66 m for the median man, slower and shorter for small."""
    man, woman = (
        on_the_way(scenario(subject=subject), 0.0).walk
        for subject in ({"sex": "male"}, {"sex": "female", "stature": 1.5})
    )
    assert 1.15 < man.speed < 1.35
    assert 0.62 < man.step_length < 0.72
    assert woman.speed < man.speed
    assert woman.step_length < man.step_length


def test_random_starts_differ_and_repeat(solves):
    guesses = []
    for seed in (3, 3, 4):
        climb(PROGRAM, seed=seed)
        guesses.append([given["guess"] for *_, given in solves.asked[PATHS + 3 : PATHS + 5]])
        solves.asked.clear()
    np.testing.assert_array_equal(guesses[0], guesses[1])
    assert np.abs(guesses[0][0] - guesses[0][1]).max() > 0.05
    assert np.abs(guesses[0][0] - guesses[2][0]).max() > 0.05


def test_a_disturbed_guess_keeps_the_limits():
    guess = disturbed(PROGRAM, np.random.default_rng(1)).reshape(-1, 55)
    lower, upper = PROGRAM.limits
    assert np.all((guess >= lower) & (guess <= upper))


def test_the_best_attempt_is_a_walk_then_an_optimum_then_what_violates_least(solves):
    solves.answers = ["failed", "rejected", "feasible", "failed", "failed"]
    attempts = climb(PROGRAM)
    assert best(attempts).solution.status == "rejected"
    others = [attempt for attempt in attempts if attempt.solution.status != "rejected"]
    assert best(others).solution.status == "feasible"
    failed = [attempt for attempt in others if not attempt.feasible]
    assert best(failed) is failed[-1]  # the cheapest of equals
    assert max(v.value for v in failed[0].solution.violations) > FEASIBLE
    solves.answers = ["failed", "walk"]
    assert best(climb(PROGRAM)).solution.status == "walk"


@pytest.mark.parametrize("solver", SOLVERS)
def test_an_interrupted_solve_is_kept(solver):
    """The real solver, stopped at its third point."""

    def begin(_):
        def tell(now):
            if now.number == 3:
                signal.raise_signal(signal.SIGINT)

        return tell

    attempts = climb(PROGRAM, solver, tell=begin)
    assert starts(attempts) == [OWN_GUESS]
    assert attempts[0].solution.interrupted
    assert not attempts[0].success


@pytest.mark.solve
@pytest.mark.parametrize("solver", ["newton", "snopt"])
def test_every_kind_of_start_can_lead_to_a_walk(solver):
    """From comfortable walking, and from a disturbed guess, to one speed and load.

    SNOPT, which takes long, has fewer joints to move.
    """
    few = {"limits": STILL} if solver == "snopt" else {}
    task = scenario(1.4, 0.7, load={"mass": 9.0}, **few)
    program = build_program(task)
    there = room.continued(program, "newton")
    assert there.converged
    assert there.gait.scenario == task
    assert there.evaluations > program.functions.evaluations  # those on the way are counted
    noise = disturbed(program, np.random.default_rng(2))
    from_noise = room.solve(program, solver, guess=noise)
    assert from_noise.converged
    assert from_noise.cost == pytest.approx(there.cost, rel=0.02)


def test_many_control_points_start_from_the_walk_with_as_many_as_usual(monkeypatch):
    program, seen = build_program(scenario(control_points=24, intervals=42)), []

    def solved(stride, _solver, start=None, tell=None):  # noqa: ARG001, as `solve` has it
        free = stride.guess() if start is None else start
        seen.append((stride.basis.n_control_points, start))
        numbers = {"iterations": 1, "evaluations": 2, "cost": 1.0, "wall_time": 3.0}
        return Solution(
            stride.gait(free), True, False, "newton", "optimal", **numbers, violations=[]
        )

    monkeypatch.setattr(room, "solve", solved)
    names = [name for name, _ in room.own_starts(program, "newton", 0, None)]
    assert names[0] == "fewer control points first"
    found = room.refined(program, "newton")
    assert [n for n, _ in seen] == [8, 24]
    assert (found.iterations, found.evaluations, found.wall_time) == (2, 4, 6.0)
    coarse = build_program(scenario(control_points=8, intervals=20))
    gait = coarse.gait(coarse.guess())
    t = np.linspace(0.0, gait.step_time, 20)
    assert np.abs(found.gait.q(t) - gait.q(t)).max() < 0.05
    usual = [name for name, _ in room.own_starts(build_program(scenario()), "newton", 0, None)]
    assert "fewer control points first" not in usual


# --- further starts


def test_further_starts_follow_the_first_walk_and_the_cheapest_is_kept(solves):
    solves.answers = ["failed", "walk", "walk", "walk", "failed", "walk", "rejected"]
    attempts = climb(PROGRAM, starts=4)
    names = starts(attempts)
    assert names[2:] == [neighbour.name for neighbour in NEIGHBOURS[:3]]
    assert [attempt.success for attempt in attempts] == [False, True, True, True, False]
    assert best(attempts) is attempts[3]  # each costs less than the one before
    told = spread(attempts)
    assert told["walks"] == 3
    costs = [attempt.solution.cost for attempt in attempts[1:4]]
    assert told["cost_spread"] == pytest.approx(costs[0] / costs[2] - 1.0)


def test_there_and_back_goes_by_a_neighbour_from_the_walk_and_its_multipliers(solves):
    solves.answers = ["walk"]
    climb(PROGRAM, starts=2)
    (*_,), (there, _, start, given), (back, *_) = solves.asked
    assert there.scenario.walk.step_length == pytest.approx(1.05 * TASK.walk.step_length)
    assert there.scenario.walk.speed == TASK.walk.speed
    assert back is PROGRAM
    np.testing.assert_array_equal(start, adapted(PROGRAM.gait(PROGRAM.guess()), there))
    assert given["multipliers"] == {}  # the answer has none


def test_after_the_neighbours_starts_are_random_and_go_by_the_seed(solves):
    solves.answers = ["walk"] * 40
    attempts = climb(PROGRAM, seed=3, starts=len(NEIGHBOURS) + 3)
    assert starts(attempts)[-2:] == ["random start 1 of seed 3", "random start 2 of seed 3"]
    guesses = [given["guess"] for *_, given in solves.asked[-2:]]
    assert not np.array_equal(*guesses)


def test_without_a_walk_there_are_no_further_starts(solves):
    names = starts(climb(PROGRAM, starts=9))
    assert names == starts(climb(PROGRAM))
    assert solves.answers == []


def test_a_neighbour_that_nobody_can_walk_is_left_out(solves):
    longest = TASK.replace(step_length=1.03)
    program = build_program(longest)
    solves.answers = ["walk"]
    names = starts(climb(program, starts=2))
    assert names == [OWN_GUESS, NEIGHBOURS[1].name]


def test_what_holds_the_first_walk_holds_the_others(solves):
    solves.answers = ["slips", "walk", "walk", "walk"]
    *_, first, other = climb(PROGRAM, starts=2)
    assert other.program is first.program is not PROGRAM


def test_the_terminal_tells_how_far_costs_differ_in_one_line(solves, capsys):
    solves.answers = ["walk", "walk", "walk"]
    attempts = climb(PROGRAM, starts=2)
    kept = best(attempts)
    console.show_outcome(kept, attempts, Path("out/mine"), kept.solution.gait)
    lines = capsys.readouterr().out.splitlines()
    (line,) = (line for line in lines if "costs differ" in line)
    percent = 100.0 * spread(attempts)["cost_spread"]
    assert line.startswith(f"2 walks in 2 attempts: their costs differ by {percent:.2g} %")
    assert line.endswith("the cheapest is kept")
    assert NEIGHBOURS[0].name in " ".join(" ".join(lines).split())
    console.show_outcome(kept, attempts[:1], Path("out/mine"), kept.solution.gait)
    assert "costs differ" not in capsys.readouterr().out


@pytest.mark.parametrize("wrong", [0, -1, 101, True, 1.5, "2"])
def test_a_number_of_starts_is_a_small_whole_number(wrong):
    with pytest.raises((TypeError, ValueError), match=r"starts|must be from 1 to 100"):
        hg.predict("paper-normal", starts=wrong)
