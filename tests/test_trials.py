"""Files of trials are read as what they are: own exports as the walk, others in their dialects."""

import time
from dataclasses import replace
from pathlib import Path

import ezc3d
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from human_gait.body.skeleton import DOF_NAMES, GRAVITY, PRISMATIC
from human_gait.exceptions import TrialError
from human_gait.export.markers import marker_positions, marker_set
from human_gait.trials.axes import OPENSIM, OURS, Axes
from human_gait.trials.cycles import cycles_of
from human_gait.trials.events import feet_of, heels, strikes_of, swings
from human_gait.trials.force_columns import force_column
from human_gait.trials.known_names import OPENSIM as OPENSIM_NAMES
from human_gait.trials.names import named
from human_gait.trials.reading import combined, read_file, read_trial, read_trials, resampled
from human_gait.trials.recording import Plate, Recording
from human_gait.trials.stated import Stated, stated
from human_gait.walk.gait_cycle import PERCENT, gait_cycle

DEGREE = np.deg2rad(1.0)
OF_PEAK = 0.01


def near(found, wanted, share=OF_PEAK):
    """Whether values agree within a share of the peak."""
    return np.abs(found - wanted).max() <= share * np.abs(wanted).max() + 1e-12


def written(path, *lines):
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return path


def mot(path, columns, header=("inDegrees=yes",)):
    rows = np.column_stack(list(columns.values()))
    lines = ["\t".join(f"{x:.10g}" for x in row) for row in rows]
    return written(path, "a motion", "version=1", *header, "endheader", "\t".join(columns), *lines)


# Own exports


@pytest.mark.parametrize("name", ["coordinates.mot", "joint_angles.csv"])
def test_exported_angles_read_back(exported, name):
    gait, folder = exported
    read = read_trial(folder / name)
    ending = "_deg" if name.endswith("csv") else ""
    q = gait.instants(np.clip(read.time, 0.0, None)).q[read.time >= 0.0]
    for i, dof in enumerate(DOF_NAMES):
        if not PRISMATIC[i]:
            found = read.angles[dof + ending][read.time >= 0.0]
            assert np.abs(found - q[:, i]).max() < 0.5 * DEGREE
    assert len(read.translations) == 3


def test_exported_torques_read_back(exported):
    gait, folder = exported
    for name, ending in (("joint_torques.sto", "_moment"), ("joint_torques.csv", "_net_Nm")):
        read = read_trial(folder / name)
        later = read.time >= 0.0
        tau = gait.instants(read.time[later]).tau
        for i in range(6, 55):
            assert near(read.moments[DOF_NAMES[i] + ending][later], tau[:, i], 1e-6)


@pytest.mark.parametrize("name", ["markers.trc", "markers.c3d"])
def test_exported_markers_read_back(exported, name):
    gait, folder = exported
    read = read_trial(folder / name)
    places = marker_positions(gait.body, gait.instants(read.time).q)
    for k, marker in enumerate(marker_set(gait.body)):
        np.testing.assert_allclose(read.markers[marker.name], places[:, k], atol=1e-6)


@pytest.mark.parametrize("name", ["ground_reaction.mot", "ground_reaction.csv", "markers.c3d"])
def test_exported_forces_read_back(exported, name):
    gait, folder = exported
    read = read_trial(folder / name)
    for f, plate in enumerate(read.plates):
        later = plate.time >= 0.0
        now = gait.instants(plate.time[later])
        assert near(plate.force[later], now.grf[:, f], 1e-5)
        loaded = now.grf[:, f, 1] > 20.0
        assert np.abs(plate.point[later][loaded] - now.cop[loaded, f]).max() < 1e-3
        assert near(plate.free_moment[later][loaded], now.yaw_moment[loaded, f], 1e-3)
    if name.endswith("mot"):
        assert [plate.name for plate in read.plates] == ["r", "l"]


def test_a_c3d_file_tells_mass_and_events(exported):
    gait, folder = exported
    read = read_trial(folder / "markers.c3d")
    assert read.mass == pytest.approx(gait.body.subject.mass)
    strikes = [event.time for event in read.events if event.strike and event.side == "right"]
    np.testing.assert_allclose(strikes, [gait.step_time, 3 * gait.step_time], atol=1e-5)


