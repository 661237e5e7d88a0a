"""Following a solve through its evaluations: count, keep the best, tell, stop on request."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from human_gait.arrays import FloatArray
from human_gait.problem.program import GaitProgram
from human_gait.problem.violation import Violation
from human_gait.stopping import Run, running
from human_gait.values import Value

FEASIBLE = 1e-4
"""Largest violation, in the unit of its constraint, of an iterate that counts as feasible."""


@dataclass(frozen=True, eq=False, repr=False)
class Iterate(Value):
    """One evaluated point on the way.

    Attributes
    ----------
    stage : str
        ``posture`` or ``torque``.
    number : int
        How many points have been evaluated.
    elapsed : float, [s]
    cost : float, [N^2 m^2 s]
    worst : Violation
    free : (m * 55,) array
        Free control points.
    """

    stage: str
    number: int
    elapsed: float
    cost: float
    worst: Violation
    free: FloatArray

    @property
    def feasible(self) -> bool:
        """Whether every constraint is kept to within ``FEASIBLE``."""
        return self.worst.value <= FEASIBLE


Tell = Callable[[Iterate], None]
"""Is given every evaluated point."""


class Interrupted(Exception):
    """Leave the solver: it was asked to stop, or its time is over."""


class Watch:
    """Follow a program through its evaluations.

    Attributes
    ----------
    stage : str
        What is solved now, as in `Iterate`.
    count : int
    best : Iterate or None
    run : Run
        If it is over the next evaluation raises `Interrupted`; for want of time not before there is
        a point to keep.
    left : str
        Why the solver was left so; empty if it was not.
    """

    def __init__(
        self, program: GaitProgram, tell: Callable[[Iterate], None] | None, run: Run
    ) -> None:
        self.program, self.tell, self.run = program, tell, run
        self.left = ""
        self.started = time.perf_counter()
        self.stage = "posture"
        self.count = 0
        self.best: Iterate | None = None

    @property
    def elapsed(self) -> float:
        """Time since the beginning, [s]."""
        return time.perf_counter() - self.started

    def __call__(self, free: FloatArray) -> None:
        """Take note of a point that is evaluated."""
        if self.run.asked.signal or (self.best is not None and self.run.over):
            self.left = self.run.over
            raise Interrupted
        self.count += 1
        cost = self.program.total_cost(free)
        worst = max(self.program.violations(free), key=lambda violation: violation.value)
        now = Iterate(self.stage, self.count, self.elapsed, cost, worst, free.copy())
        if self.best is None or _rank(now) < _rank(self.best):
            self.best = now
        if self.tell:
            self.tell(now)


def _rank(iterate: Iterate) -> tuple[float, float]:
    """Return what is smaller for a better iterate: violation first, then cost."""
    return max(iterate.worst.value, FEASIBLE), iterate.cost


@contextmanager
def watched(
    program: GaitProgram,
    tell: Callable[[Iterate], None] | None = None,
    time_limit: float | None = None,
) -> Iterator[Watch]:
    """Yield the watch of a program; Ctrl-C stops it at its next evaluation, not the process.

    So does whatever else ends the run (`stopping`), and the time limit [s].
    """
    with running(time_limit) as run, run.asked.held():
        watch = Watch(program, tell, run)
        program.functions.watched_by(watch)
        try:
            yield watch
        finally:
            program.functions.observe = None
