"""Joint angles of our body from markers: inverse kinematics of all frames at once.

At each frame the posture q minimises

    sum_m w_m |p_m(q) - x_m|^2 / s^2  +  sum_i (q_i - r_i)^2 / d_i^2,     lower <= q <= upper,

p_m where marker m is on the body and x_m where it was seen. The second sum is what is known of
postures before anything was seen: how far joints are from rest in walking. It only matters where
markers tell little. s, what markers are off by, is not known before: it is found from what is left
in the first sum, so that markers that fit well are followed closely.

Levenberg and Marquardt's method with exact derivatives: the point of a body moves with a joint k
above it by z_k x (p - o_k), or by z_k where the joint slides.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from human_gait.arrays import BoolArray, FloatArray, IntArray
from human_gait.body.dh import frames
from human_gait.body.joints import segment_frames
from human_gait.body.limits import position_limits
from human_gait.body.links import anatomical_to_link
from human_gait.body.person import Body
from human_gait.body.skeleton import DOF_NAMES, N_DOF, PARENT, PRISMATIC, SEGMENTS
from human_gait.export.markers import Marker, marker_set
from human_gait.trials.marker_names import Site
from human_gait.values import Value

Tell = Callable[[int, int], None]
"""Is told how many frames are done, and of how many."""

TOLD = 0.5
"""Of a joint, what markers tell: less is nothing."""

_SOME = 12  # frames that tell what markers are off by
_CHUNK = 100  # frames at once: 2 MB each
_MOST = 40  # iterations
_DONE = 1e-7  # [rad], [m]: a step that is none
_FIRST, _LEAST = 0.010, 1e-5  # [m], what markers are off by: at first, and at least
_ROUNDS = 3  # of finding out what they are off by
_REST = {"elbow": 0.35}  # [rad], where it is not 0
_SPREAD = {  # [rad], about rest, of a walk: assumed
    "pelvis": 100.0,  # it may be anywhere
    **dict.fromkeys(("hip", "shoulder", "elbow", "forearm"), 0.4),
    **dict.fromkeys(("ankle", "toe"), 0.3),
    "knee": 0.6,
    "spine": 0.08,
    "neck": 0.15,
    "clavicle": 0.1,
    "wrist": 0.2,
}


@dataclass(frozen=True, eq=False, repr=False)
class Seen(Value):
    """Markers as they were seen, and where they are on the body.

    Attributes
    ----------
    sites : tuple of Site, M of them
    places : (K, M, 3) array, [m]
        In the world; NaN where a marker was not seen.
    """

    sites: tuple[Site, ...]
    places: FloatArray

    def at(self, k: slice | IntArray) -> Seen:
        """Return some of the frames."""
        return Seen(self.sites, self.places[k])

    @property
    def weights(self) -> FloatArray:
        """(K, M) how much each counts: 0 where it was not seen."""
        known = np.isfinite(self.places).all(axis=-1)
        return np.asarray(known * np.array([site.weight for site in self.sites]))


@dataclass(frozen=True, eq=False, repr=False)
class Postures(Value):
    """What inverse kinematics found.

    Attributes
    ----------
    q : (K, 55) array, [rad] and [m]
    off : (K, M) array, [m]
        How far each marker is from where it is on the body; NaN where it was not seen.
    sigma : float, [m]
        What markers are off by along an axis, weighted.
    told : (55,) array
        How much of each joint the markers tell, from 0, where it is at rest for want of any, to 1.
    lost : (K, 55) bool array
        Whether the markers of a frame tell nothing of a joint that is told otherwise.
    """

    q: FloatArray
    off: FloatArray
    sigma: float
    told: FloatArray
    lost: BoolArray


class MarkedBody:
    """Where the sites of markers on a body are in the world, and how they move with its joints."""

    def __init__(self, body: Body, sites: Sequence[Site]) -> None:
        self._table = body.table
        self._links, self._local, self._of = _attached(body, sites)
        self._moves = _above(self._links)

    def places(self, q: FloatArray) -> FloatArray:
        """Return where the sites are (K, M, 3), [m], at postures (K, 55)."""
        return np.asarray(self._of @ self._points(frames(self._table, q)[1]))

    def linearised(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the same and its derivatives by q, (K, M, 3, 55)."""
        P, A = frames(self._table, q)
        points = self._points(A)
        axes, origins = P[..., :3, 2], P[..., :3, 3]
        arm = points[:, :, None] - origins[:, None]
        by_q = np.where(PRISMATIC[:, None], axes[:, None], np.cross(axes[:, None], arm))
        by_q *= self._moves[..., None]
        K, n = points.shape[:2]
        of_sites = (self._of @ by_q.reshape(K, n, -1)).reshape(K, -1, N_DOF, 3)
        return np.asarray(self._of @ points), of_sites.swapaxes(2, 3)

    def _points(self, A: FloatArray) -> FloatArray:
        on = A[:, self._links]
        return np.asarray((on[..., :3, :3] @ self._local[..., None])[..., 0] + on[..., :3, 3])


