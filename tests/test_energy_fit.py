"""The calibration of the metabolic model, without the walks that it predicts."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.energy_fit import (
    FITTED_TO,
    Fit,
    Walked,
    errors,
    fitted,
    heavier,
    least,
    measured_rates,
)
from human_gait.body.skeleton import SEGMENTS
from human_gait.scenario import Scenario
from human_gait.walk.instant import Walker
from human_gait.walk.metabolic import STANDING_RATE

RATES = measured_rates()


def walks(fit):
    """Walks that take by some constants exactly what people take."""
    return [
        Walked(v, (rate - STANDING_RATE - fit.work * 0.4 * v) / fit.heat, 0.4 * v, found=True)
        for v, rate in RATES.items()
    ]


def test_measured_rates_are_those_of_walking_people():
    assert len(RATES) == 8
    assert sum(speed < FITTED_TO for speed in RATES) == 7
    assert all(3.0 < rate < 9.0 for rate in RATES.values())
    costs = [rate / speed for speed, rate in RATES.items()]
    assert least(list(RATES), costs) == pytest.approx(1.36, abs=0.08)


def test_the_constants_that_a_model_was_made_with_are_found_again():
    made = walks(Fit(20.0, 1.3))
    found = fitted(made, RATES)
    assert found == pytest.approx((20.0, 1.3))
    np.testing.assert_allclose(errors(made, RATES, found), 0, atol=1e-12)


@pytest.mark.parametrize("changed", Fit._fields)
def test_the_fit_is_the_best_of_all(changed):
    factors = np.resize([0.9, 1.1, 1.0], len(RATES))
    pairs = zip(walks(Fit(20.0, 1.3)), factors, strict=True)
    some = [replace(one, torque=float(factor) * one.torque) for one, factor in pairs]
    found = fitted(some, RATES)
    near = [found._replace(**{changed: k * getattr(found, changed)}) for k in (0.999, 1.0, 1.001)]
    squares = [np.sum(errors(some, RATES, fit) ** 2) for fit in near]
    assert squares[1] == min(squares) > 0


@pytest.mark.parametrize(
    ("place", "segments"), [("waist", ["pelvis"]), ("foot", ["foot_r", "foot_l"])]
)
def test_a_mass_hangs_where_it_was_put_and_only_for_so_long(place, segments):
    task = Scenario.from_dict({"name": "case", "walk": {"speed": 1.2, "step_length": 0.66}})
    with heavier(place, 4.0):
        heavy = Walker(task).body
    body = Walker(task).body
    assert heavy.total_mass == pytest.approx(body.total_mass + 4)
    more = heavy.mass - body.mass
    assert sum(more[SEGMENTS[one]] for one in segments) == pytest.approx(4)
    assert sum(heavy.pinocchio_model().inertias[k].mass for k in range(56)) == pytest.approx(
        heavy.total_mass
    )
