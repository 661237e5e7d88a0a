"""Every setting can be found: in lists, explained, in a new scenario file and in an editor."""

import json
import re
import tomllib
from pathlib import Path
from urllib.parse import urlparse
from urllib.request import url2pathname

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from human_gait import cli
from human_gait.body.skeleton import DOF_NAMES
from human_gait.exceptions import ScenarioError
from human_gait.scenario import Scenario, load_scenario, shipped_scenarios
from human_gait.scenario.lengths import LENGTHS
from human_gait.scenario.limits import NOT_FROZEN
from human_gait.scenario.values import allowed_values
from human_gait.settings import (
    SCHEMA_FILE,
    all_settings,
    explanation,
    json_schema,
    listing,
    schema_text,
    write_scenario,
)

SETTINGS = list(all_settings())
FIXED = [setting for setting in SETTINGS if setting.section and setting.section != "limits"]
EDITOR = jsonschema.Draft4Validator(json_schema())
BASE = {"walk": {"speed": 1.2, "step_length": 0.7}}


def run(capsys, *arguments):
    code = cli.run(arguments)
    told = capsys.readouterr()
    return code, told.out, told.err


# --- records


@pytest.mark.parametrize("setting", SETTINGS, ids=lambda setting: setting.dotted)
def test_every_setting_says_in_a_line_what_it_does_and_what_is_allowed(setting):
    for words in (setting.meaning, setting.allowed, setting.default_words):
        assert words.strip()
        assert "\n" not in words
    assert 10 < len(setting.meaning) < 80
    assert setting.meaning[0].islower()  # as the others are
    assert not setting.meaning.endswith(".")


def test_no_two_settings_say_the_same():
    meanings = [setting.meaning for setting in SETTINGS]
    assert len(set(meanings)) == len(meanings)


def test_every_key_that_a_file_can_hold_is_listed():
    table = load_scenario("normal").to_dict()
    held = {f"{name}.{key}" for name in Scenario.sections() for key in table[name]} | {"name"}
    assert {setting.dotted for setting in SETTINGS} == held | {"limits.<joint>"}


@pytest.mark.parametrize("setting", FIXED, ids=lambda setting: setting.dotted)
def test_a_default_that_is_told_is_the_one_that_is_taken(setting):
    taken = Scenario.from_dict(BASE).to_dict()[setting.section][setting.key]
    if setting.default is not None:
        assert taken == (list(setting.default) if setting.count > 1 else setting.default)
        assert tomllib.loads(f"x = {json.dumps(taken)}")["x"] == taken
    elif setting.key in LENGTHS:
        share = re.search(r"stature x ([\d.]+) \(male\)", setting.default_words)
        assert taken == pytest.approx(1.755 * float(share[1]), abs=1e-4)
    elif not setting.required and setting.section != "walk":  # step length: test_formulations
        assert str(taken) in setting.default_words


def test_choices_and_ranges_are_those_of_the_declaration():
    for setting in FIXED:
        kind = Scenario.sections()[setting.section]
        rule = kind.rule(setting.key)
        assert setting.allowed == allowed_values(kind.kinds()[setting.key], rule)
        assert setting.choices == rule.get("choices", ())
        assert (setting.low, setting.high) == rule.get("range", (None, None))


# --- lists and explanations


def test_the_list_has_a_line_for_each_setting_under_its_section(capsys):
    code, out, _ = run(capsys, "settings")
    assert code == 0
    assert out == listing() + "\n"
    section = ""
    seen = set()
    for line in filter(None, out.splitlines()):
        if line.startswith("["):
            section = line[1 : line.index("]")]
        elif line.startswith("  "):
            seen.add(f"{section}.{line.split()[0]}".lstrip("."))
    assert seen == {setting.dotted for setting in SETTINGS}


def test_a_setting_is_explained_with_all_that_is_known(capsys):
    code, out, _ = run(capsys, "settings", "walk.step_width")
    (setting,) = (each for each in SETTINGS if each.dotted == "walk.step_width")
    assert code == 0
    for words in (setting.meaning, setting.allowed, setting.default_words, setting.source):
        assert words in out
    assert explanation("step_width") == explanation("walk.step_width")


