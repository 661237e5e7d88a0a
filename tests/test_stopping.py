"""A run is asked to stop, by signals or by the clock, and keeps what it has, at any moment."""

import json
import os
import signal
import threading
import time
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from walks import scenario

import human_gait as hg
from human_gait import cli, prediction, stopping
from human_gait.checks.check import Check
from human_gait.exceptions import NoSolutionFound, SolveInterrupted
from human_gait.problem.program import build_program
from human_gait.results.folder import replaced_folder
from human_gait.solving import starts
from human_gait.solving.drake_solvers import OPTIONS
from human_gait.solving.solver import POSTURE_OPTIONS, solve
from human_gait.stopping import (
    JOB_SIGNALS,
    TIME_LIMIT,
    Run,
    checked_limit,
    running,
    under_way,
    uninterrupted,
)

TASK = scenario(control_points=6)
WALK = "[walk]\nspeed = 1.2\nstep_length = 0.66\n[discretisation]\ncontrol_points = 6\n"
LIMITS = {"newton": "most_iterations", "snopt": "Major iterations limit", "ipopt": "max_iter"}


def handlers():
    return [signal.getsignal(number) for number in JOB_SIGNALS]


@pytest.fixture(autouse=True)
def unchanged():
    """Handlers are put back, whatever happens."""
    before = handlers()
    yield
    assert handlers() == before
    assert stopping.outermost()


@pytest.fixture
def cut_short(monkeypatch):
    """Solvers stop after one iteration, the ladder after one start; little is checked or drawn."""
    rungs, check = starts.own_starts, Check("a claim", "m", 0.0, 2.0, 1.0)
    monkeypatch.setattr(starts, "own_starts", lambda *given: islice(rungs(*given), 1))
    for room in (starts, prediction):
        monkeypatch.setattr(room, "verify", lambda _: [check])
    for options in (OPTIONS, POSTURE_OPTIONS):
        for name, limit in LIMITS.items():
            monkeypatch.setitem(options, name, options[name] | {limit: 1})
    drawn = []
    monkeypatch.setattr("human_gait.pictures.plots.save_plots", lambda *_: drawn.append("plots"))
    monkeypatch.setattr("human_gait.playback.page.save_playback", lambda _, path: path.touch())
    return drawn


def sent(number):
    """Send a signal; its handler may run a little later where other threads run beside."""
    signal.raise_signal(number)
    for _ in range(500):
        time.sleep(0.01)


# --- what is heeded


@pytest.mark.parametrize("number", JOB_SIGNALS)
def test_every_signal_that_ends_a_job_interrupts_a_command_with_its_own_exit_code(
    number, monkeypatch, capsys
):
    monkeypatch.setattr("human_gait.settings.listing", lambda: sent(number))
    assert cli.run(["settings"]) == 128 + number
    assert capsys.readouterr().err == "error: interrupted\n"


def test_what_ends_jobs_is_heeded():
    """Terminals, docker stop, service managers, Slurm, SGE, LSF, PBS and limits of CPU time."""
    names = {number.name for number in JOB_SIGNALS}
    assert names >= {"SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGXCPU", "SIGUSR1", "SIGUSR2"}


def test_a_signal_that_is_ignored_stays_so_but_for_ctrl_c():
    """Nohup ignores SIGHUP; shells ignore SIGINT for all that runs in the background."""
    before = {n: signal.signal(n, signal.SIG_IGN) for n in (signal.SIGHUP, signal.SIGINT)}
    try:
        with running(signals=JOB_SIGNALS) as run, run.asked.held():
            signal.raise_signal(signal.SIGHUP)
            assert not run.over
            signal.raise_signal(signal.SIGINT)
            assert run.over == "interrupted"
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def test_a_second_signal_leaves_the_first_its_cleaning_up_but_not_for_ever(monkeypatch):
    monkeypatch.setattr(stopping, "_AGAIN", 0.05)
    with running() as run:
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        time.sleep(0.06)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        assert run.asked.times == 3


def test_outside_the_main_thread_the_clock_alone_counts():
    found = []

    def work():
        with running(1e-9) as run:
            found.append((run.over, under_way() is run))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [("time limit of 1e-09 s reached", True)]


