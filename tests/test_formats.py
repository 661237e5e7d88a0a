"""Exports are read back by programs of others: ezc3d, pybvh, yourdfpy, Pinocchio, numpy.

What they read has to be the gait, and the places that they compute those of Pinocchio. OpenSim's
own files are in ``test_opensim.py``.
"""

import json
import os
from dataclasses import replace

import ezc3d
import numpy as np
import pinocchio as pin
import pybvh
import pytest
import yourdfpy
from exports import from_opensim, joint_centres, link_poses, marker_places, walking

from human_gait import cli
from human_gait.body.skeleton import DOF_NAMES, SEGMENTS, index, mirror
from human_gait.body.urdf import JOINT_NAMES, LINK_NAMES
from human_gait.commands.arguments import FormatName
from human_gait.exceptions import ResultError
from human_gait.export import formats as export
from human_gait.export.formats import FORMATS, RATES, export_gait, sampled
from human_gait.export.markers import marker_positions, marker_set
from human_gait.results.names import EXPORTED
from human_gait.walk.gait_file import save_gait

FILES = {
    "osim": {"model.osim"},
    "mot": {"coordinates.mot"},
    "grf": {"ground_reaction.mot", "external_loads.xml"},
    "sto": {"joint_torques.sto"},
    "trc": {"markers.trc"},
    "c3d": {"markers.c3d"},
    "bvh": {"motion.bvh"},
    "csv": {"joint_angles.csv", "joint_torques.csv", "ground_reaction.csv"},
    "urdf": {
        "human.urdf",
        "joint_trajectory.csv",
        "joint_trajectory.json",
        "joint_trajectory_controller.yaml",
    },
}
NOTE = {"made_from.json"}
RATE = 100


@pytest.fixture(scope="module")
def gait():
    return walking("a rigid backpack")


@pytest.fixture(scope="module")
def now(gait):
    """The gait at the instants of the files."""
    return gait.instants(np.arange(0, 2 * gait.step_time + 1e-9, 1 / RATE))


@pytest.fixture(scope="module")
def folder(gait, tmp_path_factory):
    target = tmp_path_factory.mktemp("walk") / "export"
    export_gait(gait, target, rate=RATE)
    return target


def columns(path):
    """A CSV file by column."""
    table = np.genfromtxt(path, delimiter=",", names=True, deletechars="", replace_space=" ")
    return {name: table[name] for name in table.dtype.names}


def test_one_stride_is_exported(gait, now):
    stride = sampled(gait, RATE)
    np.testing.assert_allclose(stride.samples.t, now.t, atol=1e-12)
    assert 2 * gait.step_time - stride.samples.t[-1] < 1 / RATE
    np.testing.assert_allclose(stride.samples.q, now.q, atol=1e-12)
    np.testing.assert_allclose(stride.samples.cop, now.cop, atol=1e-9)


def test_what_comes_before_the_stride_is_the_walk_itself(gait):
    """A step before an instant of the walk is its mirror image, one step length behind."""
    padded = sampled(gait, RATE).padded
    before = padded.t < 0
    assert padded.t[0] == pytest.approx(-export.MARGIN)
    assert padded.t[-1] > 2 * gait.step_time + export.MARGIN - 2 / RATE
    expected = mirror(gait.q(padded.t[before] + gait.step_time))
    expected[:, index("pelvis_tz")] -= gait.step_length
    np.testing.assert_allclose(padded.q[before], expected, atol=1e-12)
    step_on = gait.instants(padded.t[before] + gait.step_time)
    np.testing.assert_allclose(
        padded.zmp[before], step_on.zmp * [-1, 1, 1] - [0, 0, gait.step_length], atol=1e-9
    )


@pytest.fixture(scope="module")
def c3d(folder):
    return ezc3d.c3d(str(folder / "markers.c3d"), extract_forceplat_data=True)


