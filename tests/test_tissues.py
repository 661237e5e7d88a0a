import numpy as np
import pytest
from walks import central_difference

from human_gait import data
from human_gait.body.limits import position_limits
from human_gait.body.skeleton import DOF_NAMES, index
from human_gait.dynamics.tissues import PassiveJoints

ENDS = ("flexion", "lateral", "rotation")  # of the names of the spine's DOF


@pytest.fixture(params=["tissue", "measured"], scope="module")
def passive(request):
    return PassiveJoints(request.param)


@pytest.fixture(scope="module")
def torque_at(passive):
    """Torques at a posture at rest where the named joints are bent, [N m]."""

    def at(**degrees):
        q = np.zeros((1, 55))
        for name, value in degrees.items():
            q[0, index(name)] = np.deg2rad(value)
        return passive.torque(q, 0.0 * q).value[0]

    return at


def walking_range(n=4, seed=0):
    rng = np.random.default_rng(seed)
    lower, upper = position_limits()
    return rng.uniform(0.5 * lower, 0.5 * upper, (n, 55)), rng.uniform(-3, 3, (n, 55))


def partials(passive, q, v):
    """Of all torques (55, 110) by q and v, one torque after the other."""
    every = np.repeat([q, v], 55, axis=0).reshape(2, 55, 55)
    return np.concatenate(passive.torque(*every).gradient(np.eye(55)), axis=1)


def test_partials_are_the_slopes(passive):
    """Torques of some 1e2 N m: rounding over 1e-6 is 1e-8."""
    for q, v in zip(*walking_range(), strict=True):
        found = partials(passive, q, v)
        state = np.concatenate([q, v])
        slopes = central_difference(
            lambda x: passive.torque(x[None, :55], x[None, 55:]).value[0], state, np.eye(110)
        )
        np.testing.assert_allclose(found, slopes, atol=1e-6 * np.abs(slopes).max())


def test_nothing_holds_the_body_in_space(passive):
    q, v = (x[0] for x in walking_range())
    np.testing.assert_array_equal(passive.torque(q[None], v[None]).value[:, :6], 0.0)
    found = partials(passive, q, v).reshape(55, 2, 55)
    np.testing.assert_array_equal(found[:6], 0.0)
    np.testing.assert_array_equal(found[..., :6], 0.0)


@pytest.mark.parametrize("side", "rl")
def test_tissue_brings_the_legs_back(torque_at, side):
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
def test_elastic_moments_fall_as_the_joint_bends(torque_at, joint):
    """A tissue resists more the further it is stretched."""
    low, high = {"hip": (-20, 90), "knee": (0, 120), "ankle": (-40, 25)}[joint.split("_")[0]]
    moments = [torque_at(**{joint: x})[index(joint)] for x in np.linspace(low, high, 20)]
    assert np.all(np.diff(moments) < 0.0)


def test_two_joint_muscles_couple_the_joints(torque_at):
    """The calf, stretched over a straight knee, pulls the toes down; a bent knee lets it go."""
    ankle = index("ankle_dorsiflexion_r")
    straight = torque_at(ankle_dorsiflexion_r=15)
    bent = torque_at(ankle_dorsiflexion_r=15, knee_flexion_r=60)
    assert straight[ankle] < bent[ankle]
    hip = index("hip_flexion_r")
    hamstrings = torque_at(hip_flexion_r=80), torque_at(hip_flexion_r=80, knee_flexion_r=60)
    assert hamstrings[0][hip] < hamstrings[1][hip]


def test_the_legs_are_alike_and_do_not_touch_each_other(torque_at):
    bent = {"hip_flexion": 20, "knee_flexion": 50, "ankle_dorsiflexion": 10}
    right, left = (torque_at(**{f"{j}_{s}": x for j, x in bent.items()}) for s in "rl")
    upright = torque_at()
    for joint in bent:
        r, l = index(f"{joint}_r"), index(f"{joint}_l")  # noqa: E741, the left one
        assert right[r] == pytest.approx(left[l], rel=1e-12)
        assert right[l] == pytest.approx(upright[l], rel=1e-12)


def test_motion_is_damped_and_not_driven(passive):
    q, v = walking_range()
    power = (passive.torque(q, v).value - passive.torque(q, 0.0 * v).value) * v
    assert np.all(power[:, 6:] < 0.0)


def test_the_other_joints_are_springs(passive):
    """Zero at rest, towards rest anywhere else."""
    legs = ("hip_flexion", "knee_flexion", "ankle_dorsiflexion")
    springs = [i for i, name in enumerate(DOF_NAMES) if i >= 6 and not name.startswith(legs)]
    for away in (0.1, -0.1):
        q = (passive.rest + away)[None]
        assert np.all(passive.torque(q, 0.0 * q).value[0, springs] * away < 0.0)
    rest = passive.torque(passive.rest[None], np.zeros((1, 55))).value[0, springs]
    np.testing.assert_allclose(rest, 0.0, atol=1e-15)


def test_every_row_names_joints_and_every_joint_has_a_row():
    """A row stands for one joint, or for all of a kind that have none: no side, no number."""
    rows = data.rows("passive_joints")
    joints = [row["joint"] for row in rows]
    assert len(set(joints)) == len(joints)
    own = {name.removesuffix("_r").removesuffix("_l") for name in DOF_NAMES[6:]}
    kinds = {name: "".join(sign for sign in name if not sign.isdigit()) for name in own}
    assert set(joints) <= own | set(kinds.values())
    assert {name for name in own if not {name, kinds[name]} & set(joints)} == set()
    assert all(row["source"] for row in rows)
    given = [key for key in rows[0] if key.endswith(("stiffness", "damping"))]
    assert len(given) == 4
    assert all(float(row[key]) >= 0.0 for row in rows for key in given)


def test_the_measured_spine_is_stiffer_and_most_of_all_against_turning():
    soft, stiff = PassiveJoints("tissue").stiffness, PassiveJoints("measured").stiffness
    spine = [i for i, name in enumerate(DOF_NAMES) if name.startswith("spine")]
    assert np.all(stiff[spine] >= soft[spine])
    of = {key: stiff[[i for i in spine if DOF_NAMES[i].endswith(key)]] for key in ENDS}
    assert of["rotation"].min() > of["flexion"].max()


def test_second_derivatives_of_squares_are_products_of_partials(passive):
    """J^T w J: of single joints, and what couples joints of the legs."""
    q, v = (x[0] for x in walking_range())
    weights, by_state = np.random.default_rng(1).uniform(1, 2, 55), partials(passive, q, v)
    own, lower = np.zeros((1, 3, 55)), np.zeros((3, 1, 20, 20))
    passive.torque(q[None], v[None]).add_squares(weights[None], own, lower)
    qq, qv, vv = (np.diag(part) for part in own[0])
    for part, block in zip((qq, qv, vv), lower[:, 0], strict=True):
        part[:20, :20] += block
    found = np.block([[qq, qv], [qv.T, vv]])
    expected = by_state.T @ (weights[:, None] * by_state)
    np.testing.assert_allclose(found, expected, atol=1e-13 * np.abs(expected).max())
