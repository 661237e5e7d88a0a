"""A scenario file is either understood wholly or refused in one line that helps."""

import dataclasses
import json
import math
import os
import pickle
import threading
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from human_gait.exceptions import ScenarioError
from human_gait.scenario import (
    Discretisation,
    DofRange,
    Limits,
    Load,
    Phases,
    Scenario,
    Subject,
    Walk,
    lawful_name,
    load_scenario,
    scenario_file,
    shipped_scenarios,
    text,
)

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
    return [(name, kind) for name, kind in Scenario.sections().items() if kind is not Limits]


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
        ("[walk]\nstep_length = 0.7\n", ["walk.speed", "is missing"]),
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
        (
            WALK + "[discretisation]\nintervals = 400\ndynamics_per_interval = 8\n",
            ["intervals = 400", "at most 125", "dynamics_per_interval = 8"],
        ),
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
        (WALK + "[phases]\nfoot_flat = 0.4\n", ["phases.foot_flat = 0.4", "must not come after"]),
        ('name = "../escape"\n' + WALK, ["name", "letters"]),
        ('name = ""\n' + WALK, ["name", "letters"]),
        (WALK + "[limits]\npelvis_rx = 3\n", ["limits.pelvis_rx = 3", "2 numbers", "deg"]),
        (WALK + "[limits]\npelvis_rx = [3, -3]\n", ["limits.pelvis_rx", "lower"]),
        (WALK + "[limits]\npelvis_tz = [0, 90]\n", ["limits.pelvis_tz", "each", "m"]),
        (WALK + "[limits]\nfrozen = [1]\n", ["limits.frozen", "list of names"]),
        (WALK + '[limits]\nfrozen = ["a"]\na = [0, 1]\n', ["limits.a", "is frozen"]),
        ("walk = ", ["is not TOML"]),
        ("a = " + 5000 * "[", ["cannot be a scenario", "20 brackets"]),
        ("a = " + 5000 * "9", ["cannot be a scenario", "400 digits"]),
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


# --- files that would keep their reader busy

LIMITS = "[limits]\n"
ENDLESS = {
    "a key of 20,000 parts": "a." * 20_000 + "a = 1\n",
    "a heading of 21 parts": "[" + "a." * 20 + "a]\n" + WALK,
    "a quoted key": '"a" . ' * 30 + "a = 1\n",
    "a key in an inline table": "x = {" + "a." * 30 + "a = 1}\n",
    "brackets": "x = " + "[" * 5000,
    "inline tables": "x = " + "{a = " * 5000,
    "a number": "[walk]\nspeed = " + "9" * 4400,
    "a number with underscores": "x = -" + "9_" * 4400 + "9",
    "a mebibyte": "#" * 1_048_576,
    "blanks before a unit": WALK.replace("1.2", '"' + " " * 200_000 + '1 m/s"'),
    "joints": WALK + LIMITS + "".join(f"j{i} = [0, 1]\n" for i in range(2_000)),
    "frozen joints": WALK + LIMITS + f"frozen = {[f'j{i}' for i in range(2_000)]}\n",
}
PYTHONS_WORDS = ("recursion", "sys.", "Exceeds", "Traceback", "NoneType", "Input should")


@pytest.mark.parametrize("content", ENDLESS.values(), ids=ENDLESS)
def test_a_file_without_end_is_refused_at_once_in_plain_words(tmp_path, content):
    began = time.process_time()
    message = refusal(tmp_path, content)
    assert time.process_time() - began < 2.0
    assert len(message) < 300
    assert [word for word in PYTHONS_WORDS if word in message] == []


def test_dots_and_brackets_that_are_no_keys_are_no_obstacle(tmp_path):
    dots, brackets = "a." * 500, "[" * 500
    content = f"name = 'x'  # {dots} {brackets}\n{WALK}step_width = 0.1 # '{dots}\n"
    assert read(tmp_path, content).walk.step_width == 0.1
    message = refusal(tmp_path, f'name = "{brackets}\\"{dots}"\n{WALK}')
    assert "letters" in message


