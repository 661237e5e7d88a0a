"""How much deeper than at rest limbs are in each other, with exact first and second derivatives.

Of each pair of parts (`limb_shapes`) the first one is beads, the second one whole capsules. A bead
of radius r around x, and a capsule of radius R whose axis has the point y nearest to x, are by

    h = r + R - s - h0,    s = sqrt(|x - y|^2 + eps^2),

deeper in each other than h0, what the pair is at most when the body stands upright with hanging
arms. A limb is as deep as the smooth maximum over all its beads and capsules says,

    depth = log(exp(beta d0) + sum of exp(beta h)) / beta,

which is never less than the largest h, and more by log(n) / beta where n are equally deep; all that
is further away than the sight -d0 is as far as that, and has no slope.

Two segments would need no beads, but their distance has a kink where they are parallel, as an arm
that hangs beside a leg. That of a bead has none: its second derivatives are continuous but where y
comes to an end of the axis. There they jump by 1 / s, which is small beside the beta of the
maximum, so that a step of Newton's method is hardly another one on the other side.

Seen from the link b of the capsule only the bead moves, on the joints i between b and its own link
a: with sigma_i = 1 on the path of a, -1 on that of b and 0 on both, by sigma_i T S_i, T = [1, -[x]]
and S_i the spatial axis. With slope f and second derivatives Q of a function of its place those by
q are

    sigma_i sigma_j S_i^T B S_j,    B = (T^T Q - [0; [f]]) T,

for i nearer to b than j, or the same; for j nearer with B transposed.
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
from human_gait.walk.limb_shapes import LIMBS, PAIRS, Meetings

_ROUNDED = 1e-3  # [m], eps: what keeps a bead on the very axis from being singular
_LEAST = 20.0  # of a sum parts below exp(-20) = 2e-9 do not count


@dataclass(frozen=True, eq=False)
class Depths:
    """How deep limbs are at K instants, and what second derivatives need besides.

    Of the beads in capsules only the n that count are here, by instant, limb and links.

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
        Its instant, and which of the groups of `Meetings` it is.
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
        From where on limbs are taken for as far apart as this.
    gap : float, [m]
        Pairs that are further apart at rest are taken for as near as this at rest.

    Attributes
    ----------
    at_rest : (P,) array, [m]
        The h0 of each of ``PAIRS``.
    dofs : slice
        The D of them that move limbs against each other, those between among them.
    columns : (R, c) int array
        Which of `dofs` each of ``LIMBS`` depends on, and others to make c of them.
    """

    def __init__(self, body: Body, softness: float, sight: float, gap: float) -> None:
        self._beta, self._far = 1.0 / softness, -sight
        self._all = found = Meetings.of(body)
        limbs = np.arange(len(LIMBS))
        self._begin = np.searchsorted(found.limb, limbs)
        self._places = _places(found)
        self._ends = np.cumsum([len(found.beads.link), len(found.capsules.link)])
        self._number = found.bead * len(found.capsules.link) + found.capsule
        self._vv = np.square(found.capsules.along).sum(axis=1)[found.capsule]
        self._per_vv = 1.0 / self._vv
        reach = found.beads.radius[found.bead] + found.capsules.radius[found.capsule]
        s, _ = self._distances(*self._placed(_poses_at_rest(body)))
        self.at_rest = np.full(len(PAIRS), -gap)
        np.maximum.at(self.at_rest, found.pair, reach - s[0])
        self._reach = reach - self.at_rest[found.pair]
        of_link = _moving(body)
        first, second = (of_link[found.groups[:, i]] for i in (1, 2))
        moving = np.flatnonzero((first != second).any(axis=0))
        self.dofs = slice(int(moving[0]), int(moving[-1]) + 1)
        self._first, self._second = first[:, self.dofs], second[:, self.dofs]
        self._between = self._first - self._second  # sigma
        begin = np.searchsorted(found.groups[:, 0], limbs)
        depends = np.maximum.reduceat(np.abs(self._between), begin)
        most = int(depends.sum(axis=1).max())
        self.columns = np.sort(np.argsort(-depends, axis=1, kind="stable")[:, :most], axis=1)

    def depths(self, poses: FloatArray, axes: FloatArray) -> Depths:
        """Return how deep limbs are, with partials.

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
        k, which, weight, value = self._maximum(self._reach - s)
        capsule, limb, group = every.capsule[which], every.limb[which], every.group[which]
        x, v, s, t = beads[k, every.bead[which]], along[k, capsule], s[k, which], share[k, which]
        normal = (x - start[k, capsule] - t[:, None] * v) / s[:, None]
        inside = (t > 0.0) & (t < 1.0)
        axis = v * (inside / np.sqrt(self._vv[which]))[:, None]
        starts = np.flatnonzero(np.diff(k * len(every.groups) + group, prepend=-1))
        k_of, group_of = k[starts], group[starts]
        wrench = -weight[:, None] * np.concatenate([normal, cross(x, normal)], axis=1)
        slope = (np.add.reduceat(wrench, starts)[:, None] @ S[k_of])[:, 0]
        dq = np.zeros((*value.shape, S.shape[2]))
        np.add.at(dq, (k_of, limb[starts]), slope * self._between[group_of])
        return Depths(value, dq, k, limb, weight, x, normal, axis, s, starts, k_of, group_of)

    def hessian(self, found: Depths, axes: FloatArray, multipliers: FloatArray) -> FloatArray:
        """Return second derivatives of depths times multipliers (K, R), in `dofs`, (K, D, D).

        Besides those of the h they have beta (sum of w g g^T - m m^T), g being the slopes of the h
        and m the sum of w g, the slope of the depth. The first part of it is in Q.
        """
        S, g = axes[:, :, self.dofs], found.group_of
        by_place = self._by_place(found, found.weight * multipliers[found.k, found.limb])
        B = np.add.reduceat(by_place, found.starts).reshape(-1, 6, 6)
        here = S[found.k_of]
        turned = (B @ here) * self._first[g, None]
        turned -= (B.swapaxes(1, 2) @ here) * self._second[g, None]
        here *= self._between[g, None]
        ends = np.searchsorted(found.k_of, np.arange(len(S) + 1))
        flat = -1, S.shape[2]
        upper = np.stack(
            [here[i:j].reshape(flat).T @ turned[i:j].reshape(flat) for i, j in pairwise(ends)]
        )
        mean = (self._beta * multipliers[..., None] * found.dq).swapaxes(1, 2) @ found.dq
        return symmetric(upper) - mean

    def _maximum(self, h: FloatArray) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
        """Return the smooth maximum (K, R) of the h (K, N) of each limb, and which count for it.

        Returns
        -------
        k, which : (n,) int array
        weight : (n,) array
            What each is of the sum.
        value : (K, R) array
        """
        limb_of = self._all.limb
        top = np.maximum(np.maximum.reduceat(h, self._begin, axis=1), self._far)
        k, which = np.nonzero(h > (top - _LEAST / self._beta).take(limb_of, axis=1))
        place = k, limb_of[which]
        parts = np.exp(self._beta * (h[k, which] - top[place]))
        sums = np.exp(self._beta * (self._far - top))
        np.add.at(sums, place, parts)
        return k, which, parts / sums[place], top + np.log(sums) / self._beta

    def _by_place(self, found: Depths, m: FloatArray) -> FloatArray:
        """Return B (n, 36) of each bead in a capsule, m (n,) being its multiplier.

        f = -m n, Q = m (beta n n^T - (1 - n n^T - axis axis^T) / s).
        """
        n, a, x = found.normal, found.axis, found.x
        Q = (self._beta + 1.0 / found.s)[:, None, None] * n[:, :, None] * n[:, None]
        Q -= (np.eye(3) - a[:, :, None] * a[:, None]) / found.s[:, None, None]
        Q *= m[:, None, None]
        turned = cross(x[:, None], Q).swapaxes(1, 2) + skew(m[:, None] * n)
        left = np.concatenate([Q, turned], axis=1)
        return np.concatenate([left, cross(x[:, None], left)], axis=2).reshape(len(m), 36)

    def _placed(self, poses: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return beads, and starts and ways along the axes of capsules in the world (K, n, 3)."""
        by_axis = poses[:, :, :3].swapaxes(1, 2).reshape(len(poses), 3, -1)
        beads, start, along = np.split(by_axis @ self._places, self._ends, axis=2)
        return beads.swapaxes(1, 2), start.swapaxes(1, 2), along.swapaxes(1, 2)

    def _distances(
        self, x: FloatArray, p: FloatArray, v: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return s and where y is between the ends of the axis, 0 to 1, (K, N).

        With r = x - p the nearest point is at t = r.v / v.v, |x - y|^2 = r.r - t (2 r.v - t v.v).
        """
        xx, pp, pv = ((one * other).sum(axis=2) for one, other in ((x, x), (p, p), (p, v)))
        beads = np.stack([*np.moveaxis(x, 2, 0), np.ones_like(xx), xx], axis=2)
        # r.r = x.x + p.p - 2 x.p and r.v = x.v - p.v as products of these with
        by_p = np.stack([*np.moveaxis(-2.0 * p, 2, 0), pp, np.ones_like(pp)], axis=1)
        by_v = np.stack([*np.moveaxis(v, 2, 0), -pv, np.zeros_like(pv)], axis=1)
        rr, rv = ((beads @ by).reshape(len(x), -1)[:, self._number] for by in (by_p, by_v))
        t = rv * self._per_vv
        np.clip(t, 0.0, 1.0, out=t)
        rv *= 2.0
        rv -= t * self._vv
        rr -= t * rv
        np.maximum(rr, 0.0, out=rr)
        rr += _ROUNDED**2
        return np.sqrt(rr, out=rr), t


def _places(found: Meetings) -> FloatArray:
    """Return beads, starts and ways along the axes of capsules as a matrix (23 * 4, n).

    The first three rows of the poses, link by link, times the matrix are their places.
    """
    beads, whole = found.beads, found.capsules
    link = np.concatenate([beads.link, whole.link, whole.link])
    at = np.zeros((len(link), 4))
    at[:, :3] = np.concatenate([beads.start, whole.start, whole.along])
    at[: len(link) - len(whole.link), 3] = 1.0  # ways have no place
    matrix = np.zeros((len(LINKS), 4, len(link)))
    matrix[np.searchsorted(LINKS, link), :, np.arange(len(link))] = at
    return matrix.reshape(-1, len(link))


def _moving(body: Body) -> FloatArray:
    """Return (55, 55): 1 where the joint of the column moves the link of the row."""
    moving = np.zeros((N_DOF, N_DOF))
    for link, path in enumerate(paths(body.table)):
        moving[link, path] = 1.0
    return moving


def _poses_at_rest(body: Body) -> FloatArray:
    """Return the poses (1, 23, 4, 4) of ``LINKS`` at q = 0: upright, with hanging arms."""
    _, A = frames(body.table, np.zeros((1, N_DOF)))
    return np.asarray((A @ inverse(link_to_dh(body.table)))[:, LINKS])
