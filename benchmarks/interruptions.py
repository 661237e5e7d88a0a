"""What signals and kills at random moments leave of a prediction.

    python benchmarks/interruptions.py [--kills N] [--signals N] [--seed N] [--out DIR]

Predicts a walk again and again into a folder that holds the result of another one. Each run gets
SIGKILL, or SIGTERM, SIGINT and SIGHUP in turn, at a random moment of its life, from the first line
of the package to its end. Afterwards the folder has to hold the old result or the new one, whole,
as the exit code says, and nothing may have been told but lines: no traceback. Prints what was found
and writes DIR/interruptions.json. An hour for 300 of each.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import cycle, islice
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track

from human_gait.exceptions import GaitError
from human_gait.results.names import SUMMARY
from human_gait.results.unfinished import MARK
from human_gait.walk.gait_file import load_gait

KILL = int(signal.SIGKILL)
SIGNALS = (int(signal.SIGTERM), int(signal.SIGINT), int(signal.SIGHUP))
OLD_SPEED, NEW_SPEED = 1.15, 1.2
_BEGUN = "begun"
_TASK = """name = "walk"
[walk]
speed = {speed}
step_length = 0.66
"""
COMMAND = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    f"from human_gait.command import main; print('{_BEGUN}', flush=True); main()"
)
"""A run as of the command line: what stands before it is Python's own start."""
_LONGEST = 120.0  # [s] that a run may take after its signal


@dataclass(frozen=True)
class Trial:
    """One run that was interrupted.

    Attributes
    ----------
    signal : int
    moment : float
        After its beginning, [s].
    code : int
        Exit code, negative if the signal killed it.
    left : str
        ``old`` or ``new``: whose result is in the folder.
    lasted : float
        From the signal to its end, [s].
    faults : tuple of str
        What should not have happened.
    """

    signal: int
    moment: float
    code: int
    left: str
    lasted: float
    faults: tuple[str, ...]


class Bench:
    """A folder with the result of an old scenario, and a new one to predict into it.

    Parameters
    ----------
    place : Path
        An empty folder.
    program : str
        Python source of a run.

    Attributes
    ----------
    out : Path
    seconds : float
        That a run takes where nothing interrupts it.
    """

    def __init__(self, place: Path, program: str = COMMAND) -> None:
        self.out, self._task, self._program = place / "walk", place / "walk.toml", program
        self._task.write_text(_TASK.format(speed=OLD_SPEED), encoding="utf-8")
        run, began = self._begun(), time.monotonic()
        said = run.communicate()[1]
        self.seconds = time.monotonic() - began
        if run.returncode not in (0, 1):
            raise RuntimeError(said)
        self._old = contents(self.out)
        self._task.write_text(_TASK.format(speed=NEW_SPEED), encoding="utf-8")

    def trial(self, number: int, moment: float) -> Trial:
        """Send a signal to a run so long after its beginning, and look at what it leaves."""
        shutil.rmtree(self.out)
        self.out.mkdir()
        for name, content in self._old.items():
            (self.out / name).write_bytes(content)
        run = self._begun()
        time.sleep(moment)
        run.send_signal(number)
        sent = time.monotonic()
        said = "".join(run.communicate(timeout=_LONGEST))
        lasted = time.monotonic() - sent
        left, faults = self._left(run.returncode, number)
        if "Traceback" in said or "Exception ignored" in said:
            faults.append(said)
        if number != KILL and (
            odd := [p.name for p in self.out.parent.iterdir() if MARK in p.name]
        ):
            faults.append(f"{odd} are left")
        return Trial(number, moment, run.returncode, left, lasted, tuple(faults))

    def _left(self, code: int, number: int) -> tuple[str, list[str]]:
        """Return whose result is in the folder, and what is wrong with it."""
        now = contents(self.out)
        if now == self._old:
            expected = (-KILL, 128 + number)
            return "old", [] if code in expected else [f"exit code {code}, nothing new"]
        faults = [] if code in (0, 1, -KILL) else [f"exit code {code}, but a new result"]
        try:
            gait = load_gait(self.out)
            summary = json.loads(now[SUMMARY])
        except (GaitError, KeyError, ValueError) as error:
            return "neither", [*faults, str(error)]
        if gait.scenario.walk.speed != NEW_SPEED or gait.solution["cost"] != summary["cost"]:
            faults.append("the files are not of one result")
        if code in (0, 1) and summary["success"] is not (code == 0):
            faults.append(f"exit code {code}, success {summary['success']}")
        faults += [f"an old {name}" for name, old in self._old.items() if now.get(name) == old]
        return "new", faults

    def _begun(self) -> subprocess.Popen[str]:
        """Return a run whose first line has been executed."""
        command = [sys.executable, "-c", self._program, "predict", str(self._task)]
        run = subprocess.Popen(
            [*command, "--out", str(self.out)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )
        if run.stdout is None or run.stdout.readline() != f"{_BEGUN}\n":
            raise RuntimeError(run.communicate()[1])
        return run


def contents(folder: Path) -> dict[str, bytes]:
    """Return all files of a folder by name."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def trials(bench: Bench, numbers: Iterable[int], seed: int = 0) -> Iterator[Trial]:
    """Yield a trial for each signal, at moments of the whole of a run."""
    random = np.random.default_rng(seed)
    for number in numbers:
        yield bench.trial(number, random.uniform(0.0, bench.seconds))


def told(found: Sequence[Trial]) -> dict[str, Any]:
    """Return the numbers of some trials."""
    after = [trial.lasted for trial in found if trial.signal != KILL]
    return {
        "trials": len(found),
        "ends": Counter(f"exit {trial.code}, {trial.left} result" for trial in found),
        "longest_s_to_the_end": max(after, default=0.0),
        "faults": [asdict(trial) for trial in found if trial.faults],
    }


def main() -> None:
    """Interrupt and print the result."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--kills", type=int, default=300, metavar="N")
    parser.add_argument("--signals", type=int, default=300, metavar="N")
    parser.add_argument("--seed", type=int, default=0, metavar="N")
    parser.add_argument("--out", type=Path, default=Path("out/interruptions"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    report: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as place:
        bench = Bench(Path(place))
        for name, numbers in (
            ("kills", [KILL] * options.kills),
            ("signals", list(islice(cycle(SIGNALS), options.signals))),
        ):
            report[name] = told(
                list(track(trials(bench, numbers, options.seed), name, len(numbers)))
            )
    text = json.dumps(report, indent=2)
    Console().print(text, markup=False, soft_wrap=True)
    (options.out / "interruptions.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
