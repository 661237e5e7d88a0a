"""One word sets all defaults; what is left out follows from the rest, what is given is kept."""

import copy
import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from walking import guessed_gait

from human_gait.scenario import (
    Discretisation,
    Ground,
    Objective,
    Phases,
    Posture,
    Scenario,
    Tolerances,
    Walk,
    load_scenario,
    shipped_scenarios,
)
from human_gait.settings.records import all_settings
from human_gait.walk.described import gait_digest, was_changed
from human_gait.walk.gait_file import load_gait, save_gait

FORMULATIONS = ("human", "effort", "paper")
WALK = {"speed": 1.2, "step_length": 0.66}
FIRST = {  # all settings of versions before the formulations, but those of person and limits
    "walk": WALK | {"step_width": 0.1},
    "phases": {
        "foot_flat": 0.15,
        "ball_off": 0.15,
        "double_support": 0.25,
        "heel_unloading": 0.35,
        "mid_swing": 0.4,
        "heel_off": 0.65,
    },
    "load": {
        "mass": 0.0,
        "position": [0.0, 0.05, -0.22],
        "size": [0.3, 0.45, 0.2],
        "model": "rigid",
    },
    "discretisation": {
        "control_points": 8,
        "periodicity": "acceleration",
        "intervals": 20,
        "dynamics_per_interval": 2,
    },
    "tolerances": {
        "contact": 0.004,
        "contact_speed": 0.3,
        "load_transfer": 0.3,
        "feet_apart": 0.06,
        "zmp_margin": 0.005,
        "pelvis_speed": 0.1,
        "knee_flexion_deg": 5.0,
        "arm_leg": 0.01,
    },
    "ground": {"sharing": "pivot", "pivot_height": 1.0, "friction": 0.5},
    "objective": {"kind": "torque_squared", "weighting": "none", "passive_torques": "tissue"},
    "posture": {
        "pelvis_deg": 8.0,
        "spine_deg": 4.0,
        "neck_deg": 5.0,
        "arms_deg": 20.0,
        "swing_knee": "bent",
    },
}
WITHOUT_EFFECT = {  # what was added since, at values that change nothing of the walks of before
    "tolerances": {"contact_height": 0.004, "landing_speed": 0.3, "toe_off_speed": 0.3},
    "ground": {"ball": "foot"},
    "objective": {
        "knee": 1.0,
        "arms": 1.0,
        "passive_cost": 0.0,
        "activation_time": 0.0,
        "positive_work": 0.0,
        "negative_work": 0.0,
        "steady_head": 0.0,
        "steady_trunk": [0.0, 0.0, 0.0],
    },
    "posture": {"limbs": "free"},
}
CHANGEABLE = [
    one
    for one in all_settings()
    if one.section not in ("", "limits") and one.key not in ("formulation", "kind")
]


def of(formulation, **sections):
    objective = {"formulation": formulation, **sections.pop("objective", {})}
    return Scenario("a", **{"walk": WALK, **sections, "objective": objective})


def parts(table, of_table):
    """The settings of a table that another one has."""
    return {name: {key: table[name][key] for key in of_table[name]} for name in of_table}


# --- what the words stand for


def test_effort_is_all_that_was_before_the_formulations():
    table = json.loads(json.dumps(of("effort").to_dict()))
    assert parts(table, FIRST) == FIRST
    assert parts(table, WITHOUT_EFFECT) == WITHOUT_EFFECT


def test_paper_is_effort_with_eqs_17_and_18_as_printed():
    printed = {"ground.sharing": "parallel", "objective.passive_torques": "none"}
    paper = of("paper")
    assert of("effort").replace(printed | {"formulation": "paper"}) == paper
    changed = {
        key
        for key, value in paper.to_dict()["objective"].items()
        if value != of("effort").to_dict()["objective"][key]
    }
    assert changed == {"formulation", "passive_torques"}


def test_human_is_what_there_is_without_a_word():
    assert of("human") == Scenario("a", WALK)
    assert Objective() == Objective(formulation="human")


@pytest.mark.parametrize("name", shipped_scenarios())
def test_scenarios_of_the_original_study_say_their_formulation(name):
    original = "paper" in name or name in ("frozen-38", "backpack-40-force", "preferred-plain")
    assert (load_scenario(name).objective.formulation == "human") is not original


