"""Straight lines through what came out, over all settings at once, by ordinary least squares.

Intervals are those of Student's t with the residuals about the line: walks have no random error,
so that they tell how well a straight line describes them, not how often it would be found again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg, stats

from human_gait.arrays import FloatArray, IntArray
from human_gait.findings.columns import Column

_DEPENDENT = 1e-8  # of the largest: a column that the others give


@dataclass(frozen=True)
class Slope:
    """How an output goes with one setting, the others held.

    Attributes
    ----------
    setting : str
    word : str
        Of a setting of words: against the first of them; else empty.
    slope, low, high : float
        Per unit of the setting, and its 95 % interval.
    standard, standard_low, standard_high : float
        The same in standard deviations of the output per one of the setting.
    """

    setting: str
    word: str
    slope: float
    low: float
    high: float
    standard: float
    standard_low: float
    standard_high: float


@dataclass(frozen=True)
class Line:
    """An output as a straight function of settings.

    Attributes
    ----------
    n : int
        Walks.
    r2 : float
        Share of the variance that it explains.
    slopes : tuple of Slope
    left_out : tuple of str
        Settings that follow from the others here.
    """

    n: int
    r2: float
    slopes: tuple[Slope, ...]
    left_out: tuple[str, ...]


def terms(settings: Sequence[Column], rows: IntArray) -> list[tuple[str, str, FloatArray]]:
    """Return setting, word and regressor (m,) of each term of a line; words are 0 or 1."""
    found = []
    for one in settings:
        values = one.values[rows]
        if not one.words:
            found.append((one.name, "", values))
            continue
        present = [k for k in range(len(one.words)) if np.any(values == k)]
        found += [(one.name, one.words[k], (values == k).astype(float)) for k in present[1:]]
    return [term for term in found if len(rows) and np.ptp(term[2]) > 0]


def line_through(output: FloatArray, given: Sequence[tuple[str, str, FloatArray]]) -> Line | None:
    """Return the line of an output (m,) over terms; None where there are too few walks.

    Notes
    -----
    y = X b + e with everything standardised: b = R^-1 Q^T y by a QR factorisation with pivoting,
    Var(b) = s^2 (R^T R)^-1, s^2 = |e|^2 / (m - p - 1).
    """
    m = len(output)
    if not given or m < 3 or not np.ptp(output) > 0:
        return None
    spread = float(np.std(output))
    scales = np.array([np.std(x) for *_, x in given])
    X = np.stack([(x - x.mean()) / s for (*_, x), s in zip(given, scales, strict=True)], axis=1)
    y = (output - output.mean()) / spread
    Q, R, order = linalg.qr(X, mode="economic", pivoting=True)
    size = np.abs(np.diag(R))
    p = int(np.sum(size > _DEPENDENT * size[0]))
    if m - p - 1 < 1:
        return None
    kept, inverse = order[:p], linalg.solve_triangular(R[:p, :p], np.eye(p))
    b = inverse @ (Q[:, :p].T @ y)
    rest = float(np.sum((y - X[:, kept] @ b) ** 2))
    error = np.sqrt(rest / (m - p - 1) * np.sum(inverse**2, axis=1))
    reach = stats.t.ppf(0.975, m - p - 1) * error
    slopes = [
        _slope(given[k], b[j], reach[j], spread / scales[k])
        for j, k in sorted(enumerate(kept), key=lambda pair: pair[1])
    ]
    left_out = tuple(dict.fromkeys(given[k][0] for k in order[p:]))
    return Line(m, 1.0 - rest / m, tuple(slopes), left_out)


def _slope(term: tuple[str, str, FloatArray], b: float, reach: float, unit: float) -> Slope:
    ends = (b, b - reach, b + reach)
    return Slope(*term[:2], *(float(x * unit) for x in ends), *map(float, ends))
