"""Symmetric matrices of all kinds: what they are, their factors, and how they fail."""

import numpy as np
import pytest
from scipy.sparse import coo_array, csr_array

from human_gait.newton import cyclic_band
from human_gait.newton.cyclic_band import BandFactor, CyclicBand
from human_gait.newton.matrix import Dense, Sparse, matrix_of

SHAPES = {
    "ring": (12, 4, 3),
    "wide ring": (13, 5, 2),
    "ring of neighbours": (9, 1, 4),
    "short ring": (7, 3, 4),
    "ring that meets itself": (3, 3, 2),
}
"""Blocks, neighbours on each side, rows of a block."""


@pytest.fixture(autouse=True)
def few_blocks_are_many(monkeypatch):
    """Small matrices are factorised as large ones are."""
    monkeypatch.setattr(cyclic_band, "_MANY", 0)


def ring(m, w, b):
    """Random blocks of a half."""
    return np.random.default_rng(m).normal(size=(m, w + 1, b, b))


def entry_by_entry(blocks):
    """The dense matrix of a ring, from what its blocks are said to be."""
    m, width, b, _ = blocks.shape
    dense = np.zeros((m * b, m * b))
    for i, d in np.ndindex(m, width):
        rows, columns = slice(i * b, i * b + b), slice((i + d) % m * b, (i + d) % m * b + b)
        dense[rows, columns] += blocks[i, d]
        dense[columns, rows] += blocks[i, d].T
    return dense


def matrices():
    rings = {name: ring(*shape) for name, shape in SHAPES.items()}
    banded = ring(12, 4, 3)
    for d in range(1, 5):
        banded[12 - d :, d] = 0.0
    rings["band"] = banded
    found = {name: (CyclicBand(blocks), entry_by_entry(blocks)) for name, blocks in rings.items()}
    dense = found["ring"][1]
    return found | {"dense": (Dense(dense), dense), "sparse": (Sparse(csr_array(dense)), dense)}


MATRICES = matrices()


@pytest.fixture(params=MATRICES)
def case(request):
    return MATRICES[request.param]


def lowest(dense):
    return float(np.linalg.eigvalsh(dense)[0])


def test_it_is_the_matrix_of_its_blocks(case):
    matrix, dense = case
    np.testing.assert_allclose(matrix.dense(), dense, atol=1e-14)
    np.testing.assert_allclose(matrix.dense(), matrix.dense().T, atol=1e-14)


def test_a_factor_solves_and_leaves_the_matrix_alone(case):
    matrix, dense = case
    rng = np.random.default_rng(1)
    added = rng.uniform(1.0, 2.0, len(dense)) - lowest(dense)
    right, before = rng.normal(size=len(dense)), matrix.dense().copy()
    x, again = (matrix.factor(added).solve(right) for _ in range(2))
    expected = np.linalg.solve(dense + np.diag(added), right)
    np.testing.assert_allclose(x, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_array_equal(x, again)
    np.testing.assert_array_equal(matrix.dense(), before)


@pytest.mark.parametrize("name", ["ring", "wide ring", "ring of neighbours", "band"])
def test_rings_of_many_blocks_are_factorised_as_such(name):
    matrix, dense = MATRICES[name]
    assert isinstance(matrix.factor(np.full(len(dense), 1.0 - lowest(dense))), BandFactor)


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9, 0.9999])
def test_what_is_not_positive_definite_says_how_much_is_missing_at_least(case, share):
    """Never more than the lowest eigenvalue; added again and again it leads there."""
    matrix, dense = case
    needed = -lowest(dense)
    added = share * needed
    missing = matrix.factor(np.full(len(dense), added))
    assert 0.0 < missing <= (1.0 - share) * needed * (1.0 + 1e-9)
    for _ in range(60):
        found = matrix.factor(np.full(len(dense), added))
        if not isinstance(found, float):
            break
        added += found + 0.01 * needed
    assert added == pytest.approx(needed, rel=0.011)


@pytest.mark.parametrize("block", [0, 5, 11])
def test_a_negative_pivot_is_found_wherever_it_is(block):
    """In the first block, between, and in the border."""
    blocks = ring(12, 4, 3)
    blocks[:, 0] += np.eye(3) * (1.0 - lowest(entry_by_entry(blocks)))
    blocks[block, 0, 1, 1] = -1e6
    missing = CyclicBand(blocks).factor(np.zeros(36))
    assert 1e5 < missing <= -lowest(entry_by_entry(blocks))


def test_rings_of_few_blocks_are_factorised_whole(monkeypatch):
    """And put together once only."""
    monkeypatch.setattr(cyclic_band, "_MANY", 13)
    matrix, made = CyclicBand(ring(12, 4, 3)), []
    whole = CyclicBand.dense
    monkeypatch.setattr(CyclicBand, "dense", lambda self: made.append(1) or whole(self))
    for damping in (0.0, 1.0, 100.0):
        assert not isinstance(matrix.factor(np.full(36, damping)), BandFactor)
    assert len(made) == 1


def test_rows_that_are_left_out_of_every_block_leave_a_ring():
    blocks, gone = ring(12, 4, 3), np.tile([False, True, False], 12)
    found = CyclicBand(blocks).without(gone)
    assert isinstance(found, CyclicBand)
    expected = entry_by_entry(blocks)[np.ix_(~gone, ~gone)]
    np.testing.assert_array_equal(found.dense(), expected)


def test_any_rows_may_be_left_out(case):
    matrix, dense = case
    gone = np.random.default_rng(3).uniform(size=len(dense)) < 0.3
    found = matrix.without(gone)
    np.testing.assert_allclose(found.dense(), dense[np.ix_(~gone, ~gone)], atol=1e-14)


def test_few_entries_are_added_to_a_ring_where_it_reaches():
    """On the diagonal, beside it, round the end; in the same place twice."""
    blocks = ring(12, 4, 3)
    rows = np.array([0, 4, 5, 5, 35, 2, 35, 2, 20])
    columns = np.array([0, 5, 4, 5, 2, 35, 2, 35, 20])
    values = np.array([1.0, 2.0, 2.0, 3.0, 4.0, 4.0, 0.5, 0.5, 7.0])
    other = coo_array((values, (rows, columns)), shape=(36, 36))
    found = CyclicBand(blocks).plus(other)
    expected = entry_by_entry(blocks) + other.toarray()
    np.testing.assert_allclose(found.dense(), expected, atol=1e-14)
    np.testing.assert_allclose(CyclicBand(blocks).dense(), entry_by_entry(blocks), atol=1e-14)


def test_what_does_not_fit_into_a_ring_is_not_added():
    """Beyond its reach, or where a ring of few blocks meets itself."""
    far = coo_array((np.ones(2), ([0, 18], [18, 0])), shape=(36, 36))
    assert CyclicBand(ring(12, 4, 3)).plus(far) is None
    near = coo_array((np.ones(1), ([0], [0])), shape=(28, 28))
    assert CyclicBand(ring(7, 3, 4)).plus(near) is None


def test_rows_and_columns_are_scaled():
    blocks, unit = ring(12, 4, 3), np.random.default_rng(4).uniform(0.5, 2.0, 36)
    expected = unit[:, None] * entry_by_entry(blocks) * unit
    np.testing.assert_allclose(CyclicBand(blocks).scaled(unit).dense(), expected, rtol=1e-14)


def test_an_array_is_a_dense_matrix_and_a_matrix_stays():
    values = np.eye(3)
    assert matrix_of(values).dense() is values
    band = CyclicBand(ring(12, 4, 3))
    assert matrix_of(band) is band
