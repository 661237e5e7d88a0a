"""How damping grows and falls."""

import pytest

from human_gait.newton import damping


@pytest.mark.parametrize(
    ("tried", "before", "longest", "expected"),
    [(0.0, 0.3, 2.0, 0.1), (0.3, 0.0, 2.0, 0.3), (0.3, 0.0, 0.25, 0.15), (0.3, 0.0, 1e-3, 0.03)],
)
def test_damping_falls_after_short_steps(tried, before, longest, expected):
    assert damping.left(tried, before, longest) == pytest.approx(expected)


@pytest.mark.parametrize("before", [0.0, 1e-5, 0.3, 1e3])
@pytest.mark.parametrize(
    "grown",
    [
        lambda tried, _: damping.if_refused(tried),
        lambda tried, before: damping.if_indefinite(tried, before, tried),
    ],
)
def test_damping_grows_to_its_limit_in_some_tries(before, grown):
    """At least threefold each time, from nothing too."""
    tried, tries = damping.first(before), 0
    while tried <= damping.MOST:
        more = grown(tried, before)
        assert more >= 2.999 * tried
        assert more > 0.0
        tried, tries = more, tries + 1
    assert tries < 30


@pytest.mark.parametrize(("tried", "too_little"), [(0.0, 0.9), (0.02, 7.0), (2.0, 2.1)])
def test_what_cannot_suffice_is_not_tried(tried, too_little):
    """The next of the same threefold growth is, that is above it."""
    one_by_one = damping.if_indefinite(tried, 0.0, tried)
    while one_by_one <= too_little:
        one_by_one = damping.if_indefinite(one_by_one, 0.0, one_by_one)
    assert damping.if_indefinite(tried, 0.0, too_little) == one_by_one


def test_numbers_that_are_none_do_not_stop_its_growth():
    assert damping.if_indefinite(1.0, 0.0, float("nan")) == 3.0
    assert damping.if_indefinite(1.0, 0.0, float("inf")) > damping.MOST


def test_little_damping_is_left_away_at_first():
    assert damping.first(0.99 * damping.UNDAMPED) == 0.0
    assert damping.first(damping.UNDAMPED) == damping.UNDAMPED
