"""Scenario: who walks, how fast, with what load, and how finely the motion is resolved."""

from human_gait.scenario.files import (
    load_scenario,
    scenario_file,
    scenario_of,
    shipped_scenarios,
)
from human_gait.scenario.limits import DofRange, Limits
from human_gait.scenario.person import Load, Subject
from human_gait.scenario.problem import Discretisation, Ground, Objective, Posture, Tolerances
from human_gait.scenario.step import Phases, Walk
from human_gait.scenario.whole import STEP_HALF_ANGLE_DEG, Scenario, lawful_name

__all__ = [
    "STEP_HALF_ANGLE_DEG",
    "Discretisation",
    "DofRange",
    "Ground",
    "Limits",
    "Load",
    "Objective",
    "Phases",
    "Posture",
    "Scenario",
    "Subject",
    "Tolerances",
    "Walk",
    "lawful_name",
    "load_scenario",
    "scenario_file",
    "scenario_of",
    "shipped_scenarios",
]
