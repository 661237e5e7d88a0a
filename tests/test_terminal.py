r"""Text of files and names is shown, never obeyed; it is no markup; all goes one way."""

import ast
import io
import json
import os
import pty
import shutil
import subprocess
import sys
import unicodedata
from pathlib import Path

import pytest
import typer
from hypothesis import given
from hypothesis import strategies as st
from rich.table import Table
from rich.text import Text
from walking import guessed_gait

from human_gait import cli
from human_gait.terminal import LONGEST_MESSAGE, careful, one_line, printable, screen
from human_gait.walk.gait_file import save_gait

ROOT = Path(__file__).resolve().parent.parent
ATTACKS = {
    "title": "\x1b]0;owned\x07",
    "erase": "\x1b[2J\x1b[H",
    "colour": "\x1b[31m",
    "C1": "\x9b2J",
    "link": "\x1b]8;;file:///etc/passwd\x1b\\x",
    "carriage": "ok\rerror",
    "backspace": "FAIL\b\b\b\bok",
    "bidi": "\u202egnp.exe",
    "isolate": "\u2066x\u2069",
    "zero width": "a\u200bb\ufeff",
    "surrogate": "caf\udce9",
    "tag": "\U000e0041",
    "separator": "a\u2028b",
}
MARKUP = "a[/b]x [red]y[/red] :smile: [link=file:///x]z[/link] [@click=quit]"


def obeyed(text):
    """Signs that a terminal would do something about, or cannot be written."""
    return {
        sign for sign in text if unicodedata.category(sign)[0] == "C" or sign in "\u2028\u2029"
    } - set("\n\t")


@given(st.text() | st.text(st.characters(categories=["Cc", "Cf", "Cs", "Zl", "Zp", "Zs"])))
def test_printable_text_is_obeyed_by_no_terminal_and_says_what_was_there(text):
    shown = printable(text)
    assert not obeyed(shown)
    shown.encode()
    assert all(sign in shown for sign in text if not obeyed(sign))


def test_text_that_people_write_stays_as_it_is():
    for text in ("Müller, 80 °C", "日本語", "עברית", "a\tb\nc", "5\u202f000 N\xa0m", "✓ 👣"):
        assert printable(text) == text


def test_a_line_is_one_and_of_a_readable_length():
    assert one_line("a\nb\r\n c") == "a b c"
    assert LONGEST_MESSAGE - 2 < len(one_line("\x1b" * 9999)) <= LONGEST_MESSAGE


@pytest.mark.parametrize("attack", ATTACKS.values(), ids=ATTACKS)
def test_nothing_that_a_command_prints_is_obeyed(attack, capsys, monkeypatch):
    """By whatever way: streams, echo, tables, errors."""

    def listing():
        sys.stdout.write(f"{attack}\n")
        sys.stderr.write(f"{attack}\n")
        typer.echo(attack, err=True)
        sys.stdout.writelines([attack, "\n"])
        table = Table(attack, "b", title=attack)
        table.add_row(attack, Text(attack))
        screen().print(table)
        screen(stderr=True).print(attack, MARKUP, soft_wrap=True)
        return attack

    monkeypatch.setattr("human_gait.settings.listing", listing)
    assert cli.run(["settings"]) == 0
    captured = capsys.readouterr()
    for said in (captured.out, captured.err):
        assert not obeyed(said)
        assert said.count(printable(attack)) >= 2
    assert MARKUP in captured.err
    for error in (ValueError(attack), OSError(5, attack)):
        monkeypatch.setattr("human_gait.settings.listing", lambda error=error: raise_(error))
        assert cli.run(["settings"]) in (2, 3)
        assert not obeyed(capsys.readouterr().err)


def raise_(error):
    raise error


def test_streams_are_put_back():
    before = sys.stdout, sys.stderr
    with careful():
        assert sys.stdout is not before[0]
        assert sys.stdout.encoding == before[0].encoding
    assert (sys.stdout, sys.stderr) == before


def test_a_closed_stream_stays_closed(monkeypatch):
    monkeypatch.setattr(sys, "stderr", None)
    with careful():
        assert sys.stderr is None
    assert cli.run(["frob"]) == 2


def test_own_colours_reach_a_terminal_but_no_others():
    out = io.StringIO()
    console = screen(file=out, force_terminal=True, color_system="standard")
    console.print(Text("bad", style="red"), "\x1b[32mx", MARKUP)
    assert "\x1b[31mbad" in out.getvalue()
    assert "\\x1b[32mx" in out.getvalue()
    assert MARKUP in out.getvalue()


def test_every_console_is_made_in_one_place():
    """Any other would print what it is given as it is, or as markup."""
    for path in (ROOT / "human_gait").rglob("*.py"):
        if path.name == "terminal.py":
            continue
        tree = ast.parse(path.read_text())
        names = {
            alias.name
            for node in ast.walk(tree)
            if isinstance(node, ast.Import | ast.ImportFrom)
            for alias in node.names
        }
        used = {getattr(n.func, "id", "") for n in ast.walk(tree) if isinstance(n, ast.Call)}
        assert "Console" not in used, path
        assert "echo" not in {n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute)}, path
        assert not names & {"Prompt", "track", "getpass"}, path


@pytest.fixture
def spoilt(tmp_path):
    """A result whose texts are all escapes, in a folder named so."""
    folder = tmp_path / "w\x1b[2J[red]\u202ex"
    folder.mkdir()
    save_gait(guessed_gait(), folder)
    evil = "\x1b]0;owned\x07\x1b[2J[bold]\u202e\ud800"
    shape = {"constraint": evil, "what": evil, "time_s": 0.1, "step": evil, "saving": 0.1}
    explanation = {"shapes": [shape | {"meaning": evil}], "step_time_s": 0.5}
    (folder / "explanation.json").write_text(json.dumps(explanation))
    (folder / "summary.json").write_text(json.dumps({"success": True}))
    failed = shutil.copytree(folder, tmp_path / "failed")
    diagnosis = {"not_kept": [evil], "try": [{"key": evil, "change": evil, "because": evil}]}
    (failed / "summary.json").write_text(json.dumps({"success": False, "diagnosis": diagnosis}))
    return folder, failed


@pytest.mark.parametrize("command", ["explain", "verify", "play", "compare", "report", "nothing"])
def test_no_result_writes_to_the_terminal(spoilt, command, capsys):
    for folder in (*spoilt, spoilt[0] / "none\x1b[2J"):
        more = ["--save", f"{folder}/page.html"] if command == "play" else []
        cli.run([command, str(folder), *more])
        captured = capsys.readouterr()
        assert not obeyed(captured.out + captured.err)
        assert "Traceback" not in captured.err


def test_on_a_real_terminal_nothing_but_colours_and_its_own_line_arrives(spoilt):
    """With the streams of a process of its own."""
    main, end = pty.openpty()
    run = subprocess.Popen(
        [sys.executable, "-m", "human_gait", "explain", str(spoilt[1])],
        stdout=end,
        stderr=end,
        env={**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm-256color"},
    )
    os.close(end)
    run.wait(timeout=60)
    said = os.read(main, 100_000).decode()
    os.close(main)
    assert said.startswith("error: ")
    assert not obeyed(said) - {"\r"}


def test_nothing_is_obeyed_where_the_encoding_is_ascii(tmp_path):
    """Typer's echo takes such a stream for misconfigured and writes past it."""
    command = [sys.executable, "-m", "human_gait", "init", "--out", "é\x1b[2J\x1b]0;x\x07.toml"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "ascii"}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout == b"wrote \\xe9\\x1b[2J\\x1b]0;x\\x07.toml\n"
