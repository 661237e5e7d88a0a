r"""What reaches the terminal: text of files and names as it is read, never obeyed.

Whatever a command prints goes through here. Signs that a terminal would obey (escapes, other
controls, changes of the direction of writing) and halves of characters are written out as in
Python, ``\x1b``. Text is no markup. `screen` gives the console for tables; of escapes only its own
colours pass.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any
from unicodedata import category

if TYPE_CHECKING:
    from rich.console import Console

LONGEST_MESSAGE = 500
_LAYOUT = "\n\t"


def printable(text: str) -> str:
    """Return text with everything in it written out that a terminal would obey."""
    if text.isprintable():
        return text
    return "".join(sign if _harmless(sign) else _written_out(sign) for sign in text)


def one_line(message: object) -> str:
    """Return a message as one printable line of a readable length.

    A long one, such as of a long path, keeps its end, which has the reason.
    """
    line = printable(" ".join(str(message).split()))
    half = (LONGEST_MESSAGE - 3) // 2
    return line if len(line) <= LONGEST_MESSAGE else f"{line[:half]}...{line[-half:]}"


def say(text: str, *, error: bool = False, end: str = "\n") -> None:
    """Print text on standard output, or on standard error.

    Typer's echo would go past `careful` where the encoding is ASCII, and leave escapes out.
    """
    stream = sys.stderr if error else sys.stdout
    if stream:  # none where it is closed
        print(printable(text), end=end, file=stream, flush=True)


def complain(message: object, code: int) -> int:
    """Print one line on standard error and return the exit code."""
    if sys.stderr:  # none where it is closed
        print(f"error: {one_line(message)}", file=sys.stderr, flush=True)  # noqa: T201, that is it
    return code


class Printable:
    """A text stream that writes everything out which a terminal would obey.

    Parameters
    ----------
    stream : text stream
        Rich's consoles write to it as it is: `screen` is careful itself.
    """

    def __init__(self, stream: Any) -> None:
        self.rich_proxied_file = stream

    def write(self, text: str) -> int:
        """Write text; return its length."""
        self.rich_proxied_file.write(printable(text))
        return len(text)

    def writelines(self, lines: Any) -> None:
        """Write several texts."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.rich_proxied_file, name)


@contextmanager
def careful() -> Iterator[None]:
    """Have standard output and error write out what a terminal would obey."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (stream and Printable(stream) for stream in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def screen(**options: Any) -> Console:
    """Return a console for tables and live lines: no markup, and what it shows is printable.

    Options are those of Rich's consoles.
    """
    from rich.console import Console  # noqa: PLC0415, commands without tables do without
    from rich.segment import Segment  # noqa: PLC0415

    class Screen(Console):
        def render(self, *given: Any, **named: Any) -> Iterator[Segment]:
            for part in super().render(*given, **named):
                text = part.text if part.control else printable(part.text)
                yield Segment(text, part.style, part.control)

    return Screen(markup=False, highlight=False, emoji=False, **options)


def _harmless(sign: str) -> bool:
    return sign.isprintable() or sign in _LAYOUT or category(sign) == "Zs"


def _written_out(sign: str) -> str:
    return sign.encode("unicode_escape").decode("ascii")
