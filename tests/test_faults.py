"""Whatever is in a scenario or a result, a command ends with 0, 1 or 2 and at most one line.

Scenarios and results are mutated; nothing is solved. `conftest` tells how to try more of it.
"""

import contextlib
import io
import json
import os
import shutil
import signal
import string
import subprocess
import sys
import tracemalloc
import types
import warnings
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, currently_in_test_context, event, example, given, settings
from hypothesis import strategies as st
from walking import guessed_gait

from human_gait import cli, prediction
from human_gait.commands import exits
from human_gait.exceptions import NoSolutionFound
from human_gait.people import comparison
from human_gait.pictures import paper_figures
from human_gait.results.names import GAIT_FILE, MULTIPLIERS
from human_gait.scenario import Scenario
from human_gait.solving import starts as ladder
from human_gait.solving.warm_start import save_multipliers
from human_gait.terminal import LONGEST_MESSAGE
from human_gait.walk.gait_cycle import save_gait_cycle
from human_gait.walk.gait_file import load_gait, load_record, save_gait

ROOT = Path(__file__).resolve().parent.parent
TEXTS = [path.read_bytes() for path in sorted((ROOT / "scenarios").glob("*.toml"))]
LONGEST = 60  # [s] of one command
ENDS = {0, 1, 2}


class Hang(BaseException):
    """No command may take so long; nothing that handles errors may swallow it."""


def some(n):
    """Settings for `n` examples, or ten times as many in the thorough profile."""
    slow = [HealthCheck.too_slow, HealthCheck.function_scoped_fixture, HealthCheck.data_too_large]
    share = settings.default.max_examples / 100
    return settings(max_examples=max(int(n * share), 1), suppress_health_check=slow)


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """A folder with what commands read of a result."""
    folder = tmp_path_factory.mktemp("result")
    save_gait(guessed_gait(), folder)
    save_gait_cycle(guessed_gait(), folder / "gait_cycle.csv")
    summary = {"success": True, "solver_status": "optimal"}
    summary |= {"walking_speed_m_per_s": 1.2, "step_length_m": 0.66}
    (folder / "summary.json").write_text(json.dumps(summary))
    multipliers = {"joint limit": np.linspace(-1.0, 1.0, 330), "any": np.ones(9)}
    save_multipliers(replace(guessed_gait(), multipliers=multipliers), folder)
    return folder


@pytest.fixture(scope="module")
def arrays(result):
    with np.load(result / GAIT_FILE) as file:
        return dict(file)


@pytest.fixture
def place(result, tmp_path):
    """A copy of the result to spoil."""
    return shutil.copytree(result, tmp_path / "walk")


@pytest.fixture
def stopped(monkeypatch):
    """A solver that evaluates its start and gives up."""

    def solve(program, *_, **__):
        program.violations(program.guess())
        raise NoSolutionFound("stopped at once")

    monkeypatch.setattr(ladder, "solve", solve)


def ran(*arguments):
    """Run a command; return its exit code, once it is sure that it ended as it should."""

    def give_up(*_):
        raise Hang(arguments)

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(LONGEST)
    out, err = io.StringIO(), io.StringIO()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = cli.run([str(argument) for argument in arguments])
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    said = err.getvalue()
    assert code in ENDS, said
    if currently_in_test_context():  # pytest --hypothesis-show-statistics
        event(f"{arguments[0]} ends with {code}")
    *lines, rest = said.split("\n")
    assert rest == ""
    assert len(lines) <= (exits.MOST_ERRORS + 1 if "any.toml" in said else 1)
    for line in lines:
        assert len(line) <= LONGEST_MESSAGE + len("error: ")
        assert line.startswith("error: ") == (code == 2 or "stopped at once" in said)
    assert said or code != 2
    return code


# --- mutations


CHANGES = {
    "cut": lambda content, at, _start, _part: content[:at],
    "flip": lambda content, at, _start, _part: (
        content[:at] + bytes([content[at] ^ 1 << at % 8]) + content[at + 1 :]
    ),
    "overwrite": lambda content, at, _, part: content[:at] + part + content[at + len(part) :],
    "splice": lambda content, at, start, part: (
        content[:at] + content[start : start + len(part)] + content[at + len(part) :]
    ),
    "remove": lambda content, at, _, part: content[:at] + content[at + len(part) :],
    "insert": lambda content, at, _, part: content[:at] + part + content[at:],
}


