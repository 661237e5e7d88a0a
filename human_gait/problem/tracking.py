"""A cost of one's own that follows the joint angles of another walk, measured or predicted.

    weight * int sum_i (q_i - r_i)^2 dt

over the 49 joints and the three turns of the pelvis, r_i their angles in the walk that is followed
at the same share of the step. Where the pelvis is in the world is left free.
"""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import PRISMATIC
from human_gait.problem.term import UNIT, Term
from human_gait.values import Value
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.gait import Gait
from human_gait.walk.instant import Instants
from human_gait.walk.measured import was_measured

NAME = "following a walk"
_TURNS = 1.0 * ~PRISMATIC


@dataclass(frozen=True, eq=False, repr=False)
class Tracking(Value):
    """Follow the joint angles of a walk, with a weight; one of the costs of `predict`.

    A walk that was predicted so says which walk it follows: what it follows does not test it.

    Attributes
    ----------
    gait : Gait
        What is followed, at the same share of the step.
    weight : float, [N^2 m^2/rad^2]
        Of the squared angles: with 1e4, 0.1 rad in ten joints cost as much as 32 N m in one.

    Raises
    ------
    TypeError
        If it is no gait, or the weight no number.
    ValueError
        If the weight is not finite, or not above zero.
    """

    gait: Gait
    weight: float

    def __post_init__(self) -> None:
        """Refuse what cannot be followed."""
        gait: object = self.gait
        weight: object = self.weight
        if not isinstance(gait, Gait):
            raise TypeError(f"what is followed must be a gait, not {type(gait).__name__}")
        if isinstance(weight, bool) or not isinstance(weight, Real):
            raise TypeError(f"weight is {weight!r}, must be a number")
        if not (np.isfinite(self.weight) and self.weight > 0.0):
            raise ValueError(f"weight is {self.weight}, must be finite and above 0")

    @property
    def name(self) -> str:
        """What it is called among the costs."""
        return NAME

    @property
    def what(self) -> str:
        """What is followed, in words."""
        found = was_measured(self.gait)
        name = self.gait.scenario.name
        return f"{name} ({found['what']})" if found else f"{name}, which was predicted"

    def term(self, step_time: float) -> Term:
        """Return it as a term of the objective of steps that take so long, [s]."""
        basis, points = self.gait.basis, self.gait.control_points
        to_own = self.gait.step_time / step_time

        def apart(now: Instants) -> FloatArray:
            followed = basis.matrix(np.clip(now.t * to_own, 0.0, basis.step_time)) @ points
            return np.asarray((now.q - followed) * _TURNS)

        def value(now: Instants, spacing: FloatArray) -> float:
            return float(self.weight * spacing @ (apart(now) ** 2).sum(axis=1))

        def add_to_adjoint(
            now: Instants, spacing: FloatArray, factor: float, adjoint: Adjoint
        ) -> None:
            curvature = 2.0 * self.weight * factor * spacing[:, None] * _TURNS
            adjoint.state[:, 0] += curvature * apart(now)
            adjoint.own[:, 0] += curvature

        return Term(NAME, UNIT, "", value, add_to_adjoint)
