import numpy as np
import pytest

from human_gait.body import skeleton


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
