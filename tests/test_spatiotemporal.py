import numpy as np
import pytest
from test_reference import bump, cycle

from human_gait.people.spatiotemporal import step_length_regression, step_scores

CYCLE = cycle(vertical_up_BW=bump(0, 63))


def by_name(speed, step_length):
    return {found.name: found for found in step_scores(CYCLE, speed, step_length)}


def test_young_adults_lengthen_their_steps_by_a_third_of_a_metre_per_metre_per_second():
    regression = step_length_regression()
    assert regression.at(0) == pytest.approx(0.255, abs=1e-3)
    assert regression.slope == pytest.approx(0.312, abs=1e-3)


def test_the_regression_goes_through_the_mean_of_its_data():
    regression = step_length_regression()
    assert regression.at(regression.speed.mean()) == pytest.approx(regression.step_length.mean())


def test_the_interval_holds_about_its_share_of_the_people():
    regression = step_length_regression()
    for coverage in (0.5, 0.95):
        inside = [
            low <= length <= high
            for speed, length in zip(regression.speed, regression.step_length, strict=True)
            for low, high in [regression.interval(speed, coverage)]
        ]
        assert np.mean(inside) == pytest.approx(coverage, abs=0.05)


def test_the_interval_is_narrowest_where_the_data_are():
    regression = step_length_regression()
    widths = [np.diff(regression.interval(speed))[0] for speed in (regression.speed.mean(), 3.0)]
    assert 0 < widths[0] < widths[1]


def test_a_usual_step_is_inside_and_a_leap_is_not():
    assert by_name(1.2, 0.63)["step length"].inside
    assert not by_name(1.2, 0.95)["step length"].inside


def test_cadence_times_step_length_is_speed():
    found = by_name(1.2, 0.66)
    length, cadence = found["step length"], found["cadence"]
    for side in ("predicted", "measured"):
        assert getattr(length, side) * getattr(cadence, side) == pytest.approx(60 * 1.2)
    assert cadence.lower < cadence.measured < cadence.upper
    assert cadence.inside == length.inside


def test_double_support_is_the_stance_beyond_half_a_cycle():
    longer = {f.name: f for f in step_scores(cycle(vertical_up_BW=bump(0, 68)), 1.2, 0.66)}
    found, more = by_name(1.2, 0.66)["double support"], longer["double support"]
    assert more.predicted - found.predicted == pytest.approx(10, abs=1)
    assert 20 < found.lower < found.measured < found.upper < 35
    assert found.measured == more.measured