def test_c3d_holds_the_markers(c3d, gait):
    """1e-3 mm: C3D has single precision. It goes on to the second strike of the right heel."""
    file = c3d
    point = file["parameters"]["POINT"]
    assert point["LABELS"]["value"] == [marker.name for marker in marker_set(gait.body)]
    assert (point["UNITS"]["value"], point["RATE"]["value"]) == (["mm"], [RATE])
    assert (point["X_SCREEN"]["value"], point["Y_SCREEN"]["value"]) == (["+X"], ["+Y"])
    forward, up, right = file["data"]["points"][:3]
    places = np.stack([-right, up, forward]).T
    t = np.arange(len(places)) / RATE
    assert t[-2] < 3 * gait.step_time - 1e-9 < t[-1]
    np.testing.assert_allclose(places, 1000 * marker_places(gait.body, gait.q(t)), atol=1e-3)


def test_c3d_has_the_events_of_the_feet(c3d, gait):
    """As Vicon names them; a foot leaves the ground where its force ends, both have a cycle."""
    event = {
        name: entry["value"] for name, entry in c3d["parameters"]["EVENT"].items() if name[0] != "_"
    }
    T, off = gait.step_time, gait.scenario.phases.double_support * gait.step_time
    found = list(zip(event["CONTEXTS"], event["LABELS"], event["TIMES"][1].tolist(), strict=True))
    expected = [
        *(("Left", "Foot Strike", 0.0), ("Right", "Foot Off", off)),
        *(("Right", "Foot Strike", T), ("Left", "Foot Off", T + off)),
        *(("Left", "Foot Strike", 2 * T), ("Right", "Foot Off", 2 * T + off)),
        ("Right", "Foot Strike", 3 * T),
    ]
    assert [(side, what) for side, what, _ in found] == [(side, what) for side, what, _ in expected]
    np.testing.assert_allclose([t for *_, t in found], [t for *_, t in expected], atol=1e-6)
    assert event["USED"].tolist() == [len(expected)]
    assert (event["TIMES"][0] == 0).all()
    for side, what, t in found[1:-1]:
        before, after = (
            gait.instants([t + d]).grf[0, "RL".index(side[0]), 1] for d in (-0.01, 0.01)
        )
        assert (before > 0) == (what == "Foot Off")
        assert (after > 0) == (what == "Foot Strike")


def test_c3d_tells_who_walks(c3d, gait):
    group = c3d["parameters"]
    assert group["SUBJECTS"]["NAMES"]["value"] == [gait.scenario.name]
    assert group["PROCESSING"]["Bodymass"]["value"] == pytest.approx([gait.scenario.subject.mass])
    assert group["PROCESSING"]["Height"]["value"] == pytest.approx([1755.0])
    legs = [group["PROCESSING"][f"{side}LegLength"]["value"][0] for side in "LR"]
    assert legs[0] == pytest.approx(legs[1], rel=1e-6)
    assert 850 < legs[0] < 1000
    frames = c3d["data"]["points"].shape[2]
    for name, words in (("ACTUAL_START_FIELD", [1, 0]), ("ACTUAL_END_FIELD", [frames, 0])):
        value = group["TRIAL"][name]["value"]  # two words of 16 bits, to readers nothing else
        assert value.dtype.kind == "i"
        assert value.tolist() == words


def test_c3d_has_a_force_plate_below_each_foot(c3d, gait):
    """As ezc3d finds force, pressure and free moment, in single precision; they are on the foot."""
    rate = c3d["parameters"]["ANALOG"]["RATE"]["value"][0]
    for f, plate in enumerate(c3d["data"]["platform"]):
        now = gait.instants(np.arange(plate["force"].shape[1]) / rate)
        force = from_opensim(plate["force"].T)
        np.testing.assert_allclose(force, now.grf[:, f], atol=1e-3)
        assert force[:, 1].max() > 500
        loaded = force[:, 1] > 20
        place = from_opensim(plate["center_of_pressure"].T)[loaded]
        np.testing.assert_allclose(place, 1000 * now.cop[loaded, f], atol=0.05)
        np.testing.assert_allclose(
            plate["Tz"][1, loaded], 1000 * now.yaw_moment[loaded, f], atol=0.5
        )
        low, high = plate["corners"].min(axis=1), plate["corners"].max(axis=1)
        for axis in (0, 2):
            inside = plate["center_of_pressure"][axis, loaded]
            assert low[axis] < inside.min() <= inside.max() < high[axis]