def test_a_part_of_a_run_ends_with_the_whole():
    with running(0.01), running(100.0) as part:
        time.sleep(0.02)
        assert part.over == "time limit of 0.01 s reached"
        assert part.left == 0.0
    assert Run().over == ""
    assert Run().left == np.inf


def test_a_folder_takes_the_place_of_another_uninterrupted(tmp_path):
    """Ctrl-C in between is raised when that is done."""
    with pytest.raises(KeyboardInterrupt), uninterrupted():
        signal.raise_signal(signal.SIGINT)
    seen = []

    def put(*_):
        signal.raise_signal(signal.SIGINT)
        seen.append("put")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("human_gait.results.folder.put", put)
        with pytest.raises(KeyboardInterrupt), replaced_folder(tmp_path / "walk"):
            pass
    assert seen == ["put"]


# --- predictions


OLD = "gait=0123456789abcdef"  # a file says so that it is one of ours
STAGES = {  # where a signal comes, and whether there is something to keep by then
    "a start is made": ("human_gait.solving.starts.solve", True),
    "an attempt is checked": ("human_gait.solving.starts.verify", True),
    "the file is read back": ("human_gait.solving.summary.load_record", True),
    "the gait is written": ("human_gait.solving.summary.save_gait", True),
    "the summary is made": ("human_gait.prediction.summary_content", True),
    "the cycle is written": ("human_gait.prediction.save_gait_cycle", True),
    "the folder is replaced": ("human_gait.results.folder.put", True),
    "the outcome is told": ("human_gait.console.show_outcome", True),
    "the plots are drawn": ("human_gait.pictures.plots.save_plots", True),
    "the page is made": ("human_gait.playback.page.save_playback", True),
    "the program is built": ("human_gait.prediction.build_program", False),
    "the task is told": ("human_gait.console.show_task", False),
}


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.usefixtures("cut_short")
def test_a_signal_at_any_moment_leaves_the_old_result_or_a_new_one(
    stage, tmp_path, monkeypatch, capsys
):
    """After the stage, where what it made has not been noted yet."""
    place, kept = STAGES[stage]
    module, _, name = place.rpartition(".")
    inner = getattr(__import__(module, fromlist=[name]), name)

    def pressed(*given, **named):
        made = inner(*given, **named)
        signal.raise_signal(signal.SIGTERM)
        return made

    (tmp_path / "walk.toml").write_text(WALK)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "gait.npz").write_text(OLD)
    monkeypatch.setattr(place, pressed)
    code = cli.run(["predict", str(tmp_path / "walk.toml"), "--out", str(tmp_path / "out")])
    said = capsys.readouterr().err
    assert "Traceback" not in said
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "walk.toml"]
    if kept:
        assert code == 1
        summary = json.loads((tmp_path / "out" / "summary.json").read_text())
        assert summary["cost"] == hg.load(tmp_path / "out").solution["cost"]
    else:
        assert code == 128 + signal.SIGTERM
        assert (tmp_path / "out" / "gait.npz").read_text() == OLD
    drawn = stage in ("a start is made", "an attempt is checked")
    assert said.count("human-gait plot") == (kept and not drawn)


