"""Work, metabolic rate, lower back and share of strength, by what mechanics says of them."""

import json
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from solves import solved
from walking import guessed_gait

import human_gait as hg
from human_gait import console, data
from human_gait.body.limits import torque_limits
from human_gait.body.skeleton import DOF_NAMES, MIRROR_INDEX, index, mirror
from human_gait.checks.engines import DrakeEngine
from human_gait.checks.laws import loads_of
from human_gait.walk.energy import headline
from human_gait.walk.gait import Samples
from human_gait.walk.gait_cycle import gait_cycle
from human_gait.walk.joint_work import JOINTS, LEG, joint_power, joint_work
from human_gait.walk.metabolic import (
    ERROR,
    FIBRE_WORK,
    STANDING_RATE,
    TORQUE_HEAT,
    fibre_work,
    metabolic_rate,
)
from human_gait.walk.strain import spine_moments, strength_shares

GAIT = guessed_gait()
LADEN = guessed_gait(18.0)
NOW = GAIT.fine_samples
SUBJECT, MASS = GAIT.scenario.subject, GAIT.scenario.subject.mass
TENDON = GAIT.scenario.objective.tendon_stiffness
NEWTON = SimpleNamespace(solver="newton", cost=1.0, wall_time=1.0)


def samples(t, **given):
    """Samples in which nothing happens but what is given."""
    shapes = {item.name: getattr(NOW, item.name).shape[1:] for item in fields(Samples)}
    still = {name: np.zeros((len(t), *shape)) for name, shape in shapes.items()}
    return Samples(**still | {"t": t} | given)


def of_dof(t, name, curve):
    values = np.zeros((len(t), 55))
    values[:, index(name)] = curve
    return values


# Work


def test_every_joint_has_its_degrees_of_freedom_and_each_counts_once():
    counted = np.concatenate(list(JOINTS.values()))
    assert sorted(counted) == list(range(6, 55))
    for dofs in JOINTS.values():
        assert set(MIRROR_INDEX[dofs]) == set(dofs)


@pytest.mark.parametrize("gait", [GAIT, LADEN], ids=["alone", "laden"])
def test_what_the_joints_give_the_ground_takes_in_a_periodic_step_on_the_level(gait):
    now, found = gait.fine_samples, hg.energy(gait)
    moved = DrakeEngine(gait.body).mechanics((now.q, now.v, now.a), loads_of(gait, now))
    ground = np.trapezoid(moved.loads_power.sum(axis=1), now.t)
    work = found.positive_work + found.negative_work
    assert abs(work) > 1e-3 * found.positive_work
    assert work == pytest.approx(-ground, abs=2e-4 * found.positive_work)


def test_positive_and_negative_work_add_up_to_the_net_work_of_each_joint():
    power = joint_power(NOW)
    for one in joint_work(NOW):
        net = np.trapezoid(power[:, JOINTS[one.joint]].sum(axis=1), NOW.t)
        assert one.negative <= 0 <= one.positive
        assert one.positive + one.negative == pytest.approx(net)


def test_work_is_that_of_moments_and_angles():
    """A joint that turns by a radian against 3 N m and back has taken and given 3 J."""
    t = np.linspace(0, 1, 1001)
    angle = (1 - np.cos(2 * np.pi * t)) / 2
    v, tau = of_dof(t, "knee_flexion_l", np.gradient(angle, t)), of_dof(t, "knee_flexion_l", -3.0)
    knee = {one.joint: one for one in joint_work(samples(t, v=v, tau=tau))}["knee"]
    assert knee.positive == pytest.approx(3, rel=1e-3)
    assert knee.negative == pytest.approx(-3, rel=1e-3)


@pytest.mark.solve
def test_integrals_of_a_walk_no_longer_change_on_a_finer_grid():
    gait = solved("preferred").gait
    found, finer = hg.energy(gait), gait.step_samples(np.linspace(0, gait.step_time, 1601))
    work = sum(one.positive for one in joint_work(finer))
    assert found.positive_work == pytest.approx(work, rel=1e-3)
    rate = metabolic_rate(finer, SUBJECT, TENDON)
    assert found.metabolic.heat == pytest.approx(rate.heat, rel=1e-3)
    assert found.metabolic.work == pytest.approx(rate.work, rel=1e-3)