@st.composite
def spoilt(draw, content, near=()):
    """Bytes with a few changes, anywhere or shortly after one of the places `near`."""
    for _ in range(draw(st.integers(1, 4))):
        last = len(content) - 1
        if last < 0:
            break
        anywhere = st.integers(0, last)
        close = [st.integers(min(p, last), min(p + 90, last)) for p in near]
        change = CHANGES[draw(st.sampled_from(sorted(CHANGES)))]
        place = draw(st.one_of(anywhere, *close))
        content = change(content, place, draw(anywhere), draw(st.binary(min_size=1, max_size=40)))
    return content


ODD = st.one_of(
    st.sampled_from(
        [
            *(0, -1, 1, 6, 7, 13, 10**9, 10**400, 2**63, -(2**63)),
            *(0.0, -0.0, 0.01, 0.99, 1e-320, 1e308, np.nan, np.inf, -np.inf, 0.5, 1.5),
            *(True, False, "", "male", "force", "none", "position", "\0", "\u202e", "x" * 9999),
            *([], {}, [0.0] * 3, [1, 2], [np.nan] * 3, ["knee_flexion_r"], ["nothing"], [[[]]]),
            *({"speed": 1.2}, {"knee_flexion_r": [0, 1]}, [{"a": 1}]),
        ]
    ),
    st.floats(),
    st.integers(),
    st.text(string.printable, max_size=9),
    st.floats(0.1, 1.5).map(lambda value: round(value, 3)),
)


@st.composite
def odd_tables(draw):
    """The tables of a scenario with values changed, removed or added."""
    tables = guessed_gait().scenario.to_dict()
    tables["discretisation"] |= {"intervals": 12, "dynamics_per_interval": 1}  # quick to check
    tables["limits"] = {"knee_flexion_r": [0.0, 70.0], "frozen": ["wrist_flexion_r"]}
    for _ in range(draw(st.integers(1, 3))):
        inner = [table for table in tables.values() if isinstance(table, dict)]
        table = draw(st.sampled_from([tables, *inner, *inner]))
        key = draw(st.sampled_from([*table, "new"]))
        match draw(st.sampled_from(["nudge", "nudge", "nudge", "set", "set", "remove", "rename"])):
            case "nudge" if isinstance(table.get(key), int | float) and abs(table[key]) < 1e300:
                share = draw(st.sampled_from([0.1, 0.3, 0.7, 0.9, 1.1, 1.4, 2.0, 4.0, -1.0]))
                table[key] = type(table[key])(share * table[key])
            case "set" | "nudge":
                table[key] = draw(ODD)
            case "remove":
                table.pop(key, None)
            case "rename":
                table[draw(st.text(string.printable, max_size=6))] = table.pop(key, 1)
    return tables


