"""The laws of motion: the body moves by the forces and torques of the file.

Pinocchio, Drake and the paper's recursion each compute the torques that the motion takes under the
forces of the file (`engines`); Drake, which no solve uses, also tells what momentum and energy do.
"""

from __future__ import annotations

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.dh import frames
from human_gait.body.links import GRAVITY
from human_gait.body.skeleton import SEGMENTS
from human_gait.checks.check import EQUAL, Check, Claim, Kind
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
from human_gait.walk.gait import Gait, Samples, onward
from human_gait.walk.gait_file import Record

_ENERGY = "work and energy"
TORQUES = {
    engine: Claim(f"torques off {engine}'s", "of largest torque", Kind.LAWS, "9")
    for engine in ("Pinocchio", "Drake", "the recursion")
}
NEXT_STEP = Claim("next step's torques off Drake's", "of largest torque", Kind.LAWS, "9, 26")
MUSCLES = Claim("muscle torques off the torques", "of largest torque", Kind.LAWS, "18")
BALANCE = Claim("unbalanced force or moment", "of weight", Kind.LAWS, "17")
MOMENTUM = Claim("momentum off the impulse", "of weight x T", Kind.TIES, "Newton, Euler")
ENERGY = Claim("energy off joints' and ground's work", "of work done", Kind.LAWS, _ENERGY)
GROUND_WORK = Claim("work of the ground on standing feet", "of joint work", Kind.WALK, _ENERGY)
MEAN_FORCE = Claim("mean vertical force against weight", "of weight", Kind.TIES, "Newton")

_ON_FEET = 4
"""So many loads, the first of them, are the ground's: on rear foot and toes of both feet."""

_MOST_GROUND_WORK = 0.25  # of the positive work of the joints


def dynamics_checks(
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
        *(_torques(TORQUES[name], now, tau, peak) for name, tau in torques.items()),
        next_step(gait, now, drake, peak),
        muscles(gait, now, peak),
        balance(gait, now, np.stack(list(torques.values()), axis=1)),
        momentum(gait, now, found),
        energy(now, found),
        ground_work(now, found),
        mean_force(gait, now),
    ]


def _peak(gait: Gait, torques: FloatArray) -> float:
    """Return the largest torque of an engine, but no more than a body can need, [N m]."""
    most = gait.plan.weight * gait.body.subject.stature
    return float(np.clip(np.nan_to_num(np.abs(torques[:, 6:]).max(), nan=most), 1.0, most))


def _torques(claim: Claim, now: Samples, torques: FloatArray, peak: float) -> Check:
    """The torques are those of an engine, Eq. (9)."""
    return claim.worst(EQUAL, np.abs(torques - now.tau) / peak, now.t)


def muscles(gait: Gait, now: Samples, peak: float) -> Check:
    """Muscles give the joint torques, less what passive tissue gives where it is counted."""
    passive, kind = 0.0 * now.tau, gait.scenario.objective.passive_torques
    if kind != "none":
        passive = PassiveJoints(kind).torque(now.q, now.v).value
    off = np.abs(now.active - (now.tau - passive)) / peak
    return MUSCLES.worst(EQUAL, off, now.t)


def next_step(gait: Gait, now: Samples, drake: DrakeEngine, peak: float) -> Check:
    """The mirror image of the step is a motion of the same body: the stride goes on, Eq. (26)."""
    second = onward(now, np.ones(len(now.t), dtype=int), gait.cycle)
    torques = drake.torques((second.q, second.v, second.a), loads_of(gait, second))
    return _torques(NEXT_STEP, second, torques, peak)


def balance(gait: Gait, now: Samples, torques: FloatArray) -> Check:
    """Newton and Euler: the ground reaction nulls the global DOF (K, engines, 55), Eq. (17)."""
    weight = gait.plan.weight
    scale = np.array([weight] * 3 + [weight * gait.body.subject.stature] * 3)
    residual = np.abs(torques[..., :6]) / scale
    return BALANCE.worst(1e-6, residual, now.t)


def momentum(gait: Gait, now: Samples, found: Mechanics) -> Check:
    """Over the step the body gains the momentum that gravity and ground give it."""
    given = np.trapezoid(found.wrench, now.t, axis=0)
    weight = gait.plan.weight * gait.step_time
    scale = np.array([weight * gait.body.subject.stature] * 3 + [weight] * 3)
    off = np.abs(found.momentum[-1] - found.momentum[0] - given) / scale
    return MOMENTUM.worst(1e-3, off[None], now.t[-1:])


def energy(now: Samples, found: Mechanics) -> Check:
    """Energy changes by the work of joint torques and loads, the ground among them."""
    power = found.loads_power.sum(axis=1) + np.sum(now.tau * now.v, axis=1)
    steps = np.diff(now.t)
    work = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * steps)])
    gross = float(np.sum(np.abs(power[1:] + power[:-1]) / 2 * steps))
    off = np.abs(found.energy - found.energy[0] - work) / max(gross, 1.0)
    return ENERGY.worst(1e-3, off, now.t)


def ground_work(now: Samples, found: Mechanics) -> Check:
    """The ground does no work on feet that stand: what it does comes from standing points moving.

    In one step, against the positive work of the joints. The check is on the amount; what is said
    with it has the sign: of the ground on the feet.
    """
    power = found.loads_power[:, :_ON_FEET].sum(axis=1)
    work = float(np.trapezoid(power, now.t))
    positive = float(np.trapezoid(np.maximum(now.tau * now.v, 0.0).sum(axis=1), now.t))
    share, at = work / max(positive, 1.0), float(now.t[np.argmax(np.abs(power))])
    what = (
        f"{work:+.1f} J a step, {100.0 * share:+.1f} % of {positive:.1f} J of the joints; "
        f"{power.min():.0f} to {power.max():.0f} W"
    )
    value = float(np.nan_to_num(abs(share), nan=np.inf))
    return GROUND_WORK.found(value, _MOST_GROUND_WORK, at, what)


def mean_force(gait: Gait, now: Samples) -> Check:
    """The ground carries the weight on average: a periodic walk neither rises nor falls."""
    vertical = now.grf[..., 1].sum(axis=1)
    mean = np.trapezoid(vertical, now.t) / gait.step_time
    error = np.array([abs(mean / gait.plan.weight - 1.0)])
    return MEAN_FORCE.worst(1e-3, error, now.t[-1:])


def loads_of(gait: Gait, now: Samples) -> list[ExternalLoad]:
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
