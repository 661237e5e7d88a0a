import dataclasses
import json
import zipfile

import numpy as np
import pytest
from walks import BACKPACK, near_walk, scenario

from human_gait.body.skeleton import DOF_NAMES, index, mirror
from human_gait.exceptions import ResultError
from human_gait.problem.program import build_program
from human_gait.results.names import GAIT_FILE
from human_gait.walk.gait import Gait
from human_gait.walk.gait_file import load_gait, save_gait

FORWARD = index("pelvis_tz")


def make_gait(task, **solution):
    program = build_program(task)
    return program.gait(near_walk(program, noise=0.05), **solution)


GAIT = make_gait(scenario(load=BACKPACK), solver="by hand", cost=1.5)
T, L = GAIT.step_time, GAIT.step_length
TIMES = np.linspace(0.0, T, 14)[:-1]


def mirrored(vectors, step, feet=True):
    """World vectors (K, [2, ...] 3) as they are `step` steps later."""
    if step % 2 == 0:
        return vectors
    return (vectors[:, ::-1] if feet else vectors) * [-1.0, 1.0, 1.0]


@pytest.mark.parametrize("order", ["q", "v", "a"])
@pytest.mark.parametrize("step", [1, 2, 3])
def test_each_step_is_the_mirror_image_of_the_one_before(order, step):
    """Eq. (26); the times of later steps are rounded, which 1e-9 of the motion allows for."""
    first, later = getattr(GAIT, order)(TIMES), getattr(GAIT, order)(TIMES + step * T)
    expected = mirror(first) if step % 2 else first.copy()
    if order == "q":
        expected[:, FORWARD] += step * L
    np.testing.assert_allclose(later, expected, atol=1e-9 * np.abs(first).max())


@pytest.mark.parametrize("step", [1, 2])
def test_samples_go_on_mirrored_and_further_ahead(step):
    first, later = GAIT.instants(TIMES), GAIT.instants(TIMES + step * T)
    advance = step * np.array([0.0, 0.0, L])
    for name in ("points", "cop", "zmp"):
        expected = mirrored(getattr(first, name), step, feet=name != "zmp") + advance
        np.testing.assert_allclose(getattr(later, name), expected, atol=1e-9)
    np.testing.assert_allclose(later.grf, mirrored(first.grf, step), atol=1e-6)
    for name in ("tau", "active"):
        value = getattr(first, name)
        expected = mirror(value) if step % 2 else value
        np.testing.assert_allclose(getattr(later, name), expected, atol=1e-6)
    yaw = -first.yaw_moment[:, ::-1] if step % 2 else first.yaw_moment
    np.testing.assert_allclose(later.yaw_moment, yaw, atol=1e-6)


def test_position_and_its_rates_are_continuous_from_step_to_step():
    h = 1e-7
    for order, scale in (("q", 1e2), ("v", 1e3), ("a", 1e4)):  # h times the next derivative
        before, after = (getattr(GAIT, order)(T + s * h) for s in (-1, 1))
        np.testing.assert_allclose(before, after, atol=scale * h)


def test_the_walk_advances_by_a_step_length_each_step():
    assert GAIT.q(5 * T)[FORWARD] - GAIT.q(T)[FORWARD] == pytest.approx(4 * L, abs=1e-12)


def test_velocity_and_acceleration_are_rates():
    h, t = 1e-6, TIMES[1:] + 1e-3
    np.testing.assert_allclose((GAIT.q(t + h) - GAIT.q(t - h)) / (2 * h), GAIT.v(t), atol=1e-6)
    np.testing.assert_allclose((GAIT.v(t + h) - GAIT.v(t - h)) / (2 * h), GAIT.a(t), atol=1e-4)


@pytest.mark.parametrize("name", ["q", "v", "a", "tau"])
def test_one_time_gives_one_posture_and_many_give_many(name):
    function = getattr(GAIT, name)
    assert function(0.2).shape == (55,)
    assert function([0.2]).shape == (1, 55)
    np.testing.assert_allclose(function([0.2, 0.7])[1], function(0.7), atol=1e-12)


@pytest.mark.parametrize("name", ["q", "v", "a", "tau", "muscle_torque"])
def test_no_times_give_no_postures(name):
    assert getattr(GAIT, name)([]).shape == (0, 55)


