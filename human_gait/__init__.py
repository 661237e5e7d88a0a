"""Prediction of human walking by optimisation, with a skeleton of 55 degrees of freedom."""

import importlib
from typing import Any

from human_gait.exceptions import (
    GaitError,
    ModelError,
    NoSolutionFound,
    ResultError,
    ScenarioError,
)
from human_gait.scenario import Scenario, load_scenario

# Made available on first use: a solver or a browser viewer takes up to a second to import.
_ROOM_OF = {
    "Gait": "walk.gait",
    "bspline_trajectory": "problem.drake",
    "build_program": "problem.program",
    "play": "playback.page",
    "predict": "prediction",
    "solve": "solving.solver",
    "verify": "checks.verification",
}

__all__ = [
    "Gait",
    "GaitError",
    "ModelError",
    "NoSolutionFound",
    "ResultError",
    "Scenario",
    "ScenarioError",
    "bspline_trajectory",
    "build_program",
    "load_scenario",
    "play",
    "predict",
    "solve",
    "verify",
]


def __getattr__(name: str) -> Any:
    """Import the room of a public name when the name is used for the first time."""
    if name not in _ROOM_OF:
        message = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(message)
    return getattr(importlib.import_module(f"{__name__}.{_ROOM_OF[name]}"), name)