@pytest.mark.usefixtures("cut_short")
@pytest.mark.filterwarnings("ignore:Exception ignored in:pytest.PytestUnraisableExceptionWarning")
def test_sigterm_at_twenty_random_moments_leaves_a_whole_result(tmp_path, capsys):
    """By a clock that knows nothing of the run; `test_interruptions` does it from outside."""
    (tmp_path / "walk.toml").write_text(WALK)
    command = ["predict", str(tmp_path / "walk.toml"), "--out", str(tmp_path / "out")]
    began = time.monotonic()
    assert cli.run(command) == 1
    whole, random = time.monotonic() - began, np.random.default_rng(0)
    before = signal.signal(signal.SIGTERM, lambda *_: None)  # if the run is quicker this time
    for moment in random.uniform(0.0, whole, 20):
        (tmp_path / "out" / "summary.json").write_text(OLD)
        clock = threading.Timer(moment, os.kill, (os.getpid(), signal.SIGTERM))
        clock.start()
        code = cli.run(command)
        clock.join()
        summary = (tmp_path / "out" / "summary.json").read_text()
        assert code == (128 + signal.SIGTERM if summary == OLD else 1)
        assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "walk.toml"]
        if summary != OLD:
            cost = json.loads(summary)["cost"]
            assert hg.load(tmp_path / "out").solution["cost"] == cost
    signal.signal(signal.SIGTERM, before)
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.usefixtures("cut_short")
def test_an_interruption_between_a_solve_and_its_being_noted_keeps_the_solve(monkeypatch):
    inner = starts.verify

    def pressed(record):
        signal.raise_signal(signal.SIGINT)
        return inner(record)

    monkeypatch.setattr(starts, "verify", pressed)
    attempts = starts.climb(build_program(TASK))
    assert len(attempts) == 1


def test_from_python_an_interruption_is_both_kinds_of_exception(cut_short):  # noqa: ARG001
    def press(_):
        signal.raise_signal(signal.SIGINT)

    for kind in (KeyboardInterrupt, NoSolutionFound, SolveInterrupted):
        with pytest.raises(kind) as caught:
            hg.predict(TASK, progress=press)
    assert caught.value.gait.scenario == TASK
    assert "interrupted" in str(caught.value)
    assert caught.value.report


def test_other_signals_are_left_to_the_program_that_calls(cut_short):  # noqa: ARG001
    """A server that is told to end must not take it for a walk that was not found."""
    came = []
    before = signal.signal(signal.SIGTERM, lambda number, _: came.append(number))
    try:
        with pytest.raises(NoSolutionFound) as caught:
            hg.predict(TASK, progress=lambda _: came or signal.raise_signal(signal.SIGTERM))
    finally:
        signal.signal(signal.SIGTERM, before)
    assert came == [signal.SIGTERM]
    assert not isinstance(caught.value, KeyboardInterrupt)


# --- time


@pytest.mark.parametrize("solver", LIMITS)
def test_a_solve_ends_with_its_best_point_when_its_time_is_over(solver):
    program = build_program(TASK)
    told = []
    solution = solve(program, solver, tell=told.append, time_limit=1e-6)
    assert solution.status == "time limit of 1e-06 s reached"
    assert not solution.converged
    assert not solution.interrupted
    assert np.all(np.isfinite(solution.gait.control_points))
    assert len(told) == 1  # the first point is kept, the second not looked at


def test_a_prediction_out_of_time_is_no_walk_with_its_diagnosis(cut_short, tmp_path, capsys):
    (tmp_path / "walk.toml").write_text(WALK)
    out = tmp_path / "out"
    command = ["predict", str(tmp_path / "walk.toml"), "--out", str(out), "--time-limit", "0.001"]
    assert cli.run(command) == 1
    summary = json.loads((out / "summary.json").read_text())
    assert summary["time_limit_s"] == 0.001
    assert summary["ended_by"] == "time limit of 0.001 s reached"
    assert len(summary["attempts"]) == 1
    assert [one["key"] for one in summary["diagnosis"]["try"]]
    assert "time limit of 0.001 s reached" in capsys.readouterr().out
    assert cut_short == ["plots"]


def test_the_ladder_ends_between_its_starts(cut_short, monkeypatch):  # noqa: ARG001
    monkeypatch.setattr(
        starts, "solve", lambda *given, **named: time.sleep(0.05) or solve(*given, **named)
    )
    with running(0.04):
        assert len(starts.climb(build_program(TASK))) == 1


def test_from_python_the_time_is_limited_too(cut_short):  # noqa: ARG001
    with pytest.raises(NoSolutionFound, match=r"time limit of 0.001 s"):
        hg.predict(TASK, time_limit=0.001)