def test_samples_at_no_times_have_the_shapes_of_one_without_any():
    none, one = GAIT.instants([]), GAIT.instants(0.2)
    for item in dataclasses.fields(none):
        assert getattr(none, item.name).shape == (0, *getattr(one, item.name).shape[1:])


@pytest.mark.parametrize("name", ["q", "v", "a", "tau", "muscle_torque", "instants"])
@pytest.mark.parametrize("t", [[[0.0, 0.1]], [[]], [[0.0], [0.0, 0.1]], "soon", {}])
def test_times_are_a_number_or_a_list_of_numbers(name, t):
    with pytest.raises(ValueError, match="times must be a number or a list of numbers") as caught:
        getattr(GAIT, name)(t)
    assert "\n" not in str(caught.value)


def test_the_torques_of_the_global_dof_vanish():
    assert np.abs(GAIT.tau(TIMES)[:, :6]).max() < 1e-9 * GAIT.plan.weight


def test_samples_agree_with_the_motion():
    now = GAIT.instants(TIMES)
    np.testing.assert_array_equal(now.t, TIMES)
    np.testing.assert_array_equal(now.q, GAIT.q(TIMES))
    np.testing.assert_array_equal(now.tau, GAIT.tau(TIMES))
    shapes = {name: getattr(now, name).shape[1:] for name in ("zmp", "grf", "cop", "points")}
    assert shapes == {"zmp": (3,), "grf": (2, 3), "cop": (2, 3), "points": (2, 4, 3)}


@pytest.mark.parametrize("t", [-0.1, np.nan, np.inf])
def test_there_is_no_time_before_the_walk(t):
    for function in (GAIT.q, GAIT.tau, GAIT.instants):
        with pytest.raises(ValueError, match="times must be finite"):
            function(t)


def test_a_saved_gait_is_the_same_to_the_last_digit(tmp_path):
    save_gait(GAIT, tmp_path)
    again = load_gait(tmp_path)
    assert again.scenario == GAIT.scenario
    assert again.solution == {"solver": "by hand", "cost": 1.5}
    np.testing.assert_array_equal(again.breaks, GAIT.breaks)
    np.testing.assert_array_equal(again.control_points, GAIT.control_points)
    np.testing.assert_array_equal(again.tau(TIMES), GAIT.tau(TIMES))
    assert [path.name for path in tmp_path.iterdir()] == [GAIT_FILE]


def test_a_saved_gait_can_be_read_without_this_package(tmp_path):
    save_gait(GAIT, tmp_path)
    with np.load(tmp_path / GAIT_FILE) as file:
        t = file["t"]
        assert list(file["dof_names"]) == list(DOF_NAMES)
        assert "cubic B-splines" in str(file["about"])
        assert json.loads(str(file["scenario"]))["walk"]["speed"] == GAIT.scenario.walk.speed
        for field in dataclasses.fields(GAIT.instants(TIMES)):
            expected = getattr(GAIT.step_samples(t), field.name)
            np.testing.assert_allclose(file[field.name], expected, rtol=1e-9, atol=1e-9)
        assert (t[0], t[-1]) == (0.0, T)


