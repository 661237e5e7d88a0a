import numpy as np
import pytest

from human_gait.body import skeleton
from human_gait.scenario import Subject


def test_the_branches_are_those_of_the_paper():
    sizes = {branch: len(members) for branch, members in skeleton.BRANCHES.items()}
    assert sizes == {
        "virtual": 6,
        "right_leg": 7,
        "left_leg": 7,
        "spine": 12,
        "right_arm": 9,
        "left_arm": 9,
        "head": 5,
    }
    in_order = [i for members in skeleton.BRANCHES.values() for i in members]
    assert in_order == list(range(55))


def test_limbs_and_spine_hang_on_the_pelvis_and_arms_and_head_on_the_thorax():
    for branch, members in skeleton.BRANCHES.items():
        root = {"virtual": 0, "right_leg": 6, "left_leg": 6, "spine": 6}.get(branch, 32)
        parents = [root, *(i + 1 for i in members[:-1])]
        assert [p + 1 for p in skeleton.PARENT[list(members)]] == parents


def test_index_is_the_place_in_the_order_and_refuses_unknown_names():
    assert [skeleton.index(name) for name in skeleton.DOF_NAMES] == list(range(55))
    with pytest.raises(ValueError, match="tail"):
        skeleton.index("tail")


def test_mirroring_twice_changes_nothing():
    q = np.random.default_rng(0).normal(size=(4, 55))
    np.testing.assert_array_equal(skeleton.mirror(skeleton.mirror(q)), q)


def test_mirroring_flips_what_leans_or_turns_and_keeps_what_flexes():
    flipped = {n for n, s in zip(skeleton.DOF_NAMES, skeleton.MIRROR_SIGN, strict=True) if s < 0}
    midline = {n for n in skeleton.DOF_NAMES if not n.endswith(("_r", "_l"))}
    lateral = {n for n in midline if n.endswith(("lateral", "rotation", "_tx", "_rz", "_ry"))}
    assert flipped == lateral


def test_limits_are_ordered_contain_upright_and_are_the_same_on_both_sides():
    lower, upper = skeleton.position_limits()
    assert np.all(lower < upper)
    assert np.all(lower <= 0)
    assert np.all(upper >= 0)
    limbs = [i for i in range(55) if skeleton.MIRROR_INDEX[i] != i]
    for limit in (lower, upper, *skeleton.torque_limits(Subject.default("male"))):
        np.testing.assert_array_equal(limit[limbs], skeleton.mirror(limit)[limbs])


def test_limits_are_in_radians():
    lower, upper = skeleton.position_limits()
    knee = skeleton.index("knee_flexion_r")
    assert (lower[knee], upper[knee]) == (0.0, pytest.approx(np.deg2rad(135)))


def test_only_the_global_dof_have_no_strength_limit():
    lower, upper = skeleton.torque_limits(Subject.default("male"))
    np.testing.assert_array_equal(np.isinf(lower), np.arange(55) < 6)
    np.testing.assert_array_equal(np.isinf(upper), np.arange(55) < 6)
    assert np.all(lower < 0)
    assert np.all(upper > 0)


def test_ankle_strength_scales_with_the_subject_and_exceeds_what_walking_takes():
    """Measured walking peaks at 1.4-1.6 N m/kg of plantarflexion."""
    ankle = skeleton.index("ankle_dorsiflexion_r")
    lower, _ = skeleton.torque_limits(Subject.default("male"))
    assert -lower[ankle] > 1.6 * 78.4
    heavier, _ = skeleton.torque_limits(Subject(sex="male", stature=1.755, mass=2 * 78.4))
    assert heavier[ankle] == pytest.approx(2 * lower[ankle])
