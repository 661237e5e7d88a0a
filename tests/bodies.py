"""What the tests of the body share: bodies, random states and random loads."""

import numpy as np

from human_gait.body import skeleton
from human_gait.body.limits import position_limits
from human_gait.body.person import make_body
from human_gait.dynamics.recursive_lagrangian import ExternalLoad
from human_gait.scenario import Load, Subject

MAN, WOMAN = Subject("male", 1.755, 78.4), Subject("female", 1.626, 62.0)
MALE, FEMALE = make_body(MAN), make_body(WOMAN)
LOADED = make_body(MAN, Load(mass=18.1, position=(0.02, 0.07, -0.2)))
BODIES = {"male": MALE, "female": FEMALE, "with a backpack": LOADED}


def random_states(n, seed=0):
    """Postures inside the joint limits, faster and more abrupt than those of walking."""
    rng = np.random.default_rng(seed)
    lower, upper = position_limits()
    shape = (n, skeleton.N_DOF)
    return rng.uniform(lower, upper, shape), rng.uniform(-5, 5, shape), rng.uniform(-40, 40, shape)


def random_loads(n, seed=1):
    """Forces and moments on both feet, the toes and the thorax, for n instants."""
    rng = np.random.default_rng(seed)
    links = [skeleton.SEGMENTS[name] for name in ("foot_r", "toe_r", "foot_l", "thorax")]
    return [
        ExternalLoad(
            link,
            point=rng.uniform(-0.2, 0.2, (n, 3)),
            force=rng.uniform(-800, 800, (n, 3)),
            moment=rng.uniform(-80, 80, (n, 3)),
        )
        for link in links
    ]


def at_instant(loads, k):
    """The loads of one instant."""
    return [ExternalLoad(x.link, x.point[k], x.force[k], x.moment[k]) for x in loads]


def complex_step(function, x, step=1e-30):
    """Jacobian (n_f, n_x) of a function that takes (..., n_x), exact to rounding."""
    return function(x + 1j * step * np.eye(len(x))).imag.T / step
