"""Figures of a report, as SVG that stands in a page: its text is text, its colours are the page's.

A panel shows one curve of one or of several walks over what was measured. Legends are left to the
page, which names each line once.
"""

from __future__ import annotations

import html
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from typing import TYPE_CHECKING, Any

from human_gait.canvas import Axes, Picture, plain
from human_gait.exceptions import ResultError
from human_gait.people.reference import Cycle, Reference, stance
from human_gait.pictures.style import (
    BLACK,
    LEFT,
    RIGHT,
    SHADE,
    STYLE,
    SUPPORT,
    ZMP,
    mark_phases,
    widen,
)
from human_gait.walk.gait_cycle import COLUMNS, POWERS, TRUNK_MOMENTS, label_and_unit

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait


@dataclass(frozen=True)
class Line:
    """How a curve is drawn, and in the legend of the page.

    Attributes
    ----------
    colour : str
    dashes : tuple of float
        Lengths of strokes and gaps, [pt]; none for a line without gaps.
    """

    colour: str
    dashes: tuple[float, ...] = ()

    @property
    def style(self) -> Any:
        """Return the line style as matplotlib has it."""
        return (0, self.dashes) if self.dashes else "-"


RESULTS = (  # Okabe and Ito's palette, which colour-blind people tell apart, and dashes for grey
    Line(RIGHT),
    Line(LEFT, (6, 1.5)),
    Line(BLACK, (3, 1.2)),
    Line(ZMP, (6, 1.5, 1.2, 1.5)),
    Line("#CC79A7", (8, 2, 3, 2)),
    Line("#E69F00", (1.2, 1.2)),
)
"""Lines of the walks of a report, in their order; there is room for no more."""

MEASURED = (Line("#44557F"), Line("#1D655E"), Line("#6C4F80"))
"""Bands of the measured people, by reference."""

VARIABLES: Mapping[str, str] = {
    BLACK: "ink",
    "#000000": "ink",
    "#ffffff": "paper",
    SHADE: "shade",
    SUPPORT: "support",
    RIGHT: "vermilion",
    LEFT: "blue",
    ZMP: "green",
    "#CC79A7": "purple",
    "#E69F00": "orange",
    **{line.colour: f"measured-{k}" for k, line in enumerate(MEASURED, 1)},
}
"""Variables of the page's style sheet for the colours of the figures: light and dark differ."""

GROUPS: Mapping[str, tuple[str, ...]] = {
    "Joint angles": tuple(column for column in COLUMNS if column.endswith("_deg")),
    "Joint torques": tuple(column for column in COLUMNS if column.endswith("_Nm_per_kg")),
    "Ground reaction force": tuple(column for column in COLUMNS if column.endswith("_BW")),
}
"""Columns of the gait cycle by the heading that they are shown under."""

ENERGY_GROUPS: Mapping[str, tuple[str, ...]] = {
    "Joint powers": POWERS,
    "Moments of L5/S1": TRUNK_MOMENTS,
}
"""The same for the section on energy."""

_QUANTITIES = {"deg": "angle", "N m/kg": "moment", "BW": "force", "W/kg": "power"}
_LEAST = {
    "deg": 2.0,
    "N m/kg": 0.1,
    "BW": 0.05,
    "W/kg": 0.2,
}  # span of a vertical axis: noise is not to look large
_SIZE = (3.3, 2.1)  # [inch]
_PLACE = (0.21, 0.2, 0.74, 0.755)  # of the axes: the same in all panels
_LABEL = -0.225  # of the width of the axes: where the vertical axis is named
_TEXT: Any = {  # text as text, as it is spelt; the same identifiers every time
    "svg.fonttype": "none",
    "svg.hashsalt": "human_gait",
    "text.parse_math": False,
    "font.sans-serif": ["DejaVu Sans"],  # wide: the page's own font needs less room
}
_ANONYMOUS = dict.fromkeys(("Creator", "Date", "Format", "Type"))
_LEFT_OUT = re.compile(r' xmlns(:\w+)?="[^"]*"| version="1.1"|<style.*?</style>', re.DOTALL)
_SIZES = re.compile(r' (?:width|height)="[\d.]+pt"')
_COLOUR = re.compile(r"#[0-9a-fA-F]{6}\b")
_NAMED = re.compile(r'(\bid="|href="#|url\(#)')


