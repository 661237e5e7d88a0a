"""The ground: it pushes where feet stand, under them, and holds them by friction."""

from __future__ import annotations

import numpy as np

from human_gait.arrays import BoolArray, FloatArray
from human_gait.checks.check import EQUAL, Check, Claim, Kind
from human_gait.walk.contact_plan import LEFT, RIGHT, ContactPlan
from human_gait.walk.gait import Samples
from human_gait.walk.ground_reaction import share_on_toes

IN_THE_AIR = Claim("force on a foot in the air", "of weight", Kind.GROUND)
PULL = Claim("ground pulling at a foot", "of weight", Kind.GROUND)
SHARES = Claim("moments not shared as the loads", "N m", Kind.GROUND, "17")
TOES = Claim("toes' share off the pressure", "of the foot", Kind.GROUND)
ON_GROUND = Claim("pressure not on the ground", "m", Kind.GROUND)
ZMP_OF_FORCES = Claim("ZMP off that of the forces", "m", Kind.GROUND, "Fig. 5")
FREE = Claim("pressure of a free foot off the ZMP", "m", Kind.GROUND)
ZMP = Claim("ZMP outside the foot support region", "m", Kind.INSTANTS, "22")
PRESSURE = Claim("pressure outside its foot", "m", Kind.INSTANTS)
SLIDING = Claim("friction needed against sliding", "coefficient", Kind.FRICTION, "Coulomb")
TURNING = Claim("friction needed against turning", "coefficient", Kind.FRICTION, "Coulomb")

_LOADED = 0.05  # of the weight


def ground_checks(plan: ContactPlan, now: Samples) -> list[Check]:
    """The ground pushes where feet stand, and holds them by friction."""
    height, of_forces = np.abs(now.cop[..., 1]), zmp_of_forces(now)
    return [
        in_the_air(plan, now),
        no_pull(plan, now),
        shared(plan, now),
        on_toes(plan, now),
        ON_GROUND.worst(EQUAL, height, now.t),
        ZMP_OF_FORCES.apart(now.zmp, of_forces, now.t),
        free_pressure(plan, now),
        zmp_inside(plan, now),
        pressure_inside(plan, now),
        sliding_friction(plan, now),
        turning_friction(plan, now),
    ]


def in_the_air(plan: ContactPlan, now: Samples) -> Check:
    """Nothing acts on a foot of which no part stands."""
    acting = np.concatenate([now.grf, now.yaw_moment[..., None]], axis=-1)
    acting = np.linalg.norm(acting, axis=-1) / plan.weight  # a metre for the moment's arm
    return IN_THE_AIR.worst(EQUAL, acting * _flying(plan, now), now.t)


def free_pressure(plan: ContactPlan, now: Samples) -> Check:
    """The file puts the pressure of a foot in the air at the ZMP, under the other foot."""
    apart = np.linalg.norm(now.cop - now.zmp[:, None], axis=-1)
    return FREE.worst(EQUAL, np.where(_flying(plan, now), apart, 0.0), now.t)


def _flying(plan: ContactPlan, now: Samples) -> BoolArray:
    """Return (K, 2) true for feet of which no part stands."""
    return np.asarray(~plan.contact(now.t).any(axis=-1))


def shared(plan: ContactPlan, now: Samples) -> Check:
    """The feet share the vertical moment as they share the vertical force, Eq. (17)."""
    force, moment = now.grf[..., 1], now.yaw_moment
    total = np.maximum(force.sum(axis=1, keepdims=True), _LOADED * plan.weight)
    off = np.abs(moment - force / total * moment.sum(axis=1, keepdims=True))
    return SHARES.worst(1e-6, off, now.t)


def on_toes(plan: ContactPlan, now: Samples) -> Check:
    """The toes carry what acts ahead of the ball of the foot."""
    share = share_on_toes(now.cop[..., 2] - plan.balls)
    return TOES.apart(now.toe_share, share, now.t)


def no_pull(plan: ContactPlan, now: Samples) -> Check:
    """The ground does not pull at a foot."""
    pull = np.maximum(-now.grf[..., 1], 0.0) / plan.weight
    return PULL.worst(0.0, pull, now.t)


def zmp_inside(plan: ContactPlan, now: Samples) -> Check:
    """The ZMP is in the foot support region, Eq. (22)."""
    outside = np.empty(len(now.t))
    for instants, corners in plan.support_regions(now.t):
        outside[instants] = distance_outside(corners, now.zmp[instants][:, [0, 2]])
    return ZMP.worst(0.01, outside, now.t)


def pressure_inside(plan: ContactPlan, now: Samples) -> Check:
    """The centre of pressure of each loaded foot is under the part of it that stands."""
    outside = np.full((len(now.t), 2), np.inf)
    for f in (RIGHT, LEFT):
        for instants, corners in plan.support_regions(now.t, (f,)):
            if len(corners):
                outside[instants, f] = distance_outside(corners, now.cop[instants, f][:, [0, 2]])
    return PRESSURE.worst(0.01, np.where(_loaded(plan, now), outside, 0.0), now.t)


def sliding_friction(plan: ContactPlan, now: Samples) -> Check:
    """The floor keeps the feet from sliding: horizontal against vertical force of each."""
    horizontal = np.linalg.norm(now.grf[..., [0, 2]], axis=-1)
    needed = horizontal / np.maximum(now.grf[..., 1], _LOADED * plan.weight)
    return SLIDING.worst(plan.friction, needed, now.t)


def turning_friction(plan: ContactPlan, now: Samples) -> Check:
    """The floor keeps the walker from turning: vertical moment at the ZMP against even friction."""
    zmp = zmp_of_forces(now)
    arms = now.cop - zmp[:, None]
    moment = now.yaw_moment.sum(axis=1) + np.cross(arms, now.grf)[..., 1].sum(axis=1)
    vertical = np.maximum(now.grf[..., 1].sum(axis=1), _LOADED * plan.weight)
    needed = np.abs(moment) / (vertical * plan.turning_radius(now.t))
    return TURNING.worst(plan.friction, needed, now.t)


def _loaded(plan: ContactPlan, now: Samples) -> BoolArray:
    """Return (K, 2) true for feet with enough force on them to speak of its place and direction."""
    return np.asarray(now.grf[..., 1] > _LOADED * plan.weight)


def zmp_of_forces(now: Samples) -> FloatArray:
    """Return where the horizontal moments of the forces on both feet vanish (K, 3), Fig. 5."""
    force, moment = now.grf.sum(axis=1), np.cross(now.cop, now.grf).sum(axis=1)
    zmp: FloatArray = np.zeros_like(force)
    vertical = np.where(force[:, 1] == 0.0, np.nan, force[:, 1])
    zmp[:, 0], zmp[:, 2] = moment[:, 2] / vertical, -moment[:, 0] / vertical
    return zmp


def distance_outside(polygon: FloatArray, points: FloatArray) -> FloatArray:
    """Return the distances (...) of points (..., 2) from a convex polygon (n, 2), 0 inside."""
    edges = np.roll(polygon, -1, axis=0) - polygon
    offset = points[..., None, :] - polygon
    turn = edges[:, 0] * offset[..., 1] - edges[:, 1] * offset[..., 0]
    inside = np.all(turn >= 0.0, axis=-1) | np.all(turn <= 0.0, axis=-1)
    along = np.clip(np.sum(offset * edges, axis=-1) / np.sum(edges**2, axis=1), 0.0, 1.0)
    nearest = np.linalg.norm(offset - along[..., None] * edges, axis=-1).min(axis=-1)
    return np.asarray(np.where(inside, 0.0, nearest))
