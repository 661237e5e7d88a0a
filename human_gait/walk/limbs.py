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

import numpy as np
from scipy.sparse import csr_array

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.dh import frames, inverse, link_to_dh, paths
from human_gait.body.person import Body
from human_gait.body.skeleton import N_DOF
from human_gait.dynamics.inverse_dynamics import LINKS, symmetric
from human_gait.dynamics.spatial import cross, skew
from human_gait.walk.limb_shapes import PAIRS, Meetings, Rounds

_ROUNDED = 1e-3  # [m], eps: what keeps a bead on the very axis from being singular
_NEGLIGIBLE = 1e-12  # part of a sum that does not count


@dataclass(frozen=True, eq=False)
class Depths:
    """How deep pairs are in each other at K instants, and what second derivatives need besides.

    Attributes
    ----------
    value : (K, P) array, [m]
        Of each of ``PAIRS``: positive in each other, negative apart.
    dq : (K, P, D) array
        In the DOF of `Limbs.dofs`.
    k, meeting : (n,) int array
        Instants and numbers of the beads in capsules that count.
    weight : (n,) array
        What each is of its pair's sum.
    x, normal, axis : (n, 3) array
        Centre of the bead, the way to it from y divided by s, and the direction of the capsule's
        axis, zero where y is at an end of it.
    s : (n,) array, [m]
    together : (K * G, n) sparse array
        Sums up what is of one instant and one group of `Meetings`.
    """

    value: FloatArray
    dq: FloatArray
    k: IntArray
    meeting: IntArray
    weight: FloatArray
    x: FloatArray
    normal: FloatArray
    axis: FloatArray
    s: FloatArray
    together: csr_array


class Limbs:
    """The limbs of one body.

    Parameters
    ----------
    body : Body
    softness : float, [m]
        1 / beta.

    Attributes
    ----------
    at_rest : (P,) array, [m]
        How deep the deepest bead of each of ``PAIRS`` is at q = 0, upright with hanging arms.
    dofs : (D,) int array
        The DOF that move limbs against each other.
    columns : (P, c) int array
        Numbers in `dofs` of those that each pair depends on, and of others to make c of them.
    """

    def __init__(self, body: Body, softness: float) -> None:
        self._beta = 1.0 / softness
        self._all = found = Meetings.of(body)
        self._reach = found.beads.radius[found.bead] + found.capsules.radius[found.capsule]
        pairs = np.arange(len(PAIRS))
        self._starts = np.searchsorted(found.pair, pairs)
        self._group_starts = np.searchsorted(found.groups[:, 0], pairs)
        moves = np.zeros((N_DOF, N_DOF))
        for link, path in enumerate(paths(body.table)):
            moves[link, path] = 1.0
        first, second = (moves[found.groups[:, i]] for i in (1, 2))
        self.dofs = np.flatnonzero((first != second).any(axis=0))
        self._first, self._second = first[:, self.dofs], second[:, self.dofs]
        self._between = self._first - self._second  # sigma
        counts = np.maximum.reduceat(np.abs(self._between), self._group_starts)
        most = int(counts.sum(axis=1).max())
        self.columns = np.sort(np.argsort(-counts, axis=1, kind="stable")[:, :most], axis=1)
        _, A = frames(body.table, np.zeros((1, N_DOF)))
        s, _ = self._distances(*self._placed((A @ inverse(link_to_dh(body.table)))[:, LINKS]))
        self.at_rest = np.maximum.reduceat(self._reach - s, self._starts, axis=1)[0]

    def depths(self, poses: FloatArray, axes: FloatArray) -> Depths:
        """Return how deep limbs are in each other, with partials.

        Parameters
        ----------
        poses : (K, 23, 4, 4) array
            Of ``LINKS``.
        axes : (K, 6, 55) array
            Spatial joint axes about the world's origin.
        """
        beads, start, along = self._placed(poses)
        s, share = self._distances(beads, start, along)
        h, every = self._reach - s, self._all
        top = np.maximum.reduceat(h, self._starts, axis=1)
        parts = np.exp(self._beta * (h - top[:, every.pair]))
        sums = np.add.reduceat(parts, self._starts, axis=1)
        parts /= sums[:, every.pair]
        k, meeting = np.nonzero(parts > _NEGLIGIBLE)
        weight, x, s, t = parts[k, meeting], beads[k, every.bead[meeting]], s[k, meeting], share[k, meeting]
        capsule = every.capsule[meeting]
        v = along[k, capsule]
        normal = (x - start[k, capsule] - t[:, None] * v) / s[:, None]
        inside = (t > 0.0) & (t < 1.0)
        axis = v * (inside / np.linalg.norm(v, axis=1))[:, None]
        together = self._sums(k, meeting, len(poses))
        wrench = -weight[:, None] * np.concatenate([normal, cross(x, normal)], axis=1)
        by_group = (together @ wrench).reshape(len(poses), -1, 6) @ axes[:, :, self.dofs]
        dq = np.add.reduceat(by_group * self._between, self._group_starts, axis=1)
        value = top + np.log(sums) / self._beta
        return Depths(value, dq, k, meeting, weight, x, normal, axis, s, together)

    def hessian(self, found: Depths, axes: FloatArray, multipliers: FloatArray) -> FloatArray:
        """Return second derivatives of depths times multipliers (K, P), in `dofs`, (K, D, D).

        Besides those of the h they have beta (sum of w g g^T - m m^T), g being the slopes of the h
        and m their mean, that of the depth: the first part of it is in Q.
        """
        K, S = len(axes), axes[:, :, self.dofs]
        m = found.weight * multipliers[found.k, self._all.pair[found.meeting]]
        by_group = (found.together @ self._by_place(found, m)).reshape(K, -1, 6, 6)
        towards, back = (
            (B.reshape(K, -1, 6) @ S).reshape(*B.shape[:3], -1) * of[:, None]
            for B, of in ((by_group, self._first), (by_group.swapaxes(2, 3), self._second))
        )
        by_axis = self._between[:, None] * S[:, None]
        flat = (K, -1, len(self.dofs))
        upper = by_axis.reshape(flat).swapaxes(1, 2) @ (towards - back).reshape(flat)
        mean = (self._beta * multipliers[..., None] * found.dq).swapaxes(1, 2) @ found.dq
        return symmetric(upper) - mean

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

    def _sums(self, k: IntArray, meeting: IntArray, K: int) -> csr_array:
        """Return what sums up by instant and group: they follow each other in that order."""
        G, n = len(self._all.groups), len(k)
        key = k * G + self._all.group[meeting]
        ends = np.searchsorted(key, np.arange(K * G + 1))
        return csr_array((np.ones(n), np.arange(n), ends), shape=(K * G, n))


def _in_world(rounds: Rounds, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return starts and ways along the axes (K, n, 3)."""
    pose = poses[:, np.searchsorted(LINKS, rounds.link)]
    turn, origin = pose[..., :3, :3], pose[..., :3, 3]
    start, along = (np.einsum("knij,nj->kni", turn, part) for part in (rounds.start, rounds.along))
    return origin + start, along
