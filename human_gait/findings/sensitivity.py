"""Which setting matters: how much of the spread of an output goes with each setting.

First-order indices of Sobol, S_i = Var(E[Y | X_i]) / Var(Y), from the walks that are there: the
correlation ratio of Y over classes of X_i (Pearson; as an estimator of S_i from given data:
Plischke, Borgonovo and Smith, Eur. J. Oper. Res. 226, 2013). No design of experiments is needed.
Classes are the values of the setting where it has few, else of equal numbers of walks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from human_gait.arrays import FloatArray, IntArray
from human_gait.findings.columns import Column

_FEW = 30  # values that are classes of their own, if they have three walks or more each
_CLASSES = 50
_LEAST = 10  # walks


@dataclass(frozen=True)
class Share:
    """How much of the variance of an output goes with one setting alone.

    Attributes
    ----------
    setting : str
    share : float
        S_i; below 0 only by the correction for the number of classes.
    low, high : float
        Its 95 % interval, within 0 and 1.
    """

    setting: str
    share: float
    low: float
    high: float


def classes(setting: Column, rows: IntArray) -> IntArray:
    """Return the class of a setting that each of some rows belongs to, (m,), from 0 on."""
    values = setting.values[rows]
    levels = np.unique(values)
    if len(levels) <= min(_FEW, len(rows) / 3):
        return np.searchsorted(levels, values)
    m = min(_CLASSES, round(2 * len(rows) ** (1 / 3)))
    ranks = stats.rankdata(values, "average")
    _, place = np.unique(np.floor((ranks - 0.5) * m / len(rows)), return_inverse=True)
    return place.astype(np.intp)


def share_of(output: FloatArray, place: IntArray, setting: str) -> Share | None:
    """Return the first-order index of an output (m,) over classes (m,); None if it has none.

    Notes
    -----
    With W = (Y - mean of its class)^2 and T = (Y - mean)^2 the correlation ratio is
    1 - E[W] / E[T]; B classes in m walks take B - 1 degrees of freedom from E[W]. The interval is
    by the delta method: the ratio of two means has the variance of W - (1 - S) T, over m E[T]^2.
    """
    m, count = len(output), np.bincount(place)
    B = len(count)
    if m < _LEAST or B < 2 or m <= B or not np.ptp(output) > 0:
        return None
    total = (output - output.mean()) ** 2
    means = np.bincount(place, output) / count
    within = (output - means[place]) ** 2
    rest = within.mean() / total.mean() * (m - 1) / (m - B)
    spread = np.std(within - rest * total) / total.mean() / np.sqrt(m)
    reach = float(stats.norm.ppf(0.975) * spread)
    share = float(1.0 - rest)
    low, high = (float(np.clip(share + sign * reach, 0.0, 1.0)) for sign in (-1, 1))
    return Share(setting, share, low, high)
