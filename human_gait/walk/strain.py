"""What a walk takes of the body: moments in the lower back, and torques as shares of strength."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.limits import strength_limits
from human_gait.body.skeleton import (
    DOF_NAMES,
    MIRROR_INDEX,
    MIRROR_SIGN,
    N_DOF,
    in_words,
    index,
    mirror,
)

if TYPE_CHECKING:
    from human_gait.scenario import Subject
    from human_gait.walk.gait import Samples

L5S1: Mapping[str, tuple[str, float]] = {
    "extension": ("spine1_flexion", -1.0),
    "lateral bending": ("spine1_lateral", 1.0),
    "rotation": ("spine1_rotation", 1.0),
}
"""Axes of L5/S1, the joint of pelvis and spine: degree of freedom and its sign."""

_OPPOSITE = {  # the other sense of an axis; longer names first
    "dorsiflexion": "plantarflexion",
    "toe extension": "toe flexion",
    "flexion": "extension",
    "abduction": "adduction",
    "inversion": "eversion",
    "rotation": "external rotation",
    "protraction": "retraction",
    "elevation": "depression",
    "pronation": "supination",
    "radial deviation": "ulnar deviation",
}


@dataclass(frozen=True)
class SpineMoment:
    """Net moment about one axis of L5/S1, the joint of pelvis and spine, [N m].

    Attributes
    ----------
    axis : str
        One of `L5S1`: ``extension``, ``lateral bending``, ``rotation``.
    greatest, least : float
        Over a stride. Muscles that keep the trunk from falling forward extend: positive. Of the
        other two axes both sides take turns: the least is the greatest with the other sign.
    mean : float
        Of the moment; of the other two axes of its size.
    """

    axis: str
    greatest: float
    least: float
    mean: float

    @property
    def peak(self) -> float:
        """The greatest, or the least where that is larger in size, [N m]."""
        return max(self.greatest, self.least, key=abs)


@dataclass(frozen=True)
class StrengthShare:
    """The largest muscle torque about an axis in one sense, as a share of the strength.

    Attributes
    ----------
    joint : str
        Joint and sense, in words: ``ankle plantarflexion``.
    torque, strength : float, [N m]
        Of either side, over a stride.
    share : float
        Of the strength.
    """

    joint: str
    torque: float
    strength: float
    share: float


def spine_moments(now: Samples) -> tuple[SpineMoment, ...]:
    """Return the moments of L5/S1 over the time of some samples, which is to be one step."""
    moments = {axis: sign * now.tau[:, index(dof)] for axis, (dof, sign) in L5S1.items()}
    return tuple(_moment(axis, moment, now.t) for axis, moment in moments.items())


def _moment(axis: str, moment: FloatArray, t: FloatArray) -> SpineMoment:
    alternates = axis != "extension"  # from step to step
    size = np.abs(moment) if alternates else moment
    mean, greatest = float(np.trapezoid(size, t) / (t[-1] - t[0])), float(size.max())
    return SpineMoment(axis, greatest, -greatest if alternates else float(size.min()), mean)


def strength_shares(now: Samples, subject: Subject) -> tuple[StrengthShare, ...]:
    """Return the largest muscle torque of every axis in either sense, nearest to strength first.

    Axes whose strength no source tells (``data/joint_limits.csv``) are left out.
    """
    limits = strength_limits(subject)
    stride = np.concatenate([now.active, mirror(now.active)])
    peaks = (-stride.min(axis=0), stride.max(axis=0))
    found = []
    for i in map(int, np.flatnonzero(np.isfinite(limits[0]) & (np.arange(N_DOF) <= MIRROR_INDEX))):
        name = in_words(DOF_NAMES[i]).removeprefix("right ")
        for sense, peak, limit in zip(_senses(name, i), peaks, limits, strict=True):
            torque, strength = max(float(peak[i]), 0.0), float(abs(limit[i]))
            if sense:
                found.append(StrengthShare(sense, torque, strength, torque / strength))
    return tuple(sorted(found, key=lambda one: -one.share))


def _senses(name: str, i: int) -> tuple[str, str]:
    """Return what a torque about an axis does below and above zero; once if a mirror turns it."""
    if MIRROR_INDEX[i] == i and MIRROR_SIGN[i] < 0:
        return "", name
    end = next(positive for positive in _OPPOSITE if name.endswith(positive))
    below, above = name.removesuffix(end) + _OPPOSITE[end], name
    return below, above.replace(" rotation", " internal rotation")
