"""Walks with several weights on the back beside each other, figures 9 to 11 of the paper.

The weights are told apart by lightness, the heaviest darkest, and by line style.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body import dh
from human_gait.body.links import anatomical_to_link
from human_gait.body.person import Body
from human_gait.body.skeleton import GRAVITY, SEGMENTS, index
from human_gait.canvas import Axes, Line2D, Patch, Picture, Polygon, plain
from human_gait.pictures.sticks import draw_sticks, project, side_style, stick_figures
from human_gait.pictures.style import (
    BLACK,
    CYCLE_LABEL,
    STYLE,
    mark_phases,
    name_phases,
    new_figure,
    second_scale,
)
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import PERCENT, gait_cycle, trunk_lean

_POUND = 0.45359237  # [kg]
_LOAD_STYLES: Sequence[Mapping[str, Any]] = (  # two blues of Okabe and Ito, and black
    {"color": "#56B4E9", "linestyle": "-", "linewidth": 2.2},
    {"color": "#0072B2", "linestyle": "--"},
    {"color": BLACK, "linestyle": "-."},
)
PANEL_LETTERS = "abc"
_FRACTIONS = np.array([0.0, 1.0, 2.0]) / 3.0  # instants of Fig. 9, of the step
_APART = 0.46  # figures of one panel of Fig. 9, of the stature
_PACK, _PACK_EDGE = "#BDBDBD", "#6E6E6E"
# Right, top and front, the faces that the oblique picture shows, of a box from -1 to 1.
_PACK_FACES = np.array(
    [
        [[-1, -1, -1], [-1, -1, 1], [-1, 1, 1], [-1, 1, -1]],
        [[-1, 1, -1], [-1, 1, 1], [1, 1, 1], [1, 1, -1]],
        [[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
    ]
)


@plain(STYLE)
def backpack_postures(*gaits: Gait) -> Picture:
    """Return one panel for each load, stick figures at the same instants of a step (Fig. 9)."""
    figure = new_figure(9.6, 3.4)
    panels = figure.subplots(1, len(gaits), sharex=True, sharey=True)
    for letter, ax, gait in zip(PANEL_LETTERS, panels, gaits, strict=False):
        _draw_postures(ax, gait)
        ax.set_title(f"({letter}) {load_label(gait)}", loc="left")
        ax.margins(0.01)
        ax.set_aspect("equal")
        ax.axis("off")
    _draw_scale_bar(panels[0])
    figure.legend(handles=_posture_handles(), loc="outside upper center", ncols=4)
    return figure


def _draw_postures(ax: Axes, gait: Gait) -> None:
    """Draw the stick figures of one walk, set apart; below each its instant and its lean."""
    instants = gait.instants(_FRACTIONS * gait.step_time)
    apart = _APART * gait.body.subject.stature * np.arange(len(_FRACTIONS))
    ahead = np.stack([0 * apart, 0 * apart, apart - instants.q[:, index("pelvis_tz")]], axis=1)
    sticks, packs = stick_figures(gait, instants), backpack_faces(gait.body, instants.q)
    leans = np.rad2deg(trunk_lean(gait.body.table, instants.q))
    for k, fraction in enumerate(_FRACTIONS):
        for face in packs[k] if gait.scenario.load.mass else ():
            outline = project(face + ahead[k])
            ax.add_patch(Polygon(outline, facecolor=_PACK, edgecolor=_PACK_EDGE, zorder=1))
        now = {part: points[k] + ahead[k] for part, points in sticks.items()}
        draw_sticks(ax, now, gait.body.subject.stature)
        text = f"{100 * fraction:.0f} % of step\nlean {leans[k]:.1f}°".replace(
            "-", "\N{MINUS SIGN}"
        )
        ax.text(apart[k], -0.1, text, ha="center", va="top", fontsize=8)
    ax.axhline(0.0, color="0.8", linewidth=0.8, zorder=0)


def backpack_faces(body: Body, q: FloatArray) -> FloatArray:
    """Return the corners of three faces (right, top, front) of the load, (K, 3, 4, 3), [m].

    Parameters
    ----------
    body : Body
    q : (K, 55) array, [rad] and [m]
    """
    thorax = SEGMENTS["thorax"]
    corners = np.array(body.load.position) + _PACK_FACES * np.array(body.load.size) / 2
    pose = dh.frames(body.table, q)[1][:, thorax] @ anatomical_to_link(body.table)[thorax]
    turned = np.einsum("kij,fcj->kfci", pose[:, :3, :3], corners)
    return np.asarray(turned + pose[:, None, None, :3, 3])


def _draw_scale_bar(ax: Axes) -> None:
    """Draw half a metre on the ground."""
    start, end, low = -0.25, 0.25, -0.5
    ax.plot([start, end], [low, low], color=BLACK, linewidth=1.2)
    ax.text((start + end) / 2, low - 0.02, "0.5 m", ha="center", va="top", fontsize=8)


def _posture_handles() -> list[Any]:
    return [
        Line2D([], [], label="right leg and arm", **side_style("leg_r")),
        Line2D([], [], label="left leg and arm", **side_style("leg_l")),
        Patch(facecolor=_PACK, edgecolor=_PACK_EDGE, label="backpack"),
        Line2D([], [], linestyle="none", label="lean: of the trunk, forward +"),
    ]


def load_label(gait: Gait) -> str:
    """Return what a walk carries, in pounds as in the paper and in kilograms."""
    mass = gait.scenario.load.mass
    return f"{mass / _POUND:.0f} lb ({mass:.1f} kg)"


@plain(STYLE)
def vertical_forces(*gaits: Gait) -> Picture:
    """Return the vertical ground reaction of the right foot and of both, by load (Fig. 10)."""
    figure = new_figure(6.4, 6.0)
    panels = figure.subplots(2, 1, sharex=True)
    for ax, feet, title in zip(panels, ([0], [0, 1]), ("right foot", "both feet"), strict=True):
        curves = [vertical_force(gait, feet) for gait in gaits]
        _draw_by_load(ax, gaits, curves)
        ax.set_title(f"{title}, up +", loc="left")
        ax.set_ylabel("vertical force [BW]")
        second_scale(ax, _weight(gaits[0]), "vertical force [N]")
    name_phases(panels[0], gaits[0])
    panels[-1].set_xlabel(CYCLE_LABEL)
    _load_legend(figure, panels[0])
    return figure


def vertical_force(gait: Gait, feet: Sequence[int]) -> FloatArray:
    """Return the vertical force on feet (0 right, 1 left) over the right gait cycle, (101,), [BW].

    In weights of the body alone, whatever it carries.
    """
    instants = gait.right_stride
    return np.asarray(instants.grf[:, feet, 1].sum(axis=1) / _weight(gait))


def _weight(gait: Gait) -> float:
    return gait.body.subject.mass * GRAVITY


@plain(STYLE)
def knee_torques(*gaits: Gait) -> Picture:
    """Return the torque of the right knee over the gait cycle, by load (Fig. 11)."""
    figure = new_figure(6.4, 4.0)
    ax = figure.subplots()
    _draw_by_load(ax, gaits, [gait_cycle(gait)["knee_extension_Nm_per_kg"] for gait in gaits])
    ax.set_title("right knee, extension +", loc="left")
    ax.set_ylabel("torque [N m/kg]")
    second_scale(ax, gaits[0].body.subject.mass, "torque [N m]")
    name_phases(ax, gaits[0])
    ax.set_xlabel(CYCLE_LABEL)
    _load_legend(figure, ax)
    return figure


def _draw_by_load(ax: Axes, gaits: Sequence[Gait], curves: Sequence[FloatArray]) -> None:
    mark_phases(ax, gaits[0])
    for gait, curve, style in zip(gaits, curves, _LOAD_STYLES, strict=False):
        ax.plot(PERCENT, curve, label=load_label(gait), **style)


def _load_legend(figure: Picture, ax: Axes) -> None:
    """Name the loads above the figure, clear of the curves."""
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, handlelength=3.0)