def test_lists_within_lists_are_refused_from_python_too():
    deep: list = []
    for _ in range(5000):
        deep = [deep]
    for table in ({"walk": {"speed": deep}}, {"load": {"position": deep}}, {"limits": deep}):
        with pytest.raises(ScenarioError):
            Scenario.from_dict({"walk": {"speed": 1.2, "step_length": 0.7}, **table})
        assert "without end" in str(ScenarioError("a", "b", deep))


def test_a_device_is_no_file():
    for path in ("/dev/zero", "/dev/null", "/"):
        with pytest.raises(ScenarioError, match=r"cannot be read: it is a (device|folder)"):
            load_scenario(path)


def test_a_pipe_is_read_until_its_end(tmp_path):
    pipe = tmp_path / "walk.toml"
    os.mkfifo(pipe)
    writer = threading.Thread(target=pipe.write_text, args=(WALK,))
    writer.start()
    assert load_scenario(pipe).name == "walk"
    writer.join()


def test_nobody_waits_for_ever_for_who_writes_to_a_pipe(tmp_path, monkeypatch):
    pipe = tmp_path / "walk.toml"
    os.mkfifo(pipe)
    monkeypatch.setattr(text, "LONGEST_WAIT", 0.2)
    with pytest.raises(ScenarioError, match="not ended after"):
        load_scenario(pipe)  # nobody writes
    held = os.open(pipe, os.O_RDWR)  # somebody has it open and says no more
    os.write(held, b"[walk]\n")
    with pytest.raises(ScenarioError, match="not ended after"):
        load_scenario(pipe)
    os.close(held)


# --- several things wrong at once


SEVERAL = """
colour = "red"
[walk]
speed = 9
step_lenght = 0.7
[subject]
sex = "x"
mass = "40 ft"
[phases]
foot_flat = 0.4
heel_off = 0.2
[discretisation]
control_points = 5
periodicity = "acceleration"
intervals = 3
[limits]
frozen = ["pelvis_tz", "a"]
a = [0, 1]
b = [3, -3]
"""
WRONG = [
    "colour",
    "walk.step_lenght",
    "walk.speed",
    "subject.sex",
    "subject.mass",
    "phases.foot_flat",
    "phases.heel_off",
    "discretisation.intervals",
    "discretisation.control_points",
    "limits.b",
    "limits.frozen",
    "limits.a",
]


def test_everything_that_is_wrong_is_told_at_once_each_in_a_line_with_the_file(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(SEVERAL)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    errors = caught.value.errors
    assert sorted(error.key for error in errors) == sorted(WRONG)
    assert str(caught.value).split("\n") == [str(error) for error in errors]
    assert all(str(error).startswith(f"{path}: {error.key}") for error in errors)
    assert all(error.errors == (error,) or len(error.errors) == 1 for error in errors)


def test_a_single_error_is_as_it_was(tmp_path):
    message = refusal(tmp_path, WALK + "[subject]\nmass = -70\n")
    assert message == "subject.mass = -70: must be a number from 30 to 200 kg"


@pytest.mark.parametrize(
    ("content", "lines"),
    [
        ("[walk]\nspead = 1.2\n", 1),  # that speed is missing follows from the slip
        ("[wlak]\nspeed = 1.2\nstep_length = 0.7\n", 1),
        ("", 1),
        ('[walk]\nspeed = "fast"\n', 1),  # the step follows from it
        ("[walk]\nstep_length = 5\n[load]\nmass = 5\nposition = [0.1, 0, 0]\n", 3),
        (WALK + "[phases]\nheel_off = 0.1\n", 1),  # two rules, one event
    ],
)
def test_what_follows_from_one_slip_is_told_once(tmp_path, content, lines):
    assert len(refusal(tmp_path, content).splitlines()) == lines


def test_conflicts_between_sections_are_told_beside_errors_elsewhere(tmp_path):
    message = refusal(tmp_path, "[walk]\nspeed = 1.2\nstep_length = 1.5\n[ground]\nfriction = 7\n")
    assert "ground.friction = 7" in message
    assert "the reach of legs" in message


def test_several_errors_travel_between_processes():
    with pytest.raises(ScenarioError) as caught:
        Scenario.from_dict({"walk": {"speed": 9, "step_length": 9}})
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value)
    assert [error.key for error in again.errors] == ["walk.speed", "walk.step_length"]


