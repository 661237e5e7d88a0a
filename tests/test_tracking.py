"""Another walk as a guess, and one that is followed with a stated weight."""

from dataclasses import replace

import numpy as np
import pytest
from test_own import slopes_agree
from walking import guessed_gait
from walks import near_walk, scenario

import human_gait as hg
from human_gait.body.skeleton import PRISMATIC, index
from human_gait.cli import run
from human_gait.people.reference import tuned_by
from human_gait.problem.program import build_program
from human_gait.problem.tracking import NAME, Tracking
from human_gait.solving.solver import solve
from human_gait.solving.starts import GUESSED, OWN_GUESS, guess_of, own_starts
from human_gait.solving.summary import followed
from human_gait.walk.measured import TRACKED

FOLLOWED = guessed_gait()
TASKS = {
    "mirrored": scenario(control_points=6),
    "clamped": scenario(control_points=5, periodicity="velocity"),
}


def following(task, weight=2e4, gait=FOLLOWED):
    return build_program(task, costs=[Tracking(gait, weight)])


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    return FOLLOWED.save(tmp_path_factory.mktemp("out") / "walk")


@pytest.mark.parametrize("kind", TASKS)
def test_derivatives_of_following_agree_with_differences(kind):
    program = following(TASKS[kind])
    assert program.terms[-1].name == NAME
    slopes_agree(program, terms=program.terms[-1:])


def test_following_costs_the_squared_distance_at_the_same_share_of_the_step():
    program = following(scenario(1.0, 0.5), weight=3.0)
    gait = program.gait(near_walk(program))
    share = np.linspace(0.0, 1.0, len(program.times), endpoint=False)
    apart = (gait.q(share * gait.step_time) - FOLLOWED.q(share * FOLLOWED.step_time))[:, ~PRISMATIC]
    value = program.functions.integral(program.terms[-1], gait.free)
    assert value == pytest.approx(3.0 * gait.step_time * np.mean(np.sum(apart**2, axis=1)))


def test_what_is_followed_costs_nothing():
    program = build_program(FOLLOWED.scenario, costs=[Tracking(FOLLOWED, 1e4)])
    assert program.functions.integral(program.terms[-1], FOLLOWED.free) == pytest.approx(0.0)


def test_another_step_time_is_another_term():
    """A program of another scenario follows the same walk, at its own times."""
    program = following(scenario(1.0, 0.5)).for_scenario(FOLLOWED.scenario)
    assert program.functions.integral(program.terms[-1], FOLLOWED.free) == pytest.approx(0.0)


@pytest.mark.parametrize("weight", [0.0, -1.0, np.nan, np.inf])
def test_a_weight_is_above_zero(weight):
    with pytest.raises(ValueError, match="must be finite and above 0"):
        Tracking(FOLLOWED, weight)


def test_what_is_followed_is_a_gait_with_a_weight_that_is_a_number():
    with pytest.raises(TypeError, match="must be a gait, not str"):
        Tracking("out/normal", 1.0)
    with pytest.raises(TypeError, match="weight is '1', must be a number"):
        Tracking(FOLLOWED, "1")


def test_the_walk_says_what_it_followed():
    story = followed(following(TASKS["mirrored"]))
    assert story == {TRACKED: {"what": "guessed walk, which was predicted", "weight": 2e4}}
    assert followed(build_program(TASKS["mirrored"])) == {}
    gait = replace(FOLLOWED, solution=story)
    said = tuned_by(gait)
    assert "follows the joint angles of guessed walk" in said
    assert "20000 N^2 m^2/rad^2: these do not test it" in said
    assert "No measured" not in said
    assert tuned_by(FOLLOWED) == "No measured curve enters the prediction."


def test_the_motion_of_a_walk_is_a_guess():
    task = FOLLOWED.scenario
    program = build_program(task)
    assert np.allclose(
        guess_of(FOLLOWED, program),
        np.clip(FOLLOWED.control_points[: program.basis.n_free], *program.limits).ravel(),
    )


def test_a_guess_for_longer_legs_is_higher():
    task = FOLLOWED.scenario
    taller = build_program(task.replace(stature=1.9))
    usual = build_program(task)
    height = index("pelvis_ty")
    high, low = (
        guess_of(FOLLOWED, program).reshape(-1, 55)[:, height] for program in (taller, usual)
    )
    legs = taller.scenario.subject.leg_length / usual.scenario.subject.leg_length
    np.testing.assert_allclose(high, legs * low)


def test_rungs_with_a_given_guess_say_so():
    program = build_program(TASKS["mirrored"])
    names = [name for name, _ in own_starts(program, "newton", 0, program.guess())]
    assert names[0] == GUESSED
    assert not any(OWN_GUESS in name for name in names)
    assert next(own_starts(program, "newton", 0, None))[0] == OWN_GUESS


def test_a_guess_must_be_a_gait_or_a_folder():
    with pytest.raises(TypeError, match="guess must be a gait or the folder of its result"):
        hg.predict("normal", guess=3)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--track", "."], "needs a weight"),
        (["--track-weight", "1"], "needs a result"),
        (["--guess", ".", "--warm-from", "."], "not with --warm-from"),
        (["--guess", ".", "--solver", "all"], "not with --solver all"),
    ],
)
def test_the_command_tells_what_does_not_go_together(options, told, result, tmp_path, capsys):
    words = [str(result) if word == "." else word for word in options]
    assert run(["predict", "normal", *words, "--out", str(tmp_path / "x")]) == 2
    assert told in capsys.readouterr().err


@pytest.mark.solve
def test_a_walk_comes_nearer_to_what_it_follows():
    task = scenario()
    free = build_program(task)
    alone = solve(free, "newton").gait
    near = solve(following(task, weight=1e5), "newton")
    assert near.converged
    share = np.linspace(0.0, 1.0, 30)

    def distance(gait):
        apart = gait.q(share * gait.step_time) - FOLLOWED.q(share * FOLLOWED.step_time)
        return np.sum(apart[:, ~PRISMATIC] ** 2)

    assert distance(near.gait) < 0.5 * distance(alone)
