"""A nonlinear program as plain functions of its variables, its multipliers, and where it ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]


@dataclass(frozen=True)
class NonlinearProgram:
    """Minimise a cost subject to bounds of n variables and of m rows.

    Attributes
    ----------
    lower, upper : (n,) array
    row_lower, row_upper : (m,) array
    cost : function, x -> float
    gradient : function, x -> (n,) array
    rows : function, x -> (m,) array
    jacobian_entries : two int arrays
        Rows and columns of the entries that can differ from zero; what occurs twice is added.
    jacobian : function, x -> array
        The entries.
    hessian_entries : two int arrays
        Of the upper triangle, none twice.
    hessian : function, (x, float, (m,) array) -> array
        Entries of the second derivatives of factor * cost + multipliers * rows.
    """

    lower: FloatArray
    upper: FloatArray
    row_lower: FloatArray
    row_upper: FloatArray
    cost: Callable[[FloatArray], float]
    gradient: Callable[[FloatArray], FloatArray]
    rows: Callable[[FloatArray], FloatArray]
    jacobian_entries: tuple[IntArray, IntArray]
    jacobian: Callable[[FloatArray], FloatArray]
    hessian_entries: tuple[IntArray, IntArray]
    hessian: Callable[[FloatArray, float, FloatArray], FloatArray]


@dataclass(frozen=True)
class Duals:
    """Multipliers of a point, positive at upper bounds that hold, negative at lower ones.

    Attributes
    ----------
    rows : (m,) array
    variables : (n,) array
    """

    rows: FloatArray
    variables: FloatArray


@dataclass(frozen=True)
class End:
    """Where a solver ended.

    Attributes
    ----------
    x : (n,) array
    duals : Duals
    solved : bool
    status : str
        In the solver's words.
    iterations : int
    """

    x: FloatArray
    duals: Duals
    solved: bool
    status: str
    iterations: int
