"""A page shown live: a server of one page, by default to this computer only."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from human_gait.exceptions import ResultError

LOOPBACK = "127.0.0.1"
PORT = 7000  # MeshCat's; any free one if it is taken


def has_screen() -> bool:
    """Return whether a browser can open a window here, not only in the terminal."""
    desktop = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform in {"darwin", "win32"} or any(os.environ.get(name) for name in desktop)


def _listening(host: str, handler: type[BaseHTTPRequestHandler]) -> ThreadingHTTPServer:
    if not host:
        raise OSError(errno.EINVAL, "it is empty")
    try:
        return ThreadingHTTPServer((host, PORT), handler)
    except OSError:
        return ThreadingHTTPServer((host, 0), handler)


@contextlib.contextmanager
def page_server(page: str, host: str = LOOPBACK) -> Iterator[ThreadingHTTPServer]:
    """Serve one page, by default to this computer only."""
    content = page.encode()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, format: str, *args: object) -> None:  # noqa: A002
            """Keep the terminal quiet."""

    try:
        server = _listening(host, Handler)
    except OSError as error:
        message = f"--host = {host!r}: must be an address of this computer: {error.strerror}"
        raise ResultError(message) from None
    with server:
        yield server