@pytest.mark.parametrize("rate", [RATES[0], 700])
def test_c3d_has_whole_frames_at_any_rate(gait, tmp_path, rate):
    export_gait(gait, tmp_path, ["c3d"], rate)
    file = ezc3d.c3d(str(tmp_path / "markers.c3d"))
    frames, per = (
        file["data"]["points"].shape[2],
        file["parameters"]["ANALOG"]["RATE"]["value"][0] / rate,
    )
    assert per >= 1
    assert file["data"]["analogs"].shape[2] == pytest.approx(frames * per, abs=1e-6)


def test_more_frames_than_c3d_counts_are_refused_by_name(gait, tmp_path):
    slow = replace(gait, scenario=gait.scenario.replace(speed=0.1))
    (tmp_path / "old.txt").write_text("mine")
    with pytest.raises(
        ResultError, match=r"markers.c3d: 198001 frames: .* 65535; at most 3309 a sec"
    ):
        export_gait(slow, tmp_path, ["c3d"], rate=10_000)
    assert [path.name for path in tmp_path.iterdir()] == ["old.txt"]


def test_files_appear_in_a_folder_whose_name_is_no_utf8(gait, tmp_path):
    """As unzipped from an old Windows; blanks, quotes and brackets in it are nothing special."""
    names = (b"caf\xe9", b"a 'b' [c] \"d\"", "\u96ea".encode(), b"x" * 200, b"--")
    for name, formats in zip(names, (list(FORMATS), *[["c3d"]] * 4), strict=True):
        target = tmp_path / os.fsdecode(name)
        files = export_gait(gait, target, formats, rate=20)
        assert {path.name for path in target.iterdir()} == {path.name for path in files}
        assert {"markers.c3d"} | NOTE <= {path.name for path in files}


def test_markers_are_where_their_names_say(gait):
    """Upright: left ones at the left, ankle, knee and heel at theirs, a head above the chest."""
    places = dict(
        zip(
            [marker.name for marker in marker_set(gait.body)],
            marker_places(gait.body, np.zeros((1, 55)))[0],
            strict=True,
        )
    )
    assert len(places) == 47
    pairs = [name[1:] for name in places if "R" + name[1:] in places and name[0] == "L"]
    assert len(pairs) == 21
    for name in pairs:
        np.testing.assert_allclose(places["L" + name], places["R" + name] * [-1, 1, 1], atol=1e-12)
        assert places["L" + name][0] > 0
    hip_height = gait.body.measures.lengths["w_hip"]
    assert 0 < places["LASI"][1] < hip_height
    assert places["LASI"][2] > 0 > places["LPSI"][2]
    lengths = gait.body.measures.lengths
    assert places["LKNE"][1] == pytest.approx(-lengths["L_th"])
    assert places["LANK"][1] == pytest.approx(-lengths["L_th"] - lengths["L_sh"])
    assert places["LHEE"][2] == pytest.approx(-lengths["L_heel"])
    assert places["LTOE"][2] == pytest.approx(lengths["L_f"])
    assert places["LWRA"][2] > places["LWRB"][2]
    assert places["LFHD"][1] > places["C7"][1] > places["T10"][1] > places["LASI"][1]
    assert places["CLAV"][2] > 0 > places["RBAK"][2]
    assert places["RBAK"][0] < 0
    assert places["C7"][1] < places["LC4"][1] < places["LFHD"][1]
    assert places["T10"][1] > places["LL2"][1] > places["LL4"][1] > places["LPSI"][1] - 0.05
    assert places["LHLX"][2] > places["LTOE"][2]
    assert places["LHLX"][0] < places["LANK"][0]  # the great toe is the inner one


