"""Where rows by the state of instants go among control points, and sums of their products.

An instant depends on four control points, by N from these to q, N' to v and N'' to a. Second
derivatives couple these; of a symmetric sum only a half X is kept, X + X^T being the whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np

from human_gait import kernel
from human_gait.arrays import FloatArray, IntArray
from human_gait.body.skeleton import N_DOF
from human_gait.walk.adjoint import Block
from human_gait.walk.bspline import DEGREE, Basis
from human_gait.walk.ground_reaction import LEG_JOINTS, N_LOWER

POINTS = DEGREE + 1
"""Control points that an instant depends on: 4."""

Rows = tuple[IntArray, FloatArray]
"""Some DOF (c,), and rows (K, r, 4, c) by their control points."""

_EVERY = np.arange(N_DOF)


class Grid:
    """The instants of a basis: which control points they depend on, and how.

    Parameters
    ----------
    basis : Basis
    times : (K,) array, [s]

    Attributes
    ----------
    N : (3, K, 4) array
        Weights of the control points in q, v, a.
    first : (K,) int array
        The first of the control points.
    gap : (K,) int array
        By how many the first one of the next instant is further on: T is the image of 0 and belongs
        to the control points from m on.
    within : (K, 1, 1, 1) array
        1 where the next instant is in the same piece, else 0.
    ends : (e,) int array
        The instants whose next one is in another piece.
    """

    def __init__(self, basis: Basis, times: FloatArray) -> None:
        self.basis = basis
        piece = np.searchsorted(basis.breaks, times, side="right") - 1
        first = np.clip(piece, 0, basis.n_pieces - 1)  # T belongs to the last one
        active, at = first[:, None] + np.arange(POINTS), np.arange(len(times))[:, None]
        self.N = np.stack([basis.matrix(times, order)[at, active] for order in range(3)])
        following = np.append(first[1:], basis.n_free if basis.mirrored else first[-1])
        self.first, self.gap = first, following - first
        self.within = (self.gap == 0).astype(float)[:, None, None, None]
        self.within[-1] = 0.0  # next is T, or nothing
        self.ends = np.flatnonzero(self.gap)
        self._after = (np.arange(len(times)) + 1) % len(times)

    @cached_property
    def leg_velocities(self) -> FloatArray:
        """Partials (K, 14, 4, 20) of the velocities of the legs' joints, by `LOWER`."""
        joint = np.arange(LEG_JOINTS.stop - LEG_JOINTS.start)
        found = np.zeros((len(self.first), len(joint), POINTS, N_LOWER))
        found[:, joint, :, LEG_JOINTS.start + joint] = self.N[1]
        return found

    def onto_points(self, rows: FloatArray) -> FloatArray:
        """Return rows (K, r, 3, c) by q, v, a as rows (K, r, 4, c) by the control points."""
        K, r, _, c = rows.shape
        found = np.empty((K, r, POINTS, c))
        if run := kernel.function("onto_points"):
            run(
                K,
                r,
                0,
                r,
                c,
                c,
                np.arange(c),
                self.N,
                rows,
                kernel.NONE,
                kernel.NONE,
                into=(found,),
            )
            return found
        q, v, a = self.N[:, :, None, :, None]
        np.multiply(rows[:, :, None, 0], q, out=found)
        found += rows[:, :, None, 1] * v
        found += rows[:, :, None, 2] * a
        return found

    def postures(self, rows: FloatArray, k: IntArray | slice = slice(None)) -> FloatArray:
        """Return rows (k, r, c) by q of the instants k as rows (k, r, 4, c)."""
        return np.asarray(self.N[0, k, None, :, None] * rows[:, :, None])

    def next(self, rows: FloatArray, k: IntArray | slice = slice(None)) -> FloatArray:
        """Return rows (K, ...) at the instants after those of k, at T those of 0."""
        return np.asarray(rows[self._after[k]])

    def at_end(self, rows: FloatArray, of: IntArray, joints: slice, dofs: IntArray) -> FloatArray:
        """Return rows (r, 4, c) of the torques of `joints` at T, by `dofs`.

        From the rows, by the DOF `of`, of the joints that they are images of: the same rows by the
        images of the control points.
        """
        cycle = self.basis.cycle
        turned = rows[..., np.searchsorted(of, cycle.index[dofs])] * cycle.sign[dofs]
        return np.asarray(turned * cycle.sign[joints, None, None])

    def weighted(
        self, P: FloatArray, at_end: FloatArray, own: int, weights: Sequence[FloatArray]
    ) -> FloatArray:
        """Return w P / 2 + c V + w' P' (K, r, 4, c), the last within pieces.

        P are rows of torques, whose own joints are DOF `own` and those after it, V of the
        velocities of these, P' of the next instant, `at_end` after the last one. Weights w, c and
        w' are (K, r).
        """
        (w, c, to_next), (K, r, _, n) = weights, P.shape
        if run := kernel.function("weighted"):
            found = np.empty_like(P)
            arguments = self.within, w, c, to_next, self.N[1]
            run(K, r, n, own, P, at_end, *arguments, into=(found,))
            return found
        found, joint = w[..., None, None] / 2.0 * P, np.arange(r)
        found[:, joint, :, own + joint] += (c[..., None] * self.N[1][:, None]).swapaxes(0, 1)
        found[:-1] += (self.within * to_next[..., None, None])[:-1] * P[1:]
        return found


