"""The filter and the part of a step that it takes."""

from dataclasses import replace

import numpy as np
import pytest
from small_problems import corner, numbers, random_quadratic

from human_gait.newton.filter import NOWHERE, Filter, Measures
from human_gait.newton.interior_point import InteriorPoint
from human_gait.newton.line_search import along, leads_downhill, predicted_fall
from human_gait.newton.newton_step import Step


def test_the_predicted_fall_is_the_slope_of_the_barrier_function():
    problem = random_quadratic(2, np.linspace(0.5, 5.0, 10))
    method = InteriorPoint(problem)
    state = method.start(np.full(10, 0.2), None, 0.1)
    rng, eps = np.random.default_rng(0), 1e-6
    d = np.where(method.bounds.equal, 0.0, rng.normal(size=18))
    heights = [
        method.bounds.measures(method.stacked.point(w[:10]), w, 0.1).height
        for w in (state.inside - eps * d, state.inside + eps * d)
    ]
    fall = predicted_fall(method.bounds, state, Step(d, np.zeros(8), d, d, 1.0, 1.0), 0.1)
    assert (heights[1] - heights[0]) / (2.0 * eps) == pytest.approx(fall, rel=1e-6)


@pytest.mark.parametrize(
    ("part", "fall", "violation", "expected"),
    [
        (1.0, -1.0, 0.5, True),
        (1.0, -0.5, 0.9, False),  # 0.5^2.3 < 0.9^1.1
        (1.0, -0.5, 0.4, False),  # 0.5^2.3 < 0.4^1.1 < 0.5
        (1.0, -2.0, 3.0, True),  # 2^2.3 > 3^1.1 > 2
        (0.1, -1.0, 0.5, False),
        (1.0, 1e-3, 0.5, False),
        (1.0, 1e-3, 0.0, False),
        (1e-3, -1e-9, 0.0, True),  # nothing is violated
        (1.0, -1e300, 0.5, True),
    ],
)
def test_a_step_leads_downhill_if_it_falls_by_more_than_is_violated(
    part, fall, violation, expected
):
    assert leads_downhill(part, fall, violation) is expected


def test_the_filter_refuses_what_is_no_better_than_a_point_before():
    """Either the violation or the barrier function has to be lower by a margin."""
    seen = Filter()
    assert seen.takes(Measures(3.0, 5.0))
    seen.add(Measures(1.0, 2.0))
    assert not seen.takes(Measures(1.0, 2.0))
    assert not seen.takes(Measures(3.0, 5.0))
    assert not seen.takes(Measures(1.0 - 1e-6, 2.0 - 1e-6))
    assert seen.takes(Measures(0.9, 9.0))
    assert seen.takes(Measures(9.0, 1.9))
    assert not seen.takes(NOWHERE)
    assert not Filter().takes(NOWHERE)


def test_a_step_is_shortened_until_the_filter_takes_it():
    """And a point that was left for less violation is in the filter from then on."""
    method = InteriorPoint(replace(corner(), row_lower=numbers(1.1)))
    state = method.start(numbers(0.3, 0.3), None, 0.1)

    def taken(seen):
        return along(method.stacked, method.bounds, state, step, 1e-9, seen)

    here = method.bounds.measures(state.point, state.inside, 1e-9)
    assert here.violation > 0.4
    d = np.array([0.3, 0.3, 0.0])
    step = Step(d, np.zeros(1), np.zeros(3), np.zeros(3), primal=1.0, dual=1.0)
    point = method.stacked.point(state.inside[:2] + d[:2])
    whole = method.bounds.measures(point, state.inside + d, 1e-9)
    assert whole.violation < here.violation
    seen = Filter()
    assert taken(seen)[0] == 1.0
    assert not seen.takes(here)
    seen = Filter()
    seen.add(whole._replace(height=whole.height - 1.0))  # better than what the whole step leads to
    moved = taken(seen)
    assert moved is None or moved[0] < 1.0
