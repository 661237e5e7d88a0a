"""What people measure: a percentile of ANSUR II, 4,082 men and 1,986 women (``data/ansur2``)."""

from __future__ import annotations

from bisect import bisect_left
from functools import cache
from statistics import NormalDist

from human_gait import data

Curve = tuple[tuple[float, ...], tuple[float, ...]]

_PERCENTILES = ("1", "2.5", "5", "10", "25", "50", "75", "90", "95", "97.5", "99")
_NORMAL = NormalDist()


def at_percentile(sex: str, measure: str, percentile: float) -> float:
    """Return a percentile of a measure, [mm], [kg] or [year].

    Parameters
    ----------
    sex : str
    measure : str
        ``stature``, ``mass`` or another one of the survey.
    percentile : float
        Above 0 and below 100.
    """
    return at_score(sex, measure, _NORMAL.inv_cdf(percentile / 100.0))


def at_score(sex: str, measure: str, score: float) -> float:
    """Return a measure at a normal score z, the percentile being that of z.

    Notes
    -----
    Linear in z between the percentiles of the table, which makes a normal distribution of values
    that are normal; the least and the greatest of n people stand at 50 / n and 100 - 50 / n %.
    Nobody is beyond these.
    """
    scores, values = _curve(sex, measure)
    k = min(max(bisect_left(scores, score), 1), len(scores) - 1)
    share = (score - scores[k - 1]) / (scores[k] - scores[k - 1])
    return values[k - 1] + min(max(share, 0.0), 1.0) * (values[k] - values[k - 1])


def percentile_of(sex: str, measure: str, value: float) -> float:
    """Return the percentile of a value, the inverse of `at_percentile`; the ends beyond them."""
    scores, values = _curve(sex, measure)
    k = min(max(bisect_left(values, value), 1), len(values) - 1)
    share = (value - values[k - 1]) / (values[k] - values[k - 1])
    score = scores[k - 1] + min(max(share, 0.0), 1.0) * (scores[k] - scores[k - 1])
    return 100.0 * _NORMAL.cdf(score)


@cache
def _curve(sex: str, measure: str) -> Curve:
    """Return normal scores and values of the percentiles of a measure, ends included."""
    (row,) = (
        row
        for row in data.rows("ansur2/percentiles")
        if (row["sex"], row["measure"]) == (sex, measure)
    )
    end = 50.0 / int(row["n"])
    percentiles = (end, *map(float, _PERCENTILES), 100.0 - end)
    columns = ("min", *(f"p{each}" for each in _PERCENTILES), "max")
    scores = tuple(_NORMAL.inv_cdf(percentile / 100.0) for percentile in percentiles)
    return scores, tuple(float(row[column]) for column in columns)
