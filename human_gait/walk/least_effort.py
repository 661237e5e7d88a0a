"""How far the forces of both feet lean towards each other: as takes the legs' muscles least.

In double support a pair of forces along AB, h on the trailing foot and -h on the leading one, is
free to choose: it cancels in the sum. With h = l1 l2 R_y (B - A) g it vanishes where a foot has no
load. The torques of the muscles of the legs are linear in the lean g [1/m],

    tau = tau_0 + s (g - g_0),    s = dtau/dg,

and g is the one for which sum w_i tau_i^2 + r (g - g_0)^2 is least: at every instant

    s^T w tau + r (g - g_0) = 0,    g = g_0 - s^T w tau_0 / (s^T w s + r).

g_0 and r matter where one foot has hardly any load and s is small.

Derivatives. With D = s^T w s + r and dtau|g those at constant g

    D dg = - sum w_i (tau_i ds_i + s_i dtau_i|g),
    D d2g = - sum w_i (tau_i d2s_i + s_i d2tau_i|.. + ds_i x dtau_i + dtau_i x ds_i),

where d2tau_i|.. lacks s_i d2g alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import GRAVITY, N_DOF
from human_gait.dynamics.inverse_dynamics import (
    CHAINS,
    ROOT,
    InverseDynamics,
    load_torques,
    load_torques_dq,
)
from human_gait.dynamics.jet import Jet, Linearised, stack
from human_gait.dynamics.second_derivatives import StateHessian
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.contact_plan import LEFT, RIGHT, ContactPlan
from human_gait.walk.ground_reaction import (
    LOADED,
    GroundReaction,
    OnLinks,
    directed,
    loads_derivatives,
    on_foot,
    with_lean,
)

LEGS = np.concatenate([chain[len(ROOT) :] for chain in CHAINS])
"""Indices of the joints of both legs, right then left."""

STIFF = 0.01


@dataclass(frozen=True, eq=False)
class Lean:
    """The lean of least effort at the n of K instants where both feet stand.

    Attributes
    ----------
    k : (n,) int array
        The instants.
    beyond : Linearised (n,), [1/m]
        g - g_0.
    pair : tuple of two Jet (n, 6), [N m], [N m^2]
        The wrenches on the feet for g = 1.
    on_links : tuple of two pairs of Jet (n, 6)
        The same on rear foot and toes.
    s : Linearised (n, 14), [N m^2]
        Torques of the joints of the legs for g = 1.
    by_ground, by_posture : (n, 14, 7) and (n, 14, 55) array
        Partials of s by the variables of the ground and by q where it enters as it is.
    weights : (14,) array
        w.
    curvature : (n,) array
        D.
    """

    k: IntArray
    beyond: Linearised
    pair: tuple[Jet, Jet]
    on_links: OnLinks
    s: Linearised
    by_ground: FloatArray
    by_posture: FloatArray
    weights: FloatArray
    curvature: FloatArray

    def leaning(self, ground: GroundReaction) -> GroundReaction:
        """Return the ground reaction with the lean as its seventh variable."""
        K = len(ground.variables.value)
        lean = Linearised(np.zeros(K), np.zeros((K, ground.variables.partials.shape[-1])))
        lean.value[self.k], lean.partials[self.k] = self.beyond.value, self.beyond.partials
        wrenches = tuple(
            self._leaning(whole, unit)
            for whole, unit in zip(ground.wrenches, self.pair, strict=True)
        )
        links = tuple(
            tuple(self._leaning(w, u) for w, u in zip(of_foot, units, strict=True))
            for of_foot, units in zip(ground.on_links, self.on_links, strict=True)
        )
        variables = with_lean(ground.variables, lean)
        return replace(ground, variables=variables, wrenches=wrenches, on_links=links)  # type: ignore[arg-type]

    def _leaning(self, whole: Jet, unit: Jet) -> Jet:
        n = len(self.k)
        lean = Jet.variables(np.column_stack([np.zeros((n, 6)), self.beyond.value]))[:, 6:]
        more = unit * lean
        parts = (whole.value.copy(), whole.partials.copy(), whole.second.copy())
        for part, added in zip(parts, (more.value, more.partials, more.second), strict=True):
            part[self.k] += added
        return Jet(*parts)

    def added(self, torque: Linearised) -> Linearised:
        """Return torques (K, 55) with those of the lean, tau_0 + s (g - g_0)."""
        value, partials = torque.value.copy(), torque.partials.copy()
        at, g, s = np.ix_(self.k, LEGS), self.beyond, self.s
        value[at] += s.value * g.value[:, None]
        partials[at] += s.partials * g.value[:, None, None]
        partials[at] += s.value[:, :, None] * g.partials[:, None]
        return Linearised(value, partials)

    def add_to_adjoint(
        self, dynamics: InverseDynamics, muscles: Linearised, adjoint: Adjoint
    ) -> tuple[FloatArray, StateHessian, FloatArray]:
        """Take account of d2g in a sum weighted by the adjoint, before that of the torques."""
        k, at = self.k, np.ix_(self.k, LEGS)
        s, tau, w = self.s.value, muscles.value[at], self.weights
        owed = adjoint.ground[k, 6] + np.sum(adjoint.torque[at] * s, axis=1)
        c = -(owed / self.curvature)[:, None] * w
        adjoint.torque[at] += c * s
        weights = np.zeros((len(k), N_DOF))
        weights[:, LEGS] = c * tau
        of_pair = loads_derivatives(dynamics.axes[k], self.on_links, weights)
        adjoint.ground[k] += of_pair.ground
        adjoint.ground_second[k] += of_pair.ground_second
        dtau = c[..., None] * muscles.partials[at]
        return (
            self.by_ground.swapaxes(1, 2) @ dtau,
            self.by_posture.swapaxes(1, 2) @ dtau,
            of_pair,
        )


def lean_of_least_effort(
    dynamics: InverseDynamics,
    plan: ContactPlan,
    times: FloatArray,
    ground: GroundReaction,
    muscles: Linearised,
    weights: FloatArray,
) -> Lean:
    """Return the lean that takes the muscles of the legs least."""
    k = np.flatnonzero(plan.double_support(times))
    pair, links = unit_pair(plan, times[k], ground, k)
    s, by_ground, by_posture = _torques(dynamics.axes[k], links)
    partials = by_ground[..., :6] @ ground.variables.partials[k, :6]
    partials[..., :N_DOF] += by_posture
    w = weights[LEGS]
    stature = plan.stature
    r = (STIFF * plan.weight * stature**2) ** 2
    at = np.ix_(k, LEGS)
    tau_0 = muscles.value[at]
    D = np.sum(w * s**2, axis=1) + r
    g = -np.sum(w * s * tau_0, axis=1) / D
    tau = tau_0 + s * g[:, None]
    dg = np.einsum("ki,kix->kx", w * (tau + s * g[:, None]), partials)
    dg += np.einsum("ki,kix->kx", w * s, muscles.partials[at])
    dg /= -D[:, None]
    return Lean(
        k, Linearised(g, dg), pair, links, Linearised(s, partials), by_ground, by_posture, w, D
    )


def unit_pair(
    plan: ContactPlan, times: FloatArray, ground: GroundReaction, k: IntArray
) -> tuple[tuple[Jet, Jet], OnLinks]:
    """Return the wrenches (n, 6) on the feet and on their links for g = 1."""
    A, B = (point[:, [0, 2]] for point in plan.transfer_points(times))
    l2 = ground.leading_share[k]
    per_length = l2 * (1.0 - l2) * ground.force[k, 1]
    pair = tuple(
        _push(directed(per_length, line), pressure[k])
        for line, pressure in zip((B - A, A - B), ground.pressure, strict=True)
    )
    links = tuple(on_foot(u, toe[k]) for u, toe in zip(pair, ground.toe_share, strict=True))
    return pair, links  # type: ignore[return-value]


def _push(h: Jet, pressure: Jet) -> Jet:
    """Return the wrench (n, 6) of a horizontal force h (x and z) at a point on the ground."""
    none = 0.0 * h[:, 0]
    turning = pressure[:, 1] * h[:, 0] - pressure[:, 0] * h[:, 1]
    return stack([h[:, 0], none, h[:, 1], none, turning, none])


def _torques(axes: FloatArray, links: OnLinks) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return - S_i^T U of the joints of the legs, and its partials by ground and posture."""
    n = len(axes)
    s, by_ground, by_posture = np.zeros((n, N_DOF)), np.zeros((n, N_DOF, 7)), np.zeros((n, N_DOF, N_DOF))
    for f in (RIGHT, LEFT):
        for unit, joints in zip(links[f], LOADED[f], strict=True):
            S = axes[:, :, joints]
            s[:, joints] -= load_torques(S, unit.value)
            by_ground[:, joints] -= S.swapaxes(1, 2) @ unit.partials
            by_posture[:, joints[:, None], joints] -= load_torques_dq(S, unit.value)
    return s[:, LEGS], by_ground[:, LEGS], by_posture[:, LEGS]
