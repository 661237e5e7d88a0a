"""The page of a study: one file that loads nothing, for reading, sending and printing.

It carries the numbers of all walks, as many columns as there is room for, and draws from them what
the reader chooses. What needs statistics is worked out here: sensitivities, lines, bands of curves.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
import numpy as np
from markupsafe import Markup

from human_gait.findings.columns import Column
from human_gait.findings.curves import curve_data
from human_gait.findings.heading import heading
from human_gait.findings.matters import what_matters
from human_gait.findings.packing import cost, encoded, packed_values
from human_gait.findings.rows import Rows, read_rows
from human_gait.findings.walkers import chosen, walker_data
from human_gait.playback.policy import content_policy
from human_gait.results.folder import whole_file
from human_gait.results.names import REPORT
from human_gait.results.ours import check_free, given_path
from human_gait.studies.limits import Limit, parse_limits
from human_gait.studies.opened import open_study

if TYPE_CHECKING:
    from human_gait.studies.opened import Study

SCRIPTS = (
    *("data.js", "draw.js", "choices.js", "map.js", "bands.js", "limits.js", "front.js"),
    *("matters.js", "curves.js", "walker.js", "tables.js", "main.js"),
)
"""Our scripts, in one element in this order."""

ROOM = 7_000_000
"""Characters of the page that columns may take."""

_EXACT = 20_000  # walks whose numbers are carried with 24 bits, and their keys
_AHEAD = 12  # outputs whose extremes are among the walks that move


def study_report(
    folder: str | Path, limits: Sequence[str] = (), out: str | Path | None = None
) -> Path:
    """Write the page of a study and return its path.

    Parameters
    ----------
    folder : str or Path
        Of a study.
    limits : sequence of str
        What is to be kept, such as ``"knee_extension_peak < 1.0"``, in the units of the index; the
        page tells which walks exceed it; else those that the study file gives.
    out : str or Path, optional
        The file, HTML; else ``report.html`` in the folder.

    Returns
    -------
    Path

    Raises
    ------
    GaitError
        If a limit is about no number of the study.
    ResultError
        If there is no study, or the file cannot be written.
    """
    place = given_path(folder)
    target = place / REPORT if out is None else given_path(out)
    page = study_page(open_study(place), limits)
    if out is None:
        check_free(target.parent, [target.name])
    with whole_file(target) as path:
        path.write_text(page, encoding="utf-8")
    return target


def study_page(study: Study, limits: Sequence[str] = ()) -> str:
    """Return the page of a study as HTML; the parameters are those of `study_report`."""
    rows = read_rows(study)
    asked = parse_limits([*limits] or study.limits, rows.numbers())
    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    data = page_data(study, rows, asked)
    page = environment.from_string(_text("findings.html.jinja")).render(
        policy=content_policy(_scripts()),
        generator=f"human-gait {version('human-gait')}",
        rows=rows,
        head=heading(rows, len(data["walkers"]["rows"]), len(data["left"])),
        style=Markup(_text("findings.css")),
        data=data,
        scripts=[Markup(script) for script in _scripts()],
    )
    return page.encode("utf-8", "backslashreplace").decode("utf-8")  # names of folders may be bytes


@cache
def _scripts() -> tuple[str, ...]:
    return ("".join(map(_text, SCRIPTS)),)


def _text(name: str) -> str:
    return (files(__package__) / name).read_text(encoding="utf-8")


def page_data(study: Study, rows: Rows, limits: Sequence[Limit]) -> dict[str, Any]:
    """Return all that the scripts of the page read."""
    exact = len(rows) <= _EXACT
    shown = _with_room(rows, [limit.name for limit in limits], exact)
    outputs = [one for one in shown if not one.setting]
    walkers = chosen(rows, [one.name for one in outputs[:_AHEAD]])
    with ThreadPoolExecutor(1) as beside:  # reading curves is little of Python
        curves = beside.submit(curve_data, study, rows, walkers)
        moving = walker_data(study, rows, walkers)
        cycles = curves.result()
    return {
        "study": rows.name,
        "folder": shlex.quote(str(rows.folder)),
        "n": len(rows),
        "people": rows.people,
        "causes": rows.causes,
        "columns": [_packed(one, exact) for one in shown],
        "left": [one.name for one in (*rows.settings, *rows.outputs) if one not in shown],
        "success": encoded(rows.found, "u1"),
        "reasons": rows.reasons,
        "diagnoses": rows.diagnoses,
        "reason": encoded(np.where(rows.reason < 0, 255, np.minimum(rows.reason, 254)), "u1"),
        "keys": rows.keys if exact else [],
        "walkerKeys": [] if exact else [rows.keys[k] for k in moving["rows"]],
        "limits": [asdict(limit) for limit in limits],
        "walkers": moving,
        "cycles": cycles,
        "matters": what_matters(rows, outputs),
        "exact": exact,
    }


def _with_room(rows: Rows, needed: Sequence[str], exact: bool) -> list[Column]:
    """Return the columns that the page carries: settings, what is needed, then outputs in order."""
    first = list(dict.fromkeys([*rows.settings, *map(rows.column, needed)]))
    room, found = ROOM, []
    for one in dict.fromkeys([*first, *rows.outputs]):
        room -= cost(one, exact)
        if one in first or room > 0:
            found.append(one)
    return found


def _packed(one: Column, exact: bool) -> dict[str, Any]:
    return {
        "name": one.name,
        "label": one.label,
        "meaning": one.meaning,
        "unit": one.unit,
        "setting": one.setting,
        "words": one.words,
        **packed_values(one, exact),
    }
