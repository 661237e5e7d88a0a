"""By how much a constraint is not kept, where and when."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.problem.residual import Constraint, Demand, Residual

_COUNTS = 0.1  # of the worst row: rows that are off by less do not make a violation last longer


@dataclass(frozen=True)
class Violation:
    """The worst row of one constraint.

    Attributes
    ----------
    demand : Demand
        What is not kept, with its name and its equation.
    unit : str
    value : float
        By how much the bound is exceeded, 0 if it is kept, in `unit`.
    time : float, [s]
    what : str
        What the row is about, in words.
    first, last : float, [s]
        When rows of the constraint are off by a tenth of it or more; both 0 if all are kept.
    """

    demand: Demand
    unit: str
    value: float
    time: float
    what: str = ""
    first: float = 0.0
    last: float = 0.0

    @property
    def name(self) -> str:
        """Name of the constraint."""
        return self.demand.name

    @property
    def equation(self) -> str:
        """Number of its equation in the paper."""
        return self.demand.equation


def worst_row(constraint: Constraint, residual: Residual, times: FloatArray) -> Violation:
    """Return the worst row of a constraint; `times` (K,) are those of the grid, [s]."""
    below, above = constraint.lower - residual.value, residual.value - constraint.upper
    excess = np.maximum(np.maximum(below, above), 0.0)
    row = int(np.argmax(excess))
    at, worst = times[constraint.instants], float(excess[row])
    off = at[excess >= _COUNTS * worst] if worst > 0.0 else np.zeros(1)
    return Violation(
        demand=constraint.demand,
        unit=constraint.unit,
        value=worst,
        time=float(at[row]),
        what=str(constraint.what[row]),
        first=float(off.min()),
        last=float(off.max()),
    )
