"""The page of a walk inside a notebook: what a cell shows as its value."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from html import escape

HEIGHT = 480  # [px]


@dataclass(frozen=True, repr=False)
class InlinePage:
    """A page that a notebook shows as the value of a cell; it needs no server and no other file.

    Attributes
    ----------
    page : str
        A whole HTML page.
    title : str
        What it shows.
    height : int, [px]
    """

    page: str
    title: str
    height: int = HEIGHT

    def __repr__(self) -> str:
        return f"<the walk of {self.title}, shown where HTML can be>"

    def _repr_html_(self) -> str:
        # a frame without rights: what the page does stays in it
        return (
            f'<iframe srcdoc="{escape(self.page)}" title="{escape(self.title)}" '
            f'sandbox="allow-scripts" width="100%" height="{self.height}" '
            'style="border:0"></iframe>'
        )


def in_notebook() -> bool:
    """Return whether this is the kernel of a notebook, whose cells show HTML.

    IPython in a terminal has no kernel and shows none. IPython need not be installed.
    """
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython else None
    return getattr(shell, "kernel", None) is not None
