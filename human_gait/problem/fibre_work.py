"""What the work of muscle fibres costs: positive and negative, behind a tendon at the ankle.

The fibres of a muscle with the torque tau give the power

    P = tau (v + (dtau/dt) / k),

k the stiffness of the tendon in series: it stretches by tau / k, and what it stores the fibres have
given. Ankles have a long tendon; at all other joints fibres move as the joint does, P = tau v.
Positive and negative parts are rounded where P is small,

    P+ = (sqrt(P^2 + eps^2) - eps + P) / 2,        P- = P+ - P.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import ANKLES, N_DOF
from human_gait.dynamics.inverse_dynamics import ROOT
from human_gait.problem.term import UNIT, Term
from human_gait.walk.adjoint import Adjoint, Image, add_at_next, at_next
from human_gait.walk.instant import Instants

ROUNDING = 20.0
"""eps, [W]: with 5 W solves with many control points end before they are optimal."""

_OTHER = Image(np.array([1, 0]), np.ones(2))  # at T an ankle is as the other one at 0
_RIGID = np.setdiff1d(np.arange(len(ROOT), N_DOF), ANKLES)


class Price(NamedTuple):
    """The price of a power at each P, and its first and second derivatives."""

    value: FloatArray
    slope: FloatArray
    bend: FloatArray


def price(P: FloatArray, positive: float, negative: float) -> Price:
    """Return what fibres pay for powers P [W], by prices of positive and of negative work."""
    root = np.sqrt(P**2 + ROUNDING**2)
    both, lean = (positive + negative) / 2.0, (positive - negative) / 2.0
    return Price(
        both * (root - ROUNDING) + lean * P, both * P / root + lean, both * ROUNDING**2 / root**3
    )


def joint_work(positive: float, negative: float) -> Term:
    """Return the cost of the work of all fibres but those of the ankles, P = tau v.

    Parameters
    ----------
    positive, negative : float, [N^2 m^2 s/J]
        Price of a joule that is given, and of one that is taken up.
    """

    def paid(now: Instants) -> tuple[FloatArray, FloatArray, Price]:
        tau, v = now.muscle_torque[:, _RIGID], now.v[:, _RIGID]
        return tau, v, price(tau * v, positive, negative)

    def value(now: Instants, spacing: FloatArray) -> float:
        return float(spacing @ paid(now)[2].value.sum(axis=1))

    def add_to_adjoint(now: Instants, spacing: FloatArray, factor: float, adjoint: Adjoint) -> None:
        tau, v, cost = paid(now)
        slope, bend = (factor * spacing[:, None] * part for part in (cost.slope, cost.bend))
        adjoint.torque[:, _RIGID] += slope * v
        adjoint.state[:, 1, _RIGID] += slope * tau
        adjoint.torque_second[:, _RIGID] += bend * v**2
        adjoint.torque_velocity[:, _RIGID] += slope + bend * tau * v
        adjoint.velocity_second[:, _RIGID] += bend * tau**2

    return Term("work of fibres", UNIT, "", value, add_to_adjoint)


def ankle_work(
    positive: float, negative: float, stiffness: float, interval: float, mirrored: bool = True
) -> Term:
    """Return the cost of the work of the ankles' fibres, between neighbouring instants.

    At the middle between two, with tau, v at the one and tau', v' at the other,

        P = (tau + tau') (v + v') / 4 + (tau'^2 - tau^2) / (2 k dt).

    Parameters
    ----------
    positive, negative : float, [N^2 m^2 s/J]
    stiffness : float, [N m/rad]
        k, of the tendon.
    interval : float, [s]
        dt, from one instant to the next.
    mirrored : bool
        As of `squared_torque_rate`.
    """
    storing = 1.0 / (2.0 * stiffness * interval)

    def paid(now: Instants) -> tuple[FloatArray, FloatArray, Price]:
        """Return P's partials (4, K, 2) by tau, v, tau', v', the second ones (4, 4), the price."""
        tau, v = (_two(x, mirrored) for x in (now.muscle_torque, now.v))
        sum_tau, sum_v = sum(tau) / 4.0, sum(v) / 4.0
        P = 4.0 * sum_tau * sum_v + storing * (tau[1] ** 2 - tau[0] ** 2)
        by = [sum_v - 2.0 * storing * tau[0], sum_tau, sum_v + 2.0 * storing * tau[1], sum_tau]
        return np.stack(by), _SECOND + storing * _STORED, price(P, positive, negative)

    def value(now: Instants, _: FloatArray) -> float:
        return float(interval * paid(now)[2].value.sum())

    def add_to_adjoint(now: Instants, _: FloatArray, factor: float, adjoint: Adjoint) -> None:
        by, second, cost = paid(now)
        slope, bend = factor * interval * cost.slope, factor * interval * cost.bend
        H = bend * by[:, None] * by[None] + slope * second[..., None, None]  # (4, 4, K, 2)
        _add(adjoint.torque, slope * by[0], slope * by[2], mirrored)
        _add(adjoint.state[:, 1], slope * by[1], slope * by[3], mirrored)
        _add(adjoint.torque_second, H[0, 0], H[2, 2], mirrored)
        _add(adjoint.torque_velocity, H[0, 1], H[2, 3], mirrored)
        _add(adjoint.velocity_second, H[1, 1], H[3, 3], mirrored)
        onward = slice(by.shape[1]), ANKLES
        adjoint.torque_next[onward] += H[0, 2]
        adjoint.torque_velocity_next[onward] += H[0, 3]
        adjoint.velocity_torque_next[onward] += H[1, 2]
        adjoint.velocity_next[onward] += H[1, 3]

    return Term("work of fibres behind the tendon", UNIT, "", value, add_to_adjoint)


# Second derivatives of P by tau, v, tau', v': of the product of the sums, and of what is stored.
_SECOND = np.array([[0, 1, 0, 1], [1, 0, 1, 0], [0, 1, 0, 1], [1, 0, 1, 0]]) / 4.0
_STORED = np.diag([-2.0, 0.0, 2.0, 0.0])


def _two(values: FloatArray, mirrored: bool) -> tuple[FloatArray, FloatArray]:
    """Return a quantity (K, 55, ...) of the ankles at instants and at those that follow."""
    ankles = values[:, ANKLES]
    after = at_next(ankles, mirrored, _OTHER)
    return ankles[: len(after)], after


def _add(total: FloatArray, here: FloatArray, onward: FloatArray, mirrored: bool) -> None:
    """Add what is of the ankles at instants and at those that follow to the total (K, 55)."""
    both = np.zeros((len(total), len(ANKLES)))
    both[: len(here)] += here
    add_at_next(both, onward, mirrored, _OTHER)
    total[:, ANKLES] += both
