import numpy as np
import pytest
from walks import central_difference

from human_gait import data
from human_gait.body.limits import position_limits
from human_gait.body.skeleton import DOF_NAMES, index
from human_gait.dynamics.tissues import PassiveJoints, _kind

PASSIVE = PassiveJoints()


def torque_at(**degrees):
    """Torques at a posture at rest where the named joints are bent, [N m]."""
    q = np.zeros((1, 55))
    for name, value in degrees.items():
        q[0, index(name)] = np.deg2rad(value)
    return PASSIVE.torque(q, 0.0 * q).value[0]


def walking_range(n=4, seed=0):
    rng = np.random.default_rng(seed)
    lower, upper = position_limits()
    return rng.uniform(0.5 * lower, 0.5 * upper, (n, 55)), rng.uniform(-3, 3, (n, 55))


def test_partials_are_the_slopes():
    """Torques of some 1e2 N m: rounding over 1e-6 is 1e-8."""
    for q, v in zip(*walking_range(), strict=True):
        found = PASSIVE.torque(q[None], v[None]).partials[0]
        state = np.concatenate([q, v])
        slopes = central_difference(
            lambda x: PASSIVE.torque(x[None, :55], x[None, 55:]).value[0], state, np.eye(110)
        )
        np.testing.assert_allclose(found[:, :110], slopes, atol=1e-6 * np.abs(slopes).max())
        np.testing.assert_array_equal(found[:, 110:], 0.0)


def test_nothing_holds_the_body_in_space():
    q, v = walking_range()
    passive = PASSIVE.torque(q, v)
    np.testing.assert_array_equal(passive.value[:, :6], 0.0)
    np.testing.assert_array_equal(passive.partials[:, :6], 0.0)
    np.testing.assert_array_equal(passive.partials[..., :6], 0.0)


@pytest.mark.parametrize("side", "rl")
def test_tissue_brings_the_legs_back(side):
    """Stretched tissue pulls towards the middle: signs of Riener and Edrich's moments."""
    hip, knee, ankle = (
        f"{j}_{side}" for j in ("hip_flexion", "knee_flexion", "ankle_dorsiflexion")
    )
    assert torque_at(**{hip: -20})[index(hip)] > 5.0
    assert torque_at(**{hip: 90})[index(hip)] < -5.0
    assert torque_at(**{knee: -5})[index(knee)] > 5.0
    assert torque_at(**{knee: 120})[index(knee)] < -5.0
    assert torque_at(**{ankle: 25})[index(ankle)] < -5.0
    assert torque_at(**{ankle: -45})[index(ankle)] > 2.0


@pytest.mark.parametrize("joint", ["hip_flexion_r", "knee_flexion_l", "ankle_dorsiflexion_r"])
def test_elastic_moments_fall_as_the_joint_bends(joint):
    """A tissue resists more the further it is stretched."""
    low, high = {"hip": (-20, 90), "knee": (0, 120), "ankle": (-40, 25)}[joint.split("_")[0]]
    moments = [torque_at(**{joint: x})[index(joint)] for x in np.linspace(low, high, 20)]
    assert np.all(np.diff(moments) < 0.0)


def test_two_joint_muscles_couple_the_joints():
    """The calf, stretched over a straight knee, pulls the toes down; a bent knee lets it go."""
    ankle = index("ankle_dorsiflexion_r")
    straight = torque_at(ankle_dorsiflexion_r=15)
    bent = torque_at(ankle_dorsiflexion_r=15, knee_flexion_r=60)
    assert straight[ankle] < bent[ankle]
    hip = index("hip_flexion_r")
    hamstrings = torque_at(hip_flexion_r=80), torque_at(hip_flexion_r=80, knee_flexion_r=60)
    assert hamstrings[0][hip] < hamstrings[1][hip]


def test_the_legs_are_alike_and_do_not_touch_each_other():
    bent = {"hip_flexion": 20, "knee_flexion": 50, "ankle_dorsiflexion": 10}
    right, left = (torque_at(**{f"{j}_{s}": x for j, x in bent.items()}) for s in "rl")
    upright = torque_at()
    for joint in bent:
        r, l = index(f"{joint}_r"), index(f"{joint}_l")  # noqa: E741, the left one
        assert right[r] == pytest.approx(left[l], rel=1e-12)
        assert right[l] == pytest.approx(upright[l], rel=1e-12)


def test_motion_is_damped_and_not_driven():
    q, v = walking_range()
    power = (PASSIVE.torque(q, v).value - PASSIVE.torque(q, 0.0 * v).value) * v
    assert np.all(power[:, 6:] < 0.0)


def test_the_other_joints_are_springs():
    """Zero at rest, towards rest anywhere else."""
    legs = ("hip_flexion", "knee_flexion", "ankle_dorsiflexion")
    springs = [i for i, name in enumerate(DOF_NAMES) if i >= 6 and not name.startswith(legs)]
    for away in (0.1, -0.1):
        q = (PASSIVE.rest + away)[None]
        assert np.all(PASSIVE.torque(q, 0.0 * q).value[0, springs] * away < 0.0)
    rest = PASSIVE.torque(PASSIVE.rest[None], np.zeros((1, 55))).value[0, springs]
    np.testing.assert_allclose(rest, 0.0, atol=1e-15)


def test_every_row_names_a_joint_and_every_joint_has_a_row():
    rows = data.rows("passive_joints")
    joints = [row["joint"] for row in rows]
    assert len(set(joints)) == len(joints)
    assert set(joints) == {_kind(name) for name in DOF_NAMES[6:]}
    assert all(row["source"] for row in rows)
    assert all(float(row[key]) >= 0.0 for row in rows for key in ("stiffness", "damping"))
