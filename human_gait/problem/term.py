"""A term of the objective: an integral over the step, with derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from human_gait.arrays import FloatArray
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.instant import Instants

UNIT = "N^2 m^2 s"


@dataclass(frozen=True, eq=False)
class Term:
    """One term of the objective.

    Attributes
    ----------
    name, unit, equation : str
        All terms of an objective have its unit, N^2 m^2 s.
    value : function
        Instants (K), the time (K,) [s] that each stands for -> value of the integral.
    add_to_adjoint : function
        Instants, times (K,), factor, Adjoint: adds the first and second derivatives of factor *
        integral to the adjoint. It may couple neighbouring instants (`Adjoint.torque_next`).
    """

    name: str
    unit: str
    equation: str
    value: Callable[[Instants, FloatArray], float]
    add_to_adjoint: Callable[[Instants, FloatArray, float, Adjoint], None]
