"""Every command of the README and every example of docs/examples/ runs as it stands there."""

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from solves import SCENARIOS, solved

import human_gait
from human_gait import cli

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
PLAIN = README.replace("\\|", "|")  # within a table
ROWS = re.findall(r"^\| `human-gait (.*?)` \|", PLAIN, re.MULTILINE)
PROSE = re.sub(r"^```.*?^```$", "", PLAIN, flags=re.MULTILINE | re.DOTALL)
CODE = re.findall(r"`([^`\n]+)`", PROSE)
SHELL = "\n".join([*CODE, *(text for kind, text in BLOCKS if kind == "sh")])
TARGETS = sorted(set(re.findall(r"^make ([a-z-]+)", SHELL, re.MULTILINE)))
EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.py"))
RESULTS = {  # three solves are enough to stand for five
    "normal": "paper-normal",
    "preferred": "preferred",
    "backpack-0": "paper-backpack-0",
    "backpack-20": "paper-backpack-40",
    "backpack-40": "paper-backpack-40",
}
RESULTS |= {  # of `figures --paper`
    "paper-preferred": "paper-normal",
    **{f"paper-{name}": one for name, one in RESULTS.items() if name != "preferred"},
}
PLACEHOLDER = re.compile(r"\[?[A-Z_]+2?[\].]*")
STANDS_FOR = {
    "ADDRESS": "127.0.0.1",
    "DIR": "out/normal",
    "DIR2": "out/backpack-40",
    "DIR...": "out/normal out/backpack-40",
    "FILE": "new/file",
    "FILM": "new/walk.png",
    "FOLDER": "new/folder",
    "FORMAT": "csv",
    "HZ": "50",
    "KEY": "walk.speed",
    "N": "9",
    "NAME": "mine",
    "RESULTS_DIR": "out",
    "SCENARIO": "scenarios/paper-normal.toml",
    "VIEW": "front",
    "WIDTHxHEIGHT": "64x80",
}
OWN = {
    "--from": "normal",
    "--seed": "1",
    "--starts": "2",
    "--time-limit": "200",
    "--solver": "newton",
    "--dynamics": "pinocchio",
    "--out": "new/out",
    "--with": "out/normal/gait_cycle.csv",
    "--units": "deg",
    "--up": "y",
    "--forward": "x",
    "--map": "hip_flexion_deg=knee_flexion_deg",
    "--events": "0,1",
    "--feet": "1=r",
    "--mass": "70",
    "--side": "r",
}  # of an option
SOLVING = ("predict", "refine")  # with all options only: they take seconds
ELSEWHERE = ("fit", "study", "study-report")
"""What takes files that no result has: test_fit, test_study_runs and test_findings run them."""
INSTEAD = ("--guess", "--track", "--track-weight")
"""Options that go instead of another, ``--warm-from``: test_tracking gives them."""


def parts(synopsis):
    """The words that a command needs, and each of its optional parts."""
    optional = re.findall(r"\[([^\]]*)\]", synopsis)
    return re.sub(r"\[[^\]]*\]", "", synopsis).split(), [part.split() for part in optional]


def filled(words):
    """Words of a synopsis with a value for each placeholder and, for an option, the one of many."""
    option = words[0] if words[0].startswith("--") else ""
    values = [STANDS_FOR.get(word, word) for word in words if word != "..."]
    if option and len(values) > 1 and words[1] != "FILM":
        values[1] = OWN.get(option, values[1])
    return " ".join(values).split()


def runs(synopsis, plain):
    """A command with all it can take, and, unless it is among `plain`, with what it needs alone."""
    needed, optional = parts(synopsis)
    short = filled(needed)
    kept = [part for part in optional if part[0] not in INSTEAD]
    everything = short + [word for part in kept for word in filled(part)]
    alone = needed[0] not in (*SOLVING, *plain)
    return [short] * alone + [everything] * (everything != short)


def commands():
    """The commands of the table, then those within sentences that have no placeholder."""
    words = [shlex.split(code)[1:] for code in CODE if re.match(r"human-gait [a-z]", code)]
    whole = [one for one in words if not any(PLACEHOLDER.fullmatch(word) for word in one)]
    plain = {one[0] for one in whole if len(one) > 1 and "--" not in " ".join(one)}
    rows = [row for row in ROWS if row.split()[0] not in ELSEWHERE]
    table = [run for row in rows for run in runs(row, plain)]
    named = {(row.split()[0],) for row in ROWS if len(parts(row)[0]) > 1}  # spoken of, not run
    return [run for run in dict.fromkeys(map(tuple, [*table, *whole])) if run not in named]


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder like that of a user who has predicted some walks."""
    shutil.copytree(SCENARIOS, tmp_path / "scenarios")
    for name, scenario in RESULTS.items():
        shutil.copytree(solved(scenario).folder, tmp_path / "out" / name)
    monkeypatch.chdir(tmp_path)


def test_the_table_has_every_command_with_every_option():
    known = typer.main.get_command(cli.app).commands
    assert sorted(row.split()[0] for row in ROWS) == sorted(known)
    for row in ROWS:
        names = {one for p in known[row.split()[0]].params for one in p.opts}
        options = {name for name in names if name.startswith("--")}
        assert set(re.findall(r"--[a-z-]+", row)) == options - {"--help"}, row


@pytest.mark.solve
@pytest.mark.parametrize("command", commands(), ids=" ".join)
@pytest.mark.usefixtures("here")
def test_a_command_runs(command):
    """Its exit code is that of success; `play` that of success when it is told to end."""
    if command[0] == "play" and "--save" not in command:
        with served(command) as process:
            try:
                assert "Ctrl-C to stop" in process.stdout.readline()
                process.send_signal(signal.SIGINT)
                assert process.wait(timeout=60) == 0
            finally:
                process.kill()
    else:
        assert cli.run(command) == 0


def served(command):
    """The command in a process of its own, without a browser."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "BROWSER": "true"}
    heeding = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    code = f"{heeding}; from human_gait.cli import main; main()"  # jobs in the background do not
    return subprocess.Popen(
        [sys.executable, "-c", code, *command], stdout=subprocess.PIPE, text=True, env=environment
    )


@pytest.mark.parametrize("target", TARGETS)
def test_a_target_of_make_is_there(target):
    """With what it would do; what it does is `human-gait`'s."""
    done = run_quietly(["make", "-n", target], cwd=ROOT)
    assert done.returncode == 0, done.stderr


@pytest.mark.solve
@pytest.mark.usefixtures("here")
def test_the_pieces_of_python_run_one_after_the_other(monkeypatch):
    """As somebody types them who reads from top to bottom."""
    for shown in ("play", "film"):  # the table of commands films
        monkeypatch.setattr(human_gait, shown, lambda *_, **__: None)
    names = {}
    for text in [text for kind, text in BLOCKS if kind == "python"]:
        exec(compile(text, "README.md", "exec"), names)
    assert Path("out/faster/gait.npz").is_file()


@pytest.mark.solve
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_an_example_runs(example, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "agg", "BROWSER": "true"}
    done = run_quietly([sys.executable, str(example)], cwd=tmp_path, env=environment)
    assert done.returncode == 0, done.stderr


def run_quietly(command, **where):
    return subprocess.run(command, check=False, capture_output=True, text=True, **where)