class Trap:
    """An object that would leave a trace if it were unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return type(self.path).touch, (self.path,)


@pytest.fixture
def saved(tmp_path):
    save_gait(GAIT, tmp_path)
    return tmp_path


def rewrite(folder, allow_pickle=False, **changes):
    """Replace or, with None, remove arrays of a saved gait."""
    with np.load(folder / GAIT_FILE) as file:
        arrays = {name: file[name] for name in file.files} | changes
    kept = {name: array for name, array in arrays.items() if array is not None}
    with zipfile.ZipFile(folder / GAIT_FILE, "w") as archive:
        for name, array in kept.items():
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, np.asanyarray(array), allow_pickle=allow_pickle)


def assert_refused(folder, *parts):
    with pytest.raises(ResultError) as caught:
        load_gait(folder)
    message = str(caught.value)
    assert "\n" not in message
    assert [part for part in (GAIT_FILE, *parts) if part not in message] == []


def test_pickled_objects_are_not_executed(saved, tmp_path):
    """Neither inside an array, nor as the whole file."""
    trap = np.array(Trap(tmp_path / "sprung"), dtype=object)
    rewrite(saved, allow_pickle=True, control_points=trap)
    assert_refused(saved, "control_points is no array of numbers")
    with (saved / GAIT_FILE).open("wb") as file:
        np.save(file, trap, allow_pickle=True)
    assert_refused(saved)
    (saved / GAIT_FILE).write_bytes(trap.dumps())
    assert_refused(saved)
    assert not (tmp_path / "sprung").exists()


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_a_truncated_file_is_refused(saved, share):
    content = (saved / GAIT_FILE).read_bytes()
    (saved / GAIT_FILE).write_bytes(content[: int(share * len(content))])
    assert_refused(saved)


def test_a_damaged_file_is_refused(saved):
    """Whichever byte of the control points is turned over."""
    content = (saved / GAIT_FILE).read_bytes()
    with zipfile.ZipFile(saved / GAIT_FILE) as archive:
        info = archive.getinfo("control_points.npy")
    start = info.header_offset
    for place in range(start, start + info.compress_size, max(info.compress_size // 60, 1)):
        damaged = bytearray(content)
        damaged[place] ^= 0xFF
        (saved / GAIT_FILE).write_bytes(damaged)
        try:
            gait = load_gait(saved)
        except ResultError:
            continue
        np.testing.assert_array_equal(gait.control_points, GAIT.control_points)


@pytest.mark.parametrize("content", [b"", b"not a zip", b"PK\x03\x04", b"\x93NUMPY"])
def test_what_is_no_archive_is_refused(tmp_path, content):
    (tmp_path / GAIT_FILE).write_bytes(content)
    assert_refused(tmp_path)


def test_a_single_array_is_refused(tmp_path):
    with (tmp_path / GAIT_FILE).open("wb") as file:
        np.save(file, np.zeros(3))
    assert_refused(tmp_path)


def test_a_missing_file_and_a_folder_in_its_place_are_refused(tmp_path):
    assert_refused(tmp_path)
    (tmp_path / GAIT_FILE).mkdir()
    assert_refused(tmp_path)


NAN = GAIT.control_points.copy()
NAN[1, 7] = np.nan
CHANGES = {
    "NaN": ({"control_points": NAN}, "finite"),
    "infinite time": ({"breaks": GAIT.breaks * np.inf}, ""),
    "one control point too few": ({"control_points": GAIT.control_points[1:]}, "shape"),
    "one DOF too few": ({"control_points": GAIT.control_points[:, 1:]}, "shape"),
    "flat control points": ({"control_points": GAIT.control_points.ravel()}, "shape"),
    "breaks of two dimensions": ({"breaks": GAIT.breaks[:, None]}, "breaks"),
    "one number for breaks": ({"breaks": np.array(0.5)}, "breaks"),
    "no breaks": ({"breaks": np.zeros(0)}, ""),
    "two breaks": ({"breaks": GAIT.breaks[[0, -1]]}, "breaks"),
    "breaks that turn back": ({"breaks": GAIT.breaks[[0, 2, 1, 3, 4]]}, "increase"),
    "another step time": ({"breaks": 2 * GAIT.breaks}, "step time"),
    "text for numbers": ({"breaks": np.array(["a", "b"])}, ""),
    "wrong format": ({"format": "human_gait gait 999"}, "format"),
    "no control points": ({"control_points": None}, "control_points"),
    "no scenario": ({"scenario": None}, "scenario"),
    "no format": ({"format": None}, "format"),
    "scenario not JSON": ({"scenario": "{"}, ""),
    "scenario of a wrong kind": ({"scenario": "[1]"}, ""),
    "scenario out of range": (
        {"scenario": json.dumps({"name": "x", "walk": {"speed": -1, "step_length": 0.6}})},
        "walk.speed",
    ),
    "solution of a wrong kind": ({"solution": "3"}, ""),
    "deep JSON": ({"solution": "[" * 100_000}, ""),
}


@pytest.mark.parametrize(("changes", "part"), CHANGES.values(), ids=CHANGES)
def test_what_contradicts_itself_is_refused(saved, changes, part):
    rewrite(saved, **changes)
    assert_refused(saved, part)


def test_a_gait_is_a_value():
    again = Gait(GAIT.scenario, GAIT.breaks, GAIT.control_points)
    np.testing.assert_array_equal(again.q(TIMES), GAIT.q(TIMES))
    with pytest.raises(dataclasses.FrozenInstanceError):
        again.breaks = GAIT.breaks
