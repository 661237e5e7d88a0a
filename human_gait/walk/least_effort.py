"""How far the forces of both feet lean towards each other: as takes the muscles of the legs least.

In double support a pair of forces along AB, h = l1 l2 R_y (B - A) g on the trailing foot and -h on
the leading one, is free to choose: it cancels in the sum, and vanishes where a foot has no load.
The torques of the muscles of the legs are linear in the lean g [1/m], s being those of g = 1:

    tau = tau_0 + s (g - g_0).

At every instant g is the one for which sum w_i tau_i^2 + r (g - g_0)^2 is least, w the weights of
the objective. With D = s^T w s + r

    s^T w tau + r (g - g_0) = 0,    g = g_0 - s^T w tau_0 / D.

s is small where one foot has hardly any load. There r holds g at g_0, that of a pivot; else a foot
of little load would be pushed beyond what friction can hold.

Derivatives, from those of the condition above (' is by any two variables):

    D g'  = - sum w_i (tau_i s_i' + s_i tau_i'),           tau' with g constant,
    D g'' = - sum w_i (tau_i s_i'' + s_i tau_i'' + s_i' x tau_i' + tau_i' x s_i'),

where tau' of g'' is the whole of it, and only s g'' is left out of tau''. So what a weighted sum
owes to g'' is owed as if it were due to torques and to s, and products of first derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import N_DOF
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
    add_torques_to_adjoint,
    directed,
    on_foot,
    with_lean,
)

LEGS = np.concatenate([chain[len(ROOT) :] for chain in CHAINS])
"""Indices of the 14 joints of the legs, right then left."""

_LEAN = 6  # its place among the variables of the ground
_HOLD = 0.3  # sqrt(r) in weight times the square of the step length


@dataclass(frozen=True, eq=False)
class UnitPair:
    """What a lean of 1/m does at n instants.

    Attributes
    ----------
    on_feet : tuple of two Jet (n, 6), [N m], [N m^2]
        Wrenches on the right and on the left foot, about the world's origin.
    on_links : tuple of two pairs of Jet (n, 6)
        The same on rear foot and toes.
    torque : Linearised (n, 14), [N m^2]
        s, of the joints of the legs.
    by_ground, by_posture : (n, 14, 7) and (n, 14, 55) array
        Partials of s by the variables of the ground, and by q where the axes of joints move.
    """

    on_feet: tuple[Jet, Jet]
    on_links: OnLinks
    torque: Linearised
    by_ground: FloatArray
    by_posture: FloatArray


class LeanHessian(NamedTuple):
    """Second derivatives B^T C + C^T B in q, v, a at n instants.

    Attributes
    ----------
    k : (n,) int array
        The instants.
    left : (n, 7, 165) array
        B where C are the partials of the variables of the ground.
    by_posture : (n, 55, 165) array
        B where C are those of q.
    """

    k: IntArray
    left: FloatArray
    by_posture: FloatArray

    def add_to(self, left: FloatArray, direct: StateHessian) -> None:
        """Add to the B (K, 7, 165) of all instants and to their direct second derivatives."""
        by_q, by_v, by_a = np.split(self.by_posture, 3, axis=2)
        left[self.k] += self.left
        direct.qq[self.k] += by_q + by_q.swapaxes(1, 2)
        direct.qv[self.k] += by_v
        direct.qa[self.k] += by_a


@dataclass(frozen=True, eq=False)
class Lean:
    """The lean of least effort, at those n of K instants where both feet stand.

    Attributes
    ----------
    k : (n,) int array
        The instants.
    more : Linearised (n,), [1/m]
        g - g_0.
    pair : UnitPair
    weights : (14,) array
        w.
    stiffness : (n,) array, [N^2 m^4]
        D.
    """

    k: IntArray
    more: Linearised
    pair: UnitPair
    weights: FloatArray
    stiffness: FloatArray

    def leaning(self, ground: GroundReaction) -> GroundReaction:
        """Return the ground reaction for g instead of g_0, with g - g_0 as seventh variable."""
        K, S = len(ground.variables.value), ground.variables.partials.shape[-1]
        lean = Linearised(np.zeros(K), np.zeros((K, S)))
        lean.value[self.k], lean.partials[self.k] = self.more.value, self.more.partials
        pair = self.pair
        feet = zip(ground.wrenches, pair.on_feet, strict=True)
        links = zip(ground.on_links, pair.on_links, strict=True)
        wrenches = tuple(self._leaning(*foot) for foot in feet)
        on_links = tuple(
            tuple(self._leaning(*link) for link in zip(*foot, strict=True)) for foot in links
        )
        variables = with_lean(ground.variables, lean)
        return replace(ground, variables=variables, wrenches=wrenches, on_links=on_links)  # type: ignore[arg-type]

    def _leaning(self, wrench: Jet, unit: Jet) -> Jet:
        """Return a wrench (K, 6) and the unit pair's (n, 6) times the lean."""
        variables = np.zeros((len(self.k), _LEAN + 1))
        variables[:, _LEAN] = self.more.value
        added = unit * Jet.variables(variables)[:, _LEAN:]
        value, partials, second = wrench.value.copy(), wrench.partials.copy(), wrench.second.copy()
        value[self.k] += added.value
        partials[self.k] += added.partials
        second[self.k] += added.second
        return Jet(value, partials, second)

    def add_to(self, torque: Linearised) -> None:
        """Add s (g - g_0) to torques (K, 55), in place: those of g_0 become those of g."""
        on, s, more = np.ix_(self.k, LEGS), self.pair.torque, self.more
        torque.value[on] += s.value * more.value[:, None]
        partials = s.partials * more.value[:, None, None]
        partials += s.value[..., None] * more.partials[:, None]
        torque.partials[on] += partials

    def second_derivatives(
        self, dynamics: InverseDynamics, muscles: Linearised, adjoint: Adjoint
    ) -> LeanHessian:
        """Take account of g'' in a weighted sum, all of whose weights are in the adjoint.

        What is owed to torques and wrench is added to the adjoint, the rest is returned.
        """
        pair, on = self.pair, np.ix_(self.k, LEGS)
        s = pair.torque.value
        owed = adjoint.ground[self.k, _LEAN] + np.sum(adjoint.torque[on] * s, axis=1)
        c = -(owed / self.stiffness)[:, None] * self.weights
        adjoint.torque[on] += c * s  # s_i tau_i''
        of_s = Adjoint.none(*adjoint.ground[self.k].shape)
        of_s.torque[:, LEGS] = c * muscles.value[on]  # tau_i s_i''
        axes = dynamics.axes[self.k]
        second, mixed = add_torques_to_adjoint(axes, pair.on_links, of_s)
        adjoint.ground[self.k] += of_s.ground
        adjoint.ground_second[self.k] += of_s.ground_second
        tau_dx = c[..., None] * muscles.partials[on]  # s_i' x tau_i'
        left = pair.by_ground.swapaxes(1, 2) @ tau_dx
        by_posture = pair.by_posture.swapaxes(1, 2) @ tau_dx
        left[..., :N_DOF] += mixed.swapaxes(1, 2)
        by_posture[..., :N_DOF] += second / 2
        return LeanHessian(self.k, left, by_posture)