# --- quantities


def test_quantities_stand_wherever_a_number_with_a_unit_does(tmp_path):
    scenario = read(
        tmp_path,
        """
        [walk]
        speed = "4.32 km/h"
        step_length = "70 cm"
        [subject]
        stature = "5 ft 9 in"
        mass = "12 st"
        [load]
        mass = "40 lb"
        position = ["0 in", 0.05, "-22 cm"]
        [phases]
        heel_off = "65 %"
        [posture]
        spine_deg = "0.1 rad"
        [limits]
        pelvis_rx = ["-6 deg", "0.1 rad"]
        pelvis_tz = ["-1 ft", 2]
        """,
    )
    assert scenario.walk == Walk(4.32 / 3.6, 0.7)
    assert (scenario.subject.stature, scenario.subject.mass) == (1.7526, 168 * 0.45359237)
    assert scenario.load == Load(18.1436948, (0.0, 0.05, -0.22))
    assert scenario.phases == Phases(heel_off=0.65)
    assert scenario.posture.spine_deg == pytest.approx(math.degrees(0.1))
    tilt, path = scenario.limits.ranges
    assert (tilt.lower, tilt.upper) == (-6.0, pytest.approx(math.degrees(0.1)))
    assert (path.lower, path.upper) == (-0.3048, 2.0)


@pytest.mark.parametrize(
    ("setting", "parts"),
    [
        ('[load]\nmass = "40 ft"', ['load.mass = "40 ft"', "is a length, a mass is wanted"]),
        ('[subject]\nstature = "9 ft"', ['= "9 ft"', "is 2.743 m, must be", "from 1.3 to 2.2 m"]),
        ('[load]\nposition = [0, "5 ft", 0]', ["is 0, 1.524, 0 m", "each from -1 to 1 m"]),
        ('[load]\nmass = "40"', ['"40"', "must be a number", 'its unit, such as "40 lb"']),
        ('[load]\nmass = "40 lbz"', ["unknown unit, lbz, did you mean lb?"]),
        ('[ground]\nfriction = "5 kg"', ["friction", "must be a number from 0.05 to 2"]),
        ('[discretisation]\nintervals = "20"', ["intervals", "must be a whole number"]),
        ('[limits]\npelvis_rx = ["1 m", 2]', ["limits.pelvis_rx", "a length, an angle is wanted"]),
    ],
)
def test_a_wrong_quantity_is_told_as_written_and_converted(tmp_path, setting, parts):
    message = refusal(tmp_path, WALK + setting + "\n")
    assert [part for part in parts if part not in message] == []
    assert "\n" not in message


# --- in Python


def scenario(**sections):
    return Scenario(name="a", **{"walk": {"speed": 1.2, "step_length": 0.7}, **sections})


def test_plain_tables_become_sections():
    made = scenario(load={"mass": "40 lb"}, limits={"frozen": ["pelvis_rx"]})
    assert made.walk == Walk(1.2, 0.7)
    assert made.load == Load(18.1436948)
    assert made.limits == Limits(("pelvis_rx",))
    with pytest.raises(ScenarioError, match=r"load\.mas: unknown setting, did you mean mass\?"):
        scenario(load={"mas": 1.0})
    with pytest.raises(ScenarioError, match="load = 3: must be a table"):
        scenario(load=3)


def test_a_table_without_a_name_makes_a_scenario_with_one():
    named = Scenario.from_dict({"walk": {"speed": 1.2, "step_length": 0.7}})
    assert named.name
    assert Scenario.from_dict(named.to_dict()) == named


@pytest.mark.parametrize(
    "changes",
    [
        {"speed": 1.0},
        {"walk.speed": 1.0},
        {"walk": Walk(1.0, 0.7)},
        {"walk": {"speed": 1.0, "step_length": 0.7}},
        {"walk": Walk(0.5, 0.7), "walk.speed": 1.0},
        {"walk.speed": 1.0, "walk": Walk(0.5, 0.7)},
        {"speed": "3.6 km/h"},
    ],
)
def test_settings_are_replaced_by_any_of_their_names(changes):
    before = scenario(load=Load(5.0), limits={"pelvis_rx": [-6, 6]})
    expected = dataclasses.replace(before, walk=Walk(1.0, 0.7))
    assert before.replace(changes) == expected
    assert before.replace(**changes) == expected
    assert before.walk.speed == 1.2


