"""Is this gait a walk? Every claim of its file is checked anew, by engines that did not solve it.

The motion is that of the splines, on a grid ten times finer than the constrained one. Pinocchio,
Drake and the paper's recursion each compute the torques that it takes under the forces of the file
(`engines`); Drake tells what momentum and energy do meanwhile. How the optimiser found motion,
forces and torques plays no part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from human_gait.body import GRAVITY
from human_gait.constraints import joint_limits
from human_gait.contact_plan import LEFT, ContactPlan
from human_gait.dh import frames
from human_gait.dynamics import FOOT_LINKS
from human_gait.engines import DrakeEngine, Engine, Mechanics, PinocchioEngine, RecursionEngine
from human_gait.gait import Gait, Samples, onward
from human_gait.gait_file import Record, carried_mass
from human_gait.passive import PassiveJoints
from human_gait.recursive_lagrangian import ExternalLoad
from human_gait.skeleton import DOF_NAMES, SEGMENTS, index, mirror

FloatArray = npt.NDArray[np.float64]

FRICTION = ("friction needed against sliding", "friction needed against turning")
"""Names of the checks that depend on the floor."""

_EQUAL = 1e-9  # numbers that are the same but for rounding
_LOADED = 0.05  # of the weight


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


def verify(record: Record) -> list[Check]:
    """Return the checks of a gait: what its file says, the laws of motion, the ground, the walk."""
    gait, now = record.gait, record.samples
    return [
        *_file(record),
        *_dynamics(record),
        *_ground(gait.plan, now),
        *_feet(record),
        _joint_limits(gait, now),
        *_periodicity(gait, now),
    ]


def _worst(name: str, unit: str, limit: float, values: FloatArray, times: FloatArray) -> Check:
    """Return a check of the largest of the values (K, ...); what is not a number is the largest."""
    by_time = np.nan_to_num(values.reshape(len(times), -1), nan=np.inf).max(axis=1)
    k = int(np.argmax(by_time))
    return Check(name, unit, float(by_time[k]), limit, float(times[k]))


def _apart(
    name: str, unit: str, found: FloatArray, expected: FloatArray, times: FloatArray
) -> Check:
    """Return a check that two arrays (K, ...) are the same, in units of `expected`."""
    return _worst(name, unit, _EQUAL, np.abs(found - expected), times)


# What the file says


def _file(record: Record) -> list[Check]:
    """Samples, body and footholds of the file belong to its splines and its scenario."""
    gait, now = record.gait, record.samples
    t, start = now.t, now.t[:1]
    q, v, a = (gait.basis.matrix(t, order) @ gait.control_points for order in range(3))
    mass = carried_mass(gait.body)
    scale = np.where(mass > 0.0, mass, 1.0)
    plan = gait.plan.footholds[None]
    return [
        _apart("angles off the splines", "rad, m", now.q, q, t),
        _apart("velocities off the splines", "rad/s, m/s", now.v, v, t),
        _apart("accelerations off the splines", "rad/s2, m/s2", now.a, a, t),
        _apart("masses off the body", "of each", record.mass[None] / scale, mass / scale, start),
        _apart("footholds off the plan", "m", record.footholds[None], plan, start),
        _apart("ZMP off that of the forces", "m", now.zmp, _zmp_of_forces(now), t),
        _muscles(gait, now),
    ]


def _zmp_of_forces(now: Samples) -> FloatArray:
    """Return where the horizontal moments of the forces on both feet vanish (K, 3), Fig. 5."""
    force, moment = now.grf.sum(axis=1), np.cross(now.cop, now.grf).sum(axis=1)
    zmp: FloatArray = np.zeros_like(force)
    vertical = np.where(force[:, 1] == 0.0, np.nan, force[:, 1])
    zmp[:, 0], zmp[:, 2] = moment[:, 2] / vertical, -moment[:, 0] / vertical
    return zmp


def _muscles(gait: Gait, now: Samples) -> Check:
    """Muscles give the joint torques, less what passive tissue gives where it is counted."""
    passive = 0.0 * now.tau
    if gait.scenario.objective.passive_torques == "tissue":
        passive = PassiveJoints().torque(now.q, now.v).value
    off = np.abs(now.active - (now.tau - passive)) / _peak(now)
    return _worst("muscle torques off the torques", "of peak", _EQUAL, off, now.t)


def _peak(now: Samples) -> float:
    return max(float(np.abs(now.tau).max()), 1.0)


# The laws of motion


def _dynamics(record: Record) -> list[Check]:
    """Forces and torques of the file are those that the motion takes, and balance."""
    gait, now = record.gait, record.samples
    loads, motion = _loads(gait, now), (now.q, now.v, now.a)
    drake = DrakeEngine(gait.body)
    engines: dict[str, Engine] = {
        "Pinocchio": PinocchioEngine(gait.body),
        "Drake": drake,
        "the recursion": RecursionEngine(gait.body),
    }
    torques = {name: engine.torques(motion, loads) for name, engine in engines.items()}
    found = drake.mechanics(motion, loads)
    return [
        *(_torques(f"torques off {name}'s", now, tau) for name, tau in torques.items()),
        _next_step(gait, now, drake),
        _balance(gait, now, np.stack(list(torques.values()), axis=1)),
        _apart("feet off Drake's", "m", now.points, found.points, now.t),
        _momentum(gait, now, found),
        _energy(now, found),
        _mean_force(gait, now),
    ]


def _torques(name: str, now: Samples, torques: FloatArray) -> Check:
    """The joint torques are those of an engine, Eq. (9)."""
    off = np.abs(torques - now.tau)[:, 6:] / _peak(now)
    return _worst(name, "of peak", _EQUAL, off, now.t)


def _next_step(gait: Gait, now: Samples, drake: DrakeEngine) -> Check:
    """The mirror image of the step is a motion of the same body: the stride goes on, Eq. (26)."""
    second = onward(now, np.ones(len(now.t), dtype=int), gait.step_length)
    motion = (second.q, second.v, second.a)
    return _torques(
        "next step's torques off Drake's", second, drake.torques(motion, _loads(gait, second))
    )


def _balance(gait: Gait, now: Samples, torques: FloatArray) -> Check:
    """Newton and Euler: the ground reaction nulls the global DOF (K, engines, 55), Eq. (17)."""
    weight = gait.plan.weight
    scale = np.array([weight] * 3 + [weight * gait.body.subject.stature] * 3)
    residual = np.abs(torques[..., :6]) / scale
    return _worst("forces and moments left at the root", "of weight", 1e-6, residual, now.t)


def _momentum(gait: Gait, now: Samples, found: Mechanics) -> Check:
    """Over the step the body gains the momentum that gravity and ground give it."""
    given = np.trapezoid(found.wrench, now.t, axis=0)
    weight = gait.plan.weight * gait.step_time
    scale = np.array([weight * gait.body.subject.stature] * 3 + [weight] * 3)
    off = np.abs(found.momentum[-1] - found.momentum[0] - given) / scale
    return Check(
        "momentum off the impulse",
        "of weight x T",
        float(off.max()),
        1e-3,
        float(now.t[-1]),
    )


def _energy(now: Samples, found: Mechanics) -> Check:
    """Energy changes by the work of joint torques and loads."""
    power = found.loads_power + np.sum(now.tau * now.v, axis=1)
    steps = np.diff(now.t)
    work = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * steps)])
    gross = float(np.sum(np.abs(power[1:] + power[:-1]) / 2 * steps))
    off = np.abs(found.energy - found.energy[0] - work) / max(gross, 1.0)
    return _worst("energy off the work", "of work done", 1e-3, off, now.t)


def _mean_force(gait: Gait, now: Samples) -> Check:
    """The ground carries the weight on average: a periodic walk neither rises nor falls."""
    vertical = now.grf[..., 1].sum(axis=1)
    mean = np.trapezoid(vertical, now.t) / gait.step_time
    error = abs(mean / gait.plan.weight - 1.0)
    return Check("mean vertical force against weight", "of weight", float(error), 1e-3, 0.0)


def _loads(gait: Gait, now: Samples) -> list[ExternalLoad]:
    """Return what acts on the body: the ground on rear feet and toes, a load that is a force."""
    _, A = frames(gait.body.table, now.q)
    loads = []
    for f, (rear, toes) in enumerate(FOOT_LINKS):
        loads.append(_on_link(A, now, f, rear, 1.0 - now.toe_share[:, f]))
        loads.append(_on_link(A, now, f, toes, now.toe_share[:, f]))
    load = gait.scenario.load
    if load.model == "force":
        none = np.zeros_like(now.zmp)
        point, weight = none + gait.body.load_com, none + load.mass * GRAVITY
        loads.append(ExternalLoad(SEGMENTS["thorax"], point, weight, none))
    return loads


def _on_link(A: FloatArray, now: Samples, f: int, link: int, share: FloatArray) -> ExternalLoad:
    """Return a share (K,) of the force and moment on a foot as a load of one link."""
    rotation, origin = A[:, link, :3, :3], A[:, link, :3, 3]
    point = np.einsum("kji,kj->ki", rotation, now.cop[:, f] - origin)
    moment = np.zeros((len(now.t), 3))
    moment[:, 1] = share * now.yaw_moment[:, f]
    return ExternalLoad(int(link), point, share[:, None] * now.grf[:, f], moment)


# The ground


def _ground(plan: ContactPlan, now: Samples) -> list[Check]:
    """The ground pushes where feet stand, and holds them by friction."""
    return [
        _no_pull(plan, now),
        _zmp(plan, now),
        _pressure(plan, now),
        _friction(plan, now),
        _turning_friction(plan, now),
    ]


def _no_pull(plan: ContactPlan, now: Samples) -> Check:
    """The ground does not pull at a foot."""
    pull = np.maximum(-now.grf[..., 1], 0.0) / plan.weight
    return _worst("ground pulling at a foot", "of weight", 0.0, pull, now.t)


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
    for k, f in np.argwhere(_loaded(plan, now)):
        polygon = _standing(plan, now.t[k], f)
        place = now.cop[k, f, [0, 2]]
        outside[k, f] = np.inf if polygon is None else _distance_outside(polygon, place)
    return _worst("pressure outside its foot", "m", 0.01, outside, now.t)


def _friction(plan: ContactPlan, now: Samples) -> Check:
    """The floor keeps the feet from sliding: horizontal against vertical force of each."""
    loaded = _loaded(plan, now)
    horizontal = np.linalg.norm(now.grf[..., [0, 2]], axis=-1)
    needed = np.where(loaded, horizontal / np.where(loaded, now.grf[..., 1], 1.0), 0.0)
    return _worst(FRICTION[0], "of vertical force", plan.friction, needed, now.t)


def _turning_friction(plan: ContactPlan, now: Samples) -> Check:
    """The floor keeps the walker from turning: vertical moment at the ZMP against even friction.

    How two feet share the moment does not follow from the motion.
    """
    zmp = _zmp_of_forces(now)
    arms = now.cop - zmp[:, None]
    moment = now.yaw_moment.sum(axis=1) + np.cross(arms, now.grf)[..., 1].sum(axis=1)
    vertical = np.maximum(now.grf[..., 1].sum(axis=1), _LOADED * plan.weight)
    needed = np.abs(moment) / (vertical * plan.turning_radius(now.t))
    return _worst(FRICTION[1], "of vertical force", plan.friction, needed, now.t)


def _loaded(plan: ContactPlan, now: Samples) -> npt.NDArray[np.bool_]:
    """Return (K, 2) true for feet with enough force on them to speak of its place and direction."""
    return np.asarray(now.grf[..., 1] > _LOADED * plan.weight)


def _standing(plan: ContactPlan, time: float, f: int) -> FloatArray | None:
    """Return the part (n, 2) of a foot that stands, if any."""
    if not plan.contact(np.array([time]))[0, f].any():
        return None
    return plan.support_polygon(time, (int(f),))


# The feet


def _feet(record: Record) -> list[Check]:
    """Feet stand still on their footholds, and nothing is below the ground."""
    plan, now = record.gait.plan, record.samples
    depth = np.maximum(-now.points[..., 1], 0.0)
    return [
        _footholds(plan, now, record.footholds),
        _slip(record.gait, now),
        _worst("depth below the ground", "m", 0.01, depth, now.t),  # Eq. (20)
    ]


def _footholds(plan: ContactPlan, now: Samples, footholds: FloatArray) -> Check:
    """Points that stand are where they were put down, Eq. (21)."""
    distance = np.linalg.norm(now.points - footholds, axis=-1)
    standing = np.where(plan.contact(now.t), distance, 0.0)
    return _worst("standing points off their footholds", "m", 0.01, standing, now.t)


def _slip(gait: Gait, now: Samples) -> Check:
    """A point does not slide from where it touched the ground, over the whole stance of a foot.

    The left foot stands through this step and, trailing, through the double support of the next.
    """
    second = onward(now, np.ones(len(now.t), dtype=int), gait.step_length)
    points = np.concatenate([now.points[:, LEFT], second.points[:, LEFT]])
    leading, trailing = gait.plan.contact(now.t).swapaxes(0, 1)[::-1]
    standing = np.concatenate([leading, trailing])
    first = points[np.argmax(standing, axis=0), np.arange(points.shape[1])]
    slid = np.linalg.norm((points - first)[..., [0, 2]], axis=-1)
    times = np.concatenate([now.t, now.t + gait.step_time])
    return _worst("foot sliding while it stands", "m", 0.015, np.where(standing, slid, 0.0), times)


# The walk


def _joint_limits(gait: Gait, now: Samples) -> Check:
    """Joint angles stay within their limits, Eq. (19)."""
    lower, upper = joint_limits(gait.scenario, DOF_NAMES)
    outside = np.maximum(np.maximum(lower - now.q, now.q - upper), 0.0)[:, 3:]
    return _worst("joint limits exceeded", "deg", 1e-9, np.rad2deg(outside), now.t)


def _periodicity(gait: Gait, now: Samples) -> list[Check]:
    """Step joins step, and the stride closes: q(T) = mirror(q(0)) + L, q(2T) = q(0) + 2L, Eq. (26).

    With the next step the mirror image, what is left at 2T is what was left at T, mirrored.
    """
    forward = np.zeros(len(DOF_NAMES))
    forward[index("pelvis_tz")] = gait.step_length
    posture = np.abs(now.q[-1] - mirror(now.q[0]) - forward).max()
    velocity = np.abs(now.v[-1] - mirror(now.v[0])).max()
    T = gait.step_time
    return [
        Check("posture not periodic", "rad, m", float(posture), 1e-6, T),
        Check("velocity not periodic", "rad/s, m/s", float(velocity), 1e-6, T),
    ]


def _distance_outside(polygon: FloatArray, point: FloatArray) -> float:
    """Return the distance of a point from a convex polygon (n, 2), 0 inside."""
    edges = np.roll(polygon, -1, axis=0) - polygon
    offset = point - polygon
    turn = edges[:, 0] * offset[:, 1] - edges[:, 1] * offset[:, 0]
    if np.all(turn >= 0.0) or np.all(turn <= 0.0):
        return 0.0
    along = np.clip(np.sum(offset * edges, axis=1) / np.sum(edges**2, axis=1), 0.0, 1.0)
    return float(np.linalg.norm(offset - along[:, None] * edges, axis=1).min())
