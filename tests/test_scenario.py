"""A scenario file is either understood wholly or refused in one line that helps."""

import dataclasses
import json
import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from human_gait.exceptions import ScenarioError
from human_gait.scenario import Limits, Load, Phases, Scenario, Subject, Walk, load_scenario
from human_gait.scenario.schema import Section

ROOT = Path(__file__).resolve().parent.parent
WALK = "[walk]\nspeed = 1.2\nstep_length = 0.7\n"
DOF_NAMES = ("pelvis_tz", "pelvis_rx", "knee_flexion_r")


def read(tmp_path, content):
    path = tmp_path / "case.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return load_scenario(path)


def refusal(tmp_path, content):
    with pytest.raises(ScenarioError) as caught:
        read(tmp_path, content)
    message = str(caught.value)
    assert message.startswith(f"{tmp_path / 'case.toml'}: ")
    return message.removeprefix(f"{tmp_path / 'case.toml'}: ")


def sections():
    return [
        (name, kind)
        for name, kind in Scenario.kinds().items()
        if isinstance(kind, type) and issubclass(kind, Section) and kind is not Limits
    ]


def numbers():
    """Return (section, setting, low, high) of every setting that is one number."""
    return [
        (section, name, *kind.rule(name)["range"])
        for section, kind in sections()
        for name, type_ in kind.kinds().items()
        if type_ in (int, float)
    ]


# --- files that are right


@pytest.mark.parametrize("path", sorted((ROOT / "scenarios").glob("*.toml")), ids=lambda p: p.stem)
def test_shipped_scenarios_load_and_are_named_after_their_file(path):
    assert load_scenario(path).name == path.stem


def test_shipped_scenarios_hold_the_speeds_and_step_lengths_they_are_named_for():
    normal, preferred = (
        load_scenario(ROOT / "scenarios" / f"{name}.toml").walk for name in ("normal", "preferred")
    )
    assert (normal.speed, normal.step_length) == (1.2, 0.7)
    assert (preferred.speed, preferred.step_length) == (1.2, 0.66)


def test_speed_and_step_length_suffice(tmp_path):
    scenario = read(tmp_path, WALK)
    assert scenario.subject == Subject.default("male")
    assert scenario.load == Load()
    assert scenario.walk.step_time == pytest.approx(0.7 / 1.2)


def test_a_byte_order_mark_is_no_obstacle(tmp_path):
    assert read(tmp_path, b"\xef\xbb\xbf" + WALK.encode()).walk.speed == 1.2


def test_integers_are_numbers(tmp_path):
    speed = read(tmp_path, "[walk]\nspeed = 1\nstep_length = 0.6\n").walk.speed
    assert speed == 1.0
    assert isinstance(speed, float)


def test_stature_and_mass_follow_the_sex_unless_given(tmp_path):
    subject = read(tmp_path, WALK + '[subject]\nsex = "female"\nmass = 70\n').subject
    assert subject == dataclasses.replace(Subject.default("female"), mass=70.0)
    assert Subject.default("female").stature < Subject.default("male").stature


def test_a_file_can_name_its_scenario(tmp_path):
    assert read(tmp_path, 'name = "slow 2.0"\n' + WALK).name == "slow 2.0"


def test_numpy_numbers_are_numbers():
    assert Walk(np.float64(1.2), np.float32(0.5), np.int64(0)) == Walk(1.2, 0.5, 0.0)


def test_scenarios_can_be_hashed_and_pickled(tmp_path):
    scenario = read(tmp_path, WALK + '[limits]\nfrozen = ["knee_flexion_r"]\n')
    assert pickle.loads(pickle.dumps(scenario)) == scenario
    assert hash(scenario) == hash(read(tmp_path, WALK + '[limits]\nfrozen = ["knee_flexion_r"]\n'))


# --- files that are wrong


