"""One page about one or several results, for reading, projecting and printing.

The page is a single file that loads nothing: figures are SVG in it, and the walks move in a page
within it, made anew from the gaits. What a reader wants to know first stands first, what is about
the solver comes last.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import tomli_w
from jinja2 import Environment, StrictUndefined

from human_gait.exceptions import ResultError
from human_gait.people.reference import references_near, tuned_by
from human_gait.playback.page import page_marks, page_of
from human_gait.playback.still import still_address
from human_gait.reporting import (
    check_tables,
    energy_tables,
    key_numbers,
    panels,
    people_tables,
    tables,
)
from human_gait.reporting.figures import ENERGY_GROUPS, GROUPS, RESULTS
from human_gait.reporting.results import Result, read_results
from human_gait.results.folder import whole_file
from human_gait.results.names import REPORT
from human_gait.results.ours import check_free
from human_gait.walk.described import no_walk
from human_gait.walk.measured import was_measured

_STARTS = {  # what the command cannot say
    "warm start": "It started from the walk of another result (--warm-from DIR), whose name is not "
    "recorded; without it the same walk is found but for rounding, or one that is as cheap.",
    "given start": "It started from a motion that was given (refine, or predict --solver all); "
    "the command starts from a guess of its own.",
}


_FITTED = "With the options that it was fitted with, which are not recorded."


@dataclass(frozen=True)
class Recipe:
    """How to make a result again."""

    label: str
    file: str
    scenario: str
    command: str
    note: str
    versions: tuple[str, ...]


def report_to_file(folders: Sequence[Path], out: Path | None = None) -> Path:
    """Write the report of results and return its path.

    Parameters
    ----------
    folders : sequence of Path
        Result folders, in the order in which they are shown; the first is what others are compared
        with.
    out : Path, optional
        The file, else ``report.html`` in the folder of a single result, ``out/report.html`` of
        several.

    Raises
    ------
    ResultError
        If a folder is no result, or there are too many, or the file cannot be written.
    """
    target = out or (folders[0] if len(folders) == 1 else Path("out")) / REPORT
    page = report_page(folders)
    if out is None:
        check_free(target.parent, [target.name])
    with whole_file(target) as path:
        path.write_text(page, encoding="utf-8")
    return target


def report_page(folders: Sequence[Path]) -> str:
    """Return the report of results as HTML.

    Parameters
    ----------
    folders : sequence of Path

    Raises
    ------
    ResultError
        If a folder is no result, or there are too many.
    """
    if not 0 < len(folders) <= len(RESULTS):
        message = f"a report has room for 1 to {len(RESULTS)} results, not {len(folders)}"
        raise ResultError(message)
    results = read_results(folders)
    view = _view(results)
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    text = (files(__package__) / "report.html.jinja").read_text(encoding="utf-8")
    page = environment.from_string(text).render(view)
    return page.encode("utf-8", "backslashreplace").decode("utf-8")  # names of folders may be bytes


def _view(results: Sequence[Result]) -> dict[str, Any]:
    """Return all that the template shows."""
    measured = references_near(results[0].gait.scenario.walk.speed)
    compared = [one for one in results if one.comparison]
    gaits, labels = [one.gait for one in results], [one.label for one in results]
    return {
        **page_marks(gaits),
        "results": results,
        "no_walk": no_walk,
        "was_measured": was_measured,
        "tuned_on": tuned_by(*gaits),
        "title": ", ".join(labels),
        "tables": tables,
        "check_tables": check_tables,
        "people_tables": people_tables,
        "compared": compared,
        "sentences": key_numbers.sentences(results),
        "key_numbers": key_numbers.key_numbers(results),
        "playback": page_of(gaits, called=labels),
        "still": still_address(gaits, labels),
        "groups": list(panels.curves(results, measured, GROUPS)),
        "energy_groups": list(panels.curves(results, measured, ENERGY_GROUPS)),
        "energy_tables": energy_tables,
        "pictures": list(panels.pictures(results)),
        "measured": measured,
        "recipes": list(map(_recipe, results)),
    }


# How to make it again


def _recipe(one: Result) -> Recipe:
    scenario, outcome = one.gait.scenario, one.outcome
    packages = tuple(f"{package}=={version}" for package, version in outcome.versions.items())
    if found := was_measured(one.gait):
        given = " ".join(map(shlex.quote, found["files"]))
        return Recipe(one.label, "", "", f"human-gait fit {given}", _FITTED, packages)
    file = f"{scenario.name}.toml"
    options = f"--solver {outcome.first_solver} --dynamics {outcome.dynamics} --seed {outcome.seed}"
    folder = shlex.quote(f"out/{scenario.name}")
    return Recipe(
        one.label,
        file,
        tomli_w.dumps(scenario.to_dict()),
        f"human-gait predict {shlex.quote(file)} {options} --out {folder}",
        _STARTS.get(outcome.trials[0].start if outcome.trials else "", ""),
        packages,
    )