# --- own values


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_own_values_override_those_of_a_formulation(formulation):
    for setting in CHANGEABLE:
        own = _another(setting, of(formulation).to_dict()[setting.section][setting.key])
        found = of(formulation).replace({setting.dotted: own})
        assert found.to_dict()[setting.section][setting.key] == own
        table = {"name": "a", "walk": WALK, "objective": {"formulation": formulation}}
        table[setting.section] = {**table.get(setting.section, {}), setting.key: own}
        assert Scenario.from_dict(table) == found


def _another(setting, usual):
    if setting.choices:
        return next((choice for choice in setting.choices if choice != usual), usual)
    if setting.count > 1:
        return [usual[0], *(0.9 * value + 0.01 for value in usual[1:])]
    return usual + 1 if setting.whole else 0.9 * usual + 0.01 * setting.low + 1e-3


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_sections_can_be_tables_or_objects(formulation):
    given = {
        "phases": {"heel_off": 0.66},
        "tolerances": {"contact": 0.003},
        "ground": {"friction": 0.4},
        "posture": {"arms_deg": 15.0},
        "discretisation": {"control_points": 10},
    }
    kinds = (Phases, Tolerances, Ground, Posture, Discretisation)
    made = [kind(**given[name]) for name, kind in zip(given, kinds, strict=True)]
    objects = dict(zip(given, made, strict=True)) | {"objective": Objective(formulation)}
    assert Scenario("a", Walk(**WALK), **objects) == of(formulation, **given)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_an_objective_alone_knows_its_formulation(formulation):
    assert Objective(formulation=formulation) == of(formulation).objective
    assert Objective.from_table({"formulation": formulation}) == of(formulation).objective


# --- changes


@pytest.mark.parametrize("before", FORMULATIONS)
@pytest.mark.parametrize("after", FORMULATIONS)
def test_another_formulation_changes_what_was_left_out_and_keeps_what_was_given(before, after):
    assert of(before).replace(formulation=after) == of(after)
    given = {
        "tolerances": {"contact_speed": 0.17},
        "ground": {"friction": 0.41},
        "discretisation": {"control_points": 9},
    }
    assert of(before, **given).replace(formulation=after) == of(after, **given)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_any_change_keeps_the_formulation(formulation):
    for change in ({"name": "b"}, {"friction": 0.4}, {"walk.speed": 1.1}, {"limbs": "free"}):
        assert of(formulation).replace(change).objective.formulation == formulation
    assert replace(of(formulation), name="b") == of(formulation).replace(name="b")


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_another_speed_changes_what_follows_from_it(formulation):
    faster = of(formulation).replace(speed=1.7)
    assert faster == of(formulation, walk=WALK | {"speed": 1.7})
    follows = {"phases", "tolerances"} if formulation == "human" else set()
    names = [name for name in Scenario.sections() if name != "walk"]
    moved = {n for n in names if getattr(faster, n) != getattr(of(formulation), n)}
    assert moved == follows
    own = of(formulation, phases={"double_support": 0.275}, tolerances={"pelvis_speed": 0.12})
    kept = own.replace(speed=1.7)
    assert (kept.phases.double_support, kept.tolerances.pelvis_speed) == (0.275, 0.12)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("speed", [0.6, 1.2, 1.9])
def test_copies_are_equal_and_follow_as_the_first(formulation, speed):
    scenario = of(formulation, walk={"speed": speed}, posture={"spine_deg": 30.0})
    shown = eval(
        repr(scenario), {kind.__name__: kind for kind in (Scenario, Walk, Posture, Objective)}
    )
    again = pickle.loads(pickle.dumps(scenario)), copy.copy(scenario), copy.deepcopy(scenario)
    read = Scenario.from_dict(scenario.to_dict()), Scenario.from_record(scenario.to_dict())
    for one in (shown, *again, *read):
        assert one == scenario
        assert hash(one) == hash(scenario)
        assert one.replace(speed=1.5) == scenario.replace(speed=1.5)
        assert one.replace(formulation="human") == scenario.replace(formulation="human")


# --- results of earlier versions


def test_a_record_without_formulation_is_effort():
    table = {"name": "a", **FIRST}
    assert Scenario.from_record(table) == of("effort").replace({"subject.mass": 78.4})
    assert Scenario.from_record(of("paper").to_dict()) == of("paper")
    assert Scenario.from_record(of("human").to_dict()) == of("human")


def test_nothing_that_was_added_since_is_told_of_a_walk_of_before():
    """What the digest of a file is of: the same as when it was written."""
    for table in (FIRST, FIRST | {"ground": FIRST["ground"] | {"friction": 0.4}}):
        own = Scenario.from_record({"name": "a", **table}).own_table()
        assert {key for name in own if name != "name" for key in own[name]} <= {
            key for section in FIRST.values() for key in section
        }