def test_a_name_of_several_settings_and_a_section_explain_them_all():
    assert {"subject.mass", "load.mass"} <= set(explanation("mass").splitlines())
    lines = set(explanation("walk").splitlines())
    assert {"walk.speed", "walk.step_length", "walk.step_width"} <= lines
    assert "load.mass" not in lines


def test_joints_are_explained_and_named():
    assert explanation("limits.knee_flexion_r") == explanation("knee_flexion_r")
    assert "limits.<joint>" in explanation("knee_flexion_r").splitlines()
    assert all(name in explanation("limits") for name in DOF_NAMES)


@pytest.mark.parametrize(
    ("key", "meant"),
    [
        ("wlak", "walk"),
        ("sped", "speed"),
        ("walk.sped", "walk.speed"),
        ("knee_flexion_R", "knee_flexion_r"),
    ],
)
def test_an_unknown_setting_is_told_with_the_nearest(capsys, key, meant):
    code, out, err = run(capsys, "settings", key)
    assert (code, out) == (2, "")
    assert err == f"error: {key}: unknown setting, did you mean {meant}?\n"


# --- a new scenario


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_new_scenario_is_right_as_written_and_named_after_its_file(here, capsys):
    code, out, _ = run(capsys, "init", "mine")
    assert (code, out) == (0, "wrote mine.toml\n")
    assert [path.name for path in here.iterdir()] == ["mine.toml"]
    assert load_scenario("mine.toml") == load_scenario("preferred").replace(name="mine")
    (here / "mine.toml").rename("other.toml")
    assert load_scenario("other.toml").name == "other"


@pytest.mark.parametrize("template", shipped_scenarios())
def test_a_new_scenario_from_a_template_is_that_walk(here, capsys, template):
    assert run(capsys, "init", "mine", "--from", template)[0] == 0
    assert load_scenario("mine.toml") == load_scenario(template).replace(name="mine")
    words = shipped_scenarios()[template].read_text().splitlines()[0]
    assert words in (here / "mine.toml").read_text().splitlines()


@pytest.mark.usefixtures("here")
def test_a_new_scenario_holds_every_setting_with_its_words():
    lines = Path(write_scenario("all")).read_text().splitlines()
    text = " ".join(line.removeprefix("# ") for line in lines)
    for setting in SETTINGS:
        assert setting.meaning in text
        assert setting.allowed in text
        assert setting.default_words in text
        assert setting.source in text
    said = [line.removeprefix("#") for line in lines if not line.startswith("# ")]
    keys = [line.partition(" = ")[0] for line in said if " = " in line]
    assert [each.key for each in SETTINGS if each.key != "<joint>"] == [
        key for key in keys if not key.startswith(DOF_NAMES)
    ]
    assert max(map(len, lines[1:])) <= 100


def test_every_line_with_a_setting_can_be_uncommented(here):
    content = write_scenario("mine").read_text()
    settings = [line.lstrip("#") for line in content.splitlines() if "# " not in line[:2]]
    (here / "full.toml").write_text("\n".join(settings[1:]))
    full = load_scenario("full.toml")
    assert full.limits.ranges[0].name == "knee_flexion_r"
    assert full.replace(limits={}) == load_scenario("mine.toml")


SAME = st.sampled_from(sorted(shipped_scenarios()))


@settings(max_examples=30)
@given(SAME, st.floats(1.3, 1.9), st.sampled_from(["male", "female"]), st.integers(6, 9))
def test_whatever_the_template_holds_is_kept(tmp_path_factory, template, stature, sex, points):
    folder = tmp_path_factory.getbasetemp()
    changes = {"stature": stature, "sex": sex, "control_points": points, "step_length": 0.5}
    source = load_scenario(template).replace(changes, pelvis_deg=7)
    (folder / "own.toml").write_text(source.to_toml())
    made = write_scenario("new", folder / "new.toml", str(folder / "own.toml"), force=True)
    assert load_scenario(made) == source.replace(name="new")


