"""Is this gait a walk? Checks on a grid ten times finer than the one that was constrained."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from human_gait.body import GRAVITY
from human_gait.constraints import joint_limits
from human_gait.contact_plan import ContactPlan
from human_gait.dh import frames
from human_gait.gait import Gait, Samples
from human_gait.recursive_lagrangian import ExternalLoad, inverse_dynamics
from human_gait.skeleton import DOF_NAMES, SEGMENTS, index, mirror

FloatArray = npt.NDArray[np.float64]

REFINEMENT = 10
FRICTION = 0.5
"""Coefficient of friction that dry floors reach; people walking on the level need about 0.2."""

_LOADED = 0.05  # of the weight
_TOES = [index(f"toe_extension_{side}") for side in "rl"]


@dataclass(frozen=True)
class Check:
    """One claim about a gait.

    Attributes
    ----------
    name, unit : str
    value : float
        What was found, in `unit`.
    limit : float
        The largest value that passes.
    time : float, [s]
        When the worst was found.
    """

    name: str
    unit: str
    value: float
    limit: float
    time: float

    @property
    def passed(self) -> bool:
        """Whether the value is within its limit."""
        return bool(self.value <= self.limit)


def verify(gait: Gait) -> list[Check]:
    """Return the checks of a gait over one step.

    Torques and balance are those of the native recursion (`recursive_lagrangian`), not of the
    engine that solved.
    """
    grid = gait.scenario.discretisation
    n = REFINEMENT * grid.intervals * grid.dynamics_per_interval
    times = np.linspace(0.0, gait.step_time, n + 1)
    now = gait.instants(times)
    torques = _recursion(gait, now)
    return [
        _joint_limits(gait, now),
        _footholds(gait.plan, now),
        _penetration(now),
        _zmp(gait.plan, now),
        _pressure(gait.plan, now),
        _balance(gait, now, torques),
        _torques(now, torques),
        _no_pull(gait, now),
        _friction(gait.plan, now),
        _mean_force(gait, now),
        *_periodicity(gait),
    ]


def _worst(name: str, unit: str, limit: float, values: FloatArray, times: FloatArray) -> Check:
    """Return a check of the largest of the values (K, ...)."""
    by_time = values.reshape(len(times), -1).max(axis=1)
    k = int(np.argmax(by_time))
    return Check(name, unit, float(by_time[k]), limit, float(times[k]))


def _joint_limits(gait: Gait, now: Samples) -> Check:
    """Joint angles stay within their limits, Eq. (19)."""
    lower, upper = joint_limits(gait.scenario, DOF_NAMES)
    outside = np.maximum(np.maximum(lower - now.q, now.q - upper), 0.0)[:, 3:]
    return _worst("joint limits exceeded", "deg", 1e-9, np.rad2deg(outside), now.t)


def _footholds(plan: ContactPlan, now: Samples) -> Check:
    """Points that stand are where they were put down, Eq. (21)."""
    distance = np.linalg.norm(now.points - plan.footholds, axis=-1)
    standing = np.where(plan.contact(now.t), distance, 0.0)
    return _worst("standing points off their footholds", "m", 0.01, standing, now.t)


def _penetration(now: Samples) -> Check:
    """No point is below the ground, Eq. (20)."""
    depth = np.maximum(-now.points[..., 1], 0.0)
    return _worst("depth below the ground", "m", 0.01, depth, now.t)


def _zmp(plan: ContactPlan, now: Samples) -> Check:
    """The ZMP is in the foot support region, Eq. (22)."""
    outside = [
        _distance_outside(plan.support_polygon(t), point)
        for t, point in zip(now.t, now.zmp[:, [0, 2]], strict=True)
    ]
    return _worst("ZMP outside the foot support region", "m", 0.01, np.array(outside), now.t)


def _pressure(plan: ContactPlan, now: Samples) -> Check:
    """The centre of pressure of each loaded foot is under the part of it that stands."""
    outside = np.zeros((len(now.t), 2))
    within = plan.fraction(now.t) < 1.0  # at T the next step begins, the mirror image of 0
    for k, f in np.argwhere(_loaded(plan, now) & within[:, None]):
        polygon = plan.support_polygon(now.t[k], (int(f),))
        outside[k, f] = _distance_outside(polygon, now.cop[k, f, [0, 2]])
    return _worst("pressure outside its foot", "m", 0.01, outside, now.t)


def _loaded(plan: ContactPlan, now: Samples) -> npt.NDArray[np.bool_]:
    """Return (K, 2) true for feet with enough force on them to speak of its place and direction."""
    return np.asarray(now.grf[..., 1] > _LOADED * plan.weight)


def _balance(gait: Gait, now: Samples, torques: FloatArray) -> Check:
    """The ground reaction nulls the forces and moments of the global DOF, Eq. (17)."""
    weight = gait.plan.weight
    scale = np.array([weight] * 3 + [weight * gait.body.subject.stature] * 3)
    residual = np.abs(torques[:, :6]) / scale
    return _worst("forces and moments left at the root", "of weight", 1e-6, residual, now.t)


def _torques(now: Samples, torques: FloatArray) -> Check:
    """Both engines give the same joint torques (but for the toes, which share the foot's load)."""
    difference = np.abs(np.delete(torques - now.tau, _TOES, axis=1))
    relative = difference / np.abs(now.tau).max()
    return _worst("torques of the two engines apart", "of peak", 1e-9, relative, now.t)


def _no_pull(gait: Gait, now: Samples) -> Check:
    """The ground does not pull at a foot."""
    pull = np.maximum(-now.grf[..., 1], 0.0) / gait.plan.weight
    return _worst("ground pulling at a foot", "of weight", 0.0, pull, now.t)


def _friction(plan: ContactPlan, now: Samples) -> Check:
    """The floor holds the feet: horizontal force of each against its vertical force."""
    loaded = _loaded(plan, now)
    horizontal = np.linalg.norm(now.grf[..., [0, 2]], axis=-1)
    needed = np.where(loaded, horizontal / np.where(loaded, now.grf[..., 1], 1.0), 0.0)
    return _worst("friction needed", "of vertical force", FRICTION, needed, now.t)


def _mean_force(gait: Gait, now: Samples) -> Check:
    """The ground carries the weight on average: a periodic walk neither rises nor falls."""
    vertical = now.grf[..., 1].sum(axis=1)
    mean = np.trapezoid(vertical, now.t) / gait.step_time
    error = abs(mean / gait.plan.weight - 1.0)
    return Check("mean vertical force against weight", "of weight", float(error), 1e-3, 0.0)


def _periodicity(gait: Gait) -> list[Check]:
    """The end of the step is the mirror image of its start, Eq. (26)."""
    ends = np.array([0.0, gait.step_time])
    apart = []
    for order in (0, 1):
        first, last = gait.basis.matrix(ends, order) @ gait.control_points
        advance = np.zeros_like(last)
        advance[index("pelvis_tz")] = gait.step_length if order == 0 else 0.0
        apart.append(float(np.abs(last - advance - mirror(first)).max()))
    return [
        Check("posture not periodic", "rad, m", apart[0], 1e-6, gait.step_time),
        Check("velocity not periodic", "rad/s, m/s", apart[1], 1e-6, gait.step_time),
    ]


def _recursion(gait: Gait, now: Samples) -> FloatArray:
    """Return the torques (K, 55) of the native recursion under the ground reaction."""
    _, A = frames(gait.body.table, now.q)
    loads = [_on_foot(A, now, f, f"foot_{side}") for f, side in enumerate("rl")]
    load = gait.scenario.load
    if load.model == "force":
        weight = load.mass * GRAVITY
        loads.append(ExternalLoad(SEGMENTS["thorax"], gait.body.load_com, weight, np.zeros(3)))
    return np.asarray(inverse_dynamics(gait.body, now.q, now.v, now.a, loads))


def _on_foot(A: FloatArray, now: Samples, f: int, link_name: str) -> ExternalLoad:
    link = SEGMENTS[link_name]
    rotation, origin = A[:, link, :3, :3], A[:, link, :3, 3]
    point = np.einsum("kji,kj->ki", rotation, now.cop[:, f] - origin)
    moment = np.zeros((len(now.t), 3))
    moment[:, 1] = now.yaw_moment[:, f]
    return ExternalLoad(link, point, now.grf[:, f], moment)


def _distance_outside(polygon: FloatArray, point: FloatArray) -> float:
    """Return the distance of a point from a convex polygon (n, 2), 0 inside."""
    edges = np.roll(polygon, -1, axis=0) - polygon
    offset = point - polygon
    turn = edges[:, 0] * offset[:, 1] - edges[:, 1] * offset[:, 0]
    if np.all(turn >= 0.0) or np.all(turn <= 0.0):
        return 0.0
    along = np.clip(np.sum(offset * edges, axis=1) / np.sum(edges**2, axis=1), 0.0, 1.0)
    return float(np.linalg.norm(offset - along[:, None] * edges, axis=1).min())
