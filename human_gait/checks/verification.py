"""Is this gait a walk? Every claim of its file is checked anew, by three engines.

The motion is that of the splines, on a grid at least ten times finer than the constrained one.
Pinocchio, Drake and the paper's recursion each compute the torques that it takes under the forces
of the file (`engines`); Drake, which no solve uses, also tells where the feet are and what momentum
and energy do. How the optimiser found motion, forces and torques plays no part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.body.dh import frames
from human_gait.body.limits import joint_limits
from human_gait.body.links import GRAVITY
from human_gait.body.skeleton import SEGMENTS, index
from human_gait.checks.engines import (
    DrakeEngine,
    Engine,
    Mechanics,
    PinocchioEngine,
    RecursionEngine,
)
from human_gait.dynamics.inverse_dynamics import FOOT_LINKS
from human_gait.dynamics.recursive_lagrangian import ExternalLoad
from human_gait.dynamics.tissues import PassiveJoints
from human_gait.walk.contact_plan import HEEL, LEFT, RIGHT, TOE, ContactPlan
from human_gait.walk.gait import Gait, Samples, onward
from human_gait.walk.gait_file import Record, carried_mass
from human_gait.walk.ground_reaction import share_on_toes

FRICTION = ("friction needed against sliding", "friction needed against turning")
"""Names of the checks that depend on the floor."""

_BETWEEN = 1.5  # what may be reached between the instants, of a tolerance at them
_ANKLE_BREADTH = 0.06  # [m]
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
    with np.errstate(all="ignore"):  # absurd numbers of a file fail their checks
        drake, loads = DrakeEngine(gait.body), _loads(gait, now)
        found = drake.mechanics((now.q, now.v, now.a), loads)
        return [
            *_file(record),
            *_dynamics(record, drake, loads, found),
            *_ground(gait.plan, now),
            *_feet(record, found),
            *_walk(gait, now),
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
    ]


def _zmp_of_forces(now: Samples) -> FloatArray:
    """Return where the horizontal moments of the forces on both feet vanish (K, 3), Fig. 5."""
    force, moment = now.grf.sum(axis=1), np.cross(now.cop, now.grf).sum(axis=1)
    zmp: FloatArray = np.zeros_like(force)
    vertical = np.where(force[:, 1] == 0.0, np.nan, force[:, 1])
    zmp[:, 0], zmp[:, 2] = moment[:, 2] / vertical, -moment[:, 0] / vertical
    return zmp


# The laws of motion


def _dynamics(
    record: Record, drake: DrakeEngine, loads: list[ExternalLoad], found: Mechanics
) -> list[Check]:
    """Forces and torques of the file are those that the motion takes, and balance."""
    gait, now = record.gait, record.samples
    motion = (now.q, now.v, now.a)
    engines: dict[str, Engine] = {
        "Pinocchio": PinocchioEngine(gait.body),
        "Drake": drake,
        "the recursion": RecursionEngine(gait.body),
    }
    torques = {name: engine.torques(motion, loads) for name, engine in engines.items()}
    peak = _peak(gait, torques["Drake"])
    return [
        *(_torques(f"torques off {name}'s", now, tau, peak) for name, tau in torques.items()),
        _next_step(gait, now, drake, peak),
        _muscles(gait, now, peak),
        _balance(gait, now, np.stack(list(torques.values()), axis=1)),
        _momentum(gait, now, found),
        _energy(now, found),
        _mean_force(gait, now),
    ]


def _peak(gait: Gait, torques: FloatArray) -> float:
    """Return the largest torque of an engine, but no more than a body can need, [N m]."""
    most = gait.plan.weight * gait.body.subject.stature
    return float(np.clip(np.nan_to_num(np.abs(torques[:, 6:]).max(), nan=most), 1.0, most))


def _torques(name: str, now: Samples, torques: FloatArray, peak: float) -> Check:
    """The torques are those of an engine, Eq. (9)."""
    return _worst(name, "of largest torque", _EQUAL, np.abs(torques - now.tau) / peak, now.t)


def _muscles(gait: Gait, now: Samples, peak: float) -> Check:
    """Muscles give the joint torques, less what passive tissue gives where it is counted."""
    passive = 0.0 * now.tau
    if gait.scenario.objective.passive_torques == "tissue":
        passive = PassiveJoints().torque(now.q, now.v).value
    off = np.abs(now.active - (now.tau - passive)) / peak
    return _worst("muscle torques off the torques", "of largest torque", _EQUAL, off, now.t)


def _next_step(gait: Gait, now: Samples, drake: DrakeEngine, peak: float) -> Check:
    """The mirror image of the step is a motion of the same body: the stride goes on, Eq. (26)."""
    second = onward(now, np.ones(len(now.t), dtype=int), gait.cycle)
    torques = drake.torques((second.q, second.v, second.a), _loads(gait, second))
    return _torques("next step's torques off Drake's", second, torques, peak)


def _balance(gait: Gait, now: Samples, torques: FloatArray) -> Check:
    """Newton and Euler: the ground reaction nulls the global DOF (K, engines, 55), Eq. (17)."""
    weight = gait.plan.weight
    scale = np.array([weight] * 3 + [weight * gait.body.subject.stature] * 3)
    residual = np.abs(torques[..., :6]) / scale
    return _worst("unbalanced force or moment", "of weight", 1e-6, residual, now.t)


def _momentum(gait: Gait, now: Samples, found: Mechanics) -> Check:
    """Over the step the body gains the momentum that gravity and ground give it."""
    given = np.trapezoid(found.wrench, now.t, axis=0)
    weight = gait.plan.weight * gait.step_time
    scale = np.array([weight * gait.body.subject.stature] * 3 + [weight] * 3)
    off = np.abs(found.momentum[-1] - found.momentum[0] - given) / scale
    return _worst("momentum off the impulse", "of weight x T", 1e-3, off[None], now.t[-1:])


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
    error = np.array([abs(mean / gait.plan.weight - 1.0)])
    return _worst("mean vertical force against weight", "of weight", 1e-3, error, now.t[-1:])


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
    height, of_forces = np.abs(now.cop[..., 1]), _zmp_of_forces(now)
    return [
        _in_the_air(plan, now),
        _no_pull(plan, now),
        _shared(plan, now),
        _on_toes(plan, now),
        _worst("pressure not on the ground", "m", _EQUAL, height, now.t),
        _apart("ZMP off that of the forces", "m", now.zmp, of_forces, now.t),
        _zmp(plan, now),
        _pressure(plan, now),
        _friction(plan, now),
        _turning_friction(plan, now),
    ]


def _in_the_air(plan: ContactPlan, now: Samples) -> Check:
    """Nothing acts on a foot of which no part stands."""
    acting = np.concatenate([now.grf, now.yaw_moment[..., None]], axis=-1)
    acting = np.linalg.norm(acting, axis=-1) / plan.weight  # a metre for the moment's arm
    flying = ~plan.contact(now.t).any(axis=-1)
    return _worst("force on a foot in the air", "of weight", _EQUAL, acting * flying, now.t)


def _shared(plan: ContactPlan, now: Samples) -> Check:
    """The feet share the vertical moment as they share the vertical force, Eq. (17)."""
    force, moment = now.grf[..., 1], now.yaw_moment
    total = np.maximum(force.sum(axis=1, keepdims=True), _LOADED * plan.weight)
    off = np.abs(moment - force / total * moment.sum(axis=1, keepdims=True))
    return _worst("moments not shared as the loads", "N m", 1e-6, off, now.t)


def _on_toes(plan: ContactPlan, now: Samples) -> Check:
    """The toes carry what acts ahead of the ball of the foot."""
    share = share_on_toes(now.cop[..., 2] - plan.balls)
    return _apart("toes' share off the pressure", "of the foot", now.toe_share, share, now.t)


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
    horizontal = np.linalg.norm(now.grf[..., [0, 2]], axis=-1)
    needed = horizontal / np.maximum(now.grf[..., 1], _LOADED * plan.weight)
    return _worst(FRICTION[0], "coefficient", plan.friction, needed, now.t)


def _turning_friction(plan: ContactPlan, now: Samples) -> Check:
    """The floor keeps the walker from turning: vertical moment at the ZMP against even friction."""
    zmp = _zmp_of_forces(now)
    arms = now.cop - zmp[:, None]
    moment = now.yaw_moment.sum(axis=1) + np.cross(arms, now.grf)[..., 1].sum(axis=1)
    vertical = np.maximum(now.grf[..., 1].sum(axis=1), _LOADED * plan.weight)
    needed = np.abs(moment) / (vertical * plan.turning_radius(now.t))
    return _worst(FRICTION[1], "coefficient", plan.friction, needed, now.t)


def _loaded(plan: ContactPlan, now: Samples) -> npt.NDArray[np.bool_]:
    """Return (K, 2) true for feet with enough force on them to speak of its place and direction."""
    return np.asarray(now.grf[..., 1] > _LOADED * plan.weight)


def _standing(plan: ContactPlan, time: float, f: int) -> FloatArray | None:
    """Return the part (n, 2) of a foot that stands, if any."""
    if not plan.contact(np.array([time]))[0, f].any():
        return None
    return plan.support_polygon(time, (int(f),))


# The feet


def _feet(record: Record, found: Mechanics) -> list[Check]:
    """Feet stand still on their footholds, pass each other, and are never below the ground."""
    gait, now = record.gait, record.samples
    depth = np.maximum(-now.points[..., 1], 0.0)
    return [
        _apart("feet off Drake's", "m", now.points, found.points, now.t),
        _footholds(gait.plan, now, record.footholds),
        _soft_impact(gait, now, found),
        _slip(gait, now),
        _crossing(gait.plan, now),
        _worst("depth below the ground", "m", 0.01, depth, now.t),  # Eq. (20)
    ]


def _footholds(plan: ContactPlan, now: Samples, footholds: FloatArray) -> Check:
    """Points that stand are where they were put down, Eq. (21)."""
    distance = np.linalg.norm(now.points - footholds, axis=-1)
    standing = np.where(plan.contact(now.t), distance, 0.0)
    return _worst("standing points off their footholds", "m", 0.01, standing, now.t)


def _soft_impact(gait: Gait, now: Samples, found: Mechanics) -> Check:
    """Points that stand hardly move, Eq. (24)."""
    speed = np.abs(found.velocities).max(axis=-1)
    standing = np.where(gait.plan.contact(now.t), speed, 0.0)
    limit = _BETWEEN * gait.scenario.tolerances.contact_speed
    return _worst("speed of standing points", "m/s", limit, standing, now.t)


def _crossing(plan: ContactPlan, now: Samples) -> Check:
    """The swing foot passes beside the standing leg: heels and toe tips keep its breadth apart."""
    apart = now.points[:, LEFT, :, 0] - now.points[:, RIGHT, :, 0]
    short = np.maximum(_ANKLE_BREADTH - apart[:, [HEEL, TOE]].min(axis=1), 0.0)
    swing = ~plan.double_support(now.t)
    return _worst("feet too close in passing", "m", 0.015, np.where(swing, short, 0.0), now.t)


def _slip(gait: Gait, now: Samples) -> Check:
    """A point does not slide from where it touched the ground, over the whole stance of a foot.

    The left foot stands through this step and, trailing, through the double support of the next.
    """
    second = onward(now, np.ones(len(now.t), dtype=int), gait.cycle)
    points = np.concatenate([now.points[:, LEFT], second.points[:, LEFT]])
    leading, trailing = gait.plan.contact(now.t).swapaxes(0, 1)[::-1]
    standing = np.concatenate([leading, trailing])
    first = points[np.argmax(standing, axis=0), np.arange(points.shape[1])]
    slid = np.linalg.norm((points - first)[..., [0, 2]], axis=-1)
    times = np.concatenate([now.t, now.t + gait.step_time])
    return _worst("foot sliding while it stands", "m", 0.015, np.where(standing, slid, 0.0), times)


# The walk


def _walk(gait: Gait, now: Samples) -> list[Check]:
    """Joints keep their limits, the pelvis its speed, the knee and the arms their part."""
    return [
        *_joint_limits(gait, now),
        _pelvis_speed(gait, now),
        _knee(gait, now),
        _arms(gait, now),
        *_periodicity(gait, now),
    ]


def _joint_limits(gait: Gait, now: Samples) -> list[Check]:
    """Joint angles stay within their limits, and the pelvis aside and in height, Eq. (19)."""
    lower, upper = joint_limits(gait.scenario)
    outside = np.maximum(np.maximum(lower - now.q, now.q - upper), 0.0)
    return [
        _worst("joint limits exceeded", "deg", _EQUAL, np.rad2deg(outside[:, 3:]), now.t),
        _worst("limits of the pelvis exceeded", "m", _EQUAL, outside[:, 1:3], now.t),
    ]


def _pelvis_speed(gait: Gait, now: Samples) -> Check:
    """The pelvis moves forward at the walking speed, Eq. (23)."""
    off = np.abs(now.v[:, index("pelvis_tz")] - gait.scenario.walk.speed)
    limit = _BETWEEN * gait.scenario.tolerances.pelvis_speed
    return _worst("pelvis off the walking speed", "m/s", limit, off, now.t)


def _knee(gait: Gait, now: Samples) -> Check:
    """The knee of the swing leg is bent by 60 degrees at mid-swing, Eq. (25)."""
    middle = gait.scenario.phases.mid_swing * gait.step_time
    k = int(np.argmin(np.abs(now.t - middle)))
    off = np.abs(np.rad2deg(now.q[k : k + 1, index("knee_flexion_r")]) - 60.0)
    limit = _BETWEEN * gait.scenario.tolerances.knee_flexion_deg
    return _worst("knee off 60 deg at mid-swing", "deg", limit, off, now.t[k : k + 1])


def _arms(gait: Gait, now: Samples) -> Check:
    """Arm and leg of a side swing in opposite directions, Eq. (27)."""
    flexions = [
        [now.q[:, index(f"{joint}_{side}")] for joint in ("shoulder_flexion", "hip_flexion")]
        for side in "rl"
    ]
    together = np.maximum([arm * leg for arm, leg in flexions], 0.0).T
    limit = _BETWEEN * gait.scenario.tolerances.arm_leg
    return _worst("arms swinging with the legs", "rad2", limit, together, now.t)


def _periodicity(gait: Gait, now: Samples) -> list[Check]:
    """Step joins step, and the stride closes: q(T) = mirror(q(0)) + L, q(2T) = q(0) + 2L, Eq. (26).

    With the next step the mirror image, what is left at 2T is what was left at T, mirrored.
    """
    cycle = gait.cycle
    posture = np.abs(now.q[-1] - cycle.turned(now.q[0]) - cycle.advance).max()
    velocity = np.abs(now.v[-1] - cycle.turned(now.v[0])).max()
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
