"""What a walk costs, from its samples: the objective once more, with nothing of the optimiser's.

Rotations come from the frames of the DH table, rates and work from neighbouring instants.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.dh import frames
from human_gait.body.limits import torque_weights
from human_gait.body.skeleton import ANKLES, BRANCHES, N_DOF, PRISMATIC, SEGMENTS
from human_gait.walk.gait import Gait, Samples, constrained_grid

ROUNDING = 20.0
"""Of positive and negative power where it is small, [W]."""
_MOVES_THORAX = [*BRANCHES["virtual"], *BRANCHES["spine"]]
_PITCH_ROLL_YAW = [0, 2, 1]  # about x, z and y


def costs(gait: Gait) -> float:
    """Return the scenario's objective of a walk without costs of one's own, [N^2 m^2 s]."""
    cost, weights = gait.scenario.objective, torque_weights(gait.scenario)
    times, spacing = constrained_grid(gait.scenario)
    now, dt = gait.seen_samples, times[1] - times[0]
    tau = _Pair.of(now.active, gait)
    rates = (tau.after - tau.before) / dt
    passive = now.tau - now.active
    turned, head = _turning(gait, now)
    total = spacing @ (now.active**2 @ weights + cost.passive_cost * np.sum(passive**2, axis=1))
    total += dt * cost.activation_time**2 * np.sum(rates**2 @ weights)
    total += spacing @ (turned**2 @ np.array(cost.steady_trunk) + cost.steady_head * head)
    return float(total + _work(gait, now, spacing, dt))


class _Pair(NamedTuple):
    """A quantity (K, 55) at instants and at those that follow."""

    before: FloatArray
    after: FloatArray

    @classmethod
    def of(cls, values: FloatArray, gait: Gait) -> _Pair:
        """Return the pairs; after the last instant of a mirrored step its first one, turned."""
        if not gait.basis.mirrored:
            return cls(values[:-1], values[1:])
        image = gait.cycle.turned(values[:1], np.ones(1, dtype=int))
        return cls(values, np.concatenate([values[1:], image]))


def _work(gait: Gait, now: Samples, spacing: FloatArray, dt: float) -> float:
    """Return what the work of the fibres costs, that of the ankles behind their tendons."""
    cost = gait.scenario.objective
    prices = cost.positive_work, cost.negative_work
    others = np.setdiff1d(np.arange(6, N_DOF), ANKLES)
    joints = spacing @ _paid(now.active * now.v, *prices)[:, others].sum(axis=1)
    tau, v = (_Pair.of(values, gait) for values in (now.active, now.v))
    stretching = (tau.after - tau.before) / dt / cost.tendon_stiffness
    power = (tau.before + tau.after) / 2.0 * ((v.before + v.after) / 2.0 + stretching)
    return float(joints + dt * _paid(power, *prices)[:, ANKLES].sum())


def _paid(P: FloatArray, positive: float, negative: float) -> FloatArray:
    """Return prices of powers: positive P+ + negative P-, P+ = (sqrt(P^2 + e^2) - e + P) / 2."""
    size = np.sqrt(P**2 + ROUNDING**2) - ROUNDING
    return np.asarray((positive * (size + P) + negative * (size - P)) / 2.0)


def _turning(gait: Gait, now: Samples) -> tuple[FloatArray, FloatArray]:
    """Return pitch, roll and yaw rate (K, 3) of the thorax, and the head's 2 (1 - cos angle)."""
    P, A = frames(gait.body.table, now.q)
    axes = np.where(PRISMATIC[:, None], 0.0, P[..., :3, 2])[:, _MOVES_THORAX]
    omega = np.einsum("kjx,kj->kx", axes, now.v[:, _MOVES_THORAX])
    upright = frames(gait.body.table, np.zeros(N_DOF))[1][SEGMENTS["head"], :3, :3]
    turn = A[:, SEGMENTS["head"], :3, :3] @ upright.T
    return omega[:, _PITCH_ROLL_YAW], 3.0 - np.trace(turn, axis1=1, axis2=2)