@pytest.mark.parametrize("side", ["r", "l"])
def test_an_exported_walk_is_its_own_gait_cycle(exported, side):
    """The left leg's cycle is the mirror image: names, pelvis and medial axis change sides."""
    gait, folder = exported
    files = [folder / name for name in ("coordinates.mot", "ground_reaction.mot")]
    parts = [read_trial(file) for file in (*files, folder / "joint_torques.sto")]
    start = 0.0 if side == "l" else -0.15  # the stride of the right foot is not whole in the file
    period = 2 * gait.step_time
    if side == "r":
        parts = [periodic(part, period) for part in parts]
        start = gait.step_time
    events = [start, start + period]
    given = stated(side=side, events=events, mass=gait.body.subject.mass)
    cycle, wanted = cycles_of(parts, given), gait_cycle(gait)
    assert len(cycle.curves) == 23
    for name, rows in cycle.curves.items():
        limit = 0.5 if name.endswith("_deg") else OF_PEAK * np.abs(wanted[name]).max()
        assert np.abs(rows[0] - wanted[name]).max() < limit, name


def periodic(part, period):
    """A recording of a stride, and the same stride once more; only the ways of pelvis differ."""
    inside = (part.time >= 0.0) & (part.time < period - 1e-9)
    t = np.concatenate([part.time[inside], part.time[inside] + period])

    def twice(values):
        return np.concatenate([values[inside]] * 2)

    return replace(
        part,
        time=t,
        angles={name: twice(x) for name, x in part.angles.items()},
        moments={name: twice(x) for name, x in part.moments.items()},
        translations={},
        plates=tuple(
            Plate(t, twice(p.force), twice(p.point), twice(p.free_moment), p.name)
            for p in part.plates
        ),
    )


# Several files


def test_files_of_one_trial_are_one(exported):
    gait, folder = exported
    names = ("coordinates.mot", "ground_reaction.mot", "joint_torques.sto", "markers.trc")
    read = read_trial(*(folder / name for name in names))
    np.testing.assert_array_equal(read.time, read_trial(folder / "markers.trc").time)
    q = gait.instants(read.time).q
    i = DOF_NAMES.index("knee_flexion_r")
    assert np.abs(read.angles["knee_flexion_r"] - q[:, i]).max() < 1e-4
    assert len(read.plates) == 2
    assert len(read.markers) == len(marker_set(gait.body))


def test_the_same_kind_of_data_is_another_trial(exported):
    _, folder = exported
    motion, forces = folder / "coordinates.mot", folder / "ground_reaction.mot"
    trials = read_trials([motion, forces, motion, forces], Stated())
    assert [len(trial) for trial in trials] == [2, 2]
    with pytest.raises(TrialError, match="another trial"):
        read_trial(motion, motion)


def test_between_samples_lies_a_curve_and_in_gaps_nothing():
    t = np.linspace(0.0, 1.0, 101)
    wave = np.sin(2 * np.pi * t)
    at = np.linspace(-0.1, 1.1, 241)
    found = resampled(t, wave, at)
    inside = (at > -1e-9) & (at < 1.0 + 1e-9)
    assert np.abs(found[inside] - np.sin(2 * np.pi * at[inside])).max() < 1e-5
    assert np.isnan(found[~inside]).all()
    wave[40:50] = np.nan
    found = resampled(t, wave, at)
    assert np.isnan(found[(at > 0.395) & (at < 0.495)]).all()
    assert np.isfinite(found[(at > 0.01) & (at < 0.39)]).all()


# Axes and units


@pytest.mark.parametrize("up", ["x", "-y", "z"])
def test_axes_turn_without_mirroring(up):
    for forward in ("x", "y", "-z"):
        if forward[-1] != up[-1]:
            turn = Axes(up, forward).turn
            np.testing.assert_allclose(turn @ turn.T, np.eye(3))
            assert np.linalg.det(turn) == pytest.approx(1.0)
    np.testing.assert_array_equal(OURS.turn, np.eye(3))
    np.testing.assert_array_equal(OPENSIM.here(np.array([1.0, 2.0, 3.0])), [-3.0, 2.0, 1.0])


