"""Every command ends with an exit code that says why, one line, and no traceback."""

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from walking import guessed_gait

from human_gait import cli, faults
from human_gait.exceptions import NoSolutionFound, ResultError
from human_gait.walk.gait_file import save_gait

ROOT = Path(__file__).resolve().parent.parent
INNER = {  # what each command calls, to fail in its place
    "init": ("human_gait.settings.write_scenario", []),
    "settings": ("human_gait.settings.listing", []),
    "predict": ("human_gait.prediction.build_program", ["normal", "--out", "out"]),
    "refine": ("human_gait.prediction.refined_program", ["walk", "--out", "out"]),
    "verify": ("human_gait.prediction.verify", ["walk"]),
    "explain": ("human_gait.results.explanation.explained", ["walk"]),
    "play": ("human_gait.playback.page.play", ["walk"]),
    "film": ("human_gait.playback.film.film", ["walk"]),
    "plot": ("human_gait.pictures.plots.save_plots", ["walk"]),
    "compare": ("human_gait.people.comparison.compare_to_folder", ["walk"]),
    "report": ("human_gait.reporting.page.report_to_file", ["walk"]),
    "figures": ("human_gait.pictures.paper_figures.save_figures", ["."]),
    "export": ("human_gait.export.formats.export_gait", ["walk"]),
    "urdf": ("human_gait.export.robot.scenario_robot", []),
    "fit": ("human_gait.trials.calls.fit", ["walk.trc"]),
    "study": ("human_gait.studies.study_file.StudyFile.read", ["speed-step"]),
    "study-report": ("human_gait.findings.page.study_report", ["walk"]),
}
UNICODE = UnicodeEncodeError("utf-8", "\udce9", 0, 1, "surrogates not allowed")
ERRORS = {  # and the exit code that belongs to it
    ZeroDivisionError("division by zero"): 3,
    AssertionError(): 3,
    RecursionError("maximum recursion depth exceeded"): 3,
    UNICODE: 3,
    SystemExit(0): 3,
    SystemExit("bye"): 3,
    GeneratorExit(): 3,
    EOFError(): 3,
    typer.Abort(): 3,
    ImportError("cannot import name 'x' from 'human_gait.y'", name="human_gait.y"): 3,
    ImportError("libY.so: cannot open shared object file", name="pinocchio"): 2,
    ModuleNotFoundError("No module named 'nothing_here'", name="nothing_here"): 2,
    MemoryError(): 2,
    BrokenPipeError(errno.EPIPE, "Broken pipe"): 2,
    OSError(errno.ENOSPC, "No space left on device"): 2,
    ResultError("walk: is damaged"): 2,
    NoSolutionFound("newton stopped"): 1,
    KeyboardInterrupt(): 130,
}


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results") / "walk"
    folder.mkdir()
    save_gait(guessed_gait(), folder)
    return folder.parent


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """Where tracebacks are kept."""
    monkeypatch.setattr(faults.tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_every_command_is_tried_here():
    assert sorted(INNER) == sorted(typer.main.get_command(cli.app).commands)


@pytest.mark.parametrize("command", INNER)
def test_whatever_fails_within_a_command_is_one_line_and_a_code(
    command, result, kept, monkeypatch, capsys
):
    monkeypatch.chdir(result)
    place, arguments = INNER[command]
    for error, code in ERRORS.items():

        def fail(*_, error=error, **__):
            raise error

        monkeypatch.setattr(place, fail)
        assert cli.run([command, *arguments]) == code, error
        said = capsys.readouterr().err
        assert said.startswith("error: "), error
        assert said.count("\n") == 1, error
        files = list(kept.glob("human-gait-error-*"))
        assert len(files) == (code == 3)
        for path in files:
            assert str(path) in said
            report = path.read_text()
            assert type(error).__name__ in report
            assert "in fail" in report
            assert "numpy" in report
            path.unlink()
    assert [path.name for path in result.iterdir()] == ["walk"]


def test_a_traceback_is_shown_to_who_wants_it(kept, monkeypatch, capsys):  # noqa: ARG001
    monkeypatch.setattr(INNER["settings"][0], lambda: 1 / 0)
    for value, shown in (("1", True), ("0", False)):
        monkeypatch.setenv(faults.DEBUG, value)
        assert cli.run(["settings"]) == faults.UNFORESEEN
        assert ("Traceback" in capsys.readouterr().err) is shown


def test_where_no_traceback_can_be_kept_the_line_says_how_to_see_it(kept, monkeypatch, capsys):
    monkeypatch.setattr(faults.tempfile, "tempdir", str(kept / "nowhere"))
    monkeypatch.setattr(INNER["settings"][0], lambda: 1 / 0)
    assert cli.run(["settings"]) == faults.UNFORESEEN
    assert "what HUMAN_GAIT_DEBUG=1 prints" in capsys.readouterr().err


def test_an_error_as_long_as_a_page_leaves_room_for_the_place_of_its_traceback(
    kept, monkeypatch, capsys
):
    def fail():
        raise ValueError("x\n" * 5000)

    monkeypatch.setattr(INNER["settings"][0], fail)
    assert cli.run(["settings"]) == faults.UNFORESEEN
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert str(next(kept.glob("human-gait-error-*"))) in said


# --- the environment


def run(*words, code=None, **environment):
    """Run a command in a process of its own."""
    inherited = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "LD_LIBRARY_PATH")}
    paths = os.pathsep.join([environment.pop("PYTHONPATH", ""), str(ROOT)]).strip(os.pathsep)
    way = ["-c", code] if code else ["-m", "human_gait"]
    return subprocess.run(
        [sys.executable, *way, *map(str, words)],
        env={**inherited, **environment, "PYTHONPATH": paths},
        check=False,
        capture_output=True,
        text=True,
        timeout=60,
    )