@pytest.mark.parametrize("t", [0.0, 0.1, 0.3, 0.5])
def test_the_markers_tell_all_coordinates(gait, t):
    """Well enough: where markers are 1 mm off, no joint seems to turn by 4 deg or more."""
    q, h = gait.q(t), 1e-6
    ahead, behind = (
        marker_positions(gait.body, q + s * np.eye(55)).reshape(55, -1) for s in (h, -h)
    )
    jacobian = ((ahead - behind) / (2 * h)).T
    assert np.linalg.matrix_rank(jacobian, tol=1e-3 * np.linalg.norm(jacobian, 2)) == 55
    uncertain = 1e-3 * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    assert np.rad2deg(uncertain[3:]).max() < 4


def test_bvh_moves_as_the_body(folder, gait, now):
    """1e-6 m: angles have ten digits, and errors add up along a chain of 2 m."""
    motion = pybvh.read_bvh_file(str(folder / "motion.bvh"))
    assert motion.frame_count == len(now.t)
    assert motion.frame_time == pytest.approx(1 / RATE, rel=1e-9)
    assert set(motion.joint_names) == set(SEGMENTS)
    names = list(SEGMENTS)
    order = [names.index(name) for name in motion.joint_names]
    np.testing.assert_allclose(
        motion.joint_positions(), joint_centres(gait.body, now.q)[:, order], atol=1e-6
    )


def test_bvh_holds_the_joint_angles(folder, now):
    motion = pybvh.read_bvh_file(str(folder / "motion.bvh"))
    angles = motion.joint_angles
    knee, hip = motion.joint_index["shank_r"], motion.joint_index["thigh_l"]
    flexion, abduction, rotation, bent = (
        now.q[:, index(name)]
        for name in ("hip_flexion_l", "hip_abduction_l", "hip_rotation_l", "knee_flexion_r")
    )
    np.testing.assert_allclose(angles[:, knee, 0], bent, atol=1e-9)
    np.testing.assert_allclose(angles[:, knee, 1:], 0)
    expected = np.stack([-flexion, abduction, -rotation], axis=1)
    np.testing.assert_allclose(angles[:, hip], expected, atol=1e-9)


def test_csv_holds_angles_and_torques(folder, now):
    angles, torques = (columns(folder / f"joint_{what}.csv") for what in ("angles", "torques"))
    np.testing.assert_allclose(angles["time_s"], now.t, atol=1e-9)
    for i, name in enumerate(DOF_NAMES):
        if i < 3:
            np.testing.assert_allclose(angles[f"{name}_m"], now.q[:, i], atol=1e-9)
            continue
        np.testing.assert_allclose(np.deg2rad(angles[f"{name}_deg"]), now.q[:, i], atol=1e-9)
        if i >= 6:
            np.testing.assert_allclose(torques[f"{name}_net_Nm"], now.tau[:, i], atol=1e-6)
            np.testing.assert_allclose(torques[f"{name}_muscle_Nm"], now.active[:, i], atol=1e-6)
    assert len(angles) == 1 + 55
    assert len(torques) == 1 + 2 * 49


def test_csv_holds_the_ground_reaction(folder, now):
    ground = columns(folder / "ground_reaction.csv")
    for f, side in enumerate(("right", "left")):
        for i, axis in enumerate("xyz"):
            force = ground[f"{side}_force_{axis}_N"]
            np.testing.assert_allclose(force, now.grf[:, f, i], atol=1e-6)
        loaded = now.grf[:, f].any(axis=1)
        assert 0 < loaded.sum() < len(loaded)
        for i, axis in ((0, "x"), (2, "z")):
            place = ground[f"{side}_pressure_{axis}_m"]
            np.testing.assert_allclose(place[loaded], now.cop[loaded, f, i], atol=1e-9)
            assert np.isnan(place[~loaded]).all()
        moment = ground[f"{side}_free_moment_y_Nm"]
        np.testing.assert_allclose(moment, now.yaw_moment[:, f], atol=1e-6)
    np.testing.assert_allclose(ground["zmp_z_m"], now.zmp[:, 2], atol=1e-9)


