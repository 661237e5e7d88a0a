"""Settings that move limits are told with their defaults; what is as by default is not."""

import numpy as np
import pytest

from human_gait.body.limits import joint_limits, position_limits
from human_gait.body.skeleton import index
from human_gait.scenario import Scenario
from human_gait.settings.departures import departures
from human_gait.settings.records import all_settings

PLAIN = Scenario.from_dict({"name": "plain", "walk": {"speed": 1.2, "step_length": 0.66}})
LIMITING = ("tolerances", "posture")
TOLERANCES = [one for one in all_settings() if one.section in LIMITING and one.low is not None]


def told(**sections):
    walk = {"speed": 1.2, "step_length": 0.66}
    return [str(one) for one in departures(Scenario("any", walk, **sections))]


def test_nothing_is_told_of_a_walk_by_default():
    assert departures(PLAIN) == []
    assert departures(PLAIN.replace({"subject.sex": "female", "walk.speed": 1.0})) == []


@pytest.mark.parametrize("setting", TOLERANCES, ids=lambda one: one.dotted)
@pytest.mark.parametrize("end", ["low", "high"])
def test_every_tolerance_at_its_end_is_told_with_its_default(setting, end):
    value = getattr(setting, end)
    told = departures(PLAIN.replace({setting.dotted: value}))
    if value == setting.default:
        assert told == []
        return
    (one,) = told
    assert (one.key, one.value, one.default) == (setting.dotted, value, setting.default)
    assert one.unit == setting.unit


def test_another_formulation_is_told_and_nothing_that_follows_from_it():
    for formulation in ("effort", "paper"):
        assert told(objective={"formulation": formulation}) == [
            f"objective.formulation = {formulation}, default human"
        ]
    assert told(objective={"formulation": "effort"}, tolerances={"contact_speed": 0.1}) == [
        "tolerances.contact_speed = 0.1 m/s, default 0.3",
        "objective.formulation = effort, default human",
    ]


def test_it_is_told_in_a_line():
    assert told(tolerances={"contact_speed": 2.0}) == [
        "tolerances.contact_speed = 2 m/s, default 0.1"
    ]
    assert told(ground={"sharing": "parallel", "friction": 2}) == [
        "ground.sharing = parallel, default least_effort",
        "ground.friction = 2, default 0.5",
    ]
    assert told(load={"size": [0.3, 0.4, 0.3]}) == [
        "load.size = [0.3, 0.4, 0.3] m, default [0.3, 0.45, 0.2]"
    ]


def test_own_ranges_and_frozen_joints_stand_beside_the_usual_range():
    found = departures(
        Scenario(
            "any",
            {"speed": 1.2, "step_length": 0.66},
            limits={"frozen": ["wrist_flexion_r"], "knee_flexion_r": [0.0, 70.0]},
            posture={"arms_deg": 10.0},
        )
    )
    by_key = {one.key: one for one in found}
    assert by_key["limits.wrist_flexion_r"].value == [0.0, 0.0]
    usual = position_limits()[0][index("wrist_flexion_r")]
    assert by_key["limits.wrist_flexion_r"].default[0] == pytest.approx(np.rad2deg(usual))
    lower, upper = (np.rad2deg(end) for end in joint_limits(PLAIN))
    knee = list(by_key["limits.knee_flexion_r"].default)
    assert min(abs(lower - knee[0]).min(), abs(upper - knee[1]).min()) < 1e-6
    assert set(by_key) == {"posture.arms_deg", "limits.wrist_flexion_r", "limits.knee_flexion_r"}


def test_a_default_that_follows_from_another_setting_is_no_departure():
    few = PLAIN.replace({"discretisation.control_points": 6})
    assert departures(few) == []
    tied = few.replace({"discretisation.periodicity": "position"})
    assert [str(one) for one in departures(tied)] == [
        "discretisation.periodicity = position, default velocity"
    ]
