"""What a measured walk is not: what the mean step, its splines and a body of ours leave out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import DOF_NAMES, MIRROR_INDEX, PRISMATIC, in_words
from human_gait.trials.inverse_kinematics import TOLD
from human_gait.trials.motion import Moved
from human_gait.trials.steps import Steps
from human_gait.walk.gait import Gait

_SHOWN = 6  # joints that are named
_PERCENT = np.linspace(0.0, 1.0, 51)


def off_the_mean(
    gait: Gait, steps: Steps, parts: Sequence[tuple[FloatArray, FloatArray]]
) -> list[str]:
    """Return what the mean step is not: each side by itself, and what its splines do not follow."""
    turning = ~PRISMATIC
    off = np.concatenate(
        [q - gait.basis.matrix(share * gait.step_time) @ gait.control_points for share, q in parts]
    )[:, turning]
    rms = np.rad2deg(np.sqrt((off**2).mean()))
    lost = [f"joint angles of the steps are {rms:.2f} deg (rms) off the mean"]
    curves = [CubicSpline(share, q)(_PERCENT) for share, q in parts]
    sides = [
        [curve for curve, step in zip(curves, steps.steps, strict=True) if step.mirrored == which]
        for which in (False, True)
    ]
    if all(sides):
        apart = np.abs(np.mean(sides[0], axis=0) - np.mean(sides[1], axis=0))[:, turning]
        worst = int(np.argmax((apart**2).mean(axis=0)))
        most = np.rad2deg(np.sqrt((apart[:, worst] ** 2).mean()))
        which = in_words(np.array(DOF_NAMES)[turning][worst])
        whole = np.rad2deg(np.sqrt((apart**2).mean()))
        lost.append(
            f"left and right steps differ by {whole:.2f} deg (rms), most the {which}: {most:.1f}"
        )
    return lost


def off_markers(moved: Moved) -> list[str]:
    """Return how far markers are from those of the body, and which joints none of them tells."""
    if not moved.sites:
        return []
    lost = [f"markers are {1000.0 * moved.off:.1f} mm (rms) off those of the body"]
    if moved.left_out:
        n = len(moved.time) + moved.left_out
        lost.append(f"{moved.left_out} of {n} frames have too few markers of the legs: left out")
    unknown = moved.told < TOLD
    unknown &= unknown[MIRROR_INDEX]
    names = [in_words(name) for name in np.array(DOF_NAMES)[unknown]]
    if names:
        more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
        lost.append(f"no marker tells {', '.join(names[:_SHOWN])}{more}: taken as at rest")
    return lost


def left_over(gait: Gait) -> list[str]:
    """Return what motion and forces leave over at the pelvis."""
    if gait.forces is None:
        return ["the forces are those that the motion takes, shared by Eq. (17)"]
    tau, weight = gait.fine_samples.tau, gait.plan.weight
    force, moment = (
        float(np.sqrt((tau[:, part] ** 2).sum(axis=1).mean())) for part in (slice(3), slice(3, 6))
    )
    share = 100.0 * force / weight
    over = f"{force:.1f} N ({share:.1f} % of the weight) and {moment:.1f} N m (rms)"
    return [f"motion and forces leave {over} over, which nothing gives to the pelvis"]
