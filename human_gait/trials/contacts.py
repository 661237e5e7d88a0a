"""When a force plate carries a foot: the one answer for cycles and for measured forces."""

from __future__ import annotations

import numpy as np

from human_gait.arrays import BoolArray, FloatArray
from human_gait.trials.recording import Plate

LOADED = 20.0
"""Vertical force of a foot that is said to stand, [N]."""

NOTHING = 1.0
"""Vertical force below which a stance begins and ends, [N]."""

_GAP, _SHORTEST = 0.05, 0.1  # [s] in the air, and on the ground; what is shorter is noise


def contacts(plate: Plate) -> list[BoolArray]:
    """Return when a plate carries a foot, (n,) each; no sample is in two of them.

    That is while it carries more than `LOADED`, and before and after as long as the force rises
    from next to nothing and falls to it: what an empty plate shows goes up and down. A sample
    between two contacts is of the one before.
    """
    up = plate.force[:, 1]
    on_it = standing(plate.time, up > LOADED)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], on_it.astype(int), [0]])))
    found, last = [], 0
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        first, before = int(begin), last
        last = int(end)
        while first > before and NOTHING < up[first - 1] < up[first]:
            first -= 1
        while last < len(up) and NOTHING < up[last] < up[last - 1]:
            last += 1
        on = np.zeros(len(up), dtype=bool)
        on[first:last] = True
        found.append(on)
    return found


def standing(time: FloatArray, loaded: BoolArray) -> BoolArray:
    """Return when a foot stands, (n,), without gaps and contacts that are too short to be any."""
    result = loaded.copy()
    for what, shortest in ((False, _GAP), (True, _SHORTEST)):
        edges = np.flatnonzero(np.diff(result)) + 1
        starts, ends = np.r_[0, edges], np.r_[edges, len(result)]
        for start, end in zip(starts, ends, strict=True):
            inner = start > 0 and end < len(result)
            if inner and result[start] == what and time[end] - time[start] < shortest:
                result[start:end] = not what
    return result
