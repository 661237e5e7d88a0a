"""The footprints of one stride, with the zero moment point and the centres of pressure on them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import GRAVITY
from human_gait.canvas import Axes, Picture, plain
from human_gait.pictures.style import (
    FOOT_COLOURS,
    FOOT_NAMES,
    SHADE,
    STYLE,
    SUPPORT,
    ZMP,
    new_figure,
)

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait, Samples


@plain(STYLE)
def zmp(gait: Gait) -> Picture:
    """Return the ZMP and each foot's centre of pressure on the footprints of one stride."""
    figure = new_figure(9.6, 2.7, left=0.073, bottom=0.015, right=0.996, top=0.985)
    ax = figure.subplots()
    _draw_support(ax, gait)
    draw_footprints(ax, gait, lambda points: (points[:, 2], points[:, 0]))
    instants = gait.instants(np.linspace(0.0, 2 * gait.step_time, 241))
    _plot_pressure(ax, gait, instants)
    ax.plot(instants.zmp[:, 2], instants.zmp[:, 0], color=ZMP, linewidth=1.2)
    squares = instants.zmp[::10]
    ax.plot(squares[:, 2], squares[:, 0], "s", color=ZMP, markersize=4.0, label=_every(gait, 24))
    ax.set_aspect("equal")
    ax.set_xlabel("forward [m]")
    ax.set_ylabel("to the left [m]")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.02), ncols=3, fontsize=8)
    return figure


def _plot_pressure(ax: Axes, gait: Gait, instants: Samples) -> None:
    """Draw the centre of pressure of each foot while it carries anything."""
    weight = gait.body.subject.mass * GRAVITY
    for f in range(2):
        carries = instants.grf[:, f, 1] > 0.01 * weight
        cop = np.where(carries[:, None], instants.cop[:, f], np.nan)
        label = f"centre of pressure, {FOOT_NAMES[f]}"
        ax.plot(cop[:, 2], cop[:, 0], color=FOOT_COLOURS[f], label=label, linewidth=3.0, alpha=0.5)


def _draw_support(ax: Axes, gait: Gait) -> None:
    """Fill the support regions in the middle of double and of single support, of two steps."""
    phases = gait.scenario.phases
    instants = {
        "double support": (0.5 * phases.double_support, SHADE),
        "single support": (0.5 * (phases.double_support + phases.heel_off), SUPPORT),
    }
    for name, (fraction, colour) in instants.items():
        corners = gait.plan.support_polygon(fraction * gait.step_time)
        ax.fill(corners[:, 1], corners[:, 0], color=colour, linewidth=0, label=f"region, {name}")
        ax.fill(corners[:, 1] + gait.step_length, -corners[:, 0], color=colour, linewidth=0)


def draw_footprints(
    ax: Axes, gait: Gait, place: Callable[[FloatArray], Any], steps: range = range(-1, 2)
) -> None:
    """Outline the feet that stand during one stride; `place` maps (n, 3) to two (n,)."""
    for step in steps:
        side, outline = gait.plan.outline(step)
        x, y = place(np.concatenate([outline, outline[:1]]))
        ax.plot(x, y, color=FOOT_COLOURS[int(side)], linewidth=1.0)


def _every(gait: Gait, per_stride: int) -> str:
    return f"ZMP, a square every {2000 * gait.step_time / per_stride:.0f} ms"
