"""The two-step algorithm for the ground reaction, Eq. (17) and Fig. 5, with partials.

Step one, without ground reaction: the torques of the six global DOF are a wrench (R, M) about the
world's origin, and with it the zero moment point and the vertical moment there,

    ZMP = (M_z / R_y, 0, -M_x / R_y),    M_y,zmp = M_y - (z R_x - x R_z).

Step two: R and M_y,zmp act on the feet. In single support all of it acts on the left foot at the
ZMP. In double support the feet share it as l1 : l2, by where the ZMP lies along the line from A
(trailing foot) to B (leading foot); d1 and d2 of Eq. (17) are distances along that line. What is
left, e = ZMP - (l1 A + l2 B), shifts both points alike: R1 at A + e and R2 at B + e are together
exactly R at the ZMP, and the global DOF stay free of torque.

Forces along AB, h on the trailing foot and -h on the leading one, cancel. Eq. (17) has none: both
feet then push in parallel, and the hips have to hold the legs against each other. People's forces
meet near a point above the centre of mass (Maus et al. 2010, Nat Commun 1:70). Forces meet at the
height H above the ZMP if h = l1 l2 R_y (B - A) / H. `least_effort` finds 1/H from the torques.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from human_gait import kernel
from human_gait.arrays import BoolArray, FloatArray, IntArray
from human_gait.body.skeleton import N_DOF
from human_gait.dynamics.inverse_dynamics import (
    CHAINS,
    ROOT,
    InverseDynamics,
    load_hessian,
    load_torques_dq,
    weighted_axes_dq,
)
from human_gait.dynamics.jet import Jet, Linearised, cross, joined, stack
from human_gait.values import Value
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.contact_plan import ContactPlan, Support

_ROUNDING = 0.04  # of the way from A to B: where the share bends smoothly into 0 and 1
_TOE_BLEND = (-0.010, 0.020)  # [m] ahead of the metatarsal heads: from the rear foot to the toes

LOADED = tuple((chain[:-1], chain) for chain in CHAINS)
"""Indices of the DOF that carry a load on the rear foot and one on the toes: right, left."""

LOWER = slice(0, int(np.max(CHAINS)) + 1)
"""The 20 DOF that move the feet: the global ones and those of both legs."""
N_LOWER = LOWER.stop
_LENGTHS = np.array([len(joints) for foot in LOADED for joints in foot])
_CHAINS = _LENGTHS, np.array([chain for chain in CHAINS for _ in range(2)])
LEG_JOINTS = slice(len(ROOT), N_LOWER)
"""The 14 joints of the legs, right then left."""

QUANTITIES: Mapping[str, slice | int] = {
    "zmp": slice(0, 2),
    "yaw moment": 2,
    "leading share": 3,
    "pressure right": slice(4, 6),
    "pressure left": slice(6, 8),
    "wrench right": slice(8, 14),
    "wrench left": slice(14, 20),
    "toe share": slice(20, 22),
    "links": slice(22, 46),
}
"""Where each is among all that follows from the variables of the ground."""
_N = 46
_OF_FEET = [(f"{what} right", f"{what} left") for what in ("pressure", "wrench")]


@dataclass(frozen=True, eq=False)
class GroundReaction(Value):
    """What the ground does to the feet at K instants.

    Everything is a function of few variables; the derivatives of the jets are those in them.

    Attributes
    ----------
    variables : Linearised (K, n), [N], [N m], [1/m]
        The wrench, all that the ground has to give about the world's origin, n = 6; by least effort
        also how far the forces of the feet lean, n = 7. Partials are in q, v, a.
    force : Jet (K, 3), [N]
        R, all that the ground carries.
    zmp : Jet (K, 2), [m]
        x and z of the zero moment point.
    yaw_moment : Jet (K,), [N m]
        Vertical moment at the ZMP.
    leading_share : Jet (K,)
        l2 of Eq. (17); 1 in single support.
    pressure : tuple of two Jet (K, 2), [m]
        x and z of the centre of pressure of the right and of the left foot.
    wrenches : tuple of two Jet (K, 6), [N], [N m]
        On the right and on the left foot, about the world's origin.
    toe_share : Jet (K, 2)
        Share of each foot's wrench that acts on its toes; the rest acts on the rear foot.
    on_links : Jet (K, 2, 2, 6)
        The wrenches on rear foot and toes of the right and of the left foot.
    """

    variables: Linearised
    force: Jet
    zmp: Jet
    yaw_moment: Jet
    leading_share: Jet
    pressure: tuple[Jet, Jet]
    wrenches: tuple[Jet, Jet]
    toe_share: Jet
    on_links: Jet

    def in_state(self, quantity: Jet) -> Linearised:
        """Return one of the quantities (K, ...) with partials in q, v, a."""
        by_variables, n = quantity.partials, self.variables.value.shape[1]
        by_state = by_variables.reshape(len(by_variables), -1, n) @ self.variables.partials
        return Linearised(quantity.value, by_state.reshape(*quantity.value.shape, -1))


def ground_reaction(variables: Linearised, plan: ContactPlan, times: FloatArray) -> GroundReaction:
    """Return the ground reaction at the instants `times` (K,) of the step.

    `variables` are the wrench (K, 6) that all the bodies need about the world's origin.
    """
    if plan.least_effort:
        variables = with_lean(variables)
    F = Jet.variables(variables.value)
    found = _quantities(F, plan, plan.support(times))
    pressure, wrenches = (tuple(found[:, QUANTITIES[part]] for part in two) for two in _OF_FEET)
    return GroundReaction(
        variables,
        F[:, :3],
        found[:, QUANTITIES["zmp"]],
        found[:, QUANTITIES["yaw moment"]],
        found[:, QUANTITIES["leading share"]],
        pressure,  # type: ignore[arg-type]
        wrenches,  # type: ignore[arg-type]
        found[:, QUANTITIES["toe share"]],
        found[:, QUANTITIES["links"]].reshaped(2, 2, 6),
    )


def _quantities(F: Jet, plan: ContactPlan, support: Support) -> Jet:
    """Return all quantities of ``QUANTITIES`` (K, 46) from the variables (K, n)."""
    if run := kernel.function("ground"):
        K, n = F.value.shape
        shapes = ((K, _N), (K, _N, n), (K, _N, n, n))
        found = Jet(*(np.empty(shape) for shape in shapes))
        numbers = np.array([plan.spread, _ROUNDING, *_TOE_BLEND])
        both, A, B = support.both.astype(float), support.A, support.B
        into = found.value, found.partials, found.second
        run(K, n, F.value, both, A, B, plan.balls, numbers, into=into)
        return found
    R, M, (both, A, B) = F[:, :3], F[:, 3:6], support
    # Step one, Fig. 5 (a): M - ZMP x R has no part about x and z, only M_y about y.
    zmp = stack([M[:, 2] / R[:, 1], -M[:, 0] / R[:, 1]])  # (M_z / R_y, -M_x / R_y)
    M_y = M[:, 1] - (zmp[:, 1] * R[:, 0] - zmp[:, 0] * R[:, 2])
    # Step two, Fig. 5 (b): R and M_y act on the feet, l1 of them at A and l2 at B, Eq. (17).
    l2 = _leading_share(zmp, A, B, both)  # d1 / (d1 + d2); l1 = 1 - l2
    e = zmp - directed(l2, B - A) - A  # ZMP - (l1 A + l2 B): what the shares leave of the moment
    pressure = tuple((e + point).where(both, zmp) for point in (A, B))
    shares = (1.0 - l2, l2)
    # Beyond Eq. (17): h = l1 l2 R_y (B - A) / H on the trailing foot, -h on the leading one.
    per_length = l2 * (1.0 - l2) * R[:, 1] * plan.spread
    h = [directed(per_length, line) for line in (B - A, A - B)]
    wrenches = tuple(
        _foot_wrench(point, R, M_y, share, push)
        for point, share, push in zip(pressure, shares, h, strict=True)
    )
    toes = [
        _toe_share(point[:, 1] - ball) for point, ball in zip(pressure, plan.balls, strict=True)
    ]
    links = [on_foot(*pair) for pair in zip(wrenches, toes, strict=True)]
    vectors = [zmp, stack([M_y, l2]), *pressure, *wrenches, stack(toes)]
    return joined([*vectors, *(link for foot in links for link in foot)])


def with_lean(variables: Linearised, lean: Linearised | None = None) -> Linearised:
    """Return the wrench and, as a seventh variable, how far the forces lean (K,), [1/m]."""
    value, partials = np.zeros((len(variables.value), 7)), np.zeros((len(variables.value), 7, 165))
    value[:, :6], partials[:, :6] = variables.value[:, :6], variables.partials[:, :6]
    if lean:
        value[:, 6], partials[:, 6] = lean.value, lean.partials
    return Linearised(value, partials)


def joint_torques(dynamics: InverseDynamics, on_links: Jet) -> FloatArray:
    """Return the torques (K, 55) with the ground reaction; those of the global DOF vanish.

    The toe joint carries what acts ahead of the metatarsal heads: the share of the foot's wrench
    on the toes rises smoothly with the centre of pressure. No other torque depends on it.
    """
    return dynamics.torque.value + load_torques(dynamics.axes, on_links)


def load_torques(axes: FloatArray, on_links: Jet) -> FloatArray:
    """Return what forces on the feet add to the torques (K, 55), - S_i^T W."""
    found = np.zeros((len(axes), N_DOF))
    for wrench, joints in loads(on_links):
        found[:, joints] -= (wrench.value[:, None] @ axes[:, :, joints])[:, 0]
    return found


def loads(on_links: Jet) -> Iterator[tuple[Jet, IntArray]]:
    """Yield what acts on rear feet and toes, and the joints that carry it."""
    for f, of_links in enumerate(LOADED):
        for link, joints in enumerate(of_links):
            yield on_links[:, f, link], joints


def load_partials(axes: FloatArray, on_links: Jet) -> tuple[FloatArray, FloatArray]:
    """Return partials of what forces on the feet add to torques of the legs, - S_i^T W(y).

    Returns
    -------
    by_posture : (K, 14, 20) array
        By q, y constant, in the DOF of `LOWER`.
    by_ground : (K, 14, n) array
        By y.
    """
    K, n = len(axes), on_links.partials.shape[-1]
    by_posture, by_ground = np.zeros((K, N_LOWER, N_LOWER)), np.zeros((K, N_LOWER, n))
    if run := kernel.function("load_partials"):
        S, W, W_y = axes.swapaxes(1, 2), on_links.value, on_links.partials
        run(K, n, *_CHAINS, S, W, W_y, into=(by_posture, by_ground))
        return by_posture[:, LEG_JOINTS], by_ground[:, LEG_JOINTS]
    for wrench, joints in loads(on_links):
        S = axes[:, :, joints]
        by_posture[:, joints[:, None], joints] -= load_torques_dq(S, wrench.value)
        by_ground[:, joints] -= S.swapaxes(1, 2) @ wrench.partials
    return by_posture[:, LEG_JOINTS], by_ground[:, LEG_JOINTS]


def add_torques_to_adjoint(
    axes: FloatArray, on_links: Jet, adjoint: Adjoint
) -> tuple[FloatArray, FloatArray]:
    """Take account of the forces on the feet in second derivatives of a sum of joint torques.

    That is L = - sum w_i S_i^T W(y) with w = ``adjoint.torque``, S_i the spatial axis of joint i,
    W what acts on the links of the feet and y the variables of the ground. With p = sum w_i S_i

        dL/dy = - p^T dW/dy,                    d2L/dy2 = - p^T d2W/dy2,
        d2L/dq2 = - sum w_i (d2S_i/dq2)^T W,    d2L/dqdy = - (dp/dq)^T dW/dy.

    What the sum owes to y is added to the adjoint.

    Parameters
    ----------
    axes : (K, 6, 55) array
    on_links : Jet (K, 2, 2, 6)
        As that of a `GroundReaction`.
    adjoint : Adjoint

    Returns
    -------
    second : (K, 20, 20) array
        Second derivatives by q, y constant: the axes S move. In the DOF of `LOWER`.
    mixed : (K, n, 20) array
        Second derivatives by y and q.
    """
    K, n = adjoint.ground.shape
    second, mixed = np.zeros((K, N_LOWER, N_LOWER)), np.zeros((K, n, N_LOWER))
    if run := kernel.function("load_second"):
        of_links = on_links.value, on_links.partials, on_links.second
        into = adjoint.ground, adjoint.ground_second, second, mixed
        run(K, n, *_CHAINS, axes.swapaxes(1, 2), *of_links, adjoint.torque, into=into)
        return second, mixed
    for wrench, joints in loads(on_links):
        S, w = axes[:, :, joints], adjoint.torque[:, joints]
        p = (S @ w[..., None]).swapaxes(1, 2)  # (K, 1, 6)
        adjoint.ground[:] -= (p @ wrench.partials)[:, 0]
        adjoint.ground_second[:] -= (p @ wrench.second.reshape(K, 6, n * n)).reshape(K, n, n)
        moved = weighted_axes_dq(S, w)
        mixed[:, :, joints] -= wrench.partials.swapaxes(1, 2) @ moved
        second[:, joints[:, None], joints] -= load_hessian(S, moved, wrench.value)
    return second, mixed


def _leading_share(zmp: Jet, A: FloatArray, B: FloatArray, both: BoolArray) -> Jet:
    """Return l2 = d1 / (d1 + d2) along AB, bent smoothly to stay within 0 and 1."""
    along = (B - A) / np.sum((B - A) ** 2, axis=1, keepdims=True)
    offset = zmp - A
    s: Jet = offset[:, 0] * along[:, 0] + offset[:, 1] * along[:, 1]  # (ZMP - A) . AB / |AB|^2
    l2 = s.map(*_RAMP) - (s - 1.0).map(*_RAMP)  # max(s, 0) - max(s - 1, 0), rounded
    return l2.where(both, 1.0)


def directed(factor: Jet, line: FloatArray) -> Jet:
    """Return vectors (K, 2), x and z, times a factor (K,)."""
    return stack([factor * side for side in line.T])


def _foot_wrench(pressure: Jet, R: Jet, M_y: Jet, share: Jet, h: Jet) -> Jet:
    """Return the share of R and M_y, and h (x and z), at the pressure point, Eq. (17)."""
    height = 0.0 * M_y
    force = stack([R[:, 0] * share + h[:, 0], R[:, 1] * share, R[:, 2] * share + h[:, 1]])
    moment = cross(stack([pressure[:, 0], height, pressure[:, 1]]), force)
    turned = moment[:, 1] + M_y * share
    return stack([*(force[:, i] for i in range(3)), moment[:, 0], turned, moment[:, 2]])


def on_foot(whole: Jet, toe_share: Jet) -> tuple[Jet, Jet]:
    """Return what acts on the rear foot and on the toes, each (K, 6)."""
    toes = whole * toe_share[:, None]
    return whole - toes, toes


def share_on_toes(ahead: FloatArray) -> FloatArray:
    """Return the share of a foot's load on its toes, by the pressure ahead of the ball [m]."""
    start, end = _TOE_BLEND
    return _step((ahead - start) / (end - start))


