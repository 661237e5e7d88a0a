"""What the tests of walking share: small scenarios, motions near a walk and finite differences."""

import numpy as np

from human_gait.body.skeleton import BRANCHES, DOF_NAMES
from human_gait.problem.program import build_program
from human_gait.scenario import Scenario

MAN = {"stature": 1.755, "mass": 78.4}
EFFORT = {"formulation": "effort"}
"""The objective of walks that are solved soonest: for tests that need any walk."""


def scenario(
    speed=1.2,
    step_length=0.66,
    step_width=0.1,
    control_points=7,
    intervals=12,
    dynamics_per_interval=1,
    periodicity="acceleration",
    **sections,
):
    """A coarse scenario of the formulation `effort`; further sections as tables, as in a file."""
    walk = {"speed": speed, "step_length": step_length, "step_width": step_width}
    grid = {
        "control_points": control_points,
        "intervals": intervals,
        "dynamics_per_interval": dynamics_per_interval,
        "periodicity": periodicity,
    }
    tables = {"name": "test", "walk": walk, "discretisation": grid, "subject": MAN, **sections}
    tables["objective"] = EFFORT | tables.get("objective", {})
    return Scenario.from_dict(tables)


_MOVING = ("virtual", "right_leg", "left_leg")
_HELD = [DOF_NAMES[i] for branch in set(BRANCHES) - set(_MOVING) for i in BRANCHES[branch]]
STILL = {"frozen": sorted(n for n in _HELD if not n.startswith(("shoulder_flexion", "elbow")))}
"""Limits that leave legs, pelvis and swinging arms: for solvers that take long."""

BACKPACK = {"mass": 18.0, "position": [0.0, 0.05, -0.22]}
PEOPLE = {
    "male": scenario(),
    "female": scenario(subject={"sex": "female"}),
    "tall": scenario(subject={"sex": "male", "stature": 1.95}, step_length=0.75),
    "small and slow": scenario(0.8, 0.45, 0.14, subject={"sex": "female", "stature": 1.5}),
    "with a backpack": scenario(load=BACKPACK, phases={"double_support": 0.3, "foot_flat": 0.2}),
}


def near_walk(program, seed=0, noise=0.02):
    """Free control points, flat: the guess with every joint disturbed, the least symmetric walk."""
    guess = program.guess()
    return guess + noise * np.random.default_rng(seed).uniform(-1, 1, guess.shape)


def walking_states(task, seed=0):
    """Times, q, v, a at instants of a disturbed guess, some in double support, some not."""
    program = build_program(task)
    now = program.instants(near_walk(program, seed))
    return now.t, now.q, now.v, now.a


def central_difference(function, x, directions, step=1e-6):
    """Derivatives of a function along directions (n, d), (..., d); error of the order step^2."""
    columns = [
        (function(x + step * d) - function(x - step * d)) / (2 * step)
        for d in np.transpose(directions)
    ]
    return np.stack(columns, axis=-1)
