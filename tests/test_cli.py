"""The command line: a user's mistake ends in one line and an exit code, never in a traceback."""

import re
import shutil
import subprocess
import sys
import types
from pathlib import Path

import pytest
from walking import guessed_gait

from human_gait import cli
from human_gait.commands import arguments, exits
from human_gait.exceptions import ModelError, NoSolutionFound, ResultError
from human_gait.scenario import scenario_file
from human_gait.walk.gait_file import save_gait

ROOT = Path(__file__).resolve().parent.parent
NORMAL = str(ROOT / "scenarios" / "normal.toml")
WALK = "[walk]\nspeed = 1.2\nstep_length = 0.7\n"


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def replace_room(monkeypatch):
    """Replace one module of the package by stand-in functions for the time of a test."""

    def replace(name, **functions):
        room = types.ModuleType(f"human_gait.{name}")
        vars(room).update(functions)
        monkeypatch.setitem(sys.modules, f"human_gait.{name}", room)

    return replace


@pytest.fixture
def prediction(replace_room):
    """Let `predict` record its task and succeed, without solving anything."""
    calls = []

    def predict_to_folder(scenario, *asked, starts, plots, **started):
        calls.append((scenario.name, *asked, starts))
        calls.extend([started] if any(started.values()) else [])
        return plots

    replace_room("prediction", predict_to_folder=predict_to_folder)
    return calls


@pytest.mark.usefixtures("here")
def test_all_solvers_may_be_asked_for(replace_room):
    calls = []
    replace_room(
        "prediction",
        predict_by_all_solvers=lambda *given, **named: calls.append((*given, named)) or True,
    )
    assert cli.run(["predict", NORMAL, "--solver", "all"]) == 0
    assert cli.run(["predict", NORMAL, "--solver", "all", "--starts", "2"]) == cli.BAD_INPUT
    ((task, *rest),) = calls
    assert task.name == "normal"
    assert rest == [Path("out/normal"), "pinocchio", 300.0, {"plots": True}]


@pytest.mark.parametrize(
    ("options", "n", "target"),
    [
        ([], 11, "walk-refined"),
        (["--control-points", "14", "--out", "x"], 14, "x"),
        (["--control-points", "0"], 0, "walk-refined"),
    ],
)
def test_a_result_is_refined(here, replace_room, options, n, target):
    (here / "walk").mkdir()
    save_gait(guessed_gait(), here / "walk")
    calls = []
    refine = lambda _, *rest, **named: calls.append((*rest, named)) or True  # noqa: E731
    replace_room("prediction", refine_to_folder=refine)
    assert cli.run(["refine", "walk", *options]) == 0
    assert calls == [(n, "newton", Path(target), "pinocchio", 300.0, {"plots": True})]


@pytest.mark.usefixtures("here")
def test_plots_may_be_left_out(replace_room):
    named = []
    made = {"predict_to_folder", "refine_to_folder", "predict_by_all_solvers"}
    replace_room(
        "prediction", **dict.fromkeys(made, lambda *_, **given: named.append(given) or True)
    )
    save_gait(guessed_gait(), Path())
    for words in (["predict", NORMAL], ["predict", NORMAL, "--solver", "all"], ["refine", "."]):
        assert cli.run([*words, "--out", "new", "--no-plots"]) == 0
    assert [given["plots"] for given in named] == [False] * 3


@pytest.mark.usefixtures("here")
def test_what_is_no_result_is_not_refined(capsys):
    assert cli.run(["refine", "nowhere"]) == 2
    assert_one_line(capsys, "nowhere", "no result here")


def test_a_refinement_without_a_walk_ends_with_1(here, replace_room):
    (here / "walk").mkdir()
    save_gait(guessed_gait(), here / "walk")
    replace_room("prediction", refine_to_folder=lambda *_, **__: False)
    assert cli.run(["refine", "walk"]) == 1


