"""Walks that move in the page: which ones, and where their joints are.

A figure is its joint centres and points of the feet at even instants of one step; the next step is
its mirror image, which the page makes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import stats

from human_gait.arrays import FloatArray, IntArray
from human_gait.body import dh
from human_gait.body.links import CONTACT_POINTS, anatomical_to_link
from human_gait.body.person import make_body
from human_gait.body.skeleton import SEGMENTS, index
from human_gait.exceptions import GaitError
from human_gait.findings.packing import encoded
from human_gait.findings.rows import Rows

if TYPE_CHECKING:
    from human_gait.body.person import Body
    from human_gait.studies.opened import Study
    from human_gait.walk.gait import Gait

MOST = 400
"""Walks that are in the page to be moved."""

FRAMES = 12
"""Instants of a step: twice as many of a stride."""

_QUANTUM = 1e-4  # [m]
_POOL = 20_000  # rows that walks are chosen among
_MIDDLE = ("pelvis_ry", "spine3_flexion", "neck_lower_flexion", "neck_upper_flexion")
_LIMBS = (
    *("shoulder_abduction", "elbow_flexion", "wrist_flexion", "tip:wrist_radial_deviation"),
    *("hip_abduction", "knee_flexion", "ankle_dorsiflexion"),
)
_FEET = ("heel", "ball", "toe")
POINTS: tuple[str, ...] = (
    *("pelvis", "chest", "neck", "head", "crown", "load_low", "load_high"),
    *(
        f"{name}_{side}"
        for side in "rl"
        for name in ("shoulder", "elbow", "wrist", "hand", "hip", "knee", "ankle", *_FEET)
    ),
)
"""Names of the points of a figure, in their order."""


def chosen(rows: Rows, ahead: Sequence[str]) -> IntArray:
    """Return the rows of walks to show, in order: extremes of outputs, and walks far apart.

    Parameters
    ----------
    rows : Rows
    ahead : sequence of str
        Outputs whose least and greatest are to be among them.

    Notes
    -----
    The distance is that of the ranks in all settings, so that the walks cover every map of two of
    them; each next one is the farthest from all before (Gonzalez, 1985).
    """
    there = np.flatnonzero(rows.found)
    if len(there) <= MOST:
        return there
    ends = [
        int(there[end(values)])
        for values in (rows.column(name).values[there] for name in ahead)
        if not np.isnan(values).all()
        for end in (np.nanargmin, np.nanargmax)
    ]
    pool = np.random.default_rng(0).permutation(there)[:_POOL]
    pool = np.unique(np.concatenate([ends, pool]).astype(np.intp))
    place = np.stack([_ranks(one.values[pool]) for one in rows.settings], axis=1)
    return np.sort(pool[_far_apart(place, np.searchsorted(pool, ends[:MOST]))])


def _ranks(values: FloatArray) -> Any:
    """Return ranks of values from 0 to 1, as floats of 4 bytes."""
    ranks = stats.rankdata(values, "dense").astype(np.float32)
    return (ranks - 1) / max(float(ranks.max()) - 1, 1.0)


def _far_apart(place: Any, first: IntArray) -> list[int]:
    """Return MOST rows of places (m, d), far from each other, the first given."""
    found = list(dict.fromkeys(map(int, first))) or [0]
    nearest = np.full(len(place), np.inf, np.float32)
    for k in found:
        nearest = np.minimum(nearest, np.sum((place - place[k]) ** 2, axis=1))
    while len(found) < MOST:
        found.append(int(np.argmax(nearest)))
        if not nearest[found[-1]] > 0:  # all places are taken: any walk that is left
            left = np.setdiff1d(np.arange(len(place)), found[:-1])
            return [*found[:-1], *left[: MOST - len(found) + 1].tolist()]
        nearest = np.minimum(nearest, np.sum((place - place[found[-1]]) ** 2, axis=1))
    return found


def figure(gait: Gait) -> FloatArray:
    """Return the points of a walk at even instants of its step, (FRAMES, points, 3), [m].

    World axes: x to the left, y up, z forward.
    """
    body = make_body(gait.scenario.subject, gait.scenario.load)
    q = gait.basis.matrix(np.arange(FRAMES) * gait.step_time / FRAMES, 0) @ gait.control_points
    P, A = dh.frames(body.table, q)

    def centre(name: str) -> FloatArray:
        joint = name.removeprefix("tip:")
        return np.asarray((P if joint == name else A)[:, index(joint), :3, 3])

    points = [*map(centre, _MIDDLE), centre("tip:neck_upper_rotation"), *_load(body, A)]
    for foot, side in enumerate("rl"):
        points += [centre(f"{name}_{side}") for name in _LIMBS]
        points += _foot(body, A, foot)
    return np.stack(points, axis=1)


def _foot(body: Body, A: FloatArray, foot: int) -> list[FloatArray]:
    """Return heel, middle of the ball and toe of a foot, each (K, 3)."""
    frames, points = A[:, body.contact.links[foot]], body.contact.points[foot]
    world = np.einsum("knij,nj->kni", frames[..., :3, :3], points) + frames[..., :3, 3]
    at = {name: world[:, k] for k, name in enumerate(CONTACT_POINTS)}
    return [at["heel"], (at["ball_medial"] + at["ball_lateral"]) / 2, at["toe"]]


def _load(body: Body, A: FloatArray) -> list[FloatArray]:
    """Return the ends of the upright through the middle of the load, each (K, 3)."""
    thorax, (x, y, z), half = SEGMENTS["thorax"], body.load.position, body.load.size[1] / 2
    if not body.load.mass:
        return [A[:, thorax, :3, 3]] * 2
    frame = A[:, thorax] @ anatomical_to_link(body.table)[thorax]
    return [(frame @ [x, y + end, z, 1.0])[:, :3] for end in (-half, half)]


def walker_data(study: Study, rows: Rows, wanted: IntArray) -> dict[str, Any]:
    """Return figures of walks for the page, and which rows have none."""
    there, figures, about, missing = [], [], [], 0
    for row in wanted:
        try:
            gait = study.gait(rows.keys[row])
        except (GaitError, OSError):
            missing += 1
            continue
        there.append(int(row))
        figures.append(figure(gait))
        about.append(_about(gait, rows.persons[row]))
    points = np.array(figures or np.zeros((0, FRAMES, len(POINTS), 3)))
    return {
        "rows": there,
        "missing": missing,
        "points": POINTS,
        "frames": FRAMES,
        "quantum": _QUANTUM,
        "places": encoded(np.clip(np.rint(points / _QUANTUM), -32767, 32767), "<i2"),
        "walks": about,
    }


def _about(gait: Gait, number: float) -> dict[str, Any]:
    """Return what the page says and needs of a walk beside its points; lengths in [m]."""
    scenario = gait.scenario
    person, load, walk = scenario.subject, scenario.load, scenario.walk
    who = "" if np.isnan(number) else f"Person {number:.0f}: "
    carried = f", load {load.mass:.3g} kg" if load.mass else ""
    return {
        "step_time": round(gait.step_time, 5),
        "step_length": round(gait.step_length, 5),
        "stature": round(person.stature, 4),
        "load_depth": round(load.size[2], 3) if load.mass else 0.0,
        "person": f"{who}{person.sex}, {person.stature:.4g} m, {person.mass:.4g} kg{carried}; "
        f"{walk.speed:.4g} m/s, step {walk.step_length:.4g} m",
    }
