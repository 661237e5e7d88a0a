"""When the feet meet and leave the ground, as gait software cuts a walk into cycles."""

from __future__ import annotations

from dataclasses import dataclass

from human_gait.walk.gait import Gait

_LEADING = ("left", "right")  # of the first step and of the second


@dataclass(frozen=True)
class FootEvent:
    """A foot meets or leaves the ground.

    Attributes
    ----------
    time : float, [s]
    side : str
        ``left`` or ``right``.
    strike : bool
        Whether the heel meets the ground; else the toes leave it.
    """

    time: float
    side: str
    strike: bool


def foot_events(gait: Gait, end: float) -> tuple[FootEvent, ...]:
    """Return what the feet do from left heel strike, t = 0, to `end` [s], in the order of time.

    The foot that strikes takes over; the other one leaves the ground where double support ends.
    """
    found, step, rounding = list[FootEvent](), 0, 1e-9
    while (start := step * gait.step_time) <= end + rounding:
        leading, trailing = _LEADING[step % 2], _LEADING[1 - step % 2]
        found.append(FootEvent(start, leading, strike=True))
        off = start + gait.scenario.phases.double_support * gait.step_time
        if off <= end + rounding:
            found.append(FootEvent(off, trailing, strike=False))
        step += 1
    return tuple(found)