@pytest.mark.parametrize(("walks", "code"), [(True, 0), (False, 1)])
def test_a_result_is_verified(here, replace_room, walks, code):
    (here / "walk").mkdir()
    save_gait(guessed_gait(), here / "walk")
    replace_room("prediction", verify_folder=lambda folder: walks and folder == Path("walk"))
    assert cli.run(["verify", "walk"]) == code
    assert cli.run(["verify", "nowhere"]) == 2


def assert_one_line(capsys, *parts):
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("error: ")
    assert captured.err.count("\n") == 1
    assert captured.err.endswith("\n")
    assert [part for part in parts if part not in captured.err] == []


BAD_FILES = {
    "unknown key": ("[walk]\nspead = 1\nstep_length = 0.7\n", "did you mean speed?"),
    "wrong type": ('[walk]\nspeed = "fast"\nstep_length = 0.7\n', "walk.speed"),
    "negative mass": (WALK + "[subject]\nmass = -1\n", "subject.mass = -1"),
    "beyond leg reach": ("[walk]\nspeed = 1.2\nstep_length = 1.5\n", "walk.step_length"),
    "not TOML": ("walk: {speed: 1.2}", "is not TOML"),
    "NaN": ("[walk]\nspeed = nan\nstep_length = 0.7\n", "walk.speed = nan"),
    "line break in a key": ('["wa\\nlk"]\n' + WALK, "unknown setting"),
    "escape code in a key": ('["wa\\u001b[31mlk"]\n' + WALK, "unknown setting"),
}


@pytest.mark.parametrize(("content", "part"), BAD_FILES.values(), ids=BAD_FILES)
def test_a_bad_scenario_is_one_line_and_leaves_nothing_behind(
    here, capsys, prediction, content, part
):
    Path("bad.toml").write_text(content)
    assert cli.run(["predict", "bad.toml"]) == cli.BAD_INPUT
    assert_one_line(capsys, "bad.toml", part)
    assert [path.name for path in here.iterdir()] == ["bad.toml"]
    assert prediction == []


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["predict", "missing.toml"], "missing.toml: cannot be read"),
        (["predict", "."], "cannot be read"),
        (["predict", NORMAL, "--solver", "simplex"], "'newton', 'snopt', 'ipopt', 'all'"),
        (["refine", "walk", "--solver", "all"], "'newton', 'snopt', 'ipopt'"),
        (["predict", NORMAL, "--warm-from"], "--warm-from"),
        (["predict", NORMAL, "--warm-from", "nowhere"], "nowhere: no result here (no gait.npz)"),
        (["predict", NORMAL, "--warm-from", "."], "no result here"),
        (["predict", NORMAL, "--dynamics", "newton"], "'pinocchio', 'dh'"),
        (["predict"], "SCENARIO"),
        (["predict", NORMAL, "extra"], "extra"),
        (["predict", NORMAL, "--frob"], "--frob"),
        (["frob"], "frob"),
        (["--frob"], "--frob"),
        (["play"], "DIR"),
        (["play", "missing"], "missing: no result here"),
        (["plot", "."], "no result here"),
        (["urdf", "--scenario", "missing.toml"], "missing.toml: cannot be read"),
    ],
)
@pytest.mark.usefixtures("prediction")
def test_a_bad_command_line_is_one_line_and_leaves_nothing_behind(here, capsys, arguments, part):
    assert cli.run(arguments) == cli.BAD_INPUT
    assert_one_line(capsys, part)
    assert list(here.iterdir()) == []


def test_a_result_folder_that_cannot_be_made_is_refused_before_solving(here, capsys, prediction):
    (here / "file").write_text("")
    assert cli.run(["predict", NORMAL, "--out", "file/result"]) == cli.BAD_INPUT
    assert_one_line(capsys, "cannot be written", "Not a directory")
    assert prediction == []