def test_a_file_in_other_axes_and_units_is_the_same_trial(exported, tmp_path):
    """From x forward, y up, z right to z up and walking against y, in metres."""
    _, folder = exported
    lines = (folder / "markers.trc").read_text().splitlines()
    head = [line.replace("\tmm\t", "\tm\t") for line in lines[:5]]
    rows = []
    for line in lines[6:]:
        frame, t, *cells = line.split("\t")
        forward, up, right = np.array(cells, dtype=float).reshape(-1, 3).T / 1000.0
        there = np.stack([-right, -forward, up], axis=1).ravel()
        rows.append("\t".join([frame, t, *(f"{x:.9g}" for x in there)]))
    path = written(tmp_path / "lab.trc", *head, *rows)
    wanted = read_trial(folder / "markers.trc").markers
    found = read_trial(path, up="z", forward="-y").markers
    for name, places in wanted.items():
        np.testing.assert_allclose(found[name], places, atol=1e-7)
    with pytest.raises(TrialError, match=r"furthest along z.*give --up z"):
        read_trial(path)
    with pytest.raises(TrialError, match=r"go 1\.\d m along -y.*give --forward -y"):
        read_trial(path, up="z")


def test_degrees_and_radians_are_the_same_angles(tmp_path):
    t = np.linspace(0, 1, 20)
    knee = 40.0 * np.sin(t)
    columns = {"time": t, "knee_angle_r": knee, "pelvis_tx": t}
    degrees = read_trial(mot(tmp_path / "a.mot", columns))
    columns["knee_angle_r"] = np.deg2rad(knee)
    radians = read_trial(mot(tmp_path / "b.mot", columns, ["inDegrees=no"]))
    told = read_trial(mot(tmp_path / "c.mot", columns, []), units="rad")
    table = np.column_stack([t, knee])
    text = "\n".join(f"{a};{b}".replace(".", ",") for a, b in table)
    path = written(tmp_path / "d.csv", "time_s;knee_angle_r (deg)", text)
    comma = read_trial(path)
    for read in (degrees, radians, told):
        np.testing.assert_allclose(read.angles["knee_angle_r"], np.deg2rad(knee), atol=1e-8)
        np.testing.assert_allclose(read.translations["pelvis_tx"], t, atol=1e-9)
    np.testing.assert_allclose(comma.angles["knee_angle_r (deg)"], np.deg2rad(knee))


def test_a_header_that_contradicts_its_angles_is_told(tmp_path):
    columns = {"time": np.arange(5.0), "knee_angle_r": np.full(5, 60.0)}
    path = mot(tmp_path / "a.mot", columns, ["inDegrees=no"])
    with pytest.raises(TrialError, match=r"knee_angle_r reaches 60: give --units deg"):
        read_trial(path)
    assert read_trial(path, units="deg").angles["knee_angle_r"][0] == pytest.approx(np.pi / 3)
    small = {f"knee_{k}": np.full(5, 1.1) for k in range(4)}
    notes = read_trial(mot(tmp_path / "b.mot", {"time": np.arange(5.0), **small})).notes
    assert "if these are radians" in notes[0]


def test_a_header_that_counts_wrong_is_told(tmp_path):
    columns = {"time": np.arange(5.0), "knee_angle_r": np.arange(5.0)}
    path = mot(tmp_path / "a.mot", columns, ["inDegrees=yes", "nRows=9", "nColumns=2"])
    assert read_trial(path).notes == ("the header says 9 rows, there are 5: is the file whole?",)


@pytest.mark.parametrize(
    ("name", "lines", "option"),
    [
        ("a.mot", ["m", "endheader", "time\tknee_angle_r", "0\t1", "1\t2"], "--units deg"),
        ("a.csv", ["time_s,knee_angle_r", "0,1", "0.1,2"], "--units deg"),
        ("a.csv", ["time_s,A_x_mm,A_y_mm,A_z_mm", "0,1,2,3", "1,1,2,3"], "--up x|y|z"),
        ("a.csv", ["time_s,A_x_mm,A_y_mm,A_z_mm", "0,1,2,3", "1,1,2,3"], "--forward x|y|z"),
        ("a.csv", ["time_s,A_x,A_y,A_z", "0,1,2,3", "1,1,2,3"], "--units mm"),
        ("a.csv", ["time,a_deg", "0,1", "10,1"], "time_s, time_ms"),
    ],
)
def test_what_a_file_leaves_open_is_asked_for_by_the_option(tmp_path, name, lines, option):
    given = {"up": "z", "forward": "x"} if "units mm" in option else {}
    with pytest.raises(TrialError) as found:
        read_trial(written(tmp_path / name, *lines), **given)
    assert option in str(found.value)
    assert "\n" not in str(found.value)


