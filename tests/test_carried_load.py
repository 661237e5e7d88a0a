"""A load as a force (Eq. 9) against the recursion and against a rigid load."""

import numpy as np
import pytest
from bodies import random_states
from walks import BACKPACK, near_walk, scenario

from human_gait.body.links import GRAVITY
from human_gait.body.person import make_body
from human_gait.checks.verification import verify
from human_gait.dynamics.carried_load import THORAX, CarriedForce
from human_gait.dynamics.inverse_dynamics import PinocchioDynamics
from human_gait.dynamics.jet import Linearised
from human_gait.dynamics.recursive_lagrangian import ExternalLoad, inverse_dynamics
from human_gait.problem.program import build_program
from human_gait.scenario import Load, Subject
from human_gait.walk.gait_file import make_record
from human_gait.walk.instant import Walker

SUBJECT = Subject.default("male")
PACK = {"mass": 18.0, "position": (0.02, 0.05, -0.22)}
FORCE = make_body(SUBJECT, Load(**PACK, model="force"))
RIGID = make_body(SUBJECT, Load(**PACK))


def carried(q, v, a):
    alone = PinocchioDynamics(FORCE).inverse(q, v, a)
    wrench = Linearised(np.zeros((len(q), 6)), np.zeros((len(q), 6, 165)))
    return CarriedForce(FORCE).added(alone, wrench)[0].torque


def test_torques_are_those_of_the_recursion_with_an_external_force():
    q, v, a = random_states(5)
    weight = ExternalLoad(THORAX, FORCE.load_com, FORCE.load.mass * GRAVITY, np.zeros(3))
    expected = inverse_dynamics(FORCE, q, v, a, [weight])
    np.testing.assert_allclose(carried(q, v, a).value, expected, rtol=1e-10, atol=1e-9)


def test_partials_are_those_of_the_recursion():
    """Complex steps through the recursion, with the force at its point of the thorax."""
    q, v, a = (x[0] for x in random_states(1))
    weight = ExternalLoad(THORAX, FORCE.load_com, FORCE.load.mass * GRAVITY, np.zeros(3))
    step = 1e-30j * np.eye(55)
    found = carried(q[None], v[None], a[None]).partials[0].reshape(55, 3, 55)
    for order, state in enumerate(((q + step, v, a), (q, v + step, a), (q, v, a + step))):
        expected = inverse_dynamics(FORCE, *state, [weight]).imag.T / 1e-30
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found[:, order], expected, atol=1e-10 * scale)


def test_standing_still_it_weighs_as_much_as_a_rigid_load():
    q, still = random_states(4)[0], np.zeros((4, 55))
    rigid = PinocchioDynamics(RIGID).inverse(q, still, still).torque.value
    np.testing.assert_allclose(carried(q, still, still).value, rigid, atol=1e-9)


def test_it_has_no_inertia():
    """The difference between moving and standing is that of the body alone."""
    q, v, a = random_states(4)
    alone = PinocchioDynamics(make_body(SUBJECT)).inverse
    moving = carried(q, v, a).value - alone(q, v, a).torque.value
    still = carried(q, 0 * v, 0 * a).value - alone(q, 0 * v, 0 * a).torque.value
    np.testing.assert_allclose(moving, still, atol=1e-9)
    assert np.abs(still).max() > 10.0


@pytest.mark.parametrize("model", ["rigid", "force"])
def test_the_ground_carries_body_and_load(model):
    """On average over a step; the rectangle rule leaves some 1e-4."""
    program = build_program(scenario(load=BACKPACK | {"model": model}, intervals=48))
    free = near_walk(program, noise=0.0)
    vertical = program.instants(free).ground.force.value[:, 1]
    weight = (program.scenario.subject.mass + BACKPACK["mass"]) * 9.81
    assert vertical.mean() == pytest.approx(weight, rel=5e-4)


def test_the_checks_know_the_force():
    """The engines carry the same force and agree; momentum and energy add up with it."""
    program = build_program(scenario(load=BACKPACK | {"model": "force"}))
    record = make_record(program.gait(near_walk(program, noise=0.0)))
    checks = {check.name: check for check in verify(record)}
    for claim in (
        "torques off Drake's",
        "unbalanced force or moment",
        "masses off the body",
    ):
        assert checks[claim].passed
    for claim in ("momentum off the impulse", "energy off joints' and ground's work"):
        assert checks[claim].passed


def test_a_walker_without_load_has_no_force_to_add():
    plain, loaded = (
        Walker(scenario(load={"mass": mass, "model": "force"})) for mass in (0.0, 10.0)
    )
    q, v, a = random_states(2)
    t = np.array([0.1, 0.3])
    none = Walker(scenario()).at(t, q, v, a).ground.force.value
    np.testing.assert_allclose(plain.at(t, q, v, a).ground.force.value, none, atol=1e-9)
    more = loaded.at(t, q, v, a).ground.force.value - none
    np.testing.assert_allclose(more, np.tile([0.0, 98.1, 0.0], (2, 1)), atol=1e-9)
