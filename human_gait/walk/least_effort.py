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
from human_gait.dynamics.inverse_dynamics import InverseDynamics
from human_gait.dynamics.jet import Jet, Linearised, joined, stack
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.contact_plan import ContactPlan
from human_gait.walk.ground_reaction import (
    LEG_JOINTS,
    LOWER,
    GroundReaction,
    add_torques_to_adjoint,
    directed,
    load_partials,
    load_torques,
    on_foot,
    with_lean,
)
from human_gait.walk.muscles import Torques

_LEAN = 6  # its place among the variables of the ground
_HOLD = 0.3  # sqrt(r) in weight times the square of the step length


@dataclass(frozen=True, eq=False)
class UnitPair:
    """What a lean of 1/m does at n instants.

    Attributes
    ----------
    on_feet : tuple of two Jet (n, 6), [N m], [N m^2]
        Wrenches on the right and on the left foot, about the world's origin.
    on_links : Jet (n, 2, 2, 6)
        The same on rear foot and toes.
    torque : (n, 14) array, [N m^2]
        s, of the joints of the legs.
    by_posture, by_ground : (n, 14, 20) and (n, 14, 7) array
        Partials of s by q, where the axes of joints move, and by the variables of the ground.
    """

    on_feet: tuple[Jet, Jet]
    on_links: Jet
    torque: FloatArray
    by_posture: FloatArray
    by_ground: FloatArray


class LeanHessian(NamedTuple):
    """Second derivatives s'^T c tau' + its transpose at n instants, and others by the posture.

    Attributes
    ----------
    k : (n,) int array
        The instants.
    by_posture, by_ground : (n, 14, 20) and (n, 14, 7) array
        Those of s, times c.
    second : (n, 20, 20) array
        Second derivatives by q.
    mixed : (n, 7, 20) array
        Second derivatives by the variables of the ground and q.
    """

    k: IntArray
    by_posture: FloatArray
    by_ground: FloatArray
    second: FloatArray
    mixed: FloatArray


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
        pairs = zip(ground.wrenches, self.pair.on_feet, strict=True)
        wrenches = tuple(self._leaning(*pair) for pair in pairs)
        on_links = self._leaning(ground.on_links, self.pair.on_links)
        variables = with_lean(ground.variables, lean)
        return replace(ground, variables=variables, wrenches=wrenches, on_links=on_links)  # type: ignore[arg-type]

    def _leaning(self, wrench: Jet, unit: Jet) -> Jet:
        """Return wrenches (K, ..., 6) and the unit pair's (n, ..., 6) times the lean."""
        variables = np.zeros((len(self.k), _LEAN + 1))
        variables[:, _LEAN] = self.more.value
        lean = Jet.variables(variables)[:, _LEAN]
        added = unit * lean.reshaped(*[1] * (unit.value.ndim - 1))
        value, partials, second = wrench.value.copy(), wrench.partials.copy(), wrench.second.copy()
        value[self.k] += added.value
        partials[self.k] += added.partials
        second[self.k] += added.second
        return Jet(value, partials, second)

    def add_to(self, torque: FloatArray) -> None:
        """Add s (g - g_0) to torques (K, 55), in place: those of g_0 become those of g."""
        torque[self.k, LEG_JOINTS] += self.pair.torque * self.more.value[:, None]

    def second_derivatives(
        self, axes: FloatArray, torque: FloatArray, adjoint: Adjoint
    ) -> LeanHessian:
        """Take account of g'' in a weighted sum, all of whose weights are in the adjoint.

        What is owed to torques and wrench is added to the adjoint, the rest is returned. `torque`
        (K, 55) are those of the muscles.
        """
        pair, k = self.pair, self.k
        s, weights = pair.torque, adjoint.torque[k, LEG_JOINTS]
        owed = adjoint.ground[k, _LEAN] + np.sum(weights * s, axis=1)
        c = -(owed / self.stiffness)[:, None] * self.weights
        adjoint.torque[k, LEG_JOINTS] += c * s  # s_i tau_i''
        of_s = Adjoint.none(*adjoint.ground[k].shape)
        of_s.torque[:, LEG_JOINTS] = c * torque[k, LEG_JOINTS]  # tau_i s_i''
        second, mixed = add_torques_to_adjoint(axes[k], pair.on_links, of_s)
        adjoint.ground[k] += of_s.ground
        adjoint.ground_second[k] += of_s.ground_second
        by_posture, by_ground = (c[..., None] * by for by in (pair.by_posture, pair.by_ground))
        return LeanHessian(k, by_posture, by_ground, second, mixed)  # s_i' x tau_i'


def least_effort(
    torques: Torques,
    plan: ContactPlan,
    times: FloatArray,
    ground: GroundReaction,
    weights: FloatArray,
) -> Lean:
    """Return the lean that takes the muscles of the legs least.

    Parameters
    ----------
    torques : Torques
        Those of the muscles are tau_0.
    times : (K,) array, [s]
    ground : GroundReaction
        For g_0.
    weights : (55,) array
        Of squared torques.
    """
    k = np.flatnonzero(plan.support(times).both)
    pair = unit_pair(torques.dynamics, plan, times, ground, k)
    tau_0, w, s = torques.muscle[k, LEG_JOINTS], weights[LEG_JOINTS], pair.torque
    D = np.sum(w * s**2, axis=1) + (_HOLD * plan.weight * plan.walk.step_length**2) ** 2
    more = -np.sum(w * s * tau_0, axis=1) / D
    by_torque = np.zeros((len(k), N_DOF))
    by_torque[:, LEG_JOINTS] = w * s
    by_s = (w * (tau_0 + 2.0 * s * more[:, None]))[:, None]
    by_state, by_ground = torques.at(k).gradient(by_torque)
    by_state[:, 0, LOWER] += (by_s @ pair.by_posture)[:, 0]
    by_ground += (by_s @ pair.by_ground)[:, 0]
    by_ground = (by_ground[:, None] @ ground.variables.partials[k])[:, 0]
    slope = by_state.reshape(len(k), 3 * N_DOF) + by_ground
    return Lean(k, Linearised(more, -slope / D[:, None]), pair, w, D)


def unit_pair(
    dynamics: InverseDynamics,
    plan: ContactPlan,
    times: FloatArray,
    ground: GroundReaction,
    k: IntArray,
) -> UnitPair:
    """Return what a lean of 1/m does at the instants k."""
    _, A, B = (part[k] for part in plan.support(times))
    l2 = ground.leading_share[k]
    per_length = l2 * (1.0 - l2) * ground.force[k, 1]
    on_feet = tuple(
        _push(directed(per_length, line), pressure[k])
        for line, pressure in zip((B - A, A - B), ground.pressure, strict=True)
    )
    toes = (ground.toe_share[k, f] for f in range(2))
    of_feet = (on_foot(*pair) for pair in zip(on_feet, toes, strict=True))
    on_links = joined([link for foot in of_feet for link in foot]).reshaped(2, 2, 6)
    axes = dynamics.axes[k]
    s = load_torques(axes, on_links)[:, LEG_JOINTS]
    return UnitPair(on_feet, on_links, s, *load_partials(axes, on_links))  # type: ignore[arg-type]


def _push(h: Jet, pressure: Jet) -> Jet:
    """Return the wrench (n, 6) of a horizontal force h (x and z) at a point on the ground."""
    none = 0.0 * h[:, 0]
    turning = pressure[:, 1] * h[:, 0] - pressure[:, 0] * h[:, 1]
    return stack([h[:, 0], none, h[:, 1], none, turning, none])