def test_shares_of_the_leg_add_up_to_one():
    found = hg.energy(GAIT)
    shares = np.array([found.share_of_leg(joint) for joint in LEG])
    np.testing.assert_allclose(shares.sum(axis=0), 1)
    hip, _, ankle = (one for one in found.joints if one.joint in LEG)
    assert shares[0, 0] / shares[2, 0] == pytest.approx(hip.positive / ankle.positive)
    with pytest.raises(KeyError):
        found.share_of_leg("spine")


# Metabolic rate


def test_the_tendon_is_that_of_the_scenario():
    changed = GAIT.scenario.replace({"objective.tendon_stiffness": 2 * TENDON})
    stiffer = hg.energy(replace(GAIT, scenario=changed)).metabolic
    assert stiffer == metabolic_rate(NOW, SUBJECT, 2 * TENDON)
    assert stiffer.work != hg.energy(GAIT).metabolic.work


def test_who_needs_no_torque_takes_what_standing_takes():
    rate = metabolic_rate(samples(NOW.t, q=NOW.q, v=NOW.v), SUBJECT, TENDON)
    assert rate.gross == rate.standing == pytest.approx(MASS * STANDING_RATE)
    assert rate.net == 0


def test_a_torque_that_is_held_costs_heat_with_the_square_of_its_size():
    t = np.linspace(0, 0.5, 51)
    rates = [
        metabolic_rate(samples(t, active=of_dof(t, "hip_flexion_r", size)), SUBJECT, TENDON)
        for size in (10.0, -20.0)
    ]
    strength = MASS * 9.81 * SUBJECT.stature
    heats = [TORQUE_HEAT * size**2 / strength for size in (10, 20)]
    assert [rate.heat for rate in rates] == pytest.approx(heats)
    assert [rate.work for rate in rates] == [0, 0]


def test_who_is_twice_as_heavy_and_as_strong_takes_as_much_per_kilogram():
    twice = replace(SUBJECT, mass=2 * MASS)
    heavy = metabolic_rate(replace(NOW, active=2 * NOW.active), twice, 2 * TENDON)
    assert heavy.gross / 2 == pytest.approx(metabolic_rate(NOW, SUBJECT, TENDON).gross)


def test_only_muscles_are_paid_for():
    """The net torque has tissue in it; what tissue holds costs nothing."""
    rate = metabolic_rate(NOW, SUBJECT, TENDON)
    assert metabolic_rate(replace(NOW, tau=5 * NOW.tau), SUBJECT, TENDON) == rate
    stronger = metabolic_rate(replace(NOW, active=1.1 * NOW.active), SUBJECT, TENDON)
    assert stronger.heat == pytest.approx(1.21 * rate.heat)


def test_of_the_work_of_fibres_the_positive_is_paid_for():
    t = np.linspace(0, 1, 101)
    turn = of_dof(t, "knee_flexion_l", (1 - np.cos(2 * np.pi * t)) / 2)  # a radian and back
    held = of_dof(t, "knee_flexion_l", 3.0)
    assert metabolic_rate(samples(t, q=turn, active=held), SUBJECT, TENDON).work == pytest.approx(
        3 * FIBRE_WORK
    )


def test_fibres_that_hold_while_the_tendon_gives_way_do_no_work():
    t = np.linspace(0, 0.5, 51)
    torque = 100 * np.sin(2 * np.pi * t) ** 2
    moved = {"q": of_dof(t, "ankle_dorsiflexion_r", -torque / TENDON)}
    ankle = samples(t, active=of_dof(t, "ankle_dorsiflexion_r", torque), **moved)
    np.testing.assert_allclose(fibre_work(ankle, TENDON), 0, atol=1e-12)
    elsewhere = {"q": of_dof(t, "knee_flexion_r", -torque / TENDON)}
    knee = samples(t, active=of_dof(t, "knee_flexion_r", torque), **elsewhere)
    assert metabolic_rate(knee, SUBJECT, TENDON).work > 10
    assert metabolic_rate(ankle, SUBJECT, 2 * TENDON).work > 5