def test_a_gait_of_an_earlier_version_is_the_one_that_was_written(tmp_path):
    """Its file holds the settings of its time."""
    gait = guessed_gait()
    save_gait(gait, tmp_path)
    with np.load(tmp_path / "gait.npz") as file:
        members = dict(file)
    table = json.loads(str(members["scenario"]))
    for name, section in WITHOUT_EFFECT.items():
        for key in section:
            del table[name][key]
    for key in ("formulation", "tendon_stiffness"):
        del table["objective"][key]
    for key in ("pad", "loading"):
        del table["ground"][key]
    del table["tolerances"]["limbs_apart"]
    members["scenario"] = np.array(json.dumps(table))
    members.pop("digests", None)
    np.savez(tmp_path / "gait.npz", **members)
    old = load_gait(tmp_path)
    assert old.scenario == gait.scenario
    assert gait_digest(old) == gait_digest(gait)
    assert not was_changed(old)


# --- what follows from speed and stature

SPEEDS = st.floats(0.4, 2.5)


@given(SPEEDS)
def test_phases_by_speed_follow_each_other_on_the_grid(speed):
    phases = Scenario("a", {"speed": speed, "step_length": 0.6}).phases
    grid = 40
    assert phases.ball_off <= phases.double_support < phases.heel_unloading < phases.heel_off
    assert phases.foot_flat <= phases.double_support
    for event in vars(Phases()):
        if not event.startswith("_"):
            place = getattr(phases, event) * grid
            assert place == pytest.approx(round(place), abs=1e-9), event


@given(SPEEDS, SPEEDS)
def test_a_faster_walker_stands_on_both_feet_for_less_time(one, other):
    slow, fast = sorted((one, other))
    both = [Scenario("a", {"speed": v, "step_length": 0.6}).phases for v in (slow, fast)]
    assert both[0].double_support >= both[1].double_support
    assert both[0].ball_off >= both[1].ball_off


@given(st.floats(0.06, 0.34))
def test_other_events_follow_the_double_support_that_is_given(both):
    phases = of("human", phases={"double_support": both}).phases
    assert phases.ball_off <= both
    assert phases.foot_flat <= both


@given(SPEEDS)
def test_speeds_of_standing_points_by_speed_are_allowed_and_in_order(speed):
    found = Scenario("a", {"speed": speed, "step_length": 0.6}).tolerances
    assert found.contact_speed <= min(found.landing_speed, found.toe_off_speed)
    assert found.contact_height <= found.contact
    assert found.pelvis_speed == pytest.approx(speed / 8, abs=1e-4)
    for name in found.kinds():
        low, high = found.rule(name)["range"]
        assert low <= getattr(found, name) <= high


def test_more_room_for_one_point_is_room_for_those_that_follow():
    found = of("human", tolerances={"contact_speed": 0.9, "contact": 0.0005}).tolerances
    assert found.landing_speed == found.toe_off_speed == 0.9
    assert found.contact_height == 0.0005
    effort = of("effort", tolerances={"contact_speed": 0.2, "contact": 0.006}).tolerances
    assert effort.landing_speed == effort.toe_off_speed == 0.2
    assert effort.contact_height == 0.006


@given(st.floats(0.5, 2.0), st.floats(1.5, 2.0))
def test_steps_that_people_take_grow_with_speed_and_stature(speed, stature):
    steps = [
        Scenario("a", {"speed": v}, {"stature": h}).walk.step_length
        for v, h in ((speed, stature), (speed + 0.1, stature), (speed, stature + 0.1))
    ]
    assert steps[0] < min(steps[1:])
    assert steps[1] - steps[0] == pytest.approx(0.0306, abs=2e-3)
    assert 0.3 * stature < steps[0] * 1.2 / speed**0.5 < 0.6 * stature


def test_the_step_is_that_of_the_measured_adults_unless_it_is_given():
    """Fukuchi et al. 2018: 0.63 m at 1.2 m/s."""
    assert Scenario("a", {"speed": 1.2}).walk.step_length == pytest.approx(0.63, abs=0.01)
    assert of("human").replace(speed=0.9).walk.step_length == WALK["step_length"]
    left_out = Scenario("a", {"speed": 1.2}).replace(speed=0.9)
    assert left_out.walk.step_length < 0.6
