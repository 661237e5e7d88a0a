"""Parts of the drawn body in each other: which, how deep and when."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from walking import guessed_gait

from human_gait.body.dh import frames
from human_gait.body.person import make_body
from human_gait.body.skeleton import DOF_NAMES, index
from human_gait.checks import limbs
from human_gait.checks.check import Kind
from human_gait.scenario import Load, Subject

BODY = guessed_gait().body
NOW = guessed_gait().fine_samples


def found(n=5, **angles):
    """What is in what in a posture, that is taken at the last of n instants."""
    q = np.zeros((n, len(DOF_NAMES)))
    q[:, index("shoulder_abduction_r")] = q[:, index("shoulder_abduction_l")] = np.deg2rad(15.0)
    for name, degrees in angles.items():
        q[-1, index(name)] = np.deg2rad(degrees)
    now = replace(NOW, q=q, t=np.linspace(0.0, 0.5, n))
    return {one.parts: one for one in limbs.overlaps(BODY, now)}


def test_arms_held_away_touch_nothing():
    assert found() == {}


@pytest.mark.parametrize(
    ("angles", "parts"),
    [
        ({"shoulder_abduction_r": -20.0}, ("right forearm", "trunk")),
        ({"shoulder_abduction_l": -20.0}, ("left forearm", "trunk")),
        ({"hip_abduction_r": -15.0}, ("right thigh", "left thigh")),
        ({"hip_abduction_r": -8.0}, ("left shank", "right shank")),
        ({"hip_abduction_l": -15.0}, ("left foot", "right foot")),
        ({"hip_abduction_l": -15.0}, ("left foot", "right shank")),
    ],
)
def test_parts_that_are_turned_into_each_other_are_told(angles, parts):
    there = found(**angles)
    (one,) = [one for name, one in there.items() if set(name) == set(parts)]
    assert one.depth > limbs._DEEP
    assert one.time == 0.5
    assert str(one).startswith(" in ".join(one.parts))


def test_a_box_in_the_way_of_the_arms_is_told():
    """Its edge is 5 cm inside of the forearm's axis, or far behind it."""
    q = np.zeros((1, len(DOF_NAMES)))
    now = replace(NOW, q=q, t=np.zeros(1))
    wide = Load(mass=5.0, position=(0.0, -0.1, 0.0), size=(0.5, 0.2, 0.2))
    told = {one.parts: one.depth for one in limbs.overlaps(make_body(Subject.default(), wide), now)}
    radius = max(
        shape
        for shape, part in zip(
            limbs.shapes_of(BODY).radius, limbs.shapes_of(BODY).part, strict=True
        )
        if part == "left upper arm"
    )
    assert told["left upper arm", "load"] == pytest.approx(told["right upper arm", "load"])
    assert radius < told["left upper arm", "load"] < radius + 0.1
    behind = Load(mass=5.0, position=(0.0, 0.05, -0.5))
    there = limbs.overlaps(make_body(Subject.default(), behind), now)
    assert not [one for one in there if "load" in one.parts]
    weightless = limbs.overlaps(make_body(Subject.default(), replace(wide, mass=0.0)), now)
    assert not [one for one in weightless if "load" in one.parts]


def test_a_heavy_person_is_deeper_in_himself():
    heavy = make_body(Subject(sex="male", stature=1.755, mass=120.0))
    usual, wide = (limbs.overlaps(body, NOW)[0].depth for body in (BODY, heavy))
    assert wide > usual + 0.005


def test_the_shapes_are_where_the_urdf_has_them():
    """Its cylinders, placed by Pinocchio, are the axes of the shapes."""
    model, data = BODY.model, BODY.model.createData()
    visuals = pin.buildGeomFromUrdfString(model, BODY.urdf, pin.GeometryType.VISUAL)
    drawn = [one for one in visuals.geometryObjects if isinstance(one.geometry, pin.coal.Cylinder)]
    q = NOW.q[30]
    pin.forwardKinematics(model, data, q)
    middles = np.array([(data.oMi[one.parentJoint] * one.placement).translation for one in drawn])
    shapes = limbs.shapes_of(BODY)
    start, along = limbs._placed(frames(BODY.table, q[None])[1], shapes)
    assert len(middles) == len(shapes.part)
    np.testing.assert_allclose((start + along / 2)[0], middles, atol=1e-9)


