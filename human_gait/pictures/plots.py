"""Pictures of a walk: stick diagram, joint angles and torques, ground reaction, ZMP on footprints.

Curves run over the right leg's gait cycle, from its heel strike to the next, in the units and signs
of gait laboratories. Right is vermilion, left is blue and dashed: Okabe and Ito's palette, which
colour-blind people tell apart.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch

from human_gait.arrays import FloatArray
from human_gait.body import dh
from human_gait.body.skeleton import GRAVITY, index
from human_gait.results.folder import whole_file
from human_gait.walk.gait_cycle import gait_cycle

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait, Samples


RIGHT, LEFT, BLACK = "#D55E00", "#0072B2", "#222222"
ZMP, SUPPORT, SHADE = "#009E73", "#F9F3A8", "#E9E9E9"
DPI = 200

_FOOT_COLOURS = (RIGHT, LEFT)
_FOOT_STYLES = ("-", (0, (5, 2)))
_FOOT_NAMES = ("right foot", "left foot")
STYLE: Any = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "lines.linewidth": 1.8,
    "legend.frameon": False,
    "savefig.facecolor": "white",
}
CYCLE_LABEL = "gait cycle from right heel strike [%]"

_TORQUES = {
    "hip_extension_Nm_per_kg": ("right hip", "extension +"),
    "knee_extension_Nm_per_kg": ("right knee", "extension +"),
    "ankle_plantarflexion_Nm_per_kg": ("right ankle", "plantarflexion +"),
}
_ANGLES = {
    "pelvis_tilt_anterior_deg": ("pelvis tilt", "anterior +"),
    "pelvis_obliquity_up_deg": ("pelvis obliquity", "right side up +"),
    "pelvis_rotation_internal_deg": ("pelvis rotation", "right side forward +"),
    "trunk_flexion_deg": ("trunk", "flexion +"),
    "hip_flexion_deg": ("right hip", "flexion +"),
    "hip_adduction_deg": ("right hip", "adduction +"),
    "hip_rotation_internal_deg": ("right hip", "internal rotation +"),
    "shoulder_flexion_deg": ("right shoulder", "flexion +"),
    "knee_flexion_deg": ("right knee", "flexion +"),
    "ankle_dorsiflexion_deg": ("right ankle", "dorsiflexion +"),
    "elbow_flexion_deg": ("right elbow", "flexion +"),
}
_FORCES = {
    "vertical_up_BW": ("vertical", "up +"),
    "foreaft_forward_BW": ("fore-aft", "forward +"),
}

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


def save_plots(gait: Gait, folder: str | Path) -> None:
    """Write all pictures of a walk into a folder, as PNG."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    for name, draw in PLOTS.items():
        with mpl.rc_context(STYLE):
            figure = draw(gait)
            with whole_file(target / f"{name}.png") as path:
                figure.savefig(path, dpi=DPI)


def joint_torques(gait: Gait) -> Figure:
    """Return the torques of the right hip, knee and ankle over the gait cycle (Fig. 8)."""
    columns, mass = gait_cycle(gait), gait.body.subject.mass
    figure = new_figure(6.4, 6.6)
    panels = figure.subplots(3, 1, sharex=True)
    for ax, (column, (joint, sign)) in zip(panels, _TORQUES.items(), strict=True):
        mark_phases(ax, gait)
        ax.plot(columns["gait_cycle_percent"], columns[column], color=RIGHT)
        ax.set_title(f"{joint}, {sign}", loc="left")
        ax.set_ylabel("torque [N m/kg]")
        second_scale(ax, mass, "torque [N m]")
    name_phases(panels[0], gait)
    panels[-1].set_xlabel(CYCLE_LABEL)
    return figure


def joint_angles(gait: Gait) -> Figure:
    """Return the angles of pelvis, trunk and the right limbs over the gait cycle."""
    columns = gait_cycle(gait)
    figure = new_figure(9.6, 6.8)
    panels = figure.subplots(3, 4)
    for ax, (column, (joint, sign)) in zip(panels.flat, _ANGLES.items(), strict=False):
        mark_phases(ax, gait)
        ax.plot(columns["gait_cycle_percent"], columns[column], color=RIGHT)
        ax.set_title(f"{joint}\n{sign}", loc="left")
        _widen(ax, 10.0)
    figure.supxlabel(CYCLE_LABEL, fontsize=9.0)
    figure.supylabel("angle [deg]", fontsize=9.0)
    panels[-1, -1].axis("off")
    panels[-1, -1].legend(handles=_phase_handles(), loc="center left")
    return figure