# Dialects


@pytest.mark.parametrize(
    ("name", "plate", "part"),
    [
        ("ground_force_vx", "", "force"),
        ("1_ground_force_px", "1", "point"),
        ("1_ground_torque_x", "1", "torque"),
        ("l_ground_force_vx", "l", "force"),
        ("R_ground_torque_x", "r", "torque"),
        ("ground_force1_vx", "1", "force"),
        ("ground_force_2_px", "2", "point"),
        ("ground_moment_2_mx", "2", "torque"),
        ("ground_force_r_vx", "r", "force"),
        ("ground_torque_l_x", "l", "torque"),
        ("ground_force_calcn_r_mx", "r", "torque"),
        ("right_force_x_N", "r", "force"),
        ("left_pressure_x_m", "l", "point"),
        ("right_free_moment_x_Nm", "r", "torque"),
    ],
)
def test_ground_reaction_is_known_by_its_several_names(name, plate, part):
    found = force_column(name)
    assert (found.plate, found.part, found.axis) == (plate, part, 0)


@pytest.mark.parametrize("name", ["foot_r_force_vx", "knee_angle_r", "glut_max1_r", "zmp_x_m"])
def test_other_columns_are_no_ground_reaction(name):
    assert force_column(name) is None


def test_the_header_of_simm_is_read(tmp_path):
    """As in OpenSim's own examples: blanks before the names, tabs behind the header."""
    names = [f"{p}ground_force_{k}{x}" for p in ("", "l_") for k in "vp" for x in "xyz"]
    row = "\t".join(map(str, [0, 700, 10, 0.5, 0, 0.1, 0, 300, 0, 0.2, 0, -0.1]))
    path = written(
        tmp_path / "subject01_walk1_grf.mot",
        "name subject01_walk1_grf.mot\t\t\t",
        "datacolumns 13\t\t",
        "datarows 2\t\t",
        "range 0.75 1.5\t\t",
        "endheader\t\t",
        "          time\t" + "\t".join(f"     {name}" for name in names),
        f"0.75\t{row}",
        f"0.7517\t{row}",
    )
    read = read_trial(path)
    assert read.notes == ()
    assert [plate.name for plate in read.plates] == ["", "l"]
    np.testing.assert_allclose(read.plates[0].force[0], [-10.0, 700.0, 0.0])
    feet, notes = feet_of(read, Stated())
    assert feet == {"": "r", "l": "l"}
    assert "right foot" in notes[0]


def test_states_of_opensim_are_coordinates(tmp_path):
    """Paths of states: values are angles, speeds and muscles are left out."""
    t = np.linspace(0, 1, 9)
    path = "/jointset/walker_knee_r/knee_angle_r"
    columns = {
        "time": t,
        f"{path}/value": t,
        f"{path}/speed": t,
        "/forceset/soleus_r/activation": t,
    }
    read = read_trial(mot(tmp_path / "a.sto", columns, ["version=3", "inDegrees=no"]))
    assert list(read.angles) == ["knee_angle_r"]
    assert len(read.ignored) == 2


@pytest.mark.parametrize(("sign", "word"), [(1.0, "positive"), (-1.0, "negative")])
def test_the_sign_of_the_knee_is_told_by_how_far_it_bends(sign, word):
    """Rajagopal's model flexes it in the positive sense, gait2392 in the negative one."""
    t = np.linspace(0, 1, 101)
    flexion = np.deg2rad(30 - 32 * np.cos(2 * np.pi * t))
    trial = Recording(
        Path("a.mot"),
        t,
        angles={"knee_angle_r": sign * flexion},
        moments={"knee_angle_r_moment": sign * 50.0 * np.ones(101)},
    )
    curves, readings = named(trial, Stated(), 50.0, trial)
    np.testing.assert_allclose(curves["knee_flexion_deg"], np.rad2deg(flexion))
    np.testing.assert_allclose(curves["knee_extension_Nm_per_kg"], -1.0)
    assert f"flexion is {word}" in readings[0].why
    still = replace(trial, angles={"knee_angle_r": 0.1 * flexion})
    curves, readings = named(still, Stated(), 50.0, still)
    assert not curves
    assert "give --map knee_flexion_deg=-knee_angle_r" in readings[0].why