def toml(value):
    """A value as TOML, tables inline."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return str(value) if isinstance(value, float) else json.dumps(value)


def file_of(tables):
    return "".join(f"{json.dumps(key)} = {toml(value)}\n" for key, value in tables.items())


TYPES = ["f4", ">f8", "i8", "u1", "c16", "U", "S", "O", "?", "f2", "m8[s]", "V8"]
NUMBERS = [np.nan, np.inf, -np.inf, 1e308, -1e308, 1e150, 1e9, 1e3, 1e-320, 0.0, -1.0, 0.3]


LONG_TEXTS = ["[" * 99_999, '{"a":' * 99_999, "9" * 9999]
TEXT = st.text(max_size=20) | st.sampled_from(LONG_TEXTS)
SCALES = [-1.0, 0.0, 1.01, 10.0, 40.0, 1e3, 1e100]


@st.composite
def odd_array(draw, array):
    """An array of other type, shape or values, or none at all."""
    ways = [of_type, of_shape, of_values] if array.dtype.kind == "f" else [of_type, of_shape]
    way = draw(st.sampled_from([None, "text", *ways, *ways]))
    if way == "text":
        return np.array(draw(TEXT))
    return way(draw, array) if way else None


def of_type(draw, array):
    kind = draw(st.sampled_from(TYPES))
    with warnings.catch_warnings(action="ignore"):
        try:
            return array.astype(kind)
        except (ValueError, TypeError):
            return np.zeros(3, kind)


def of_shape(draw, array):
    flat = np.atleast_1d(array)
    shapes = [flat[None], array.ravel(), array.T, array[..., None], flat[:0], flat[1:]]
    return shapes[draw(st.integers(0, len(shapes) - 1))]


def of_values(draw, array):
    scaled = array * draw(st.sampled_from([1.0, 1.0, *SCALES]))
    n = draw(st.integers(0, 2)) or array.size
    at = draw(st.integers(0, array.size - n))
    if draw(st.booleans()):
        scaled.flat[at : at + n] = draw(st.sampled_from(NUMBERS))
    return scaled


def rewritten(folder, arrays, **changes):
    kept = {name: array for name, array in {**arrays, **changes}.items() if array is not None}
    np.savez(folder / GAIT_FILE, allow_pickle=True, **kept)


# --- scenarios


@some(25)
@given(st.sampled_from(TEXTS).flatmap(spoilt))
def test_a_scenario_of_spoilt_text(tmp_path, stopped, content):  # noqa: ARG001
    path = tmp_path / "any.toml"
    path.write_bytes(content)
    assert ran("predict", path, "--out", tmp_path / "out") in {1, 2}
    assert ran("urdf", "--scenario", path, "--out", tmp_path / "body.urdf") in {0, 2}
    assert not (tmp_path / "out").exists()


@some(35)
@given(odd_tables())
def test_a_scenario_of_odd_values(tmp_path, stopped, tables):  # noqa: ARG001
    path = tmp_path / "any.toml"
    path.write_text(file_of(tables), encoding="utf-8", errors="replace")
    assert ran("predict", path, "--out", tmp_path / "out") in {1, 2}
    assert ran("urdf", "--scenario", path, "--out", tmp_path / "body.urdf") in {0, 2}
    assert not (tmp_path / "out").exists()


# --- the gait of a result


@some(40)
@given(st.data())
def test_a_gait_of_spoilt_bytes_is_the_gait_that_was_written_or_is_refused(place, result, data):
    """Let the checks pass whatever they are given: what counts is what they are given."""
    content = (result / GAIT_FILE).read_bytes()
    members = [content.index(name) for name in (b"scenario.npy", b"breaks.npy", b"control_points")]
    directory = [content.index(b"PK\x01\x02"), content.rindex(b"PK\x05\x06")]
    (place / GAIT_FILE).write_bytes(data.draw(spoilt(content, [*members, *directory])))
    checked = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(prediction, "verify", lambda record: checked.append(record) or [])
        assert ran("verify", place) == (0 if checked else 2)
    original = load_record(result)
    for record in checked:
        assert_same(record.gait, guessed_gait())
        for name in ("mass", "footholds"):
            np.testing.assert_array_equal(getattr(record, name), getattr(original, name))
        for name in ("q", "tau", "grf", "points"):
            found, written = (getattr(one.samples, name) for one in (record, original))
            np.testing.assert_array_equal(found, written)


def assert_same(gait, other):
    assert gait.scenario == other.scenario
    np.testing.assert_array_equal(gait.breaks, other.breaks)
    np.testing.assert_array_equal(gait.control_points, other.control_points)


@some(20)
@given(st.data())
@example(None)
def test_a_gait_of_odd_arrays_is_no_walk(place, arrays, stopped, data):  # noqa: ARG001
    """The guess is none, and no change makes it one."""
    if data:
        read = [
            "format",
            "solution",
            "breaks",
            "control_points",
            "knots",
            "mass",
            "t",
            "tau",
            "cop",
        ]
        names = data.draw(st.lists(st.sampled_from(read), min_size=1, max_size=2, unique=True))
        rewritten(place, arrays, **{name: data.draw(odd_array(arrays[name])) for name in names})
    assert ran("verify", place) in {1, 2}
    assert ran("refine", place) in {1, 2}


@some(20)
@given(odd_tables())
def test_a_gait_of_an_odd_scenario_is_no_walk(place, arrays, tables):
    rewritten(place, arrays, scenario=np.array(json.dumps(tables)))
    assert ran("verify", place) in {1, 2}


@some(4)
@given(st.data())
def test_an_odd_gait_is_drawn_or_refused(place, arrays, data):
    names = ["breaks", "control_points"]
    rewritten(place, arrays, **{name: data.draw(odd_array(arrays[name])) for name in names[1:]})
    assert ran("plot", place) in {0, 2}


# --- what else is read


@some(10)
@given(st.data())
@example(None)
def test_a_start_with_spoilt_or_odd_multipliers(place, result, stopped, data):  # noqa: ARG001
    """They are used or refused; a scenario that fits them and one that does not."""
    content = (result / MULTIPLIERS).read_bytes()
    if data and data.draw(st.booleans()):
        content = data.draw(spoilt(content, [content.index(b"__names__"), content.index(b"__1__")]))
        (place / MULTIPLIERS).write_bytes(content)
    elif data:
        with np.load(result / MULTIPLIERS) as file:
            prices = dict(file)
        name = data.draw(st.sampled_from(sorted(prices)))
        prices[name] = data.draw(odd_array(prices[name]))
        kept = {name: price for name, price in prices.items() if price is not None}
        np.savez(place / MULTIPLIERS, allow_pickle=True, **kept)
    for task in ("normal", "paper-275"):
        path = ROOT / "scenarios" / f"{task}.toml"
        code = ran("predict", path, "--warm-from", place, "--out", place / "out")
        assert code in {1, 2} if data else code == 1


@some(20)
@given(st.sampled_from(["summary.json", "gait_cycle.csv"]), st.data())
def test_a_comparison_with_a_spoilt_file(place, result, name, data):
    figure = types.SimpleNamespace(png=lambda *_: b"")
    shutil.copytree(result, place, dirs_exist_ok=True)
    (place / name).write_bytes(data.draw(spoilt((result / name).read_bytes())))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(comparison, "compare_figure", lambda *_: figure)
        if ran("compare", place) == 0:
            json.loads((place / "compare.json").read_text())


@some(10)
@given(st.data())
def test_a_comparison_of_odd_numbers(place, result, data):
    figure = types.SimpleNamespace(png=lambda *_: b"")
    lines = (result / "gait_cycle.csv").read_text().splitlines()
    row, column = data.draw(st.integers(1, 101)), data.draw(st.integers(1, 12))
    cells = lines[row].split(",")
    cells[column] = str(data.draw(st.sampled_from(NUMBERS)))
    lines[row] = ",".join(cells)
    (place / "gait_cycle.csv").write_text("\n".join([*lines, ""]))
    summary = {"walking_speed_m_per_s": data.draw(ODD), "step_length_m": data.draw(ODD)}
    (place / "summary.json").write_text(json.dumps(summary))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(comparison, "compare_figure", lambda *_: figure)
        ran("compare", place)


@some(6)
@given(st.data())
def test_figures_with_a_spoilt_summary_or_gait(place, result, data):
    for name in paper_figures.MAKE_TARGETS:
        shutil.copytree(result, place / name, dirs_exist_ok=True)
    file = place / "preferred" / data.draw(st.sampled_from([GAIT_FILE, "summary.json"]))
    file.write_bytes(data.draw(spoilt(file.read_bytes())))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(paper_figures, "FIGURES", {})
        assert ran("figures", place) in {0, 2}


# --- chosen cases


def test_the_result_that_is_spoilt_here_is_read(place):
    assert_same(load_gait(place), guessed_gait())
    assert Scenario.from_dict(guessed_gait().scenario.to_dict()) == guessed_gait().scenario


class Trap:
    """An object that would leave a trace if it were unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return type(self.path).touch, (self.path,)


