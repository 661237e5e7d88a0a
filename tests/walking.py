"""A walk that needs no solver: the initial guess, nearly on its footholds, as a Gait."""

from functools import cache

from walks import EFFORT

from human_gait.body.person import make_body
from human_gait.scenario import Scenario
from human_gait.walk.bspline import Basis
from human_gait.walk.contact_plan import ContactPlan
from human_gait.walk.cycle import step_cycle
from human_gait.walk.gait import Gait
from human_gait.walk.initial_guess import initial_guess


@cache
def guessed_gait(load_mass=0.0):
    scenario = Scenario.from_dict(
        {
            "name": "guessed walk",
            "subject": {"sex": "male", "mass": 78.4},
            "walk": {"speed": 1.2, "step_length": 0.66},
            "load": {"mass": load_mass},
            "discretisation": {"control_points": 9},
            "objective": EFFORT,
        }
    )
    body = make_body(scenario.subject, scenario.load)
    basis = Basis.uniform(step_cycle(scenario.walk), 9)
    free = initial_guess(scenario, body, ContactPlan(scenario, body), basis)
    return Gait(scenario, basis.breaks, basis.expand(free))