@pytest.mark.parametrize(
    ("content", "parts"),
    [
        ("[walk]\nspead = 1.2\n", ["walk.spead", "did you mean speed?"]),
        ("speed = 1.2\n" + WALK, ["speed", "did you mean walk.speed?"]),
        ("[wlak]\n", ["wlak", "did you mean walk?"]),
        ("[load]\nqqq = 1\n" + WALK, ["load.qqq", "known are mass, position, size"]),
        ("", ["walk.speed", "is missing", "m/s"]),
        ("[walk]\nspeed = 1.2\n", ["walk.step_length", "is missing"]),
        ("walk = 3\n", ["walk = 3", "table"]),
        ("[[walk]]\nspeed = 1.2\n", ["walk", "table"]),
        ("limits = 3\n" + WALK, ["limits = 3", "table"]),
        ('[walk]\nspeed = "1.2"\nstep_length = 0.7\n', ['walk.speed = "1.2"', "number", "m/s"]),
        ("[walk]\nspeed = true\nstep_length = 0.7\n", ["walk.speed = true", "number"]),
        ("[walk]\nspeed = nan\nstep_length = 0.7\n", ["walk.speed = nan", "number"]),
        ("[walk]\nspeed = -inf\nstep_length = 0.7\n", ["walk.speed = -inf", "number"]),
        ("[walk]\nspeed = 1.2\nstep_length = 2024-01-01\n", ["walk.step_length", "2024-01-01"]),
        ("[walk]\nstep_length = 0.7\nspeed = 0x" + 5000 * "f", ["walk.speed", "digits"]),
        (WALK + "[subject]\nmass = -70\n", ["subject.mass = -70", "from 30 to 200 kg"]),
        (WALK + '[subject]\nsex = "x"\n', ["subject.sex", "one of male, female"]),
        (WALK + "[subject]\nsex = 1\n", ["subject.sex = 1", "one of male, female"]),
        (WALK + "[load]\nposition = [0, 1]\n", ["load.position = [0, 1]", "3 numbers"]),
        (WALK + "[load]\nsize = [1, 1, 0]\n", ["load.size", "each from 0.01 to 2 m"]),
        (WALK + "[discretisation]\nintervals = 16.0\n", ["intervals = 16.0", "whole number"]),
        (WALK + "[discretisation]\ncontrol_points = 4\n", ["control_points = 4", "from 5"]),
        (
            WALK + "[load]\nmass = 5.0\nposition = [0.1, 0.0, -0.2]\n",
            ["load.position", "[0.1, 0.0, -0.2]", "mirror images"],
        ),
        (
            WALK + '[discretisation]\ncontrol_points = 5\nperiodicity = "acceleration"\n',
            ["control_points = 5", "at least 6"],
        ),
        (WALK + "[discretisation]\ncontrol_points = true\n", ["control_points", "whole number"]),
        (WALK + '[objective]\nkind = "speed"\n', ["objective.kind", "one of torque_squared"]),
        (WALK + "[phases]\nheel_off = 0.2\n", ["phases.heel_off = 0.2", "must come after"]),
        (WALK + "[phases]\nfoot_flat = 0.3\n", ["phases.foot_flat = 0.3", "must not come after"]),
        ('name = "../escape"\n' + WALK, ["name", "letters"]),
        ('name = ""\n' + WALK, ["name", "letters"]),
        (WALK + "[limits]\npelvis_rx = 3\n", ["limits.pelvis_rx = 3", "2 numbers", "deg"]),
        (WALK + "[limits]\npelvis_rx = [3, -3]\n", ["limits.pelvis_rx", "lower"]),
        (WALK + "[limits]\npelvis_tz = [0, 90]\n", ["limits.pelvis_tz", "each", "m"]),
        (WALK + "[limits]\nfrozen = [1]\n", ["limits.frozen", "list of names"]),
        (WALK + '[limits]\nfrozen = ["a"]\na = [0, 1]\n', ["limits.a", "is frozen"]),
        ("walk = ", ["is not TOML"]),
        ("a = " + 5000 * "[", ["is not TOML"]),
        ("a = " + 5000 * "9", ["is not TOML"]),
        (b"\x00\x01\x02", ["is not TOML"]),
        ("name = 'é'".encode("latin-1"), ["UTF-8"]),
        (WALK.encode("utf-16"), ["UTF-8"]),
    ],
)
def test_a_wrong_file_is_refused_with_key_value_and_what_is_allowed(tmp_path, content, parts):
    message = refusal(tmp_path, content)
    assert [part for part in parts if part not in message] == []
    assert len(message) < 300


@pytest.mark.parametrize("path", [".", "missing.toml", "missing/missing.toml", "nul\0.toml"])
def test_a_path_that_is_no_file_is_refused_by_name(tmp_path, path):
    with pytest.raises(ScenarioError, match="cannot be read"):
        load_scenario(tmp_path / path)


@pytest.mark.parametrize(("section", "name", "low", "high"), numbers())
def test_every_number_is_refused_just_outside_its_range(section, name, low, high):
    table = {"name": "x", "walk": {"speed": 1.2, "step_length": 0.7}}
    for value in (low - 1, high + 1):
        wrong = {**table, section: {**table.get(section, {}), name: value}}
        with pytest.raises(ScenarioError, match=f"^{section}.{name} = "):
            Scenario.from_dict(wrong)


def test_every_setting_says_its_unit_or_its_choices():
    for _, kind in sections():
        for name in kind.kinds():
            assert {"unit", "choices"} & kind.rule(name).keys()


def test_a_value_is_checked_wherever_it_is_made():
    with pytest.raises(ScenarioError, match=r"subject\.mass"):
        Subject("male", 1.7, -70.0)
    with pytest.raises(ScenarioError, match=r"walk\.speed"):
        dataclasses.replace(Walk(1.2, 0.7), speed=math.nan)
    with pytest.raises(ScenarioError, match=r"phases\.heel_off"):
        Phases(heel_off=0.25)


# --- reach


@pytest.mark.parametrize("sex", ["male", "female"])
def test_a_step_up_to_the_reach_of_the_legs_is_accepted_and_a_longer_one_refused(sex):
    subject = Subject.default(sex)
    longest = 2 * subject.leg_length * math.sin(math.radians(35.0))
    assert Scenario("x", Walk(1.2, longest - 1e-9), subject).subject is subject
    with pytest.raises(ScenarioError, match=rf"step_length.*at most {longest:.2f} m"):
        Scenario("x", Walk(1.2, longest + 1e-9), subject)


