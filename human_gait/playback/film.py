"""A walk as a file that others can see without us: a film, or a picture of one stride.

GIF is written by Pillow, MP4 by ffmpeg, PNG shows phases of the stride beside one another.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image, PngImagePlugin

from human_gait.exceptions import GaitError, ResultError
from human_gait.playback.encoder import encoder
from human_gait.playback.lettering import labelled, stacked, warning_strip
from human_gait.playback.picture import VIEWS, Walker, downscaled, stage_for
from human_gait.playback.still import strobe
from human_gait.results.folder import whole_file
from human_gait.results.names import FILM
from human_gait.results.ours import check_free, given_path
from human_gait.walk.described import gait_digest, no_walk
from human_gait.walk.gait_file import folder_of, gait_of

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait

Told = Callable[[int, int], None]

SUFFIXES = (".gif", ".mp4", ".png")
"""What a film can be written as."""

_RATE = 25  # frames per second, about: a stride has a whole number of them
_SIZE = (400, 500)  # of one walker, [px]
_STILL_HEIGHT = 480  # [px]
_SIZES = (64, 1920)  # that a picture can have, [px]
_LASTS = 8.0  # what a film that does not repeat itself takes at least, [s]
_COLOURS = 255


def film(
    gait: Gait | str | Path,
    path: str | Path | None = None,
    view: str = "quarter",
    size: tuple[int, int] | None = None,
    second: Gait | str | Path | None = None,
    progress: Told | None = None,
) -> Path:
    """Write a walk as a film, or as a picture of its phases, and return the path.

    It needs no display, no browser and no graphics card.

    Parameters
    ----------
    gait : Gait, str or Path
        A gait, or the folder of a result, or its ``gait.npz``.
    path : str or Path, optional
        ``.gif``: one stride, again and again; ``.mp4``: some strides, which needs ffmpeg or the
        package imageio-ffmpeg; ``.png``: phases of a stride beside one another. If left out
        ``walk.gif`` in the folder of the result, else in ``out``.
    view : str
        ``side``, ``front`` or ``quarter``.
    size : (int, int), optional, [px]
        Width and height of the film, or of each phase in a PNG.
    second : Gait, str or Path, optional
        Another walk, shown beside it at the same phase of the stride.
    progress : function, optional
        Is told how many frames of how many are drawn.

    Returns
    -------
    Path

    Raises
    ------
    GaitError
        If the suffix, the view or the size is none of those that there are.
    ResultError
        If there is no gait that can be read, or no encoder, or the file cannot be written.
    """
    target = _target(gait, path)
    if path is None:
        check_free(target.parent, [target.name])
    suffix = target.suffix.lower()
    _check(target, view, size)
    encode = encoder(target) if suffix == ".mp4" else ""
    given = [gait] if second is None else [gait, second]
    gaits = [gait_of(one) for one in given]
    walkers = [Walker(one) for one in gaits]
    told = _said_of(gaits)
    with whole_file(target) as file:
        if suffix == ".png":
            _write_png(strobe(gaits, view, size), file, told)
            return target
        stride = 2 * gaits[0].step_time
        n = max(round(_RATE * stride), 2)
        frames = _frames(walkers, view, size or _SIZE, n, progress)
        if suffix == ".gif":
            _write_gif(list(frames), file, stride, told)
        else:
            _write_mp4(list(frames), file, stride, told, encode)
    return target


def size_named(text: str) -> tuple[int, int]:
    """Return the size that is written as ``480x600``."""
    found = re.fullmatch(r"(\d{1,6})[xX](\d{1,6})", text)
    if not found:
        raise GaitError(f"--size = {text!r}: must be WIDTHxHEIGHT in pixels, as 480x600")
    return int(found[1]), int(found[2])


def _target(gait: Gait | str | Path, path: str | Path | None) -> Path:
    if path is not None:
        return given_path(path)
    return (folder_of(gait) if isinstance(gait, str | Path) else Path("out")) / FILM


def _check(target: Path, view: str, size: tuple[int, int] | None) -> None:
    if target.suffix.lower() not in SUFFIXES:
        raise GaitError(f"{target}: a film ends in {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}")
    if view not in VIEWS:
        raise GaitError(f"--view = {view!r}: must be {', '.join(VIEWS)}")
    low, high = _SIZES
    if size is not None and not all(low <= length <= high for length in size):
        width, height = size
        raise GaitError(f"--size = {width}x{height}: both must be from {low} to {high} pixels")


def _said_of(gaits: Sequence[Gait]) -> str:
    """Return what a file says of its walks, in one line."""
    digests = [f"gait={gait_digest(one)}" for one in gaits]  # first: a comment may be cut
    names = " and ".join(one.scenario.name for one in gaits)
    said = " ".join(["human-gait", *digests, f"{names}.", *filter(None, map(no_walk, gaits))])
    return "".join(sign if sign.isprintable() else "?" for sign in said)  # on one line


def _frames(
    walkers: Sequence[Walker], view: str, size: tuple[int, int], n: int, progress: Told | None
) -> Iterator[Image.Image]:
    """Yield n pictures of a stride, at even phases; the first follows the last."""
    width, height = size
    words = " ".join(dict.fromkeys(filter(None, (no_walk(one.gait) for one in walkers))))
    warning = warning_strip(width // len(walkers) * len(walkers), height, words)
    each = (width // len(walkers), height - warning.height)
    stage = stage_for(walkers, view, each)
    names = [one.gait.scenario.name for one in walkers] if len(walkers) > 1 else []
    for k in range(n):
        drawn = [downscaled(stage.draw(one, k / n)) for one in walkers]
        picture = Image.fromarray(np.concatenate(drawn, axis=1))
        yield stacked([labelled(picture, names), warning])
        if progress:
            progress(k + 1, n)


def _write_png(picture: Image.Image, file: Path, told: str) -> None:
    about = PngImagePlugin.PngInfo()
    about.add_text("Comment", told)
    picture.save(file, format="PNG", pnginfo=about, optimize=True)


def _write_gif(frames: list[Image.Image], file: Path, stride: float, told: str) -> None:
    """Write frames that repeat for ever; durations are hundredths of a second."""
    width, height = frames[0].size
    some = Image.new("RGB", (width, 4 * height))  # to choose the colours from
    for k in range(4):
        some.paste(frames[k * len(frames) // 4], (0, k * height))
    colours = some.quantize(_COLOURS, dither=Image.Dither.NONE)
    first, *rest = [frame.quantize(palette=colours, dither=Image.Dither.NONE) for frame in frames]
    ends = [round(100 * stride * k / len(frames)) for k in range(len(frames) + 1)]
    first.save(
        file,
        format="GIF",
        save_all=True,
        append_images=rest,
        duration=[10 * (end - start) for start, end in pairwise(ends)],
        loop=0,
        comment=told.encode("utf-8", "replace")[:255],
    )


def _write_mp4(
    frames: list[Image.Image], file: Path, stride: float, told: str, program: str
) -> None:
    """Write some strides as H.264, whose width and height are even."""
    width, height = (length // 2 * 2 for length in frames[0].size)
    rate = Fraction(len(frames) / stride).limit_denominator(1000)
    command = [
        *(program, "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"),
        *("-s", f"{width}x{height}", "-r", str(rate), "-i", "-", "-an", "-c:v", "libx264"),
        *("-vf", f"loop={ceil(_LASTS / stride) - 1}:{len(frames)}:0"),
        *("-crf", "20", "-pix_fmt", "yuv420p", "-movflags", "+faststart"),
        *("-metadata", f"comment={told}", "-f", "mp4", str(file)),
    ]
    content = b"".join(frame.crop((0, 0, width, height)).tobytes() for frame in frames)
    ended = subprocess.run(command, input=content, capture_output=True, check=False)
    if ended.returncode:
        said = ended.stderr.decode(errors="replace").strip().splitlines() or ["no reason given"]
        raise ResultError(f"{program} cannot encode the film: {said[-1]}")
