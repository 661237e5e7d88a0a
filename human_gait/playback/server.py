"""A page shown live: a server of one page, by default to this computer only.

It answers who asks for it by its own name and nobody else: a page from elsewhere whose name was
made to lead here (DNS rebinding) is refused. Clients that are slow, silent or many cost it some
seconds and some threads, and one that goes away costs nothing.
"""

from __future__ import annotations

import contextlib
import errno
import io
import ipaddress
import os
import socket
import socketserver
import sys
import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, TypeAlias

from human_gait.exceptions import ResultError
from human_gait.playback.policy import NOTHING

LOOPBACK = "127.0.0.1"
PORT = 7000  # MeshCat's; any free one if it is taken

TO_ASK = 10.0  # [s] for a whole request
TO_READ = 60.0  # [s] for the whole answer
TO_LEAVE = 1.0  # [s]
CONNECTIONS = 32  # at a time; then the oldest has to go
MOST_ASKED = 2**17  # bytes of a request; a browser's has about 1000

Address: TypeAlias = ipaddress.IPv4Address | ipaddress.IPv6Address

_HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


def has_screen() -> bool:
    """Return whether a browser can open a window here, not only in the terminal."""
    desktop = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform in {"darwin", "win32"} or any(os.environ.get(name) for name in desktop)


