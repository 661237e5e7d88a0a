"""A result is the old one or the new one, whole, whatever happens to those who write it."""

import ctypes
import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from human_gait.exceptions import ResultError
from human_gait.results import exchange
from human_gait.results import folder as room
from human_gait.results.folder import replaced_folder, whole_file
from human_gait.results.reading import read_json
from human_gait.results.unfinished import MARK

WRITERS = Path(__file__).with_name("writers.py")
OLD, NEW = "0.0", "10.0"
NOBODY = 2**22 + 1  # beyond the numbers that processes get


WAYS = (
    *("kill", "stop", "full exchange", "full renames", "full one-by-one", "together"),
    *("stop renames", "kill renames"),
)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Where all ways to fail were tried, by copies of one process that takes seconds to begin."""
    place = tmp_path_factory.mktemp("writers")
    subprocess.run([sys.executable, str(WRITERS), str(place), *WAYS], check=True, timeout=600)
    return place


def tries(place, way):
    """Return what the folder held, and how processes ended, at each try, and what was said."""
    printed, said = ((place / f"{way}.{kind}").read_text() for kind in ("out", "err"))
    lines = [line.split(maxsplit=1)[1].rsplit(maxsplit=1) for line in printed.splitlines()]
    return [state for state, _ in lines], {code for _, code in lines}, said


# --- processes that fail


@pytest.mark.parametrize("how", ["kill", "stop"])
def test_a_kill_or_ctrl_c_at_any_step_leaves_the_old_result_or_the_new(place, how):
    states, codes, _ = tries(place, how)
    assert set(states) == {OLD, NEW}
    assert states.count(OLD) > 20
    assert codes == {"0", "137" if how == "kill" else "130"}
    assert {path.name for path in (place / how).iterdir()} == {"walk", "had notes"}


@pytest.mark.parametrize("way", ["exchange", "renames", "one-by-one"])
def test_a_full_disk_leaves_the_old_result_and_says_so(place, way):
    states, codes, said = tries(place, f"full {way}")
    assert states == [OLD] * (len(states) - 1) + [NEW]
    assert len(states) > 3
    assert codes == {"2", "0"}
    line = f"{place / f'full {way}' / 'walk'}: the result cannot be written: File too large; "
    assert set(said.splitlines()) == {f"{line}the new result is lost, the old one is as it was"}


def test_results_written_at_once_do_not_mix(place):
    states, _, said = tries(place, "together")
    assert not [state for state in states if "mix" in state or state == "none"]
    assert len(set(states)) > 1
    assert said == ""


def test_where_folders_cannot_be_exchanged_ctrl_c_does_the_same(place):
    states, _, _ = tries(place, "stop renames")
    assert set(states) == {OLD, NEW}


def test_where_folders_cannot_be_exchanged_a_kill_can_only_hide_the_result(place):
    states, _, _ = tries(place, "kill renames")
    assert set(states) == {OLD, NEW, "none"}
    assert states.count("none") <= 2


# --- one process


@pytest.fixture
def old(tmp_path):
    """A result with a comparison and what somebody else has put beside it."""
    folder = tmp_path / "walk"
    (folder / "sub" / "inner").mkdir(parents=True)
    for name in ("export", "made"):
        (folder / name).mkdir()
    for name in (
        *("gait", "compare", "notes", "sub/inner/data", "sub/compare"),
        *("export/motion", "export/notes", "made/motion"),
    ):
        (folder / name).write_text(f"old {name}")
    (folder / "link").symlink_to("notes")
    (folder / "sub" / "dead").symlink_to("nowhere")
    return folder


DERIVED = ("compare", "export/motion", "made/motion")


def renew(folder, error=None, **others):
    with replaced_folder(folder, DERIVED) as new:
        for name in ("gait", *others):
            (new / name).write_text("new")
        if error:
            raise error


def contents(folder):
    return {
        str(path.relative_to(folder)): path.read_text()
        for path in folder.rglob("*")
        if path.is_file()
    }


RENEWED = {
    "gait": "new",
    "notes": "old notes",
    "link": "old notes",
    "sub/inner/data": "old sub/inner/data",
    "sub/compare": "old sub/compare",
    "export/notes": "old export/notes",
}


def assert_renewed(folder):
    assert contents(folder) == RENEWED
    assert (folder / "link").is_symlink()
    assert (folder / "sub" / "dead").is_symlink()
    assert not (folder / "made").exists()
    assert not [path for path in folder.parent.iterdir() if MARK in path.name]


def test_what_is_not_ours_stays_and_what_is_derived_goes(old):
    old.chmod(0o750)
    renew(old)
    assert_renewed(old)
    assert old.stat().st_mode & 0o777 == 0o750


def refuse(code):
    def refusal(*_, **__):
        raise OSError(code, os.strerror(code))

    return refusal


@pytest.mark.parametrize(
    ("place", "name", "instead"),
    [
        (exchange, "exchange", refuse(errno.EBUSY)),  # a mount point
        (exchange, "exchange", refuse(errno.EXDEV)),
        (os, "link", refuse(errno.EPERM)),  # a file system without hard links
        (ctypes, "CDLL", lambda *_, **__: object()),  # a library without renameat2
        (room, "can_move", lambda _: False),
    ],
)
def test_every_way_to_replace_gives_the_same(old, monkeypatch, place, name, instead):
    monkeypatch.setattr(place, name, instead)
    renew(old)
    assert_renewed(old)


@pytest.mark.parametrize("name", ["\N{HIRAGANA LETTER A}" * 80, "a." + "b" * 250, "a b", "-", "%s"])
def test_any_name_that_a_folder_can_have_will_do(tmp_path, name):
    for text in ("old", "new"):
        with replaced_folder(tmp_path / name) as new, whole_file(new / name) as path:
            path.write_text(text)
    assert contents(tmp_path) == {f"{name}/{name}": "new"}


@pytest.mark.parametrize("here", [".", "sub"])
def test_the_current_folder_stays_under_ones_feet(old, monkeypatch, here):
    monkeypatch.chdir(old / here)
    before = old.stat().st_ino
    renew(old)
    assert old.stat().st_ino == before
    assert_renewed(old)


@pytest.mark.parametrize("kind", ["home", "crowded"])
def test_a_folder_that_is_more_than_a_result_is_not_made_anew(old, monkeypatch, kind):
    if kind == "home":
        monkeypatch.setenv("HOME", str(old))
    else:
        monkeypatch.setattr(room, "_MANY", 5)
    before = old.stat().st_ino, (old / "sub").stat().st_ino
    renew(old)
    assert (old.stat().st_ino, (old / "sub").stat().st_ino) == before
    assert_renewed(old)


def test_a_current_folder_that_is_gone_does_not_matter(old, monkeypatch):
    gone = old.parent / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    renew(old)
    assert_renewed(old)


def test_a_folder_is_made_with_those_above_it(tmp_path):
    renew(tmp_path / "a" / "b")
    assert contents(tmp_path) == {"a/b/gait": "new"}


def test_a_link_to_a_folder_stays_a_link(old):
    link = old.parent / "latest"
    link.symlink_to("walk")
    renew(link)
    assert link.is_symlink()
    assert_renewed(old)


@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError, ResultError])
def test_an_exception_passes_and_nothing_is_changed(old, error):
    before = contents(old)
    with pytest.raises(error):
        renew(old, error=error)
    assert contents(old) == before
    assert list(old.parent.iterdir()) == [old]


def test_where_nothing_can_be_written_the_old_result_is_named(old):
    full = OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(ResultError, match=r"No space left.*; the new .* lost, the old .* as it"):
        renew(old, full)
    with pytest.raises(ResultError, match=r"is lost$"):
        renew(old / "gait" / "below")


@pytest.mark.parametrize("inner", [".", "inner", "inner/most"])
def test_a_file_in_the_place_of_a_folder_is_kept(tmp_path, inner):
    (tmp_path / "walk").write_text("mine")
    with pytest.raises(ResultError, match=r"cannot be written: Not a directory; .* is lost"):
        renew(tmp_path / "walk" / inner)
    if inner != ".":
        with pytest.raises(ResultError, match=r"cannot be written: Not a directory$"):
            rewrite(tmp_path / "walk" / inner, "new")
    assert contents(tmp_path) == {"walk": "mine"}


def test_what_took_no_solve_is_not_called_lost(old):
    before = contents(old)
    with (
        pytest.raises(ResultError) as caught,
        replaced_folder(old, solved=False),
    ):
        raise PermissionError(errno.EACCES, "Permission denied")
    assert str(caught.value) == f"{old}: cannot be written: Permission denied"
    assert contents(old) == before


def test_the_folders_above_a_file_are_made(tmp_path):
    rewrite(tmp_path / "new" / "sub" / "page.html", "new")
    assert contents(tmp_path) == {"new/sub/page.html": "new"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "walk: no a.json: predict it again"),
        ("{", "walk/a.json: it is damaged, it is no JSON at line 1, column 2: predict it again"),
        ("[" * 100_000, "walk/a.json: it is damaged, it is nested too deeply: predict it again"),
        ("{}", "walk/a.json: it has no key: it is damaged, predict it again"),
        ("[]", "walk/a.json: it must be a table, not a list: it is damaged, predict it again"),
    ],
)
def test_a_json_file_that_cannot_be_used_is_named(tmp_path, monkeypatch, text, said):
    monkeypatch.chdir(tmp_path)
    Path("walk").mkdir()
    if text is not None:
        Path("walk/a.json").write_text(text)
    with pytest.raises(ResultError) as caught:
        read_json(Path("walk/a.json"), {"key": str})
    assert str(caught.value) == said


def test_files_that_were_replaced_in_part_are_reported(old, monkeypatch):
    monkeypatch.setattr(room, "can_move", lambda _: False)
    (old / "second").mkdir()
    (old / "second" / "full").touch()
    with pytest.raises(ResultError, match="some of its files are old, some new"):
        renew(old, second="new")


def test_a_folder_of_results_is_replaced_where_it_cannot_be_renamed(old, monkeypatch):
    monkeypatch.setattr(room, "can_move", lambda folder: folder.name != "walk")
    with replaced_folder(old, ["sub/compare"]) as new:
        (new / "sub").mkdir()
        (new / "sub" / "data").write_text("new")
    assert contents(old / "sub") == {"data": "new", "inner/data": "old sub/inner/data"}


def test_what_killed_runs_left_is_removed_but_not_what_others_write(old):
    dead, alive = (old.with_name(f".walk{MARK}{n}-0123abcd") for n in (NOBODY, 1))
    for folder in (dead, alive):
        shutil.copytree(old, folder, symlinks=True)
    renew(old)
    assert not dead.exists()
    assert contents(alive)


def test_a_file_is_replaced_whole(tmp_path):
    path, link = tmp_path / "file.txt", tmp_path / "link.txt"
    link.symlink_to("file.txt")
    left = tmp_path / f".file.txt{MARK}{NOBODY}-0123abcd.txt"
    left.touch()
    for text in ("old", "new"):
        rewrite(link, text)
    assert contents(tmp_path) == {"file.txt": "new", "link.txt": "new"}
    with pytest.raises(ResultError, match="cannot be written: No space"):
        rewrite(path, "half", OSError(errno.ENOSPC, "No space left on device"))
    assert contents(tmp_path) == {"file.txt": "new", "link.txt": "new"}
    with pytest.raises(ResultError, match="Is a directory"):
        rewrite(tmp_path, "half")


def rewrite(path, text, error=None):
    with whole_file(path) as new:
        assert new.suffix == path.suffix
        new.write_text(text)
        if error:
            raise error


def test_a_device_is_written_to_and_not_replaced():
    with whole_file(Path("/dev/null")) as path:
        path.write_text("gone")
    assert Path("/dev/null").is_char_device()