@pytest.mark.parametrize(
    ("package", "content"),
    [
        ("pinocchio", "from .pinocchio_pywrap_default import *"),  # of ROS
        ("scipy", "raise RuntimeError('compiled against another numpy')"),
        ("matplotlib", "x = undefined"),
        ("typer", ""),
    ],
)
def test_packages_of_another_environment_are_told_with_the_remedy(tmp_path, package, content):
    (tmp_path / package).mkdir()
    (tmp_path / package / "__init__.py").write_text(content)
    done = run("predict", "normal", "--out", tmp_path / "out", PYTHONPATH=str(tmp_path))
    place = tmp_path / package / "__init__.py"
    line = f"error: another {package} is in the way: {place}, by PYTHONPATH: env -u PYTHONPATH"
    assert done.stderr.startswith(line)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert not (tmp_path / "out").exists()


def test_a_file_of_ones_own_that_is_called_like_a_package_is_told(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "daqp.py").write_text("")
    error = AttributeError("module 'daqp' has no attribute 'Model'")
    found = faults.environment_fault(error)
    assert found.startswith(f"another daqp is in the way: {tmp_path / 'daqp.py'} is not of the")
    (tmp_path / "daqp.py").unlink()
    sys.path_importer_cache.clear()
    assert faults.environment_fault(error) == ""


def test_a_package_that_is_missing_is_told_with_the_remedy(monkeypatch):
    monkeypatch.setattr(faults, "_spec", lambda _: None)
    error = ModuleNotFoundError("No module named 'pydrake'", name="pydrake.solvers")
    assert faults.environment_fault(error) == (
        f"the package drake is missing: {sys.executable} -m pip install drake"
    )


def test_a_library_that_does_not_load_is_told_with_the_remedy(monkeypatch):
    error = ImportError("libboost.so.1: undefined symbol", name="pinocchio")
    monkeypatch.delenv("LD_LIBRARY_PATH", raising=False)
    assert "-m pip install --force-reinstall pin" in faults.environment_fault(error)
    monkeypatch.setenv("LD_LIBRARY_PATH", "/opt/ros/lib")
    assert "env -u LD_LIBRARY_PATH" in faults.environment_fault(error)
    for other in (ValueError("x"), ImportError("y", name="human_gait.body"), ResultError("z")):
        assert faults.environment_fault(other) == ""


def test_an_import_that_makes_something_else_of_an_interruption_is_interrupted(
    kept, monkeypatch, capsys
):
    """As packages do whose modules are compiled."""

    def fail():
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt:
            raise ImportError("pinocchio: initialization failed", name="pinocchio") from None

    monkeypatch.setattr(INNER["settings"][0], fail)
    assert cli.run(["settings"]) == 128 + signal.SIGTERM
    assert capsys.readouterr().err == "error: interrupted\n"
    assert list(kept.iterdir()) == []


# --- ways in


@pytest.mark.parametrize("module", ["human_gait", "human_gait.cli"])
def test_the_package_is_the_command(module):
    done = run(
        "predict",
        "nonexistent.toml",
        code=f"import runpy; runpy.run_module('{module}', run_name='__main__')",
    )
    assert done.returncode == 2
    assert done.stderr.startswith("error: nonexistent.toml: ")


STARTED = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
import human_gait.command
class Finder:
    def find_spec(self, name, path, target=None):
        if name == {name!r}:
            signal.raise_signal(signal.{signal})
sys.meta_path.insert(0, Finder())
human_gait.command.main()
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize(
    "name", ["human_gait.results.streams", "typer", "numpy", "pydrake.solvers"]
)
def test_a_signal_during_imports_is_one_line(name, number, tmp_path):
    """As soon as the first module of the package is there."""
    program = STARTED.format(name=name, signal=number.name)
    done = run("predict", "normal", "--out", tmp_path / "out", code=program)
    assert done.stderr == "error: interrupted\n"
    assert done.returncode == 128 + number
    assert not (tmp_path / "out").exists()


def test_a_terminal_that_is_closed_costs_no_result(tmp_path):
    """Nobody is there to read on, which is no failure."""
    ours, theirs = os.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "human_gait", "settings"],
        stdout=theirs,
        stderr=subprocess.PIPE,
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        cwd=tmp_path,
    )
    os.close(theirs)
    os.close(ours)
    said = process.communicate(timeout=60)[1]
    assert (process.returncode, said) == (0, b"")


@pytest.mark.parametrize(
    ("words", "found"), [("human-gait pre", "predict"), ("human-gait predict --ti", "--time-limit")]
)
def test_shells_complete_commands_and_options(words, found, tmp_path):
    number = str(len(words.split()) - 1)
    asked = {"_HUMAN_GAIT_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": number}
    done = run(**asked)
    assert (done.stdout.strip(), done.stderr, done.returncode) == (found, "", 0)
    alone = {"_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}  # whatever runs the tests
    shown = run("--show-completion", "bash", HOME=str(tmp_path), **alone)
    assert "_HUMAN_GAIT_COMPLETE" in shown.stdout
    assert (shown.stderr, shown.returncode) == ("", 0)
