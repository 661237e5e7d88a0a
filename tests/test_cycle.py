"""What a walk repeats: the mirrored step and, for comparison, a cycle that mirrors nothing."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import MALE, random_states

from human_gait.body import dh
from human_gait.body.skeleton import DOF_NAMES, MIRROR_INDEX, N_DOF, SEGMENTS, index, mirror
from human_gait.scenario import Walk
from human_gait.walk.bspline import Basis
from human_gait.walk.cycle import Cycle, step_cycle

STEP = step_cycle(Walk(speed=1.2, step_length=0.66))
PLAIN = Cycle(1.1, np.arange(N_DOF), np.ones(N_DOF), 2 * STEP.advance)
CYCLES = {"step": STEP, "nothing mirrored": PLAIN}
RNG = np.random.default_rng(5)
Q = RNG.normal(size=(6, N_DOF))
MANY = np.array([0, 1, 2, 3, -1, -2])
TIMES = np.linspace(0.0, 1.0, 9)


@pytest.fixture(params=CYCLES.values(), ids=CYCLES)
def cycle(request):
    return request.param


def test_a_step_is_mirrored_and_goes_on_by_its_length():
    assert (STEP.period, STEP.length) == (0.66 / 1.2, 0.66)
    np.testing.assert_array_equal(STEP.turned(Q), mirror(Q))
    moved = STEP.image(Q) - mirror(Q)
    np.testing.assert_allclose(moved[:, index("pelvis_tz")], 0.66)
    assert np.count_nonzero(moved) == len(Q)


@pytest.mark.parametrize("name", ["turned", "image", "placed", "reflected", "exchanged"])
def test_many_cycles_are_one_after_another(cycle, name):
    """Forwards and back again; 1e-15 is rounding."""
    shapes = {"turned": (N_DOF,), "image": (N_DOF,), "exchanged": (2, 4, 3)}
    values = RNG.normal(size=(6, *shapes.get(name, (4, 3))))
    later = getattr(cycle, name)
    one_by_one = [values[:1], *(None for _ in range(3))]
    for k in range(1, 4):
        one_by_one[k] = later(one_by_one[k - 1])
    repeated = np.repeat(values[:1], 4, axis=0)
    np.testing.assert_allclose(
        later(repeated, np.arange(4)), np.concatenate(one_by_one), atol=1e-15
    )
    np.testing.assert_allclose(later(later(values, MANY), -MANY), values, atol=1e-15)


def test_no_cycle_changes_nothing(cycle):
    np.testing.assert_array_equal(cycle.image(Q, 0), Q)
    np.testing.assert_array_equal(cycle.turned(Q, 2), Q)


def test_only_a_mirrored_cycle_swaps_the_sides_and_only_by_odd_steps():
    np.testing.assert_array_equal(STEP.swaps(MANY), MANY % 2 == 1)
    assert not PLAIN.swaps(MANY).any()
    vectors = RNG.normal(size=(6, 2, 3))
    np.testing.assert_array_equal(PLAIN.reflected(vectors, MANY), vectors)
    np.testing.assert_array_equal(PLAIN.exchanged(vectors, MANY), vectors)


def test_turning_is_its_own_transpose(cycle):
    """What makes gradients in the free control points from those in their images."""
    a, b = RNG.normal(size=(2, N_DOF))
    assert a @ cycle.turned(b) == pytest.approx(cycle.turned(a) @ b, abs=1e-12)


def test_rates_are_turned_as_differences_of_postures(cycle):
    np.testing.assert_allclose(
        cycle.image(Q[0], 3) - cycle.image(Q[1], 3), cycle.turned(Q[0] - Q[1], 3), atol=1e-14
    )


def test_the_segments_of_a_posture_go_where_the_world_goes(cycle):
    """Forward kinematics of the image against the image of the forward kinematics."""
    q, _, _ = random_states(4)
    links = np.array(list(SEGMENTS.values()))
    swapped = np.array([SEGMENTS[_other(name)] for name in SEGMENTS])
    before, after = (dh.frames(MALE.table, x)[0][..., :3, 3] for x in (q, cycle.image(q)))
    of_other_side = swapped if cycle.swaps() else links
    np.testing.assert_allclose(after[:, links], cycle.placed(before[:, of_other_side]), atol=1e-12)


def _other(name):
    return {"_r": f"{name[:-2]}_l", "_l": f"{name[:-2]}_r"}.get(name[-2:], name)


def test_a_map_that_does_not_lead_back_is_refused():
    round_about = np.roll(np.arange(N_DOF), 1)
    with pytest.raises(ValueError, match="lead back"):
        replace(STEP, index=round_about)
    sign = STEP.sign.copy()
    sign[index("knee_flexion_r")] = -1.0  # and not that of the left knee
    with pytest.raises(ValueError, match="lead back"):
        replace(STEP, sign=sign)


@pytest.mark.parametrize("order", range(3))
def test_splines_go_on_as_any_cycle_says(cycle, order):
    basis = Basis.uniform(cycle, 9)
    first, last = basis.matrix(np.array([0.0, cycle.period]), order) @ basis.expand(Q)
    goes_on = cycle.turned if order else cycle.image
    np.testing.assert_allclose(last, goes_on(first), atol=1e-12 * np.abs(last).max())


def test_splines_of_any_cycle_are_fitted_and_refined(cycle):
    basis = Basis.uniform(cycle, 9)
    times, P = TIMES * cycle.period, basis.expand(Q)
    np.testing.assert_allclose(basis.fit(times, basis.matrix(times) @ P), Q, atol=1e-12)
    finer = basis.refined(13)
    more = basis.insert(finer, P)
    np.testing.assert_allclose(finer.matrix(times) @ more, basis.matrix(times) @ P, atol=1e-13)
    np.testing.assert_allclose(finer.expand(more[: finer.n_free]), more, atol=1e-13)


def test_a_cycle_mirrors_every_degree_of_freedom_once():
    assert sorted(STEP.index) == list(range(N_DOF))
    pairs = [name for name in DOF_NAMES if name.endswith(("_r", "_l"))]
    assert np.count_nonzero(np.arange(N_DOF) != MIRROR_INDEX) == len(pairs)