def test_predict_passes_its_options_on(here, prediction):
    options = ["--solver", "ipopt", "--out", "new/place", "--seed", "7", "--starts", "5"]
    assert cli.run(["predict", NORMAL]) == 0
    assert cli.run(["predict", NORMAL, *options]) == 0
    assert cli.run(["predict", NORMAL, "--dynamics", "dh"]) == 0
    assert prediction == [
        ("normal", "newton", Path("out/normal"), "pinocchio", 0, None, 300.0, 1),
        ("normal", "ipopt", Path("new/place"), "pinocchio", 7, None, 300.0, 5),
        ("normal", "newton", Path("out/normal"), "dh", 0, None, 300.0, 1),
    ]
    assert list(here.iterdir()) == []


def test_predict_starts_from_a_result_that_is_named(here, prediction):
    (here / "walk").mkdir()
    save_gait(guessed_gait(), here / "walk")
    assert cli.run(["predict", NORMAL, "--warm-from", "walk", "--solver", "snopt"]) == 0
    assert prediction == [
        ("normal", "snopt", Path("out/normal"), "pinocchio", 0, Path("walk"), 300.0, 1)
    ]


def test_predict_takes_a_guess_and_what_to_follow(here, prediction):
    (here / "walk").mkdir()
    save_gait(guessed_gait(), here / "walk")
    options = ["--guess", "walk", "--track", "walk", "--track-weight", "1e4"]
    assert cli.run(["predict", NORMAL, *options]) == 0
    started = prediction[1]
    assert started["guess"] == Path("walk")
    assert (started["track"].gait, started["track"].weight) == (guessed_gait(), 1e4)


def test_a_result_to_start_from_that_is_none_is_refused_before_anything_is_built(
    here, capsys, prediction
):
    (here / "walk").mkdir()
    assert cli.run(["predict", NORMAL, "--warm-from", "walk"]) == cli.BAD_INPUT
    assert_one_line(capsys, "walk: no result here (no gait.npz), make one with human-gait predict")
    assert prediction == []


@pytest.mark.parametrize("name", ["gait.npz", "multipliers.npz"])
def test_a_damaged_result_to_start_from_is_one_line(here, capsys, name):
    """With the real room: the file is read before anything is solved."""
    (here / "walk").mkdir()
    save_gait(guessed_gait(), here / "walk")
    (here / "walk" / name).write_bytes(b"junk")
    assert cli.run(["predict", NORMAL, "--warm-from", "walk"]) == cli.BAD_INPUT
    assert_one_line(capsys, f"walk/{name}")
    assert [path.name for path in here.iterdir()] == ["walk"]


@pytest.mark.usefixtures("here")
def test_no_success_is_exit_code_1(replace_room):
    replace_room("prediction", predict_to_folder=lambda *_, **__: False)
    assert cli.run(["predict", NORMAL]) == cli.NO_SOLUTION


@pytest.mark.parametrize(
    ("error", "exit_code"),
    [
        (NoSolutionFound("contact, 3 mm at 0.2 s", gait="last", report="table"), cli.NO_SOLUTION),
        (ModelError("the DOF are\nout of order"), cli.BAD_INPUT),
        (OSError(28, "No space left on device"), cli.BAD_INPUT),
        (KeyboardInterrupt(), 130),
    ],
    ids=lambda value: type(value).__name__,
)
@pytest.mark.usefixtures("here")
def test_errors_on_the_way_are_one_line(capsys, replace_room, error, exit_code):
    def fail(*_, **__):
        raise error

    replace_room("prediction", predict_to_folder=fail)
    assert cli.run(["predict", NORMAL]) == exit_code
    assert_one_line(capsys)


def test_no_solution_keeps_the_last_iterate():
    error = NoSolutionFound("stopped", gait="last", report="table")
    assert (str(error), error.gait, error.report) == ("stopped", "last", "table")


