"""Second derivatives by the state of instants as second derivatives by control points.

An instant k depends on its control points by N_k (165, 220), and couples them by N_k^T H_k N_k. The
rows of the products that H is made of are taken onto the control points first: instants of one
polynomial piece have the same four, and one product of matrices sums over all (`grid`). Rows are
kept as short as the joints they depend on allow: an arm's torque knows nothing of the legs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import BRANCHES, N_DOF
from human_gait.dynamics.inverse_dynamics import ROOT
from human_gait.dynamics.second_derivatives import TreeHessian
from human_gait.newton.cyclic_band import CyclicBand
from human_gait.problem.grid import Grid, Half
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.ground_reaction import LEG_JOINTS, LOWER
from human_gait.walk.instant import SecondDerivatives
from human_gait.walk.least_effort import LeanHessian
from human_gait.walk.muscles import UPPER

_EVERY = np.arange(N_DOF)
_LOWER = _EVERY[LOWER]
_N_ROOT = len(ROOT)

_SPINE = np.concatenate([ROOT, BRANCHES["spine"]])
ABOVE_PELVIS = {
    "spine": UPPER,
    **{branch: np.concatenate([_SPINE, BRANCHES[branch]]) for branch in ("right_arm", "left_arm")},
    "head": np.concatenate([_SPINE, BRANCHES["head"]]),
}
"""The DOF that the torques of a branch depend on: the joints above it and its own."""
_BRANCH_OF = {joint: branch for branch in ABOVE_PELVIS for joint in BRANCHES[branch]}


def hessian(grid: Grid, second: SecondDerivatives) -> CyclicBand:
    """Return second derivatives by free control points (m * 55, m * 55)."""
    adjoint = second.adjoint
    onward = bool(adjoint.torque_next.any() or adjoint.velocity_next.any())
    half = Half(grid, onward)
    _add_tree(half, grid, second.tree)
    half.add_own(adjoint.own)
    for block in adjoint.blocks:
        half.add_block(block)
    _add_upper(half, grid, second, onward)
    _add_lower(half, grid, second, onward)
    for dofs, *sides in adjoint.products:
        left, right = (grid.onto_points(side) for side in sides)
        half.add((dofs, left), (dofs, right))
    return CyclicBand(half.folded())


def _add_tree(half: Half, grid: Grid, tree: TreeHessian) -> None:
    """Add what pairs of joints have to do with each other: legs and upper body are apart."""
    for dofs, others in ((UPPER, 1.0), (_LOWER, 0.0)):  # those of the global DOF once
        X, Y = tree.on_points(grid.N, dofs)
        mask = tree.above[dofs[:, None], dofs]
        mask[:_N_ROOT, :_N_ROOT] *= others
        half.add((dofs, X), (dofs, Y), mask)


def _add_upper(half: Half, grid: Grid, second: SecondDerivatives, onward: bool) -> None:
    """Add what is by the torques of the joints above the pelvis.

    With P of their partials, w, c and w' of their second derivatives and P' of the next instant

        P^T (w P / 2 + c V + w' P'),        V_i = N' for the velocity of joint i, else 0.
    """
    adjoint = second.adjoint
    of = {name: second.muscles.on_points(grid.N, name, dofs) for name, dofs in ABOVE_PELVIS.items()}
    for branch, dofs in ABOVE_PELVIS.items():
        P, joints = of[branch], slice(BRANCHES[branch][0], BRANCHES[branch][-1] + 1)
        w, c, to_next = (
            by[:, joints]
            for by in (adjoint.torque_second, adjoint.torque_velocity, adjoint.torque_next)
        )
        source = _BRANCH_OF[int(grid.basis.cycle.index[joints.start])]  # whose image it is at T
        at_end = grid.at_end(of[source][0], ABOVE_PELVIS[source], joints, dofs)
        right = grid.weighted(P, at_end, int(np.searchsorted(dofs, joints.start)), (w, c, to_next))
        half.add((dofs, P), (dofs, right))
        if onward:
            following = grid.next(P, grid.ends)
            following[grid.ends == len(P) - 1] = at_end
            following *= to_next[grid.ends, :, None, None]
            half.add_onward((dofs, P[grid.ends]), (dofs, following))


@dataclass(frozen=True, eq=False)
class _Legs:
    """Partials by control points at K instants: those of the legs' torques are own + G Y.

    Attributes
    ----------
    own, V : (K, 14, 4, 20) array
        Own ones of torques, and those of the velocities of the joints.
    G : (K, 14, n) array
        Of torques by the variables of the ground.
    Y : (K, n, 4, 55) array
        Of these.
    """

    own: FloatArray
    V: FloatArray
    G: FloatArray
    Y: FloatArray

    @classmethod
    def of(cls, grid: Grid, second: SecondDerivatives) -> _Legs:
        """Return those of instants."""
        muscles = second.muscles
        ground = muscles.ground.reshape(*muscles.ground.shape[:2], 3, N_DOF)
        own, Y = grid.onto_points(muscles.legs), grid.onto_points(ground)
        return cls(own, grid.leg_velocities, muscles.by_ground, Y)

    def next(self, grid: Grid) -> _Legs:
        """Return those at the next instants."""
        own, V, G, Y = (grid.next(part) for part in (self.own, self.V, self.G, self.Y))
        if grid.basis.mirrored:
            cycle = grid.basis.cycle
            joints = cycle.index[LEG_JOINTS] - LEG_JOINTS.start
            own[-1] = grid.at_end(own[-1][joints], _LOWER, LEG_JOINTS, _LOWER)
            G[-1] = G[-1, joints] * cycle.sign[LEG_JOINTS, None]
            Y[-1] = cycle.turned(Y[-1])
        return _Legs(own, V, G, Y)

    def sums(self, rows: FloatArray) -> FloatArray:
        """Return G^T rows (K, n, 4, c) of rows of the joints (K, 14, 4, c)."""
        return _combined(self.G.swapaxes(1, 2), rows)


def _add_lower(half: Half, grid: Grid, second: SecondDerivatives, onward: bool) -> None:
    """Add what is by the torques of the legs, and by the variables of the ground.

    With T = own + G Y of torques (`_Legs`), w and c as in `_add_upper`, s' of the lean

        T^T (w T / 2 + c V) + s'^T T + Y^T (M Y + R).

    Rows of T are never made: what has Y as a factor goes to Y^T (...).
    """
    adjoint, legs = second.adjoint, _Legs.of(grid, second)
    w, c = (
        by[:, LEG_JOINTS, None, None] for by in (adjoint.torque_second, adjoint.torque_velocity)
    )
    moved = c * legs.V
    M = adjoint.ground_second / 2.0 + legs.G.swapaxes(1, 2) @ (w[..., 0] / 2.0 * legs.G)
    R = grid.postures(second.ground) + legs.sums(w * legs.own + moved)
    left, right = [legs.own], [w / 2.0 * legs.own + moved]
    if second.lean:
        left.append(_lean(grid, legs, second.lean, M, R))
        right.append(legs.own)
    by_ground = _combined(M, legs.Y)
    by_ground[..., LOWER] += R
    if onward:
        _add_onward(half, grid, (legs, legs.next(grid)), adjoint, (left, right, by_ground))
    half.add((_LOWER, np.concatenate(left, axis=1)), (_LOWER, np.concatenate(right, axis=1)))
    half.add((_EVERY, legs.Y), (_EVERY, by_ground))


def _lean(grid: Grid, legs: _Legs, lean: LeanHessian, M: FloatArray, R: FloatArray) -> FloatArray:
    """Add s'^T T of the instants where feet lean to M and R; return the rest of s', by posture.

    s' = by_posture N + by_ground Y.
    """
    k, G_T, by_ground_T = lean.k, legs.G[lean.k].swapaxes(1, 2), lean.by_ground.swapaxes(1, 2)
    R[k] += _combined(by_ground_T, legs.own[k]) + grid.postures(G_T @ lean.by_posture, k)
    M[k] += by_ground_T @ legs.G[k]
    rows = np.zeros_like(legs.own)
    rows[k] = grid.postures(lean.by_posture, k)
    return rows


def _add_onward(
    half: Half,
    grid: Grid,
    pair: tuple[_Legs, _Legs],
    adjoint: Adjoint,
    within: tuple[list[FloatArray], list[FloatArray], FloatArray],
) -> None:
    """Add what an instant has to do with the next one, T^T (w' T' + x V') + V^T (z T' + n V').

    Between pieces to the half, within them to the rows `left`, `right` and `by_ground` of the same
    instants.
    """
    (now, after), (left, right, by_ground), ends = pair, within, grid.ends
    to_torque, to_velocity, from_velocity, both = (
        by[:, LEG_JOINTS, None, None]
        for by in (
            *(adjoint.torque_next, adjoint.torque_velocity_next),
            *(adjoint.velocity_torque_next, adjoint.velocity_next),
        )
    )
    by_torque = to_torque * after.own + to_velocity * after.V
    moving = np.flatnonzero((from_velocity != 0.0).any(axis=0))
    by_velocity = (from_velocity * after.own + both * after.V)[:, moving]
    V = now.V[:, moving]
    across = _combined(now.G.swapaxes(1, 2) @ (to_torque[..., 0] * after.G), after.Y)
    across[..., LOWER] += now.sums(by_torque)
    back = after.sums(to_torque * now.own + from_velocity * now.V)
    half.add_onward((_LOWER, now.own[ends]), (_LOWER, by_torque[ends]))
    half.add_onward((_LOWER, V[ends]), (_LOWER, by_velocity[ends]))
    half.add_onward((_EVERY, now.Y[ends]), (_EVERY, across[ends]))
    half.add_onward((_LOWER, back[ends]), (_EVERY, after.Y[ends]))
    right[0] += grid.within * by_torque
    left.append(grid.within * V)
    right.append(by_velocity)
    by_ground += grid.within * across
    half.add((_LOWER, grid.within * back), (_EVERY, after.Y))


def _combined(M: FloatArray, rows: FloatArray) -> FloatArray:
    """Return sums of rows (K, s, 4, c) with weights (K, r, s)."""
    K, s, points, c = rows.shape
    return (M @ rows.reshape(K, s, points * c)).reshape(K, M.shape[1], points, c)
