import numpy as np
import pytest
from scipy.spatial import ConvexHull
from walks import PEOPLE, scenario

from human_gait.body.person import make_body
from human_gait.problem.contact_rows import CONTACT_POSITION, SOFT_IMPACT
from human_gait.problem.program import build_program
from human_gait.walk.contact_plan import (
    BALL_LATERAL,
    BALL_MEDIAL,
    HEEL,
    LEFT,
    RIGHT,
    TOE,
    ContactPlan,
    _hull,
)

DOWN, UP = True, False


def plan_of(task):
    return ContactPlan(task, make_body(task.subject, task.load))


@pytest.fixture(params=PEOPLE.values(), ids=PEOPLE, scope="module")
def plan(request):
    return plan_of(request.param)


def times_of(plan, n=61):
    return np.linspace(0.0, plan.walk.step_time, n)


def inside(polygon, point, slack=1e-12):
    """Whether a point is in a convex polygon whose corners go round counterclockwise."""
    edges = np.roll(polygon, -1, axis=0) - polygon
    offset = point - polygon
    return np.all(edges[:, 0] * offset[:, 1] - edges[:, 1] * offset[:, 0] >= -slack)


def test_the_footholds_are_a_step_apart(plan):
    right, left = plan.footholds
    np.testing.assert_allclose(left[[HEEL, TOE], 2] - right[[HEEL, TOE], 2], plan.walk.step_length)
    np.testing.assert_allclose(left[[HEEL, TOE], 0] - right[[HEEL, TOE], 0], plan.walk.step_width)
    np.testing.assert_allclose(right[[HEEL, TOE], 0], -plan.walk.step_width / 2)


def test_the_footholds_are_on_the_ground_the_heel_behind_the_ball_behind_the_toe(plan):
    np.testing.assert_allclose(plan.footholds[..., 1], 0.0, atol=1e-14)
    for foot in plan.footholds:
        assert foot[HEEL, 2] < foot[BALL_MEDIAL, 2] < foot[TOE, 2]
        assert foot[BALL_MEDIAL, 2] == pytest.approx(foot[BALL_LATERAL, 2])
    np.testing.assert_allclose(plan.balls, plan.footholds[:, BALL_MEDIAL, 2])


def test_medial_points_face_the_other_foot(plan):
    right, left = plan.footholds
    assert right[BALL_MEDIAL, 0] > right[BALL_LATERAL, 0]
    assert left[BALL_MEDIAL, 0] < left[BALL_LATERAL, 0]


def test_the_pelvis_starts_midway_between_the_feet(plan):
    np.testing.assert_allclose(plan.ankles.mean(axis=0), 0.0, atol=1e-15)


def test_contacts_follow_the_phases(plan):
    """Right: ball and toes, then toes alone, then none. Left: heel, then flat, then ball."""
    phases, e = plan.phases, 1e-3
    flat, single, heel_off = phases.foot_flat, phases.double_support, phases.heel_off
    s = np.array([0.0, flat - e, flat, single, single + e, heel_off, heel_off + e, 1.0])
    balls_down = s <= phases.ball_off
    right, left = plan.contact(s * plan.walk.step_time).swapaxes(0, 1)
    np.testing.assert_array_equal(right[:, HEEL], [UP] * 8)
    np.testing.assert_array_equal(left[:, HEEL], [DOWN] * 6 + [UP] * 2)
    for point in (BALL_MEDIAL, BALL_LATERAL, TOE):
        toes_down = [DOWN] * 4 + [UP] * 4
        np.testing.assert_array_equal(right[:, point], toes_down if point == TOE else balls_down)
        np.testing.assert_array_equal(left[:, point], [UP] * 2 + [DOWN] * 6)
    both = plan.double_support(s * plan.walk.step_time)
    np.testing.assert_array_equal(both, [True] * 4 + [False] * 4)


def test_at_every_time_something_stands(plan):
    touching = plan.contact(times_of(plan))
    assert np.all(touching[:, LEFT].any(axis=1))


def test_rounding_of_the_grid_does_not_move_an_event():
    """With 20 intervals double support ends on instant 5, however 5 T / 20 is rounded."""
    plan = plan_of(scenario(speed=1.1, step_length=0.63, phases={"double_support": 0.25}))
    times = np.arange(20) * plan.walk.step_time / 20
    assert np.flatnonzero(plan.double_support(times))[-1] == 5