class Half:
    """A half X of second derivatives by control points, X + X^T being the whole.

    Parameters
    ----------
    grid : Grid
    onward : bool
        Whether there are products with the next instant.

    Attributes
    ----------
    blocks : (p, reach + 1, 55, 55) array
        [i, d] is by the control points i and i + d.
    """

    def __init__(self, grid: Grid, onward: bool) -> None:
        self._grid = grid
        most = int(grid.gap.max()) if onward else 0
        n_points = grid.basis.n_control_points + int(onward and grid.gap[-1] > 0)
        self._reach = DEGREE + most
        self.blocks = np.zeros((n_points, self._reach + 1, N_DOF, N_DOF))

    def add(self, left: Rows, right: Rows, mask: FloatArray | None = None) -> None:
        """Add the sums of L^T R of rows of the same instants, times a mask (l, r) of their DOF."""
        grid = self._grid
        self._add_products(left, right, grid.first, 0 * grid.gap, mask)

    def add_onward(self, left: Rows, right: Rows) -> None:
        """Add L^T R of rows of instants and of the next ones that are in another piece.

        Rows are those of ``Grid.ends`` and of the instants after them.
        """
        grid = self._grid
        self._add_products(left, right, grid.first[grid.ends], grid.gap[grid.ends], None)

    def _add_products(
        self, left: Rows, right: Rows, first: IntArray, gap: IntArray, mask: FloatArray | None
    ) -> None:
        """Add L^T R, L by the control points from the first ones on, R by those `gap` further."""
        (rows, L), (columns, R) = left, right
        K, r, _, n = L.shape
        if run := kernel.function("add_products"):
            dofs = n, rows, len(columns), columns, kernel.optional(mask)
            product = np.empty(POINTS**2 * n * len(columns))
            run(K, r, *dofs, first, gap, L, R, self._reach, into=(self.blocks, product))
            return
        starts = np.flatnonzero(np.diff(first, prepend=-1) | np.diff(gap, prepend=-1))
        found = np.empty((len(starts), POINTS * n, POINTS * len(columns)))
        for (i, j), into in zip(pairwise([*starts, K]), found, strict=True):
            flat = [side[i:j].reshape((j - i) * r, POINTS * side.shape[3]) for side in (L, R)]
            np.matmul(flat[0].T, flat[1], out=into)
        by_point = found.reshape(-1, POINTS, n, POINTS, len(columns))
        if mask is not None:
            by_point *= mask[:, None]
        self._fold(rows, columns, by_point, first[starts], gap[starts])

    def _fold(
        self, rows: IntArray, columns: IntArray, found: FloatArray, first: IntArray, gap: IntArray
    ) -> None:
        """Add products (p, 4, l, 4, r), rows by points from the first ones (p,), columns `gap` on.

        What is by a column's point before the row's goes to its transpose.
        """
        p, width = self.blocks.shape[:2]
        upper = np.zeros((p, width, len(rows), len(columns)))
        same = np.array_equal(rows, columns)
        lower = upper if same else np.zeros((p, width, len(columns), len(rows)))
        for ahead in np.unique(gap):
            pieces = _neighbours(np.flatnonzero(gap == ahead))
            blocks = found[pieces]
            at = [_neighbours(first[pieces] + i) for i in range(-POINTS, POINTS)]
            for i in range(POINTS):
                for j in range(POINTS):
                    d = int(ahead) + j - i
                    if d >= 0:
                        upper[at[POINTS + i], d] += blocks[:, i, :, j]
                    else:
                        lower[at[POINTS + i + d], -d] += blocks[:, i, :, j].swapaxes(1, 2)
        _add_to(self.blocks, rows, columns, upper)
        if not same:
            _add_to(self.blocks, columns, rows, lower)

    def add_block(self, block: Block) -> None:
        """Add what stands in no product: N_i H_qq N_j / 2 + N_i H_qv N'_j + N'_i H_vv N'_j / 2."""
        N, first, (dofs, qq, qv, vv) = self._grid.N, self._grid.first, block
        if run := kernel.function("add_block"):
            given = (kernel.optional(part) for part in (qq, qv, vv))
            run(len(first), len(dofs), dofs, N, first, *given, self._reach, into=(self.blocks,))
            return
        q, v, _ = N
        by_block = (q / 2, q), (q, v), (v / 2, v)
        weights = [(i[:, :, None] * j[:, None, :]).reshape(-1, POINTS**2) for i, j in by_block]
        parts = [(w, part) for w, part in zip(weights, block[1:], strict=True) if part is not None]
        starts = np.flatnonzero(np.diff(first, prepend=-1))
        found = [
            sum(weight[i:j].T @ part[i:j].reshape(j - i, -1) for weight, part in parts)
            for i, j in pairwise([*starts, len(first)])
        ]
        shape = -1, POINTS, POINTS, len(dofs), len(dofs)
        by_point = np.array(found).reshape(shape).swapaxes(2, 3)
        self._fold(dofs, dofs, by_point, first[starts], 0 * starts)

    def add_own(self, own: FloatArray) -> None:
        """Add second derivatives (K, 3, 55) of single DOF, by q twice, q and v, v twice."""
        q, v, _ = self._grid.N
        starts = np.flatnonzero(np.diff(self._grid.first, prepend=-1))
        at = self._grid.first[starts, None]
        for i in range(POINTS):
            for j in range(i, POINTS):
                half = 0.5 if i == j else 1.0  # the other half is the transpose
                mixed = q[:, i] * v[:, j] + (i != j) * v[:, i] * q[:, j]
                by = np.stack([half * q[:, i] * q[:, j], mixed, half * v[:, i] * v[:, j]], axis=1)
                found = np.add.reduceat((by[:, :, None] * own).sum(axis=1), starts)
                self.blocks[at + i, j - i, _EVERY, _EVERY] += found

    def folded(self) -> FloatArray:
        """Return the blocks (m, reach + 1, 55, 55) by free control points i and (i + d) mod m.

        Control points past the free ones are images P_(m+i) = S P_i + L z of the first ones,
        Eq. (26), so that their rows and columns are turned by S, which is its own transpose.
        """
        basis = self._grid.basis
        m, turned = basis.n_free, basis.cycle.turned
        free = self.blocks[:m]
        if not basis.mirrored:
            return free
        for d in range(free.shape[1]):
            columns = np.arange(max(m - d, 0), m)  # by points past the free ones
            columns = columns[(columns + d) // m % 2 == 1]
            free[columns, d] = turned(free[columns, d])
            for row in range(m, len(self.blocks) - d):  # these as well
                past = self.blocks[row, d]
                if row // m % 2:
                    past = turned(past.T).T
                free[row % m, d] += turned(past) if (row + d) // m % 2 else past
        return free


def _neighbours(i: IntArray) -> slice | IntArray:
    """Return indices as a slice, which copies nothing, if each is one more than the last."""
    adjacent = np.array_equal(i, np.arange(i[0], i[0] + len(i)))
    return slice(int(i[0]), int(i[0]) + len(i)) if adjacent else i


def _add_to(blocks: FloatArray, rows: IntArray, columns: IntArray, found: FloatArray) -> None:
    """Add blocks (..., l, r) of some DOF to those of all (..., 55, 55), by runs of neighbours."""
    for i, at in _runs(rows):
        for j, beside in _runs(columns):
            blocks[..., at, beside] += found[..., i, j]


def _runs(dofs: IntArray) -> list[tuple[slice, slice]]:
    """Return the runs of neighbouring DOF: where each is among them, and which they are."""
    starts = [0, *(np.flatnonzero(np.diff(dofs) != 1) + 1).tolist(), len(dofs)]
    return [(slice(i, j), slice(int(dofs[i]), int(dofs[i]) + j - i)) for i, j in pairwise(starts)]
