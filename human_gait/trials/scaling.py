"""How long the segments of a person are, from markers.

Lengths p and the postures q_k of some frames minimise together

    sum_k sum_m w_m |p_m(q_k, p) - x_km|^2 / s^2  +  sum_j (p_j - f_j S)^2 / (d f_j S)^2,

S the stature, f_j S the length of a person of usual proportions and d how far people are from it.
What markers tell little of stays usual; where there are few of them that is all but the stature.
Postures and lengths are improved in turn; a step of the lengths counts with the postures that
follow it (variable projection).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.person import make_body
from human_gait.exceptions import ScenarioError
from human_gait.scenario import Load, Subject
from human_gait.scenario.lengths import LENGTHS, usual_lengths
from human_gait.trials.inverse_kinematics import MarkedBody, Seen, postures, prior

_FRAMES = 10
_ROUNDS = 8
_STEP = 1e-4  # of a length, for differences
_STATURE = 0.05  # how far people are from the stature that is begun with, of it
_PEOPLE = 0.04  # how far lengths are from those that are usual at a stature, of them: ANSUR II
_DIGITS = 5  # of a length in metres
_ENOUGH = 1e-4  # [m]: a change of lengths that is none


def scaled(subject: Subject, load: Load, seen: Seen, *, stature_known: bool) -> Subject:
    """Return a person of the lengths that markers show.

    Parameters
    ----------
    subject : Subject
        Sex, mass, and the stature to begin with.
    load : Load
    seen : Seen
        Of a person who stands or walks, facing z.
    stature_known : bool
        Whether the stature is the person's; else it is found.
    """
    some = seen.at(np.unique(np.linspace(0, len(seen.places) - 1, _FRAMES).astype(int)))
    names = [*([] if stature_known else ["stature"]), *LENGTHS]
    first, q = subject.stature, None
    for _ in range(_ROUNDS):
        found = postures(make_body(subject, load), some, q)
        q = np.median(found.q, axis=0)
        change = _change(subject, load, names, some, found.q, found.sigma, first)
        subject = _changed(subject, names, change)
        if np.abs(change).max() < _ENOUGH:
            break
    return replace(subject, **{name: round(getattr(subject, name), _DIGITS) for name in names})


def _change(
    subject: Subject,
    load: Load,
    names: list[str],
    seen: Seen,
    q: FloatArray,
    sigma: float,
    first: float,
) -> FloatArray:
    """Return by how much lengths change, (n,), [m], the postures changing with them."""
    places, J = MarkedBody(make_body(subject, load), seen.sites).linearised(q)
    K = len(q)
    w = np.repeat(seen.weights[..., None], 3, axis=-1).reshape(K, -1) / sigma**2
    J, off = J.reshape(K, -1, J.shape[-1]), (places - np.nan_to_num(seen.places)).reshape(K, -1)
    M = np.stack([_slope(subject, load, name, seen, q).reshape(K, -1) for name in names], axis=-1)
    H = (w[..., None] * J).swapaxes(1, 2) @ J + np.diag(prior()[1] ** -2.0)
    follow = np.linalg.solve(H, (w[..., None] * J).swapaxes(1, 2) @ M)  # of q to p, but for sign
    left = M - J @ follow
    G, apart = _proportions(subject, names, first)
    A = np.einsum("kri,kr,krj->ij", left, w, left) + G.T @ G
    b = np.einsum("kri,kr,kr->i", left, w, off) + G.T @ apart
    return np.asarray(-np.linalg.solve(A, b))


def _proportions(subject: Subject, names: list[str], first: float) -> tuple[FloatArray, FloatArray]:
    """Return how far lengths are from usual ones (n,), in parts of what people are, and by what.

    The derivatives (n, n) are by the lengths: usual ones grow with the stature.
    """
    usual = usual_lengths(subject.sex, subject.stature)
    G, apart = np.zeros((len(names), len(names))), np.zeros(len(names))
    for j, name in enumerate(names):
        if name == "stature":
            spread = _STATURE * first
            G[j, j], apart[j] = 1.0 / spread, (subject.stature - first) / spread
            continue
        spread = _PEOPLE * usual[name]
        G[j, j], apart[j] = 1.0 / spread, (getattr(subject, name) - usual[name]) / spread
        if "stature" in names:
            G[j, names.index("stature")] = -usual[name] / subject.stature / spread
    return G, apart


def _slope(subject: Subject, load: Load, name: str, seen: Seen, q: FloatArray) -> FloatArray:
    """Return the derivative of the places (K, M, 3) by a length."""
    length = getattr(subject, name)
    ends = []
    for share in (1.0 + _STEP, 1.0 - _STEP):
        body = make_body(replace(subject, **{name: length * share}), load)
        ends.append(MarkedBody(body, seen.sites).places(q))
    return np.asarray((ends[0] - ends[1]) / (2.0 * _STEP * length))


def _changed(subject: Subject, names: list[str], change: FloatArray) -> Subject:
    """Return a person with other lengths; half the change where it is no person's."""
    for share in (1.0, 0.5, 0.25, 0.125):
        new: dict[str, Any] = {
            name: float(getattr(subject, name) + share * more)
            for name, more in zip(names, change, strict=True)
        }
        try:
            return replace(subject, **new)
        except ScenarioError:
            continue
    return subject
