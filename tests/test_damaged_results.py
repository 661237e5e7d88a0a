"""The short form of `benchmarks/damaged_results.py`, and chosen damages: one line, no traceback."""

import json
import os
import shutil
import time
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from walking import guessed_gait

from benchmarks.damaged_results import SPOILS, make_from, tried
from human_gait import cli
from human_gait.exceptions import ResultError
from human_gait.problem.program import build_program
from human_gait.results.archive import numbers, opened
from human_gait.results.names import EXPLANATION, GAIT_FILE, MULTIPLIERS, SUMMARY
from human_gait.results.reading import LARGEST, parsed
from human_gait.results.shapes import Between, Many, Maybe, faults
from human_gait.solving.warm_start import fitting

CASES = 40


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    gait = guessed_gait()
    multipliers = fitting({}, build_program(gait.scenario, gait.basis))
    return make_from(replace(gait, multipliers=multipliers), tmp_path_factory.mktemp("whole"))


@pytest.fixture
def place(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "walk")


def refused(capsys, command, folder, *parts):
    assert cli.run([command, str(folder)]) == cli.BAD_INPUT
    error = capsys.readouterr().err
    assert error.startswith("error: ")
    assert error.count("\n") == 1
    for part in parts:
        assert part in error
    return error


def test_damaged_folders_end_every_command_in_a_line_that_names_the_file(whole):
    assert [found for number in range(CASES) if (found := tried(whole, number, 7))["wrong"]] == []


def changed(path, key, value):
    """Change a value of a JSON file as older versions wrote it, without digests."""
    found = json.loads(path.read_text())
    for name in ("gait", "digest"):
        found.pop(name, None)
    inside = found
    *outer, last = key.split(".")
    for part in outer:
        inside = inside[int(part) if part.isdigit() else part]
    inside[last] = value
    path.write_text(json.dumps(found))


@pytest.mark.parametrize(
    ("name", "key", "value", "wanted"),
    [
        (EXPLANATION, "step_time_s", 10**399, "a number up to 1e+300"),
        (EXPLANATION, "step_time_s", [], "a number, not a list"),
        (SUMMARY, "wall_time_s", 10**399, "a number up to 1e+300"),
        (SUMMARY, "wall_time_s", "fast", "a number, not the text 'fast'"),
        (SUMMARY, "wall_time_s", True, "a number, not true"),
        (SUMMARY, "iterations", 1.5, "a whole number"),
        (SUMMARY, "seed", -1, "a whole number"),
        (SUMMARY, "start", 5, "a text without control signs, not 5"),
        (SUMMARY, "start", "\ud800", "a text without control signs"),
        (SUMMARY, "start", "\x9b2J", "a text without control signs"),
        (SUMMARY, "start", "\u202eknaj", "a text without control signs"),
        (SUMMARY, "diagnosis.not_kept", ["\x1b[2Jerased"], "diagnosis.not_kept.0 must be a text"),
        (SUMMARY, "diagnosis", "none", "a table, not the text 'none'"),
        (SUMMARY, "success", "yes", "true or false"),
        (SUMMARY, "checks", [], "a table, not a list"),
        (SUMMARY, "attempts", {}, "a list, not a table"),
        (SUMMARY, "attempts", [{}], "it has no attempts.0.start"),
        (SUMMARY, "versions", {"a": None}, "versions.a must be a text"),
    ],
    ids=lambda value: str(value)[:20].encode("ascii", "replace").decode(),
)
def test_what_is_not_of_the_declared_shape_is_named_by_file_and_key(
    place, capsys, name, key, value, wanted
):
    changed(place / name, key, value)
    said = refused(capsys, "report", place, f"{place / name}: ", key, wanted)
    assert not set("\x1b\x9b\u202e") & set(said)