def test_a_file_is_never_replaced_without_being_told(here, capsys):
    (here / "mine.toml").write_text("mine")
    code, out, err = run(capsys, "init", "mine")
    assert (code, out, err) == (2, "", "error: mine.toml: exists already, --force replaces it\n")
    (here / "link.toml").symlink_to("nowhere")
    assert run(capsys, "init", "link")[0] == 2
    assert (here / "mine.toml").read_text() == "mine"
    assert not (here / "nowhere").exists()
    assert run(capsys, "init", "mine", "--force")[0] == 0
    assert load_scenario("mine.toml").name == "mine"


def test_the_file_and_the_name_can_differ(here, capsys):
    assert run(capsys, "init", "mine", "--out", "deep/er/file.toml")[0] == 0
    assert load_scenario("deep/er/file.toml").name == "mine"
    assert "predict deep/er/file.toml" in (here / "deep/er/file.toml").read_text()
    assert run(capsys, "init", "--out", "file.toml")[0] == 0
    assert load_scenario("file.toml").name == "file"
    assert run(capsys, "init", "twice.toml")[1] == "wrote twice.toml\n"


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["../x"], 'name = "../x": must be a name'),
        (["x", "--from", "bakpack-20"], "did you mean backpack-20?"),
        (["x", "--from", "x.toml"], "x.toml: cannot be read"),
        (["x", "--out", "file/x.toml"], "file/x.toml: cannot be written"),
        (["x", "--out", "folder"], "folder: exists already"),
        (["x", "--force", "--out", "folder"], "folder: cannot be written"),
    ],
)
def test_what_cannot_be_made_is_told_in_one_line_and_leaves_nothing(here, capsys, arguments, part):
    (here / "file").touch()
    (here / "folder").mkdir()
    code, out, err = run(capsys, "init", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert part in err
    assert sorted(path.name for path in here.rglob("*")) == ["file", "folder"]


# --- editors


def test_the_schema_is_one_and_its_file_is_fresh(capsys):
    jsonschema.Draft4Validator.check_schema(json_schema())
    code, out, _ = run(capsys, "settings", "--json-schema")
    assert (code, out) == (0, schema_text())
    assert json.loads(out) == json_schema()
    written = SCHEMA_FILE.read_text(encoding="utf-8")
    assert written == out, f"human-gait settings --json-schema > {SCHEMA_FILE}"


@pytest.mark.usefixtures("here")
def test_a_new_scenario_points_its_editor_to_the_schema():
    first = write_scenario("mine").read_text().partition("\n")[0]
    directive, address = first.split(" ")
    assert directive == "#:schema"
    assert urlparse(address).scheme == "file"
    assert Path(url2pathname(urlparse(address).path)).samefile(SCHEMA_FILE)


@pytest.mark.parametrize("path", shipped_scenarios().values(), ids=lambda path: path.stem)
def test_shipped_scenarios_are_right_for_editors(path):
    EDITOR.validate(tomllib.loads(path.read_text(encoding="utf-8")))


@pytest.mark.usefixtures("here")
def test_what_a_new_scenario_holds_is_right_for_editors():
    EDITOR.validate(tomllib.loads(write_scenario("mine").read_text()))


@pytest.mark.parametrize(
    "table",
    [
        {},
        {"walk": {"step_length": 0.7}},
        {**BASE, "colour": "red"},
        {**BASE, "load": {"mas": 1}},
        {**BASE, "load": 3},
        {**BASE, "limits": {"frozen": ["elbow"]}},
        {**BASE, "limits": {"frozen": ["pelvis_tz"]}},
        {**BASE, "limits": {"pelvis_rx": [0]}},
        {**BASE, "name": "../x"},
    ],
)
def test_what_the_loader_refuses_an_editor_marks(table):
    assert not EDITOR.is_valid(table)


def test_every_setting_tells_an_editor_what_it_does():
    tables = json_schema()["properties"]
    for setting in FIXED:
        shown = tables[setting.section]["properties"][setting.key]
        assert setting.meaning in shown["description"]
        assert setting.allowed in shown["description"]
    assert set(DOF_NAMES) < set(tables["limits"]["properties"])


def by_its_rule(setting, value):
    """Tell whether the loader takes a value, as far as that setting alone decides."""
    table = {**BASE, setting.section: {**BASE.get(setting.section, {}), setting.key: value}}
    try:
        Scenario.from_dict(table)
    except ScenarioError as error:
        wrong = [each for each in error.errors if each.key == setting.dotted]
        words = f"must be {setting.allowed}"
        refusals = words, " is wanted", "has an unknown unit"
        return not any(said in each.allowed for said in refusals for each in wrong)
    return True


def by_the_editor(setting, value):
    table = {**BASE, setting.section: {**BASE.get(setting.section, {}), setting.key: value}}
    return EDITOR.is_valid(table)


ODD = st.none() | st.booleans() | st.text(max_size=3) | st.just({}) | st.just(10**400)


def near(setting):
    """Return a strategy of values around what a setting allows."""
    if setting.choices:
        return st.sampled_from(setting.choices) | st.sampled_from(["", setting.choices[0] + " "])
    low, high = setting.low, setting.high
    span = high - low
    ends = st.sampled_from([low, high, int(low), int(high), low - 1, high + 1])
    number = (
        ends
        | st.floats(low - span, high + span)
        | st.integers(int(low) - 2, int(high) + 2)
        | st.builds(float, st.integers(int(low), int(high)))
    )
    return st.lists(number | ODD, min_size=2, max_size=4) if setting.count > 1 else number


@settings(max_examples=600)  # of 49 settings
@given(st.sampled_from(FIXED), st.data())
def test_an_editor_marks_what_the_loader_refuses_and_nothing_else(setting, data):
    value = data.draw(near(setting) | ODD | st.lists(ODD, max_size=3))
    assert by_the_editor(setting, value) == by_its_rule(setting, value)


@given(st.sampled_from([each for each in FIXED if each.low is not None and not each.whole]))
def test_both_ends_of_a_range_are_inside_for_both(setting):
    for value, inside in ((setting.low, True), (setting.high, True), (setting.high + 1e-9, False)):
        given_value = [value] * setting.count if setting.count > 1 else value
        assert by_the_editor(setting, given_value) == inside
        assert by_its_rule(setting, given_value) == inside


KINDS = ("1 m", "10 cm", "5'1", "40 lb", "10 kg", "4 km/h", "9 deg", "0.001 rad^2", "30 %")


@given(st.sampled_from(FIXED), st.sampled_from([*KINDS, "9", "x", ""]))
def test_quantities_that_the_loader_takes_an_editor_takes(setting, written):
    value = [written] * setting.count if setting.count > 1 else written
    if by_its_rule(setting, value):
        assert by_the_editor(setting, value)
    elif by_the_editor(setting, value):  # the kind is right: only the loader converts and compares
        assert setting.low is not None
        with pytest.raises(ScenarioError, match=r"is [-.\d, ]+ .*, must be"):
            Scenario.from_dict(
                {**BASE, setting.section: {**BASE.get(setting.section, {}), setting.key: value}}
            )


@given(st.sampled_from(DOF_NAMES), st.lists(st.floats(-400, 400) | ODD, min_size=1, max_size=3))
def test_ranges_of_joints_are_judged_alike(name, value):
    table = {**BASE, "limits": {name: value}}
    try:
        Scenario.from_dict(table)
    except ScenarioError as error:
        fits = "lower not above upper" in str(error)  # is left to the loader
    else:
        fits = True
    assert EDITOR.is_valid(table) == fits


@given(st.lists(st.sampled_from(DOF_NAMES), max_size=3))
def test_frozen_joints_are_judged_alike(names):
    table = {**BASE, "limits": {"frozen": names}}
    assert EDITOR.is_valid(table) == (not NOT_FROZEN & set(names))