def _toe_share(ahead: Jet) -> Jet:
    start, end = _TOE_BLEND
    return ((ahead - start) / (end - start)).map(_step, _step_slope, _step_bend)


def _ramp(s: FloatArray) -> FloatArray:
    """Return max(s, 0), rounded within +- _ROUNDING; twice continuously differentiable."""
    r = _ROUNDING
    u = np.clip((s + r) / (2 * r), 0.0, 1.0)
    return np.asarray(2 * r * (u**3 - u**4 / 2) + np.maximum(s - r, 0.0))


def _ramp_slope(s: FloatArray) -> FloatArray:
    u = np.clip((s + _ROUNDING) / (2 * _ROUNDING), 0.0, 1.0)
    return np.asarray(3 * u**2 - 2 * u**3)


def _ramp_bend(s: FloatArray) -> FloatArray:
    u = np.clip((s + _ROUNDING) / (2 * _ROUNDING), 0.0, 1.0)
    return np.asarray(3 * u * (1 - u) / _ROUNDING)


_RAMP = (_ramp, _ramp_slope, _ramp_bend)


def _step(x: FloatArray) -> FloatArray:
    """Return a smooth step from 0 to 1, twice continuously differentiable."""
    u = np.clip(x, 0.0, 1.0)
    return np.asarray(u**3 * (10 - 15 * u + 6 * u**2))


def _step_slope(x: FloatArray) -> FloatArray:
    u = np.clip(x, 0.0, 1.0)
    return np.asarray(30 * u**2 * (1 - u) ** 2)


def _step_bend(x: FloatArray) -> FloatArray:
    u = np.clip(x, 0.0, 1.0)
    return np.asarray(60 * u * (1 - u) * (1 - 2 * u))
