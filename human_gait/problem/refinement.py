"""The problem of a gait with more control points: knots are inserted, the motion stays as it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import ScenarioError
from human_gait.problem.program import GaitProgram, build_program
from human_gait.walk.gait import Gait


def refined_program(
    gait: Gait, n_control_points: int, dynamics: str = "pinocchio"
) -> tuple[GaitProgram, FloatArray]:
    """Return the problem of a gait with more control points, and where to start: the same gait.

    Knots are inserted, so that the curves stay as they are. The constrained grid grows by whole
    multiples, until there are two intervals to each polynomial piece.

    Parameters
    ----------
    gait : Gait
    n_control_points : int
        Per DOF.
    dynamics : str
        As in `build_program`.

    Raises
    ------
    ScenarioError
        If these are not more control points than the gait has, or too many.
    """
    grid = gait.scenario.discretisation
    most = int(grid.rule("control_points")["range"][1])
    if n_control_points > most:
        allowed = f"must be at most {most}"
        raise ScenarioError("discretisation.control_points", allowed, n_control_points)
    if n_control_points <= gait.basis.n_control_points:
        allowed = f"must be more than the {gait.basis.n_control_points} there are"
        raise ScenarioError("discretisation.control_points", allowed, n_control_points)
    basis = gait.basis.refined(n_control_points)
    multiple = int(np.ceil(2 * basis.n_pieces / grid.intervals))
    finer = replace(grid, control_points=n_control_points, intervals=multiple * grid.intervals)
    scenario = replace(gait.scenario, discretisation=finer)
    P = gait.basis.insert(basis, gait.control_points)
    return build_program(scenario, basis, dynamics), P[: basis.n_free].ravel()