def test_the_region_of_pressure_is_in_the_foot_support_region(plan):
    for t, region in zip(times_of(plan), plan.pressure_region(times_of(plan)), strict=True):
        polygon = plan.support_polygon(t)
        for f in (RIGHT, LEFT) if plan.double_support(np.array([t]))[0] else (LEFT,):
            lower, upper = region[f]
            assert np.all(lower < upper)
            corners = [(x, z) for x in (lower[0], upper[0]) for z in (lower[1], upper[1])]
            assert all(inside(polygon, corner) for corner in corners)


def test_pressure_is_under_the_part_that_stands(plan):
    region = plan.pressure_region(times_of(plan))
    touching = plan.contact(times_of(plan))
    foot = plan.footholds[LEFT, :, 2]
    before_flat, after_heel_off = ~touching[:, LEFT, TOE], ~touching[:, LEFT, HEEL]
    assert np.all(region[before_flat, LEFT, 1, 1] < (foot[HEEL] + foot[BALL_MEDIAL]) / 2)
    assert np.all(region[after_heel_off, LEFT, 0, 1] >= foot[BALL_MEDIAL] - 1e-12)
    assert np.all(region[:, RIGHT, 0, 1] >= plan.footholds[RIGHT, BALL_MEDIAL, 2] - 1e-12)


def test_the_rear_bound_moves_forward_without_a_jump(plan):
    """It covers the way from heel to ball, but no more than a tenth of it per 1 % of the step."""
    rear = plan.pressure_region(times_of(plan, 101))[:, LEFT, 0, 1]
    assert np.all(np.diff(rear) >= 0.0)
    assert np.diff(rear).max() < 0.1 * np.ptp(rear)


def test_load_is_handed_over_from_foot_to_foot(plan):
    """A and B of Eq. (17) stay under standing parts and move forward."""
    times = times_of(plan)[plan.double_support(times_of(plan))]
    A, B = plan.transfer_points(times)
    trailing, leading = plan.footholds[:, :, 2]
    assert np.all((A[:, 2] >= trailing[BALL_MEDIAL]) & (A[:, 2] <= trailing[TOE]))
    assert np.all((B[:, 2] >= leading[HEEL]) & (B[:, 2] <= leading[BALL_MEDIAL]))
    for points, ankle in ((A, plan.ankles[RIGHT]), (B, plan.ankles[LEFT])):
        assert np.all(np.diff(points[:, 2]) > 0.0)
        np.testing.assert_allclose(points[:, 0], ankle[0])
        np.testing.assert_array_equal(points[:, 1], 0.0)


def test_outlines_alternate_sides_and_advance(plan):
    steps = range(-1, 5)
    sides, outlines = zip(*(plan.outline(step) for step in steps), strict=True)
    assert sides == (RIGHT, LEFT, RIGHT, LEFT, RIGHT, LEFT)
    centres = np.array([outline.mean(axis=0) for outline in outlines])
    np.testing.assert_allclose(np.diff(centres[:, 2]), plan.walk.step_length)
    np.testing.assert_allclose(np.abs(np.diff(centres[:, 0])), plan.walk.step_width, atol=0.03)
    np.testing.assert_allclose(np.concatenate(outlines)[:, 1], 0.0, atol=1e-14)


def test_the_first_outlines_are_those_of_the_standing_feet(plan):
    for step, f in ((-1, RIGHT), (0, LEFT)):
        _, outline = plan.outline(step)
        points = plan.footholds[f]
        assert outline[:, 2].min() == pytest.approx(points[HEEL, 2])
        assert outline[:, 2].max() == pytest.approx(points[TOE, 2])


def test_the_support_polygon_spans_what_stands(plan):
    phases, T = plan.phases, plan.walk.step_time
    trailing, leading = plan.footholds[:, :, 2]
    rolled = (max(phases.foot_flat, phases.ball_off) + phases.double_support) / 2
    start, both = (plan.support_polygon(t * T)[:, 1] for t in (0.0, rolled))
    flat = plan.support_polygon((phases.double_support + phases.heel_off) / 2 * T)[:, 1]
    forefoot = plan.support_polygon(T)[:, 1]
    assert start.min() == pytest.approx(trailing[BALL_MEDIAL])
    assert leading[HEEL] < start.max() < leading[BALL_MEDIAL]
    assert trailing[BALL_MEDIAL] < both.min() < trailing[TOE]
    assert both.max() == pytest.approx(leading[TOE])
    assert (flat.min(), flat.max()) == pytest.approx((leading[HEEL], leading[TOE]))
    assert (forefoot.min(), forefoot.max()) == pytest.approx((leading[BALL_MEDIAL], leading[TOE]))


