"""What a gait tells of itself: the digest of what it is, and whether it is a walk."""

import json
from dataclasses import replace

import numpy as np
import pytest
from solves import solved
from walking import guessed_gait

import human_gait as hg
from human_gait import walks
from human_gait.checks.check import Check
from human_gait.exceptions import ResultError
from human_gait.newton import active_set, interior_point
from human_gait.problem.program import build_program
from human_gait.scenario import Scenario
from human_gait.solving import summary
from human_gait.solving.warm_start import fitting
from human_gait.walk.described import _CONTENT, gait_digest, no_walk, with_story
from human_gait.walk.gait_file import load_gait, save_gait

GAIT = guessed_gait()


def bent(gait, by):
    return replace(gait, control_points=gait.control_points + by)


def test_equal_gaits_have_equal_digests_however_they_were_found(tmp_path):
    save_gait(GAIT, tmp_path)
    again = Scenario.from_dict(json.loads(json.dumps(GAIT.scenario.to_dict())))
    twins = [
        load_gait(tmp_path),
        replace(GAIT, scenario=again),
        replace(GAIT, scenario=replace(again, name="another")),
        replace(GAIT, solution={"cost": 1.0}, multipliers={"any": np.ones(3)}),
        replace(GAIT, control_points=np.where(GAIT.control_points == 0, -0.0, GAIT.control_points)),
        replace(GAIT, control_points=GAIT.control_points.astype(">f8")),
    ]
    assert [gait_digest(gait) for gait in twins] == [gait_digest(GAIT)] * len(twins)
    assert len(gait_digest(GAIT)) == 16


@pytest.mark.parametrize("where", [(0, 0), (4, 20), (-1, -1)])
def test_the_smallest_change_has_another_digest(where):
    points = GAIT.control_points.copy()
    points[where] = np.nextafter(points[where], 9.0)
    assert gait_digest(replace(GAIT, control_points=points)) != gait_digest(GAIT)


@pytest.mark.parametrize("key", ["walk", "subject", "load", "ground", "tolerances"])
def test_every_setting_counts(key):
    tables = GAIT.scenario.to_dict()
    changes = {
        "walk": tables["walk"] | {"speed": 1.2 + 1e-12},
        "subject": tables["subject"] | {"mass": 80.0},
        "load": tables["load"] | {"mass": 1e-9},
        "ground": tables["ground"] | {"friction": 0.9},
        "tolerances": tables["tolerances"] | {"contact_speed": 0.4},
    }
    other = replace(GAIT, scenario=Scenario.from_dict(tables | {key: changes[key]}))
    assert gait_digest(other) != gait_digest(GAIT)


@pytest.mark.parametrize(
    ("solution", "said"),
    [
        ({}, ""),
        ({"solver": "by hand", "cost": 1.5}, ""),
        ({"solver": "newton", "status": "optimal"}, ""),
        ({"solver": "newton", "status": active_set.OPTIMAL, "success": True}, ""),
        ({"solver": "snopt", "status": "1: optimality conditions satisfied"}, ""),
        ({"solver": "snopt", "status": "3: requested accuracy could not be achieved"}, ""),
        ({"solver": "ipopt", "status": "Success"}, ""),
        ({"solver": "newton", "status": "iteration limit reached"}, "newton ended with 'iteration"),
        ({"solver": "newton", "status": "interrupted", "success": True}, "'interrupted'"),
        ({"solver": "snopt", "status": "32: major iteration limit reached"}, "snopt ended with"),
        ({"solver": "snopt", "status": "13: nonlinear infeasibilities"}, "snopt ended with"),
        ({"solver": "ipopt", "status": "Max iterations exceeded"}, "ipopt ended with"),
        ({"solver": "newton"}, "status unknown"),
        ({"solver": "newton", "status": "optimal", "success": False}, "fails checks"),
        ({"success": False}, "fails checks"),
    ],
)
def test_a_gait_says_whether_it_is_a_walk_as_far_as_it_knows(solution, said):
    gait = replace(GAIT, solution=solution)
    assert bool(no_walk(gait)) == bool(said)
    assert said in no_walk(gait)
    assert no_walk(gait).startswith("This is no walk: " if said else "")
    assert no_walk(gait) in repr(gait)
    assert ("this is no walk" in gait._repr_html_().lower()) == bool(said)