def test_parts_that_are_joined_are_in_each_other_and_not_told():
    told = {frozenset(parts) for parts in found(elbow_flexion_r=120.0, knee_flexion_l=120.0)}
    assert not told & {frozenset(pair) for pair in limbs._NEIGHBOURS}


def test_the_distance_is_that_of_the_nearest_points():
    rng = np.random.default_rng(3)
    p, u, q, v = (rng.normal(size=(4, 50, 3)) for _ in range(4))
    u[0, 0], v[0, 0] = [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]  # parallel
    share = np.linspace(0.0, 1.0, 201)[:, None]
    one, other = (x[..., None, :] + share * y[..., None, :] for x, y in ((p, u), (q, v)))
    tried = np.linalg.norm(one[..., :, None, :] - other[..., None, :, :], axis=-1).min(axis=(2, 3))
    nearest = limbs._apart(*(x.T for x in (p, u, q, v))).T
    assert np.all(nearest <= tried + 1e-12)
    assert np.all(tried - nearest < 0.02)


def test_it_is_told_how_deep_they_are_at_rest():
    deep = found(elbow_flexion_r=30.0, shoulder_abduction_r=-10.0)["right forearm", "trunk"]
    (rest,) = (d for p, d in limbs._depths(BODY, np.zeros((1, 55))).items() if p == deep.parts)
    assert deep.rest == pytest.approx(rest.item())
    assert deep.deeper == pytest.approx(deep.depth - deep.rest)
    assert f"(at rest {1e3 * deep.rest:.0f})" in str(deep)
    apart = found(hip_abduction_r=-15.0)["left thigh", "right thigh"]
    assert apart.rest == 0.0
    assert "at rest" not in str(apart)


def judged(**angles):
    """The checks of a posture, of a scenario that holds limbs apart."""
    gait = guessed_gait()
    gait = replace(gait, scenario=gait.scenario.replace({"posture.limbs": "apart"}))
    q = np.zeros((1, len(DOF_NAMES)))
    for name, degrees in angles.items():
        q[0, index(name)] = np.deg2rad(degrees)
    return limbs.limbs_checks(gait, replace(NOW, q=q, t=np.zeros(1)))


def test_where_limbs_are_held_apart_it_is_judged_against_rest():
    _, upright = judged()
    assert (upright.name, upright.value, upright.verdict) == (limbs.DEEPER.name, 0.0, "ok")
    note, crossed = judged(hip_abduction_r=-15.0, hip_abduction_l=-15.0)
    assert (note.verdict, crossed.verdict) == ("note", "FAIL")
    assert "thigh" in crossed.what
    assert crossed.value == max(one.deeper for one in limbs.overlaps(BODY, guessed_at(-15.0)))
    _, slightly = judged(hip_abduction_r=-3.0)
    assert 0.0 < slightly.value < slightly.limit
    assert slightly.passed


def guessed_at(degrees):
    q = np.zeros((1, len(DOF_NAMES)))
    q[0, [index("hip_abduction_r"), index("hip_abduction_l")]] = np.deg2rad(degrees)
    return replace(NOW, q=q, t=np.zeros(1))


def test_it_is_a_note_with_the_deepest_pair_first():
    (check,) = limbs.limbs_checks(guessed_gait(), NOW)
    pairs = limbs.overlaps(BODY, NOW)
    assert (check.kind, check.verdict, check.passed) == (Kind.NOTE, "note", True)
    assert check.value == pairs[0].depth == max(one.depth for one in pairs)
    assert check.what.startswith(str(pairs[0]))


def test_every_capsule_that_is_drawn_belongs_to_a_part():
    shapes = limbs.shapes_of(BODY)
    sides = {part.split()[0] for part in shapes.part} - {"trunk", "head"}
    assert sides == {"right", "left"}
    assert len(set(shapes.part)) == 14
    assert all(len(array) == len(shapes.part) for array in (shapes.start, shapes.radius))
