"""Limbs do not pass through each other."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.person import Body, make_body
from human_gait.problem.residual import Constraint, Demand, Residual, Tolerance
from human_gait.scenario import Scenario
from human_gait.walk.adjoint import Adjoint, Block
from human_gait.walk.instant import Instants
from human_gait.walk.limb_shapes import LIMBS
from human_gait.walk.limbs import Depths, Limbs

LIMBS_APART = Demand(
    name="limbs apart",
    meaning="arms and legs have to pass beside each other and the trunk, not through them",
    tolerance=Tolerance("limbs_apart", upwards=True),
)

# Parts of the tolerance, and how many metres they are at most:
_BETWEEN = 0.8, 4e-3  # for what is between the instants, when limbs pass
_ROUNDING = 0.1, 5e-4  # how round the maximum over a limb is
_GAP = 2.5e-3  # [m] that limbs which are apart at rest keep: they are the ones that pass quickly
_SIGHT = 0.2  # [m]: a step should know of what it can reach


def limbs_apart(scenario: Scenario, times: FloatArray) -> Constraint:
    """Limbs are not deeper in each other than at rest, or in each other, by ``limbs_apart``.

    Not in the paper. One step shows both sides: the next one is its mirror image.
    """
    tolerance = scenario.tolerances.limbs_apart
    between, rounding = (min(part * tolerance, most) for part, most in (_BETWEEN, _ROUNDING))
    limbs = _limbs(make_body(scenario.subject, scenario.load), rounding)
    K, R = len(times), len(LIMBS)
    upper = np.full(K * R, tolerance - between)
    each = np.arange(R)[:, None], limbs.columns
    last: list[tuple[Instants, Depths]] = []

    def depths(now: Instants) -> Depths:
        """Return those of the instants, without computing the last ones again."""
        if not last or last[0][0] is not now:
            last[:] = [(now, limbs.depths(now.dynamics.link_poses, now.dynamics.axes))]
        return last[0][1]

    def evaluate(now: Instants) -> Residual:
        found = depths(now)
        dq = found.dq[:, *each].reshape(len(upper), -1)
        return Residual(found.value.ravel(), dq, 0.0 * dq, 0.0 * dq)

    def to_adjoint(
        now: Instants, multipliers: FloatArray, curvature: FloatArray, adjoint: Adjoint
    ) -> None:
        second = limbs.hessian(depths(now), now.dynamics.axes, multipliers.reshape(K, R))
        dq = depths(now).dq
        second += (dq.swapaxes(1, 2) * curvature.reshape(K, 1, R)) @ dq
        adjoint.blocks.append(Block(np.arange(limbs.dofs.start, limbs.dofs.stop), second))

    return Constraint(
        demand=LIMBS_APART,
        unit="m",
        lower=upper - np.inf,
        upper=upper,
        instants=np.repeat(np.arange(K), R),
        columns=np.tile(limbs.dofs.start + limbs.columns, (K, 1)),
        what=np.tile([*LIMBS], K),
        evaluate=evaluate,
        to_adjoint=to_adjoint,
    )


@lru_cache(maxsize=8)
def _limbs(body: Body, rounding: float) -> Limbs:
    """Return the limbs of a body, the same ones for the next walk of the same person."""
    return Limbs(body, rounding, _SIGHT, _GAP)
