"""The messages that the page on troubleshooting quotes are those that the program prints."""

import shutil
from pathlib import Path

import pytest
from walking import guessed_gait

from human_gait import cli
from human_gait.walk.gait_file import save_gait

PAGE = Path(__file__).resolve().parent.parent / "docs" / "troubleshooting.md"
WALK = "[walk]\nspeed = 1.2\nstep_length = 0.7\n"


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    folder = tmp_path_factory.mktemp("walk")
    save_gait(guessed_gait(), folder)
    return folder


@pytest.fixture
def here(tmp_path, monkeypatch, walk):
    """What the page is about: a folder with results that have gone wrong."""
    monkeypatch.chdir(tmp_path)
    Path("empty").mkdir()
    for name in ("half", "damaged", "old", "walk"):
        shutil.copytree(walk, name)
    Path("half/multipliers.npz").write_text("junk")
    for name in ("gait_cycle.csv", "playback.html"):
        Path("half", name).write_text("")
    Path("damaged/gait.npz").write_bytes(Path("walk/gait.npz").read_bytes()[:1000])
    Path("file").write_text("")
    Path("mine").mkdir()
    Path("mine/report.html").write_text("by hand")
    Path("n.toml").write_text(WALK)
    Path("a.toml").write_text("[walk]\nspeed = 1.2\nstep_lenght = 0.7\n")
    Path("b.toml").write_text("[walk]\nspeed = 1.2\nstep_length = 1.5\n")
    Path("c.toml").write_text("[walk]\nspeed = 4\nstep_length = 0.7\n")


@pytest.mark.parametrize(
    "command",
    [
        "predict a.toml",
        "predict b.toml",
        "predict c.toml",
        "play empty",
        "verify damaged",
        "explain half",
        "report half",
        "report walk walk",
        "predict n.toml --warm-from nowhere",
        "predict n.toml --warm-from half --solver all",
        "predict n.toml --warm-from half",
        "play walk --host 192.0.2.1",
        "predict n.toml --out file/x",
        "predict n.toml --out mine",
        "predict n.toml --out=",
    ],
)
@pytest.mark.usefixtures("here")
def test_a_message_is_quoted_as_it_is(command, capsys):
    if command == "report walk walk":
        for name in ("summary.json", "gait_cycle.csv", "explanation.json"):
            Path("walk", name).write_text("{}")
    assert cli.run(command.split()) == cli.BAD_INPUT
    assert f"\n    {capsys.readouterr().err}" in PAGE.read_text()
