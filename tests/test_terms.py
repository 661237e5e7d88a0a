"""The terms of the objective: derivatives by differences, and what mechanics says of each."""

from types import SimpleNamespace

import numpy as np
import pytest
from walks import central_difference, near_walk, scenario, walking_states

from human_gait.body.skeleton import MIRROR_INDEX, MIRROR_SIGN, index
from human_gait.checks.costs import costs
from human_gait.dynamics.inverse_dynamics import ENGINES
from human_gait.problem.fibre_work import ROUNDING, ankle_work, joint_work, price
from human_gait.problem.objective import (
    squared_passive_torque,
    squared_torque,
    squared_torque_rate,
)
from human_gait.problem.program import build_program
from human_gait.problem.steadiness import steady_head, steady_trunk
from human_gait.walk.instant import Walker

ALL = {"formulation": "human", "negative_work": 9.0, "steady_trunk": (770.0, 300.0, 3000.0)}
PERIODICITIES = ("acceleration", "velocity")
ANKLES = [index("ankle_dorsiflexion_r"), index("ankle_dorsiflexion_l")]
NAMES = [term.name for term in build_program(scenario(objective=ALL)).terms]


class Differences:
    """Each term at a point near a walk: derivatives, and differences along some directions."""

    def __init__(self, periodicity, engine):
        task = scenario(objective=ALL, periodicity=periodicity)
        program = build_program(task, dynamics=engine)
        free = near_walk(program, noise=0.05)
        rng = np.random.default_rng(1)
        single = np.eye(len(free))[:, rng.choice(len(free), 3, replace=False)]
        self.along = np.hstack([rng.normal(size=(len(free), 3)), single])
        found = [program.functions.cost([term], free)[1] for term in program.terms]
        self.gradients = dict(zip(NAMES, found, strict=True))
        self.hessians = {
            term.name: program.functions.hessian(free, [(term, 1.0)], []).dense()
            for term in program.terms
        }

        def all_terms(x):
            parts = [program.functions.cost([term], x) for term in program.terms]
            return np.stack([np.append(slope, value) for value, slope in parts])

        found = central_difference(all_terms, free, self.along)
        self.slopes = dict(zip(NAMES, found, strict=True))


@pytest.fixture(params=PERIODICITIES, scope="module")
def periodicity(request):
    return request.param


@pytest.fixture(params=ENGINES, scope="module")
def differences(periodicity, request):
    return Differences(periodicity, request.param)


def test_the_human_formulation_has_them_all():
    assert len(set(NAMES)) == len(NAMES) == 7
    for formulation in ("effort", "paper"):
        program = build_program(scenario(objective={"formulation": formulation}))
        assert [term.name for term in program.terms] == NAMES[:1]


@pytest.mark.parametrize("name", NAMES)
def test_gradients_are_slopes(differences, name):
    found, slopes = differences.gradients[name] @ differences.along, differences.slopes[name][-1]
    assert np.abs(found - slopes).max() < 1e-6 * np.abs(slopes).max()


@pytest.mark.parametrize("name", NAMES)
def test_hessians_are_slopes_of_gradients(differences, name):
    hessian, slopes = differences.hessians[name], differences.slopes[name][:-1]
    assert np.abs(hessian @ differences.along - slopes).max() < 1e-5 * np.abs(slopes).max()
    np.testing.assert_allclose(hessian, hessian.T, atol=1e-13 * np.abs(hessian).max())


PRICES = {
    "positive_work": 0.0,
    "negative_work": 0.0,
    "passive_cost": 0.0,
    "activation_time": 0.0,
    "steady_trunk": (0.0, 0.0, 0.0),
    "steady_head": 0.0,
}
OTHERS = {"negative_work": 9.0, "weighting": "strength", "knee": 0.7, "arms": 2.0}


