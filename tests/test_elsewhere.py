"""What was solved is written somewhere, whatever became of the place where it should be."""

import errno
import os
import tempfile
import types
from pathlib import Path

import pytest

from human_gait import prediction
from human_gait.exceptions import ResultError
from human_gait.results.unfinished import refuges

FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.fixture
def places(tmp_path, monkeypatch):
    """The places that there are, each in a folder here; `full` are those without room."""
    for name in ("temporary", "home", "here"):
        (tmp_path / name).mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path / "here")
    full = [Path("/var/tmp")]

    def write(folder, kept, *_):
        if any(folder.is_relative_to(place) for place in full):
            raise ResultError(f"{folder}: the result cannot be written") from FULL
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "gait.npz").write_text(str(kept))

    monkeypatch.setattr(prediction, "_write", write)
    monkeypatch.setattr(prediction, "best", lambda attempts: attempts[0])
    monkeypatch.setattr(prediction.console, "show_outcome", lambda *_: None)
    return types.SimpleNamespace(root=tmp_path, full=full)


def fails(folder, solved):
    with (
        pytest.raises(ResultError) as caught,
        prediction._kept_elsewhere(folder, solved),
    ):
        raise ResultError("lost") from FULL
    return str(caught.value)


@pytest.mark.parametrize("full", [[], ["temporary"], ["temporary", "home"]])
def test_it_is_where_there_is_room_and_it_is_said_where(places, full):
    places.full += [places.root / name for name in full]
    said = fails(Path("out/walk"), {"": ["a walk"]})
    start, kept = said.split("; it is in ")
    assert start == "out/walk: the result cannot be written here: No space left on device"
    assert (Path(kept) / "gait.npz").read_text() == "a walk"
    assert Path(kept).name == "walk"
    left = [path for path in places.root.glob("*/*") if not Path(kept).is_relative_to(path)]
    assert left == []


def test_results_of_several_solvers_are_kept_together(places):
    said = fails(Path("out/all"), {"newton": ["one"], "snopt": ["other"]})
    kept = Path(said.split("; it is in ")[1])
    assert {path.parent.name: path.read_text() for path in kept.glob("*/gait.npz")} == {
        "newton": "one",
        "snopt": "other",
    }
    assert kept.is_relative_to(places.root / "temporary")


def test_where_there_is_no_room_at_all_the_reason_is_told(places):
    places.full.append(places.root)
    assert fails(Path("walk"), {"": ["a walk"]}) == "lost"
    assert list(places.root.glob("*/*")) == []


def test_nothing_solved_is_written_nowhere(places):
    assert fails(Path("walk"), {}) == "lost"
    assert list(places.root.glob("*/*")) == []


def test_a_place_that_cannot_be_used_is_passed_over(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", "/dev/null")
    monkeypatch.setenv("HOME", str(tmp_path))
    found = [place.parent.parent for place in refuges("walk")]
    assert found[0] == Path("/var/tmp")
    assert tmp_path in found
