"""A still of a walk for paper: phases of one stride beside one another, on white."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from human_gait.playback.lettering import stacked, titled, warning_strip
from human_gait.playback.picture import Stage, Walker, cell_width, downscaled, stage_for
from human_gait.walk.described import no_walk

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait

_PHASES = 6
_HEIGHT, _SMALL = 480, 240  # [px]
_COLOURS, _FEW = 192, 48


def strobe(
    gaits: Sequence[Gait],
    view: str = "side",
    size: tuple[int, int] | None = None,
    height: int = _HEIGHT,
    called: Sequence[str] = (),
) -> Image.Image:
    """Return phases of one stride of each walk beside one another, a row for each walk.

    Parameters
    ----------
    gaits : sequence of Gait
    view : str
        One of `picture.VIEWS`.
    size : (int, int), optional, [px]
        Of one phase; otherwise as wide as the walkers need.
    height : int, [px]
        Of one phase, if there is no size.
    called : sequence of str
        What several walks are called; else by their scenarios.
    """
    walkers = [Walker(gait) for gait in gaits]
    each = size or (cell_width(walkers, view, height), height)
    stage = stage_for(walkers, view, each, plain=True)
    names = [*called] or [gait.scenario.name for gait in gaits]
    rows = [
        _row(stage, walker, name if len(walkers) > 1 else "")
        for walker, name in zip(walkers, names, strict=True)
    ]
    return stacked(rows)


def _row(stage: Stage, walker: Walker, name: str) -> Image.Image:
    phases = np.arange(_PHASES) / _PHASES
    drawn = [downscaled(stage.draw(walker, phase)) for phase in phases]
    row = Image.fromarray(np.concatenate(drawn, axis=1))
    heads = [f"{100 * phase:.0f} %" for phase in phases]
    warning = warning_strip(row.width, row.height, no_walk(walker.gait))
    return stacked([titled(row, [[name]] * bool(name) + [heads]), warning])


def still_address(gaits: Sequence[Gait], called: Sequence[str] = ()) -> str:
    """Return the still of walks as a small PNG in a data URI, for a page that loads nothing."""
    picture = strobe(gaits, height=_SMALL, called=called).quantize(_FEW, dither=Image.Dither.NONE)
    content = BytesIO()
    picture.save(content, format="PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(content.getvalue()).decode('ascii')}"