@pytest.mark.parametrize("price_of", [*PRICES, "weighting", "knee", "arms"])
def test_each_is_what_the_checks_compute_from_the_frames_of_the_table(periodicity, price_of):
    """One price at a time, by code that shares nothing with the terms."""
    own = {key: value for key, value in PRICES.items() if key != price_of}
    own |= {key: value for key, value in OTHERS.items() if key == price_of}
    task = scenario(objective={"formulation": "human", **own}, periodicity=periodicity)
    program = build_program(task)
    free = near_walk(program)
    assert costs(program.gait(free)) == pytest.approx(program.cost(free)[0], rel=1e-11)


# --- work of fibres

POWERS = np.linspace(-400.0, 400.0, 801)


def test_positive_and_negative_parts_make_up_the_power():
    up, down = price(POWERS, 1.0, 0.0), price(POWERS, 0.0, 1.0)
    np.testing.assert_allclose(up.value - down.value, POWERS, atol=1e-11)
    np.testing.assert_allclose(up.value, down.value[::-1], atol=1e-11)
    both = price(POWERS, 34.0, 9.0)
    for part in ("value", "slope", "bend"):
        expected = 34.0 * getattr(up, part) + 9.0 * getattr(down, part)
        np.testing.assert_allclose(getattr(both, part), expected, atol=1e-9)


def test_the_price_is_convex_nothing_at_rest_and_that_of_the_work_where_it_is_much():
    up = price(POWERS, 1.0, 0.0)
    assert np.all(up.bend > 0.0)
    assert np.all(np.diff(up.value) > 0.0)
    assert np.all((up.slope > 0.0) & (up.slope < 1.0))
    assert up.value[400] == 0.0
    much = price(np.array([-1e5, 1e5]), 1.0, 0.0)
    np.testing.assert_allclose(much.value, [-ROUNDING / 2, 1e5 - ROUNDING / 2], atol=0.01)
    assert np.abs(up.value - np.maximum(POWERS, 0.0)).max() <= ROUNDING / 2


def test_slope_and_bend_of_the_price_are_derivatives():
    found, step = price(POWERS, 34.0, 9.0), 1e-3
    ahead, behind = price(POWERS + step, 34.0, 9.0), price(POWERS - step, 34.0, 9.0)
    np.testing.assert_allclose(found.slope, (ahead.value - behind.value) / 2 / step, atol=1e-6)
    np.testing.assert_allclose(found.bend, (ahead.slope - behind.slope) / 2 / step, atol=1e-6)


@pytest.fixture(scope="module")
def step():
    """A walk at the instants of a step that is its own mirror image, and their spacing."""
    task = scenario(intervals=40)
    program = build_program(task)
    return program.instants(near_walk(program)), program.functions.spacing


def test_over_a_step_that_repeats_itself_a_tendon_takes_what_it_gives(step):
    """Priced alike, what is given less what is taken: the same for a tendon of any stiffness."""
    now, spacing = step
    dt = now.t[1] - now.t[0]
    found = [ankle_work(1.0, -1.0, k, dt).value(now, spacing) for k in (50.0, 350.0, 1e12)]
    np.testing.assert_allclose(found, found[-1], rtol=1e-9)


def test_behind_a_stiff_tendon_fibres_move_as_the_joint_does(step):
    now, spacing = step
    dt = now.t[1] - now.t[0]
    found = ankle_work(34.0, 0.0, 1e12, dt).value(now, spacing)
    tau, v = (x[:, ANKLES] for x in (now.muscle_torque, now.v))
    after = [np.vstack([x[1:], x[:1, ::-1]]) for x in (tau, v)]
    power = (tau + after[0]) * (v + after[1]) / 4.0
    assert found == pytest.approx(dt * price(power, 34.0, 0.0).value.sum(), rel=1e-9)
    soft = ankle_work(34.0, 0.0, 350.0, dt).value(now, spacing)
    assert abs(soft - found) > 0.01 * abs(found)


def test_the_fibres_of_all_other_joints_move_as_their_joints_do(step):
    now, spacing = step
    paid = np.delete(price(now.muscle_torque * now.v, 34.0, 0.0).value, ANKLES, axis=1)
    found = joint_work(34.0, 0.0).value(now, spacing)
    assert found == pytest.approx(spacing @ paid.sum(axis=1))


# --- activation


