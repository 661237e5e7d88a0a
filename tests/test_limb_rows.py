"""Limbs are held apart: how deep they are by postures made by hand, against the drawn body."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from walks import central_difference, scenario

from human_gait.body.person import make_body
from human_gait.body.skeleton import index, mirror
from human_gait.checks import limbs as drawn
from human_gait.dynamics.inverse_dynamics import ENGINES, make_dynamics
from human_gait.problem.limb_rows import LIMBS_APART, limbs_apart
from human_gait.problem.program import build_program
from human_gait.scenario import Subject
from human_gait.walk.instant import Walker
from human_gait.walk.limb_shapes import LIMBS, PAIRS
from human_gait.walk.limbs import Limbs

PEOPLE = {
    "man": Subject.default("male"),
    "woman": Subject.default("female"),
    "heavy man": Subject(sex="male", stature=1.755, mass=120.0),
    "heavy woman": Subject(sex="female", stature=1.62, mass=100.0),
    "light man": Subject(sex="male", stature=1.9, mass=60.0),
    "light woman": Subject(sex="female", stature=1.5, mass=42.0),
}
TASK = scenario(posture={"limbs": "apart"})
WALKER = Walker(TASK)
CROSSED = {  # degrees, and the limb that is in another
    "right hand": {"shoulder_abduction_r": -10.0, "shoulder_flexion_r": 8.0},
    "left hand": {"shoulder_abduction_l": -10.0, "shoulder_flexion_l": 8.0},
    "right forearm": {"shoulder_abduction_r": -15.0, "elbow_flexion_r": 40.0},
    "left forearm": {"shoulder_abduction_l": -15.0, "elbow_flexion_l": 40.0},
    "thighs": {"hip_abduction_r": -8.0},
    "lower legs": {"hip_abduction_l": -8.0, "knee_flexion_l": 20.0},
}


def posture(**degrees):
    q = np.zeros(55)
    for name, angle in degrees.items():
        q[index(name)] = np.deg2rad(angle)
    return q


def rows(q, task=TASK, walker=WALKER):
    """How far the rows of each limb are beyond what is allowed in one posture, by limb."""
    constraint = limbs_apart(task, np.zeros(1))
    still = np.zeros((1, 55))
    found = constraint.evaluate(walker.at(np.zeros(1), q[None], still, still))
    return dict(zip(constraint.what, found.value - constraint.upper, strict=True))


def deeper(body, q):
    """How much deeper than at rest the drawn parts of each limb are in others, 0 if apart."""
    depths, rest = (
        {frozenset(parts): d[0] for parts, d in drawn._depths(body, one[None]).items()}
        for one in (q, np.zeros(55))
    )
    return {
        limb: max(depths[frozenset(pair)] - max(rest[frozenset(pair)], 0.0) for pair in pairs)
        for limb, pairs in LIMBS.items()
    }


def moved(limbs, body, q, engine="pinocchio"):
    """How deep limbs are in one posture, and its axes."""
    now = _dynamics(body, engine).inverse(q[None], *np.zeros((2, 1, 55)))
    return limbs.depths(now.link_poses, now.axes), now.axes


_dynamics = cache(make_dynamics)


def near(seed, n=3):
    """Postures in which all limbs are near others."""
    rng = np.random.default_rng(seed)
    q = posture(hip_abduction_r=-4.0, hip_abduction_l=-4.0, elbow_flexion_r=15.0)
    return q + rng.uniform(-0.15, 0.15, (n, 55))


@pytest.mark.parametrize("subject", PEOPLE.values(), ids=PEOPLE)
def test_who_stands_with_hanging_arms_keeps_the_rows(subject):
    task = replace(TASK, subject=subject)
    assert all(value < 0.0 for value in rows(np.zeros(55), task, Walker(task)).values())


@pytest.mark.parametrize("limb", CROSSED)
def test_a_limb_in_another_is_told_by_its_name(limb):
    beyond = rows(posture(**CROSSED[limb]))
    assert beyond[limb] > 0.01
    other = {"right": "left", "left": "right"}.get(limb.split()[0], "right")
    assert all(value < 0.0 for name, value in beyond.items() if name.startswith(other))


def test_arms_held_away_are_as_far_as_is_seen():
    q = posture(shoulder_abduction_r=80.0, shoulder_abduction_l=80.0)
    beyond, tolerance = rows(q), TASK.tolerances.limbs_apart
    assert beyond["right hand"] == pytest.approx(-0.2 - 0.2 * tolerance)


def test_where_nothing_is_near_nothing_depends_on_the_posture():
    body = make_body(Subject.default())
    limbs = Limbs(body, 1e-4, 0.001, 0.0)
    joints = "shoulder_abduction", "hip_abduction"
    wide = {f"{joint}_{side}": 40.0 for joint in joints for side in "rl"}
    found, axes = moved(limbs, body, posture(**wide))
    assert np.all(found.value == pytest.approx(-0.001))
    assert not found.dq.any()
    assert not limbs.hessian(found, axes, np.ones((1, len(LIMBS)))).any()


@pytest.mark.parametrize("subject", PEOPLE.values(), ids=PEOPLE)
def test_they_are_as_deep_as_the_drawn_body(subject):
    """But for what beads miss and what the smooth maximum adds, 1 mm times ln(10) or so."""
    body = make_body(subject)
    limbs = Limbs(body, 0.001, 0.05, 0.0)
    for q in near(1, 10):
        found, expected = moved(limbs, body, q)[0].value[0], deeper(body, q)
        for value, (limb, depth) in zip(found, expected.items(), strict=True):
            if -0.01 < depth < 0.03:
                assert -0.002 < value - depth < 0.003, limb


def test_the_other_side_is_the_mirror_image():
    q = near(2)[0]
    body = make_body(Subject.default())
    limbs = Limbs(body, 0.001, 0.05, 0.0)
    here, there = (moved(limbs, body, x)[0].value[0] for x in (q, mirror(q)))
    here, there = (dict(zip(LIMBS, value, strict=True)) for value in (here, there))
    for part in ("hand", "forearm"):
        assert here[f"right {part}"] == pytest.approx(there[f"left {part}"], abs=1e-9)
        assert here[f"left {part}"] == pytest.approx(there[f"right {part}"], abs=1e-9)
    for limb in ("thighs", "lower legs"):  # beads and capsules change sides
        assert here[limb] == pytest.approx(there[limb], abs=2e-3)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("which", range(len(LIMBS)), ids=LIMBS)
def test_derivatives_are_those_of_differences(engine, which):
    """Beta times the step, 1e-3, is what the second differences are off: squared, 1e-6."""
    body = make_body(Subject.default("female"))
    limbs = Limbs(body, 0.001, 0.05, 0.0)
    weight = np.zeros((1, len(LIMBS)))
    weight[0, which] = 1.0
    noise = np.random.default_rng(which).uniform(-0.05, 0.05, 55)
    q, along = (
        posture(**CROSSED[[*LIMBS][which]]) / 2 + noise,
        np.random.default_rng(which + 9).normal(size=(55, 5)),
    )
    found, axes = moved(limbs, body, q, engine)
    assert found.value[0, which] > -0.02
    slopes = central_difference(
        lambda x: moved(limbs, body, x, engine)[0].value[0, which], q, along
    )
    moving = along[limbs.dofs]
    np.testing.assert_allclose(
        found.dq[0, which] @ moving, slopes, atol=1e-6 * np.abs(slopes).max()
    )
    second = limbs.hessian(found, axes, weight)[0]
    curves = central_difference(lambda x: moved(limbs, body, x, engine)[0].dq[0, which], q, along)
    np.testing.assert_allclose(second @ moving, curves, atol=1e-5 * np.abs(curves).max())


def test_no_limb_depends_on_where_the_body_is():
    limbs = Limbs(make_body(Subject.default()), 0.001, 0.05, 0.0)
    assert limbs.dofs.start >= 6


def test_a_bead_on_the_very_axis_has_finite_derivatives():
    """The thighs, both hips turned until their axes cross."""
    body = make_body(Subject.default())
    limbs = Limbs(body, 0.001, 0.05, 0.0)
    found, axes = moved(limbs, body, posture(hip_abduction_r=-40.0, hip_abduction_l=-40.0))
    second = limbs.hessian(found, axes, np.ones((1, len(LIMBS))))
    assert np.isfinite(found.dq).all()
    assert np.isfinite(second).all()


def test_a_tolerance_lets_limbs_be_deeper():
    wide = TASK.replace({"tolerances.limbs_apart": 0.2})
    crossed = posture(**CROSSED["thighs"])
    assert rows(crossed, wide, Walker(wide))["thighs"] < 0.0 < rows(crossed)["thighs"]


def test_who_does_not_ask_for_it_has_no_such_rows():
    names = {
        limbs: [c.demand for c in build_program(TASK.replace({"posture.limbs": limbs})).constraints]
        for limbs in ("apart", "free")
    }
    assert LIMBS_APART in names["apart"]
    assert LIMBS_APART not in names["free"]
    assert scenario().posture.limbs == "free"


def test_rows_are_at_all_instants_and_depend_on_no_more_than_moves_them():
    constraint = limbs_apart(TASK, np.zeros(4))
    assert len(constraint.lower) == 4 * len(LIMBS)
    np.testing.assert_array_equal(np.bincount(constraint.instants), len(LIMBS))
    assert all(len(set(columns)) == constraint.columns.shape[1] for columns in constraint.columns)
    assert constraint.columns.shape[1] < 30


def test_every_pair_is_of_parts_that_are_not_joined():
    assert not {frozenset(pair) for pair in PAIRS} & {frozenset(n) for n in drawn._NEIGHBOURS}
    assert len({frozenset(pair) for pair in PAIRS}) == len(PAIRS)
