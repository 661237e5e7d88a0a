"""Sensitivities and lines of all outputs of a study, as the page shows them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.findings.columns import Column
from human_gait.findings.regression import line_through, terms
from human_gait.findings.rows import FOUND, Rows
from human_gait.findings.sensitivity import classes, share_of


def what_matters(rows: Rows, outputs: Sequence[Column]) -> dict[str, Any]:
    """Return shares of variance and straight lines, by output; whether there is a walk is one.

    Walks where an output or a setting has no number are left out, and the rest is counted.
    """
    causes = [one for one in rows.settings if one.name in rows.causes]
    whole = np.all([~np.isnan(one.values) for one in causes], axis=0) if causes else rows.found
    found: dict[str, Any] = {
        FOUND: _both(rows.found.astype(float), np.flatnonzero(whole), causes, {})
    }
    kept: dict[bytes, Any] = {}  # what walks have in common, by which they are
    for one in outputs:
        if not one.words:
            there = np.flatnonzero(whole & rows.found & ~np.isnan(one.values))
            found[one.name] = _both(one.values, there, causes, kept)
    return found


def _both(
    values: FloatArray, there: IntArray, causes: Sequence[Column], kept: dict[bytes, Any]
) -> dict[str, Any]:
    if not len(there):
        return {"n": 0, "shares": [], "line": None, "tied": None}
    same = there.tobytes()
    if same not in kept:
        given = terms(causes, there)
        kept[same] = [classes(one, there) for one in causes], given, _tied(given)
    places, given, tied = kept[same]
    output = values[there]
    shares = [share_of(output, place, one.name) for place, one in zip(places, causes, strict=True)]
    line = line_through(output, given)
    return {
        "n": len(there),
        "shares": sorted(
            (asdict(share) for share in shares if share), key=lambda one: -one["share"]
        ),
        "line": asdict(line) if line else None,
        "tied": tied,
    }


def _tied(given: Sequence[tuple[str, str, FloatArray]]) -> dict[str, Any] | None:
    """Return the two settings that go together most, and their correlation."""
    if len({setting for setting, *_ in given}) < 2 or len(given[0][2]) < 3:
        return None
    r = np.atleast_2d(np.corrcoef(np.stack([x for *_, x in given])))
    apart = np.array([[a != b for b, *_ in given] for a, *_ in given])
    one, other = map(int, np.unravel_index(np.argmax(np.abs(r) * apart), r.shape))
    return {"one": given[one][0], "other": given[other][0], "r": float(r[one, other])}
