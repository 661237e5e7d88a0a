"""The objective: a sum of terms, integrals over the step of what walking costs.

The first is the integral of the squared joint torques, Eq. (18), and in the paper's formulation the
only one. A term tells its value and what it asks of the adjoint, from which exact first and second
derivatives follow (`walk.adjoint`).
"""

from __future__ import annotations

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.limits import torque_weights
from human_gait.body.skeleton import N_DOF
from human_gait.problem.fibre_work import ankle_work, joint_work
from human_gait.problem.steadiness import steady_head, steady_trunk
from human_gait.problem.term import UNIT, Term
from human_gait.scenario import Scenario
from human_gait.walk.adjoint import Adjoint, add_at_next, at_next
from human_gait.walk.gait import instant_spacing
from human_gait.walk.instant import Instants


def objective(scenario: Scenario) -> list[Term]:
    """Return the terms of a scenario's objective: those that cost anything."""
    cost, weights = scenario.objective, torque_weights(scenario)
    mirrored, dt = scenario.discretisation.mirrored, instant_spacing(scenario)
    terms = [squared_torque(weights)]
    if cost.activation_time:
        terms.append(squared_torque_rate(weights * cost.activation_time**2, dt, mirrored))
    if cost.passive_cost:
        terms.append(squared_passive_torque(np.full(N_DOF, cost.passive_cost)))
    if cost.positive_work or cost.negative_work:
        prices = cost.positive_work, cost.negative_work
        terms += [joint_work(*prices), ankle_work(*prices, cost.tendon_stiffness, dt, mirrored)]
    if any(cost.steady_trunk):
        terms.append(steady_trunk(np.array(cost.steady_trunk)))
    if cost.steady_head:
        terms.append(steady_head(cost.steady_head))
    return terms


def squared_torque(weights: FloatArray) -> Term:
    """Return the integral of the squared muscle torques, Eq. (18): sum_i w_i tau_i^2 dt.

    Parameters
    ----------
    weights : (55,) array
    """
    return _squares("squared torque", "18", weights, "muscle_torque", ("torque", "torque_second"))


def squared_passive_torque(weights: FloatArray) -> Term:
    """Return the integral of the squared torques p of tissues: sum_i w_i p_i^2 dt.

    A joint that leans on its tissues loads them as muscles would be: without a price the trunk
    hangs in its ligaments.

    Parameters
    ----------
    weights : (55,) array
    """
    slopes = "passive", "passive_second"
    return _squares("squared passive torque", "", weights, "passive_torque", slopes)


def _squares(
    name: str, equation: str, weights: FloatArray, torque: str, slopes: tuple[str, str]
) -> Term:
    """Return the integral of squares of one of the torques (55,) that are known at instants.

    `slopes` are the derivatives by it, first and second, in the adjoint.
    """

    def value(now: Instants, spacing: FloatArray) -> float:
        tau: FloatArray = getattr(now, torque)
        return float(spacing @ (tau**2 @ weights))

    def add_to_adjoint(now: Instants, spacing: FloatArray, factor: float, adjoint: Adjoint) -> None:
        weight = 2.0 * np.multiply.outer(factor * spacing, weights)
        first, second = (getattr(adjoint, slope) for slope in slopes)
        first += weight * getattr(now, torque)
        second += weight

    return Term(name, UNIT, equation, value, add_to_adjoint)


def squared_torque_rate(weights: FloatArray, interval: float, mirrored: bool = True) -> Term:
    """Return the integral of the squared rates of the muscle torques: sum_i w_i (dtau_i/dt)^2 dt.

    A muscle that follows its excitation e by T dtau/dt + tau = e has, over a step that repeats
    itself, the integral of e^2 = tau^2 + T^2 (dtau/dt)^2: the mixed term is a total derivative.
    With w = T^2 and the squared torques this is the squared excitation.

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
        tau = now.muscle_torque
        after = at_next(tau, mirrored)
        return after - tau[: len(after)]

    def by_torque(now: Instants) -> FloatArray:
        """Return the derivative (K, 55) of the integral by each torque."""
        slope = 2.0 * weights * differences(now) / interval
        by = np.zeros_like(now.q)
        by[: len(slope)] -= slope
        add_at_next(by, slope, mirrored)
        return by

    def value(now: Instants, _: FloatArray) -> float:
        return float(np.sum(differences(now) ** 2 @ weights) / interval)

    def add_to_adjoint(now: Instants, _: FloatArray, factor: float, adjoint: Adjoint) -> None:
        own = 2.0 * factor * weights / interval
        adjoint.torque[:] += factor * by_torque(now)
        adjoint.torque_second[:] += 2.0 * own
        if not mirrored:
            adjoint.torque_second[[0, -1]] -= own
        adjoint.torque_next[: len(now.q) if mirrored else -1] -= own

    return Term("squared torque rate", UNIT, "", value, add_to_adjoint)
