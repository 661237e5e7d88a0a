"""Whether costs and constraints of one's own are what a program can use."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from human_gait.problem.balance_rows import SLIDING_FRICTION, TURNING_FRICTION
from human_gait.problem.constraints import LIMITS, SYMMETRY
from human_gait.problem.own import RunningCost
from human_gait.problem.posture_rows import STRENGTH
from human_gait.problem.residual import Constraint
from human_gait.problem.term import Term
from human_gait.problem.tracking import Tracking
from human_gait.walk.instant import Instants

OwnCost: TypeAlias = RunningCost | Tracking | Term
"""What can be added to the objective."""


def as_term(cost: OwnCost, guess: Instants, step_time: float) -> Term:
    """Return a cost as a term of the objective, if it can be used at instants like these."""
    if isinstance(cost, Tracking):
        return cost.term(step_time)
    return cost if isinstance(cost, Term) else cost.checked(guess).term()


def of_kind(what: str, given: object, kinds: tuple[type, ...]) -> None:
    """Raise TypeError unless own costs or constraints are a sequence of the right kind."""
    names = " or ".join(kind.__name__ for kind in kinds)
    if not isinstance(given, Sequence):
        raise TypeError(f"{what} must be a list of {names}, not a {type(given).__name__}")
    for one in given:
        if not isinstance(one, kinds):
            raise TypeError(f"{what} must be a list of {names}, there is a {type(one).__name__}")


def without_twins(constraints: Sequence[Constraint]) -> None:
    """Raise ValueError if two constraints have one name: duals go by it."""
    others = LIMITS, SYMMETRY, SLIDING_FRICTION, TURNING_FRICTION, STRENGTH
    names = [constraint.name for constraint in constraints] + [demand.name for demand in others]
    twins = {name for name in names if names.count(name) > 1}
    if twins:
        raise ValueError(f"{min(twins)!r} is the name of more than one constraint")