@pytest.mark.parametrize("key", ["checks.masses off the body.limit", "cost", "diagnosis"])
def test_what_may_be_null_may_not_be_missing(place, capsys, key):
    found = json.loads((place / SUMMARY).read_text())
    for name in ("gait", "digest"):
        found.pop(name)
    *outer, last = key.split(".")
    inside = found
    for part in outer:
        inside = inside[part]
    inside.pop(last)
    (place / SUMMARY).write_text(json.dumps(found))
    refused(capsys, "report", place, f"{SUMMARY}: it has no {key}")


@pytest.mark.parametrize("spoil", [SPOILS[0], SPOILS[1], SPOILS[3]])
def test_what_json_should_not_be_is_no_json(spoil):
    text = spoil('{"a": {"b": 1}}')
    with pytest.raises(ValueError, match=r"twice|deeply|digits"):
        parsed(text)


@pytest.mark.parametrize("text", ["NaN", "[Infinity]", '{"a": -Infinity}', "\ufeff{}", "{", ""])
def test_numbers_that_are_none_and_marks_are_no_json(text):
    with pytest.raises(ValueError, match=r"no number|byte order mark|no JSON at line 1"):
        parsed(text)


def test_a_shape_says_what_is_wrong_where():
    shape = {"a": Many({"b": Maybe(Between(0, 1))}), "c": Many(int, named=True)}
    assert not list(faults({"a": [{"b": 0.5}, {}], "c": {"x": 1}, "more": object()}, shape))
    wrong = {"a": [{"b": 2}, 3], "c": {"\x1b": 1, "x": 2**60}}
    assert list(faults(wrong, shape)) == [
        "a.0.b must be a number from 0 to 1, not 2",
        "a.1 must be a table, not 3",
        "c: a name in it must be a text without control signs",
        f"c.x must be a whole number from 0 to 2^53, not {2**60}",
    ]
    assert list(faults({"a": [0] * 30_000, "c": {}}, shape)) == [
        "a holds 30000 entries: at most 20000 can be"
    ]


@pytest.mark.parametrize("name", [SUMMARY, GAIT_FILE])
def test_what_is_no_file_is_not_waited_for(place, capsys, name):
    for put in (os.mkfifo, lambda path: path.symlink_to("/dev/zero")):
        (place / name).unlink()
        put(place / name)
        begin = time.perf_counter()
        refused(capsys, "explain", place, str(place))
        assert time.perf_counter() - begin < 10


def test_a_file_too_large_is_not_read(place, capsys):
    with (place / SUMMARY).open("ab") as file:
        file.truncate(2**40)
    refused(capsys, "explain", place, f"{SUMMARY}: is larger than {LARGEST} bytes")


def test_members_are_counted_before_they_are_read(place, capsys):
    np.savez(place / GAIT_FILE, **{f"n{k}": np.zeros(0) for k in range(300)})
    refused(capsys, "verify", place, "it holds too much")


@pytest.mark.parametrize(
    "head", ["(" * 5000, "\\d", "{'descr': '|O'}", "{", "{'shape': (2**62,)}", "\0", "1\n 1"]
)
def test_an_array_with_an_odd_head_is_named(tmp_path, head):
    text = f"{head}\n".encode()
    content = b"\x93NUMPY\1\0" + len(text).to_bytes(2, "little") + text + bytes(80)
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("odd.npy", content)
    with (
        pytest.raises(ResultError, match="odd is no array"),
        opened(tmp_path / "a.npz", "it") as file,
    ):
        numbers(file, "odd")


@pytest.mark.parametrize("name", [GAIT_FILE, MULTIPLIERS])
@pytest.mark.parametrize("content", [b"junk", b"\x80\x04N.", b"\x93NUMPY\1\0\2\0{}", b"", None])
def test_what_is_no_archive_is_told_in_plain_words(place, capsys, name, content):
    whole = (place / name).read_bytes()
    (place / name).write_bytes(b"junk" + whole if content is None else content)
    for word in ("pickle", "numpy", "zip"):
        assert word not in refused(capsys, "report", place, name)
