"""The ground that every picture is drawn on: matplotlib's own defaults, whatever a user has set.

All modules that draw take matplotlib from here. Its settings are asked while a figure is made and
again while it is drawn: both happen within `plain`, and a `Picture` sees to the latter by itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

from human_gait.surroundings import importing_matplotlib

with importing_matplotlib():
    import matplotlib as mpl
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Circle, Patch, Polygon

__all__ = ["Artist", "Axes", "Circle", "Figure", "Line2D", "Patch", "Picture", "Polygon", "plain"]

FONT = Path(mpl.get_data_path(), "fonts", "ttf", "DejaVuSans.ttf")
"""The font that matplotlib brings along: the same everywhere."""

_PACKED = 3  # of 9: quicker than 6, and an eighth larger
SOURCE = "human_gait"
"""What the metadata of a picture name as its source."""

_DEFAULTS = {key: mpl.rcParamsDefault[key] for key in mpl.rcParamsDefault if key != "backend"}


_in_force: ContextVar[Mapping[str, Any] | None] = ContextVar("style", default=None)


@contextmanager
def plain(style: Mapping[str, Any] | None = None) -> Iterator[None]:
    """Draw with the defaults of matplotlib and a style, and leave its settings as they were.

    Within another `plain` the style adds to that one.
    """
    outer, own = _in_force.get(), dict(style or {})
    token = _in_force.set({**(outer or {}), **own})
    try:
        settings: Any = own if outer is not None else _DEFAULTS | own
        with mpl.rc_context(settings):
            yield
    finally:
        _in_force.reset(token)


class Picture(Figure):
    """A figure that looks the same wherever it is shown or saved, and does not know pyplot.

    It keeps the style that it is made in.

    Parameters
    ----------
    width, height : float, [inch]
    dpi : float
        Dots per inch where it is saved, if nothing else is asked for.
    layout : str, optional
        How matplotlib arranges its parts.
    """

    def __init__(
        self,
        width: float,
        height: float,
        dpi: float = 100.0,
        layout: Literal["constrained"] | None = None,
    ) -> None:
        self._style = dict(_in_force.get() or {})
        with plain(self._style):
            super().__init__(figsize=(width, height), dpi=dpi, layout=layout)
        FigureCanvasAgg(self)

    def draw(self, renderer: Any) -> None:
        """Draw it, in its own style."""
        with plain(self._style):
            super().draw(renderer)

    def savefig(self, fname: Any, **options: Any) -> None:
        """Write it, in its own style, as PNG unless the name or an option says otherwise."""
        with plain(self._style):
            super().savefig(fname, **options)

    def png(self, about: Mapping[str, str] | None = None) -> bytes:
        """Return it as the content of a PNG file, which tells its source and what else is given.

        Drawn once: matplotlib would draw a figure whose parts it arranges once more beforehand.
        """
        content = BytesIO()
        with plain(self._style):
            canvas: Any = FigureCanvasAgg(self)
            told = {"Source": SOURCE, **(about or {})}
            canvas.print_png(content, metadata=told, pil_kwargs={"compress_level": _PACKED})
        return content.getvalue()

    def _repr_png_(self) -> bytes:
        return self.png()
