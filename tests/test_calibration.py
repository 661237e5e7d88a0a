"""What the script on calibrated sizes tells, without the walks that it predicts."""

from dataclasses import replace

import numpy as np
import pytest
from walking import guessed_gait

from benchmarks.calibration import (
    FALISSE,
    TARGETS,
    calibrated,
    facts,
    hand_beside,
    on_bounds,
    push_off,
    stiffness,
)
from human_gait import data
from human_gait.body.limits import joint_limits
from human_gait.body.skeleton import DOF_NAMES, index
from human_gait.dynamics.tissues import PassiveJoints
from human_gait.people.reference import references
from human_gait.settings.records import all_settings

GAIT = guessed_gait()


def turned(joint, turn):
    """A walk in which a joint of both sides is turned otherwise."""
    points = GAIT.control_points.copy()
    points[:, [index(f"{joint}_r"), index(f"{joint}_l")]] += turn
    return replace(GAIT, control_points=points)


def test_every_size_that_says_calibrated_is_listed_once_with_its_value():
    listed = {key: value for key, value, _ in calibrated(GAIT.scenario)}
    settings = {one.dotted for one in all_settings() if "calibrated" in one.source}
    rows = [row for row in data.rows("passive_joints") if "calibrated" in row["measured_source"]]
    assert listed.keys() == settings | {row["joint"] for row in rows}
    assert listed["objective.knee"] == repr(GAIT.scenario.objective.knee)


def test_every_target_is_of_a_curve_that_was_measured():
    assert {(one.name, curve) for one in references() for curve in one.curves} >= TARGETS.keys()


def test_people_are_within_what_is_to_be_reached():
    falisse = next(one for one in references() if one.name == FALISSE)
    cycle = {name: curve.mean for name, curve in falisse.curves.items()}
    known = facts(GAIT)
    _, low, high = known[next(name for name in known if "push-off" in name)]
    assert low <= push_off(cycle) <= high


def test_push_off_is_half_way_down():
    ankle = np.interp(np.arange(101), [0, 50, 70, 100], [0.0, 12.0, -18.0, 0.0])
    assert push_off({"ankle_dorsiflexion_deg": ankle}) == pytest.approx(60)


@pytest.mark.parametrize("name", ["spine_rotation", "hip_rotation"])
def test_a_joint_is_as_stiff_as_it_was_given_and_only_for_so_long(name):
    before = PassiveJoints("measured").stiffness
    with stiffness(name, "123"):
        given = PassiveJoints("measured").stiffness
    changed = np.flatnonzero(given != before)
    kind, _, axis = name.partition("_")
    alike = [i for i, dof in enumerate(DOF_NAMES) if dof.startswith(kind) and axis in dof]
    np.testing.assert_array_equal(changed, alike)
    np.testing.assert_array_equal(given[changed], 123)
    np.testing.assert_array_equal(PassiveJoints("measured").stiffness, before)


def test_an_arm_that_is_lifted_to_the_side_takes_the_hand_there():
    assert hand_beside(turned("shoulder_abduction", np.deg2rad(30))) > hand_beside(GAIT) + 20


def test_a_joint_that_is_at_its_limit_is_told():
    _, upper = joint_limits(GAIT.scenario)
    elbow = index("elbow_flexion_r")
    bent = upper[elbow] - 5e-4 - GAIT.q([0.0])[0, elbow]
    elbows = {"elbow_flexion_r", "elbow_flexion_l"}
    assert elbows.isdisjoint(on_bounds(GAIT))
    assert elbows <= set(on_bounds(turned("elbow_flexion", bent)))