def test_squared_torques_and_rates_are_the_squared_excitation():
    """A muscle that follows T tau' + tau = e: the mixed term adds up to nothing."""
    K, T, lag = 1000, 0.55, 0.04
    t = T * np.arange(K) / K
    rng = np.random.default_rng(3)
    size, phase = rng.normal(size=(2, 4, 55))
    waves = np.pi * np.arange(4)[:, None] / T  # of the stride, which has two steps

    def stride(t, order):
        angle = waves * t + phase + order * np.pi / 2
        return np.sum(size * waves**order * np.cos(angle), axis=0)

    def torque(order):
        """tau(T) is the mirror image of tau(0)."""
        turned = [MIRROR_SIGN * stride(s + T, order)[MIRROR_INDEX] for s in t]
        return np.array([stride(s, order) for s in t]) + turned

    tau, rate = torque(0), torque(1)
    now = SimpleNamespace(muscle_torque=tau, q=tau)
    spacing = np.full(K, T / K)
    weights = np.ones(55)
    found = squared_torque(weights).value(now, spacing)
    found += squared_torque_rate(lag**2 * weights, T / K).value(now, spacing)
    assert found == pytest.approx(spacing @ np.sum((tau + lag * rate) ** 2, axis=1), rel=1e-4)


def test_tissues_pay_for_what_they_bear(step):
    now, spacing = step
    found = squared_passive_torque(np.full(55, 2.0)).value(now, spacing)
    borne = now.torque - now.muscle_torque
    assert found == pytest.approx(2.0 * spacing @ np.sum(borne**2, axis=1))


# --- steadiness

TIMES = np.linspace(0.0, 0.5, 4)
SPACING = np.array([0.1, 0.2, 0.15, 0.1])
TURNS = {"pelvis_rx": 0, "pelvis_rz": 1, "pelvis_ry": 2}


def moving(q=(), v=()):
    """Instants of a body that is upright and at rest but for some DOF."""
    states = np.zeros((3, 4, 55))
    for order, changes in enumerate((q, v)):
        for name, value in dict(changes).items():
            states[order, :, index(name)] = value
    return Walker(scenario()).at(TIMES, *states)


def test_who_glides_upright_is_steady():
    glide = {"pelvis_tz": 1.2, "pelvis_ty": 0.1, "pelvis_tx": -0.1, "knee_flexion_r": 2.0}
    now = moving({"pelvis_tz": 0.3, "hip_flexion_l": 0.4}, glide)
    assert steady_trunk(np.ones(3)).value(now, SPACING) == 0.0
    assert steady_head(1.0).value(now, SPACING) == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize("name", TURNS)
def test_turning_costs_by_its_axis_whichever_joint_turns(name):
    weights = np.array([7.0, 11.0, 13.0])
    now = moving(v={name: 0.5})
    found = steady_trunk(weights).value(now, SPACING)
    assert found == pytest.approx(weights[TURNS[name]] * 0.25 * SPACING.sum())


def test_a_lean_that_stays_is_steady_for_the_trunk_and_not_for_the_head():
    now = moving({"pelvis_rx": 0.3})
    assert steady_trunk(np.ones(3)).value(now, SPACING) == 0.0
    found = steady_head(5.0).value(now, SPACING)
    assert found == pytest.approx(5.0 * 2.0 * (1.0 - np.cos(0.3)) * SPACING.sum())


@pytest.mark.parametrize("name", ["pelvis_rz", "pelvis_ry", "neck_upper_flexion", "spine2_lateral"])
def test_the_heads_angle_from_upright_counts_whichever_joint_turns_it(name):
    found = steady_head(1.0).value(moving({name: 0.2}), SPACING)
    assert found == pytest.approx(2.0 * (1.0 - np.cos(0.2)) * SPACING.sum())


def test_states_near_a_walk_are_unsteady():
    now = Walker(scenario()).at(*walking_states(scenario()))
    spacing = np.full(len(now.t), 0.1)
    assert steady_trunk(np.ones(3)).value(now, spacing) > 0.0
    assert steady_head(1.0).value(now, spacing) > 0.0
