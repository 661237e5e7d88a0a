"""How deep limbs are in each other, smoothly, with exact first and second derivatives.

Limbs are the capsules of the drawn body (`figure.capsules`). Of each pair of parts the first one is
beads, balls along its axes; the capsules of the second one are whole. A bead of radius r around x
is in a capsule of radius R, whose axis has the point y nearest to x, by

    h = r + R - s,    s = sqrt(|x - y|^2 + eps^2),

and the pair is as deep in each other as the smooth maximum over all its beads and capsules says,

    depth = log(sum of exp(beta h)) / beta,

which is never less than the largest h, and more by log(n) / beta where n are equally deep. Two
segments would need no beads, but their distance has a kink where they are parallel, as an arm that
hangs beside a leg. That of a bead has none: its second derivatives are continuous but where y comes
to an end of the axis, and there they jump by 1 / s at most, far less than beta.

Seen from the link b of the capsule only the bead moves, on the joints i between b and its own link
a: with sigma_i = 1 on the path of a, -1 on that of b, 0 on both, x moves by sigma_i J_i,
J_i = l_i + w_i x x. With the slope f of a function of that place, its second derivatives Q, and
T J = l + w x x as a matrix of the spatial axis, second derivatives by q are

    sigma_i sigma_j S_i^T B S_j,    B = (T^T Q + [0; -[f]x]) T,

for i nearer to b than j, or the same; B is transposed where j is nearer.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.dh import frames, inverse, link_to_dh, paths
from human_gait.body.person import Body
from human_gait.body.skeleton import N_DOF
from human_gait.dynamics.inverse_dynamics import LINKS, symmetric
from human_gait.dynamics.spatial import cross, skew
from human_gait.walk.limb_shapes import LIMBS, PAIRS, Meetings, Rounds

_ROUNDED = 1e-3  # [m], eps: what keeps a bead on the very axis from being singular
_LEAST = 27.0  # of a sum parts below exp(-27) = 2e-12 do not count


@dataclass(frozen=True, eq=False)
class Depths:
    """How deep limbs are in others at K instants, and what second derivatives need besides.

    Of the beads in capsules only the n that count are here, by instant, limb and links; `limb`,
    `normal` and so on are of each of them.

    Attributes
    ----------
    value : (K, R) array, [m]
        Of each of ``LIMBS``: how much deeper than at rest.
    dq : (K, R, D) array
        In the DOF of `Limbs.dofs`.
    k, limb : (n,) int array
    weight : (n,) array
        Of the sum of its limb.
    x, normal, axis : (n, 3) array
        Centre of the bead, the way to it from y divided by s, and the direction of the capsule's
        axis, zero where y is at an end of it.
    s : (n,) array, [m]
    starts : (u,) int array
        Where the next pair of links begins.
    k_of, group_of : (u,) int array
        Its instant and which of the groups of `Meetings` it is.
    """

    value: FloatArray
    dq: FloatArray
    k: IntArray
    limb: IntArray
    weight: FloatArray
    x: FloatArray
    normal: FloatArray
    axis: FloatArray
    s: FloatArray
    starts: IntArray
    k_of: IntArray
    group_of: IntArray


class Limbs:
    """The limbs of one body.

    Parameters
    ----------
    body : Body
    softness : float, [m]
        1 / beta.
    sight : float, [m]
        Limbs that are further apart than this are taken for as far as this.

    Attributes
    ----------
    dofs : (D,) int array
        The DOF that move limbs against each other.
    columns : (R, c) int array
        Numbers in `dofs` of those that each of ``LIMBS`` depends on, and of others to make c.
    """

    def __init__(self, body: Body, softness: float, sight: float) -> None:
        self._beta, self._far = 1.0 / softness, -sight
        self._all = found = Meetings.of(body)
        moves = np.zeros((N_DOF, N_DOF))
        for link, path in enumerate(paths(body.table)):
            moves[link, path] = 1.0
        first, second = (moves[found.groups[:, i]] for i in (1, 2))
        self.dofs = np.flatnonzero((first != second).any(axis=0))
        self._first, self._second = first[:, self.dofs], second[:, self.dofs]
        self._between = self._first - self._second  # sigma
        begin = np.searchsorted(found.groups[:, 0], np.arange(len(LIMBS)))
        depends = np.maximum.reduceat(np.abs(self._between), begin)
        most = int(depends.sum(axis=1).max())
        self.columns = np.sort(np.argsort(-depends, axis=1, kind="stable")[:, :most], axis=1)
        reach = found.beads.radius[found.bead] + found.capsules.radius[found.capsule]
        s, _ = self._distances(*self._placed(_poses_at_rest(body)))
        at_rest = np.zeros(len(PAIRS))
        np.maximum.at(at_rest, found.pair, reach - s[0])
        self._reach = reach - at_rest[found.pair]

    def depths(self, poses: FloatArray, axes: FloatArray) -> Depths:
        """Return how much deeper than at rest limbs are in others, with partials.

        Parameters
        ----------
        poses : (K, 23, 4, 4) array
            Of ``LINKS``.
        axes : (K, 6, 55) array
            Spatial joint axes about the world's origin.
        """
        every, S = self._all, axes[:, :, self.dofs]
        beads, start, along = self._placed(poses)
        s, share = self._distances(beads, start, along)
        h = self._reach - s
        k, meeting = np.nonzero(h > self._far - _LEAST / self._beta)
        value, weight = self._maximum(k, every.limb[meeting], h[k, meeting], len(poses))
        counts = weight > np.exp(-_LEAST)
        k, meeting, weight = k[counts], meeting[counts], weight[counts]
        capsule, limb, group = every.capsule[meeting], every.limb[meeting], every.group[meeting]
        x, v, s, t = beads[k, every.bead[meeting]], along[k, capsule], s[k, meeting], share[k, meeting]
        normal = (x - start[k, capsule] - t[:, None] * v) / s[:, None]
        inside = (t > 0.0) & (t < 1.0)
        axis = v * (inside / np.linalg.norm(v, axis=1))[:, None]
        starts = np.flatnonzero(np.diff(k * len(every.groups) + group, prepend=-1))
        k_of, group_of = k[starts], group[starts]
        wrench = -weight[:, None] * np.concatenate([normal, cross(x, normal)], axis=1)
        by_links = np.add.reduceat(wrench, starts)[:, None] @ S[k_of]
        dq = np.zeros((*value.shape, len(self.dofs)))
        np.add.at(dq, (k_of, limb[starts]), by_links[:, 0] * self._between[group_of])
        return Depths(value, dq, k, limb, weight, x, normal, axis, s, starts, k_of, group_of)

    def hessian(self, found: Depths, axes: FloatArray, multipliers: FloatArray) -> FloatArray:
        """Return second derivatives of depths times multipliers (K, R), in `dofs`, (K, D, D).

        Besides those of the h they have beta (sum of w g g^T - m m^T), g being the slopes of the h
        and m their sum, that of the depth: the first part of it is in Q.
        """
        S = axes[:, :, self.dofs]
        by_place = self._by_place(found, found.weight * multipliers[found.k, found.limb])
        B = np.add.reduceat(by_place, found.starts).reshape(-1, 6, 6)
        here = S[found.k_of]
        turned = (B @ here) * self._first[found.group_of, None]
        turned -= (B.swapaxes(1, 2) @ here) * self._second[found.group_of, None]
        here *= self._between[found.group_of, None]
        ends = np.searchsorted(found.k_of, np.arange(len(S) + 1))
        upper = np.stack([
            here[i:j].reshape(-1, len(self.dofs)).T @ turned[i:j].reshape(-1, len(self.dofs))
            for i, j in pairwise(ends)
        ])
        mean = (self._beta * multipliers[..., None] * found.dq).swapaxes(1, 2) @ found.dq
        return symmetric(upper) - mean

    def _maximum(
        self, k: IntArray, limb: IntArray, h: FloatArray, K: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return the smooth maximum (K, R) of each limb, and what each h is of the sum, (n,)."""
        shape = K, len(LIMBS)
        place = k * shape[1] + limb
        top = np.full(K * shape[1], self._far)
        np.maximum.at(top, place, h)
        parts = np.exp(self._beta * (h - top[place]))
        sums = np.bincount(place, parts, len(top)) + np.exp(self._beta * (self._far - top))
        return (top + np.log(sums) / self._beta).reshape(shape), parts / sums[place]

    def _by_place(self, found: Depths, m: FloatArray) -> FloatArray:
        """Return B (n, 36) of each bead in a capsule, m (n,) being its multiplier."""
        n, a, x = found.normal, found.axis, found.x
        Q = (self._beta + 1.0 / found.s)[:, None, None] * n[:, :, None] * n[:, None]
        Q -= (np.eye(3) - a[:, :, None] * a[:, None]) / found.s[:, None, None]
        Q *= m[:, None, None]
        turned = cross(x[:, None], Q).swapaxes(1, 2) + skew(m[:, None] * n)  # [x] Q - [f], f = -m n
        left = np.concatenate([Q, turned], axis=1)
        return np.concatenate([left, cross(x[:, None], left)], axis=2).reshape(len(m), 36)

    def _placed(self, poses: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return beads, and starts and ways along the axes of capsules in the world (K, n, 3)."""
        beads, _ = _in_world(self._all.beads, poses)
        return beads, *_in_world(self._all.capsules, poses)

    def _distances(
        self, x: FloatArray, p: FloatArray, v: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return s and where y is between the ends of the axis, 0 to 1, (K, N).

        With r = x - p the nearest point is at t = r.v / v.v, |x - y|^2 = r.r - t (2 r.v - t v.v).
        """
        bead, capsule = self._all.bead, self._all.capsule
        from_p, from_v = (x @ to.swapaxes(1, 2) for to in (p, v))
        xx, pp, vv, pv = (np.einsum("kni,kni->kn", *two) for two in ((x, x), (p, p), (v, v), (p, v)))
        rr = (xx[:, :, None] + pp[:, None] - 2.0 * from_p)[:, bead, capsule]
        rv, vv = (from_v - pv[:, None])[:, bead, capsule], vv[:, capsule]
        t = np.clip(rv / vv, 0.0, 1.0)
        squared = rr - t * (2.0 * rv - t * vv)
        return np.sqrt(np.maximum(squared, 0.0) + _ROUNDED**2), t

def _poses_at_rest(body: Body) -> FloatArray:
    """Return the poses (1, 23, 4, 4) of ``LINKS`` at q = 0: upright, with hanging arms."""
    _, A = frames(body.table, np.zeros((1, N_DOF)))
    return np.asarray((A @ inverse(link_to_dh(body.table)))[:, LINKS])


def _in_world(rounds: Rounds, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return starts and ways along the axes (K, n, 3)."""
    pose = poses[:, np.searchsorted(LINKS, rounds.link)]
    turn, origin = pose[..., :3, :3], pose[..., :3, 3]
    start, along = (np.einsum("knij,nj->kni", turn, part) for part in (rounds.start, rounds.along))
    return origin + start, along
