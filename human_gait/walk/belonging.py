"""Do the files of a result folder belong to its gait? Each is held against ``gait.npz``.

Files written since they carry the digest of their gait (`gait_digest`) are held against that; what
is also told by the gait, such as the cost, the speed or the gait cycle, is compared number by
number, whatever the age of the file.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from human_gait.exceptions import ResultError, ScenarioError, shown
from human_gait.results.archive import opened, text
from human_gait.results.names import (
    COMPARISON_JSON,
    COMPARISON_PNG,
    EXPLANATION,
    EXPORT,
    EXPORTED,
    FILMS,
    GAIT_CYCLE,
    GAIT_FILE,
    MULTIPLIERS,
    PLAYBACK,
    PLOTS,
    REPORT,
    SUMMARY,
    VERIFICATION,
)
from human_gait.results.reading import AGAIN, LARGEST, read_json, read_regular
from human_gait.results.sealed import MARK, digest_of
from human_gait.results.shapes import ASKED, FOUND, GAITS, Maybe, Shape
from human_gait.scenario import Scenario
from human_gait.walk.described import gait_digest
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import gait_cycle, load_gait_cycle
from human_gait.walk.gait_file import load_gait

GAIT_MEMBER = "__gait__"
"""Of ``multipliers.npz``: the digest of the gait that they belong to."""

_NEAR = 2**16  # bytes from the start or the end of a file in which its digest is
_MARK = re.compile(rb"(?:\b|tEXt)" + MARK)
_CLOSE = 1e-6  # of the largest number of a curve: the table has nine digits
_TOLD: Mapping[str, Shape] = {
    **GAITS,
    **ASKED,
    **{key: Maybe(shape) for key, shape in FOUND.items()},
    **dict.fromkeys(("solver", "solver_status"), Maybe(str)),
    "cost": Maybe(float),
}
_OTHERS = f"is of another walk than {GAIT_FILE} beside it"


def own_gait(folder: Path, but: Collection[str] = ()) -> Gait:
    """Read the gait of a result folder whose files all belong to it.

    Parameters
    ----------
    folder : Path
    but : collection of str
        Files that need not belong: they are about to be replaced.

    Raises
    ------
    ResultError
        If there is no gait that can be read, or a file beside it is damaged, was changed, or is of
        another walk.
    """
    gait = load_gait(folder)
    for name, wrong in strangers(gait, folder, but):
        help_ = "" if AGAIN in wrong else f": {AGAIN}, or see human-gait verify {folder}"
        raise ResultError(f"{folder / name}: {wrong}{help_}")
    return gait


def strangers(gait: Gait, folder: Path, but: Collection[str] = ()) -> Iterator[tuple[str, str]]:
    """Yield what does not belong to the gait of a folder: each file, and what is wrong with it."""
    for name, look in _LOOKS.items():
        if name not in but and (folder / name).exists():
            try:
                wrong = look(folder / name, gait)
            except ResultError as error:
                wrong = str(error).removeprefix(f"{folder / name}: ")
            if wrong:
                yield name, wrong


def multipliers_belong(file: Mapping[str, Any], gait: Gait) -> bool:
    """Tell whether the multipliers of an archive are those of a gait, as far as it says."""
    return GAIT_MEMBER not in file or text(file, GAIT_MEMBER) == gait_digest(gait)


def _of_summary(path: Path, gait: Gait) -> str:
    found = read_json(path, _TOLD)
    return _of_another(found, gait) or _contradiction(found, gait)


def _contradiction(summary: Mapping[str, Any], gait: Gait) -> str:
    """Return what a summary says otherwise than the gait; nothing if they agree."""
    scenario, solution = gait.scenario, gait.solution
    asked = {
        "walking_speed_m_per_s": scenario.walk.speed,
        "step_length_m": scenario.walk.step_length,
        "body_mass_kg": scenario.subject.mass,
        "load_kg": scenario.load.mass,
    }
    names = {"cost": "cost", "solver": "solver", "solver_status": "status"}
    names |= {key: key for key in FOUND}
    known = asked | {key: solution[name] for key, name in names.items() if name in solution}
    for key, value in known.items():
        if key in summary and summary[key] != value:
            return f"{key} = {shown(summary[key])}, but {GAIT_FILE} says {shown(value)}"
    told = summary.get("scenario")
    return "" if told is None or _is_of(told, scenario) else f"its scenario {_OTHERS}"


def _is_of(table: Mapping[str, Any], scenario: Scenario) -> bool:
    try:
        return Scenario.from_record(table).own_table() == scenario.own_table()
    except ScenarioError:
        return False


def _of_explanation(path: Path, gait: Gait) -> str:
    found = read_json(path, {**GAITS, "cost": Maybe(float), "step_time_s": Maybe(float)})
    known = {"cost": gait.solution.get("cost"), "step_time_s": gait.step_time}
    for key, value in known.items():
        told = found.get(key)
        if told is not None and value is not None and not np.isclose(told, value, rtol=1e-12):
            return f"{key} = {shown(told)}, but {GAIT_FILE} says {shown(value)}"
    return _of_another(found, gait)


def _of_json(path: Path, gait: Gait) -> str:
    found = read_json(path, GAITS)
    for name, digest in (found.get("files") or {}).items():
        beside = path.parent / Path(name).name
        if beside.is_file() and digest_of(_content(beside)) != digest:
            return f"{beside.name} beside it was changed, or is of another walk"
    return _of_another(found, gait)


def _of_another(found: Mapping[str, Any], gait: Gait) -> str:
    told = found.get("gait")
    return "" if told is None or told == gait_digest(gait) else _OTHERS


def _of_cycle(path: Path, gait: Gait) -> str:
    found, right = load_gait_cycle(path), gait_cycle(gait)
    for name, read in found.items():  # an older version wrote fewer
        curve = right[name]
        if np.abs(read - curve).max() > _CLOSE * max(np.abs(curve).max(), 1e-3):
            return f"{name} is not that of {GAIT_FILE} beside it"
    return ""


def _of_multipliers(path: Path, gait: Gait) -> str:
    with opened(path, "multipliers") as file:
        return "" if multipliers_belong(file, gait) else _OTHERS


def _by_mark(path: Path, gait: Gait) -> str:
    """Look for the digest that pictures, pages, films and exports carry."""
    content = _content(path)
    found = _MARK.findall(content[:_NEAR] + b" " + content[-_NEAR:])
    return _OTHERS if found and gait_digest(gait).encode() not in found else ""


def _content(path: Path) -> bytes:
    try:
        return read_regular(path, LARGEST)
    except OSError as error:
        raise ResultError(f"{path}: cannot be read: {error.strerror or error}") from None


_LOOKS: Mapping[str, Callable[[Path, Gait], str]] = {
    SUMMARY: _of_summary,
    EXPLANATION: _of_explanation,
    GAIT_CYCLE: _of_cycle,
    MULTIPLIERS: _of_multipliers,
    VERIFICATION: _of_json,
    COMPARISON_JSON: _of_json,
    **dict.fromkeys((COMPARISON_PNG, *PLOTS, PLAYBACK, REPORT, *FILMS), _by_mark),
    **dict.fromkeys((f"{EXPORT}/{name}" for name in EXPORTED), _by_mark),
}
"""What each file is held against the gait by; ``compare.csv`` by ``compare.json`` beside it."""
