"""What a format cannot hold is refused by the name of its file, and nothing is written."""

import json
import os
import re
from dataclasses import replace

import ezc3d
import numpy as np
import pytest
import yaml
from exports import walking

from human_gait.body.skeleton import DOF_NAMES, index
from human_gait.body.urdf import JOINT_NAMES
from human_gait.exceptions import ResultError
from human_gait.export import formats, markers
from human_gait.export.formats import FORMATS, SampledStride, export_gait, sampled
from human_gait.export.rules import check_count, check_names, check_numbers, check_times
from human_gait.export.tables import save_csv

RATE = 20


@pytest.fixture(scope="module")
def gait():
    return walking()


@pytest.fixture(scope="module")
def stride(gait):
    return sampled(gait, RATE)


def spoilt(stride, name, value):
    """A stride with one wrong number in the third row of its stride."""

    def with_it(samples, row):
        values = getattr(samples, name).copy()
        values[row].flat[-1] = value
        return replace(samples, **{name: values})

    margin = len(stride.padded.t) - len(stride.samples.t)
    padded = with_it(stride.padded, margin // 2 + 2)
    return SampledStride(stride.gait, stride.rate, with_it(stride.samples, 2), padded)


SPOILT = {  # what is wrong, by format, and the file that says so
    "mot": ("q", "coordinates.mot"),
    "grf": ("grf", "ground_reaction.mot"),
    "sto": ("tau", "joint_torques.sto"),
    "trc": ("q", "markers.trc"),
    "bvh": ("q", "motion.bvh"),
    "csv": ("active", "joint_torques.csv"),
    "urdf": ("a", "joint_trajectory.csv"),
}


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", SPOILT)
def test_what_is_no_number_is_refused(stride, tmp_path, monkeypatch, name, value):
    what, file = SPOILT[name]
    bad = spoilt(stride, what, value)
    monkeypatch.setattr(formats, "sampled", lambda _gait, _rate: bad)
    with np.errstate(invalid="ignore"), pytest.raises(ResultError) as caught:
        export_gait(stride.gait, tmp_path, [name], RATE)
    said = str(caught.value)
    assert said.startswith(f"{file}: ")
    assert re.search(r" = (nan|-?inf) in row \d+: must be a number", said)
    assert not list(tmp_path.iterdir())


def test_c3d_refuses_what_is_no_number_in_single_precision(gait, tmp_path):
    far = gait.control_points.copy()
    far[:, index("pelvis_tz")] = 1e37  # 1e40 mm
    with pytest.raises(ResultError, match=r"markers\.c3d: place = .* must be a number up to 3\.4"):
        export_gait(replace(gait, control_points=far), tmp_path, ["c3d"], RATE)


@pytest.mark.parametrize(("name", "file"), [("trc", "markers.trc"), ("c3d", "markers.c3d")])
@pytest.mark.parametrize("bad", ["TOE 1", "T\tE", "", "L" * 300, "é", "LHEE"])
def test_names_that_a_format_cannot_hold_are_refused(gait, tmp_path, monkeypatch, name, file, bad):
    set_of = markers.marker_set
    own = [
        replace(marker, name=bad) if marker.name == "LTOE" else marker
        for marker in set_of(gait.body)
    ]
    for module in (markers, formats.save_c3d.__globals__):
        place = module if isinstance(module, dict) else vars(module)
        monkeypatch.setitem(place, "marker_set", lambda _body: tuple(own))
    with pytest.raises(ResultError, match=rf"^{re.escape(file)}: the name '"):
        export_gait(gait, tmp_path, [name], RATE)


def test_rules_let_pass_what_is_right():
    check_names("a", ["x", "y"], r"\s", longest=1)
    check_numbers("a", {"x": np.array([1.0, -2.0])}, largest=2.0)
    check_times("a", ["0", "0.1"])
    check_count("a", "rows", 2, 2)


@pytest.mark.parametrize(
    ("rule", "said"),
    [
        (lambda: check_times("a.mot", ["0", "0.1", "0.1"]), "a.mot: time = 0.1 in row 3: must be"),
        (lambda: check_names("a.mot", ["x", "x"], r"\s"), "a.mot: the name 'x' is there twice"),
        (
            lambda: check_names("a.csv", ["x,y"], ","),
            "a.csv: the name 'x,y' must be 1 to 255",
        ),
        (lambda: check_count("a", "rows", 3, 2), "a: 3 rows: the format holds 2"),
        (
            lambda: check_numbers("a", {"x": np.array([1.0, 3.0])}, 2.0),
            "a: x = 3.0 in row 2: must be a number up to 2",
        ),
    ],
)
def test_rules_say_file_and_value(rule, said):
    with pytest.raises(ResultError, match=re.escape(said)):
        rule()


def test_csv_leaves_out_only_what_may_be_missing(tmp_path):
    x = np.array([1.0, np.nan])
    save_csv({"x": x}, tmp_path / "a.csv", gaps=["x"])
    assert (tmp_path / "a.csv").read_text() == "x\n1\n\n"
    with pytest.raises(ResultError, match=r"a\.csv: x = nan in row 2"):
        save_csv({"x": x}, tmp_path / "a.csv")


def test_long_names_and_scenarios_fit_into_c3d(gait, tmp_path):
    """127 bytes of a name, letters whole; the whole one, and all that was asked for, in a note."""
    ranges = {name: [-90.123456789, 91.2] for name in DOF_NAMES[6:]}
    long = gait.scenario.replace({"name": "é" * 100, "limits": ranges})
    export_gait(replace(gait, scenario=long), tmp_path, ["c3d"], RATE)
    groups = ezc3d.c3d(str(tmp_path / "markers.c3d"))["parameters"]
    (name,) = groups["SUBJECTS"]["NAMES"]["value"]
    assert long.name.startswith(name)
    assert 120 < len(name.encode()) <= 127
    assert json.loads("".join(groups["HUMAN_GAIT"]["SCENARIO"]["value"])) == long.to_dict()


def test_controllers_get_a_message_that_they_take(gait, tmp_path):
    """Spelt as ROS 2 does; no pelvis, no effort, first point later than 0, at rest at the end."""
    export_gait(gait, tmp_path, ["urdf"], RATE)
    text = (tmp_path / "joint_trajectory_controller.yaml").read_text()
    message = yaml.safe_load(text)
    viewed = json.loads((tmp_path / "joint_trajectory.json").read_text())
    assert list(message) == ["header", "joint_names", "points"]
    assert message["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "world"}
    assert list(viewed)[:3] == list(message)
    assert viewed["header"] == message["header"]
    assert message["joint_names"] == list(JOINT_NAMES[6:])
    points, names = message["points"], ["positions", "velocities", "accelerations"]
    assert all(list(point) == [*names, "time_from_start"] for point in points)
    assert all(isinstance(x, float) for point in points for name in names for x in point[name])
    times = [p["time_from_start"]["sec"] + 1e-9 * p["time_from_start"]["nanosec"] for p in points]
    assert times[0] > 0
    assert (np.diff(times) > 0).all()
    assert all(0 <= point["time_from_start"]["nanosec"] < 1e9 for point in points)
    for point, seen in zip(points[:-1], viewed["points"], strict=True):
        assert all(point[name] == seen[name][6:] for name in names)
    assert not any(points[-1]["velocities"] + points[-1]["accelerations"])
    last = np.array(points[-1]["positions"])
    before, speed = (np.array(points[-2][name]) for name in names[:2])
    assert (np.abs(last - before) <= np.abs(speed) / 2 + 1e-9).all()  # no joint goes back or far
    assert "Controllers take joint_trajectory_controller.yaml" in viewed["note"]


def test_small_numbers_are_numbers_to_yaml(gait, tmp_path):
    """1e-05 is a text to YAML 1.1, which ROS 2 reads."""
    still = gait.control_points.copy()
    still[:, 6:] = 1e-5 * np.arange(1, 50)
    export_gait(replace(gait, control_points=still), tmp_path, ["urdf"], RATE)
    text = (tmp_path / "joint_trajectory_controller.yaml").read_text()
    values = yaml.safe_load(text)["points"][0]["positions"]
    assert all(isinstance(value, float) for value in values)
    np.testing.assert_allclose(values, 1e-5 * np.arange(1, 50))


def test_a_file_that_is_cut_short_is_no_c3d(gait, tmp_path, monkeypatch):
    """As on a full disk, of which the library says nothing."""
    write = ezc3d.c3d.write

    def cut(self, path, **given):
        write(self, path, **given)
        os.truncate(path, 1000)

    monkeypatch.setattr(ezc3d.c3d, "write", cut)
    with pytest.raises(ResultError, match=r"markers\.c3d: cannot be written: no space left"):
        export_gait(gait, tmp_path, ["c3d"], RATE)
    assert not list(tmp_path.iterdir())


def test_every_format_is_tried_with_wrong_numbers():
    assert {*SPOILT, "c3d", "osim"} == {*FORMATS}