def test_urdf_and_trajectory_move_as_the_body(folder, gait, now):
    trajectory = json.loads((folder / "joint_trajectory.json").read_text())
    robot = yourdfpy.URDF.load(folder / "human.urdf")
    assert trajectory["joint_names"] == list(JOINT_NAMES) == robot.actuated_joint_names
    links = [LINK_NAMES[i] for i in SEGMENTS.values()]
    for k in range(0, len(now.t), 20):
        point = trajectory["points"][k]
        stamp = point["time_from_start"]
        assert stamp["sec"] + 1e-9 * stamp["nanosec"] == pytest.approx(now.t[k], abs=1e-9)
        robot.update_cfg(dict(zip(trajectory["joint_names"], point["positions"], strict=True)))
        poses = [robot.get_transform(link, "world") for link in links]
        np.testing.assert_allclose(poses, link_poses(gait.body, now.q[k : k + 1])[0], atol=1e-9)


def test_the_csv_trajectory_is_that_of_json(folder):
    trajectory = json.loads((folder / "joint_trajectory.json").read_text())
    table = columns(folder / "joint_trajectory.csv")
    fields = {
        "positions": "position",
        "velocities": "velocity",
        "accelerations": "acceleration",
        "effort": "effort",
    }
    assert len(table) == 1 + 4 * 55
    for field, quantity in fields.items():
        values = np.array([point[field] for point in trajectory["points"]])
        found = np.stack([table[f"{name}/{quantity}"] for name in JOINT_NAMES], axis=1)
        np.testing.assert_allclose(found, values, rtol=1e-9, atol=1e-9)


def test_pinocchio_finds_the_efforts_from_the_files_alone(folder):
    """What moves as the trajectory does, under the forces of the CSV, needs its efforts."""
    model = pin.buildModelFromUrdf(str(folder / "human.urdf"))
    model.gravity.linear = np.array([0.0, -9.81, 0.0])
    data = model.createData()
    ground = columns(folder / "ground_reaction.csv")
    points = json.loads((folder / "joint_trajectory.json").read_text())["points"]
    for k in range(0, len(points), 10):
        q, v, a, effort = (
            np.array(points[k][field])
            for field in ("positions", "velocities", "accelerations", "effort")
        )
        pin.forwardKinematics(model, data, q)
        loads = external(model, data, ground, k)
        tau = pin.rnea(model, data, q, v, a, loads)
        np.testing.assert_allclose(tau, effort, atol=1e-6)


def external(model, data, ground, k):
    """The ground reaction of the CSV in the frames of the joints of feet and toes."""
    loads = [pin.Force.Zero() for _ in range(model.njoints)]
    for side in ("right", "left"):
        force = np.array([ground[f"{side}_force_{axis}_N"][k] for axis in "xyz"])
        if not force.any():
            continue
        x, z = (ground[f"{side}_pressure_{axis}_m"][k] for axis in "xz")
        moment = np.cross([x, 0, z], force)
        moment[1] += ground[f"{side}_free_moment_y_Nm"][k]
        toes = ground[f"{side}_share_on_toes"][k]
        for part, share in (("foot", 1 - toes), ("toe", toes)):
            joint = SEGMENTS[f"{part}_{side[0]}"] + 1
            loads[joint] = data.oMi[joint].actInv(pin.Force(share * force, share * moment))
    return loads


@pytest.mark.parametrize("name", FORMATS)
def test_a_format_alone_writes_its_files(gait, tmp_path, name):
    files = export_gait(gait, tmp_path / "out", [name, name], rate=20)
    assert {path.name for path in files} == FILES[name] | NOTE
    assert {path.name for path in (tmp_path / "out").iterdir()} == FILES[name] | NOTE


def test_all_formats_are_the_default(folder):
    assert {path.name for path in folder.iterdir()} == NOTE.union(*FILES.values())


def test_the_files_that_go_with_an_old_result_are_those_that_are_written(folder):
    assert sorted(path.name for path in folder.iterdir()) == sorted(EXPORTED)