@pytest.mark.parametrize("feet", [(RIGHT, LEFT), (LEFT,), (RIGHT,)])
def test_the_support_regions_are_those_of_each_instant(plan, feet):
    """Every instant is in one of them, and without corners only where nothing stands."""
    times, seen = times_of(plan), []
    standing = plan.contact(times)[:, feet].any(axis=(1, 2))
    for instants, corners in plan.support_regions(times, feet):
        seen += instants.tolist()
        assert len(corners) > 2 or not standing[instants].any()
        if len(corners):
            np.testing.assert_array_equal(corners, plan.support_polygon(times[instants[-1]], feet))
    assert sorted(seen) == list(range(len(times)))


def test_the_hull_of_points_is_scipys():
    """Corners all around, counterclockwise; points within, on an edge and twice there are none."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    more = [square, square[:1], [[0.5, 0.0], [0.3, 0.4]], square[1:] + 1e-14]
    np.testing.assert_allclose(_hull(np.concatenate(more)), square, atol=1e-13)
    for points in np.random.default_rng(5).normal(size=(20, 12, 2)):
        expected, found = points[ConvexHull(points).vertices], _hull(points)
        first = int(np.argmin(expected[:, 0]))
        np.testing.assert_array_equal(found, np.roll(expected, -first, axis=0))


@pytest.mark.parametrize("task", PEOPLE.values(), ids=PEOPLE)
def test_the_weight_is_that_of_body_and_load(task):
    weight = 9.81 * (task.subject.mass + task.load.mass)
    assert plan_of(task).weight == pytest.approx(weight, rel=1e-12)


ROOM = {"contact_speed": 0.11, "landing_speed": 0.43, "toe_off_speed": 0.27}


def test_each_standing_point_may_have_the_speed_of_its_event():
    """The heel as it strikes, ball and toes as the foot comes down, the toe tip that rolls off."""
    plan = plan_of(scenario(objective={"formulation": "human"}, tolerances=ROOM))
    flat, e = plan.phases.foot_flat, 1e-3
    s = np.array([0.0, 0.05 - e, 0.05 + e, flat - e, flat, flat + 0.05 - e, flat + 0.05 + e, 0.9])
    right, left = plan.allowed_speed(s * plan.walk.step_time).swapaxes(0, 1)
    rest, landing, rolling = ROOM.values()
    np.testing.assert_array_equal(left[:, HEEL], [landing] * 2 + [rest] * 6)
    for point in (BALL_MEDIAL, BALL_LATERAL, TOE):
        np.testing.assert_array_equal(left[:, point], [rest] * 4 + [landing] * 2 + [rest] * 2)
    np.testing.assert_array_equal(right[:, TOE], rolling)
    np.testing.assert_array_equal(right[:, :TOE], rest)


def test_without_a_word_all_standing_points_may_move_alike_by_effort(plan):
    np.testing.assert_array_equal(plan.allowed_speed(times_of(plan)), 0.3)


def test_rows_of_standing_points_have_these_speeds_and_the_height_its_own_tolerance():
    tolerances = ROOM | {"contact": 0.006, "contact_height": 0.002}
    task = scenario(objective={"formulation": "human"}, tolerances=tolerances)
    program = build_program(task)
    rows = {constraint.name: constraint for constraint in program.constraints}
    place = rows[CONTACT_POSITION.name]
    up = np.char.endswith(place.what, "height")
    assert set(place.upper[up]) == {0.002}
    assert set(place.upper[~up]) == {0.006}
    np.testing.assert_array_equal(place.lower, -place.upper)
    speed = rows[SOFT_IMPACT.name]
    of_toe = np.char.startswith(speed.what, "right toe")
    assert set(speed.upper[of_toe]) == {ROOM["toe_off_speed"]}
    assert set(speed.upper[np.char.startswith(speed.what, "left")]) == {0.11, 0.43}
