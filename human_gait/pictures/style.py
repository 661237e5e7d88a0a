"""How pictures of a walk look: colours, the gait cycle with its phases, scales.

Right is vermilion, left is blue and dashed: Okabe and Ito's palette, which colour-blind people tell
apart.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from human_gait.canvas import Axes, Picture

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait

RIGHT, LEFT, BLACK = "#D55E00", "#0072B2", "#222222"
ZMP, SUPPORT, SHADE = "#009E73", "#F9F3A8", "#E9E9E9"
DPI = 200
FOOT_COLOURS = (RIGHT, LEFT)
FOOT_STYLES = ("-", (0, (5, 2)))
FOOT_NAMES = ("right foot", "left foot")
STYLE: Any = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titley": 1.0,  # else it is looked for at each drawing
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "lines.linewidth": 1.8,
    "legend.frameon": False,
    "savefig.facecolor": "white",
}
CYCLE_LABEL = "gait cycle from right heel strike [%]"


def new_figure(width: float, height: float, **edges: float) -> Picture:
    """Return an empty figure, [inch], to be filled in `STYLE`.

    Parameters
    ----------
    width, height : float, [inch]
    **edges
        Edges and gaps of the panels, as shares of the figure and of a panel (``subplots_adjust``).
        Without them matplotlib measures all texts to find some, which takes as long as drawing.
    """
    figure = Picture(width, height, DPI, None if edges else "constrained")
    if edges:
        figure.subplots_adjust(**edges)
    return figure


def _events(gait: Gait) -> tuple[float, ...]:
    """Return left toe-off, left heel strike and right toe-off, in percent of the cycle."""
    both = 50.0 * gait.scenario.phases.double_support
    return both, 50.0, 50.0 + both


def mark_phases(ax: Axes, gait: Gait) -> None:
    """Shade double support, draw right toe-off and the zero line."""
    left_off, left_strike, right_off = _events(gait)
    ax.axvspan(0.0, left_off, color=SHADE, linewidth=0)
    ax.axvspan(left_strike, right_off, color=SHADE, linewidth=0)
    ax.axvline(right_off, color=BLACK, linewidth=0.8, linestyle=(0, (2, 2)))
    ax.axhline(0.0, color=BLACK, linewidth=0.6)
    ax.set_xlim(0.0, 100.0)
    ax.set_xticks(range(0, 101, 20))


def name_phases(ax: Axes, gait: Gait) -> None:
    """Name the phases above the uppermost panel."""
    left_off, left_strike, right_off = _events(gait)
    names = {
        "double\nsupport": (0.0, left_off),
        "right single support": (left_off, left_strike),
        "double\nsupport ": (left_strike, right_off),
        "right swing": (right_off, 100.0),
    }
    for name, ends in names.items():
        ax.annotate(
            name.strip(),
            (sum(ends) / 2, 1.0),
            xytext=(0, 24),
            xycoords=ax.get_xaxis_transform(),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=8,
            linespacing=0.95,
        )


def second_scale(ax: Axes, factor: float, label: str) -> None:
    """Add a scale at the right that is `factor` times the left one."""
    second = ax.secondary_yaxis(
        "right", functions=(lambda y: np.asarray(y) * factor, lambda y: np.asarray(y) / factor)
    )
    second.set_ylabel(label)
    second.spines["right"].set_visible(True)


def widen(ax: Axes, least: float) -> None:
    """Widen the range of a panel to `least`: small ripples should look small."""
    low, high = ax.get_ylim()
    if high - low < least:
        middle = (low + high) / 2
        ax.set_ylim(middle - least / 2, middle + least / 2)
