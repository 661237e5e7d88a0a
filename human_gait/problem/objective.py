"""The objective: the integral of the squared joint torques, Eq. (18)."""

from __future__ import annotations

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.limits import torque_limits
from human_gait.body.skeleton import N_DOF
from human_gait.scenario import Scenario
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.instant import Instants

REFERENCE_STRENGTH = 100.0
"""Strength of a joint whose torques count as they are, [N m]."""


def torque_weights(scenario: Scenario) -> FloatArray:
    """Return the weights w_i (55,) of the squared torques.

    ``strength``: (100 N m / strength_i)^2, the mean strength of the joint's two directions. Effort
    is then relative to what a joint can give: 10 N m are little for a hip and much for a wrist.
    ``none``: 1, the objective of the paper.
    """
    if scenario.objective.weighting == "none":
        return np.ones(N_DOF)
    lower, upper = torque_limits(scenario.subject, deviations=0.0)
    return np.asarray((2.0 * REFERENCE_STRENGTH / (upper - lower)) ** 2)


def torque_squared(
    now: Instants, spacing: FloatArray, weights: FloatArray
) -> tuple[float, FloatArray]:
    """Return the integral of the weighted squared muscle torques, and its partials.

    Parameters
    ----------
    now : Instants
        K instants.
    spacing : (K,) array, [s]
        The time that each stands for; together T.
    weights : (55,) array

    Returns
    -------
    value : float, [N^2 m^2 s]
    partials : (K, 165) array
        In q, v, a of each instant.
    """
    tau, weight = now.muscle_torque, np.multiply.outer(spacing, weights)
    value = float(np.sum(weight * tau.value**2))
    return value, np.einsum("ki,kis->ks", 2.0 * weight * tau.value, tau.partials)


def lean_on_torques(
    now: Instants, spacing: FloatArray, weights: FloatArray, adjoint: Adjoint
) -> None:
    """Add the first and second derivatives of the integral by the torques to an adjoint."""
    weight = 2.0 * np.multiply.outer(spacing, weights)
    adjoint.torque[:] += weight * now.muscle_torque.value
    adjoint.torque_second[:] += weight