def test_a_name_that_is_stated_comes_first():
    t = np.linspace(0, 1, 11)
    trial = Recording(Path("a.csv"), t, angles={"knee_flexion_r": t, "bend": -t})
    given = stated(map=["knee_flexion_deg=-bend"])
    curves, readings = named(trial, given, None, trial)
    np.testing.assert_allclose(curves["knee_flexion_deg"], np.rad2deg(t))
    assert [(one.column, one.why) for one in readings if one.curve] == [("bend", "as stated")]


VICON = """Model Outputs
100
,,Ann:RKneeAngles,,,Ann:RKneeMoment,,
Frame,Sub Frame,X,Y,Z,X,Y,Z
,,deg,deg,deg,N.mm/kg,N.mm/kg,N.mm/kg
1,0,10,0,0,500,0,0
2,0,20,0,0,600,0,0
3,0,30,0,0,700,0,0

Trajectories
100
,,Ann:RHEE,,,Ann:LHEE,,
Frame,Sub Frame,X,Y,Z,X,Y,Z
,,mm,mm,mm,mm,mm,mm
1,0,0,100,50,0,-100,50
2,0,,,,0,-100,50
3,0,0,100,50,0,-100,50

Devices
1000
,,Plate
Frame,Sub Frame,Fx
,,N
1,0,3
"""


def test_tables_of_vicon_are_read(tmp_path):
    path = written(tmp_path / "ann.csv", VICON)
    read = read_trial(path, up="z", forward="x")
    np.testing.assert_allclose(read.time, [0.0, 0.01, 0.02])
    np.testing.assert_allclose(np.rad2deg(read.angles["RKneeAngles.x"]), [10, 20, 30])
    np.testing.assert_allclose(read.moments["RKneeMoment.x"], [0.5, 0.6, 0.7])
    assert read.moment_unit == "N m/kg"
    np.testing.assert_allclose(read.markers["RHEE"][0], [0.1, 0.05, 0.0])
    assert np.isnan(read.markers["RHEE"][1]).all()
    assert read.ignored == ("section Devices",)
    curves, _ = named(read, Stated(), None, read)
    assert {"knee_flexion_deg", "knee_extension_Nm_per_kg"} <= set(curves)


def test_sub_frames_of_vicon_are_times_of_their_own(tmp_path):
    """The rate is that of the rows, 100 Hz, in frames of two."""
    rows = [f"{k // 2 + 1},{k % 2},{k % 60},2,3" for k in range(400)]
    head = ["Model Outputs", "100", ",,A:RKneeAngles,,", "Frame,Sub Frame,X,Y,Z", ",,deg,deg,deg"]
    read = read_trial(written(tmp_path / "a.csv", *head, *rows))
    np.testing.assert_allclose(read.time, np.arange(400) / 100.0)
    assert len(cycles_of([read], stated(events="0.5,1.5,2.5")).curves["knee_flexion_deg"]) == 2


def laboratory(path, kinds=(2, 4)):
    """A file as laboratories have it: z up, walking against y, plates that z points into."""
    file, t = ezc3d.c3d(), np.arange(50) / 100
    labels = ["Ann:RHEE", "Ann:LHEE", "Ann:RKneeAngles", "Ann:RKneeMoment", "Ann:RKneeForce"]
    points = np.ones((4, len(labels), len(t)))
    for k, x in enumerate((-100.0, 100.0)):
        points[:3, k] = np.stack([0 * t + x, 1000 - 2400 * t, 0 * t + 50])
    points[0, 2], points[0, 3] = 60 * t, 500.0
    file["data"]["points"] = points
    group = file["parameters"]["POINT"]
    group["RATE"]["value"], group["UNITS"]["value"] = [100.0], ["mm"]
    group["LABELS"]["value"] = labels
    screen = {"X_SCREEN": ["+X"], "Y_SCREEN": ["+Z"]}
    units = {"ANGLE_UNITS": ["deg"], "MOMENT_UNITS": ["Nmm"], "ANGLES": ["Ann:RKneeAngles"]}
    for name, value in {**screen, **units}.items():
        file.add_parameter("POINT", name, value)
    channels = np.zeros((1, 12, 500))
    channels[0, [2, 3, 4, 8]] = np.array([[700.0], [28000.0], [-70000.0], [300.0]])
    file["data"]["analogs"] = channels
    analog = file["parameters"]["ANALOG"]
    analog["RATE"]["value"], analog["GEN_SCALE"]["value"] = [1000.0], [1.0]
    analog["SCALE"]["value"], analog["OFFSET"]["value"] = np.ones(12), np.zeros(12, dtype=int)
    analog["LABELS"]["value"] = [f"channel {k}" for k in range(12)]
    analog["UNITS"]["value"] = [*["N"] * 3, *["Nmm"] * 3] * 2
    corners = np.array([[200, 300, 0], [200, -300, 0], [-200, -300, 0], [-200, 300, 0]])
    shifts = np.array([[-200, 0, 0], [200, 0, 0]])
    plates = file["parameters"]["FORCE_PLATFORM"]
    plates["USED"]["value"], plates["TYPE"]["value"] = [2], list(kinds)
    plates["CORNERS"]["value"] = np.stack([(corners + shift).T for shift in shifts], axis=2)
    plates["ORIGIN"]["value"] = np.zeros((3, 2))
    plates["CHANNEL"]["value"] = np.arange(1, 13).reshape(2, 6).T
    file.add_parameter("FORCE_PLATFORM", "CAL_MATRIX", np.stack([np.eye(6)] * 2, axis=2))
    file.write(str(path))
    return path


