"""Words in a picture: names of walkers, phases, and that something is no walk."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from matplotlib import get_data_path
from PIL import Image, ImageDraw, ImageFont

_INK, _PAPER = (32, 38, 45), (255, 255, 255)
_WARNING = (179, 38, 30)


@cache
def _font(size: int) -> ImageFont.FreeTypeFont:
    """Return the font that matplotlib brings along: the same everywhere."""
    return ImageFont.truetype(Path(get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf", size)


def labelled(picture: Image.Image, names: Sequence[str], at_top: bool = True) -> Image.Image:
    """Write names into a picture, each over its share of the width."""
    pen, width = ImageDraw.Draw(picture), picture.width / max(len(names), 1)
    font = _font(max(picture.height // 32, 11))
    for k, name in enumerate(names):
        room = width - 0.5 * font.size
        shown = _cut(name, font, room)
        y = 0.5 * font.size if at_top else picture.height - 1.7 * font.size
        pen.text(((k + 0.5) * width, y), shown, fill=_INK, font=font, anchor="ma")
    return picture


def banner(picture: Image.Image, words: str) -> Image.Image:
    """Write a warning across the foot of a picture, in as many lines as it needs."""
    if not words:
        return picture
    font = _font(max(picture.height // 32, 11))
    lines = _lines(words, font, picture.width - 2 * font.size)
    pen, step = ImageDraw.Draw(picture), 1.3 * font.size
    top = picture.height - step * len(lines) - 0.6 * font.size
    pen.rectangle((0, top, picture.width, picture.height), fill=_WARNING)
    for k, line in enumerate(lines):
        y = top + 0.3 * font.size + k * step
        pen.text((picture.width / 2, y), line, fill=_PAPER, font=font, anchor="ma")
    return picture


def _lines(words: str, font: ImageFont.FreeTypeFont, room: float) -> list[str]:
    lines = [""]
    for word in words.split():
        longer = f"{lines[-1]} {word}".strip()
        if font.getlength(longer) <= room or not lines[-1]:
            lines[-1] = longer
        else:
            lines.append(word)
    return [_cut(line, font, room) for line in lines]


def _cut(text: str, font: ImageFont.FreeTypeFont, room: float) -> str:
    shown = "".join(sign if sign.isprintable() else "?" for sign in text)
    while shown and font.getlength(shown) > room:
        shown = shown.rstrip("\N{HORIZONTAL ELLIPSIS}")[:-1] + "\N{HORIZONTAL ELLIPSIS}"
        if len(shown) == 1:
            break
    return shown