@pytest.mark.parametrize("gait", [GAIT, LADEN], ids=["alone", "laden"])
def test_a_tendon_gives_back_what_it_has_taken_up_over_a_step(gait):
    """All work of fibres is that of muscles, though not at the same time."""
    now = gait.fine_samples
    muscles = np.trapezoid((now.active * now.v)[:, 6:].sum(axis=1), now.t)
    fibres = fibre_work(now, TENDON)[:, 6:]
    assert fibres.sum() == pytest.approx(muscles, abs=1e-4 * np.abs(fibres).sum())


def test_the_next_step_goes_on_with_the_torques_of_the_other_side():
    t = np.linspace(0, 0.5, 51)
    torque = of_dof(t, "ankle_dorsiflexion_r", t) + of_dof(t, "ankle_dorsiflexion_l", 0.5 - t)
    work = fibre_work(samples(t, active=100 * torque), TENDON)
    assert np.abs(work[0]).max() > 1e-4
    np.testing.assert_allclose(work[-1], 0, atol=1e-12)


def test_every_constant_of_the_model_has_a_unit_and_a_source():
    for table in ("metabolic_model", "metabolic_measured"):
        rows = data.rows(table)
        assert rows
        assert all(row["unit"] and row["source"] and float(row["value"]) > 0 for row in rows)


# The lower back and strength


def test_moments_of_the_lower_back_are_those_of_the_gait_cycle():
    cycle, found = gait_cycle(GAIT), hg.energy(GAIT).spine
    names = ("extension", "bending_right", "rotation_left")
    for one, name in zip(found, names, strict=True):
        curve = MASS * cycle[f"L5S1_{name}_Nm_per_kg"]
        scale = np.abs(curve).max()
        assert one.greatest == pytest.approx(curve.max(), abs=0.05 * scale)
        assert one.least == pytest.approx(curve.min(), abs=0.05 * scale)
        seen = curve if name == "extension" else np.abs(curve)
        assert one.mean == pytest.approx(np.trapezoid(seen) / 100, abs=0.03 * scale)
        assert abs(one.peak) == max(one.greatest, -one.least)


def test_tissues_bear_the_lower_back_too():
    assert spine_moments(replace(NOW, active=0 * NOW.active)) == spine_moments(NOW)


def test_the_moments_of_a_step_are_those_of_its_mirror_image():
    other = replace(NOW, tau=mirror(NOW.tau), active=mirror(NOW.active))
    for one, same in zip(spine_moments(NOW), spine_moments(other), strict=True):
        assert (one.greatest, one.least) == pytest.approx((same.greatest, same.least))
    subject = GAIT.scenario.subject
    assert strength_shares(other, subject) == strength_shares(NOW, subject)


@pytest.mark.parametrize(
    ("dof", "torque", "words"),
    [
        ("knee_flexion_l", -500.0, "knee extension"),
        ("knee_flexion_r", 500.0, "knee flexion"),
        ("ankle_dorsiflexion_r", -900.0, "ankle plantarflexion"),
        ("hip_rotation_l", 500.0, "hip internal rotation"),
        ("hip_rotation_r", -500.0, "hip external rotation"),
        ("hip_abduction_r", -800.0, "hip adduction"),
        ("spine1_flexion", -2000.0, "spine 1 extension"),
        ("spine1_lateral", -1000.0, "spine 1 lateral bending"),
    ],
)
def test_the_torque_nearest_to_strength_is_named_with_its_sense(dof, torque, words):
    active = 0.1 * NOW.active
    active[7, index(dof)] = torque
    subject = GAIT.scenario.subject
    first = strength_shares(replace(NOW, active=active), subject)[0]
    limit = torque_limits(subject, deviations=0.0)[int(torque > 0)][index(dof)]
    assert first.joint == words
    assert (first.torque, first.strength) == pytest.approx((abs(torque), abs(limit)))
    assert first.share == pytest.approx(torque / limit)


def test_each_sense_of_each_axis_is_told_once_and_no_strength_is_assumed():
    found = strength_shares(NOW, GAIT.scenario.subject)
    names = [one.joint for one in found]
    assert len(set(names)) == len(names)
    rows = data.rows("joint_limits")
    assumed = {row["name"] for row in rows if row["torque_origin"] == "assumed"}
    assert {name[:3] for name in assumed} == {"toe", "cla"}
    assert not [name for name in names if name.startswith(("toe", "clavicle"))]
    sided = sum(name.endswith("_r") and name not in assumed for name in DOF_NAMES[6:])
    assert sum(not name.startswith(("spine", "neck")) for name in names) == 2 * sided
    shares = [one.share for one in found]
    assert shares == sorted(shares, reverse=True)