def test_longer_legs_reach_further():
    walk = Walk(1.2, 1.2)
    with pytest.raises(ScenarioError):
        Scenario("x", walk, Subject("male", 1.6, 60.0))
    assert Scenario("x", walk, Subject("male", 2.1, 100.0)).walk is walk


# --- limits


def test_ranges_are_degrees_for_rotations_and_metres_for_translations(tmp_path):
    limits = read(tmp_path, WALK + "[limits]\npelvis_rx = [-6, 6]\npelvis_tz = [-1, 2]\n").limits
    ranges = limits.ranges_si(DOF_NAMES)
    assert ranges["pelvis_rx"] == pytest.approx((-math.pi / 30, math.pi / 30))
    assert ranges["pelvis_tz"] == (-1.0, 2.0)


def test_a_name_that_is_no_dof_is_refused_with_the_nearest(tmp_path):
    limits = read(
        tmp_path, WALK + '[limits]\nfrozen = ["knee_flex_r"]\npelvis_rX = [0, 1]\n'
    ).limits
    with pytest.raises(ScenarioError, match=r"knee_flex_r.*did you mean knee_flexion_r\?"):
        limits.frozen_dofs(DOF_NAMES)
    with pytest.raises(ScenarioError, match=r"limits.pelvis_rX.*did you mean pelvis_rx\?"):
        limits.ranges_si(DOF_NAMES)
    assert Limits(frozen=("pelvis_rx",)).frozen_dofs(DOF_NAMES) == ("pelvis_rx",)


def test_a_long_list_of_known_names_is_cut():
    names = [f"dof_{number}" for number in range(55)]
    with pytest.raises(ScenarioError, match=r"known are dof_0, .*, \.\.\.$"):
        Limits(frozen=("zzz",)).frozen_dofs(names)


# --- properties


def inside(kind, name, type_):
    """Return a strategy of allowed values of one setting."""
    rule = kind.rule(name)
    if "choices" in rule:
        return st.sampled_from(rule["choices"])
    low, high = rule["range"]
    component = st.integers(low, high) if type_ is int else st.floats(low, high)
    return component if type_ in (int, float) else st.tuples(component, component, component)


def settings_of(kind, **narrower):
    """Return a strategy of tables of one section, some settings narrowed or left out."""
    allowed = {name: inside(kind, name, type_) for name, type_ in kind.kinds().items()} | narrower
    required = {name: allowed.pop(name) for name in ("speed", "step_length") if name in allowed}
    return st.fixed_dictionaries(required, optional=allowed)


RANGES = st.tuples(st.floats(-20, 20), st.floats(-20, 20)).map(sorted)
NARROWER = {  # what other settings of the scenario ask for
    "load": {"position": st.tuples(st.just(0.0), st.floats(-1, 1), st.floats(-1, 1))},
    "discretisation": {"control_points": st.integers(6, 60)},
}
SCENARIOS = st.fixed_dictionaries(
    {
        "name": st.from_regex(r"[a-z][a-z0-9 .+-]{0,9}", fullmatch=True),
        "walk": settings_of(Walk, step_length=st.floats(0.1, 0.76)),
        "phases": settings_of(
            Phases,
            foot_flat=st.floats(0.01, 0.2),
            ball_off=st.floats(0.01, 0.2),
            double_support=st.floats(0.2, 0.34),
            mid_swing=st.floats(0.41, 0.99),
            heel_unloading=st.floats(0.41, 0.6),
            heel_off=st.floats(0.61, 0.99),
        ),
        "limits": st.dictionaries(st.sampled_from(DOF_NAMES), RANGES),
    },
    optional={
        section: settings_of(kind, **NARROWER.get(section, {}))
        for section, kind in sections()
        if kind not in (Walk, Phases)
    },
)


@given(SCENARIOS)
def test_a_scenario_survives_the_way_through_plain_tables_and_json(table):
    scenario = Scenario.from_dict(table)
    assert Scenario.from_dict(scenario.to_dict()) == scenario
    assert Scenario.from_dict(json.loads(json.dumps(scenario.to_dict()))) == scenario


TOML_VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text()
    | st.dates()
    | st.just(10**400),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=5,
)


@given(st.sampled_from(numbers()), TOML_VALUES)
def test_any_value_is_taken_within_the_range_or_refused_by_its_key(setting, value):
    section, name, low, high = setting
    table = {"name": "x", "walk": {"speed": 1.2, "step_length": 0.7}}
    table[section] = {**table.get(section, {}), name: value}
    try:
        scenario = Scenario.from_dict(table)
    except ScenarioError as error:
        refused = error
    else:
        assert low <= getattr(getattr(scenario, section), name) <= high
        return
    assert refused.key.startswith(f"{section}.")
    assert str(refused)


@given(st.binary(max_size=200))
def test_no_file_content_escapes_the_loader(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "any.toml"
    path.write_bytes(content)
    with pytest.raises(ScenarioError):
        load_scenario(path)
