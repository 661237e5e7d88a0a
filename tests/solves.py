"""Whole solves that tests share: each scenario is predicted once per run of pytest.

One of them is drawn; the pictures of the others would take longer than the walks.
Processes that run tests beside each other (pytest-xdist) share a folder and wait for each other.
"""

import fcntl
import json
from functools import cache
from pathlib import Path

from sharing import FOLDER

from human_gait.prediction import predict_to_folder
from human_gait.scenario import load_scenario
from human_gait.solving.drake_solvers import SOLVERS
from human_gait.walk.gait_cycle import load_gait_cycle
from human_gait.walk.gait_file import load_gait

SCENARIOS = Path(__file__).resolve().parent.parent / "scenarios"
DRAWN = "preferred"


class Result:
    """What a prediction has left in its folder."""

    def __init__(self, folder):
        self.folder = folder
        self.summary = json.loads((folder / "summary.json").read_text())
        self.success = self.summary["success"]
        self.gait = load_gait(folder)
        self.cycle = load_gait_cycle(folder / "gait_cycle.csv")


@cache
def solved(name):
    """The result of a scenario that comes with the package."""
    folder = FOLDER / name
    folder.parent.mkdir(exist_ok=True)
    with (folder.parent / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.is_dir():
            task = load_scenario(SCENARIOS / f"{name}.toml")
            predict_to_folder(task, SOLVERS[0], folder, plots=name == DRAWN)
    return Result(folder)