def test_several_settings_are_replaced_at_once_and_the_rest_stays():
    before = scenario(subject=Subject.default("female"))
    after = before.replace({"load.mass": 5.0}, name="b", frozen=["pelvis_rx"], heel_off=0.7)
    changed = {
        "name": "b",
        "load": Load(5.0),
        "limits": Limits(("pelvis_rx",)),
        "phases": Phases(heel_off=0.7),
    }
    assert after == dataclasses.replace(before, **changed)


def test_the_range_of_a_joint_is_replaced_by_its_key():
    after = scenario(limits={"pelvis_rx": [-6, 6]}).replace({"limits.pelvis_rx": [-3, "3 deg"]})
    assert after.limits.ranges == (DofRange("pelvis_rx", -3.0, 3.0),)


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        ({"sped": 1.0}, ["sped: unknown setting", "did you mean walk.speed?"]),
        ({"wlak": 1.0}, ["wlak: unknown setting", "did you mean walk?"]),
        ({"walk.sped": 1.0}, ["walk.sped: unknown", "did you mean speed?"]),
        ({"wlak.speed": 1.0}, ["wlak.speed: unknown", "did you mean walk.speed?"]),
        ({"walk.speed.x": 1.0}, ["walk.speed.x: unknown"]),
        ({"zzz": 1.0}, ["zzz: unknown setting, known are name, walk"]),
        ({"knee_flexion_r": [0, 70]}, ["did you mean limits.knee_flexion_r?"]),
        ({"knee_flex_l": [0, 70]}, ["did you mean limits.knee_flexion_l?"]),
        ({"limits.ranges": ()}, ["limits.ranges: is no joint", "name"]),
        ({"limits.ranges": [0, 70]}, ["limits.ranges: is no joint", "name"]),
        ({"ranges": ()}, ["ranges: unknown"]),
        ({"mass": 80.0}, ["mass: could be", "subject.mass or load.mass"]),
        ({"walk.speed": 1.0, "speed": 1.0}, ["walk.speed: is given twice"]),
        ({"speed": 99.0}, ["walk.speed = 99.0: must be a number"]),
        ({"walk": {"step_length": 0.6}}, ["walk.speed: is missing"]),
        ({"walk": 3, "walk.speed": 1.0}, ["walk = 3: must be a table"]),
        ({"step_length": 1.5}, ["step_length", "reach of legs"]),
        ({"mass": 1, "zzz": 1}, ["mass: could be", "zzz: unknown"]),
    ],
)
def test_a_wrong_replacement_is_refused_with_what_could_be_meant(changes, parts):
    with pytest.raises(ScenarioError) as caught:
        scenario().replace(changes)
    assert [part for part in parts if part not in str(caught.value)] == []


def test_every_setting_but_the_shared_names_can_be_replaced_by_its_own_name():
    keys = Scenario.inner_keys()
    bare = [key.partition(".")[2] for key in keys]
    before = scenario()
    for key, name in zip(keys, bare, strict=True):
        section = key.partition(".")[0]
        same = {name: getattr(getattr(before, section), name)}
        if bare.count(name) == 1:
            assert before.replace(same) == before
        assert name not in Scenario.kinds()  # or it would mean the section


def test_the_shipped_scenarios_are_found_by_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert set(shipped_scenarios()) == {path.stem for path in (ROOT / "scenarios").glob("*.toml")}
    for name, path in shipped_scenarios().items():
        assert scenario_file(name) == path
        assert load_scenario(name).name == name


def test_a_file_of_ones_own_comes_before_a_shipped_scenario_of_that_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "normal").write_text("[walk]\nspeed = 0.3\nstep_length = 0.3\n")
    (tmp_path / "preferred").mkdir()
    assert load_scenario("normal").walk.speed == 0.3
    assert load_scenario("preferred").walk.speed == 1.2


@pytest.mark.parametrize("path", ["normal.toml", "./normal", "scenarios/normal"])
def test_what_looks_like_a_file_is_one(tmp_path, monkeypatch, path):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ScenarioError, match="cannot be read"):
        load_scenario(path)


