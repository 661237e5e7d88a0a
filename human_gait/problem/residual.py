"""What a constraint is: what it demands of a walk, and its rows at instants of the step.

A residual has rows; each row belongs to one instant and knows its partials in q, v and a of the
DOF that it depends on. `program` makes gradients in control points of them. For the second
derivatives a constraint passes the multipliers of its rows on to what the rows are made of: places
and velocities of the feet, the wrench of the ground, postures (`adjoint`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray, IntArray
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.instant import Instants

Words = npt.NDArray[np.str_]


@dataclass(frozen=True)
class Tolerance:
    """The setting of a scenario that relaxes a constraint.

    Attributes
    ----------
    key : str
        Of the section ``tolerances``.
    upwards : bool
        Whether a larger value allows more.
    """

    key: str
    upwards: bool


@dataclass(frozen=True, kw_only=True)
class Demand:
    """What a constraint demands of a walk: all that is said of it anywhere is said here.

    Attributes
    ----------
    name : str
        No two constraints of a problem have the same.
    equation : str
        Its number, or numbers, in the paper; empty if the paper has none.
    meaning : str
        What a bound that holds the walk stands for, as an answer to "why does it walk like this?".
    tolerance : Tolerance or None
        What relaxes it, if anything does.
    """

    name: str
    equation: str = ""
    meaning: str = ""
    tolerance: Tolerance | None = None


@dataclass(frozen=True)
class Residual:
    """Rows of one constraint: values and partials in the DOF of each row.

    Attributes
    ----------
    value : (r,) array
    dq, dv, da : (r, c) array
    """

    value: FloatArray
    dq: FloatArray
    dv: FloatArray
    da: FloatArray


ToAdjoint = Callable[[Instants, FloatArray, FloatArray, Adjoint], None]


@dataclass(frozen=True, eq=False, kw_only=True)
class Constraint:
    """One constraint at the instants where it holds.

    Attributes
    ----------
    demand : Demand
        What it demands, with its name and its equation.
    unit : str
        Of the rows.
    lower, upper : (r,) array
    instants : (r,) int array
        Index of each row's instant on the grid.
    columns : (r, c) int array
        DOF of each row.
    what : (r,) str array
        What each row is about, in words; no two rows of one instant say the same.
    evaluate : function
        Instants of the grid -> Residual.
    to_adjoint : function
        Instants, multipliers (r,), curvature (r,), Adjoint: adds to the adjoint a function of the
        rows with these for first and second derivatives by each row.
    linear : bool
        Whether the rows are linear in the motion.
    """

    demand: Demand
    unit: str
    lower: FloatArray
    upper: FloatArray
    instants: IntArray
    columns: IntArray
    what: Words
    evaluate: Callable[[Instants], Residual]
    to_adjoint: ToAdjoint
    linear: bool = False

    @property
    def name(self) -> str:
        """Name of the constraint, the key of its multipliers."""
        return self.demand.name

    @property
    def equation(self) -> str:
        """Number of its equation in the paper."""
        return self.demand.equation

    def rows_at(self, instants: IntArray) -> Constraint:
        """Return the constraint with the rows of some instants only."""
        rows = np.flatnonzero(np.isin(self.instants, instants))

        def evaluate(now: Instants) -> Residual:
            r = self.evaluate(now)
            return Residual(r.value[rows], r.dq[rows], r.dv[rows], r.da[rows])

        def to_adjoint(
            now: Instants, multipliers: FloatArray, curvature: FloatArray, adjoint: Adjoint
        ) -> None:
            every = np.zeros((2, len(self.lower)))
            every[:, rows] = multipliers, curvature
            self.to_adjoint(now, every[0], every[1], adjoint)

        return replace(
            self,
            lower=self.lower[rows],
            upper=self.upper[rows],
            instants=self.instants[rows],
            columns=self.columns[rows],
            what=self.what[rows],
            evaluate=evaluate,
            to_adjoint=to_adjoint,
        )


def same_words(rows: IntArray, words: str) -> Words:
    """Return the same words for each of the rows (r,)."""
    return np.full(len(rows), words)
