import base64
import re
import shutil
import subprocess
import threading
import urllib.request
from importlib.resources import files

import pytest
from walking import guessed_gait

from human_gait import playback
from human_gait.exceptions import ResultError
from human_gait.playback import play, playback_page, save_playback

MEGABYTE = 1e6


@pytest.fixture(scope="module")
def page():
    return playback_page(guessed_gait(), strides=1)


def own_part(page):
    """The page without MeshCat's viewer and without the packed commands."""
    viewer = (files("meshcat") / "viewer" / "dist" / "main.min.js").read_text(encoding="utf-8")
    return re.sub(r'"[A-Za-z0-9+/=]{20,}"', '""', page.replace(viewer, ""))


def test_the_page_loads_nothing_from_elsewhere(page):
    assert not re.search(r"src\s*=|href\s*=|@import|url\(|fetch|://", own_part(page))


def test_the_page_says_who_walks_how(page):
    for said in ("guessed walk", "1.2 m/s", "0.66 m", "male", "78.4 kg", "zero moment point"):
        assert said in own_part(page)
    assert "load 18.1 kg" in own_part(playback_page(guessed_gait(18.1), strides=1))


def test_a_saved_page_is_small_enough_to_send(tmp_path):
    path = tmp_path / "playback.html"
    save_playback(guessed_gait(), path)
    assert 0.5 * MEGABYTE < path.stat().st_size < 15 * MEGABYTE


def test_the_commands_are_text_that_a_browser_decodes(page):
    commands = re.findall(r'"([A-Za-z0-9+/=]{20,})"', page[page.index("for (const command of") :])
    assert len(commands) > 50
    assert all(base64.b64decode(command, validate=True) for command in commands)


@pytest.fixture
def no_screen(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(playback.sys, "platform", "linux")


@pytest.mark.usefixtures("no_screen")
def test_without_a_screen_no_browser_is_opened(monkeypatch, capsys):
    monkeypatch.setattr(playback.webbrowser, "open", pytest.fail)
    play(guessed_gait(), strides=1)
    assert re.search(r"http://127\.0\.0\.1:\d+/", capsys.readouterr().out)


@pytest.mark.usefixtures("no_screen")
def test_the_browser_gets_the_page_from_this_computer_only(monkeypatch):
    monkeypatch.setenv("DISPLAY", ":0")
    got = []

    def fetch(url):
        with urllib.request.urlopen(url) as answer:
            got.append(answer.read().decode())

    def browser(url):
        assert url.startswith("http://127.0.0.1:")
        threading.Thread(target=fetch, args=[url]).start()

    monkeypatch.setattr(playback.webbrowser, "open", browser)
    play(guessed_gait(), strides=1)
    assert own_part(got[0]) == own_part(playback_page(guessed_gait(), 1, 1))


def test_only_this_computer_is_listened_to_unless_told_otherwise():
    with playback._page_server("page") as server:
        assert server.server_address[0] == "127.0.0.1"
    with playback._page_server("page", "0.0.0.0") as server:
        assert server.server_address[0] == "0.0.0.0"


@pytest.mark.parametrize("host", ["192.0.2.1", "", "no such name"])
def test_an_address_of_another_computer_is_refused(host):
    with pytest.raises(ResultError, match=f"--host = '{host}': must be an address"):
        play(guessed_gait(), strides=1, host=host)


def test_two_walks_can_be_shown_at_once():
    with playback._page_server("one") as first, playback._page_server("two") as second:
        assert first.server_port != second.server_port


@pytest.mark.usefixtures("no_screen")
def test_ctrl_c_ends_an_endless_walk_quietly(monkeypatch):
    def interrupted(_server):
        raise KeyboardInterrupt

    monkeypatch.setattr(playback.ThreadingHTTPServer, "serve_forever", interrupted)
    play(guessed_gait())


@pytest.mark.parametrize("strides", [0, -1])
def test_a_walk_of_no_strides_is_refused(strides):
    with pytest.raises(ValueError, match="at least 1"):
        play(guessed_gait(), strides)


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


@pytest.mark.skipif(CHROMIUM is None, reason="needs the browser Chromium")
def test_chromium_builds_the_scene(page, tmp_path):
    """The viewer lists what it shows in its controls; the script ends only without an error."""
    path = tmp_path / "page.html"
    probe = "<script>document.title = `walks ${viewer.animator.playing}`</script></body>"
    path.write_text(page.replace("</body>", probe), encoding="utf-8")
    dom = dumped(path, tmp_path / "profile")
    assert "<title>walks true</title>" in dom
    for name in ("footholds", "zmp", "ground_reaction", "j55_neck_upper_rotation"):
        assert f">{name}<" in dom


def dumped(path, profile):
    """What Chromium makes of a page, as HTML."""
    options = "--headless --no-sandbox --disable-gpu --enable-unsafe-swiftshader --disable-quic"
    quiet = "--no-first-run --disable-background-networking --disable-component-update"
    command = [CHROMIUM, *options.split(), *quiet.split(), "--disable-sync", "--dump-dom"]
    shown = subprocess.run(
        [*command, f"--user-data-dir={profile}", path.as_uri()],
        capture_output=True,
        check=True,
        text=True,
        timeout=100,
    )
    return shown.stdout