def test_c3d_of_a_laboratory_is_turned_into_the_axes_here(tmp_path):
    path = laboratory(tmp_path / "lab.c3d")
    with pytest.raises(TrialError, match=r"along -y.*give --forward -y"):
        read_trial(path)
    read = read_trial(path, forward="-y")
    np.testing.assert_allclose(read.markers["RHEE"][0], [-0.1, 0.05, -1.0], atol=1e-6)
    first, second = read.plates
    np.testing.assert_allclose(first.force[5], [0.0, 700.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(first.point[5], [-0.16, 0.0, -0.1], atol=1e-6)
    np.testing.assert_allclose(second.force[5], [0.0, 300.0, 0.0], atol=1e-3)
    assert len(first.time) == 10 * len(read.time)
    assert "taken as those on the plate" in read.notes[0]
    assert read.ignored == ("RKneeForce",)
    assert feet_of(read, Stated())[0] == {"1": "r", "2": "l"}


def test_outputs_of_plug_in_gait_are_known(tmp_path):
    read = read_trial(laboratory(tmp_path / "lab.c3d"), forward="-y")
    assert read.moment_unit == "N m/kg"  # by their size, whatever the file says
    assert "per kilogram" in read.notes[1]
    curves, readings = named(read, Stated(), None, read)
    np.testing.assert_allclose(curves["knee_flexion_deg"], 60 * read.time, atol=1e-5)
    np.testing.assert_allclose(curves["knee_extension_Nm_per_kg"], 0.5)
    assert {one.why for one in readings if one.curve} == {"Plug-in Gait's name"}


@pytest.mark.parametrize(
    ("coordinate", "axis", "shown"),
    [
        ("pelvis_tilt", [0, 0, 1], lambda turn: (turn @ [0, 1, 0])[0]),  # the top goes forward
        ("pelvis_list", [1, 0, 0], lambda turn: (turn @ [0, 0, 1])[1]),  # the right side goes up
        ("pelvis_rotation", [0, 1, 0], lambda turn: (turn @ [0, 0, 1])[0]),  # and forward
    ],
)
def test_the_pelvis_of_opensim_has_the_sign_of_its_axes(coordinate, axis, shown):
    """Its coordinates turn about z (right), x (forward), y (up)."""
    turn = Rotation.from_rotvec(0.1 * np.array(axis)).as_matrix()
    _, sign = OPENSIM_NAMES[coordinate]
    assert np.sign(shown(turn)) == sign


def test_the_trunk_of_opensim_leans_as_pelvis_and_lumbar_joint_turn():
    """Backwards is positive in both; turned about the vertical in between, it leans aside."""
    t = np.linspace(0, 1, 5)
    tilt, extension = np.full(5, -0.2), np.full(5, -0.1)
    trial = Recording(Path("a.mot"), t, angles={"pelvis_tilt": tilt, "lumbar_extension": extension})
    lean = named(trial, Stated(), None, trial)[0]["trunk_flexion_deg"]
    np.testing.assert_allclose(lean, np.rad2deg(0.3))
    aside = {**trial.angles, "pelvis_rotation": np.full(5, np.pi / 2)}
    turned = replace(trial, angles=aside)
    lean = named(turned, Stated(), None, turned)[0]["trunk_flexion_deg"]
    np.testing.assert_allclose(np.tan(np.deg2rad(lean)), np.tan(0.2))


# Feet, strikes, mass


def strides(gait, steps=6.5):
    """A recording of markers and forces of a walk that goes on."""
    t = np.arange(0.0, steps * gait.step_time, 0.01)
    now = gait.instants(t)
    places = marker_positions(gait.body, now.q)
    markers = {m.name: places[:, k] for k, m in enumerate(marker_set(gait.body))}
    plates = tuple(
        Plate(t, now.grf[:, f], now.cop[:, f], now.yaw_moment[:, f], str(f + 1)) for f in (0, 1)
    )
    return Recording(Path("walk"), t, markers=markers, plates=plates)


def test_strikes_come_from_forces_and_where_there_are_none_from_the_heel(exported):
    gait, _ = exported
    trial = strides(gait)
    feet, _ = feet_of(trial, Stated())
    assert feet == {"1": "r", "2": "l"}
    wanted = gait.step_time * np.array([1, 3, 5])
    forces = strikes_of(trial, trial.plates[:1], Stated())
    np.testing.assert_allclose(forces.times, wanted, atol=0.02)
    assert "vertical force of the right foot" in forces.source
    heel = strikes_of(replace(trial, plates=()), (), Stated())
    np.testing.assert_allclose(heel.times, wanted, atol=0.05)
    assert "marker RHEE" in heel.source
    assert strikes_of(trial, trial.plates, stated(events="0.1,0.9")).times == (0.1, 0.9)
    bare = replace(trial, plates=(), markers={})
    with pytest.raises(TrialError, match=r"no marker on the right heel.*give --events"):
        strikes_of(bare, (), Stated())


def test_the_foot_swings_forward_before_a_strike():
    """Noise is no strike, nor is a trial that ends in a swing; one soon before its end counts."""
    t = np.arange(0.0, 2.68, 0.01)
    ahead = 0.3 * np.sin(2 * np.pi * t) + 0.003 * np.random.default_rng(0).normal(size=len(t))
    ahead += 0.04 * np.exp(-(((t - 0.75) / 0.03) ** 2))
    np.testing.assert_allclose(swings(t, ahead)[:2], [0.25, 1.25], atol=0.03)
    assert len(swings(t[t < 2.15], ahead[t < 2.15])) == 2
    assert len(swings(t[t < 2.36], ahead[t < 2.36])) == 3
    assert swings(t[:3], ahead[:3]) == swings(t, np.full(len(t), np.nan)) == []


def test_a_contact_or_a_gap_that_is_too_short_is_none():
    t = np.arange(0.0, 2.0, 0.001)
    vertical = np.where((t % 1.0 > 0.2) & (t % 1.0 < 0.8), 700.0, 0.0)
    vertical[(t > 0.1) & (t < 0.12)] = 50.0  # a plate that rings
    vertical[(t > 0.21) & (t < 0.24)] = 5.0
    force = np.stack([0 * t, vertical, 0 * t], axis=1)
    plate = Plate(t, force, np.zeros_like(force), 0 * t, "r")
    found = strikes_of(Recording(Path("a"), t, plates=(plate,)), (plate,), Stated())
    np.testing.assert_allclose(found.times, [0.2, 1.2], atol=0.002)


def test_feet_are_told_by_the_heels_or_where_they_are_or_by_the_user(exported):
    gait, _ = exported
    trial = strides(gait)
    bare = replace(trial, markers={})
    assert feet_of(bare, Stated())[0] == {"1": "r", "2": "l"}
    one = replace(bare, plates=bare.plates[:1])
    with pytest.raises(TrialError, match="give --feet 1=r or 1=l"):
        feet_of(one, Stated())
    assert feet_of(one, stated(feet=["1=r"]))[0] == {"1": "r"}
    nameless = replace(one, plates=(replace(one.plates[0], name=""),))
    with pytest.raises(TrialError, match="give --feet =r or =l"):
        feet_of(nameless, Stated())
    assert feet_of(nameless, stated(feet=["=l"]))[0] == {"": "l"}
    with pytest.raises(TrialError, match="the force plates are '1'"):
        feet_of(one, stated(feet={"9": "r"}))


def test_the_forces_of_a_whole_stride_weigh_the_walker(exported):
    """The vertical force averages the weight of body and load, exactly."""
    gait, _ = exported
    cycle = cycles_of([strides(gait, 9)], Stated())
    mass = gait.body.subject.mass + gait.body.load.mass
    told = next(note for note in cycle.notes if "by the mean vertical force" in note)
    assert float(told.split("mass ")[1].split()[0]) == pytest.approx(mass, rel=5e-3)
    rows = cycle.curves["vertical_up_BW"]
    wanted = gait.right_stride.grf[:, 0, 1] / (mass * GRAVITY)
    assert len(rows) == 3
    assert np.median(np.abs(rows - wanted)) < 0.02


def test_a_cycle_with_a_gap_does_not_count():
    t = np.arange(0.0, 3.01, 0.01)
    knee = np.sin(2 * np.pi * t)
    knee[150] = np.nan
    trial = Recording(Path("a.csv"), t, angles={"knee_flexion_r": knee})
    cycle = cycles_of([trial], stated(events=[0, 1, 2, 3]))
    assert len(cycle.curves["knee_flexion_deg"]) == 2
    wave = np.rad2deg(np.sin(2 * np.pi * PERCENT / 100))
    np.testing.assert_allclose(cycle.curves["knee_flexion_deg"][0], wave, atol=1e-3)
    with pytest.raises(TrialError, match="no cycle of the leg is whole"):
        cycles_of([trial], stated(events=[5, 6]))


def test_a_stride_with_a_missed_strike_does_not_count():
    t = np.arange(0.0, 8.0, 0.01)
    trial = Recording(Path("a"), t, angles={"knee_flexion_r": 0.5 * np.sin(2 * np.pi * t / 1.1)})
    cycle = cycles_of([trial], stated(events="0.55,1.65,2.75,4.95,6.05"))
    rows = cycle.curves["knee_flexion_deg"]
    assert len(rows) == 3
    assert rows.std(axis=0).max() < 0.01
    told = "left out as two strides or more: 2.20 s from 2.750 s, more than 1.5 times the median"
    assert any(told in note for note in cycle.notes)
    two = cycles_of([trial], stated(events="0.55,1.65,3.85"))
    assert len(two.curves["knee_flexion_deg"]) == 1


def test_combining_keeps_what_each_file_has(exported):
    gait, _ = exported
    trial = strides(gait)
    motion = Recording(Path("b"), trial.time + 0.003, angles={"knee_flexion_r": trial.time**2})
    whole = combined([motion, replace(trial, mass=60.0)])
    assert whole.mass == 60.0
    inside = trial.time >= 0.003
    found = whole.angles["knee_flexion_r"][inside]
    np.testing.assert_allclose(found, (trial.time[inside] - 0.003) ** 2, atol=1e-9)


def test_a_trc_file_of_opensim_is_read(tmp_path):
    """As its examples are: a tab ends each row, frames begin anywhere, the header counts others."""
    path = written(
        tmp_path / "walk_free_01.trc",
        "PathFileType\t4\t(X/Y/Z)\tsubject01_walk1.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate",
        "60.00\t60.00\t       900\t2\tmm\t60.00",
        "Frame#\tTime\tR.Heel\t\t\tV.Sacral\t\t\t",
        "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t",
        "",
        "185\t3.067000\t810.08\t57.2\t100.05\t404.7\t1036.6\t0.8\t",
        "186\t3.083000\t800.38\t57.0\t98.3\t406.5\t1034.2\t2.9\t",
    )
    read = read_trial(path)
    np.testing.assert_allclose(read.markers["R.Heel"][0], [-0.10005, 0.0572, 0.81008])
    assert heels(read) == {"r": "R.Heel"}
    assert read.notes == ("the header says 900 frames, there are 2: is the file whole?",)


# Size


def test_a_hundred_thousand_rows_take_less_than_two_seconds(tmp_path):
    rows = "\n".join(["\t".join(["{}", *["12.345678"] * 6])] * 100_000)
    rows = rows.format(*(f"{k / 1000:.3f}" for k in range(100_000)))
    names = "\t".join(["time", *(f"knee_{k}" for k in range(6))])
    path = written(tmp_path / "a.mot", "m", "inDegrees=yes", "endheader", names, rows)
    start = time.process_time()
    read = read_file(path, Stated())
    assert time.process_time() - start < 2.0
    assert len(read.time) == 100_000
