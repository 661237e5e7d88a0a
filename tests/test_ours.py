"""Files of a user that bear our names stay as they are, and so does what lies around them."""

import contextlib
import errno
import io
import os
import shutil
import tempfile
import types
from pathlib import Path

import matplotlib as mpl
import pytest
from pages import sparing
from PIL import Image
from solves import solved
from walking import guessed_gait

import human_gait as hg
from human_gait import cli
from human_gait.commands.arguments import beside, check_writable
from human_gait.exceptions import ResultError
from human_gait.pictures import plots
from human_gait.prediction import OURS
from human_gait.results.names import EXPORTED, PLOTS, PREDICTED
from human_gait.results.ours import check_free, is_ours, our_folder
from human_gait.scenario import Scenario
from human_gait.walk.gait_file import load_gait, save_gait

MINE = "my own, made by hand for years"
NAMES = ("report.html", "compare.csv", "export/model.osim", "summary.json", "zmp.png")


def result(folder):
    """A folder with what makes it a result."""
    folder.mkdir(parents=True, exist_ok=True)
    save_gait(guessed_gait(), folder)
    return folder


def put(path, text=MINE):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


# --- what is ours


ODD = os.fsdecode(  # \xe2\x80\xae turns the direction of writing
    b"-caf\xe9 [/b][red] 'q' \"d\" \x1b[31m\x9b $(x) `y` ;&*?#%41 \xe2\x80\xae/-a\n\tb\\/~/"
    + b"n" * 255
)
"""Bytes that are no UTF-8, markup, quotes, escapes, signs of shells, lines, 255 letters."""

COMMANDS = (
    *(["verify"], ["explain"], ["plot"], ["compare"], ["report"], ["export"]),
    *(["film", "--size", "64x64"], ["play", "--save", f"./{ODD}/own.html"]),
)


@pytest.fixture(scope="module")
def everything(tmp_path_factory):
    """A result with all that commands make of it, in a folder that only a system could like."""
    place = tmp_path_factory.mktemp("all")
    folder = place / ODD
    shutil.copytree(solved("preferred").folder, folder)
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(io.StringIO()) as out:
        patch.chdir(place)
        sparing(patch)
        for command in COMMANDS:
            said = io.StringIO()
            with contextlib.redirect_stderr(said):
                code = cli.run([*command, "--", ODD])
            assert (command, code, said.getvalue()) == (command, 0, "")
        assert [sign for sign in "\x1b\x9b\udce9\u202e" if sign in out.getvalue()] == []
    return folder


def test_every_command_works_in_every_folder_and_what_it_writes_is_known_as_ours(everything):
    """The fixture runs the commands."""
    files = [path for path in everything.rglob("*") if path.is_file()]
    assert {path.name for path in files} >= {*PREDICTED, *EXPORTED, "report.html", "compare.csv"}
    assert [path.name for path in files if not is_ours(path)] == []
    assert {"own.html", "walk.gif"} <= {path.name for path in files}


def test_a_result_is_written_and_read_there_from_python_too(tmp_path, monkeypatch):
    """Even temporary files may have to be in such a folder."""
    folder = guessed_gait().save(tmp_path / ODD)
    check_writable(folder)
    assert load_gait(folder).scenario == guessed_gait().scenario
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    assert all(map(is_ours, guessed_gait().export(folder / "c3d", "c3d")))


@pytest.mark.parametrize(
    ("name", "head"),
    [
        ("summary.json", b'{"success": true, "solver_status": "x", "walking_speed_m_per_s": 1'),
        ("explanation.json", b'{"price_unit": "N^2 m^2 s per unit of the bound",'),
        ("verification.json", b'{\n  "angles off the splines": {'),
        ("report.html", "<title>a \N{EN DASH} predicted walking</title>".encode()),
        ("motion.bvh", b"HIERARCHY\nROOT pelvis\n{\n  JOINT thigh_r\n  {"),
        ("empty", b""),
    ],
)
def test_so_are_those_of_older_versions(tmp_path, name, head):
    (tmp_path / name).write_bytes(head)
    assert is_ours(tmp_path / name)


def own_picture(path):
    figure = mpl.figure.Figure(figsize=(5, 4))
    figure.savefig(path)


def test_nothing_else_is(tmp_path):
    own_picture(tmp_path / "compare.png")
    Image.new("RGB", (1920, 540)).save(tmp_path / "zmp.png")
    (tmp_path / "report.html").write_text(
        "<title>human_gait and predicted walking: a review</title>"
    )
    (tmp_path / "summary.json").write_text('{"walking_speed_m_per_s": 1.2}')
    (tmp_path / "gait_cycle.csv").write_text("gait_cycle_percent,hip,knee\n")
    (tmp_path / "gait.npz").write_bytes(b"PK\3\4 of somebody else's")
    (tmp_path / "dead").symlink_to("nowhere")
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    assert [path.name for path in tmp_path.iterdir() if is_ours(path)] == []


# --- what is not ours stays


