"""Files of a result that are read, and what is said where one cannot be."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from human_gait.exceptions import ResultError

T = TypeVar("T")

AGAIN = "predict it again"
"""What helps where a file of a result cannot be used."""


def read_json(path: Path, restore: Callable[[Any], T]) -> T:
    """Return what `restore` makes of the content of a JSON file of a result.

    Raises
    ------
    ResultError
        If the file is missing or cannot be read, or `restore` cannot make anything of it.
    """
    try:
        return restore(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise ResultError(f"{path.parent}: no {path.name}: {AGAIN}") from None
    except OSError as error:
        raise ResultError(f"{path}: cannot be read: {error.strerror}") from None
    except KeyError as error:
        raise ResultError(f"{path}: has no {error.args[0]}, {AGAIN}") from None
    except (AttributeError, TypeError, ValueError, ZeroDivisionError, RecursionError):
        raise ResultError(f"{path}: is damaged, {AGAIN}") from None
