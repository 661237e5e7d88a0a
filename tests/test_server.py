"""The live page and clients that are not friendly: each is refused, or ended after a while."""

import base64
import contextlib
import hashlib
import http.client
import socket
import struct
import threading
import time

import pytest

from human_gait.playback import server
from human_gait.playback.policy import content_policy
from human_gait.playback.server import page_server

PAGE = "<title>a walk</title>"
POLICY = content_policy(["a script"])


@contextlib.contextmanager
def serving(host="127.0.0.1", page=PAGE):
    with page_server(page, host, POLICY) as served:
        thread = threading.Thread(target=served.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield served
        finally:
            served.shutdown()
            thread.join()


@pytest.fixture(scope="module")
def served():
    with serving() as one:
        yield one


def connected(served, host="127.0.0.1"):
    client = socket.create_connection((host, served.server_port))
    client.settimeout(5)
    return client


def answer(served, text):
    """All that comes back for what is sent; {port} is that of the server."""
    with connected(served) as client:
        client.sendall(text.replace("{port}", str(served.server_port)).encode("latin-1"))
        got = b""
        while part := client.recv(65536):
            got += part
    return got.decode()


def status(served, text):
    return int(answer(served, text).split()[1])


def ask(line="GET / HTTP/1.1", *headers, host="127.0.0.1:{port}"):
    return "\r\n".join([line, f"Host: {host}", *headers, "", ""])


@pytest.mark.parametrize("host", ["127.0.0.1:{port}", "localhost:{port}", "LocalHost:{port}"])
def test_it_answers_by_its_own_names(served, host):
    assert answer(served, ask(host=host)).endswith(f"\r\n\r\n{PAGE}")


@pytest.mark.parametrize(
    "host",
    [
        *("elsewhere.example", "elsewhere.example:{port}", "127.0.0.1", "127.0.0.1:1"),
        *("localhost.elsewhere.example:{port}", "127.0.0.1:{port}.example", "", "a\x1b[2J\xe9"),
        *("localhost:{port}, evil.example", "evil@localhost:{port}", "2130706433:{port}"),
    ],
)
def test_it_does_not_answer_by_another_name(served, host):
    got = answer(served, ask(host=host))
    assert got.split()[1] == "421"
    assert PAGE not in got
    assert "evil" not in got
    assert "\x1b" not in got


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("GET / HTTP/1.0\r\n\r\n", 400),  # no Host
        ("GET /\r\n\r\n", 400),  # HTTP/0.9
        ("GET  /  HTTP/1.1 more\r\n\r\n", 400),
        ("\x16\x03\x01\x02\x00\x01\r\n\r\n", 400),  # TLS
        (ask("GET / HTTP/1.1", "Host: evil.example"), 421),
        (ask("GET http://evil.example/ HTTP/1.1"), 421),
        (ask("GET http://localhost:{port}/ HTTP/1.1", host="evil.example"), 421),
        (ask("GET http://localhost:{port}/ HTTP/1.1"), 200),
        (ask("GET http://localhost:{port} HTTP/1.1"), 200),
        (ask("GET / HTTP/1.1", "Origin: http://evil.example"), 403),
        (ask("GET / HTTP/1.1", "Origin: null"), 403),
        (ask("GET / HTTP/1.1", "Origin: http://127.0.0.1:{port}"), 200),
        (ask("GET /?again HTTP/1.1"), 200),
        (ask("HEAD / HTTP/1.1"), 200),
        (ask("GET /favicon.ico HTTP/1.1"), 204),
        (ask("GET /../../etc/passwd HTTP/1.1"), 404),
        (ask("GET /%2e%2e/%2e%2e/etc/passwd HTTP/1.1"), 404),
        (ask("GET //etc/passwd HTTP/1.1"), 404),
        (ask("POST / HTTP/1.1", "Content-Length: 3") + "a=b", 405),
        (ask("OPTIONS * HTTP/1.1"), 405),
        (ask("CONNECT evil.example:443 HTTP/1.1"), 405),
        (ask("GET / HTTP/2.0"), 505),
        (ask("GET / HTTP/1.1", "A: " + 70_000 * "x"), 431),
        (ask("GET / HTTP/1.1", *(f"A{k}: x" for k in range(200))), 431),
        (ask(f"GET /{70_000 * 'x'} HTTP/1.1"), 414),
    ],
)
def test_every_answer_is_right_and_sealed(served, text, wanted):
    got = answer(served, text)
    head, _, content = got.partition("\r\n\r\n")
    assert int(head.split()[1]) == wanted
    assert (content == PAGE) == (wanted == 200 and "HEAD" not in text)
    headers = dict(line.split(": ", 1) for line in head.split("\r\n")[1:])
    assert headers["X-Frame-Options"] == "DENY"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["Content-Security-Policy"].startswith("default-src 'none'; ")
    assert headers["Content-Security-Policy"].endswith("; frame-ancestors 'none'")
    assert "Python" not in got
    if wanted == 200:
        assert headers["Content-Security-Policy"].startswith(POLICY)


def test_of_requests_in_a_row_the_first_is_answered(served):
    assert answer(served, 3 * ask()).count(PAGE) == 1