@pytest.mark.parametrize("limit", [0, -1.0, np.nan, np.inf, 1e9])
def test_a_time_limit_is_positive_and_at_most_a_week(limit, capsys):
    with pytest.raises(ValueError, match="at most 604800 s"):
        hg.predict(TASK, time_limit=limit)
    with pytest.raises(ValueError, match="at most 604800 s"):
        hg.solve(build_program(TASK), time_limit=limit)
    assert cli.run(["predict", "normal", "--time-limit", str(limit)]) == 2
    assert "must be above 0 and at most 604800 s" in capsys.readouterr().err


@pytest.mark.parametrize("limit", ["3", True, [3]])
def test_a_time_limit_is_a_number(limit, capsys):
    with pytest.raises(TypeError, match="number of seconds"):
        hg.predict(TASK, time_limit=limit)
    assert cli.run(["predict", "normal", "--time-limit", "soon"]) == 2
    assert "'soon' is not a number of seconds" in capsys.readouterr().err


def test_numbers_of_numpy_are_time_limits_and_none_is_too_large_to_be_refused():
    assert checked_limit(np.int64(3)) == 3.0
    with pytest.raises(ValueError, match="at most 604800 s"):
        checked_limit(10**400)


@pytest.mark.parametrize("seed", [-1, 2**32, 10**30, 1.5, "1", None, True])
def test_a_seed_is_looked_at_before_anything_is_solved(seed, monkeypatch):
    monkeypatch.setattr("human_gait.walks.climb", lambda *_: pytest.fail("solves"))
    kind = ValueError if type(seed) is int else TypeError
    with pytest.raises(kind, match=r"seed|must be from 0 to 4294967295"):
        hg.predict(TASK, seed=seed)


def test_the_default_limit_is_told_by_help(capsys):
    cli.run(["predict", "--help"])
    assert f"[default: {TIME_LIMIT}]" in capsys.readouterr().out


# --- what follows a solve


FOLLOWERS = {
    "plots": "human_gait.pictures.plots.save_plots",
    "playback.html": "human_gait.playback.page.save_playback",
    "gait_cycle.csv": "human_gait.prediction.save_gait_cycle",
    "explanation.json": "human_gait.prediction.explanation_content",
}


@pytest.mark.parametrize(
    "error",
    [
        RuntimeError("no latex"),
        OSError(28, "No space left on device"),
        RecursionError(),
        MemoryError(),
    ],
    ids=repr,
)
@pytest.mark.usefixtures("cut_short")
def test_what_fails_after_a_solve_is_a_warning_that_tells_how_to_make_it_later(
    error, tmp_path, monkeypatch, capsys
):
    for place in FOLLOWERS.values():

        def fail(*given, **_):
            for path in given:
                if isinstance(path, Path) and not path.is_dir():
                    path.write_text("half")
            raise error

        monkeypatch.setattr(place, fail)
    assert prediction.predict_to_folder(TASK, "newton", tmp_path / "walk") is False
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == len(FOLLOWERS)
    for name in FOLLOWERS:
        assert any(line.startswith("warning: no ") and name in line for line in lines)
    assert sum(f"human-gait plot {tmp_path / 'walk'}" in line for line in lines) == 2
    written = {path.name for path in (tmp_path / "walk").iterdir()}
    assert written == {"gait.npz", "summary.json"}


@pytest.mark.usefixtures("cut_short")
def test_a_walk_is_there_whether_it_can_be_drawn_or_not(tmp_path, monkeypatch, capsys):
    """What draws is loaded once all is written and told, if anything is to be drawn."""
    (tmp_path / "walk.toml").write_text(WALK)
    out, told = tmp_path / "out", []

    def fail(module, _):
        told.append((out / "summary.json").is_file())
        raise ImportError(
            f"libX.so: cannot open shared object file, for {module}", name="matplotlib"
        )

    monkeypatch.setattr(prediction, "late", fail)
    command = ["predict", str(tmp_path / "walk.toml"), "--out", str(out)]
    written = {"gait.npz", "summary.json", "explanation.json", "gait_cycle.csv"}
    for words, warnings in (([], 2), (["--no-plots"], 0)):
        assert cli.run([*command, *words]) == 1
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) == warnings
        assert all("libX.so" in line for line in lines)
        assert {path.name for path in out.iterdir()} == written
    assert told == [True, True]
