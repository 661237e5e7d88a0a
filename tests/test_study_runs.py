"""Studies that are run: by one process and by many, on a scheduler, killed and gone on with."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from walks import scenario

import human_gait as hg
from human_gait.studies.plan import plan_of
from human_gait.studies.store import Store
from human_gait.studies.study_file import StudyFile

pytestmark = pytest.mark.solve

SPEEDS = [1.1, 1.15, 1.2, 1.25]
ASKED = {
    "name": "small",
    "scenario": scenario(control_points=8, intervals=40).to_dict(),
    "vary": {"speed": SPEEDS, "step_length": [0.66, 1.9]},
}
_LONGEST = 120.0  # [s] that anything may take on a busy machine


def same(one, other):
    """Whether two studies have the same rows, curves and walks, to the last digit."""
    a, b = (study.to_dataframe().drop(columns="seconds") for study in (one, other))
    if not a.equals(b):
        return False
    curves = zip(one.cycles().values(), other.cycles().values(), strict=True)
    if not all(np.array_equal(x, y, equal_nan=True) for x, y in curves):
        return False
    walks = ((one.gait(key), other.gait(key)) for key in a.index[a.success])
    return all(np.array_equal(x.control_points, y.control_points) for x, y in walks)


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """The study, found by one process without Dask."""
    told = []
    folder = tmp_path_factory.mktemp("alone")
    return hg.study(ASKED, folder, workers=0, tell=told.append), told


def test_every_walk_is_told_of_once_and_is_in_the_index(alone):
    study, told = alone
    frame = study.to_dataframe()
    assert len(frame) == len(told) == 8
    assert list(frame.success) == [True, False] * 4
    assert {one.key for one in told} == set(frame.index)
    assert frame.diagnosis[~frame.success].str.contains("reach of legs").all()
    assert list(frame.walk_speed[frame.success]) == SPEEDS
    assert list(frame.walk_step_length[~frame.success]) == [1.9] * 4


def test_walks_of_a_study_are_walks(alone):
    study, _ = alone
    for key in study.to_dataframe().query("success").index[:2]:
        assert all(check.passed for check in hg.verify(study.gait(key)))


def test_neighbours_start_warm_and_take_fewer_iterations(alone):
    frame = alone[0].to_dataframe().query("success")
    cold, warm = (frame[(frame.start == "cold") == which] for which in (True, False))
    assert set(warm.start) <= set(cold.index)
    assert warm.iterations.max() < cold.iterations.min()


def test_what_is_there_is_not_done_again(alone):
    study, _ = alone
    told = []
    again = hg.study(ASKED, study.folder, workers=0, tell=told.append)
    assert not told
    assert same(study, again)


def command(*words, **more):
    return subprocess.Popen(
        [sys.executable, "-m", *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        start_new_session=True,
        **more,
    )


def waited(condition, what):
    until = time.monotonic() + _LONGEST
    while not (found := condition()):
        assert time.monotonic() < until, f"waited too long for {what}"
        time.sleep(0.05)
    return found


@pytest.fixture
def processes():
    """Processes that are killed at the end, whatever else happens."""
    started = []
    yield started
    for one in started:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(one.pid, signal.SIGKILL)
        one.wait()


def _scheduler(processes, folder):
    """Return the address of a scheduler that was started by hand."""
    file = folder / "scheduler.json"
    words = ("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0")
    processes.append(command(*words, "--no-dashboard", "--scheduler-file", str(file)))
    waited(file.is_file, "the scheduler")
    import json

    return waited(lambda: file.read_text() and json.loads(file.read_text())["address"], "it")


def _worker(processes, address, folder):
    words = ("distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny")
    processes.append(command(*words, "--no-dashboard", "--local-directory", str(folder)))
    return processes[-1]


def test_a_worker_and_the_study_are_killed_and_every_walk_is_there_once(alone, processes, tmp_path):
    (tmp_path / "small.toml").write_text(StudyFile.from_table(ASKED).to_toml())
    out = tmp_path / "out"
    address = _scheduler(processes, tmp_path)
    first, _ = (_worker(processes, address, tmp_path) for _ in range(2))
    run = ("human_gait", "study", str(tmp_path / "small.toml"), "--out", str(out))
    processes.append(command(*run, "--scheduler", address))
    store = Store(out)
    waited(lambda: len(store.keys()) >= 3, "walks")
    os.kill(first.pid, signal.SIGKILL)
    waited(lambda: len(store.keys()) >= 5, "more walks")
    os.killpg(processes[-1].pid, signal.SIGKILL)
    assert not (out / "index.parquet").exists()
    processes.append(command(*run, "--scheduler", address, "--resume"))
    assert processes[-1].wait(_LONGEST) == 0
    assert store.keys() == {job.key for job in plan_of(StudyFile.from_table(ASKED)).jobs}
    assert same(alone[0], hg.open_study(out))


def test_the_parts_of_an_array_make_the_whole(alone, tmp_path):
    (tmp_path / "small.toml").write_text(StudyFile.from_table(ASKED).to_toml())
    out = tmp_path / "out"
    for part in ("1/2", "2/2"):
        words = ("human_gait", "study", str(tmp_path / "small.toml"), "--out", str(out))
        assert command(*words, "--array", part).wait(_LONGEST) == 0
    assert same(alone[0], hg.open_study(out))
    assert Path(out / "report.html").is_file()
