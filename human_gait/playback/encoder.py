"""Which ffmpeg writes films: that of the package imageio-ffmpeg, else the one of the system."""

from __future__ import annotations

import shutil
from pathlib import Path

from human_gait.exceptions import ResultError


def encoder(target: Path) -> str:
    """Return the program that encodes films.

    Raises
    ------
    ResultError
        If there is none; it says how to get one.
    """
    try:
        from imageio_ffmpeg import get_ffmpeg_exe  # noqa: PLC0415, an extra that may be missing

        return str(get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        found = shutil.which("ffmpeg")
    if not found:
        message = "needs an encoder: install human-gait[film] or ffmpeg, or write a .gif"
        raise ResultError(f"{target}: {message}")
    return found
