"""One page about one or several results, for reading, projecting and printing.

The page is a single file that loads nothing: figures are SVG in it. The animation of one result is
in it, too, made anew from the gait; the page of several results has links to their files.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote

import tomli_w
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from human_gait.exceptions import ResultError
from human_gait.people.reference import Reference, references_near
from human_gait.pictures.plots import stick_diagram, zmp
from human_gait.playback.page import playback_page
from human_gait.reporting import tables
from human_gait.reporting.figures import GROUPS, MEASURED, RESULTS, Line, curve_panel, styled, svg
from human_gait.reporting.figures import variable as colour_variable
from human_gait.reporting.results import PLAYBACK, Result, read_results
from human_gait.results.folder import whole_file
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import label_and_unit

FILE = "report.html"

_STARTS = {  # what the command cannot say
    "warm start": "It started from the walk of another result (--warm-from DIR), whose name is not "
    "recorded; without it the same walk is found but for rounding, or one that is as cheap.",
    "given start": "It started from a motion that was given (refine, or predict --solver all); "
    "the command starts from a guess of its own.",
}


@dataclass(frozen=True)
class Picture:
    """A figure of the page: an SVG element and what is written with it."""

    title: str
    svg: Markup


@dataclass(frozen=True)
class Key:
    """An entry of the legend: a line or a band in a colour of the style sheet."""

    label: str
    colour: str
    dashes: str = ""
    band: bool = False


@dataclass(frozen=True)
class Curves:
    """Panels under one heading, with their legend; `phases` tells whether these are marked."""

    heading: str
    legend: tuple[Key, ...]
    panels: tuple[Picture, ...]
    phases: bool


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
    target = out or (folders[0] if len(folders) == 1 else Path("out")) / FILE
    page = report_page(folders, target)
    with whole_file(target) as path:
        path.write_text(page, encoding="utf-8")
    return target


def report_page(folders: Sequence[Path], target: Path = Path(FILE)) -> str:
    """Return the report of results as HTML.

    Parameters
    ----------
    folders : sequence of Path
    target : Path
        Where the page will be: the links to the animations start from there.

    Raises
    ------
    ResultError
        If a folder is no result, or there are too many.
    """
    if not 0 < len(folders) <= len(RESULTS):
        message = f"a report has room for 1 to {len(RESULTS)} results, not {len(folders)}"
        raise ResultError(message)
    results = read_results(folders)
    view = _view(results, target)
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    text = (files("human_gait.data") / "report.html.jinja").read_text(encoding="utf-8")
    return environment.from_string(text).render(view)


def _view(results: Sequence[Result], target: Path) -> dict[str, Any]:
    """Return all that the template shows."""
    measured = references_near(results[0].gait.scenario.walk.speed)
    compared = [one for one in results if one.comparison]
    return {
        "results": results,
        "title": ", ".join(one.label for one in results),
        "tables": tables,
        "compared": compared,
        "playback": playback_page(results[0].gait) if len(results) == 1 else "",
        "links": [(one.label, _link(one, target)) for one in results if _has_playback(one)],
        "groups": list(_curves(results, measured)),
        "pictures": list(_pictures(results)),
        "measured": measured,
        "recipes": list(map(_recipe, results)),
    }


# The animation


def _has_playback(one: Result) -> bool:
    return (one.folder / PLAYBACK).is_file()


def _link(one: Result, target: Path) -> str:
    """Return the address of an animation as seen from the page."""
    path = os.path.relpath((one.folder / PLAYBACK).resolve(), target.resolve().parent)
    return quote(Path(path).as_posix())


# Figures


def _common_phases(results: Sequence[Result]) -> Gait | None:
    """Return a walk whose phases are those of all."""
    phases = {one.gait.scenario.phases for one in results}
    return results[0].gait if len(phases) == 1 else None


def _curves(results: Sequence[Result], measured: Sequence[Reference]) -> Iterator[Curves]:
    """Yield the groups of curves."""
    cycles, gait = [one.cycle for one in results], _common_phases(results)
    for heading, columns in GROUPS.items():
        panels = []
        for column in columns:
            title = _capital(label_and_unit(column)[0])
            with styled():
                drawn = svg(curve_panel(column, cycles, measured, gait), column, title)
            panels.append(_picture(title, drawn))
        keys = tuple(_legend(results, measured, columns))
        yield Curves(heading, keys, tuple(panels), phases=gait is not None)


def _pictures(results: Sequence[Result]) -> Iterator[list[Picture]]:
    """Yield the stick diagrams of all results, then their footprints."""
    for title, (draw, size) in _DRAWN.items():
        pictures = []
        for k, one in enumerate(results):
            name = f"{one.label}: " if len(results) > 1 else ""
            with styled():
                figure = draw(one.gait)
                figure.set_size_inches(*size)
                drawn = svg(figure, f"{draw.__name__}-{k}", title)
            pictures.append(_picture(f"{name}{title}", drawn))
        yield pictures


_DRAWN = {  # [inch]: smaller than on their own, which makes letters larger
    "one stride, as stick figures": (stick_diagram, (7.2, 4.9)),
    "footprints of one stride with the zero moment point": (zmp, (7.2, 2.1)),
}


def _picture(title: str, drawn: str) -> Picture:
    return Picture(title, Markup(drawn))  # made by us; no text of a file is in it


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _legend(
    results: Sequence[Result], measured: Sequence[Reference], columns: Sequence[str]
) -> Iterator[Key]:
    """Yield what the lines of a group of curves are, and the bands that are in it."""
    for one, line in zip(results, RESULTS, strict=False):
        yield _key(one.label if len(results) > 1 else f"{one.label}, predicted", line)
    for reference, line in zip(measured, MEASURED, strict=False):
        if any(column in reference.curves for column in columns):
            yield Key(f"{reference.label}, mean ± SD", colour_variable(line.colour), band=True)


def _key(label: str, line: Line) -> Key:
    dashes = " ".join(f"{2 * length:g}" for length in line.dashes)
    return Key(label, colour_variable(line.colour), dashes)


# How to make it again


def _recipe(one: Result) -> Recipe:
    scenario, outcome = one.gait.scenario, one.outcome
    file = f"{scenario.name}.toml"
    options = f"--solver {outcome.first_solver} --dynamics {outcome.dynamics} --seed {outcome.seed}"
    folder = shlex.quote(f"out/{scenario.name}")
    return Recipe(
        one.label,
        file,
        tomli_w.dumps(scenario.to_dict()),
        f"human-gait predict {shlex.quote(file)} {options} --out {folder}",
        _STARTS.get(outcome.trials[0].start if outcome.trials else "", ""),
        tuple(f"{package}=={version}" for package, version in outcome.versions.items()),
    )
