"""One walk of a study: found, verified and put into the store, on whatever machine.

What comes out depends on the scenario and on the walk that it starts from, on nothing else: not on
what this process did before, nor on how many there are.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from threadpoolctl import threadpool_limits

from human_gait.exceptions import GaitError, ResultError
from human_gait.problem.program import GaitProgram, build_program
from human_gait.scenario import Scenario
from human_gait.solving.diagnosis import not_kept
from human_gait.solving.starts import Attempt, Start, best, climb, from_walk
from human_gait.solving.summary import diagnosis_content, found_gait
from human_gait.stopping import running
from human_gait.studies.numbers import curves_of, nearest_to_strength, numbers_of, settings_of
from human_gait.studies.plan import Job, package_version
from human_gait.studies.store import Kept, Store
from human_gait.walk.gait import Gait
from human_gait.walks import held_like

COLD = "cold"
AGAIN = "again"
"""In the row of a walk that no fault of its own kept from being found: it is done again."""
OUT_OF_TIME = "out_of_time"
"""In the row of a walk that was given up for want of time."""

_SOLVER, _DYNAMICS, _SEED = "newton", "pinocchio", 0


@dataclass(frozen=True)
class Terms:
    """What holds for all walks of a study.

    Attributes
    ----------
    folder : str
        Of the store, as all machines see it.
    version : str
        Of the package: another one would make other walks.
    tries : int
    time_limit : float, [s]
    """

    folder: str
    version: str
    tries: int
    time_limit: float


class Told(NamedTuple):
    """What is told of a walk that is done."""

    key: str
    success: bool
    reason: str
    seconds: float


def find(job: Job, terms: Terms) -> Told:
    """Find one walk, write it to the store, and tell how it went.

    Whatever is wrong with the walk is in its row; only what would spoil every walk is raised.

    Raises
    ------
    ResultError
        If this process has another version of the package, or the store cannot be written.
    """
    if (own := package_version()) != terms.version:
        raise ResultError(f"a worker has human-gait {own}, the study {terms.version}: install it")
    store = Store(Path(terms.folder))
    begin = time.perf_counter()
    with threadpool_limits(1, "blas"):
        kept = _kept(job, store, terms)
    seconds = time.perf_counter() - begin
    limits = {"tries": terms.tries, "time_limit": terms.time_limit}
    row = {"key": job.key, **kept.row, **limits, "seconds": seconds}
    store.save(job.key, Kept(row, kept.curves, kept.gait))
    return Told(job.key, row["success"], row["reason"], seconds)


def lost(job: Job, terms: Terms, why: str) -> Told:
    """Put a walk into the store that no worker lived to find."""
    row = {"key": job.key, **_failed(job, why), AGAIN: True, "seconds": 0.0}
    Store(Path(terms.folder)).save(job.key, Kept(row))
    return Told(job.key, False, why, 0.0)


def _kept(job: Job, store: Store, terms: Terms) -> Kept:
    if job.scenario is None:
        return Kept({**_failed(job, job.refused), "reason": _rule(job.refused)})
    try:
        with running(terms.time_limit) as run:
            try:
                kept = _solved(job, job.scenario, store, terms.tries)
            except KeyboardInterrupt:  # of a solve that had nothing to keep when it was over
                kept = Kept(_failed(job, run.over))
            if run.asked.signal:
                raise KeyboardInterrupt
            late = bool(run.over) and not kept.row["success"]
            return Kept({**kept.row, OUT_OF_TIME: late}, kept.curves, kept.gait)
    except GaitError as error:
        return Kept(_failed(job, " ".join(str(error).split())))
    except (ArithmeticError, LookupError, TypeError, ValueError, RuntimeError) as error:
        # One walk must not end a study of thousands: what nobody foresaw is in its row.
        return Kept(_failed(job, f"not foreseen: {type(error).__name__}: {error}"))


def _solved(job: Job, scenario: Scenario, store: Store, tries: int) -> Kept:
    program = build_program(scenario, None, _DYNAMICS)
    start, program = _start(job, store, program)
    attempts = climb(program, _SOLVER, start, _SEED, tries=tries)
    kept = best(attempts)
    gait = found_gait(kept, _SEED, attempts)
    row = {
        "success": kept.success,
        **_verdict(kept),
        "start": job.start if start is not None else COLD,
        "attempts": len(attempts),
        "iterations": kept.solution.iterations,
        **settings_of(scenario),
        **(_of_a_walk(gait, kept) if kept.success else {}),
    }
    told = {name: value for name, value in gait.solution.items() if name != "wall_time_s"}
    plain = gait.retold(told, gait.multipliers if kept.success else {})
    return Kept(_json(row), curves_of(gait) if kept.success else None, plain)


def _of_a_walk(gait: Gait, kept: Attempt) -> dict[str, Any]:
    return {"strength_joint": nearest_to_strength(gait), **numbers_of(gait, kept.checks)}


def _start(job: Job, store: Store, program: GaitProgram) -> tuple[Start | None, GaitProgram]:
    """Return the walk to start from, if it was found, and the program with what held it."""
    if not job.start or not store.row(job.start).get("success"):
        return None, program
    before = store.gait(job.start)
    program = held_like(before, program)
    return from_walk(before, program), program


def _verdict(kept: Attempt) -> dict[str, str]:
    """Return why there is no walk, briefly and in sentences; nothing where there is one."""
    if kept.success:
        return {"reason": "", "diagnosis": ""}
    content = diagnosis_content(kept)
    tries = [f"try {one['key']}: {one['change']}" for one in content["try"]]
    return {
        "reason": _reason(kept),
        "diagnosis": "; ".join([*content["not_kept"], *tries]) or kept.solution.status,
    }


def _reason(kept: Attempt) -> str:
    """Return the first check that failed, else the worst constraint, else the solver's word."""
    failed = [check.name for check in kept.checks if not check.passed]
    broken = not_kept(kept.program.scenario, kept.solution.violations)
    names = [*(worst.name for worst in broken[:1]), *failed[:1]]
    return names[0] if names else kept.solution.status


def _failed(job: Job, why: str) -> dict[str, Any]:
    """Return the row of a walk of which nothing else is known."""
    settings = settings_of(job.scenario) if job.scenario else {}
    return _json({"success": False, "reason": why, "diagnosis": why, "start": COLD, **settings})


def _rule(refused: str) -> str:
    """Return what a scenario is refused for, without the numbers, which differ for each."""
    keys = (line.partition(" = ")[0].partition(":")[0] for line in refused.split("; "))
    return f"not allowed: {', '.join(dict.fromkeys(keys))}"


def _json(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row of what JSON has: no NaN."""
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in row.items()
    }
