"""Pictures of a walk: stick diagram, joint angles and torques, ground reaction, ZMP on footprints.

Curves run over the right leg's gait cycle, from its heel strike to the next, in the units and signs
of gait laboratories.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import GRAVITY
from human_gait.canvas import Line2D, Patch, Picture, plain
from human_gait.people.pictures import warn_on
from human_gait.pictures.footprints import zmp
from human_gait.pictures.sticks import stick_diagram
from human_gait.pictures.style import (
    BLACK,
    CYCLE_LABEL,
    FOOT_COLOURS,
    FOOT_NAMES,
    FOOT_STYLES,
    RIGHT,
    SHADE,
    STYLE,
    mark_phases,
    name_phases,
    new_figure,
    second_scale,
    widen,
)
from human_gait.results.ours import our_folder
from human_gait.walk.described import gait_digest, no_walk
from human_gait.walk.gait_cycle import gait_cycle

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait

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


def save_plots(gait: Gait, folder: str | Path) -> None:
    """Write all pictures of a walk into a folder, as PNG: all of them or none."""
    with our_folder(Path(folder), solved=False) as new:
        for name in PLOTS:
            (new / f"{name}.png").write_bytes(plot(gait, name).png({"gait": gait_digest(gait)}))


@plain(STYLE)
def joint_torques(gait: Gait) -> Picture:
    """Return the torques of the right hip, knee and ankle over the gait cycle (Fig. 8)."""
    columns, mass = gait_cycle(gait), gait.body.subject.mass
    figure = new_figure(6.4, 6.6, left=0.105, bottom=0.067, right=0.9, top=0.927, hspace=0.186)
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


@plain(STYLE)
def joint_angles(gait: Gait) -> Picture:
    """Return the angles of pelvis, trunk and the right limbs over the gait cycle."""
    columns = gait_cycle(gait)
    figure = new_figure(
        9.6, 6.8, left=0.068, bottom=0.069, right=0.965, top=0.942, wspace=0.32, hspace=0.43
    )
    panels = figure.subplots(3, 4)
    for ax, (column, (joint, sign)) in zip(panels.flat, _ANGLES.items(), strict=False):
        mark_phases(ax, gait)
        ax.plot(columns["gait_cycle_percent"], columns[column], color=RIGHT)
        ax.set_title(f"{joint}\n{sign}", loc="left")
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_label_coords(0.5, 0.0)  # no place is looked for: they have no labels
        widen(ax, 10.0)
    figure.supxlabel(CYCLE_LABEL, fontsize=9.0)
    figure.supylabel("angle [deg]", fontsize=9.0)
    panels[-1, -1].axis("off")
    panels[-1, -1].legend(handles=_phase_handles(), loc="center left")
    return figure


def _phase_handles() -> list[Any]:
    return [
        Patch(color=SHADE, label="double support"),
        Line2D([], [], color=BLACK, linewidth=0.8, linestyle=(0, (2, 2)), label="right toe-off"),
        Line2D([], [], color=RIGHT, label="pelvis, trunk, right limbs"),
    ]


@plain(STYLE)
def ground_reaction(gait: Gait) -> Picture:
    """Return the vertical and the fore-aft ground reaction force of each foot."""
    columns, weight = gait_cycle(gait), gait.body.subject.mass * GRAVITY
    figure = new_figure(6.4, 5.4, left=0.105, bottom=0.082, right=0.89, top=0.911, hspace=0.19)
    panels = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for ax, (column, (name, sign)) in zip(panels, _FORCES.items(), strict=True):
        mark_phases(ax, gait)
        for f, force in enumerate((columns[column], half_a_cycle_later(columns[column]))):
            style: Any = {"color": FOOT_COLOURS[f], "linestyle": FOOT_STYLES[f]}
            ax.plot(columns["gait_cycle_percent"], force, label=FOOT_NAMES[f], **style)
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


PLOTS: Mapping[str, Callable[[Gait], Picture]] = {
    "stick_diagram": stick_diagram,
    "joint_torques": joint_torques,
    "joint_angles": joint_angles,
    "ground_reaction": ground_reaction,
    "zmp": zmp,
}
"""The pictures by the names of their files."""


def plot(gait: Gait, name: str) -> Picture:
    """Return a picture of a walk by its name.

    Raises
    ------
    ValueError
        If there is no such picture.
    """
    if name not in PLOTS:
        raise ValueError(f"no picture is called {name!r}: choose from {', '.join(PLOTS)}")
    with plain(STYLE):
        figure = PLOTS[name](gait)
        if warning := no_walk(gait):
            figure.set_layout_engine("constrained")  # there is one line more
            warn_on(figure, warning)
        return figure
