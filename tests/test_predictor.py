"""A predictor that remembers: from which walk it starts, and what an estimate says of itself."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from solves import solved
from walking import guessed_gait
from walks import scenario

import human_gait as hg
from human_gait import predictor as room
from human_gait.exceptions import ResultError
from human_gait.problem.balance_rows import SLIDING_FRICTION, TURNING_FRICTION
from human_gait.problem.program import build_program
from human_gait.scenario.nearness import Place
from human_gait.solving.estimate import estimated
from human_gait.solving.starts import WARM
from human_gait.solving.warm_start import adapted

PAGE = Path(__file__).resolve().parent.parent / "docs" / "many-walks.md"

# --- how near scenarios are


def place(**changes):
    return Place.of(scenario().replace(changes))


def test_places_are_as_far_apart_as_their_settings():
    here, little, more = place(), place(speed=1.25), place(speed=1.3)
    assert here.distance(here) == here.distance(place(name="another")) == 0.0
    assert 0.0 < here.distance(little) < here.distance(more)
    assert here.distance(more) == more.distance(here)
    both = here.distance(place(speed=1.25, step_length=0.7))
    assert both > max(here.distance(little), here.distance(place(step_length=0.7)))


@pytest.mark.parametrize(
    "changes",
    [
        {"sex": "female"},
        {"weighting": "strength"},
        {"control_points": 8},
        {"limits.frozen": ["wrist_flexion_r"]},
        {"limits.knee_flexion_r": [0.0, 100.0]},
        {"formulation": "paper"},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_other_kinds_are_nowhere_near(changes):
    assert place().distance(Place.of(scenario().replace(changes))) == np.inf


def test_limits_are_numbers_among_those_of_the_same_joint():
    narrow, wide = (
        Place.of(scenario().replace({"limits.knee_flexion_r": [0.0, end]})) for end in (90.0, 99.0)
    )
    assert narrow.distance(wide) == pytest.approx(9.0 / 360.0)


# --- from where it starts


def found(**changes):
    """A gait that passes for a walk that was found: the guess, with multipliers."""
    gait = guessed_gait()
    free = {"limits": np.zeros(gait.free.size)}
    return replace(gait, scenario=gait.scenario.replace(changes), multipliers=free)


@pytest.fixture
def asked(monkeypatch):
    """The problems and starts that are solved, all with success."""
    seen = []

    def walk_of(program, _, start, *__):
        seen.append((program, start))
        return replace(program.gait(program.guess()), multipliers={"limits": np.zeros(3)})

    monkeypatch.setattr(room, "walk_of", walk_of)
    return seen


def test_the_first_walk_starts_cold_and_the_next_from_it(asked):
    predictor = hg.Predictor()
    for speed in (1.2, 1.22):
        predictor.predict(guessed_gait().scenario.replace(speed=speed))
    (_, cold), (_, warm) = asked
    assert cold is None
    assert warm.name == WARM
    assert not warm.alone
    assert [gait.scenario.walk.speed for gait in predictor.walks] == [1.2, 1.22]
    assert repr(predictor) == "Predictor(2 walks)"


def test_the_nearest_walk_is_the_start(asked):
    predictor = hg.Predictor()
    for speed in (1.3, 1.2, 1.1):
        predictor.add(found(speed=speed))
    task = guessed_gait().scenario.replace(speed=1.19)
    predictor.predict(task)
    (program, start), near = asked[0], predictor.walks[1]
    np.testing.assert_array_equal(start.point, adapted(near, program))
    assert program.scenario == task
    assert start.most_iterations


def test_what_is_far_or_of_another_kind_is_no_start(asked):
    predictor = hg.Predictor()
    predictor.add(found())
    predictor.predict(guessed_gait().scenario.replace({"load.mass": 20.0}))
    predictor.predict(guessed_gait().scenario.replace(sex="female", step_length=0.6))
    assert [start for _, start in asked] == [None, None]


def test_the_oldest_walks_go():
    predictor = hg.Predictor(keep=2)
    for speed in (1.1, 1.2, 1.3):
        predictor.add(found(speed=speed))
    assert [gait.scenario.walk.speed for gait in predictor.walks] == [1.2, 1.3]


def test_what_a_walk_was_held_by_holds_the_next_one_too(asked):
    """A walk near one that slips slips too: it is not solved twice."""
    predictor, walk = hg.Predictor(), found()
    held = {name.name: np.zeros(1) for name in (SLIDING_FRICTION, TURNING_FRICTION)}
    predictor.add(replace(walk, multipliers=walk.multipliers | held))
    predictor.predict(walk.scenario.replace(speed=1.21))
    demands = [constraint.demand for constraint in asked[0][0].constraints]
    assert {SLIDING_FRICTION, TURNING_FRICTION} <= {*demands}


def test_own_costs_are_those_of_every_walk(asked):
    own = hg.RunningCost("knee", lambda motion: hg.Rows(motion.q[:, [16]]))
    predictor = hg.Predictor(costs=[own])
    for speed in (1.2, 1.3):
        predictor.predict(guessed_gait().scenario.replace(speed=speed))
    assert all(program.own_costs == (own,) for program, _ in asked)


@pytest.mark.parametrize(
    ("walk", "why"),
    [
        (guessed_gait(), "no multipliers"),
        (replace(found(), solution={"success": False}), "fails checks"),
        (replace(found(), solution={"estimate": {}}), "an estimate"),
    ],
)
def test_what_is_no_walk_is_not_kept(walk, why):
    with pytest.raises(ResultError, match=f"guessed walk: .*{why}"):
        hg.Predictor().add(walk)


def test_without_a_walk_nothing_is_estimated():
    predictor = hg.Predictor()
    with pytest.raises(ResultError, match="no walk is near enough"):
        predictor.estimate("preferred")
    predictor.add(found())
    with pytest.raises(ResultError, match="no walk is near enough"):
        predictor.estimate("preferred")


# --- what it finds


@pytest.fixture(scope="module")
def known():
    return hg.load(solved("preferred").folder)


@pytest.fixture(scope="module")
def faster(known):
    return known.scenario.replace(speed=1.02 * known.scenario.walk.speed)


@pytest.fixture(scope="module")
def estimate(known, faster):
    predictor = hg.Predictor()
    predictor.add(known)
    return predictor.estimate(faster)


@pytest.mark.solve
def test_a_walk_is_found_near_the_estimate_that_says_how_far(known, faster, estimate):
    predictor = hg.Predictor()
    predictor.add(solved("preferred").folder)
    walk = predictor.predict(faster)
    assert walk.solution["start"] == WARM
    assert walk.solution["success"]
    assert hg.verify(walk).passed
    assert walk.solution["iterations"] < known.solution["iterations"] / 2
    assert predictor.walks[-1] == walk
    said = estimate.solution["estimate"]
    off = abs(estimate.solution["cost"] - walk.solution["cost"])
    assert off <= said["cost_error"] < 0.02 * walk.solution["cost"]


@pytest.mark.solve
def test_an_estimate_says_what_it_is_wherever_it_goes(estimate, tmp_path):
    assert "an estimate" in repr(estimate)
    assert not estimate.solution["success"]
    assert not estimate.multipliers
    assert "an estimate, not solved" in hg.verify(estimate).failed.names
    again = hg.load(estimate.save(tmp_path / "there"))
    assert not again.solution["success"]
    assert again.solution["estimate"] == estimate.solution["estimate"]
    assert "an estimate, not solved" in hg.verify(tmp_path / "there").failed.names


@pytest.mark.solve
def test_the_violation_of_an_estimate_is_measured_and_of_second_order(known, faster, estimate):
    problem = build_program(faster)
    worst = max(problem.violations(estimate.free), key=lambda violation: violation.value)
    said = estimate.solution["estimate"]
    assert said["largest_violation"] == pytest.approx(worst.value)
    assert (said["constraint"], said["unit"]) == (worst.name, worst.unit)
    nearer = known.scenario.replace(speed=1.005 * known.scenario.walk.speed)
    smaller = estimated(known, problem.moved_to(nearer)).solution["estimate"]
    assert smaller["largest_violation"] < worst.value / 4.0
    assert smaller["cost_error"] < said["cost_error"] / 3.0


@pytest.mark.solve
def test_the_code_of_the_page_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("out").mkdir()
    Path("out/preferred").symlink_to(solved("preferred").folder.resolve())
    for piece in PAGE.read_text().split("```python\n")[1:]:
        exec(piece.split("```")[0], globals())
    assert "N^2 m^2 s" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("wrong", "says"), [({"keep": 0}, "keep is 0"), ({"dynamics": "x"}, "'x'")]
)
def test_what_it_cannot_do_is_said_at_once(wrong, says):
    with pytest.raises(ValueError, match=says):
        hg.Predictor(**wrong)
