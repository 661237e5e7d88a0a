import base64
import json
import re
import threading
import urllib.request
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from lxml import html
from walking import guessed_gait

from human_gait import cli
from human_gait.body.skeleton import index
from human_gait.exceptions import ResultError
from human_gait.playback import page as playback
from human_gait.playback import server
from human_gait.playback.page import play, playback_page, save_playback
from human_gait.playback.server import page_server
from human_gait.scenario import Scenario
from human_gait.walk.bspline import Basis
from human_gait.walk.cycle import step_cycle
from human_gait.walk.gait import Gait
from human_gait.walk.gait_file import save_gait

MEGABYTE = 1e6


@pytest.fixture(scope="module")
def page():
    return playback_page(guessed_gait())


def own_part(page):
    """The page without MeshCat's viewer and without the packed commands."""
    viewer = (files("meshcat") / "viewer" / "dist" / "main.min.js").read_text(encoding="utf-8")
    return re.sub(r'"[A-Za-z0-9+/=]{20,}"', '""', page.replace(viewer, ""))


def test_the_page_loads_nothing_from_elsewhere(page):
    own = re.sub(' (src|href)="data:[^"]*"', "", own_part(page))
    assert not re.search(r"src\s*=|href\s*=|@import|url\(|fetch|://", own)


def test_the_page_says_who_walks_how(page):
    for said in ("guessed walk", "1.2_m/s", "0.66_m", "male", "78.4_kg", "Zero moment point"):
        assert said.replace("_", "\N{NO-BREAK SPACE}") in own_part(page)
    loaded = own_part(playback_page(guessed_gait(18.1)))
    assert "load 18.1\N{NO-BREAK SPACE}kg" in loaded


def test_no_number_of_the_caption_is_parted_from_its_unit(page):
    (caption,) = (walk["caption"] for walk in data(page)["walks"])
    assert not re.search(r"\d (m|kg)\b", caption)


def test_numbers_of_the_caption_are_rounded():
    gait = guessed_gait()
    scenario = gait.scenario.replace(speed="4 km/h", stature="5 ft 6 in")
    scenario = scenario.replace({"subject.mass": "140 lb"})
    caption = playback._caption(replace(gait, scenario=scenario)).replace("\N{NO-BREAK SPACE}", " ")
    assert caption.startswith("1.111 m/s, step 0.66 m; male, 1.676 m, 63.5 kg")


def test_the_page_says_what_its_clock_is_in_the_files(page):
    (note,) = re.findall(r'id="note">(.*?)</p>', page, flags=re.DOTALL)
    words = html.fromstring(note).text_content().replace("\N{NO-BREAK SPACE}", " ")
    assert "0 s is right heel strike, t = T in the files" in words


def test_saved_pages_are_small_enough_to_send(tmp_path):
    for others in ((), (guessed_gait(18.1),)):
        path = tmp_path / "playback.html"
        save_playback(guessed_gait(), path, *others)
        assert 0.5 * MEGABYTE < path.stat().st_size < 15 * MEGABYTE


def data(page):
    (text,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page)
    return json.loads(text)


def test_the_commands_are_text_that_a_browser_decodes(page):
    commands = data(page)["commands"]
    assert len(commands) > 50
    assert all(base64.b64decode(command, validate=True) for command in commands)


def test_two_walks_of_one_name_are_told_apart():
    gait = guessed_gait()
    names = [walk["name"] for walk in data(playback_page(gait, second=gait))["walks"]]
    assert names == ["guessed walk (1)", "guessed walk (2)"]


def test_the_torques_of_the_page_are_those_of_the_gait(page):
    gait, told = guessed_gait(), data(page)
    (walk,) = told["walks"]
    phases = np.linspace(0, 1, len(walk["torques"]["j10_knee_flexion_r"]))
    knee = gait.tau(gait.step_time * (1 + 2 * phases))[:, index("knee_flexion_r")]
    np.testing.assert_allclose(walk["torques"]["j10_knee_flexion_r"], abs(knee), atol=0.06)
    assert told["torqueMax"] >= max(map(max, walk["torques"].values()))
    assert walk["strideTime"] == pytest.approx(2 * gait.step_time)