def postures(
    body: Body, seen: Seen, start: FloatArray | None = None, tell: Tell = lambda *_: None
) -> Postures:
    """Return the postures of a body that markers show.

    Parameters
    ----------
    body : Body
    seen : Seen
        Facing forward, z.
    start : (55,) array, optional
        A posture to start from.
    tell : function, optional
        Is told how many frames are done, and of how many.
    """
    marked, sigma = MarkedBody(body, seen.sites), _FIRST
    some = seen.at(np.unique(np.linspace(0, len(seen.places) - 1, _SOME).astype(int)))
    q = _begun(marked, some, start)
    for _ in range(_ROUNDS):
        q = _solved(marked, some, q, sigma)
        sigma = _spread(marked, some, q)
    found = (
        q if len(q) == len(seen.places) else _all(marked, seen, np.median(q, axis=0), sigma, tell)
    )
    off = np.linalg.norm(marked.places(found) - seen.places, axis=-1)
    told = np.median(_Problem.of(marked, some, sigma).told(q), axis=0)
    return Postures(found, off, sigma, told, _lost(marked, seen, found, sigma, told))


def _lost(
    marked: MarkedBody, seen: Seen, q: FloatArray, sigma: float, told: FloatArray
) -> BoolArray:
    """Return (K, 55) whether a frame tells nothing of a joint that is told otherwise.

    Only frames that miss a marker which most of them have are asked.
    """
    lost = np.zeros(q.shape, dtype=bool)
    usual = np.median(seen.weights, axis=0)
    some = np.flatnonzero((seen.weights < usual).any(axis=1))
    for first in range(0, len(some), _CHUNK):
        k = some[first : first + _CHUNK]
        here = _Problem.of(marked, seen.at(k), sigma).told(q[k])
        lost[k] = (told >= TOLD) & (here < TOLD / 2.0)
    return lost


def _all(marked: MarkedBody, seen: Seen, start: FloatArray, sigma: float, tell: Tell) -> FloatArray:
    """Return the postures of all frames (K, 55), some at a time, from one to start from."""
    found = np.empty((len(seen.places), N_DOF))
    for k in range(0, len(found), _CHUNK):
        part = seen.at(slice(k, k + _CHUNK))
        found[k : k + _CHUNK] = _solved(marked, part, _begun(marked, part, start), sigma)
        tell(min(k + _CHUNK, len(found)), len(found))
    return found


def placed_at(body: Body, q: FloatArray, segment: str, places: FloatArray) -> Marker:
    """Return a marker on a segment where it was seen on average.

    Parameters
    ----------
    body : Body
    q : (K, 55) array
        Postures.
    segment : str
    places : (K, 3) array, [m]
        In the world; NaN where it was not seen.
    """
    on = segment_frames(body, q)[:, list(SEGMENTS).index(segment)]
    local = on[:, :3, :3].swapaxes(1, 2) @ (places - on[:, :3, 3])[..., None]
    return Marker(segment, segment, np.nanmean(local[..., 0], axis=0))


def prior() -> tuple[FloatArray, FloatArray]:
    """Return the posture of rest and how far joints are from it in walking, each (55,), [rad]."""
    parts = [next(part for part in _SPREAD if name.startswith(part)) for name in DOF_NAMES]
    rest = np.array(
        [
            _REST.get(part, 0.0) if "flexion" in name else 0.0
            for part, name in zip(parts, DOF_NAMES, strict=True)
        ]
    )
    return rest, np.array([_SPREAD[part] for part in parts])


def _begun(marked: MarkedBody, seen: Seen, start: FloatArray | None) -> FloatArray:
    """Return a posture, moved to where the markers are, (K, 55)."""
    q = np.tile(prior()[0] if start is None else start, (len(seen.places), 1))
    apart = np.nan_to_num(seen.places - marked.places(q))
    w = seen.weights
    shift = (w[..., None] * apart).sum(axis=1) / np.maximum(w.sum(axis=1), 1e-9)[:, None]
    for axis, name in enumerate("xyz"):
        q[:, DOF_NAMES.index(f"pelvis_t{name}")] += shift[:, axis]
    return q


def _solved(marked: MarkedBody, seen: Seen, q: FloatArray, sigma: float) -> FloatArray:
    """Return the postures (K, 55) by Levenberg and Marquardt's method, each frame on its own."""
    problem = _Problem.of(marked, seen, sigma)
    q = np.clip(q, *problem.limits)
    cost, damping = problem.cost(q), np.full(len(q), 1e-3)
    left = np.arange(len(q))
    for _ in range(_MOST):
        part = problem.at(left)
        step = part.step(q[left], damping[left])
        tried = np.clip(q[left] + step, *problem.limits)
        moved, new = np.abs(tried - q[left]).max(axis=1), part.cost(tried)
        better = new <= cost[left]
        taken = left[better]
        q[taken], cost[taken] = tried[better], new[better]
        damping[left] = np.clip(damping[left] * np.where(better, 0.1, 10.0), 1e-9, 1e9)
        left = left[moved > _DONE]
        if not len(left):
            break
    return q