@pytest.mark.parametrize("name", ["format", "scenario", "solution", "breaks", "control_points"])
def test_pickled_objects_are_refused_unopened(place, arrays, tmp_path, name):
    rewritten(place, arrays, **{name: np.array(Trap(tmp_path / "sprung"), dtype=object)})
    assert {ran(command, place) for command in ("verify", "plot", "play", "refine")} == {2}
    with np.load(place / GAIT_FILE, allow_pickle=True) as file:
        file[name]
    assert (tmp_path / "sprung").exists()  # the trap would have worked


BOMB = bytes(2**20)


@pytest.mark.parametrize(
    ("packing", "part"),
    [(zipfile.ZIP_DEFLATED, "larger than"), (zipfile.ZIP_LZMA, "packed"), (zipfile.ZIP_BZIP2, "")],
)
def test_an_archive_that_would_fill_the_memory_is_refused_packed(place, capsys, packing, part):
    repeats = 300 if packing == zipfile.ZIP_DEFLATED else 1
    with (
        zipfile.ZipFile(place / GAIT_FILE, "a", packing) as archive,
        archive.open("t2", "w") as file,
    ):
        for _ in range(repeats):
            file.write(BOMB)
    tracemalloc.start()
    assert cli.run(["verify", str(place)]) == 2
    assert tracemalloc.get_traced_memory()[1] < 2**22
    tracemalloc.stop()
    assert part in capsys.readouterr().err