def test_play_and_plot_take_the_result_of_the_folder(here, capsys, replace_room):
    (here / "gait.npz").write_bytes(b"")
    (here / "playback.html").write_text("gait=0123456789abcdef")
    taken = []
    replace_room("walk.gait_file", load_gait=lambda folder: f"gait of {folder}")
    replace_room("walk.described", no_walk=lambda _: "")
    replace_room(
        "playback.page",
        play=lambda gait, host: taken.append((gait, host)),
        save_playback=lambda gait, path: path.write_text(f"page of the {gait}"),
    )
    replace_room(
        "pictures.plots",
        save_plots=lambda gait, folder: (folder / "a.png").write_text(gait),
        PLOTS=["a", "b"],
    )
    assert cli.run(["play", "."]) == cli.run(["plot", "."]) == 0
    assert taken == [("gait of .", "127.0.0.1")]
    assert (here / "a.png").read_text() == "gait of ."
    assert (here / "playback.html").read_text() == "page of the gait of ."
    assert capsys.readouterr().out == "wrote 2 plots and playback.html to .\n"


def test_a_comparison_tells_what_it_wrote(here, capsys, replace_room):
    (here / "gait.npz").write_bytes(b"")
    replace_room("people.comparison", compare_to_folder=lambda folder: f"table of {folder}")
    assert cli.run(["compare", "."]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said == ["table of .", "wrote compare.json, compare.csv, compare.png to ."]


@pytest.mark.parametrize("command", ["explain", "report", "export", "verify", "play", "compare"])
def test_a_file_is_no_result_folder(here, capsys, command):
    (here / "gait.npz").write_bytes(b"")
    assert cli.run([command, "gait.npz"]) == cli.BAD_INPUT
    assert_one_line(capsys, "gait.npz: is a file, give the folder of a result")


def test_a_page_is_saved_with_the_folders_above_it(here, capsys, replace_room):
    (here / "gait.npz").write_bytes(b"")
    replace_room("walk.gait_file", load_gait=lambda folder: f"gait of {folder}")
    replace_room("walk.described", no_walk=lambda _: "")
    replace_room("playback.page", save_playback=lambda gait, path: path.write_text(gait))
    assert cli.run(["play", ".", "--save", "new/sub/page.html"]) == 0
    assert Path("new/sub/page.html").read_text() == "gait of ."
    assert capsys.readouterr().out == "wrote new/sub/page.html\n"
    assert cli.run(["play", ".", "--save", "gait.npz/page.html"]) == cli.BAD_INPUT
    assert_one_line(capsys, "gait.npz/page.html: cannot be written: Not a directory")


@pytest.mark.parametrize("place", ["", "docs/"])
def test_results_are_not_committed(place):
    """Not in the folder of the tutorial either, where it writes when it is opened there."""
    git = shutil.which("git")
    if not git or not (ROOT / ".git").exists():
        pytest.skip("no repository")
    path = f"{place}out/normal/gait.npz"
    assert subprocess.run([git, "check-ignore", "-q", path], cwd=ROOT, check=False).returncode == 0


def test_an_unreadable_result_is_one_line(here, capsys, replace_room):
    def load_gait(folder):
        raise ResultError(f"{folder}/gait.npz: not a result of human_gait")

    (here / "gait.npz").write_bytes(b"junk")
    replace_room("walk.gait_file", load_gait=load_gait)
    replace_room("playback.page", play=None)
    assert cli.run(["play", "."]) == cli.BAD_INPUT
    assert_one_line(capsys, "not a result")


def test_urdf_writes_the_body_of_the_scenario(here, capsys, replace_room):
    (here / "her.toml").write_text(WALK + '[subject]\nsex = "female"\n[load]\nmass = 9\n')

    def scenario_robot(task=None):
        return f"{task.subject.sex} {task.load.mass}" if task else "male 0.0"

    replace_room("export.robot", scenario_robot=scenario_robot)
    assert cli.run(["urdf"]) == 0
    assert cli.run(["urdf", "--scenario", "her.toml", "--out", "her.urdf"]) == 0
    assert (here / "urdf" / "human.urdf").read_text() == "male 0.0"
    assert (here / "her.urdf").read_text() == "female 9.0"
    assert capsys.readouterr().out.splitlines() == ["wrote urdf/human.urdf", "wrote her.urdf"]


@pytest.mark.parametrize("arguments", [[], ["--help"], ["predict", "--help"]])
def test_help_is_shown_on_standard_output(capsys, arguments):
    assert cli.run(arguments) == 0
    captured = capsys.readouterr()
    assert "Usage: human-gait" in captured.out
    assert captured.err == ""


@pytest.mark.parametrize("command", ["film", "predict", "export"])
def test_no_word_of_a_help_is_taken_for_markup(capsys, command):
    """A unit in square brackets would be: it would be left out."""
    cli.run([command, "--help"])
    assert not re.search(r"[,(] *[.)] ", capsys.readouterr().out)


def test_the_version_is_that_of_the_package(capsys):
    assert cli.run(["--version"]) == 0
    assert capsys.readouterr().out.startswith("human-gait ")


def test_main_exits_with_the_code_of_the_command(capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["human-gait", "frob"])
    with pytest.raises(SystemExit) as exited:
        cli.main()
    assert exited.value.code == cli.BAD_INPUT
    assert_one_line(capsys, "frob")


_DRAWING = "matplotlib PIL meshcat jinja2 scipy.spatial scipy.ndimage"


@pytest.mark.parametrize(
    ("program", "heavy"),
    [
        ("from human_gait import cli; cli.run(['--help'])", "pydrake pinocchio scipy numpy"),
        ("import human_gait.prediction", "scipy.interpolate scipy.optimize scipy.stats"),
    ],
    ids=["help", "prediction"],
)
def test_what_is_not_needed_yet_is_not_imported(program, heavy):
    shown = f"\nimport sys; print(sorted({{*'{heavy} {_DRAWING}'.split()}} & set(sys.modules)))"
    run = subprocess.run(
        [sys.executable, "-c", program + shown], capture_output=True, text=True, check=True
    )
    assert run.stdout.splitlines()[-1] == "[]"


def test_the_choices_are_those_of_the_rooms():
    """They are written down again because importing the rooms takes seconds."""
    from human_gait.dynamics.inverse_dynamics import ENGINES
    from human_gait.solving.drake_solvers import SOLVERS

    assert tuple(arguments.DynamicsName) == ENGINES
    assert tuple(arguments.SolverName) == SOLVERS
    assert tuple(arguments.SolverChoice) == (*SOLVERS, "all")


# --- scenarios by name, and all that is wrong with one


def test_a_shipped_scenario_is_predicted_by_name_and_its_file_told(here, capsys, prediction):
    assert cli.run(["predict", "backpack-20"]) == 0
    assert prediction[0][:3] == ("backpack-20", "newton", Path("out/backpack-20"))
    assert capsys.readouterr().out == f"scenario: {scenario_file('backpack-20')}\n"
    (here / "backpack-20").write_text('name = "own"\n' + WALK)
    assert cli.run(["predict", "backpack-20"]) == 0
    assert prediction[1][0] == "own"
    assert capsys.readouterr().out == ""


@pytest.mark.usefixtures("here")
def test_everything_that_is_wrong_with_a_scenario_is_told_in_a_line_each(capsys, prediction):
    Path("bad.toml").write_text("[walk]\nspeed = 9\n[load]\nmass = '3 m'\n\"a\\nb\" = 1\n")
    assert cli.run(["predict", "bad.toml"]) == cli.BAD_INPUT
    lines = capsys.readouterr().err.splitlines()
    told = [("walk.speed = 9", "3 m/s"), ("load.a b", "unknown")]
    told.append(('load.mass = "3 m"', "a mass is wanted"))
    assert len(lines) == len(told)
    assert all(line.startswith("error: bad.toml: ") for line in lines)
    for key, words in told:
        assert any(key in line and words in line for line in lines)
    assert prediction == []


@pytest.mark.usefixtures("here")
def test_of_many_errors_some_are_told(capsys):
    Path("bad.toml").write_text("[limits]\n" + "".join(f"a{i} = 1\n" for i in range(90)) + WALK)
    assert cli.run(["predict", "bad.toml"]) == cli.BAD_INPUT
    *lines, last = capsys.readouterr().err.splitlines()
    assert len(lines) == exits.MOST_ERRORS
    assert last == f"error: and {90 - exits.MOST_ERRORS} more"
