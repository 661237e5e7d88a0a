"""The signs of the gait cycle are held against where the joints of the body are in space."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from bodies import LOADED, MALE

from human_gait.body import skeleton
from human_gait.body.person import Body
from human_gait.dynamics.recursive_lagrangian import ExternalLoad, inverse_dynamics
from human_gait.exceptions import ResultError
from human_gait.scenario import Scenario, Walk
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import (
    COLUMNS,
    FURTHER,
    PERCENT,
    gait_cycle,
    label_and_unit,
    load_gait_cycle,
    save_gait_cycle,
    trunk_lean,
)

MODEL = MALE.pinocchio_model()
WEIGHT = MALE.subject.mass * skeleton.GRAVITY


@dataclass
class Standstill:
    """A stand-in for a gait: one posture for ever, held against given forces on the right foot."""

    q: np.ndarray = field(default_factory=lambda: np.zeros(55))
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    body: Body = MALE
    step_time: float = 0.5

    @property
    def right_stride(self):
        t = np.arange(101)
        tau = inverse_dynamics(self.body, self.q, np.zeros(55), np.zeros(55), self.loads())
        grf = np.zeros((len(t), 2, 3))
        grf[:, 0] = self.force
        q, tau = (np.tile(values, (len(t), 1)) for values in (self.q, tau))
        return SimpleNamespace(t=t, q=q, v=0.0 * q, tau=tau, grf=grf)

    def loads(self):
        """The force of the ground on the tip of the right toes."""
        side, point = 0, self.body.contact.names.index("toe")
        link = int(self.body.contact.links[side, point])
        where = self.body.contact.points[side, point]
        return [ExternalLoad(link, where, np.array(self.force), np.zeros(3))]


def posture(**degrees):
    q = np.zeros(55)
    for name, value in degrees.items():
        q[skeleton.index(name)] = np.deg2rad(value)
    return q


def first_row(gait):
    return {name: values[0] for name, values in gait_cycle(gait).items()}


def place(q, name):
    """Origin of a joint, or a contact point of a foot, in the world.

    The hip flexion joints lie on their common axis at mid-hip, abduction at the hip centres.
    """
    data = MODEL.createData()
    pin.framesForwardKinematics(MODEL, data, q)
    joint = next((k for k, n in enumerate(MODEL.names) if n.endswith(name)), None)
    if joint is not None:
        return data.oMi[joint].translation
    return data.oMf[MODEL.getFrameId(name)].translation


def angle(q, start, end, rise, run):
    """Direction of the line between two joints in the plane of two axes, [deg]."""
    line = place(q, end) - place(q, start)
    return np.rad2deg(np.arctan2(rise @ line, run @ line))


LEFT, UP, FORWARD = np.eye(3)
RIGHT, DOWN, BACK = -np.eye(3)

# column: what it measures in a posture where only the joints concerned have moved
THOUGHT_EXPERIMENTS = {
    "pelvis_tilt_anterior_deg": (
        {"pelvis_rx": 9},
        lambda q: angle(q, "hip_abduction_r", "spine1_flexion", FORWARD, UP),
    ),
    "pelvis_obliquity_up_deg": (
        {"pelvis_rz": -6},
        lambda q: angle(q, "hip_abduction_l", "hip_abduction_r", UP, RIGHT),
    ),
    "pelvis_rotation_internal_deg": (
        {"pelvis_ry": 7},
        lambda q: angle(q, "hip_abduction_l", "hip_abduction_r", FORWARD, RIGHT),
    ),
    "hip_flexion_deg": (
        {"hip_flexion_r": 25},
        lambda q: angle(q, "hip_abduction_r", "knee_flexion_r", FORWARD, DOWN),
    ),
    "hip_adduction_deg": (
        {"hip_abduction_r": -8},
        lambda q: angle(q, "hip_abduction_r", "knee_flexion_r", LEFT, DOWN),
    ),
    "hip_rotation_internal_deg": (
        {"hip_rotation_r": 11},
        lambda q: angle(q, "heel_r", "toe_r", LEFT, FORWARD),
    ),
    "knee_flexion_deg": (
        {"knee_flexion_r": 60},
        lambda q: angle(q, "knee_flexion_r", "ankle_dorsiflexion_r", BACK, DOWN),
    ),
    "ankle_dorsiflexion_deg": (
        {"ankle_dorsiflexion_r": 12},
        lambda q: angle(q, "heel_r", "toe_r", UP, FORWARD),
    ),
    "ankle_inversion_deg": (
        {"ankle_inversion_r": 14},
        lambda q: angle(q, "ball_lateral_r", "ball_medial_r", UP, LEFT),
    ),
    "toe_extension_deg": (
        {"toe_extension_r": 17},
        lambda q: (
            angle(q, "toe_extension_r", "toe_r", UP, FORWARD)
            - angle(np.zeros(55), "toe_extension_r", "toe_r", UP, FORWARD)
        ),
    ),
    "trunk_flexion_deg": (
        {"pelvis_rx": 4, "spine1_flexion": 3, "spine3_flexion": 2, "spine4_flexion": 5},
        lambda q: angle(q, "spine4_flexion", "neck_lower_flexion", FORWARD, UP),
    ),
    "shoulder_flexion_deg": (
        {"shoulder_flexion_r": 20},
        lambda q: angle(q, "shoulder_abduction_r", "elbow_flexion_r", FORWARD, DOWN),
    ),
    "elbow_flexion_deg": (
        {"elbow_flexion_r": 35},
        lambda q: angle(q, "elbow_flexion_r", "wrist_radial_deviation_r", FORWARD, DOWN),
    ),
}


@pytest.mark.parametrize("column", THOUGHT_EXPERIMENTS)
def test_an_angle_is_positive_where_the_body_shows_it(column):
    dofs, seen = THOUGHT_EXPERIMENTS[column]
    q = posture(**dofs)
    shown = gait_cycle(Standstill(q))[column]
    assert seen(q) > 1
    np.testing.assert_allclose(shown, seen(q), rtol=1e-9)


@pytest.mark.parametrize("column", THOUGHT_EXPERIMENTS)
def test_upright_standing_is_the_zero_of_all_angles(column):
    np.testing.assert_allclose(gait_cycle(Standstill())[column], 0, atol=1e-9)


def test_all_angles_are_covered_by_a_thought_experiment():
    names = (*COLUMNS, *FURTHER)
    angles = {name for name in names if name.endswith("_deg") and not name.startswith("left_")}
    assert set(THOUGHT_EXPERIMENTS) == angles


def test_trunk_lean_is_the_sum_of_the_flexions_even_when_turned_and_tilted_sideways():
    leaning = {"pelvis_rx": 4, "spine1_flexion": 3, "spine2_flexion": 2, "spine4_flexion": 5}
    turned = posture(**leaning, pelvis_rz=5, pelvis_ry=8, spine2_rotation=-3, spine3_lateral=4)
    assert np.rad2deg(trunk_lean(MALE.table, turned)) == pytest.approx(14, abs=1)


def test_a_leg_held_out_in_front_takes_hip_flexors_and_knee_extensors():
    row = first_row(Standstill(posture(hip_flexion_r=80)))
    assert row["hip_extension_Nm_per_kg"] < 0 < row["knee_extension_Nm_per_kg"]


def test_a_leg_held_out_behind_takes_hip_extensors():
    assert first_row(Standstill(posture(hip_flexion_r=-25)))["hip_extension_Nm_per_kg"] > 0


def test_a_leg_held_out_sideways_takes_hip_abductors():
    assert first_row(Standstill(posture(hip_abduction_r=30)))["hip_abduction_Nm_per_kg"] > 0


def test_standing_on_the_toes_takes_plantarflexors_by_weight_times_arm():
    row = first_row(Standstill(force=(0, WEIGHT, 0)))
    arm = (place(np.zeros(55), "toe_r") - place(np.zeros(55), "ankle_dorsiflexion_r"))[2]
    foot = 0.02 * skeleton.GRAVITY * arm  # the foot's own weight pulls it down
    assert row["ankle_plantarflexion_Nm_per_kg"] == pytest.approx(skeleton.GRAVITY * arm, abs=foot)


def test_forces_are_up_forward_and_medial_in_body_weights():
    row = first_row(Standstill(force=(0.05 * WEIGHT, 1.1 * WEIGHT, -0.2 * WEIGHT)))
    assert row["mediolateral_medial_BW"] == pytest.approx(0.05)
    assert row["vertical_up_BW"] == pytest.approx(1.1)
    assert row["foreaft_forward_BW"] == pytest.approx(-0.2)


def test_to_the_left_is_medial_of_the_right_foot():
    foot, pelvis = place(np.zeros(55), "heel_r"), place(np.zeros(55), "spine1_flexion")
    assert (pelvis - foot) @ LEFT > 0


def test_kilograms_and_weight_are_those_of_the_body_without_its_load():
    loaded, alone = (
        first_row(Standstill(posture(hip_flexion_r=80), (0, WEIGHT, 0), body))
        for body in (LOADED, MALE)
    )
    assert loaded["vertical_up_BW"] == pytest.approx(1)
    assert loaded["knee_extension_Nm_per_kg"] == pytest.approx(alone["knee_extension_Nm_per_kg"])


def test_the_cycle_has_all_its_columns():
    cycle = gait_cycle(Standstill())
    assert tuple(cycle) == (*COLUMNS, *FURTHER)
    assert all(values.shape == (101,) for values in cycle.values())


def test_the_first_half_is_the_other_legs_step():
    """By symmetry the right leg does in the second step what the left leg did in the first."""
    scenario = Scenario("case", Walk(1.2, 0.66))
    rng = np.random.default_rng(3)
    control_points = rng.uniform(-0.05, 0.05, (9, 55))
    control_points[:, skeleton.index("pelvis_ty")] = 0.9
    gait = Gait(scenario, np.linspace(0, scenario.walk.step_time, 7), control_points)
    T = gait.step_time
    np.testing.assert_allclose(gait.right_stride.t, np.linspace(T, 3 * T, 101))
    cycle = gait_cycle(gait)
    step = gait.instants(np.linspace(0, gait.step_time, 51)[:-1])
    for column, name in (("knee_flexion_deg", "knee_flexion"), ("hip_flexion_deg", "hip_flexion")):
        left, right = (np.rad2deg(step.q[:, skeleton.index(f"{name}_{s}")]) for s in "lr")
        np.testing.assert_allclose(cycle[column][:50], left, atol=1e-9)
        np.testing.assert_allclose(cycle[column][50:100], right, atol=1e-9)
    weight = scenario.subject.mass * skeleton.GRAVITY
    np.testing.assert_allclose(cycle["vertical_up_BW"][:50] * weight, step.grf[:, 1, 1], atol=1e-6)
    np.testing.assert_allclose(
        cycle["mediolateral_medial_BW"][:50] * weight, -step.grf[:, 1, 0], atol=1e-6
    )


def any_gait():
    """Some motion: neither a walk nor symmetric within the step."""
    scenario = Scenario("case", Walk(1.2, 0.66))
    control_points = np.random.default_rng(5).uniform(-0.05, 0.05, (9, 55))
    control_points[:, skeleton.index("pelvis_ty")] = 0.9
    return Gait(scenario, np.linspace(0, scenario.walk.step_time, 7), control_points)


def test_the_left_leg_does_half_a_cycle_later_what_the_right_leg_does():
    cycle = gait_cycle(any_gait())
    left = [name for name in FURTHER if name.startswith("left_")]
    legs = {name.removeprefix("left_") for name in left}
    assert legs >= {name for name in COLUMNS if name.startswith(("hip", "knee", "ankle"))}
    assert legs >= {name for name in COLUMNS if name.endswith("_BW")}
    for name in left:
        right, scale = cycle[name.removeprefix("left_")], np.abs(cycle[name]).max()
        assert scale > 0
        np.testing.assert_allclose(cycle[name][50:], right[:51], atol=1e-9 * scale)
        np.testing.assert_allclose(cycle[name][:51], right[50:], atol=1e-9 * scale)


def test_what_bends_or_turns_the_trunk_changes_sides_from_step_to_step():
    cycle = gait_cycle(any_gait())
    for name, sign in (("extension", 1), ("bending_right", -1), ("rotation_left", -1)):
        curve = cycle[f"L5S1_{name}_Nm_per_kg"]
        np.testing.assert_allclose(curve[50:], sign * curve[:51], atol=1e-9 * np.abs(curve).max())


def test_a_power_is_moment_times_velocity_of_one_axis_or_of_all():
    gait = any_gait()
    cycle, t = gait_cycle(gait), gait.step_time * (1 + PERCENT / 50)
    power = gait.tau(t) * gait.v(t) / gait.body.subject.mass
    for joint, axes in (
        ("hip", ("hip_flexion", "hip_abduction", "hip_rotation")),
        ("knee", ("knee_flexion",)),
        ("ankle", ("ankle_dorsiflexion", "ankle_inversion")),
    ):
        each = [power[:, skeleton.index(f"{axis}_r")] for axis in axes]
        np.testing.assert_allclose(cycle[f"{joint}_W_per_kg"], sum(each), rtol=1e-9)
        if joint != "knee":
            np.testing.assert_allclose(cycle[f"{joint}_sagittal_W_per_kg"], each[0], rtol=1e-9)


def test_a_load_in_front_takes_the_extensors_of_the_back():
    bowed = first_row(Standstill(posture(spine1_flexion=15)))
    assert bowed["L5S1_extension_Nm_per_kg"] > 0.1
    to_the_left = first_row(Standstill(posture(spine1_lateral=-3, spine2_lateral=-6)))
    assert to_the_left["L5S1_bending_right_Nm_per_kg"] > 0.05


def test_what_is_saved_is_read_back(tmp_path):
    gait = Standstill(posture(hip_flexion_r=20, knee_flexion_r=40), (10, 700, -30))
    save_gait_cycle(gait, tmp_path / "gait_cycle.csv")
    read, cycle = load_gait_cycle(tmp_path / "gait_cycle.csv"), gait_cycle(gait)
    for column in (*COLUMNS, *FURTHER):
        np.testing.assert_allclose(read[column], cycle[column], rtol=1e-8, atol=1e-9)
    lines = (tmp_path / "gait_cycle.csv").read_text().splitlines()
    assert lines[0] == ",".join((*COLUMNS, *FURTHER))
    assert len(lines) == 102


def test_a_column_more_is_no_harm(tmp_path):
    save_gait_cycle(Standstill(), tmp_path / "cycle.csv")
    lines = (tmp_path / "cycle.csv").read_text().splitlines()
    (tmp_path / "cycle.csv").write_text("\n".join(f"{line},{k}" for k, line in enumerate(lines)))
    assert tuple(load_gait_cycle(tmp_path / "cycle.csv")) == (*COLUMNS, *FURTHER)


def test_a_file_of_an_older_version_has_the_first_columns_alone(tmp_path):
    save_gait_cycle(Standstill(), tmp_path / "cycle.csv")
    lines = (tmp_path / "cycle.csv").read_text().splitlines()
    old = [",".join(line.split(",")[: len(COLUMNS)]) for line in lines]
    (tmp_path / "cycle.csv").write_text("\n".join(old))
    assert tuple(load_gait_cycle(tmp_path / "cycle.csv")) == COLUMNS


def with_nan(text):
    lines = text.splitlines()
    lines[50] = ",".join([*lines[50].split(",")[:-1], "nan"])
    return "\n".join(lines)


CORRUPTIONS = {
    "no column knee_flexion_deg": lambda text: text.replace("knee_flexion_deg", "knee"),
    "101 rows": lambda text: "\n".join(text.splitlines()[:50]),
    "finite": with_nan,
    "table of numbers": lambda text: text.replace("\n50,", "\nfifty,"),
    "from 0 to 100": lambda text: text.replace("\n50,", "\n50.5,"),
    "101 rows of finite": lambda text: text[:0],
}


@pytest.mark.parametrize(("complaint", "corrupt"), CORRUPTIONS.items(), ids=CORRUPTIONS)
def test_a_corrupt_file_is_refused_by_name(tmp_path, complaint, corrupt):
    path = tmp_path / "gait_cycle.csv"
    save_gait_cycle(Standstill(), path)
    path.write_text(corrupt(path.read_text()))
    with pytest.raises(ResultError, match=complaint) as caught:
        load_gait_cycle(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("content", [b"\xff\xfe\x00", b"a,b\n1,2\n3\n"])
def test_what_is_no_table_is_refused(tmp_path, content):
    (tmp_path / "x.csv").write_bytes(content)
    with pytest.raises(ResultError, match=r"table of numbers|no text in UTF-8"):
        load_gait_cycle(tmp_path / "x.csv")


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ResultError, match=r"no gait_cycle\.csv"):
        load_gait_cycle(tmp_path / "gait_cycle.csv")


def test_every_column_has_a_name_and_a_unit():
    named = [label_and_unit(column) for column in (*COLUMNS[1:], *FURTHER)]
    assert len(set(named)) == len(named)
    assert label_and_unit("hip_extension_Nm_per_kg") == ("hip extension moment", "N m/kg")
    assert label_and_unit("vertical_up_BW") == ("vertical force", "BW")
    assert label_and_unit("left_vertical_up_BW") == ("left vertical force", "BW")
    assert label_and_unit("L5S1_extension_Nm_per_kg") == ("L5/S1 extension moment", "N m/kg")
    assert label_and_unit("hip_sagittal_W_per_kg") == ("hip sagittal power", "W/kg")
    assert label_and_unit("knee_flexion_deg") == ("knee flexion", "deg")
    assert len(PERCENT) == 101
