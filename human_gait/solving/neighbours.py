"""A walk once more from a walk beside it: another way into the same valley, or into a lower one.

Walks have local optima whose costs differ by some tenths of a per cent, and a path that comes from
a neighbour often ends lower than one from nothing.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

from human_gait.exceptions import ScenarioError
from human_gait.problem.program import GaitProgram
from human_gait.solving.solver import Solution, solve
from human_gait.solving.warm_start import adapted, fitting
from human_gait.solving.watch import Tell

WARM_ITERATIONS = 40
"""Of a warm start: near walks take half of it; from far ones a cold start is quicker."""

SPENT = ("iterations", "evaluations", "wall_time")


class Neighbour(NamedTuple):
    """A walk beside another one.

    Attributes
    ----------
    name : str
    setting : str
        Of the section ``walk``.
    factor : float
    """

    name: str
    setting: str
    factor: float

    def beside(self, program: GaitProgram) -> GaitProgram | None:
        """Return the problem of the neighbour of a walk; None if nobody can walk so."""
        walk = program.scenario.walk
        value = self.factor * getattr(walk, self.setting)
        with suppress(ScenarioError):
            changed = replace(walk, **{self.setting: value})
            return program.moved_to(replace(program.scenario, walk=changed))
        return None


NEIGHBOURS = (
    Neighbour("from a walk with a longer step", "step_length", 1.05),
    Neighbour("from a faster walk", "speed", 1.05),
    Neighbour("from a walk with a shorter step", "step_length", 0.95),
    Neighbour("from a slower walk", "speed", 0.95),
)


def there_and_back(
    program: GaitProgram,
    beside: GaitProgram,
    solver: str,
    found: Solution,
    tell: Tell | None = None,
) -> Solution:
    """Solve the neighbour of a walk from the walk that was found, and that again from there."""
    there = _next(beside, solver, found, tell)
    back = _next(program, solver, there, tell)
    total = {name: getattr(there, name) + getattr(back, name) for name in SPENT}
    return replace(back, **total)


def _next(program: GaitProgram, solver: str, before: Solution, tell: Tell | None) -> Solution:
    start, duals = adapted(before.gait, program), fitting(before.multipliers, program)
    most = WARM_ITERATIONS if before.multipliers else None
    duals = duals if before.multipliers else {}
    return solve(program, solver, start, tell, multipliers=duals, most_iterations=most)
