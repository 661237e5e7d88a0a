"""From a measured motion to one step of our walk: cut, turned, placed, and the mean of all steps.

A walk here is one step from left heel strike to right heel strike, and its mirror image after it.
Of a trial every step counts: those that the right foot leads are mirrored first. Each is placed as
ours are, with the origin midway between the two footholds, facing z, and takes the time from 0 to
1. Splines through all of them are the mean step. What is lost is told: how far left and right
differ, and what the splines do not follow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from human_gait.arrays import BoolArray, FloatArray, IntArray
from human_gait.body.dh import frames
from human_gait.body.person import Body
from human_gait.body.skeleton import MIRROR_INDEX, SIDES_IN_WORDS, index, mirror
from human_gait.exceptions import TrialError
from human_gait.export.events import FootEvent
from human_gait.values import Value

STRIDE = 3
"""Strikes of alternate feet that a stride has."""

_X, _Z = index("pelvis_tx"), index("pelvis_tz")
_TURNS = [index(f"pelvis_r{axis}") for axis in "zxy"]  # in their order
_STANDING = (0.2, 0.6)  # of a step: the leading foot is flat
_IN_PLACE = 0.01  # [m]: a trial that is placed as ours are keeps its coordinates
_STEADY = 0.2  # [m] in a stride: less is no walk over ground
_BRIDGED = 0.1  # [s] without a frame: a spline goes over it
_SLACK = 1.5  # frames that a strike may be outside of the motion


@dataclass(frozen=True, eq=False, repr=False)
class Step(Value):
    """One step of a trial.

    Attributes
    ----------
    start, end : float, [s]
        Its strike, and the next one.
    mirrored : bool
        Whether the right foot leads.
    origin : (2,) array, [m]
        x and z of the point midway between the footholds, after turning.
    """

    start: float
    end: float
    mirrored: bool
    origin: FloatArray


@dataclass(frozen=True, eq=False, repr=False)
class Steps(Value):
    """The steps of a trial, and how they are placed.

    Attributes
    ----------
    steps : tuple of Step
    yaw : float, [rad]
        By which the trial is turned about the vertical to face z.
    speed : float, [m/s]
        Of the belt, by which it is moved on; 0 over ground.
    time, length, width : float, [s] and [m]
        Of the mean step.
    """

    steps: tuple[Step, ...]
    yaw: float
    speed: float
    time: float
    length: float
    width: float

    def placed(self, t: FloatArray, points: FloatArray, step: Step) -> FloatArray:
        """Return points (K, ..., 3) of the trial at times (K,), as a step has them."""
        moved = turned_points(points, self.yaw)
        moved[..., 2] += (self.speed * t).reshape(-1, *[1] * (points.ndim - 2))
        moved[..., [0, 2]] -= step.origin
        return moved * [-1.0, 1.0, 1.0] if step.mirrored else moved

    def directed(self, vectors: FloatArray, step: Step) -> FloatArray:
        """Return vectors (K, ..., 3) of the trial as a step has them."""
        found = turned_points(vectors, self.yaw)
        return found * [-1.0, 1.0, 1.0] if step.mirrored else found

    def samples(self, t: FloatArray, q: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Return of each step the shares of it (n,) that a motion has samples at, and these."""
        moved = moved_on(turned(q, self.yaw), t, self.speed)
        return [self._within(t, moved, step) for step in self.steps]

    def _within(self, t: FloatArray, q: FloatArray, step: Step) -> tuple[FloatArray, FloatArray]:
        share = (t - step.start) / (step.end - step.start)
        on = (share >= -1e-9) & (share <= 1.0 + 1e-9)
        found = q[on].copy()
        found[:, [_X, _Z]] -= step.origin
        return np.clip(share[on], 0.0, 1.0), mirror(found) if step.mirrored else found


def told_by_both(
    parts: Sequence[tuple[FloatArray, FloatArray]], steps: Steps, told: BoolArray
) -> list[tuple[FloatArray, FloatArray]]:
    """Return the samples of steps with what one side does not tell taken from the other side.

    Parameters
    ----------
    parts : sequence of (n,) and (n, 55) array
        Shares of the step and postures, of each step.
    steps : Steps
    told : (55,) bool array
        Whether anything tells a joint.
    """
    here = [told[MIRROR_INDEX] if step.mirrored else told for step in steps.steps]
    found = []
    for (share, q), known in zip(parts, here, strict=True):
        filled = q.copy()
        for j in np.flatnonzero(~known):
            others = [
                CubicSpline(*part)(share)[:, j]
                for part, theirs in zip(parts, here, strict=True)
                if theirs[j]
            ]
            if others:
                filled[:, j] = np.mean(others, axis=0)
        found.append((share, filled))
    return found