def everything_in(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*.*")}


@pytest.mark.parametrize("beside_a_result", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_a_prediction_is_refused_before_it_solves(
    tmp_path, monkeypatch, capsys, name, beside_a_result
):
    """Nothing is solved: there is no file of a scenario where the command would go on."""
    if beside_a_result:
        result(tmp_path)
    put(tmp_path / name)
    before = everything_in(tmp_path)
    monkeypatch.chdir(tmp_path)
    for out in (".", str(tmp_path)):
        assert cli.run(["predict", "normal", "--out", out]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1
        assert f"{name}: is in the way: " in said
        assert "--out" in said
    assert everything_in(tmp_path) == before


def test_so_it_is_among_files_of_ours_that_somebody_has_collected(tmp_path):
    put(tmp_path / "compare.csv", "reference,curve,r,rmse,rmse_offset_free,offset\n")
    with pytest.raises(ResultError, match=r"compare.csv: is in the way"):
        check_writable(tmp_path)
    result(tmp_path)
    check_writable(tmp_path)


@pytest.mark.parametrize("kind", ["folder", "dead link", "link to mine", "pipe"])
def test_what_is_no_file_is_in_the_way_too(tmp_path, kind):
    folder = result(tmp_path / "walk")
    path = folder / "playback.html"
    match kind:
        case "folder":
            put(path / "notes.txt")
        case "dead link":
            path.symlink_to("nowhere")
        case "link to mine":
            put(tmp_path / "page.html")
            path.symlink_to(tmp_path / "page.html")
        case "pipe":
            os.mkfifo(path)
    with pytest.raises(ResultError, match=r"playback.html: is in the way"):
        check_writable(folder)
    with pytest.raises(ResultError, match="in the way"), our_folder(folder, OURS) as new:
        (new / "playback.html").touch()
    assert os.path.lexists(path)


def test_a_file_in_the_place_of_a_folder_of_ours_is_not_lost(tmp_path):
    folder = result(tmp_path)
    put(folder / "newton")
    put(folder / "export")
    check_writable(folder)
    with pytest.raises(ResultError, match=r"newton: is in the way"):
        check_writable(folder, by_all=True)
    with pytest.raises(ResultError, match=r"newton: is in the way"), our_folder(folder) as new:
        put(new / "newton" / "gait.npz", "")
    with our_folder(folder, OURS) as new:
        (new / "summary.json").touch()
    assert (folder / "newton").read_text() == (folder / "export").read_text() == MINE


def test_results_in_folders_of_their_own_stay_unless_they_were_compared(tmp_path):
    for compared in (False, True):
        folder = result(tmp_path / str(compared))
        result(folder / "snopt")
        if compared:
            put(folder / "agreement.json", '{"cost_relative_to_first": {}}')
        with our_folder(folder, OURS) as new:
            save_gait(guessed_gait(), new)
        assert (folder / "snopt" / "gait.npz").exists() is not compared


WRITERS = {
    "export": lambda folder: ["export", folder],
    "plot": lambda folder: ["plot", folder],
    "compare": lambda folder: ["compare", folder],
    "report": lambda folder: ["report", folder],
    "refine": lambda folder: ["refine", folder],
    "urdf": lambda _: ["urdf"],
}
IN_THE_WAY = {
    "export": "walk/export/markers.c3d",
    "plot": "walk/zmp.png",
    "compare": "walk/compare.png",
    "report": "walk/report.html",
    "refine": "walk-refined/gait.npz",
    "urdf": "urdf/human.urdf",
}


@pytest.mark.parametrize("command", WRITERS)
def test_other_commands_leave_what_is_not_ours(everything, tmp_path, monkeypatch, capsys, command):
    shutil.copytree(everything, tmp_path / "walk")
    monkeypatch.chdir(tmp_path)
    sparing(monkeypatch)
    Path(IN_THE_WAY[command]).unlink(missing_ok=True)
    put(Path(IN_THE_WAY[command]))
    before = everything_in(tmp_path)
    assert cli.run(WRITERS[command]("walk")) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"error: {IN_THE_WAY[command]}: is in the way: ")
    assert said.count("\n") == 1
    assert everything_in(tmp_path) == before


def test_verify_leaves_it_with_a_warning(tmp_path, capsys):
    put(result(tmp_path) / "verification.json")
    assert cli.run(["verify", str(tmp_path)]) == 1
    assert "verification.json: is in the way" in capsys.readouterr().err
    assert (tmp_path / "verification.json").read_text() == MINE


def test_from_python_it_is_left_too(tmp_path):
    put(tmp_path / "summary.json")
    with pytest.raises(ResultError, match=r"summary.json: is in the way"):
        guessed_gait().save(tmp_path)
    put(tmp_path / "motion.bvh")
    with pytest.raises(ResultError, match=r"motion.bvh: is in the way"):
        guessed_gait().export(tmp_path, "bvh")
    with pytest.raises(ResultError, match=r"zmp.png: is in the way"):
        check_free(tmp_path, put(tmp_path / "zmp.png") or ["zmp.png"])
    assert {path.read_text() for path in tmp_path.iterdir()} == {MINE}


# --- no path at all


@pytest.mark.parametrize(
    "words",
    [
        *(["predict", "normal", "--out", ""], ["predict", "normal", "--out="], ["predict", ""]),
        *(["refine", ".", "--out", ""], ["export", ".", "--out", ""], ["report", ".", "--out", ""]),
        *(["figures", ".", "--out", ""], ["urdf", "--out", ""], ["play", ".", "--save", ""]),
        *(["init", "--out", ""], ["verify", ""], ["plot", ""], ["compare", ""], ["explain", ""]),
        *(["report", ".", ""], ["figures", ""], ["predict", "normal", "--warm-from", ""]),
    ],
)
def test_an_empty_path_is_none(tmp_path, monkeypatch, capsys, words):
    """It would be the current folder, where this is a result."""
    monkeypatch.chdir(result(tmp_path))
    before = everything_in(tmp_path)
    assert cli.run(words) == 2
    said = capsys.readouterr().err
    assert "is empty: " in said
    assert said.count("\n") == 1
    assert everything_in(tmp_path) == before


@pytest.mark.parametrize(
    "write",
    [
        lambda gait: gait.save(""),
        lambda gait: gait.export(""),
        lambda gait: hg.report(gait, out=""),
        lambda gait: hg.film(gait, ""),
    ],
)
def test_nor_is_it_one_from_python(tmp_path, monkeypatch, write):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ResultError, match="empty path"):
        write(guessed_gait())
    assert list(tmp_path.iterdir()) == []


# --- the place is tried


@pytest.mark.parametrize(
    ("place", "why"),
    [
        ("a" * 300, "File name too long"),
        ("a/" * 2040 + "b", "File name too long"),
        ("\N{HIRAGANA LETTER A}" * 100, "File name too long"),
        ("file/walk", "Not a directory"),
        ("file", "Not a directory"),
        ("loop/walk", "Too many levels of symbolic links"),
        ("/proc/walk", "No such file or directory"),
    ],
)
def test_a_place_where_nothing_can_be_written_is_told_before_a_solve(
    tmp_path, monkeypatch, capsys, place, why
):
    monkeypatch.chdir(tmp_path)
    Path("file").write_text(MINE)
    Path("loop").symlink_to("loop")
    for command in (["predict", "normal"], ["refine", "walk"]):
        result(tmp_path / "walk")
        assert cli.run([*command, "--out", place]) == 2
        said = capsys.readouterr().err
        assert f"a result cannot be written here: {why}" in said
        assert said.count("\n") == 1
    assert {path.name for path in tmp_path.iterdir()} == {"file", "loop", "walk"}


@pytest.mark.parametrize("place", ["walk", "new", "deep/er/walk", "link", "a" * 255, "."])
def test_trying_leaves_everything_as_it_was(tmp_path, monkeypatch, place):
    monkeypatch.chdir(tmp_path)
    result(tmp_path / "walk")
    Path("link").symlink_to("nowhere yet")
    before = sorted(tmp_path.rglob("*"))
    check_writable(Path(place))
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("name", ["x" * 101, "x" * 300])
def test_a_name_of_more_than_100_signs_is_refused(tmp_path, capsys, name):
    (tmp_path / "a.toml").write_text(f'name = "{name}"\n[walk]\nspeed = 1.3\nstep_length = 0.7\n')
    assert cli.run(["predict", str(tmp_path / "a.toml")]) == 2
    assert "a name of at most 100 letters" in capsys.readouterr().err
    assert Scenario(name[:100], {"speed": 1.3, "step_length": 0.7}).name == name[:100]


@pytest.mark.parametrize("place", [".", "../walk", "./", "../walk/../walk/."])
def test_a_refinement_is_written_beside_a_result_that_has_no_name_here(
    tmp_path, monkeypatch, place
):
    folder = result(tmp_path / "walk")
    monkeypatch.chdir(folder)
    put(tmp_path / "walk-refined" / "gait.npz")
    with pytest.raises(ResultError, match=r"walk-refined/gait.npz: is in the way"):
        check_writable(beside(Path(place), "-refined"))


# --- pictures: all or none


@pytest.mark.parametrize("call", range(len(PLOTS)))
def test_a_disk_that_gets_full_leaves_the_old_pictures(tmp_path, monkeypatch, call):
    content, made = types.SimpleNamespace(png=lambda *_: b"gait=0123456789abcdef"), iter(range(99))
    monkeypatch.setattr(plots, "plot", lambda *_: content)
    plots.save_plots(guessed_gait(), tmp_path)
    before, write = everything_in(tmp_path), Path.write_bytes

    def full(path, text):
        if next(made) == call:
            write(path, text[:10])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(path, text + b" new")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", full)
        with pytest.raises(ResultError, match="No space left"):
            plots.save_plots(guessed_gait(), tmp_path)
    assert everything_in(tmp_path) == before
    assert set(before) == set(PLOTS)