def test_the_words_of_success_are_those_of_the_solvers():
    assert _CONTENT["newton"] == (interior_point.OPTIMAL, active_set.OPTIMAL)


@pytest.mark.parametrize(
    "change",
    [
        lambda gait: bent(gait, 1e-9),
        lambda gait: replace(gait, breaks=gait.breaks * (1 + 1e-15)),
        lambda gait: replace(
            gait, scenario=replace(gait.scenario, load=replace(gait.scenario.load, mass=1.0))
        ),
    ],
)
def test_a_walk_that_was_changed_from_python_is_no_walk_until_it_is_verified(change):
    walk = with_story(GAIT, True)
    assert no_walk(walk) == ""
    assert "changed since it was found" in no_walk(change(walk))
    assert no_walk(with_story(change(walk), True)) == ""


def test_what_is_saved_is_what_the_checks_of_the_file_say(tmp_path, monkeypatch):
    """A motion that was changed keeps neither the verdict nor the digest of what it was."""
    multipliers = fitting({}, build_program(GAIT.scenario, GAIT.basis))
    claimed = with_story(replace(GAIT, multipliers=multipliers), True)
    folder = claimed.save(tmp_path / "failed")
    assert load_gait(folder).solution["success"] is False
    assert json.loads((folder / "summary.json").read_text())["success"] is False
    assert no_walk(hg.load(folder))
    monkeypatch.setattr(walks, "verify", lambda _: [Check("any", "m", 0.0, 1.0, 0.0)])
    walk = load_gait(claimed.save(tmp_path / "passed"))
    assert walk.solution["success"] is True
    assert walk.solution["digest"] == gait_digest(walk)
    changed = load_gait(bent(claimed, 1e-12).save(tmp_path / "changed"))
    assert changed.solution["success"] is False  # nobody has solved for it


@pytest.mark.parametrize("spoilt", ["a sample", "a control point"])
def test_a_file_that_does_not_hold_what_was_checked_is_no_result(spoilt, tmp_path, monkeypatch):
    def badly_written(gait, folder):
        save_gait(bent(gait, 1e-13) if spoilt == "a control point" else gait, folder)
        if spoilt == "a sample":
            with np.load(folder / "gait.npz") as file:
                members = dict(file)
            np.savez(folder / "gait.npz", **members | {"tau": members["tau"] + 1e-12})

    monkeypatch.setattr(summary, "save_gait", badly_written)
    with pytest.raises(ResultError, match="not as it was written"):
        GAIT.save(tmp_path / "walk")
    assert not (tmp_path / "walk").exists()


def test_a_gait_that_is_told_anew_is_not_computed_anew():
    told = with_story(GAIT, True)
    assert told.fine_samples is GAIT.fine_samples
    assert (told, told.solution["success"]) == (GAIT, True)
    assert "success" not in GAIT.solution


@pytest.mark.solve
def test_a_walk_that_was_found_says_so_in_its_file():
    gait = solved("preferred").gait
    assert gait.solution["success"] is True
    assert gait.solution["digest"] == gait_digest(gait)
    assert gait.solution["iterations"] == solved("preferred").summary["iterations"]
    assert no_walk(gait) == ""


def test_a_gait_of_an_older_file_knows_what_its_summary_says(tmp_path):
    save_gait(replace(GAIT, solution={"solver": "newton", "status": "optimal"}), tmp_path)
    told = {"start": "own guess", "seed": 0, "dynamics": "dh", "iterations": 1, "evaluations": 2}
    (tmp_path / "summary.json").write_text(json.dumps({"success": False, **told}))
    assert no_walk(load_gait(tmp_path)) == ""
    assert "fails checks" in no_walk(hg.load(tmp_path))
