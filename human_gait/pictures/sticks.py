"""Stick figures of a walk, in an oblique picture seen from the right."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body import dh
from human_gait.body.skeleton import index
from human_gait.canvas import Axes, Circle, Line2D, Picture, plain
from human_gait.pictures.footprints import draw_footprints
from human_gait.pictures.style import BLACK, LEFT, RIGHT, STYLE, ZMP, new_figure

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait, Samples

_ZMP_SQUARE: Any = {"markersize": 6.0, "markeredgecolor": "white", "markeredgewidth": 0.8}
_STICK_INSTANTS = 7  # of one stride
_OBLIQUE = np.array([0.35, 0.20])  # how far right and up one metre to the left is drawn
# Polylines through joint centres; "tip" is the far end of a link.
_ARM = (
    "shoulder_abduction",
    "elbow_flexion",
    "wrist_flexion",
    "tip:wrist_radial_deviation",
)
_LEG = ("hip_abduction", "knee_flexion", "ankle_dorsiflexion")
_SPINE = ("pelvis_ry", *(f"spine{k}_flexion" for k in range(1, 5)), "neck_lower_flexion")
_HIPS = ("hip_abduction_l", "pelvis_ry", "hip_abduction_r")
_SHOULDERS = ("shoulder_abduction_l", "neck_lower_flexion", "shoulder_abduction_r")


@plain(STYLE)
def stick_diagram(gait: Gait) -> Picture:
    """Return stick figures of one stride at even intervals; square dots are the ZMP (Fig. 7)."""
    times = np.linspace(0.0, 2 * gait.step_time, _STICK_INSTANTS)
    instants = gait.instants(times)
    figure = new_figure(9.6, 6.2, left=0.004, bottom=0.04, right=0.996, top=0.947)
    ax = figure.subplots()
    _draw_ruler(ax, gait)
    draw_footprints(ax, gait, lambda points: project(points).T)
    sticks = stick_figures(gait, instants)
    for k in range(len(times)):
        now = {part: points[k] for part, points in sticks.items()}
        draw_sticks(ax, now, gait.body.subject.stature)
    path = gait.instants(np.linspace(0.0, times[-1], 201)).zmp
    ax.plot(*project(path).T, color=ZMP, linewidth=1.0)
    ax.plot(*project(instants.zmp).T, "s", color=ZMP, zorder=3, **_ZMP_SQUARE)
    ax.set_aspect("equal")
    ax.axis("off")
    ax.legend(handles=_stick_handles(), loc="lower center", ncols=3, bbox_to_anchor=(0.5, 1.0))
    every = 1000 * (times[1] - times[0])
    figure.supxlabel(f"from left heel strike, t = 0; a figure every {every:.0f} ms", fontsize=9.0)
    return figure


def stick_figures(gait: Gait, instants: Samples) -> dict[str, FloatArray]:
    """Return polylines (K, n, 3), [m], through the joint centres of a body at K instants."""
    P, A = dh.frames(gait.body.table, instants.q)

    def line(names: Iterable[str], side: str = "") -> FloatArray:
        return np.stack([_joint_centre(P, A, name + side) for name in names], axis=1)

    sticks: dict[str, FloatArray] = {}
    for side, points in (("_l", instants.points[:, 1]), ("_r", instants.points[:, 0])):
        ball = points[:, 1:3].mean(axis=1)
        ankle = line(["ankle_dorsiflexion"], side)[:, 0]
        sole = [ankle, points[:, 0], ball, points[:, 3], ball, ankle]
        sticks |= {f"leg{side}": line(_LEG, side), f"arm{side}": line(_ARM, side)}
        sticks[f"foot{side}"] = np.stack(sole, axis=1)
    sticks |= {"pelvis": line(_HIPS), "spine": line(_SPINE), "shoulders": line(_SHOULDERS)}
    sticks["head"] = line(["neck_lower_flexion", "neck_upper_flexion", "tip:neck_upper_rotation"])
    return sticks


def _joint_centre(P: FloatArray, A: FloatArray, name: str) -> FloatArray:
    """Return the centre of a joint, or the far end of the link behind it, (K, 3), [m]."""
    joint = name.removeprefix("tip:")
    return np.asarray((P if joint == name else A)[:, index(joint), :3, 3])


def project(points: FloatArray) -> FloatArray:
    """Return points (..., 3) of the world in an oblique picture, (..., 2), [m].

    The plane of walking keeps its shape, seen from the right; what lies to the left is shifted
    aside and up.
    """
    return np.asarray(points[..., [2, 1]] + points[..., :1] * _OBLIQUE)


def draw_sticks(ax: Axes, sticks: Mapping[str, FloatArray], stature: float) -> None:
    """Draw one stick figure from its polylines (n, 3)."""
    for part, points in sticks.items():
        width = 1.2 if part.startswith(("arm", "foot")) else 1.8
        corners = points[:2] if part == "head" else points
        ax.plot(*project(corners).T, linewidth=width, solid_capstyle="round", **side_style(part))
    centre = project(sticks["head"][1:].mean(axis=0))
    head: dict[str, Any] = {"facecolor": "white", "edgecolor": BLACK, "linewidth": 1.8}
    ax.add_patch(Circle(tuple(centre), 0.04 * stature, **head))


def side_style(part: str) -> dict[str, Any]:
    """Return colour and line of a part of a stick figure: left is blue and dashed."""
    if part.endswith("_r"):
        return {"color": RIGHT}
    if part.endswith("_l"):
        return {"color": LEFT, "alpha": 0.65, "linestyle": (0, (4, 1))}
    return {"color": BLACK}


def _stick_handles() -> list[Any]:
    square: dict[str, Any] = {"color": ZMP, "marker": "s", "linewidth": 1.0, **_ZMP_SQUARE}
    return [
        Line2D([], [], label="right leg and arm", **side_style("leg_r")),
        Line2D([], [], label="left leg and arm", **side_style("leg_l")),
        Line2D([], [], label="ZMP", **square),
    ]


def _draw_ruler(ax: Axes, gait: Gait) -> None:
    """Draw a ruler along the path on the ground, with a tick every half metre."""
    beside = -0.25 - gait.scenario.walk.step_width / 2
    ticks = np.arange(-0.5, 2.5 * gait.step_length + 0.5, 0.5)
    for k, z in enumerate(ticks):
        tick = np.array([[beside, 0.0, z], [beside - 0.05, 0.0, z]])
        ax.plot(*project(tick).T, color=BLACK, linewidth=0.8)
        unit = " m" if k == len(ticks) - 1 else ""
        place = tuple(project(tick[1]))
        ax.annotate(
            f"{z:g}{unit}".replace("-", "\N{MINUS SIGN}"),
            place,
            (0, -3),
            textcoords="offset points",
            ha="center",
            va="top",
            fontsize=8,
        )
    ends = np.array([[beside, 0.0, z] for z in ticks[[0, -1]]])
    ax.plot(*project(ends).T, color=BLACK, linewidth=0.8)
