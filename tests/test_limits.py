"""How far joints turn and how strong they are."""

import numpy as np
import pytest
from bodies import MAN
from walks import scenario

from human_gait.body.limits import (
    joint_limits,
    mirrored_limits,
    position_limits,
    torque_limits,
)
from human_gait.body.skeleton import DOF_NAMES, MIRROR_INDEX, index, mirror
from human_gait.exceptions import ScenarioError
from human_gait.scenario import Subject


def test_limits_are_ordered_contain_upright_and_are_the_same_on_both_sides():
    lower, upper = position_limits()
    assert np.all(lower < upper)
    assert np.all(lower <= 0)
    assert np.all(upper >= 0)
    limbs = [i for i in range(55) if MIRROR_INDEX[i] != i]
    for limit in (lower, upper, *torque_limits(MAN)):
        np.testing.assert_array_equal(limit[limbs], mirror(limit)[limbs])


def test_limits_are_in_radians():
    lower, upper = position_limits()
    knee = index("knee_flexion_r")
    assert (lower[knee], upper[knee]) == (0.0, pytest.approx(np.deg2rad(135)))


def test_only_the_global_dof_have_no_strength_limit():
    lower, upper = torque_limits(MAN)
    np.testing.assert_array_equal(np.isinf(lower), np.arange(55) < 6)
    np.testing.assert_array_equal(np.isinf(upper), np.arange(55) < 6)
    assert np.all(lower < 0)
    assert np.all(upper > 0)


def test_ankle_strength_scales_with_the_subject_and_exceeds_what_walking_takes():
    """Measured walking peaks at 1.4-1.6 N m/kg of plantarflexion."""
    ankle = index("ankle_dorsiflexion_r")
    lower, _ = torque_limits(MAN)
    assert -lower[ankle] > 1.6 * 78.4
    heavier, _ = torque_limits(Subject(sex="male", stature=1.755, mass=2 * 78.4))
    assert heavier[ankle] == pytest.approx(2 * lower[ankle])


def limits_of(**sections):
    lower, upper = joint_limits(scenario(**sections))
    return {name: tuple(ends) for name, *ends in zip(DOF_NAMES, lower, upper, strict=True)}


def test_joint_limits_are_within_those_of_the_anatomy():
    lower, upper = joint_limits(scenario())
    anatomy = position_limits()
    assert np.all(lower >= anatomy[0])
    assert np.all(upper <= anatomy[1])


def test_the_trunk_is_held_upright():
    held = limits_of(posture={"pelvis_deg": 3.0, "spine_deg": 2.0, "neck_deg": 1.0})
    for start, degrees in (("pelvis_r", 3.0), ("spine", 2.0), ("neck", 1.0)):
        found = [ends for name, ends in held.items() if name.startswith(start)]
        assert found
        assert max(upper for _, upper in found) == pytest.approx(np.deg2rad(degrees))
        assert min(lower for lower, _ in found) == pytest.approx(-np.deg2rad(degrees))
    assert held["knee_flexion_r"] == limits_of()["knee_flexion_r"]


def test_a_scenario_freezes_joints_and_sets_ranges():
    limits = {"frozen": ["wrist_flexion_r", "wrist_flexion_l"], "pelvis_rx": [-10.0, 12.0]}
    found = limits_of(limits=limits)
    assert found["wrist_flexion_r"] == found["wrist_flexion_l"] == (0.0, 0.0)
    assert found["pelvis_rx"] == pytest.approx(np.deg2rad([-10.0, 12.0]))


def test_limits_hold_for_a_posture_and_its_mirror_image():
    """The walk goes on mirrored: what binds the right knee in one step binds the left one too."""
    limits = {
        "knee_flexion_r": [5.0, 70.0],
        "spine1_lateral": [-1.0, 4.0],
        "frozen": ["wrist_flexion_l"],
    }
    lower, upper = joint_limits(scenario(limits=limits))
    left = index("knee_flexion_l")
    assert (lower[left], upper[left]) == pytest.approx(np.deg2rad([5.0, 70.0]))
    assert upper[index("spine1_lateral")] == pytest.approx(np.deg2rad(1.0))
    assert lower[index("wrist_flexion_r")] == upper[index("wrist_flexion_r")] == 0.0
    ends = mirror(lower), mirror(upper)
    np.testing.assert_allclose(np.minimum(*ends), lower)
    np.testing.assert_allclose(np.maximum(*ends), upper)


@pytest.mark.parametrize(
    ("limits", "parts"),
    [
        ({"frozen": ["tail"]}, ("limits.frozen", "tail")),
        ({"tail": [0.0, 1.0]}, ("limits.tail", "unknown DOF")),
        ({"pelvis_rz": [2.0, 5.0]}, ("limits.pelvis_rz = [2.0, 5.0]", "mirror", "with 0 in it")),
        (
            {"knee_flexion_r": [0.0, 5.0], "knee_flexion_l": [10.0, 20.0]},
            ("limits.knee_flexion_r = [0.0, 5.0]", "the same on both sides"),
        ),
    ],
)
def test_limits_that_make_no_sense_are_refused(limits, parts):
    with pytest.raises(ScenarioError) as caught:
        limits_of(limits=limits)
    assert [part for part in parts if part not in str(caught.value)] == []


@pytest.mark.parametrize(
    ("limits", "told"),
    [
        ({}, []),
        ({"frozen": ["neck_lower_lateral"]}, []),
        ({"pelvis_ty": [0.8, 1.0]}, []),
        ({"knee_flexion_r": [0, 70], "knee_flexion_l": [0, 70]}, []),
        ({"knee_flexion_r": [0, 70]}, ["limits.knee_flexion_r holds for the left too"]),
        ({"wrist_flexion_l": [0, 5]}, ["limits.wrist_flexion_l holds for the right too"]),
        ({"frozen": ["toe_extension_l"]}, ["limits.frozen: toe_extension_l holds for the right"]),
        ({"pelvis_rx": [-3, 8]}, []),  # bending forwards is its own mirror image
        ({"pelvis_rz": [-3, 8]}, ["limits.pelvis_rz holds as -3 to 3 deg"]),
        ({"pelvis_tx": [-0.1, 0.3]}, ["limits.pelvis_tx holds as -0.1 to 0.1 m"]),
        (
            {"hip_flexion_r": [-20, 50], "hip_flexion_l": [-30, 40]},
            [f"limits.hip_flexion_{side} holds as -20 to 40 deg" for side in "rl"],
        ),
    ],
)
def test_a_limit_that_holds_for_the_other_side_says_so(limits, told):
    found = mirrored_limits(scenario(limits=limits))
    assert len(found) == len(told)
    for line, start in zip(found, told, strict=True):
        assert line.startswith(start)
        assert line.endswith("since steps are mirror images")
