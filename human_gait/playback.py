"""The walk in MeshCat: a page that opens without a server, or is shown live from this computer.

The page holds MeshCat's viewer and the commands of the scene, in their order.
"""

from __future__ import annotations

import contextlib
import errno
import html
import os
import sys
import threading
import webbrowser
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from human_gait.exceptions import ResultError
from human_gait.scene import COLOURS, scene_commands

if TYPE_CHECKING:
    from human_gait.gait import Gait

LOOPBACK = "127.0.0.1"
PORT = 7000  # MeshCat's; any free one if it is taken

STRIDES = 4
"""Strides in a row before the animation starts again where it began."""

_LEGEND = {
    "right": "right foot: footholds and ground reaction force",
    "left": "left foot: footholds and ground reaction force",
    "zmp": "zero moment point",
}


def play(gait: Gait, strides: int | None = None, host: str = LOOPBACK) -> None:
    """Show a walk in MeshCat: print its address on this computer, open a browser if there is one.

    Parameters
    ----------
    gait : Gait
    strides : int, optional
        Stop and return after so many strides; otherwise walk until Ctrl-C.
    host : str
        Address to listen on; by default this computer alone can connect.

    Raises
    ------
    ValueError
        If `strides` is less than 1.
    ResultError
        If this computer has no such address.
    """
    if strides is not None and strides < 1:
        raise ValueError(f"strides must be at least 1, not {strides}")
    page = playback_page(gait) if strides is None else playback_page(gait, 1, strides)
    with _page_server(page, host) as server, contextlib.suppress(KeyboardInterrupt):
        url = f"http://{host}:{server.server_port}/"
        print(f"MeshCat at {url}, Ctrl-C to stop", flush=True)  # noqa: T201, for who plays
        if has_screen():
            webbrowser.open(url)
        if strides is not None:
            bell = threading.Timer(2 * gait.step_time * strides, server.shutdown)
            bell.daemon = True
            bell.start()
        server.serve_forever()


def save_playback(gait: Gait, path: str | Path) -> None:
    """Write an HTML page that plays the walk and needs no server, no network and no other file."""
    Path(path).write_text(playback_page(gait), encoding="utf-8")


def playback_page(gait: Gait, strides: int = STRIDES, repetitions: float = float("inf")) -> str:
    """Return the HTML page that plays a walk.

    Parameters
    ----------
    gait : Gait
    strides : int
        Strides in a row in the animation.
    repetitions : float
        How often the page plays them; endlessly by default.
    """
    template = Template((files("human_gait.data") / "playback.html").read_text(encoding="utf-8"))
    viewer = files("meshcat") / "viewer" / "dist" / "main.min.js"
    item = '<li><i style="background: #{:06x}"></i>{}</li>'.format
    return template.substitute(
        title=html.escape(gait.scenario.name),
        caption=html.escape(_caption(gait)),
        legend="".join(item(COLOURS[name], text) for name, text in _LEGEND.items()),
        viewer=viewer.read_text(encoding="utf-8"),
        commands=",".join(f'"{command}"' for command in scene_commands(gait, strides, repetitions)),
    )


def has_screen() -> bool:
    """Return whether a browser can open a window here, not only in the terminal."""
    desktop = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform in {"darwin", "win32"} or any(os.environ.get(name) for name in desktop)


def _caption(gait: Gait) -> str:
    walk, subject, load = gait.scenario.walk, gait.body.subject, gait.body.load
    person = f"{subject.sex}, {subject.stature:g} m, {subject.mass:g} kg"
    carried = f", load {load.mass:g} kg" if load.mass > 0 else ""
    return f"{walk.speed:g} m/s, step {walk.step_length:g} m; {person}{carried}"


def _listening(host: str, handler: type[BaseHTTPRequestHandler]) -> ThreadingHTTPServer:
    if not host:
        raise OSError(errno.EINVAL, "it is empty")
    try:
        return ThreadingHTTPServer((host, PORT), handler)
    except OSError:
        return ThreadingHTTPServer((host, 0), handler)


@contextlib.contextmanager
def _page_server(page: str, host: str = LOOPBACK) -> Iterator[ThreadingHTTPServer]:
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