def cut(
    body: Body,
    t: FloatArray,
    q: FloatArray,
    strikes: Sequence[FootEvent],
    speed: float,
    source: str,
) -> Steps:
    """Return the steps of a motion (K, 55) at times (K,), between strikes of alternate feet.

    Parameters
    ----------
    body : Body
    t, q : (K,) and (K, 55) array
    strikes : sequence of FootEvent
    speed : float, [m/s]
        Of the belt of a treadmill; 0 over ground.
    source : str
        What errors name.

    Raises
    ------
    TrialError
        If there is no stride, or the walker stays in place.
    """
    run = longest_run(t, strikes)
    if len(run) < STRIDE:
        raise TrialError(
            f"{source}: no whole stride: it takes three strikes of alternate feet within the "
            f"motion, from {t[0]:.3f} to {t[-1]:.3f} s{_without(t)}, and there are {len(run)}"
        )
    at = np.array([event.time for event in run])
    motion = CubicSpline(t, q)
    whole = len(at) - 1 - (len(at) - 1) % 2  # strides
    ends = motion(at[[0, whole]])[:, [_X, _Z]]
    way = ends[1] - ends[0]
    yaw = 0.0 if speed else -float(np.arctan2(way[0], way[1]))
    moved = moved_on(turned(q, yaw), t, speed)
    time = float((at[whole] - at[0]) / whole)
    length = float(np.hypot(*way) if not speed else way[1] + speed * time * whole) / whole
    if length < _STEADY / 2:
        raise TrialError(
            f"{source}: the walker moves on by {2 * length:.3f} m in a stride: give the speed of "
            "the belt if it is a treadmill (--speed)"
        )
    holds = _footholds(body, t, moved, run)
    stride = np.array([0.0, 2.0 * length])
    holds = np.concatenate([[holds[1] - stride], holds])
    origins = (holds[1:] + holds[:-1]) / 2.0
    expected = np.array([[0.0, k * length] for k in range(len(origins))])
    if np.abs(origins - expected).max() < _IN_PLACE:
        origins = expected
    steps = tuple(
        Step(start.time, end.time, start.side == SIDES_IN_WORDS[0], origin)
        for (start, end), origin in zip(pairwise(run), origins, strict=True)
    )
    width = float(np.mean(np.abs(np.diff(holds[:, 0]))))
    return Steps(steps, yaw, speed, time, length, width)


def turned(q: FloatArray, yaw: float) -> FloatArray:
    """Return postures (K, 55) turned about the vertical through the origin, by an angle [rad].

    The pelvis turns about z, then x, then y: R = Rz Rx Ry, whose angles are read from

        R_21 = sin x,   -R_20 / R_22 = tan y,   -R_01 / R_11 = tan z.
    """
    if yaw == 0.0:
        return q
    found, turn = q.copy(), _about_y(yaw)
    place = np.stack([q[:, _X], np.zeros(len(q)), q[:, _Z]], axis=1) @ turn.T
    found[:, _X], found[:, _Z] = place[:, 0], place[:, 2]
    z, x, y = q[:, _TURNS].T
    R = turn @ _about(2, z) @ _about(0, x) @ _about(1, y)
    angles = (
        np.arctan2(-R[:, 0, 1], R[:, 1, 1]),
        np.arcsin(np.clip(R[:, 2, 1], -1.0, 1.0)),
        np.arctan2(-R[:, 2, 0], R[:, 2, 2]),
    )
    found[:, _TURNS] = np.stack(angles, axis=1)
    return found


def turned_points(points: FloatArray, yaw: float) -> FloatArray:
    """Return points or vectors (..., 3) turned about the vertical through the origin."""
    return np.asarray(points @ _about_y(yaw).T)


def moved_on(q: FloatArray, t: FloatArray, speed: float) -> FloatArray:
    """Return postures (K, 55) moved on by a belt at times (K,)."""
    found = q.copy()
    found[:, _Z] += speed * t
    return found


def _about_y(angle: float) -> FloatArray:
    return np.asarray(_about(1, np.array([angle]))[0])


def _about(axis: int, angle: FloatArray) -> FloatArray:
    """Return rotations (K, 3, 3) about an axis of the world by angles (K,)."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.zeros((len(angle), 3, 3))
    R[:, axis, axis] = 1.0
    R[:, i, i], R[:, j, j], R[:, i, j], R[:, j, i] = c, c, -s, s
    return R


def longest_run(t: FloatArray, strikes: Sequence[FootEvent]) -> list[FootEvent]:
    """Return the longest row of strikes of alternate feet within the motion, without long gaps."""
    frame = _frame(t)
    runs: list[list[FootEvent]] = [[]]
    for part in np.split(t, _gaps(t) + 1):
        start, end = part[0] - _SLACK * frame, part[-1] + _SLACK * frame
        inside = [one for one in strikes if one.strike and start <= one.time <= end]
        runs.append([])
        for one in sorted(inside, key=lambda one: one.time):
            if runs[-1] and runs[-1][-1].side == one.side:
                runs.append([])
            runs[-1].append(one)
    return max(runs, key=len)


def _frame(t: FloatArray) -> float:
    return float(np.median(np.diff(t))) if len(t) > 1 else 0.0


def _gaps(t: FloatArray) -> IntArray:
    """Return the frames (n,) after which there is a gap that no step goes over."""
    return np.flatnonzero(np.diff(t) > max(_BRIDGED, 2.0 * _frame(t)) + 1e-9)


def _without(t: FloatArray) -> str:
    gaps = ", ".join(f"{t[k]:.3f} to {t[k + 1]:.3f} s" for k in _gaps(t))
    return f" without {gaps}, where frames are missing" if gaps else ""


def _footholds(body: Body, t: FloatArray, q: FloatArray, run: Sequence[FootEvent]) -> FloatArray:
    """Return where the leading foot of each step stands, x and z of its ankle (n, 2), [m]."""
    P, _ = frames(body.table, q)
    found = []
    for start, end in pairwise(run):
        share = (t - start.time) / (end.time - start.time)
        ankle = P[:, index(f"ankle_dorsiflexion_{start.side[0]}"), :3, 3]
        on = (share >= _STANDING[0]) & (share <= _STANDING[1])
        found.append(ankle[on][:, [0, 2]].mean(axis=0))
    return np.array(found)


def facing(left_to_right: FloatArray) -> float:
    """Return by how much a trial has to be turned about the vertical to face z, [rad].

    Parameters
    ----------
    left_to_right : (K, 3) array, [m]
        From markers of the left side to those of the right: at q = 0 along -x.
    """
    x, _, z = np.nanmean(left_to_right, axis=0)
    return float(np.arctan2(-z, -x))