def test_a_large_body_does_not_cost_its_sender_the_answer(served):
    assert status(served, ask("POST / HTTP/1.1", "Content-Length: 60000") + 60_000 * "x") == 405


def test_clients_that_go_away_are_passed_over_in_silence(served, capfd):
    for _ in range(5):
        client = connected(served)
        client.sendall(ask(host=f"127.0.0.1:{served.server_port}").encode())
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        client.close()
    assert status(served, ask()) == 200
    time.sleep(0.1)
    assert capfd.readouterr() == ("", "")


def test_a_mistake_of_ours_is_not_passed_over(served, monkeypatch, capfd):
    monkeypatch.setattr(served, "hosts", lambda _: 1 / 0)
    assert answer(served, ask()) == ""
    assert "ZeroDivisionError" in capfd.readouterr().err


def ended(client):
    """Whether a connection is over."""
    with contextlib.suppress(OSError):
        while client.recv(65536):
            pass
    return True


def test_half_requests_take_few_threads_for_a_short_while(monkeypatch, capfd):
    monkeypatch.setattr(server, "TO_ASK", 1.0)
    monkeypatch.setattr(server, "TO_LEAVE", 0.1)
    before = threading.active_count()
    with serving() as served, contextlib.ExitStack() as open_ones:
        half = [open_ones.enter_context(connected(served)) for _ in range(300)]
        for client in half:
            with contextlib.suppress(OSError):  # it had to make room
                client.sendall(b"GET / HTTP/1.1\r\n")
        assert status(served, ask()) == 200  # all the same
        assert threading.active_count() - before <= 40
        assert all(map(ended, half))
        time.sleep(0.3)
        assert threading.active_count() - before <= 1
    assert capfd.readouterr() == ("", "")


def test_a_request_in_drops_has_no_more_time_than_another(monkeypatch):
    monkeypatch.setattr(server, "TO_ASK", 0.4)
    monkeypatch.setattr(server, "TO_LEAVE", 0.1)
    with serving() as served, connected(served) as client:
        begun = time.monotonic()
        with contextlib.suppress(OSError):
            for letter in ask() * 100:
                client.sendall(letter.encode())
                time.sleep(0.02)
        assert time.monotonic() - begun < 2


def test_who_reads_in_drops_is_left_after_a_while(monkeypatch):
    monkeypatch.setattr(server, "TO_READ", 0.4)
    monkeypatch.setattr(server, "TO_LEAVE", 0.1)
    before = threading.active_count()
    with serving(page=20_000_000 * "x") as served, connected(served) as client:
        client.sendall(ask(host=f"localhost:{served.server_port}").encode())
        for _ in range(60):
            client.recv(1)
            time.sleep(0.02)
        assert threading.active_count() - before <= 1


def test_it_ends_at_once_whoever_is_connected():
    with serving() as served:
        clients = [connected(served) for _ in range(20)]
        begun = time.monotonic()
    assert time.monotonic() - begun < 0.5
    for client in clients:
        client.close()


def has_ipv6():
    try:
        with socket.create_server(("::1", 0), family=socket.AF_INET6):
            return True
    except OSError:
        return False


@pytest.mark.skipif(not has_ipv6(), reason="needs IPv6")
@pytest.mark.parametrize(("host", "name"), [("::1", "[::1]"), ("::", "localhost")])
def test_it_can_listen_on_an_address_of_ipv6(host, name):
    with serving(host) as served:
        connection = http.client.HTTPConnection("::1", served.server_port, timeout=5)
        connection.request("GET", "/", headers={"Host": f"{name}:{served.server_port}"})
        assert connection.getresponse().read().decode() == PAGE
        connection.close()
    assert served.url == f"http://{'[::1]' if host == '::1' else '127.0.0.1'}:{served.server_port}/"


def test_on_all_addresses_it_has_that_of_the_client_and_the_name_of_the_computer():
    with serving("0.0.0.0") as served:
        port, own = served.server_port, socket.gethostname().lower()
        assert served.url == f"http://127.0.0.1:{port}/"
        assert served.hosts("192.0.2.7") == {
            f"192.0.2.7:{port}",
            f"0.0.0.0:{port}",
            f"{own}:{port}",
        }
        assert status(served, ask(host="evil.example:{port}")) == 421
        assert status(served, ask(host=f"{own}:{{port}}")) == 200


def test_a_name_is_answered_to_that_its_user_gave():
    with serving("localhost") as served:
        assert f"localhost:{served.server_port}" in served.hosts("192.0.2.7")


def test_a_policy_allows_the_scripts_styles_and_pictures_of_the_page_and_nothing_else():
    script, *others = sorted(set(POLICY.split("; ")) - {""}, key=lambda one: one[:7] != "script-")
    digest = base64.b64encode(hashlib.sha256(b"a script").digest()).decode()
    assert script == f"script-src 'sha256-{digest}'"
    nothing = {f"{kind} 'none'" for kind in ("default-src", "base-uri", "form-action")}
    assert set(others) == nothing | {"style-src 'unsafe-inline'", "img-src data:"}