class PageServer(ThreadingHTTPServer):
    """A server of one page to clients that need not be friendly.

    Parameters
    ----------
    family, address
        As `socket.getaddrinfo` gives them.
    host : str
        How its user calls the address.
    page, policy : str
        The page and its Content Security Policy.
    """

    request_queue_size = 128

    def __init__(self, family: int, address: Any, host: str, page: str, policy: str) -> None:
        self.address_family = family
        self.host, self.page, self.policy = host, page.encode(), policy
        self._open: dict[socket.socket, None] = {}  # the oldest first
        self._room = threading.BoundedSemaphore(CONNECTIONS)
        super().__init__(address, _Handler)

    def server_bind(self) -> None:
        """Bind without asking a name server what the address is called, which may take long."""
        socketserver.TCPServer.server_bind(self)
        address, self.server_port, *_ = self.socket.getsockname()
        self.server_name, self._bound = self.host, _address(address)

    @property
    def everywhere(self) -> bool:
        """Return whether other computers can connect, by any address of this one."""
        return self._bound.is_unspecified

    @property
    def url(self) -> str:
        """Return where a browser on this computer finds the page."""
        name = LOOPBACK if self.everywhere else _shown(self._bound)
        return f"http://{name}:{self.server_port}/"

    @property
    def url_elsewhere(self) -> str:
        """Return where a browser on another computer finds the page of a server `everywhere`."""
        return f"http://{socket.gethostname()}:{self.server_port}/"

    def hosts(self, local: str) -> set[str]:
        """Return what the server may be called by who has come in on one of its addresses.

        That address, and the name that its user gave; this computer's own where it listens on
        all addresses. No name that somebody else can give is among them.
        """
        address = _address(local)
        names = {_shown(address), self.host.lower()}
        if address.is_loopback:
            names |= {"localhost", LOOPBACK, "[::1]"}
        if self.everywhere:
            names.add(socket.gethostname().lower())
        with_port = {f"{name}:{self.server_port}" for name in names}
        return with_port | names if self.server_port == 80 else with_port

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer in a thread; the oldest connection makes room for one too many."""
        while not self._room.acquire(blocking=False):
            with contextlib.suppress(StopIteration, OSError, RuntimeError):
                next(iter(self._open)).shutdown(socket.SHUT_RDWR)
            time.sleep(0.001)
        self._open[request] = None
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        """Close a connection, and make room for another."""
        super().shutdown_request(request)
        if request in self._open:
            del self._open[request]
            self._room.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of clients that have gone away or are too slow."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    server: PageServer
    raw_requestline: bytes
    server_version, sys_version = "human-gait", ""

    def setup(self) -> None:
        super().setup()
        self.rfile.close()
        self.rfile = io.BufferedReader(_Until(self.connection, TO_ASK))

    def handle(self) -> None:
        self.handle_one_request()  # a browser that wants more comes again
        self._linger()

    def parse_request(self) -> bool:
        if len(self.raw_requestline.split()) == 3:
            return super().parse_request() and self._is_for_us()
        self.command = self.requestline = ""
        self.send_error(400)  # such as HTTP/0.9, which has no headers to judge it by
        return False

    def _is_for_us(self) -> bool:
        hosts = self.server.hosts(self.connection.getsockname()[0])
        named = self.headers.get_all("Host", [])
        origins = self.headers.get_all("Origin", [])
        if self.path.lower().startswith("http://"):
            authority, _, rest = self.path[len("http://") :].partition("/")
            named, self.path = [*named, authority], f"/{rest}"
        refused = {
            400: not named,
            421: any(name.lower() not in hosts for name in named),
            403: any(one.lower().removeprefix("http://") not in hosts for one in origins),
        }
        for status, applies in refused.items():
            if applies:
                self.send_error(status)
                return False
        return True

    def do_GET(self) -> None:
        place = self.path.partition("?")[0]
        if place == "/":
            self._answer(200, self.server.page, "text/html", self.server.policy)
        elif place == "/favicon.ico":
            self._answer(204)
        else:
            self.send_error(404)

    do_HEAD = do_GET  # noqa: N815, a name of the base class

    def send_error(self, code: int, *_: Any, **__: Any) -> None:
        """Refuse in a few words that hold nothing of what was sent."""
        code = 405 if code == 501 else code
        words = f"{code} {self.responses.get(code, ('Refused', ''))[0]}. "
        self._answer(code, f"{words}The walk is at {self.server.url}\n".encode(), "text/plain")

    def _answer(
        self, code: int, content: bytes = b"", kind: str = "", policy: str = NOTHING
    ) -> None:
        self.request_version = self.protocol_version  # whatever was asked in: there are headers
        self.send_response(code)
        self.send_header("Connection", "close")
        self.send_header("Content-Security-Policy", f"{policy}; frame-ancestors 'none'")
        for name, value in _HEADERS.items():
            self.send_header(name, value)
        if code == 405:
            self.send_header("Allow", "GET, HEAD")
        if content:
            self.send_header("Content-Type", f"{kind}; charset=utf-8")
            self.send_header("Content-Length", str(len(content)))
        self.connection.settimeout(TO_READ)  # of all that `sendall` sends, not of a part
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(content)

    def _linger(self) -> None:
        """Let the client read: what it still sends would break the connection before it has."""
        self.connection.shutdown(socket.SHUT_WR)
        rest = io.BufferedReader(_Until(self.connection, TO_LEAVE))
        while rest.read1(65536):
            pass

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002
        """Keep the terminal quiet."""


class _Until(io.RawIOBase):
    """What comes from a client within some time and of some size, in however many parts."""

    def __init__(self, connection: socket.socket, seconds: float) -> None:
        self._connection, self._end = connection, time.monotonic() + seconds
        self._left = MOST_ASKED

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        self._connection.settimeout(max(self._end - time.monotonic(), 1e-3))
        n = self._connection.recv_into(buffer, min(len(buffer), self._left)) if self._left else 0
        self._left -= n
        return n


def _address(name: str) -> Address:
    """Return an address without its zone; one of IPv4 written as IPv6 as what it is."""
    address = ipaddress.ip_address(name.partition("%")[0])
    return getattr(address, "ipv4_mapped", None) or address


def _shown(address: Address) -> str:
    return f"[{address}]" if address.version == 6 else str(address)


@contextlib.contextmanager
def page_server(page: str, host: str = LOOPBACK, policy: str = NOTHING) -> Iterator[PageServer]:
    """Serve one page, by default to this computer only.

    Raises
    ------
    ResultError
        If this computer has no such address.
    """
    try:
        server = _listening(page, host, policy)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is no name"
        message = f"--host = {host!r}: must be an address of this computer: {reason}"
        raise ResultError(message) from None
    with server:
        yield server


def _listening(page: str, host: str, policy: str) -> PageServer:
    """Return a server at the first address of a host that can be had, at any port if need be."""
    if not host:
        raise OSError(errno.EINVAL, "it is empty")
    refused = OSError(errno.EADDRNOTAVAIL, "it has none")
    for port in (PORT, 0):
        for family, _, _, _, address in socket.getaddrinfo(host, port, type=socket.SOCK_STREAM):
            try:
                return PageServer(family, address, host, page, policy)
            except OSError as error:
                refused = error
    raise refused