def curve_panel(
    column: str, cycles: Sequence[Cycle], measured: Sequence[Reference], gait: Gait | None
) -> Picture:
    """Return one curve of some walks over the measured means, each in a band of one SD.

    Parameters
    ----------
    column : str
        One of ``gait_cycle.COLUMNS`` or ``FURTHER``.
    cycles : sequence of mapping of str to (101,) array
        At most as many as there are `RESULTS`.
    measured : sequence of Reference
        One that covers stance only is stretched over the stance of the first walk.
    gait : Gait or None
        Whose phases are marked; none where they differ.
    """
    _, unit = label_and_unit(column)
    figure = Picture(*_SIZE)
    ax = figure.add_axes(_PLACE)
    if gait is not None:
        mark_phases(ax, gait)
    _draw_measured(ax, column, cycles[0], measured)
    for cycle, line in zip(cycles, RESULTS, strict=False):
        ax.plot(cycle["gait_cycle_percent"], cycle[column], color=line.colour, ls=line.style)
    widen(ax, _LEAST[unit])
    ax.set_xlim(0.0, 100.0)
    ax.set_xticks(range(0, 101, 20))
    ax.set_xlabel("gait cycle [%]")
    ax.set_ylabel(f"{_QUANTITIES[unit]} [{unit}]")
    ax.yaxis.set_label_coords(_LABEL, 0.5)
    return figure


def _draw_measured(ax: Axes, column: str, cycle: Cycle, measured: Sequence[Reference]) -> None:
    for reference, line in zip(measured, MEASURED, strict=False):
        if column not in reference.curves:
            continue
        curve, place = reference.curves[column], _over_cycle(reference, cycle)
        if place is None:
            continue
        percent = place[0] + curve.percent / 100.0 * (place[1] - place[0])
        band = (curve.mean - curve.sd, curve.mean + curve.sd)
        ax.fill_between(percent, *band, color=line.colour, alpha=0.35, linewidth=0)
        ax.plot(percent, curve.mean, color=line.colour, linewidth=1.0)


def _over_cycle(reference: Reference, cycle: Cycle) -> tuple[float, float] | None:
    """Return where measured curves begin and end, [%]; nowhere if the foot never stands."""
    if not reference.stance_only:
        return 0.0, 100.0
    try:
        return stance(cycle)
    except ResultError:
        return None


def styled() -> Any:
    """Return the settings in which figures of a report are drawn, as a context."""
    return plain(STYLE | _TEXT)


def svg(figure: Picture, key: str, meaning: str) -> str:
    """Return a figure as an SVG element, to be drawn within `styled`.

    Parameters
    ----------
    figure : Picture
    key : str
        Prefix of its identifiers: no two figures of a page may share it.
    meaning : str
        What it shows, for those who cannot see it.
    """
    text = StringIO()
    figure.savefig(text, format="svg", transparent=True, metadata=_ANONYMOUS)
    found = text.getvalue()
    found = _LEFT_OUT.sub("", found[found.index("<svg") :])
    found = _SIZES.sub("", found, count=2)
    found = _COLOUR.sub(lambda colour: variable(colour[0]), found)
    found = _NAMED.sub(lambda start: f"{start[0]}{key}-", found)
    return found.replace("<svg", f'<svg role="img" aria-label="{html.escape(meaning)}"', 1)


def variable(colour: str) -> str:
    """Return a colour as the style sheet of the page knows it, ``var(--name)``."""
    return f"var(--{_BY_LOWER[colour.lower()]})"


_BY_LOWER = {colour.lower(): name for colour, name in VARIABLES.items()}
