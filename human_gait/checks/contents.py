"""The contents of a file: its parts belong to its scenario and splines, and are as written.

What scenario and control points give is computed anew, the way every other command does it: nobody
gets from a result what has not been checked. That the laws of motion agree is another question,
which engines answer that share nothing with the walk (`laws`).
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.checks.check import EQUAL, Check, Claim, Kind
from human_gait.checks.costs import costs
from human_gait.walk.described import ESTIMATE, was_changed
from human_gait.walk.gait import Gait, Samples
from human_gait.walk.gait_file import Record, carried_mass

ANGLES = Claim("angles off the splines", "rad, m", Kind.FILE, "28")
VELOCITIES = Claim("velocities off the splines", "rad/s, m/s", Kind.FILE, "28")
ACCELERATIONS = Claim("accelerations off the splines", "rad/s2, m/s2", Kind.FILE, "28")
MASSES = Claim("masses off the body", "of each", Kind.FILE)
PLANNED = Claim("footholds off the plan", "m", Kind.FILE, "21")
SAMPLES = Claim("samples off scenario and splines", "of largest", Kind.FILE)
COST = Claim("cost off the objective", "of the cost", Kind.FILE, "18")
NOT_SOLVED = Claim("an estimate, not solved", "estimates", Kind.FILE)
SEAL = Claim("parts not as they were written", "parts", Kind.FILE)

OWN_COST = "own_cost"
"""Of a solution: the part of its cost that is of one's own, which no file has as a function."""

_SHOWN = 25
"""Names of members: more than a file has of ours."""

_FOUND = ("the walk that was found",)


def contents_checks(record: Record) -> list[Check]:
    """Samples, body, footholds and cost belong to splines and scenario; all is as written."""
    gait, now = record.gait, record.samples
    t, start = now.t, now.t[:1]
    q, v, a = (gait.basis.matrix(t, order) @ gait.control_points for order in range(3))
    mass = carried_mass(gait.body)
    scale = np.where(mass > 0.0, mass, 1.0)
    plan = gait.plan.footholds[None]
    return [
        ANGLES.apart(now.q, q, t),
        VELOCITIES.apart(now.v, v, t),
        ACCELERATIONS.apart(now.a, a, t),
        MASSES.apart(record.mass[None] / scale, mass / scale, start),
        PLANNED.apart(record.footholds[None], plan, start),
        as_computed(now, gait.fine_samples),
        cost(gait),
        as_written(record),
        *([NOT_SOLVED.found(1.0, 0.0, 0.0)] if ESTIMATE in gait.solution else ()),
    ]


def as_computed(now: Samples, expected: Samples) -> Check:
    """Every array of the samples is what scenario and control points give, to 1e-9 of its size."""
    names = [item.name for item in fields(Samples) if item.name != "t"]
    off = np.array([_off(getattr(now, name), getattr(expected, name)) for name in names])
    wrong = [names[i] for i in np.argsort(-off.max(axis=1)) if not off[i].max() <= EQUAL]
    return SAMPLES.worst(EQUAL, off.T, now.t, ", ".join(wrong))


def _off(found: FloatArray, expected: FloatArray) -> FloatArray:
    """Return how far an array (K, ...) is from what it should be, (K,), of its largest number."""
    largest = float(np.nan_to_num(np.abs(expected), posinf=0.0).max())
    apart = np.abs(found - expected).reshape(len(found), -1) / max(largest, 1e-3)
    return np.asarray(np.nan_to_num(apart, nan=np.inf).max(axis=1))


def cost(gait: Gait) -> Check:
    """The cost that is told is the scenario's objective: squared muscle torques, Eq. (18), ...

    Summed up at the instants that the optimiser saw, as it did. Costs of one's own are functions
    that no file has: of these the number that is told is taken.
    """
    T, told = gait.step_time, gait.solution.get("cost")
    if told is None:
        return COST.noted(0.0, T, "no cost is told")
    try:
        own = float(gait.solution.get(OWN_COST, 0.0))
        apart = float(told) - own - costs(gait)
    except (TypeError, ValueError):
        return COST.found(np.inf, EQUAL, T, "it is no number")
    of_own = f"with {own:.6g} of one's own that the file tells and nobody can compute anew"
    value = float(np.nan_to_num(abs(apart) / max(abs(float(told)), 1.0), nan=np.inf))
    return COST.found(value, EQUAL, T, of_own if own else "")


def as_written(record: Record) -> Check:
    """No member of the file differs from its digest, nor the walk from the one that was found."""
    altered = [*(record.altered or ()), *(_FOUND if was_changed(record.gait) else ())]
    if record.altered is None and not altered:
        return SEAL.noted(0.0, 0.0, "the file has no digests and cannot tell")
    some = [*altered[:_SHOWN], "..."] if altered[_SHOWN:] else altered
    return SEAL.found(float(len(altered)), 0.0, 0.0, ", ".join(some))
