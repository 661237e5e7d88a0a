"""The gait cycle of a result over the measured curves, with their standard deviations."""

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.canvas import Artist, Axes, Picture, plain
from human_gait.people.reference import Cycle, MeasuredCurve, Reference, Score, scores, stance
from human_gait.walk.gait_cycle import label_and_unit

_DPI = 130
PREDICTED = "#D55E00"
_WARNING = "#B00020"
_MEASURED = (("#0072B2", "--"), ("#00795A", "-."), ("#A94E86", ":"))
"""Colours of Okabe and Ito (safe for the colour-blind), dark enough to be read, and styles."""

_OWN = (("#222222", "-"), ("#7A5C00", "--"), ("#4B3B8F", "-."), ("#5E5E5E", ":"))
"""The same of own trials, which follow the built-in ones."""


PANELS = (
    ("pelvis_tilt_anterior_deg", "pelvis_obliquity_up_deg", "pelvis_rotation_internal_deg"),
    ("hip_flexion_deg", "hip_adduction_deg", "hip_rotation_internal_deg"),
    ("knee_flexion_deg", "ankle_dorsiflexion_deg", "trunk_flexion_deg"),
    ("shoulder_flexion_deg", "elbow_flexion_deg", "hip_abduction_Nm_per_kg"),
    ("hip_extension_Nm_per_kg", "knee_extension_Nm_per_kg", "ankle_plantarflexion_Nm_per_kg"),
    ("vertical_up_BW", "foreaft_forward_BW", "mediolateral_medial_BW"),
)


@plain()
def compare_figure(cycle: Cycle, measured: Sequence[Reference], warning: str = "") -> Picture:
    """Draw every column of a gait cycle over the measured mean and its SD.

    Parameters
    ----------
    cycle : mapping of str to (101,) array
    measured : sequence of Reference
        One that covers stance only is stretched over the predicted stance.
    warning : str
        Why it is no walk.

    Raises
    ------
    ResultError
        If one covers stance only and the foot never stands.
    """
    figure = Picture(10.5, 14.5, _DPI, "constrained")
    axes = figure.subplots(len(PANELS), len(PANELS[0]), sharex=True)
    r = {(s.reference, s.curve): s for source in measured for s in scores(cycle, source)}
    for ax, column in zip(axes.flat, (name for row in PANELS for name in row), strict=True):
        draw_column(ax, column, cycle, measured)
        _correlations(ax, column, measured, r)
    for ax in axes[-1]:
        ax.set_xlabel("gait cycle of the right leg [%]")
    figure.align_ylabels(axes)
    _legend(figure, axes.flat)
    warn_on(figure, warning)
    return figure


def warn_on(figure: Picture, warning: str) -> None:
    """Write above a figure what is wrong with its walk, if anything is."""
    if not warning:
        return
    if figure.legends:  # a title would be in its place
        figure.legends[0].set_title(warning)
        text = figure.legends[0].get_title()
    else:
        text = figure.suptitle(warning)
    text.set(color=_WARNING, fontsize=10, fontweight="bold", parse_math=False)


def draw_column(ax: Axes, column: str, cycle: Cycle, measured: Sequence[Reference]) -> None:
    """Draw one column of a gait cycle over the measured means and a band of one SD around each."""
    label, unit = label_and_unit(column)
    ax.set_title(label[0].upper() + label[1:], fontsize=10, loc="left")
    ax.set_ylabel(f"[{unit}]", fontsize=9)
    ax.set_xlim(0, 100)
    ax.tick_params(labelsize=8)
    ax.axhline(0.0, color="0.8", linewidth=0.8, zorder=0)
    for reference, (colour, style) in zip(measured, _styles(), strict=False):
        if column in reference.curves:
            curve = reference.curves[column]
            percent = _over_cycle(curve, reference, cycle)
            below, above = curve.mean - curve.sd, curve.mean + curve.sd
            ax.fill_between(percent, below, above, color=colour, alpha=0.2, linewidth=0)
            band = "" if np.isnan(curve.sd).any() else ", mean ± SD"
            ax.plot(percent, curve.mean, style, color=colour, label=f"{reference.label}{band}")
    ax.plot(cycle["gait_cycle_percent"], cycle[column], color=PREDICTED, lw=2, label="predicted")


def _styles() -> Iterator[tuple[str, str]]:
    """Yield a colour and a style for each reference: three built-in ones, then any number."""
    yield from _MEASURED
    yield from itertools.cycle(_OWN)


def _over_cycle(curve: MeasuredCurve, reference: Reference, cycle: Cycle) -> FloatArray:
    if not reference.stance_only:
        return curve.percent
    start, end = stance(cycle)
    return start + curve.percent / 100.0 * (end - start)


def _correlations(
    ax: Axes,
    column: str,
    measured: Sequence[Reference],
    known: Mapping[tuple[str, str], Score],
) -> None:
    """Write r in the colour of each reference, from the right end leftwards, own ones inside."""
    beside = {True: 0, False: 0}
    for k, (reference, (colour, _)) in enumerate(zip(measured, _styles(), strict=False)):
        found = known.get((reference.name, column))
        if found and np.isfinite(found.r):
            own = k >= len(_MEASURED)  # inside the panel: above it is no more room
            right, at_height = (0.99, 0.91) if own else (1.0, 1.01)
            at = (right - 0.22 * beside[own], at_height)
            text = f"r = {found.r:.2f}"
            ax.annotate(text, at, xycoords="axes fraction", color=colour, fontsize=8, ha="right")
            beside[own] += 1


def _legend(figure: Picture, axes: Iterable[Axes]) -> None:
    """Name each line once, above all panels."""
    entries: dict[str, Artist] = {}
    for ax in axes:
        lines, names = ax.get_legend_handles_labels()
        entries |= dict(zip(names, lines, strict=True))
    labels = sorted(entries, key=lambda label: label != "predicted")
    figure.legend(
        [entries[label] for label in labels],
        labels,
        loc="outside upper center",
        ncols=2,
        fontsize=9,
    )