def test_a_backpack_can_be_hidden_where_there_is_one(page):
    assert 'data-layer="backpack"' not in page
    assert 'data-layer="backpack"' in playback_page(guessed_gait(), second=guessed_gait(18.1))


def test_walks_of_different_pace_are_said_to_be_at_the_same_phase():
    gait = guessed_gait()
    assert "pace" not in playback_note(gait, guessed_gait(18.1))
    quicker = Scenario.from_dict(
        {**gait.scenario.to_dict(), "name": "quick", "walk": {"speed": 1.5, "step_length": 0.66}}
    )
    basis = Basis.uniform(step_cycle(quicker.walk), 9)
    note = playback_note(gait, Gait(quicker, basis.breaks, gait.control_points))
    assert "same per cent" in note
    note = note.replace("\N{NO-BREAK SPACE}", " ")
    assert "pace of the first: 1.10 s; the second needs 0.88 s" in note


def playback_note(first, second):
    page = playback_page(first, second=second)
    return re.search(r'id="note">(.*?)</p>', page, flags=re.DOTALL).group(1)


@pytest.fixture
def no_screen(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(server.sys, "platform", "linux")


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
    assert own_part(got[0]) == own_part(playback_page(guessed_gait(), 1))


def test_only_this_computer_is_listened_to_unless_told_otherwise():
    with page_server("page") as served:
        assert served.server_address[0] == "127.0.0.1"
    with page_server("page", "0.0.0.0") as served:
        assert served.server_address[0] == "0.0.0.0"


@pytest.mark.parametrize("host", ["192.0.2.1", "", "no such name"])
def test_an_address_of_another_computer_is_refused(host):
    with pytest.raises(ResultError, match=f"--host = '{host}': must be an address"):
        play(guessed_gait(), strides=1, host=host)


def test_two_walks_can_be_shown_at_once():
    with page_server("one") as first, page_server("two") as second:
        assert first.server_port != second.server_port


@pytest.mark.usefixtures("no_screen")
def test_ctrl_c_ends_an_endless_walk_quietly(monkeypatch):
    def interrupted(_server):
        raise KeyboardInterrupt

    monkeypatch.setattr(server.ThreadingHTTPServer, "serve_forever", interrupted)
    play(guessed_gait())


@pytest.mark.parametrize("strides", [0, -1])
def test_a_walk_of_no_strides_is_refused(strides):
    with pytest.raises(ValueError, match="at least 1"):
        play(guessed_gait(), strides)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Two folders of results."""
    folders = []
    for name, load in (("light", 0.0), ("heavy", 18.1)):
        folders.append(tmp_path_factory.mktemp(name))
        save_gait(guessed_gait(load), folders[-1])
    return [str(folder) for folder in folders]


def test_the_command_writes_the_page_of_two_results(results, tmp_path, capsys):
    page = tmp_path / "both.html"
    assert cli.run(["play", *results, "--overlay", "--save", str(page)]) == 0
    assert capsys.readouterr().out == f"wrote {page}\n"
    told = data(page.read_text(encoding="utf-8"))
    assert [walk["caption"].count("load") for walk in told["walks"]] == [0, 1]
    assert told["overlay"]
    assert cli.run(["play", results[0], "--save", str(page)]) == 0
    told = data(page.read_text(encoding="utf-8"))
    assert (len(told["walks"]), told["overlay"]) == (1, False)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--overlay"], "--overlay: needs a second result, DIR2"),
        (["nowhere"], "nowhere: no result here"),
        (["--save", "/dev/null/page.html"], "page.html: cannot be written: Not a directory"),
    ],
)
def test_what_cannot_be_played_is_told_in_one_line(results, capsys, arguments, words):
    assert cli.run(["play", results[0], *arguments]) == cli.BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert words in line


def test_the_same_walk_gives_the_same_page(page):
    """MeshCat names its objects at random."""
    assert playback_page(guessed_gait()) == page
