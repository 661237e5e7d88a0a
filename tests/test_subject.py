"""Who walks: a percentile, lengths of one's own, and what older results mean."""

import json
from dataclasses import replace

import pytest
from test_anthropometry import UPRIGHT
from walking import guessed_gait

import human_gait as hg
from human_gait.body.anthropometry import body_measures
from human_gait.scenario import Scenario, Subject, load_scenario
from human_gait.scenario.lengths import LENGTHS
from human_gait.scenario.nearness import Place
from human_gait.walk.described import gait_digest

SEXES = ("male", "female")
TASK = Scenario("a", {"speed": 1.2})


@pytest.mark.parametrize("sex", SEXES)
def test_a_percentile_is_of_stature_and_mass_where_they_are_left_out(sex):
    small, usual, large = (Subject(sex, percentile=p) for p in (5.0, 50.0, 95.0))
    assert small.stature < usual.stature < large.stature
    assert small.mass < usual.mass < large.mass
    assert usual == Subject.default(sex)
    given = Subject(sex, stature=1.7, percentile=95.0)
    assert (given.stature, given.mass) == (1.7, large.mass)
    assert Subject(sex, mass=60.0, percentile=95.0).stature == large.stature


@pytest.mark.parametrize(("percentile", "said"), [(0.5, "from 1 to 99"), ("x", "number")])
def test_a_percentile_that_is_none_is_refused(percentile, said):
    with pytest.raises(hg.ScenarioError, match=rf"subject\.percentile.*{said}"):
        Subject(percentile=percentile)


def test_a_percentile_given_anew_is_that_of_stature_mass_and_lengths():
    """Also in a scenario that names them, or whose record does."""
    for task in (load_scenario("normal"), Scenario.from_record(TASK.to_dict()), TASK):
        own = task.replace({"subject.thigh": 0.45}, stature=1.76)
        assert own.replace(percentile=95).subject == Subject(percentile=95)
        heavy = own.replace({"percentile": 95, "subject.mass": 90}).subject
        assert (heavy.stature, heavy.mass) == (Subject(percentile=95).stature, 90.0)


@pytest.mark.parametrize("sex", SEXES)
def test_lengths_follow_from_the_stature_unless_given(sex):
    usual, tall = Subject(sex), Subject(sex, stature=1.9)
    for name in LENGTHS:
        assert getattr(tall, name) / tall.stature == pytest.approx(
            getattr(usual, name) / usual.stature
        )
    long = Subject(sex, thigh=usual.thigh + 0.03)
    assert long.leg_length == pytest.approx(usual.leg_length + 0.03)
    assert long.trunk == pytest.approx(usual.trunk - 0.03)
    assert {name for name in LENGTHS if long.lengths[name] != usual.lengths[name]} == {"thigh"}


GIVEN = dict.fromkeys(LENGTHS, 1.04) | {"shank": 0.95, "head_and_neck": 0.97}


@pytest.mark.parametrize("name", [*LENGTHS, "all"])
def test_the_body_has_the_lengths_that_are_given_and_the_stature(name):
    usual = Subject.default()
    names = LENGTHS if name == "all" else [name]
    who = Subject(**{each: GIVEN[each] * usual.lengths[each] for each in names})
    before, found = body_measures(usual).lengths, body_measures(who).lengths
    for each in names:
        for symbol in LENGTHS[each]:
            assert found[symbol] == pytest.approx(GIVEN[each] * before[symbol])
    assert sum(found[symbol] for symbol in UPRIGHT) == pytest.approx(who.stature, rel=1e-12)
    trunk = sum(found[symbol] for symbol in ("y_sp", "L_s1", "L_s2", "L_s3", "L_s4"))
    assert trunk == pytest.approx(who.trunk)
    assert found["h_drop"] == pytest.approx(found["h_ank"] - found["h_mtp"])


def test_lengths_that_leave_no_trunk_are_refused_in_a_line():
    with pytest.raises(hg.ScenarioError, match=r"leaves 0\.\d+ m for the trunk") as error:
        Subject(stature=1.6, thigh=0.6, shank=0.6)
    assert str(error.value).startswith("subject.stature = 1.6: ")
    assert "\n" not in str(error.value)


def test_people_survive_tables_files_and_what_is_shown():
    for who in [*hg.Population("both", 6, strength=True), Subject(percentile=30), Subject()]:
        task = replace(TASK, subject=who)
        assert Scenario.from_dict(json.loads(json.dumps(task.to_dict()))) == task
        assert Scenario.from_record(task.to_dict()).subject == who
        assert eval(repr(who), {"Subject": Subject}) == who
        assert task.replace(speed=1.1).subject == who
    assert repr(Subject(thigh=Subject().thigh)) == "Subject()"


def test_what_is_new_of_a_person_changes_no_digest_of_a_walk_of_before():
    """The median man of the first versions has 78.4 kg, and was not told of."""
    new = {*LENGTHS, "percentile"}
    gait = guessed_gait()
    table = gait.scenario.to_dict()
    before = table | {"subject": {k: v for k, v in table["subject"].items() if k not in new}}
    assert Scenario.from_record(before) == gait.scenario
    assert "subject" not in gait.scenario.own_table()
    assert TASK.own_table()["subject"] == {"sex": "male", "stature": 1.755, "mass": 84.6}
    digests = {gait_digest(gait)}
    for changes in ({"thigh": 0.44}, {"percentile": 60}, {"subject.mass": 84.6}):
        digests.add(gait_digest(replace(gait, scenario=gait.scenario.replace(changes))))
    assert len(digests) == 4


@pytest.mark.parametrize("sex", SEXES)
def test_a_record_that_does_not_name_somebody_means_who_walked_then(sex):
    mass = {"male": 78.4, "female": 62.0}[sex]
    table = {"name": "a", "walk": {"speed": 1.2}}
    assert Scenario.from_record(table | {"subject": {"sex": sex}}).subject.mass == mass
    assert Scenario.from_record(table).subject.mass == 78.4
    assert Scenario.from_dict(table).subject.mass == 84.6


def test_taller_people_are_as_near_as_before_lengths_could_be_given():
    """What lengths add to the stature counts, not that they follow from it."""
    place = Place.of(TASK)
    taller = Place.of(TASK.replace({"stature": 1.845, "walk.step_length": TASK.walk.step_length}))
    assert place.distance(taller) == pytest.approx(0.09 / 0.9)
    longer = Place.of(TASK.replace(thigh=TASK.subject.thigh + 0.05))
    assert place.distance(longer) == pytest.approx(0.05 / 0.5)
    assert place.distance(Place.of(TASK.replace({"percentile": 50.0}))) == 0.0
