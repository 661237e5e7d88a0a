"""How much damping a Newton step gets: what is added to the matrix's diagonal.

Damping that is large turns a step towards steepest descent and makes it short. It grows where the
matrix is not positive definite, or no part of the step is taken, and falls as long as steps stay
short: where the cost has a curved valley, long ones leave it.

References
----------
A. Waechter and L. T. Biegler, Mathematical Programming 106 (2006): Algorithm IC; that damping goes
by the length of the last step is our own.
"""

from __future__ import annotations

MOST = 1e8
"""More is of no use."""
UNDAMPED = 3e-3
"""Where less would be the first, a step without any is tried."""

_LEAST = 1e-4
_MORE = 3.0
_REFUSED, _LEAST_REFUSED = 10.0, 1e-2
_LESS = 1.0 / 3.0
_AT_ONCE = 10.0  # largest fall from one step to the next, where damping was needed
_SHORT = 0.5  # largest change of a variable, in its unit, from where the damping does not fall


def first(damping: float) -> float:
    """Return what a step tries first, with the damping that the last one left."""
    return damping if damping >= UNDAMPED else 0.0


def if_indefinite(tried: float, damping: float, too_little: float) -> float:
    """Return what is tried next after a matrix that is not positive definite.

    Parameters
    ----------
    tried : float
    damping : float
        What the last step left.
    too_little : float
        A damping that is known not to suffice either: what is not above it is not tried.
    """
    more = max(_MORE * tried, _LESS * damping, _LEAST)
    while more <= min(too_little, MOST):
        more *= _MORE
    return more


def if_refused(tried: float) -> float:
    """Return what is tried next after a step of which no part was taken."""
    return max(_REFUSED * tried, _LEAST_REFUSED)


def left(tried: float, damping: float, longest: float) -> float:
    """Return the damping that a step leaves to the next one.

    Parameters
    ----------
    tried : float
        Damping of the step.
    damping : float
        What the last one left.
    longest : float
        Largest change of a variable, in its unit.
    """
    if not tried:
        return _LESS * damping
    return tried * min(max(longest / _SHORT, 1.0 / _AT_ONCE), 1.0)
