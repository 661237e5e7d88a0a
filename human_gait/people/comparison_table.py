"""How a walk compares with measured people, as a table for a terminal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from human_gait.people.reference import Reference, Score
from human_gait.people.spatiotemporal import StepScore
from human_gait.walk.gait_cycle import label_and_unit

if TYPE_CHECKING:
    from human_gait.people.comparison import Comparison

_COLUMNS = (
    "r",
    "RMSE",
    "less\nmean",
    "predicted\nrange",
    "measured\nrange",
    "peak\n[%]",
    "in 1, 2\nSD [%]",
)
_UNITS = (
    "Angles in deg, moments (mom.) in N m/kg, forces in BW. RMSE as it is, and less the difference "
    "of the means; time of the peak, predicted and measured; share of the time within 1 and 2 SD."
)


def comparison_table(comparison: Comparison) -> Table:
    """Return the scores as a table, one section for each reference."""
    heading = f"{comparison.speed:.2f} m/s, steps of {comparison.step_length:.2f} m"
    title = f"Predicted against measured gait: {heading}"
    table = Table(
        title=Text("\n".join(filter(None, [comparison.no_walk, title]))),
        caption="\n".join(
            [
                _UNITS,
                *map(_extent, comparison.references),
                *map(_sentence, comparison.step_scores),
                *filter(None, [comparison.tuned_on]),
            ]
        ),
        caption_justify="left",
        box=SIMPLE_HEAD,
        padding=0,  # a row has room in 80 columns
        show_edge=False,
    )
    table.add_column("curve", overflow="fold")
    for name in _COLUMNS:
        table.add_column(name, justify="right", no_wrap=True)
    for reference in comparison.references:
        table.add_section()
        table.add_row(Text(", ".join(reference.label.split(", ")[:2]), style="bold"))
        for score in comparison.scores:
            if score.reference == reference.name:
                table.add_row(*_cells(score))
    return table


def _cells(score: Score) -> tuple[str, ...]:
    label, unit = label_and_unit(score.curve)
    digits = 1 if unit == "deg" else 2
    shares = (100.0 * score.within_1sd, 100.0 * score.within_2sd)
    banded = math.isfinite(score.within_1sd)
    return (
        label.replace("moment", "mom."),
        f"{score.r:.2f}" if math.isfinite(score.r) else "-",
        f"{score.rmse:.{digits}f}",
        f"{score.rmse_offset_free:.{digits}f}",
        _pair(score.predicted_range, digits),
        _pair(score.measured_range, digits),
        _pair((score.predicted_peak_percent, score.measured_peak_percent), 0),
        _pair(shares, 0) if banded else "-",
    )


def _pair(values: tuple[float, float], digits: int) -> str:
    return ", ".join(f"{value:.{digits}f}" for value in values)


def _extent(reference: Reference) -> str:
    return f"{reference.label}: {'stance' if reference.stance_only else 'gait cycle'}."


def _sentence(step: StepScore) -> str:
    return (
        f"{step.name.capitalize()} {step.predicted:.3g} {step.unit}, measured {step.measured:.3g}"
        f" ({step.lower:.3g} to {step.upper:.3g}): {step.basis}."
    )
