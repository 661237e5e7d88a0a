"""What a result folder says about itself: what shapes its walk, or why there is none.

Read from `explanation.json` and `summary.json` alone; no solver is imported.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table

from human_gait.results.names import EXPLANATION, SUMMARY
from human_gait.results.reading import read_json
from human_gait.results.shapes import EXPLANATION_SHAPE, VERDICT

_SHOWN = 15
_NOTE = (
    "\nCost is the objective. What a bound would save is estimated to first order, for one bound "
    "at a time, given more room throughout the step. 'Most at' is the time from left heel strike "
    "(0 %) to right heel strike (100 %); the right foot swings. In the next step left and right "
    "change places."
)


def explained(folder: Path, measured: str = "") -> RenderableType:
    """Return the table of what shapes a walk, or the diagnosis of a solve that found none.

    Of a walk that was `measured`, in a sentence, there is nothing to explain but that.

    Raises
    ------
    ResultError
        If a file is missing, as in results of older versions, or damaged.
    """
    if measured:
        return (
            f"{measured}\nNothing was optimised: people walk like this, no bound of ours shapes it."
        )
    failure = _failure(read_json(folder / SUMMARY, VERDICT))
    return failure or _shapes(read_json(folder / EXPLANATION, EXPLANATION_SHAPE))


def diagnosis_text(diagnosis: dict[str, Any]) -> str:
    """Return the ``diagnosis`` of a summary as lines: what is not kept, and what to try."""
    lines = [f"  {line}" for line in diagnosis["not_kept"]]
    tries = [f"  {one['key']}: {one['change']} ({one['because']})" for one in diagnosis["try"]]
    kept = "every constraint is kept, but the solver stopped before the optimum"
    parts = ["not kept:", *lines] if lines else [kept]
    return "\n".join([*parts, "try:", *tries] if tries else parts)


def _failure(summary: dict[str, Any]) -> str:
    """Return the diagnosis of a solve that found no walk; nothing if it found one."""
    if summary["success"]:
        return ""
    diagnosis = summary.get("diagnosis")
    return diagnosis_text(diagnosis) if diagnosis else "no walk was found; why is not recorded"


def _shapes(explanation: dict[str, Any]) -> Group:
    shapes, step_time = explanation["shapes"], float(explanation["step_time_s"])
    table = Table(title="What shapes this walk", title_justify="left", box=SIMPLE_HEAD, padding=0)
    table.show_edge = False  # a row has room in 80 columns
    for column in ("bound", "most at", "more room", "saves"):
        table.add_column(column, justify="left" if column == "bound" else "right")
    for one in shapes[:_SHOWN]:
        at = f"{100.0 * float(one['time_s']) / step_time:.0f} %"
        saved = f"{100.0 * float(one['saving']):.2f} %"
        table.add_row(f"{one['constraint']}: {one['what']}", at, str(one["step"]), saved)
    return Group(table, *_sentences(shapes))


def _sentences(shapes: list[dict[str, Any]]) -> list[str]:
    """Return what the table means, in words."""
    if not shapes:
        return ["No bound costs anything worth mentioning."]
    most, left = shapes[0], len(shapes) - _SHOWN
    reasons = dict.fromkeys(str(one["meaning"]) for one in shapes[:_SHOWN])
    saved = f"{100.0 * float(most['saving']):.1f} % less"
    rows = [
        f"Most of all: {most['constraint']}, {most['what']}.",
        f"With {most['step']} more room the walk would cost {saved}.",
        f"It walks like this because {'; '.join(reasons)}.",
        _NOTE,
    ]
    return [*rows, f"{left} more bounds are in {EXPLANATION}."] if left > 0 else rows
