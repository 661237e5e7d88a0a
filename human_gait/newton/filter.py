"""The filter of a line search: what the next point has to improve on.

References
----------
A. Waechter and L. T. Biegler, Mathematical Programming 106 (2006), section 2.3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

_MARGIN = 1e-5  # gamma_theta = gamma_phi of Eq. (18)


class Measures(NamedTuple):
    """The two things that a step is to make smaller.

    Attributes
    ----------
    violation : float
        theta, the sum of what rows and slacks differ by.
    height : float
        phi, the barrier function, Eq. (3a).
    """

    violation: float
    height: float

    def better_than(self, other: Measures) -> bool:
        """Return whether one of the two is lower than the other's by a margin, Eq. (18)."""
        margin = _MARGIN * other.violation
        lower = self.violation <= other.violation - margin
        return lower or self.height <= other.height - margin


NOWHERE = Measures(np.inf, np.inf)
"""Of a point that cannot be evaluated."""


class Filter:
    """The measures of points that no later one may be worse than in both."""

    def __init__(self) -> None:
        self._points: list[Measures] = []

    def add(self, point: Measures) -> None:
        """Keep the measures of a point."""
        self._points.append(point)

    def takes(self, there: Measures) -> bool:
        """Return whether a point is better than each that was kept, in one measure at least."""
        return there.violation < np.inf and all(there.better_than(kept) for kept in self._points)