def least_effort(
    dynamics: InverseDynamics,
    plan: ContactPlan,
    times: FloatArray,
    ground: GroundReaction,
    muscles: Linearised,
    weights: FloatArray,
) -> Lean:
    """Return the lean that takes the muscles of the legs least.

    Parameters
    ----------
    times : (K,) array, [s]
    ground : GroundReaction
        For g_0.
    muscles : Linearised (K, 55), [N m]
        tau_0.
    weights : (55,) array
        Of squared torques.
    """
    k = np.flatnonzero(plan.double_support(times))
    pair = unit_pair(dynamics, plan, times, ground, k)
    tau_0, w = muscles[np.ix_(k, LEGS)], weights[LEGS]
    s, s_dx = pair.torque.value, pair.torque.partials
    D = np.sum(w * s**2, axis=1) + (_HOLD * plan.weight * plan.walk.step_length**2) ** 2
    more = -np.sum(w * s * tau_0.value, axis=1) / D
    lent = s * more[:, None]
    by_state = ((w * (tau_0.value + 2.0 * lent))[:, None] @ s_dx)[:, 0]
    by_state += ((w * s)[:, None] @ tau_0.partials)[:, 0]
    return Lean(k, Linearised(more, -by_state / D[:, None]), pair, w, D)


def unit_pair(
    dynamics: InverseDynamics,
    plan: ContactPlan,
    times: FloatArray,
    ground: GroundReaction,
    k: IntArray,
) -> UnitPair:
    """Return what a lean of 1/m does at the instants k."""
    A, B = (point[:, [0, 2]] for point in plan.transfer_points(times[k]))
    l2 = ground.leading_share[k]
    per_length = l2 * (1.0 - l2) * ground.force[k, 1]
    on_feet = tuple(
        _push(directed(per_length, line), pressure[k])
        for line, pressure in zip((B - A, A - B), ground.pressure, strict=True)
    )
    toes = (share[k] for share in ground.toe_share)
    on_links = tuple(on_foot(*pair) for pair in zip(on_feet, toes, strict=True))
    s, by_ground, by_posture = _torques(dynamics.axes[k], on_links)  # type: ignore[arg-type]
    partials = by_ground @ ground.variables.partials[k]
    partials[..., :N_DOF] += by_posture
    return UnitPair(on_feet, on_links, Linearised(s, partials), by_ground, by_posture)  # type: ignore[arg-type]


def _push(h: Jet, pressure: Jet) -> Jet:
    """Return the wrench (n, 6) of a horizontal force h (x and z) at a point on the ground."""
    none = 0.0 * h[:, 0]
    turning = pressure[:, 1] * h[:, 0] - pressure[:, 0] * h[:, 1]
    return stack([h[:, 0], none, h[:, 1], none, turning, none])


def _torques(axes: FloatArray, on_links: OnLinks) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return -S_i^T W of the joints of the legs (n, 14), and its partials by ground and posture."""
    n, y = len(axes), on_links[0][0].partials.shape[-1]
    s, by_ground, by_posture = (np.zeros((n, N_DOF, *last)) for last in ((), (y,), (N_DOF,)))
    for f in (RIGHT, LEFT):
        for unit, joints in zip(on_links[f], LOADED[f], strict=True):
            S = axes[:, :, joints]
            s[:, joints] -= load_torques(S, unit.value)
            by_ground[:, joints] -= S.swapaxes(1, 2) @ unit.partials
            by_posture[:, joints[:, None], joints] -= load_torques_dq(S, unit.value)
    return s[:, LEGS], by_ground[:, LEGS], by_posture[:, LEGS]
