"""What stands first on the page of a study: what was varied, how many walks, what failed."""

from __future__ import annotations

from typing import Any

import numpy as np

from human_gait.findings.columns import Column
from human_gait.findings.rows import Rows

_FEW = 20  # walks of which percentiles are rough
_SHOWN = 8  # values that are listed
_SPACE, _DASH = "\N{NO-BREAK SPACE}", "\N{EN DASH}"
_EXAMPLE = 300  # signs of a diagnosis


def heading(rows: Rows, moving: int, left: int) -> dict[str, Any]:
    """Return what the head of the page shows.

    Parameters
    ----------
    rows : Rows
    moving : int
        Walks that move in the page.
    left : int
        Outputs for which it has no room.
    """
    found, lost = int(rows.found.sum()), int(np.sum(~rows.found))
    return {
        "facts": _facts(rows, found, lost),
        "warnings": _warnings(found, lost),
        "varied": [_varied(one) for one in rows.settings if one.name in rows.causes],
        "follow": [one.label.lower() for one in rows.settings if one.name not in rows.causes],
        "lost": [_lost(rows, k, lost) for k in range(len(rows.reasons))],
        "lost_said": f"{_counted(lost, 'walk')} of {_spaced(len(rows))} "
        f"({_share(lost, len(rows))}) {'was' if lost == 1 else 'were'} not found.",
        "notes": _notes(rows, found, moving, left),
    }


def _facts(rows: Rows, found: int, lost: int) -> list[dict[str, str]]:
    some = rows.seconds[np.isfinite(rows.seconds)]
    each = f"{np.median(some):.3g} s each" if len(some) else ""
    facts = [
        ("walks", _spaced(len(rows)), _people(rows), ""),
        ("found and verified", _spaced(found), _share(found, len(rows)), "good"),
        ("not found", _spaced(lost), _share(lost, len(rows)), "bad" if lost else ""),
        ("computing time", _duration(float(some.sum())), each, ""),
    ]
    return [dict(zip(("name", "value", "more", "mark"), fact, strict=True)) for fact in facts]


def _people(rows: Rows) -> str:
    if not rows.people:
        return ""
    count = len(np.unique(rows.persons[~np.isnan(rows.persons)]))
    return f"of {_counted(count, 'person').replace('persons', 'people')}" if count else "of people"


def _warnings(found: int, lost: int) -> list[str]:
    if not found:
        return ["No walk was found: there is nothing to draw but where they failed, and why."]
    told = []
    if found < _FEW:
        told.append(
            f"Only {_counted(found, 'walk')} {'was' if found == 1 else 'were'} found: "
            "percentiles, shares and intervals of so few are rough."
        )
    if lost > found:
        told.append(
            "More walks failed than were found: what is shown is of those that can be walked, "
            "and no picture of the whole that was asked for."
        )
    return told


def _varied(one: Column) -> tuple[str, ...]:
    unit = f"{_SPACE}{one.unit}" if one.unit else ""
    name = one.label
    levels = one.levels(_SHOWN)
    some = one.values[~np.isnan(one.values)]
    if one.words:
        return name, _DASH, _DASH, ", ".join(one.words[:_SHOWN]), one.meaning
    ends = (f"{x:.4g}{unit}" for x in (some.min(), some.max()))
    listed = ", ".join(f"{x:.4g}" for x in levels) if levels is not None else ""
    return name, *ends, listed or f"{_spaced(len(np.unique(some)))} values", one.meaning


def _lost(rows: Rows, k: int, lost: int) -> tuple[str, ...]:
    count = int(np.sum(rows.reason == k))
    example = rows.diagnoses[k]
    shown = example if len(example) <= _EXAMPLE else f"{example[:_EXAMPLE]}..."
    return rows.reasons[k], _spaced(count), _share(count, lost), shown or _DASH


def _notes(rows: Rows, found: int, moving: int, left: int) -> list[str]:
    notes = [
        (
            "Every walk that counts as found is optimal and passed all checks. Those that were not "
            "found have no numbers: they are counted wherever they would have been, and averaged "
            "nowhere."
        ),
        f"{_spaced(moving)} of {_spaced(found)} walks move in the page"
        + (", chosen so that they lie all over the settings." if moving < found else "."),
        "In Python: hg.open_study(DIR).to_dataframe() has all rows and columns with all digits.",
    ]
    if left:
        notes.append(
            f"{_counted(left, 'further output')} of the index had no room here; numbers here "
            "are kept to 1/65,534 of their range, so that a walk that is so near a limit may be "
            "counted on either side."
        )
    same = [one.label.lower() for one in rows.constant if not one.setting]
    if same:
        more = f" and {len(same) - _SHOWN} more" if len(same) > _SHOWN else ""
        shown = ", ".join(same[:_SHOWN])
        notes.append(f"The same in all walks, or in none, and left out: {shown}{more}.")
    return notes


def _spaced(count: int) -> str:
    return f"{count:,}".replace(",", "\N{NARROW NO-BREAK SPACE}") if count > 9999 else str(count)


def _counted(count: int, noun: str) -> str:
    return f"{_spaced(count)} {noun}{'' if count == 1 else 's'}"


def _share(part: int, whole: int) -> str:
    return f"{100 * part / whole:.3g}{_SPACE}%" if whole else _DASH


def _duration(seconds: float) -> str:
    for size, unit in ((86400, "days"), (3600, "h"), (60, "min")):
        if seconds >= 2 * size:
            return f"{seconds / size:.3g}{_SPACE}{unit}"
    return f"{seconds:.3g}{_SPACE}s"