def test_what_fails_leaves_the_old_files_and_nothing_else(gait, tmp_path, monkeypatch):
    target = tmp_path / "out"
    export_gait(gait, target, ["bvh"], rate=20)
    (target / "notes.txt").write_text("mine")
    old = {path.name: path.read_bytes() for path in target.iterdir()}

    def fails(_stride, folder):
        (folder / "half.bvh").write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(export, "FORMATS", {**FORMATS, "csv": fails})
    with pytest.raises(ResultError, match="No space left"):
        export_gait(gait, target, ["bvh", "csv"], rate=50)
    assert {path.name: path.read_bytes() for path in target.iterdir()} == old
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_other_files_in_the_folder_stay(gait, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    export_gait(gait, tmp_path, ["bvh"], rate=20)
    export_gait(gait, tmp_path, ["sto"], rate=20)
    assert {path.name for path in tmp_path.iterdir()} == {"notes.txt"} | NOTE | FILES[
        "bvh"
    ] | FILES["sto"]


def test_tables_for_opensim_are_finer_by_default(gait, tmp_path):
    """It differentiates them: at 1000 Hz its torques are within 1 % of ours."""
    names = {"mot": "coordinates.mot", "grf": "ground_reaction.mot", "sto": "joint_torques.sto"}
    export_gait(gait, tmp_path / "all")
    export_gait(gait, tmp_path / "fine", names, 1000)
    export_gait(gait, tmp_path / "coarse", rate=100)
    for path in (tmp_path / "all").iterdir():
        if path.name in NOTE:
            continue
        like = tmp_path / ("fine" if path.name in names.values() else "coarse") / path.name
        assert path.read_bytes() == like.read_bytes()


@pytest.mark.parametrize("rate", [0, RATES[0] - 1, RATES[1] + 1, float("nan")])
def test_a_rate_out_of_range_is_refused(gait, tmp_path, rate):
    with pytest.raises(ValueError, match="from 10 to 10000 Hz"):
        export_gait(gait, tmp_path, rate=rate)


def test_an_unknown_format_is_refused(gait, tmp_path):
    with pytest.raises(ValueError, match="no format is called 'fbx': choose from osim"):
        export_gait(gait, tmp_path, ["bvh", "fbx"])
    assert not list(tmp_path.iterdir())


def test_the_command_writes_beside_the_result(gait, tmp_path, capsys):
    save_gait(gait, tmp_path)
    assert cli.run(["export", str(tmp_path), "--format", "bvh", "--format", "mot"]) == 0
    assert capsys.readouterr().out == f"wrote 3 files to {tmp_path / 'export'}\n"
    found = {path.name for path in (tmp_path / "export").iterdir()}
    assert found == NOTE | FILES["bvh"] | FILES["mot"]
    out = tmp_path / "elsewhere" / "deep"
    assert cli.run(["export", str(tmp_path), "--rate", "20", "--out", str(out)]) == 0
    assert {path.name for path in out.iterdir()} == NOTE.union(*FILES.values())
    assert pybvh.read_bvh_file(str(out / "motion.bvh")).frame_time == pytest.approx(1 / 20)


def test_the_command_offers_all_formats_and_rates(gait, tmp_path, capsys):
    assert [name.value for name in FormatName] == list(FORMATS)
    save_gait(gait, tmp_path)
    (tmp_path / "afile").touch()
    for arguments, complaint in (
        (["--format", "fbx"], "'fbx' is not one of"),
        (["--format", "osim,mot"], "'osim,mot' is not one of osim, mot, grf"),
        (["--format", "osim,mot"], "csv, urdf; give --format once for each"),
        (["--rate", str(RATES[0] - 1)], "error: --rate = 9: must be from 10 to 10000 Hz\n"),
        (["--rate", str(RATES[1] + 1)], "error: --rate = 10001: must be from 10 to 10000 Hz\n"),
        (["--out", str(tmp_path / "afile")], "afile: cannot be written: Not a directory\n"),
        (["--out", str(tmp_path / "afile/x")], "afile/x: cannot be written: Not a directory\n"),
    ):
        assert cli.run(["export", str(tmp_path), *arguments]) == cli.BAD_INPUT
        assert complaint in capsys.readouterr().err
    assert cli.run(["export", str(tmp_path / "no"), "--format", "bvh"]) == cli.BAD_INPUT
    assert "no result here" in capsys.readouterr().err