def test_a_name_that_nearly_is_a_shipped_scenario_is_told(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ScenarioError, match=r"nomal: cannot be read.*did you mean normal\?"):
        load_scenario("nomal")
    with pytest.raises(ScenarioError, match=r"zzz: cannot be read.*the package has .*normal"):
        load_scenario("zzz")
    (tmp_path / "my.walk.toml").touch()
    with pytest.raises(ScenarioError, match=r"my\.walk: cannot be read.*mean my\.walk\.toml\?"):
        load_scenario("my.walk")


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


KNEE = "knee_flexion_r"


@pytest.mark.parametrize(
    ("make", "parts"),
    [
        (lambda: Limits(frozen=KNEE), ["limits.frozen", KNEE, "list of names"]),
        (lambda: Limits(frozen=(1,)), ["limits.frozen", "list of names"]),
        (lambda: Limits(frozen=("pelvis_ty",)), ["limits.frozen", "pelvis_ty"]),
        (lambda: Limits(ranges=DofRange(KNEE, 0, 70)), ["limits.ranges", "list of ranges"]),
        (lambda: Limits(ranges=((KNEE, 0, 70),)), ["limits.ranges", KNEE, "DofRange"]),
        (lambda: Limits((KNEE,), (DofRange(KNEE, 0, 70),)), [f"limits.{KNEE}", "is frozen"]),
        (lambda: Limits((), 2 * (DofRange(KNEE, 0, 70),)), [f"limits.{KNEE}", "twice"]),
        (lambda: DofRange(KNEE, 70, 0), [f"limits.{KNEE} = [70, 0]", "lower not above upper"]),
        (lambda: DofRange(KNEE, 0, math.nan), [f"limits.{KNEE}", "-180 to 180 deg"]),
        (lambda: DofRange("pelvis_tz", 0, 70), ["limits.pelvis_tz", "-20 to 20 m"]),
        (lambda: DofRange(KNEE, "0 m", "70 deg"), [f"limits.{KNEE}", "an angle is wanted"]),
        (lambda: DofRange("frozen", 0, 70), ["limits.frozen", "is no joint"]),
        (lambda: DofRange("ranges", 0, 70), ["limits.ranges", "is no joint"]),
        (lambda: DofRange(3, 0, 70), ["limits = 3", "name of a joint"]),
    ],
)
def test_wrong_limits_are_refused_wherever_they_are_made(make, parts):
    with pytest.raises(ScenarioError) as caught:
        make()
    assert len(caught.value.errors) == 1
    assert [part for part in parts if part not in str(caught.value)] == []


def test_all_that_is_wrong_with_limits_is_told_at_once():
    with pytest.raises(ScenarioError) as caught:
        Limits(frozen=KNEE, ranges=3)
    assert [error.key for error in caught.value.errors] == ["limits.frozen", "limits.ranges"]


def test_limits_are_the_same_however_they_are_written():
    """Lists become tuples, quantities and integers numbers: as from a file."""
    ranges = [DofRange(KNEE, "0 rad", "90 deg"), DofRange("pelvis_tz", 0, "150 cm")]
    made = scenario(limits=Limits(["pelvis_rx"], ranges))
    written = {"frozen": ["pelvis_rx"], KNEE: [0.0, 90.0], "pelvis_tz": [0, 1.5]}
    assert made == scenario(limits=written)
    assert hash(made) == hash(scenario(limits=written))
    assert made.limits.ranges_si(DOF_NAMES)[KNEE] == pytest.approx((0.0, math.pi / 2))
    assert Scenario.from_dict(tomllib.loads(made.to_toml())) == made


def test_all_names_that_are_no_dof_are_told_at_once():
    limits = Limits(("a", "b"), (DofRange("c", 0.0, 1.0), DofRange("d", 0.0, 1.0)))
    for ask, names in ((limits.frozen_dofs, "ab"), (limits.ranges_si, "cd")):
        with pytest.raises(ScenarioError) as caught:
            ask(DOF_NAMES)
        assert len(caught.value.errors) == 2
        assert all(name in str(e) for name, e in zip(names, caught.value.errors, strict=True))


