"""Signals and kills at random moments of runs that are cut short: the benchmark's trials."""

import pytest

from benchmarks.interruptions import COMMAND, KILL, NEW_SPEED, SIGNALS, Bench, told, trials

CUT = """
def cut():
    from itertools import islice
    from human_gait.solving import drake_solvers, starts
    from human_gait.pictures import plots
    from human_gait.playback import page
    from human_gait.walk.described import gait_digest
    rungs = starts.own_starts
    starts.own_starts = lambda *given: islice(rungs(*given), 1)
    drake_solvers.OPTIONS["newton"]["most_iterations"] = 5
    told = lambda gait: f"gait={gait_digest(gait)} {gait.scenario.walk.speed}"
    plots.save_plots = lambda gait, folder: (folder / "zmp.png").write_text(told(gait))
    page.save_playback = lambda gait, path: path.write_text(told(gait))
import sys
class Cut:
    # when the commands import what predicts
    def find_spec(self, name, path, target=None):
        if name == "human_gait.prediction":
            sys.meta_path.remove(self)
            cut()
sys.meta_path.insert(0, Cut())
"""


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    return Bench(tmp_path_factory.mktemp("bench"), CUT + COMMAND)


@pytest.mark.solve
@pytest.mark.parametrize("numbers", [[KILL] * 2, list(SIGNALS)], ids=str)
def test_a_run_that_is_interrupted_at_random_leaves_a_whole_result(bench, numbers):
    found = told(list(trials(bench, numbers, seed=3)))
    assert found["faults"] == []
    assert found["trials"] == len(numbers)


@pytest.mark.solve
def test_the_trials_notice_a_result_of_two_halves(bench):
    """What they look for is seen where it is."""
    trial = bench.trial(SIGNALS[0], 2.0 * bench.seconds + 5.0)
    assert (trial.left, trial.code, trial.faults) == ("new", 1, ())
    summary = bench.out / "summary.json"
    summary.write_text(summary.read_text().replace('"cost": ', '"cost": 1'))
    assert bench._left(1, SIGNALS[0])[1] == ["the files are not of one result"]
    assert bench._left(143, SIGNALS[0])[1] == [
        "exit code 143, but a new result",
        "the files are not of one result",
    ]
    assert str(NEW_SPEED) in (bench.out / "zmp.png").read_text()
