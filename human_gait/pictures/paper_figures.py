"""Figures 7 to 12 of the paper, drawn from the results of its walks.

By the default formulation, or by that of the original study, of results with `PAPER` in front.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path

from human_gait.canvas import SOURCE, Axes, Picture, plain
from human_gait.exceptions import ResultError
from human_gait.people.pictures import draw_column, warn_on
from human_gait.people.reference import references, scores
from human_gait.pictures.backpacks import (
    PANEL_LETTERS,
    backpack_postures,
    knee_torques,
    vertical_forces,
)
from human_gait.pictures.plots import joint_torques
from human_gait.pictures.sticks import stick_diagram
from human_gait.pictures.style import STYLE, new_figure
from human_gait.results.names import GAIT_FILE, SUMMARY
from human_gait.results.ours import our_folder
from human_gait.results.reading import read_json
from human_gait.scenario import Load, Scenario
from human_gait.walk.belonging import own_gait
from human_gait.walk.described import gait_digest, no_walk
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import gait_cycle
from human_gait.walk.gait_file import load_gait

MAKE_TARGETS: Mapping[str, str] = {
    "normal": "normal",
    "preferred": "preferred",
    "backpack-0": "backpack",
    "backpack-20": "backpack",
    "backpack-40": "backpack",
}
"""The results that the figures need, and the Make target that makes each."""

PAPER = "paper-"
"""What results by the formulation of the original study begin with; each has its own target."""

_BACKPACKS = ("backpack-0", "backpack-20", "backpack-40")
_VALIDATED = {
    "knee_flexion_deg": "knee, flexion +",
    "ankle_dorsiflexion_deg": "ankle, dorsiflexion +",
}
_SVG = {"svg.fonttype": "none", "svg.hashsalt": "human_gait"}  # text as text, the same every time


def save_figures(results: str | Path, folder: str | Path, prefix: str = "") -> list[Path]:
    """Draw all figures from the results and write each into a folder, as PNG and as SVG.

    Parameters
    ----------
    results, folder : path
        The folder of the result folders, and the one to write to.
    prefix : str
        What the names of the results begin with, `PAPER` or nothing.

    Returns
    -------
    list of Path
        The files, 12.

    Raises
    ------
    ResultError
        If a result is missing or cannot be read, or the files cannot be written: none is then.
    """
    gaits, target = load_results(results, prefix), Path(folder)
    drawn: dict[str, bytes] = {}
    for name, (draw, needed) in FIGURES.items():
        walks = [gaits[result] for result in needed]
        digests = " ".join(map(gait_digest, walks))
        with plain(_SVG):
            figure, svg = draw(*walks), BytesIO()
            warn_on(figure, next(filter(None, map(no_walk, walks)), ""))
            about = {"Date": None, "Source": SOURCE, "Identifier": digests}
            figure.savefig(svg, format="svg", metadata=about)
        drawn |= {f"{name}.png": figure.png({"gait": digests}), f"{name}.svg": svg.getvalue()}
    with our_folder(target, solved=False) as new:
        for name, content in drawn.items():
            (new / name).write_bytes(content)
    return [target / name for name in drawn]


def failed_results(results: str | Path, prefix: str = "") -> list[Path]:
    """Return the folders of results that are no walk, as far as they know."""
    folders = [Path(results) / f"{prefix}{name}" for name in MAKE_TARGETS]
    return [folder for folder in folders if no_walk(load_gait(folder)) or _failed(folder / SUMMARY)]


def _failed(summary: Path) -> bool:
    return summary.is_file() and read_json(summary, {"success": bool})["success"] is False


def load_results(results: str | Path, prefix: str = "") -> dict[str, Gait]:
    """Return the walks of the result folders that the figures need, by name without prefix.

    Raises
    ------
    ResultError
        If one is missing or cannot be read, or has a file of another walk, or if the walks with a
        backpack differ in more than the load.
    """
    folders = {name: Path(results) / f"{prefix}{name}" for name in MAKE_TARGETS}
    missing = [name for name, folder in folders.items() if not (folder / GAIT_FILE).is_file()]
    if missing:
        targets = {name: folders[name].name if prefix else MAKE_TARGETS[name] for name in missing}
        places = ", ".join(f"{folders[name]} (make {target})" for name, target in targets.items())
        raise ResultError(f"no {GAIT_FILE} in {places}")
    gaits = {name: own_gait(folder) for name, folder in folders.items()}
    for name in _BACKPACKS[1:]:
        if _walk(gaits[name]) != _walk(gaits[_BACKPACKS[0]]):
            first = folders[_BACKPACKS[0]]
            raise ResultError(f"{folders[name]}: differs in more than the load from {first}")
    return gaits


def _walk(gait: Gait) -> Scenario:
    """Return what has to be the same where loads are compared: all but name and load."""
    return replace(gait.scenario, name="any", load=Load())


@plain(STYLE)
def validation(gait: Gait) -> Picture:
    """Return knee and ankle angle over measured means and standard deviations (Fig. 12)."""
    cycle, figure = gait_cycle(gait), new_figure(9.6, 4.2)
    measured = [source for source in references() if not source.stance_only]
    panels = figure.subplots(1, len(_VALIDATED))
    for k, (column, title) in enumerate(_VALIDATED.items()):
        ax = panels[k]
        draw_column(ax, column, cycle, measured)
        ax.set_title(f"({PANEL_LETTERS[k]}) {title}", loc="left")
        ax.set_xlabel("gait cycle from heel strike [%]")
        ax.set_ylabel("angle [deg]")
        r = [s.r for source in measured for s in scores(cycle, source) if s.curve == column]
        _legend_with_r(ax, r, gait.scenario.walk.speed)
    return figure


def _legend_with_r(ax: Axes, r: Sequence[float], speed: float) -> None:
    """Name the curves above a panel, the predicted one with its speed, the measured with r."""
    _, *means, predicted = ax.get_lines()  # the first is that of zero
    bands = list(zip(ax.collections, means, strict=True))
    for band, mean in bands:  # an outline keeps overlapping bands apart in grey
        colour = mean.get_color()
        band.set(alpha=None, facecolor=(colour, 0.2), edgecolor=(colour, 0.7), linewidth=0.6)
    names = [f"{mean.get_label()}, r = {value:.2f}" for mean, value in zip(means, r, strict=True)]
    names.insert(0, f"predicted, {speed:.2f} m/s")
    ax.legend([predicted, *bands], names, loc="lower left", bbox_to_anchor=(0.0, 1.08))


FIGURES: Mapping[str, tuple[Callable[..., Picture], tuple[str, ...]]] = {
    "fig07_stick_diagram": (stick_diagram, ("normal",)),
    "fig08_joint_torques": (joint_torques, ("normal",)),
    "fig09_backpack_postures": (backpack_postures, _BACKPACKS),
    "fig10_vertical_forces": (vertical_forces, _BACKPACKS),
    "fig11_knee_torques": (knee_torques, _BACKPACKS),
    "fig12_validation": (validation, ("preferred",)),
}
"""The figures by file name: how each is drawn, and the results that it takes."""
