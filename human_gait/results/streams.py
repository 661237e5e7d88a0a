"""Standard output and error that may lose their reader (``| head``) or their disk."""

from __future__ import annotations

import errno
import io
import os
from typing import Any, ClassVar


class Outlet(io.FileIO):
    """A file that falls silent at the first failure to write; work goes on and is not lost.

    Attributes
    ----------
    failure : str
        Why output was lost, of whichever outlet; empty if only nobody wanted to read on.
    """

    failure: ClassVar[str] = ""

    def write(self, content: Any) -> int:
        """Write, or from the first failure on only pretend to."""
        try:
            return super().write(content) or 0
        except OSError as error:
            if error.errno not in (errno.EPIPE, errno.EIO):  # EIO: the terminal was closed
                Outlet.failure = error.strerror or str(error)
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            return len(content)


def outlet(stream: Any) -> Any:
    """Return a text stream to where a standard one leads, through an `Outlet`."""
    buffer = getattr(stream, "buffer", None)
    if not isinstance(getattr(buffer, "raw", buffer), io.FileIO):
        return stream  # closed, or replaced by whoever runs us
    file = Outlet(stream.fileno(), "w", closefd=False)
    return io.TextIOWrapper(
        file if buffer is getattr(buffer, "raw", buffer) else io.BufferedWriter(file),
        encoding=stream.encoding,
        errors="backslashreplace",  # what the terminal has no signs for
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )
