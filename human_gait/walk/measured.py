"""What was measured of a walk: the forces of the ground, and how it is told that it was.

A predicted walk has the forces that its motion takes (`ground_reaction`). Where force plates have
measured them, motion and forces come from two instruments and a model of the body, and do not
agree: what is left over is a force and a moment at the pelvis, which nothing in the world gives.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from human_gait.arrays import BoolArray, FloatArray
from human_gait.values import Value
from human_gait.walk.ground_reaction import LOADED, share_on_toes

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait, Samples
    from human_gait.walk.instant import Instants

MEASURED = "measured"
"""Of the solution of a gait: what it was fitted to, if it was measured; also its ``solver``."""

MEASURED_TITLE = "This is a measured walk, no prediction."
"""What pictures and files say of a gait that was measured: there is no room for more."""

TRACKED = "tracked"
"""Of the solution of a gait: what motion its prediction followed, and with what weight."""


@dataclass(frozen=True, eq=False, repr=False)
class GroundForces(Value):
    """What the ground was measured to give to the feet in a step, at n even times from 0 to T.

    Attributes
    ----------
    force : (n, 2, 3) array, [N]
        On the right and on the left foot.
    point : (n, 2, 2) array, [m]
        Centre of pressure, x and z; where nothing acts, that of the nearest time at which it does.
    free_moment : (n, 2) array, [N m]
        About the vertical through the point.
    """

    force: FloatArray
    point: FloatArray
    free_moment: FloatArray

    def at(self, share: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return force (K, 2, 3), point (K, 2, 2) and moment (K, 2) at shares of the step (K,)."""
        n = len(self.force) - 1
        k = np.clip(np.floor(share * n).astype(int), 0, n - 1)
        w = share * n - k
        force, point, moment = (
            (1.0 - _like(w, x)) * x[k] + _like(w, x) * x[k + 1]
            for x in (self.force, self.point, self.free_moment)
        )
        return force, point, moment


def _like(w: FloatArray, x: FloatArray) -> FloatArray:
    return w.reshape(-1, *[1] * (x.ndim - 1))


def under_forces(
    now: Samples, instants: Instants, forces: GroundForces, share: FloatArray, balls: FloatArray
) -> Samples:
    """Return samples of a motion under measured forces: torques by inverse dynamics.

    Torques of the six global DOF are what motion and forces leave over.

    Parameters
    ----------
    now : Samples
        Under the forces that the motion takes.
    instants : Instants
        The same motion, with the dynamics of the body without the ground.
    forces : GroundForces
    share : (K,) array
        Of the step.
    balls : (2,) array, [m]
        Forward position of the metatarsal heads of the standing feet: what acts ahead of them acts
        on the toes.
    """
    force, point, moment = forces.at(share)
    place = np.stack([point[..., 0], np.zeros_like(moment), point[..., 1]], axis=-1)
    about_origin = np.cross(place, force)
    about_origin[..., 1] += moment
    wrench = np.concatenate([force, about_origin], axis=-1)
    zmp = _zmp(wrench.sum(axis=1))
    place = np.where(_acts(force, moment)[..., None], place, zmp[:, None])
    toes = share_on_toes(place[..., 2] - balls)
    tau = instants.dynamics.torque.value.copy()
    for f, (rear, whole) in enumerate(LOADED):
        parts = (
            ((1.0 - toes[:, f])[:, None] * wrench[:, f], rear),
            (toes[:, f, None] * wrench[:, f], whole),
        )
        for acting, joints in parts:
            axes = instants.dynamics.axes[:, :, joints]
            tau[:, joints] -= (acting[:, None] @ axes)[:, 0]
    return replace(
        now,
        tau=tau,
        active=tau - instants.passive_torque,
        zmp=zmp,
        grf=force,
        cop=place,
        yaw_moment=moment,
        toe_share=toes,
    )


def _acts(force: FloatArray, moment: FloatArray) -> BoolArray:
    return np.asarray(force.any(axis=-1) | (moment != 0.0))


def _zmp(wrench: FloatArray) -> FloatArray:
    """Return where the horizontal moments of wrenches (K, 6) vanish (K, 3), 0 where none acts."""
    up = np.where(wrench[:, 1] == 0.0, np.inf, wrench[:, 1])
    none = np.zeros(len(wrench))
    return np.stack([wrench[:, 5] / up, none, -wrench[:, 3] / up], axis=-1)


def was_measured(gait: Gait) -> Mapping[str, Any] | None:
    """Return what a gait was fitted to, or None if it was not measured."""
    found = gait.solution.get(MEASURED)
    return found if isinstance(found, Mapping) else None


def was_tracked(gait: Gait) -> Mapping[str, Any] | None:
    """Return what motion the prediction of a gait followed, or None."""
    found = gait.solution.get(TRACKED)
    return found if isinstance(found, Mapping) else None


def tracked_words(gait: Gait) -> str:
    """Return in a sentence what motion the prediction of a gait followed; else nothing."""
    found = was_tracked(gait)
    if found is None:
        return ""
    return (
        f"{gait.scenario.name} follows the joint angles of {found['what']} with the weight "
        f"{found['weight']:g} N^2 m^2/rad^2: these do not test it, nor do curves like them."
    )


def measured_words(gait: Gait) -> str:
    """Return in sentences that a gait was measured and what it does not keep; else nothing."""
    found = was_measured(gait)
    if found is None:
        return ""
    what = f"{MEASURED_TITLE[:-1]}: {found['what']}"
    return f"{what}. Not kept: {'; '.join(found['not_kept'])}."
