"""Units in which the solvers see cost and control points."""

from __future__ import annotations

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.limits import torque_weights
from human_gait.body.skeleton import N_DOF
from human_gait.scenario import Scenario
from human_gait.walk.bspline import Basis

COST_SCALE = 1e-3
"""The solvers see the cost in kN^2 m^2 s: of the order of one to ten."""

_LEAST_CURVATURE = 1e-4  # [kN^2 m^2 / rad^2] keeps the units of the lightest joints below 10 rad


def units(scenario: Scenario, basis: Basis, times: FloatArray, partials: FloatArray) -> FloatArray:
    """Return the unit (55,) of each DOF's control points from the slopes of the torques.

    With d = sum_i w_i (dtau_i/dP)^2 at the first guess, the Gauss-Newton diagonal of the objective,
    units d^(-1/2) would give every variable the same curvature. Constraints, in metres for all,
    want none of it: d^(-1/4) is between the two. Powers of two: no rounding.

    Parameters
    ----------
    scenario : Scenario
    basis : Basis
    times : (K,) array, [s]
    partials : (K, 55, 165) array
        Of the torques of muscles in q, v, a.
    """
    by_order = partials.reshape(*partials.shape[:2], 3, N_DOF)
    weights = torque_weights(scenario)
    squares = np.einsum("kiod,kipd,i->kopd", by_order, by_order, weights)
    N = np.stack([basis.matrix(times, order) for order in range(3)])
    overlap = np.einsum("okn,pkn->kop", N, N) * COST_SCALE / len(times)
    d = np.einsum("kop,kopd->d", overlap, squares)
    d = np.maximum((d + d[basis.cycle.index]) / 2, _LEAST_CURVATURE)
    return np.asarray(np.exp2(np.round(-np.log2(d) / 4)))
