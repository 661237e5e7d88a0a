"""Words in a picture: names of walkers, phases, and that something is no walk."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from PIL import Image, ImageDraw, ImageFont

from human_gait.canvas import FONT

_LINE = 1.3  # of the size of a letter
_INK, _PAPER = (32, 38, 45), (255, 255, 255)
_WARNING = (179, 38, 30)


@cache
def _font(size: int) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(FONT, size)


def labelled(picture: Image.Image, names: Sequence[str], line: int = 0) -> Image.Image:
    """Write names into a picture, each over its share of the width, in a line from the top."""
    font, width = _font_for(picture), picture.width / max(len(names), 1)
    pen = ImageDraw.Draw(picture)
    for k, name in enumerate(names):
        shown = _cut(name, font, width - 0.5 * font.size)
        place = ((k + 0.5) * width, (0.5 + _LINE * line) * font.size)
        pen.text(place, shown, fill=_INK, font=font, anchor="ma")
    return picture


def titled(picture: Image.Image, lines: Sequence[Sequence[str]]) -> Image.Image:
    """Return a picture with lines of names on white over it, each over its share of the width."""
    height = round((0.5 + _LINE * len(lines)) * _font_for(picture).size)
    head = Image.new("RGB", (picture.width, height), _PAPER)
    whole = stacked([head, picture])
    for k, names in enumerate(lines):
        labelled(whole, names, k)
    return whole


def warning_strip(width: int, height: int, words: str) -> Image.Image:
    """Return a red strip that warns, for a picture of a size, [px]; without words it is empty."""
    font = _font(max(height // 32, 11))
    step, edge, room = _LINE * font.size, 0.3 * font.size, width - 2 * font.size
    most = max(int(height / 3 / step), 1)
    lines = _lines(words, font, room) if words else []
    if len(lines) > most:
        lines[most - 1 :] = [_cut(" ".join(lines[most - 1 :]), font, room)]
    tall = round(step * len(lines) + 2 * edge) if lines else 0
    strip = Image.new("RGB", (width, tall), _WARNING)
    pen = ImageDraw.Draw(strip)
    for k, line in enumerate(lines):
        pen.text((width / 2, edge + k * step), line, fill=_PAPER, font=font, anchor="ma")
    return strip


def stacked(pictures: Sequence[Image.Image]) -> Image.Image:
    """Return pictures of one width above one another."""
    whole = Image.new("RGB", (pictures[0].width, sum(one.height for one in pictures)))
    top = 0
    for one in pictures:
        whole.paste(one, (0, top))
        top += one.height
    return whole


def _font_for(picture: Image.Image) -> ImageFont.FreeTypeFont:
    return _font(max(picture.height // 32, 11))


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
