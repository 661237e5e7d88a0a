"""Names that are looked up where they are used, not where their module is imported.

Two things need that: the package itself, whose import stays quick, and a `Gait`, whose methods
reach what is made of a gait (exports, pictures, tables) without depending on it.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

PACKAGE = __name__.rpartition(".")[0]


def late(module: str, name: str) -> Any:
    """Return what `name` is in a module of this package, which is imported now.

    Parameters
    ----------
    module : str
        As seen from the package, such as ``walk.gait``.
    name : str
    """
    return getattr(import_module(f"{PACKAGE}.{module}"), name)
