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
from human_gait.results.sealed import digest_of
from human_gait.results.shapes import ASKED, FOUND, GAITS, NUMBER, Maybe, Shape
from human_gait.scenario import Scenario
from human_gait.walk.described import gait_digest
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import gait_cycle, load_gait_cycle
from human_gait.walk.gait_file import load_gait

GAIT_MEMBER = "__gait__"
"""Of ``multipliers.npz``: the digest of the gait that they belong to."""

_HEAD = 8192  # bytes at the start of pictures and pages, where their digest is
_IN_PICTURE = re.compile(rb"tEXtgait\0([0-9a-f]{16})")
_IN_PAGE = re.compile(rb'<meta name="gait" content="([0-9a-f]{16})">')
_CLOSE = 1e-6  # of the largest number of a curve: the table has nine digits
_TOLD: Mapping[str, Shape] = {
    **GAITS,
    **ASKED,
    **{key: Maybe(shape) for key, shape in FOUND.items()},
    **dict.fromkeys(("solver", "solver_status"), Maybe(str)),
    "cost": NUMBER,
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
    for complaint in strangers(gait, folder, but):
        raise ResultError(complaint)
    return gait


def strangers(gait: Gait, folder: Path, but: Collection[str] = ()) -> Iterator[str]:
    """Yield what does not belong to the gait of a folder: each file, and what is wrong with it."""
    for name, look in _LOOKS.items():
        if name not in but and (folder / name).exists():
            try:
                wrong = look(folder / name, gait)
            except ResultError as error:
                yield str(error)
            else:
                if wrong:
                    yield f"{folder / name}: {wrong}: {AGAIN}, or see human-gait verify {folder}"


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
        return Scenario.from_dict(table).own_table() == scenario.own_table()
    except ScenarioError:
        return False


def _of_explanation(path: Path, gait: Gait) -> str:
    found = read_json(path, {**GAITS, "cost": NUMBER, "step_time_s": NUMBER})
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
        if beside.is_file() and digest_of(_start(beside, LARGEST)) != digest:
            return f"{beside.name} beside it was changed, or is of another walk"
    return _of_another(found, gait)


def _of_another(found: Mapping[str, Any], gait: Gait) -> str:
    told = found.get("gait")
    return "" if told is None or told == gait_digest(gait) else _OTHERS


def _of_cycle(path: Path, gait: Gait) -> str:
    found, right = load_gait_cycle(path), gait_cycle(gait)
    for name, curve in right.items():
        if np.abs(found[name] - curve).max() > _CLOSE * max(np.abs(curve).max(), 1e-3):
            return f"{name} is not that of {GAIT_FILE} beside it"
    return ""


def _of_multipliers(path: Path, gait: Gait) -> str:
    with opened(path, "multipliers") as file:
        return "" if multipliers_belong(file, gait) else _OTHERS


def _of_picture(path: Path, gait: Gait) -> str:
    return _marked(_IN_PICTURE, path, gait)


def _of_page(path: Path, gait: Gait) -> str:
    return _marked(_IN_PAGE, path, gait)


def _marked(mark: re.Pattern[bytes], path: Path, gait: Gait) -> str:
    found = mark.findall(_start(path, _HEAD))
    return _OTHERS if found and gait_digest(gait).encode() not in found else ""


def _start(path: Path, most: int) -> bytes:
    try:
        return read_regular(path, most)
    except OSError as error:
        raise ResultError(f"{path}: cannot be read: {error.strerror or error}") from None


_LOOKS: Mapping[str, Callable[[Path, Gait], str]] = {
    SUMMARY: _of_summary,
    EXPLANATION: _of_explanation,
    GAIT_CYCLE: _of_cycle,
    MULTIPLIERS: _of_multipliers,
    VERIFICATION: _of_json,
    COMPARISON_JSON: _of_json,
    COMPARISON_PNG: _of_picture,
    **dict.fromkeys(PLOTS, _of_picture),
    **dict.fromkeys((PLAYBACK, REPORT), _of_page),
}
"""What each file is held against the gait by; ``compare.csv`` by ``compare.json`` beside it."""
