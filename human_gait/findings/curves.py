"""Curves of the gait cycle over many walks: mean and percentiles, of all and by group."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from human_gait.arrays import IntArray
from human_gait.findings.columns import Column
from human_gait.findings.packing import encoded, in_steps
from human_gait.findings.rows import Rows
from human_gait.walk.gait_cycle import COLUMNS, label_and_unit

if TYPE_CHECKING:
    from human_gait.studies.opened import Study

MOST = 3000
"""Walks that bands are made of; of more an even sample, drawn at random."""

PERCENTILES = (5, 25, 50, 75, 95)
_EVERY = 2  # per cent of the cycle
_CURVES = COLUMNS[1:]
_GROUPS = 4  # of a setting; of more values three of equal size
_GROUPINGS = 8


@dataclass(frozen=True, eq=False)
class Group:
    """Walks that have something in common.

    Attributes
    ----------
    label : str
    rows : (m,) int array
    """

    label: str
    rows: IntArray


def cycles_of(study: Study, rows: Rows, wanted: IntArray) -> Any:
    """Return the curves of some walks, (m, 19, 51), every second per cent."""
    read = study.cycles([rows.keys[k] for k in wanted], list(_CURVES))
    return np.stack([np.asarray(read[name])[:, ::_EVERY] for name in _CURVES], axis=1)


def sample(rows: Rows) -> IntArray:
    """Return the rows of the walks that bands are made of, in order."""
    there = np.flatnonzero(rows.found)
    if len(there) <= MOST:
        return there
    return np.sort(np.random.default_rng(0).choice(there, MOST, replace=False))


def groupings(rows: Rows, among: IntArray) -> Iterator[tuple[str, list[Group]]]:
    """Yield the settings that walks can be grouped by, and their groups."""
    for setting in rows.settings[:_GROUPINGS]:
        found = _grouped(setting, among)
        if len(found) > 1:
            yield setting.name, found


def _grouped(setting: Column, among: IntArray) -> list[Group]:
    values = setting.values[among]
    levels = np.unique(values[~np.isnan(values)])
    unit = f" {setting.unit}" if setting.unit else ""
    if len(levels) <= _GROUPS:
        return [Group(_level(setting, x, unit), among[values == x]) for x in levels]
    ends = np.unique(np.quantile(values[~np.isnan(values)], [0, 1 / 3, 2 / 3, 1]))
    place = np.searchsorted(ends[1:-1], values, side="right")
    return [
        Group(f"{low:.4g} to {high:.4g}{unit}", among[place == k])
        for k, (low, high) in enumerate(pairwise(ends))
        if np.any(place == k)
    ]


def _level(setting: Column, value: float, unit: str) -> str:
    return setting.words[int(value)] if setting.words else f"{value:.4g}{unit}"


def bands(curves: Any) -> Any:
    """Return mean and `PERCENTILES` of curves (m, 19, 51), as (6, 19, 51); NaN where m is 0."""
    whole = curves[~np.isnan(curves[:, 0, 0])]
    if not len(whole):
        return np.full((1 + len(PERCENTILES), *curves.shape[1:]), np.nan)
    ordered = np.sort(whole.transpose(1, 2, 0).copy(), axis=-1)  # each along memory: much quicker
    place = np.array(PERCENTILES) / 100 * (len(whole) - 1)
    below = np.floor(place).astype(int)
    above = np.minimum(below + 1, len(whole) - 1)
    between = ordered[..., below] + (place - below) * (ordered[..., above] - ordered[..., below])
    return np.concatenate([whole.mean(axis=0)[None], np.moveaxis(between, -1, 0)])


def curve_data(study: Study, rows: Rows, shown: IntArray) -> dict[str, Any]:
    """Return all that the page says of curves: bands of all and by group, and those of `shown`."""
    among = sample(rows)
    if not len(among):
        return {"n": 0}
    wanted = np.union1d(among, shown)  # read once: a file of many walks takes seconds
    read = cycles_of(study, rows, wanted)
    every, own = (read[np.searchsorted(wanted, part)] for part in (among, shown))
    scales = _scales(every, own)
    place = {int(row): k for k, row in enumerate(among)}

    def told(group: Group) -> dict[str, Any]:
        inside = every[[place[int(row)] for row in group.rows]]
        n = int(np.sum(~np.isnan(inside[:, 0, 0])))
        return {"label": group.label, "n": n, "bands": _in_codes(bands(inside), scales)}

    return {
        "n": len(among),
        "of": int(rows.found.sum()),
        "points": every.shape[2],
        "curves": [_about(name, *scale) for name, scale in zip(_CURVES, scales, strict=True)],
        "all": told(Group("all walks", among)),
        "groups": {
            name: [told(group) for group in found] for name, found in groupings(rows, among)
        },
        "rows": shown.tolist(),
        "own": _in_codes(own, scales),
    }


def _about(name: str, low: float, step: float) -> dict[str, Any]:
    label, unit = label_and_unit(name)
    return {
        "name": name,
        "label": label[:1].upper() + label[1:],
        "unit": unit,
        "low": low,
        "step": step,
    }


def _scales(*several: Any) -> list[tuple[float, float]]:
    """Return lowest value and step of the codes of each curve."""
    return [
        in_steps(np.concatenate([curves[:, k].ravel() for curves in several]))[1:]
        for k in range(len(_CURVES))
    ]


def _in_codes(curves: Any, scales: Sequence[tuple[float, float]]) -> str:
    low, step = (np.array(part)[:, None] for part in zip(*scales, strict=True))
    codes = np.rint((curves - low) / step)
    return encoded(np.where(np.isnan(codes), 65535, codes), "<u2")
