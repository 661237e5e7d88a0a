"""Figures of the page with what is written with them: curves with their legend, and pictures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from human_gait.people.reference import Reference
from human_gait.pictures.footprints import zmp
from human_gait.pictures.sticks import stick_diagram
from human_gait.reporting.figures import MEASURED, RESULTS, Line, curve_panel, styled, svg
from human_gait.reporting.figures import variable as colour_variable
from human_gait.reporting.results import Result
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import label_and_unit


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


def _common_phases(results: Sequence[Result]) -> Gait | None:
    """Return a walk whose phases are those of all."""
    phases = {one.gait.scenario.phases for one in results}
    return results[0].gait if len(phases) == 1 else None


def curves(
    results: Sequence[Result],
    measured: Sequence[Reference],
    groups: Mapping[str, Sequence[str]],
) -> Iterator[Curves]:
    """Yield groups of curves, by their headings."""
    cycles, gait = [one.cycle for one in results], _common_phases(results)
    for heading, columns in groups.items():
        panels = []
        for column in columns:
            title = _capital(label_and_unit(column)[0])
            with styled():
                drawn = svg(curve_panel(column, cycles, measured, gait), column, title)
            panels.append(_picture(title, drawn))
        keys = tuple(_legend(results, measured, columns))
        yield Curves(heading, keys, tuple(panels), phases=gait is not None)


def pictures(results: Sequence[Result]) -> Iterator[list[Picture]]:
    """Yield the stick diagrams of all results, then their footprints."""
    for title, (draw, size) in _DRAWN.items():
        row = []
        for k, one in enumerate(results):
            name = f"{one.label}: " if len(results) > 1 else ""
            with styled():
                figure = draw(one.gait)
                figure.set_size_inches(*size)
                drawn = svg(figure, f"{draw.__name__}-{k}", title)
            row.append(_picture(f"{name}{title}", drawn))
        yield row


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
