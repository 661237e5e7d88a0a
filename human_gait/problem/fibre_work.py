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

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import N_DOF, SIDES, index
from human_gait.problem.term import UNIT, Term
from human_gait.walk.adjoint import JOINTS, Adjoint, at_next
from human_gait.walk.instant import Instants

ROUNDING = 20.0
"""eps, [W]: with 5 W solves with many control points end before they are optimal."""

_ANKLES = np.array([index(f"ankle_dorsiflexion_{side}") for side in SIDES])
_RIGID = np.setdiff1d(JOINTS, _ANKLES)


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
        tau, v = now.muscle_torque.value[:, _RIGID], now.v[:, _RIGID]
        return tau, v, price(tau * v, positive, negative)

    def evaluate(now: Instants, spacing: FloatArray) -> tuple[float, FloatArray]:
        tau, v, cost = paid(now)
        slope = spacing[:, None] * cost.slope
        by = np.einsum("ki,kis->ks", slope * v, now.muscle_torque.partials[:, _RIGID])
        by[:, N_DOF + _RIGID] += slope * tau
        return float(spacing @ cost.value.sum(axis=1)), by

    def add_to_adjoint(now: Instants, spacing: FloatArray, factor: float, adjoint: Adjoint) -> None:
        tau, v, cost = paid(now)
        slope, bend = (factor * spacing[:, None] * part for part in (cost.slope, cost.bend))
        adjoint.torque[:, _RIGID] += slope * v
        adjoint.torque_second[:, _RIGID] += bend * v**2
        # by tau and v: slope + bend tau v;  by v twice: bend tau^2
        turned = _by_velocity(len(tau), _RIGID)
        J = now.muscle_torque.partials[:, _RIGID]
        mixed = (slope + bend * tau * v)[..., None] * J + (bend * tau**2 / 2.0)[..., None] * turned
        adjoint.products.append((mixed, turned))

    return Term("work of fibres", UNIT, "", evaluate, add_to_adjoint)


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
        tau, v = (_two(x, mirrored) for x in (now.muscle_torque.value, now.v))
        sum_tau, sum_v = sum(tau) / 4.0, sum(v) / 4.0
        P = 4.0 * sum_tau * sum_v + storing * (tau[1] ** 2 - tau[0] ** 2)
        by = [sum_v - 2.0 * storing * tau[0], sum_tau, sum_v + 2.0 * storing * tau[1], sum_tau]
        return np.stack(by), _SECOND + storing * _STORED, price(P, positive, negative)

    def rows(now: Instants) -> FloatArray:
        """Return the partials (4, K, 2, 165) of tau, v, tau', v' in the states of both instants."""
        J = now.muscle_torque.partials
        turned = np.zeros_like(J)
        turned[:, JOINTS, N_DOF + JOINTS] = 1.0
        (tau, tau_next), (v, v_next) = (_two(x, mirrored) for x in (J, turned))
        return np.stack([tau, v, tau_next, v_next])

    def evaluate(now: Instants, _: FloatArray) -> tuple[float, FloatArray]:
        by, _, cost = paid(now)
        R, parts = rows(now), interval * cost.slope * by
        here, onward = (np.einsum("aki,akis->ks", parts[a], R[a]) for a in _ENDS)
        total = np.zeros((len(now.t), 3 * N_DOF))
        total[: len(here)] += here
        total[_onward(len(onward), len(total))] += onward
        return float(interval * cost.value.sum()), total

    def add_to_adjoint(now: Instants, _: FloatArray, factor: float, adjoint: Adjoint) -> None:
        by, second, cost = paid(now)
        slope, bend = factor * interval * cost.slope, factor * interval * cost.bend
        H = bend * by[:, None] * by[None] + slope * second[..., None, None]  # (4, 4, K, 2)
        R, K = rows(now), len(now.t)
        _add_slopes(adjoint, slope * by[0], slope * by[2], mirrored)
        here = np.arange(by.shape[1])
        adjoint.pairs.append((_flat(np.einsum("abki,akis->bkis", H[:2, 2:], R[:2])), _flat(R[2:])))
        for end, at in zip(_ENDS, (here, _onward(len(here), K)), strict=True):
            half = np.einsum("abki,akis->bkis", H[end, end] / 2.0, R[end])
            adjoint.products.append((_at(at, K, half), _at(at, K, R[end])))

    return Term("work of fibres behind the tendon", UNIT, "", evaluate, add_to_adjoint)


# Second derivatives of P by tau, v, tau', v': of the product of the sums, and of what is stored.
_SECOND = np.array([[0, 1, 0, 1], [1, 0, 1, 0], [0, 1, 0, 1], [1, 0, 1, 0]]) / 4.0
_STORED = np.diag([-2.0, 0.0, 2.0, 0.0])


_ENDS = slice(0, 2), slice(2, 4)  # what is of an instant, and of the next


def _onward(pairs: int, K: int) -> IntArray:
    """Return the instant that ends each pair; T is the mirror image of the first one."""
    return (np.arange(pairs) + 1) % K


def _two(values: FloatArray, mirrored: bool) -> tuple[FloatArray, FloatArray]:
    """Return a quantity of the ankles at instants and at those that follow."""
    after = at_next(values, mirrored)
    return values[: len(after), _ANKLES], after[:, _ANKLES]


def _add_slopes(adjoint: Adjoint, here: FloatArray, onward: FloatArray, mirrored: bool) -> None:
    """Add the derivatives by tau and tau' to those by the torques of the instants."""
    adjoint.torque[: len(here), _ANKLES] += here
    adjoint.torque[1:, _ANKLES] += onward[: len(adjoint.torque) - 1]
    if mirrored:  # tau(T) is that of the other ankle at 0
        adjoint.torque[0, _ANKLES[::-1]] += onward[-1]


def _flat(rows: FloatArray) -> FloatArray:
    """Return rows (2, K, 2, 165) by instant, (K, 4, 165)."""
    return rows.transpose(1, 0, 2, 3).reshape(rows.shape[1], -1, rows.shape[-1])


def _at(instants: IntArray, K: int, rows: FloatArray) -> FloatArray:
    """Return rows (2, k, 2, 165) at some instants as rows (K, 4, 165) at all."""
    whole = np.zeros((K, 4, rows.shape[-1]))
    whole[instants] = _flat(rows)
    return whole


def _by_velocity(K: int, joints: IntArray) -> FloatArray:
    """Return the partials (K, c, 165) of the velocities of joints."""
    rows = np.zeros((K, len(joints), 3 * N_DOF))
    rows[:, np.arange(len(joints)), N_DOF + joints] = 1.0
    return rows
