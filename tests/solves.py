"""Whole solves that tests share: each scenario is predicted once per process."""

import atexit
import json
from functools import cache
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp

from human_gait.prediction import predict_to_folder
from human_gait.scenario import load_scenario
from human_gait.solving.drake_solvers import SOLVERS
from human_gait.walk.gait_cycle import load_gait_cycle
from human_gait.walk.gait_file import load_gait

SCENARIOS = Path(__file__).resolve().parent.parent / "scenarios"


class Result:
    """What a prediction has left in its folder."""

    def __init__(self, name, folder):
        self.folder = folder
        task = load_scenario(SCENARIOS / f"{name}.toml")
        self.success = predict_to_folder(task, SOLVERS[0], folder)
        self.summary = json.loads((folder / "summary.json").read_text())
        self.gait = load_gait(folder)
        self.cycle = load_gait_cycle(folder / "gait_cycle.csv")


@cache
def solved(name):
    """The result of a scenario that comes with the package."""
    folder = Path(mkdtemp(prefix=f"{name}-"))
    atexit.register(rmtree, folder, ignore_errors=True)
    return Result(name, folder)
