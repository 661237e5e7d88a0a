"""The objective: a sum of terms, integrals over the step of what walking costs.

By default it has one, the integral of the squared joint torques, Eq. (18). A term tells its value
with first derivatives by the state (q, v, a) of each instant, and what it asks of the adjoint, from
which exact second derivatives follow (`walk.adjoint`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.limits import torque_weights
from human_gait.body.skeleton import MIRROR_INDEX, MIRROR_SIGN
from human_gait.scenario import Scenario
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.instant import Instants

UNIT = "N^2 m^2 s"


@dataclass(frozen=True, eq=False)
class Term:
    """One term of the objective.

    Attributes
    ----------
    name, unit, equation : str
        All terms of an objective have its unit, N^2 m^2 s.
    evaluate : function
        Instants (K), the time (K,) [s] that each stands for -> value of the integral, and its
        partials (K, 165) in q, v, a of each instant.
    add_to_adjoint : function
        Instants, times (K,), factor, Adjoint: adds the derivatives of factor * integral to the
        adjoint. It may couple neighbouring instants (`Adjoint.torque_next`).
    """

    name: str
    unit: str
    equation: str
    evaluate: Callable[[Instants, FloatArray], tuple[float, FloatArray]]
    add_to_adjoint: Callable[[Instants, FloatArray, float, Adjoint], None]


def objective(scenario: Scenario) -> list[Term]:
    """Return the terms of a scenario's objective."""
    return [squared_torque(torque_weights(scenario))]


def squared_torque(weights: FloatArray) -> Term:
    """Return the integral of the squared muscle torques, Eq. (18): sum_i w_i tau_i^2 dt.

    Parameters
    ----------
    weights : (55,) array
    """

    def evaluate(now: Instants, spacing: FloatArray) -> tuple[float, FloatArray]:
        tau, weight = now.muscle_torque, np.multiply.outer(spacing, weights)
        value = float(np.sum(weight * tau.value**2))
        return value, np.einsum("ki,kis->ks", 2.0 * weight * tau.value, tau.partials)

    def add_to_adjoint(now: Instants, spacing: FloatArray, factor: float, adjoint: Adjoint) -> None:
        weight = 2.0 * np.multiply.outer(factor * spacing, weights)
        adjoint.torque[:] += weight * now.muscle_torque.value
        adjoint.torque_second[:] += weight

    return Term("squared torque", UNIT, "18", evaluate, add_to_adjoint)


def squared_torque_rate(weights: FloatArray, interval: float, mirrored: bool = True) -> Term:
    """Return the integral of the squared rates of the muscle torques: sum_i w_i (dtau_i/dt)^2 dt.

    Rates are differences of neighbouring instants; the end of a step that is its own mirror image
    (Eq. 26) has the mirrored torques of its beginning.

    Parameters
    ----------
    weights : (55,) array, [s^2]
    interval : float, [s]
        From one instant to the next.
    mirrored : bool
        Whether the instants leave out the end of the step.
    """

    def differences(now: Instants) -> FloatArray:
        tau = now.muscle_torque.value
        end = MIRROR_SIGN * tau[:1, MIRROR_INDEX]
        return np.diff(tau, axis=0, append=end) if mirrored else np.diff(tau, axis=0)

    def by_torque(now: Instants) -> FloatArray:
        """Return the derivative (K, 55) of the integral by each torque."""
        slope = 2.0 * weights * differences(now) / interval
        by = np.zeros_like(now.q)
        by[: len(slope)] -= slope
        by[1:] += slope[: len(by) - 1]
        if mirrored:
            by[0, MIRROR_INDEX] += MIRROR_SIGN * slope[-1]
        return by

    def evaluate(now: Instants, _: FloatArray) -> tuple[float, FloatArray]:
        value = float(np.sum(weights * differences(now) ** 2) / interval)
        return value, np.einsum("ki,kis->ks", by_torque(now), now.muscle_torque.partials)

    def add_to_adjoint(now: Instants, _: FloatArray, factor: float, adjoint: Adjoint) -> None:
        own = 2.0 * factor * weights / interval
        adjoint.torque[:] += factor * by_torque(now)
        adjoint.torque_second[:] += 2.0 * own
        adjoint.torque_next[:] -= own
        if not mirrored:
            adjoint.torque_second[[0, -1]] -= own
            adjoint.torque_next[-1] += own

    return Term("squared torque rate", UNIT, "", evaluate, add_to_adjoint)
