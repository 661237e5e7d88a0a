"""Walks of bodies that differ in scale alone are one walk in dimensionless numbers."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from walking import guessed_gait

import human_gait as hg
from human_gait.body.skeleton import GRAVITY
from human_gait.people.spatiotemporal import step_length_regression
from human_gait.walk.dimensionless import Scales, froude_number
from human_gait.walk.gait import Gait

PEOPLE = [hg.Subject(), hg.Subject("female"), *hg.Population("both", 4, seed=3)]


def scaled(gait, size, mass):
    """The same walk of a body of another size and density."""
    before = gait.scenario
    walk = replace(
        before.walk,
        speed=before.walk.speed * np.sqrt(size),
        step_length=before.walk.step_length * size,
        step_width=before.walk.step_width * size,
    )
    subject = hg.Subject(before.subject.sex, before.subject.stature * size, mass)
    points = gait.control_points * np.where(np.arange(55) < 3, size, 1.0)
    return Gait(replace(before, walk=walk, subject=subject), gait.breaks * np.sqrt(size), points)


@pytest.mark.parametrize(("size", "mass"), [(0.8, 61.0), (1.2, 95.0)])
def test_bodies_of_one_shape_have_one_walk(size, mass):
    """But for the metabolic rate, and passive tissues, which nobody has measured to scale."""
    gait = guessed_gait()
    gait = replace(gait, scenario=gait.scenario.replace(passive_torques="none"))
    one, other = (asdict(hg.dimensionless(g)) for g in (gait, scaled(gait, size, mass)))
    for name in one.keys() - {"cost_of_transport"}:
        assert other[name] == pytest.approx(one[name], rel=1e-3), name
    assert hg.energy(gait).effort != pytest.approx(hg.energy(scaled(gait, size, mass)).effort)


def test_numbers_are_those_of_the_walk_over_weight_and_leg():
    gait = guessed_gait()
    found, energy, subject = hg.dimensionless(gait), hg.energy(gait), gait.scenario.subject
    weight, leg = subject.mass * GRAVITY, subject.leg_length
    assert found.froude == pytest.approx(1.2**2 / (GRAVITY * leg))
    assert found.speed**2 == pytest.approx(found.froude)
    assert found.step_length == pytest.approx(0.66 / leg)
    assert found.step_length / found.step_time == pytest.approx(found.speed)
    assert found.positive_work == pytest.approx(energy.positive_work / (weight * 0.66))
    assert found.negative_work < 0.0
    assert found.cost_of_transport == pytest.approx(energy.cost_of_transport / GRAVITY)
    steps = leg / gait.step_length
    expected = energy.effort / ((weight * leg) ** 2 * np.sqrt(leg / GRAVITY)) * steps
    assert found.effort == pytest.approx(expected)
    assert found.L5S1_extension == pytest.approx(energy.spine[0].greatest / (weight * leg))


@pytest.mark.parametrize("who", PEOPLE)
def test_a_comfortable_walk_is_in_proportion_to_the_leg_and_as_people_walk(who):
    walk = hg.comfortable_walk(who)
    scales = Scales.of(who)
    assert froude_number(who, walk.speed) == pytest.approx(0.16)
    assert walk.step_length / scales.leg == pytest.approx(0.71)
    assert scales.power == pytest.approx(scales.force * scales.speed)
    measured = 0.152 * who.stature + 0.306 * walk.speed
    assert abs(walk.step_length - measured) < 0.08  # 2 SD of a person, and the leg's share
    assert hg.Scenario("a", walk, who).walk == walk


def test_the_median_man_takes_longer_steps_at_higher_speeds_as_people_do():
    man = hg.Subject.default()
    for froude in (0.08, 0.16, 0.3):
        walk = hg.comfortable_walk(man, froude)
        low, high = step_length_regression().interval(walk.speed)
        assert low < walk.step_length < high
    for wrong in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="must be above 0"):
            hg.comfortable_walk(man, wrong)
    with pytest.raises(hg.ScenarioError, match=r"walk\.speed"):
        hg.comfortable_walk(man, 9.0)