def test_thousands_of_unknown_settings_are_refused_quickly():
    table = {"walk": {"speed": 1.2, "step_length": 0.7}, **{f"w{i}": 1 for i in range(5000)}}
    with pytest.raises(ScenarioError) as caught:
        Scenario.from_dict(table)
    assert len(caught.value.errors) < 100


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
    "subject": {  # the trunk is what the lengths leave of the stature
        "stature": st.floats(1.6, 1.9),
        "percentile": st.floats(40.0, 90.0),
        "thigh": st.floats(0.39, 0.45),
        "shank": st.floats(0.39, 0.45),
        "ankle_height": st.floats(0.05, 0.09),
        "head_and_neck": st.floats(0.2, 0.27),
    },
    "load": {"position": st.tuples(st.just(0.0), st.floats(-1, 1), st.floats(-1, 1))},
    "discretisation": {"control_points": st.integers(6, 60), "intervals": st.integers(12, 125)},
}
SCENARIOS = st.fixed_dictionaries(
    {
        "name": st.from_regex(r"[a-z][a-z0-9 .+-]{0,9}", fullmatch=True),
        "walk": settings_of(Walk, step_length=st.floats(0.1, 0.76)),
        "phases": settings_of(
            Phases,
            foot_flat=st.floats(0.01, 0.175),
            ball_off=st.floats(0.01, 0.175),
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


@given(SCENARIOS)
def test_a_scenario_survives_the_way_through_a_file(table):
    scenario = Scenario.from_dict(table)
    assert Scenario.from_dict(tomllib.loads(scenario.to_toml())) == scenario


@given(SCENARIOS)
def test_a_scenario_is_shown_shortly_and_as_it_can_be_made_again(table):
    scenario = Scenario.from_dict(table)
    shown = repr(scenario)
    kinds = {kind.__name__: kind for _, kind in sections()}
    again = eval(shown, {"Scenario": Scenario, "Limits": Limits, "DofRange": DofRange, **kinds})
    assert again == scenario
    assert hash(again) == hash(scenario)
    assert shown.count("\n") < 14


def test_what_is_as_by_default_is_not_shown():
    assert repr(scenario()) == "Scenario(name='a', walk=Walk(speed=1.2, step_length=0.7))"
    assert repr(Load()) == "Load()"
    assert repr(Discretisation(intervals=30)) == "Discretisation(intervals=30)"


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


# --- names that come from files


@pytest.mark.parametrize(
    ("stem", "name"),
    [
        ("walk (1)", "walk-1"),
        ("a&b", "a-b"),
        ("sub,1", "sub-1"),
        ("subject's walk", "subject-s walk"),
        ("trial[3]", "trial-3"),
        ("1.2m_s@treadmill", "1.2m_s-treadmill"),
        ("walk#2", "walk-2"),
        ("walk - (2)", "walk-2"),
        ("-walk", "walk"),
        ("  walk ", "walk"),
        ("walk ", "walk "),  # lawful as it is
        ("a:b\\c|d", "a-b-c-d"),
        ("a\nb\x1b[1m", "a-b-1m"),
        ("???", "scenario"),
        ("caf\udce9", "caf"),  # bytes that are no UTF-8
        ("e\u0301te\u0301", "\u00e9t\u00e9"),
        ("x" * 240, "x" * 100),
    ],
)
def test_a_file_of_any_name_gives_its_scenario_a_lawful_one(tmp_path, stem, name):
    path = tmp_path / f"{stem}.toml"
    path.write_text("[walk]\nspeed = 1.3\nstep_length = 0.7\n")
    assert load_scenario(path).name == name
    assert lawful_name(name) == name


@given(st.text(max_size=150))
def test_there_is_a_lawful_name_for_every_text(text):
    assert Scenario(lawful_name(text), {"speed": 1.3, "step_length": 0.7})


def test_a_name_that_is_written_is_taken_as_it_is_or_refused(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text('name = "walk (1)"\n[walk]\nspeed = 1.3\nstep_length = 0.7\n')
    with pytest.raises(ScenarioError, match=r'name = "walk \(1\)": must be a name of at most 100'):
        load_scenario(path)