@dataclass(frozen=True, eq=False)
class _Problem:
    """The sum of squares at K frames."""

    marked: MarkedBody
    places: FloatArray
    weights: FloatArray
    limits: tuple[FloatArray, FloatArray]
    rest: FloatArray
    precision: FloatArray

    @classmethod
    def of(cls, marked: MarkedBody, seen: Seen, sigma: float) -> _Problem:
        rest, spread = prior()
        weights = np.repeat(seen.weights[..., None], 3, axis=-1) / sigma**2
        places = np.nan_to_num(seen.places)
        return cls(marked, places, weights, _limits(), rest, spread**-2)

    def at(self, k: IntArray) -> _Problem:
        """Return the problem at some of the frames."""
        some = self.places[k], self.weights[k]
        return _Problem(self.marked, *some, self.limits, self.rest, self.precision)

    def cost(self, q: FloatArray) -> FloatArray:
        """Return the sum of squares of each frame (K,)."""
        off = self.marked.places(q) - self.places
        near = (q - self.rest) ** 2 @ self.precision
        return np.asarray((self.weights * off**2).sum(axis=(1, 2)) + near)

    def step(self, q: FloatArray, damping: FloatArray) -> FloatArray:
        """Return the step (K, 55) of each frame, 0 for joints that are held by their limits."""
        K = len(q)
        places, J = self.marked.linearised(q)
        J, w = J.reshape(K, -1, N_DOF), self.weights.reshape(K, -1, 1)
        off = (places - self.places).reshape(K, -1, 1)
        weighted = (w * J).swapaxes(1, 2)
        gradient = (weighted @ off)[..., 0] + self.precision * (q - self.rest)
        H = weighted @ J + np.diag(self.precision)
        held = self._held(q, gradient)
        H = np.where(held[:, :, None] | held[:, None], 0.0, H)
        diagonal = np.arange(N_DOF)
        H[:, diagonal, diagonal] += damping[:, None] * H[:, diagonal, diagonal] + held
        gradient = np.where(held, 0.0, gradient)
        return np.asarray(-np.linalg.solve(H, gradient[..., None])[..., 0])

    def told(self, q: FloatArray) -> FloatArray:
        """Return how much of each joint is told (K, 55): 1 - posterior by prior variance."""
        J = self.marked.linearised(q)[1].reshape(len(q), -1, N_DOF)
        H = (self.weights.reshape(len(q), -1, 1) * J).swapaxes(1, 2) @ J + np.diag(self.precision)
        variance = np.diagonal(np.linalg.inv(H), axis1=1, axis2=2)
        return np.asarray(1.0 - variance * self.precision)

    def _held(self, q: FloatArray, gradient: FloatArray) -> BoolArray:
        lower, upper = self.limits
        return np.asarray(((q <= lower) & (gradient > 0)) | ((q >= upper) & (gradient < 0)))


def _spread(marked: MarkedBody, seen: Seen, q: FloatArray) -> float:
    """Return what markers are off by along an axis, [m], by the root mean square of what is left.

    Of n numbers that are seen 55 at most are taken up by the posture.
    """
    off, w = marked.places(q) - np.nan_to_num(seen.places), seen.weights
    squares = (w[..., None] * off**2).sum()
    free = max(3 * w.sum() - len(q) * N_DOF / 2, 0.25 * 3 * w.sum(), 1.0)
    return float(max(np.sqrt(squares / free), _LEAST))


def _limits() -> tuple[FloatArray, FloatArray]:
    """Return how far joints turn, without limits of the six global DOF, each (55,)."""
    lower, upper = position_limits()
    lower[:6], upper[:6] = -np.inf, np.inf
    return lower, upper


def _attached(body: Body, sites: Sequence[Site]) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return the links of points (n,), their places in the DH frames (n, 3), and means (M, n).

    A site is one point or the mean of several.
    """
    known = {marker.name: marker for marker in marker_set(body)}
    points = [(marker, m) for m, site in enumerate(sites) for marker in site.among(known)]
    links = np.array([SEGMENTS[marker.segment] for marker, _ in points])
    to_link = anatomical_to_link(body.table)[links]
    local = np.array([marker.position for marker, _ in points])
    # anatomical axes stand in the link's frame as A U: back to them by U
    placed = (to_link[:, :3, :3] @ local[..., None])[..., 0] + to_link[:, :3, 3]
    of = np.zeros((len(sites), len(points)))
    for n, (_, m) in enumerate(points):
        of[m, n] = 1.0
    return links, placed, of / of.sum(axis=1, keepdims=True)


def _above(links: IntArray) -> BoolArray:
    """Return (n, 55) whether a joint moves a link."""
    found = np.zeros((len(links), N_DOF), dtype=bool)
    for n, link in enumerate(links):
        joint = int(link)
        while joint >= 0:
            found[n, joint] = True
            joint = int(PARENT[joint])
    return found