# All of it


def test_per_kilogram_and_metre_is_of_the_body_without_its_load_and_of_the_step():
    found, alone = hg.energy(LADEN), hg.energy(GAIT)
    walk, told = LADEN.scenario.walk, found.to_dict()
    assert (found.mass, found.load, alone.load) == (MASS, 18.0, 0.0)
    for sign, work in (("positive", found.positive_work), ("negative", found.negative_work)):
        assert told[f"{sign}_work_J"] == work
        assert told[f"{sign}_work_J_per_kg"] * MASS == pytest.approx(work)
        per_metre = told[f"{sign}_work_J_per_kg_m"]
        assert per_metre * MASS * walk.step_length == pytest.approx(work)
    assert found.cost_of_transport * MASS * walk.speed == pytest.approx(found.metabolic.gross)
    assert found.net_cost_of_transport * MASS * walk.speed == pytest.approx(found.metabolic.net)
    assert told["metabolic_rate_W_per_kg"] == pytest.approx(found.cost_of_transport * walk.speed)
    assert sum(told["metabolic_parts_W_per_kg"].values()) == pytest.approx(
        told["metabolic_rate_W_per_kg"]
    )
    joints = told["joints"].values()
    assert sum(one["positive_work_J"] for one in joints) == pytest.approx(found.positive_work)
    assert told["metabolic_error"]["rms"] == found.metabolic_error


def test_effort_is_the_integral_of_the_squared_muscle_torques_and_comes_last():
    found = hg.energy(GAIT)
    every = GAIT.step_time / 40
    torques = GAIT.muscle_torque(every * np.arange(40))
    assert found.effort == pytest.approx(every * np.sum(torques**2))
    assert list(found.to_dict())[-2:] == ["effort_N2_m2_s", "effort_N2_m2_s_per_kg_m"]
    assert headline(found)[-1].startswith("effort")


@pytest.mark.parametrize(
    ("changes", "calibrated"),
    [
        ({"formulation": "human"}, True),
        ({"formulation": "human", "walk.speed": 1.8}, True),
        ({"formulation": "human", "walk.speed": 0.5}, False),
        ({"formulation": "human", "walk.speed": 1.9}, False),
        ({"formulation": "human", "load.mass": 10.0}, False),
        ({"formulation": "effort"}, False),
    ],
)
def test_the_error_of_the_model_stands_beside_walks_of_its_calibration_alone(changes, calibrated):
    if speed := changes.get("walk.speed"):
        changes = {**changes, "walk.step_length": speed * GAIT.step_time}
    found = hg.energy(replace(GAIT, scenario=GAIT.scenario.replace(changes)))
    assert found.calibrated == calibrated
    assert (ERROR in headline(found)[0]) == calibrated
    assert ("error not known" in headline(found)[0]) != calibrated


def test_what_is_shown_has_every_joint():
    found = hg.energy(GAIT)
    assert headline(found)[0] in str(found)
    for one in found.joints:
        assert one.joint in str(found)
    assert found.strength[0].joint in repr(found)


def test_a_prediction_ends_with_it_and_the_verdict(capsys):
    kept = SimpleNamespace(success=True, checks=[], solution=NEWTON)
    console.show_outcome(kept, [kept], Path("out/mine"), GAIT)
    *told, verdict = capsys.readouterr().out.splitlines()
    assert verdict.startswith("newton found a walk")
    lines = headline(hg.energy(GAIT))
    assert told[-len(lines) :] == lines


def test_a_result_folder_is_taken_for_its_gait_and_its_summary_tells_the_same(tmp_path):
    LADEN.save(tmp_path / "laden")
    found = hg.energy(tmp_path / "laden")
    assert found == hg.energy(LADEN)
    summary = json.loads((tmp_path / "laden" / "summary.json").read_text())
    assert summary["energy"] == found.to_dict()
    with pytest.raises(hg.ResultError):
        hg.energy(tmp_path / "nothing")
