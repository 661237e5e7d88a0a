"""Limbs do not pass through each other."""

from __future__ import annotations

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.person import make_body
from human_gait.problem.residual import Constraint, Demand, Residual, Tolerance
from human_gait.scenario import Scenario
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.instant import Instants
from human_gait.walk.limb_shapes import LIMBS
from human_gait.walk.limbs import Depths, Limbs

LIMBS_APART = Demand(
    name="limbs apart",
    meaning="arms and legs have to pass beside each other and the trunk, not through them",
    tolerance=Tolerance("limbs_apart", upwards=True),
)

_AT_INSTANTS, _SOFT, _SIGHT = 0.5, 0.2, 4.0  # parts of the tolerance


def limbs_apart(scenario: Scenario, on: IntArray) -> Constraint:
    """Limbs are not deeper in each other than at rest, or not at all, by ``limbs_apart``.

    Not in the paper. In a step both sides take part: the next one is its mirror image.
    """
    tolerance = scenario.tolerances.limbs_apart
    body = make_body(scenario.subject, scenario.load)
    limbs = Limbs(body, _SOFT * tolerance, _SIGHT * tolerance)
    n, R = len(on), len(LIMBS)
    upper = np.full(n * R, _AT_INSTANTS * tolerance)
    at = np.arange(n)[:, None, None], np.arange(R)[:, None], limbs.columns
    last: list[tuple[Instants, Depths]] = []

    def depths(now: Instants) -> Depths:
        """Return those of the last instants without computing them again."""
        if not last or last[0][0] is not now:
            last[:] = [(now, limbs.depths(now.dynamics.link_poses[on], now.dynamics.axes[on]))]
        return last[0][1]

    def evaluate(now: Instants) -> Residual:
        found = depths(now)
        dq = found.dq[at].reshape(len(upper), -1)
        return Residual(found.value.ravel(), dq, 0.0 * dq, 0.0 * dq)

    def to_adjoint(now: Instants, multipliers: FloatArray, adjoint: Adjoint) -> None:
        second = limbs.hessian(depths(now), now.dynamics.axes[on], multipliers.reshape(n, -1))
        adjoint.posture_second[np.ix_(on, limbs.dofs, limbs.dofs)] += second

    return Constraint(
        demand=LIMBS_APART,
        unit="m",
        lower=upper - np.inf,
        upper=upper,
        instants=np.repeat(on, R),
        columns=np.tile(limbs.dofs[limbs.columns], (n, 1)),
        what=np.tile([*LIMBS], n),
        evaluate=evaluate,
        to_adjoint=to_adjoint,
    )
