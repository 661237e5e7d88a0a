"""One thing of a result changed: it is refused by name, or shown as what moves a limit."""

import json
from dataclasses import replace

import numpy as np
import pytest
from walks import BACKPACK, scenario

from benchmarks.tampering import NOTHING, changes, made_anew, told_by
from human_gait.checks import contents
from human_gait.checks.costs import costs
from human_gait.checks.verification import verify
from human_gait.exceptions import ScenarioError
from human_gait.problem.program import build_program
from human_gait.settings.records import all_settings
from human_gait.walk.described import with_story
from human_gait.walk.gait_file import (
    load_record,
    make_record,
    members_of,
    restored,
    save_gait,
    sealed,
)

ONLY_TOLD = {
    "subject.strength",  # of which nothing is asked in this walk
    "subject.percentile",  # of no effect beside stature and mass, which are in the file
    "about",
    *(f"solution.{key}" for key in ("solver", "status", "wall_time_s", "success")),
}
"""What nobody can compute anew, and so only the digests tell of."""


def walk(**sections):
    """The guess of a coarse scenario, with a story of how it was found."""
    program = build_program(scenario(**sections))
    gait = program.gait(program.guess())
    story = {"solver": "newton", "status": "optimal", "wall_time_s": 1.5}
    found = replace(gait, solution={**story, "cost": costs(gait)})
    return with_story(found, success=True)


GAIT = walk(load=BACKPACK)
MEMBERS = sealed(members_of(make_record(GAIT)))
CHANGES = list(changes(MEMBERS, 1, np.random.default_rng(0)))


def member_of(name):
    section = name.partition(".")[0]
    return section if section in MEMBERS else "scenario"


def test_everything_in_the_file_is_changed():
    assert {member_of(name) for name, _ in CHANGES} == set(MEMBERS) - {"digests"}
    changed = {name for name, _ in CHANGES}
    plain = {one.dotted for one in all_settings() if one.key != "<joint>"}
    assert plain < changed
    assert len(changed - plain) > 20


def test_whatever_is_changed_is_named_while_the_digests_are_as_they_were():
    unnamed = []
    for name, changed in CHANGES:
        try:
            record = restored(changed)
        except (ValueError, TypeError, KeyError, ScenarioError) as error:
            if not str(error):
                unnamed.append(name)
            continue
        seal = contents.as_written(record)
        if seal.passed or member_of(name) not in seal.what:
            unnamed.append(name)
    assert unnamed == []


def test_with_digests_made_anew_physics_or_the_header_tells():
    unseen = {name for name, new in CHANGES if told_by(made_anew(new), GAIT) == NOTHING}
    assert unseen == ONLY_TOLD


def test_a_walk_that_is_not_the_one_that_was_found_is_refused_whatever_the_digests_say():
    """With those of the file made anew, or taken away as in a file of an older version."""
    table = json.loads(str(MEMBERS["scenario"]))
    table["tolerances"]["contact_speed"] = 2.0
    changed = {**MEMBERS, "scenario": np.array(json.dumps(table))}
    older = {name: one for name, one in changed.items() if name != "digests"}
    for members in (sealed(changed), older):
        seal = contents.as_written(restored(members))
        assert (seal.passed, seal.what) == (False, "the walk that was found")


def test_a_file_as_it_was_written_says_so_and_one_without_digests_cannot_tell(tmp_path):
    save_gait(GAIT, tmp_path)
    seal = contents.as_written(load_record(tmp_path))
    assert (seal.passed, seal.value, seal.what, seal.verdict) == (True, 0.0, "", "ok")
    with np.load(tmp_path / "gait.npz") as file:
        older = {name: file[name] for name in file.files if name != "digests"}
    np.savez(tmp_path / "gait.npz", **older)
    seal = contents.as_written(load_record(tmp_path))
    assert (seal.passed, seal.verdict) == (True, "note")
    assert "no digests" in seal.what


@pytest.mark.parametrize(
    ("spoilt", "named"),
    [
        ({"mine": np.zeros(3)}, "mine"),
        ({"bad\x1b[2Jname": np.zeros(3)}, "bad?[2Jname"),
        ({"about": None}, "about"),
        ({"digests": np.array("[]")}, "digests"),
        ({"digests": np.array("{}")}, "control_points"),
    ],
)
def test_what_is_added_or_taken_away_is_named(spoilt, named):
    changed = {name: one for name, one in {**MEMBERS, **spoilt}.items() if one is not None}
    assert named in contents.as_written(restored(changed)).what


@pytest.mark.parametrize("array", ["grf", "active", "cop", "toe_share", "yaw_moment", "zmp"])
def test_every_array_of_samples_is_named_when_its_largest_number_is_changed(array):
    changed = MEMBERS[array].copy()
    changed.flat[np.abs(changed).argmax()] *= 1.01
    record = restored({**MEMBERS, array: changed})
    check = contents.as_computed(record.samples, record.gait.fine_samples)
    assert (check.passed, check.what) == (False, array)


def test_a_law_of_the_ground_that_is_changed_in_the_scenario_is_seen():
    """Forces shared in another way move and balance the body as well: no engine sees it."""
    table = json.loads(str(MEMBERS["scenario"]))
    table["ground"]["sharing"] = "parallel"
    record = restored({**MEMBERS, "scenario": np.array(json.dumps(table))})
    failed = {check.name: check for check in verify(record) if not check.passed}
    engines = {name for name in failed if name.startswith("torques off")}
    assert not engines
    assert {"grf", "tau", "active"} <= set(failed[contents.SAMPLES.name].what.split(", "))


OBJECTIVES = {
    "as printed": {"formulation": "paper"},
    "by strength, all torques paid": {"weighting": "strength", "passive_torques": "none"},
    "by strength": {"weighting": "strength", "passive_torques": "tissue"},
    "human": {"formulation": "human"},
    "human with all terms": {"formulation": "human", "weighting": "strength", "negative_work": 9.0},
}


@pytest.mark.parametrize("objective", OBJECTIVES.values(), ids=OBJECTIVES)
@pytest.mark.parametrize("periodicity", ["velocity", "acceleration"])
def test_the_cost_is_that_of_the_problem_whatever_its_objective(objective, periodicity):
    program = build_program(
        scenario(objective=objective, periodicity=periodicity, control_points=10)
    )
    free = program.guess()
    told = program.cost(free)[0]
    gait = program.gait(free, cost=told)
    assert contents.cost(gait).passed
    assert costs(gait) == pytest.approx(told, rel=1e-12)
    for wrong in (1.0001, 0.9999, 0.0, -1.0):
        assert not contents.cost(program.gait(free, cost=wrong * told)).passed


def test_costs_of_ones_own_are_taken_as_told_and_said():
    plain = GAIT.solution["cost"]
    own = replace(GAIT, solution={"cost": plain + 70.0, contents.OWN_COST: 70.0})
    assert contents.cost(own).passed
    assert "70 of one's own" in contents.cost(own).what
    assert not contents.cost(replace(GAIT, solution={"cost": plain + 70.0})).passed


@pytest.mark.parametrize("told", [np.nan, np.inf, "much", [], None])
def test_a_cost_that_is_no_number_is_refused_and_none_is_said(told):
    check = contents.cost(replace(GAIT, solution={"cost": told}))
    assert check.verdict == ("note" if told is None else "FAIL")
    assert check.what or isinstance(told, float)
