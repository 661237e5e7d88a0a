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
    "grown", [lambda tried, _: damping.if_refused(tried), damping.if_indefinite]
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


def test_little_damping_is_left_away_at_first():
    assert damping.first(0.99 * damping.UNDAMPED) == 0.0
    assert damping.first(damping.UNDAMPED) == damping.UNDAMPED
