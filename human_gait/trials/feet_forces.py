"""Measured forces of the ground: which foot they act on, and what they are in the mean step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from human_gait.arrays import BoolArray, FloatArray
from human_gait.body.dh import frames
from human_gait.body.person import Body
from human_gait.body.skeleton import SIDES, SIDES_IN_WORDS, index
from human_gait.export.events import FootEvent
from human_gait.trials.contacts import LOADED, NOTHING, contacts
from human_gait.trials.recording import Plate
from human_gait.trials.steps import Step, Steps
from human_gait.walk.measured import GroundForces

_BESIDE = 0.35  # [m]: pressure further from both ankles is that of neither foot
_TIMES = 401  # of a step
_EARLY, _MIDDLE = slice(0, 41), slice(160, 361)  # when a foot that stood, or stands, is loaded


def by_foot(body: Body, t: FloatArray, q: FloatArray, plates: Sequence[Plate]) -> list[Plate]:
    """Return what acts on the right and on the left foot, each contact on the nearer foot.

    Of plates that say which foot they are of nothing is asked. A plate under both feet at a time
    gives all to the one that is nearer on average.

    Parameters
    ----------
    body : Body
    t, q : (K,) and (K, 55) array
        The motion, in the axes of the plates.
    plates : sequence of Plate
    """
    P, _ = frames(body.table, q)
    ankles = [P[:, index(f"ankle_dorsiflexion_{side}"), :3, 3] for side in SIDES]
    found: list[list[Plate]] = [[], []]
    for plate in plates:
        for contact in contacts(plate):
            part = _part(plate, contact)
            if plate.name in SIDES:
                found[SIDES.index(plate.name)].append(part)
                continue
            near = [_distance(part, t, ankle) for ankle in ankles]
            if min(near) <= _BESIDE:
                found[int(np.argmin(near))].append(part)
    return [_together(parts, side) for parts, side in zip(found, SIDES, strict=True)]


def strikes_by_forces(feet: Sequence[Plate]) -> tuple[FootEvent, ...]:
    """Return strikes and offs of the feet, where contacts begin and end within a trial."""
    found = []
    for plate, side in zip(feet, SIDES_IN_WORDS, strict=True):
        if not len(plate.time):
            continue
        for on in contacts(plate):
            begin, end = np.flatnonzero(on)[[0, -1]]
            if begin > 0:
                found.append(FootEvent(float(plate.time[begin]), side, strike=True))
            if end < len(on) - 1:
                found.append(FootEvent(float(plate.time[end]), side, strike=False))
    return tuple(sorted(found, key=lambda one: one.time))


def mean_forces(feet: Sequence[Plate], steps: Steps) -> tuple[GroundForces | None, int]:
    """Return the forces in the mean step, and of how many steps they are; None if one is missing.

    The leading foot counts in the steps in which it is loaded in the middle, the trailing foot
    where it is at the strike of the other.
    """
    kept: list[list[FloatArray]] = [[], []]  # trailing, leading
    for step in steps.steps:
        for f, plate in enumerate(feet):
            leads = (f == 0) == step.mirrored
            wrench = _in_step(plate, steps, step)
            if wrench[_MIDDLE if leads else _EARLY, 1].min() > LOADED:
                kept[int(leads)].append(wrench)
    if not all(kept):
        return None, 0
    return _forces(np.stack([np.mean(one, axis=0) for one in kept], axis=1)), max(map(len, kept))


def _in_step(plate: Plate, steps: Steps, step: Step) -> FloatArray:
    """Return the wrench of a foot about the origin of a step, (n, 6), at even times of it."""
    t = step.start + np.linspace(0.0, 1.0, _TIMES) * (step.end - step.start)
    if not len(plate.time):
        return np.zeros((_TIMES, 6))
    force, point = (_at(t, plate.time, x) for x in (plate.force, _filled(plate.point)))
    moment = _at(t, plate.time, plate.free_moment[:, None])[:, 0]
    force, point = steps.directed(force, step), steps.placed(t, point, step)
    about = np.cross(point, force)
    about[:, 1] += -moment if step.mirrored else moment
    return np.concatenate([force, about], axis=1)


def _forces(wrench: FloatArray) -> GroundForces:
    """Return wrenches about the origin (n, 2, 6) as forces at centres of pressure."""
    force, about = wrench[..., :3], wrench[..., 3:]
    acts = force[..., 1] > NOTHING
    force = np.where(acts[..., None], force, 0.0)
    up = np.where(acts, force[..., 1], 1.0)
    point = np.stack([about[..., 2] / up, -about[..., 0] / up], axis=-1)
    point = np.stack([_filled(np.where(acts[:, f, None], point[:, f], np.nan)) for f in (0, 1)], 1)
    turning = point[..., 1] * force[..., 0] - point[..., 0] * force[..., 2]
    return GroundForces(force, point, np.where(acts, about[..., 1] - turning, 0.0))


def _part(plate: Plate, on: BoolArray) -> Plate:
    """Return a plate with one of its contacts alone."""
    force = np.where(on[:, None], plate.force, 0.0)
    point = np.where(on[:, None], _filled(plate.point), np.nan)
    return Plate(plate.time, force, point, np.where(on, plate.free_moment, 0.0), plate.name)


def _distance(part: Plate, t: FloatArray, ankle: FloatArray) -> float:
    on = np.isfinite(part.point).all(axis=1)
    there = np.stack([np.interp(part.time[on], t, x) for x in ankle.T], axis=1)
    return float(np.linalg.norm((part.point[on] - there)[:, [0, 2]], axis=1).mean())


def _together(parts: Sequence[Plate], name: str) -> Plate:
    """Return the sum of what acts on one foot, at the times of the first part."""
    if not parts:
        return Plate(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), name)
    t = parts[0].time
    force, about = np.zeros((len(t), 3)), np.zeros((len(t), 3))
    for part in parts:
        pushes, point = _at(t, part.time, part.force), _at(t, part.time, _filled(part.point))
        force += pushes
        about += np.cross(point, pushes)
        about[:, 1] += _at(t, part.time, part.free_moment[:, None])[:, 0]
    acts = force[:, 1] > 0.0
    up = np.where(acts, force[:, 1], 1.0)
    point = np.stack([about[:, 2] / up, np.zeros(len(t)), -about[:, 0] / up], axis=1)
    turning = np.cross(np.where(acts[:, None], point, 0.0), force)[:, 1]
    point = np.where(acts[:, None], point, np.nan)
    return Plate(t, force, point, about[:, 1] - turning, name)


def _at(t: FloatArray, times: FloatArray, values: FloatArray) -> FloatArray:
    """Return what acts (n, d) at other times (K, d), evenly between samples.

    Each end counts for one sample more; beyond the record there is nothing.
    """
    found = np.stack([np.interp(t, times, column) for column in values.T], axis=1)
    sample = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    within = (t >= times[0] - sample) & (t <= times[-1] + sample)
    return np.where(within[:, None], found, 0.0)


def _filled(values: FloatArray) -> FloatArray:
    """Return values (n, d) whose gaps have the nearest known ones; 0 if there are none."""
    known = np.flatnonzero(np.isfinite(values).all(axis=1))
    if not len(known):
        return np.zeros_like(values)
    after = np.clip(np.searchsorted(known, np.arange(len(values))), 0, len(known) - 1)
    before = np.clip(after - 1, 0, None)
    k = np.arange(len(values))
    nearer = np.abs(known[before] - k) < np.abs(known[after] - k)
    return values[np.where(nearer, known[before], known[after])]