def ground_reaction(gait: Gait) -> Figure:
    """Return the vertical and the fore-aft ground reaction force of each foot."""
    columns, weight = gait_cycle(gait), gait.body.subject.mass * GRAVITY
    figure = new_figure(6.4, 5.4)
    panels = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for ax, (column, (name, sign)) in zip(panels, _FORCES.items(), strict=True):
        mark_phases(ax, gait)
        for f, force in enumerate((columns[column], half_a_cycle_later(columns[column]))):
            style: Any = {"color": _FOOT_COLOURS[f], "linestyle": _FOOT_STYLES[f]}
            ax.plot(columns["gait_cycle_percent"], force, label=_FOOT_NAMES[f], **style)
        ax.set_title(f"{name}, {sign}", loc="left")
        ax.set_ylabel("force [body weights]")
        second_scale(ax, weight, "force [N]")
    name_phases(panels[0], gait)
    panels[1].legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=2)
    panels[-1].set_xlabel(CYCLE_LABEL)
    return figure


def half_a_cycle_later(values: FloatArray) -> FloatArray:
    """Return the left limb's curve (n,) from the right limb's, periodic, both ends included."""
    return np.append(np.roll(values[:-1], len(values) // 2), values[len(values) // 2])


def zmp(gait: Gait) -> Figure:
    """Return the ZMP and each foot's centre of pressure on the footprints of one stride."""
    figure = new_figure(9.6, 2.7)
    ax = figure.subplots()
    _draw_support(ax, gait)
    _draw_footprints(ax, gait, lambda points: (points[:, 2], points[:, 0]))
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


def stick_diagram(gait: Gait) -> Figure:
    """Return stick figures of one stride at even intervals; square dots are the ZMP (Fig. 7)."""
    times = np.linspace(0.0, 2 * gait.step_time, _STICK_INSTANTS)
    instants = gait.instants(times)
    figure = new_figure(9.6, 6.2)
    ax = figure.subplots()
    _draw_ruler(ax, gait)
    _draw_footprints(ax, gait, lambda points: project(points).T)
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


PLOTS: Mapping[str, Callable[[Gait], Figure]] = {
    "stick_diagram": stick_diagram,
    "joint_torques": joint_torques,
    "joint_angles": joint_angles,
    "ground_reaction": ground_reaction,
    "zmp": zmp,
}
"""The pictures by the names of their files."""


def plot(gait: Gait, name: str) -> Figure:
    """Return a picture of a walk by its name.

    Raises
    ------
    ValueError
        If there is no such picture.
    """
    if name not in PLOTS:
        raise ValueError(f"no picture is called {name!r}: choose from {', '.join(PLOTS)}")
    with mpl.rc_context(STYLE):
        return PLOTS[name](gait)


class Picture(Figure):
    """A figure that a notebook shows, without pyplot and whatever the settings of matplotlib."""

    def _repr_png_(self) -> bytes:
        png = BytesIO()
        with mpl.rc_context(STYLE):
            self.savefig(png, format="png", dpi=DPI)
        return png.getvalue()


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure, [inch], that does not know pyplot."""
    figure = Picture(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
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


def _phase_handles() -> list[Any]:
    return [
        Patch(color=SHADE, label="double support"),
        Line2D([], [], color=BLACK, linewidth=0.8, linestyle=(0, (2, 2)), label="right toe-off"),
        Line2D([], [], color=RIGHT, label="pelvis, trunk, right limbs"),
    ]


def second_scale(ax: Axes, factor: float, label: str) -> None:
    """Add a scale at the right that is `factor` times the left one."""
    second = ax.secondary_yaxis(
        "right", functions=(lambda y: np.asarray(y) * factor, lambda y: np.asarray(y) / factor)
    )
    second.set_ylabel(label)
    second.spines["right"].set_visible(True)


def _widen(ax: Axes, least: float) -> None:
    """Widen the range of a panel to `least`: small ripples should look small."""
    low, high = ax.get_ylim()
    if high - low < least:
        middle = (low + high) / 2
        ax.set_ylim(middle - least / 2, middle + least / 2)


def _plot_pressure(ax: Axes, gait: Gait, instants: Samples) -> None:
    """Draw the centre of pressure of each foot while it carries anything."""
    weight = gait.body.subject.mass * GRAVITY
    for f in range(2):
        carries = instants.grf[:, f, 1] > 0.01 * weight
        cop = np.where(carries[:, None], instants.cop[:, f], np.nan)
        label = f"centre of pressure, {_FOOT_NAMES[f]}"
        ax.plot(cop[:, 2], cop[:, 0], color=_FOOT_COLOURS[f], label=label, linewidth=3.0, alpha=0.5)


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


def _draw_footprints(
    ax: Axes, gait: Gait, place: Callable[[FloatArray], Any], steps: range = range(-1, 2)
) -> None:
    """Outline the feet that stand during one stride; `place` maps (n, 3) to two (n,)."""
    for step in steps:
        side, outline = gait.plan.outline(step)
        x, y = place(np.concatenate([outline, outline[:1]]))
        ax.plot(x, y, color=_FOOT_COLOURS[int(side)], linewidth=1.0)


def _every(gait: Gait, per_stride: int) -> str:
    return f"ZMP, a square every {2000 * gait.step_time / per_stride:.0f} ms"


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