def test_an_array_that_claims_to_be_huge_is_refused(place, arrays):
    """The header of an array promises a terabyte that is not there."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        header, {"descr": "<f8", "fortran_order": False, "shape": (2**37,)}
    )
    rewritten(place, arrays, breaks=None)
    with zipfile.ZipFile(place / GAIT_FILE, "a") as archive:
        archive.writestr("breaks.npy", header.getvalue() + bytes(80))
    assert ran("verify", place) == 2


def test_a_file_too_large_for_a_gait_is_not_even_opened(place):
    with (place / GAIT_FILE).open("ab") as file:
        file.truncate(2**40)
    assert ran("verify", place) == 2


def test_too_little_memory_is_one_line(place, monkeypatch):
    def fail(_):
        raise MemoryError

    monkeypatch.setattr(prediction, "verify", fail)
    assert ran("verify", place) == 2


def process(*arguments, **options):
    program = "from human_gait.cli import main; main()"
    command = [sys.executable, *options.pop("python", []), "-c", program, *map(str, arguments)]
    return subprocess.Popen(command, text=True, stderr=subprocess.PIPE, **options)


@pytest.mark.parametrize("python", [[], ["-u"]])
def test_a_reader_that_leaves_is_no_error_and_the_result_is_written(place, python):
    reading, writing = os.pipe()
    os.close(reading)
    run = process("verify", place, stdout=writing, python=python)
    os.close(writing)
    assert (run.communicate(timeout=LONGEST)[1], run.returncode) == ("", 1)
    assert "passed" in (place / "verification.json").read_text()


def test_output_that_does_not_fit_on_the_disk_is_no_success():
    with Path("/dev/full").open("w") as full:
        run = process("--help", stdout=full)
    said = run.communicate(timeout=LONGEST)[1]
    assert (said.count("\n"), run.returncode) == (1, 2)
    assert "cannot be written: No space" in said


WAITING = """
import signal
import time
from itertools import islice
signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
from human_gait import cli, console, prediction
from human_gait.solving import starts as ladder
from human_gait.solving import drake_solvers, solver
ladder.own_starts = lambda *given, rungs=ladder.own_starts: islice(rungs(*given), 1)
def wait(*_, **__):
    print("here", flush=True)
    time.sleep(60)
{place}.{name} = wait
for options in (drake_solvers.OPTIONS, solver.POSTURE_OPTIONS):
    options["newton"]["most_iterations"] = 1
cli.main()
"""


@pytest.mark.parametrize(
    ("room", "name"), [("prediction", "build_program"), ("console", "show_task")]
)
def test_ctrl_c_before_the_solver_changes_nothing(place, room, name):
    """From there on there is something to keep: `test_stopping`."""
    before = {path.name: path.read_bytes() for path in place.iterdir()}
    program = WAITING.format(place=room, name=name)
    command = [sys.executable, "-c", program, "predict", ROOT / "scenarios" / "normal.toml"]
    run = subprocess.Popen(
        [*map(str, command), "--out", str(place)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    for line in run.stdout:
        if line == "here\n":
            break
    run.send_signal(signal.SIGINT)
    assert run.communicate(timeout=LONGEST)[1] == "error: interrupted\n"
    assert run.returncode == 130
    assert {path.name: path.read_bytes() for path in place.iterdir()} == before
    assert list(place.parent.iterdir()) == [place]
