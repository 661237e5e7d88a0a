"""A predictor that remembers: each walk starts from the nearest of those that it has found."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from human_gait.dynamics.inverse_dynamics import ENGINES
from human_gait.exceptions import ResultError
from human_gait.problem.own import PathConstraint, RunningCost
from human_gait.problem.program import GaitProgram, build_program
from human_gait.scenario import Scenario, scenario_of
from human_gait.scenario.nearness import NEAR, Place
from human_gait.solving.estimate import estimated
from human_gait.solving.seeds import checked_seed
from human_gait.solving.starts import from_walk
from human_gait.stopping import TIME_LIMIT, checked_limit, running
from human_gait.walk.described import no_walk
from human_gait.walk.gait import Gait
from human_gait.walks import Progress, held_like, load, walk_of

KEPT = 100
"""Walks that are kept, of 40 kB each."""


class _Kept(NamedTuple):
    place: Place
    gait: Gait


class Predictor:
    """Predicts one walk after another, each warm from the nearest one found before.

    A study of many people or a page with a slider asks for walks that are like each other. The body
    and the walks that were found are kept, and a small change then takes a fraction of the time;
    where nothing is near, a walk is predicted as by `predict`. Every one is verified. An object
    belongs to one thread.

    >>> predictor = hg.Predictor()
    >>> walks = [predictor.predict(scenario.replace(speed=v)) for v in (1.0, 1.05, 1.1)]

    Parameters
    ----------
    dynamics : str
        As `predict`.
    costs : sequence of RunningCost
        Of one's own, of every walk.
    constraints : sequence of PathConstraint
        The same.
    keep : int
        How many walks are kept, at least one; the oldest ones go.

    Raises
    ------
    ValueError
        If there is no such dynamics, or nothing is to be kept.
    """

    def __init__(
        self,
        dynamics: str = "pinocchio",
        *,
        costs: Sequence[RunningCost] = (),
        constraints: Sequence[PathConstraint] = (),
        keep: int = KEPT,
    ) -> None:
        if dynamics not in ENGINES:
            raise ValueError(f"dynamics is {dynamics!r}, must be one of {', '.join(ENGINES)}")
        if keep < 1:
            raise ValueError(f"keep is {keep}, must be at least 1")
        self._own = dynamics, costs, constraints
        self._kept: deque[_Kept] = deque(maxlen=keep)
        self._program: GaitProgram | None = None

    def __repr__(self) -> str:
        return f"Predictor({len(self._kept)} walks)"

    @property
    def walks(self) -> list[Gait]:
        """The walks that others can start from, the oldest one first."""
        return [kept.gait for kept in self._kept]

    def predict(
        self,
        scenario: Scenario | str | Path,
        seed: int = 0,
        *,
        progress: Progress = False,
        time_limit: float | None = TIME_LIMIT,
    ) -> Gait:
        """Return the predicted gait of a scenario, verified, and keep it for those to come.

        Parameters and errors are those of `predict`; the solver is ``newton``.
        """
        seed, task = checked_seed(seed), scenario_of(scenario)
        with running(checked_limit(time_limit)):
            program, near = self._problem(task), self._nearest(task)
            if near is not None:
                program = held_like(near, program)
            start = None if near is None else from_walk(near, program)
            gait = walk_of(program, "newton", start, seed, progress)
        self.add(gait)
        return gait

    def estimate(self, scenario: Scenario | str | Path) -> Gait:
        """Return about how the walk of a scenario is: one step from the nearest walk that is kept.

        It takes a fraction of the time of `predict` and is no walk: ``gait.solution["estimate"]``
        tells by how much it breaks which constraint and how far its cost may be off.

        Raises
        ------
        ScenarioError
            If the scenario cannot be read or used.
        ResultError
            If no walk that is kept is near.
        """
        task = scenario_of(scenario)
        near = self._nearest(task)
        if near is None:
            raise ResultError(f"{task.name}: no walk is near enough to estimate it; predict one")
        return estimated(near, held_like(near, self._problem(task)))

    def add(self, gait: Gait | str | Path) -> None:
        """Keep a walk that was found elsewhere, as a start of others.

        Parameters
        ----------
        gait : Gait, str or Path
            A walk with its multipliers, or the folder of its result.

        Raises
        ------
        ResultError
            If it cannot be read, is no walk or has no multipliers.
        """
        walk = gait if isinstance(gait, Gait) else load(gait)
        if why := no_walk(walk) or ("" if walk.multipliers else "It has no multipliers."):
            raise ResultError(f"{walk.scenario.name}: {why} Nothing can start from it.")
        self._kept.append(_Kept(Place.of(walk.scenario), replace(walk)))

    def _problem(self, task: Scenario) -> GaitProgram:
        """Return the problem of a scenario, with what is known of the last one."""
        if self._program is None:
            self._program = build_program(task, None, *self._own)
        else:
            self._program = self._program.moved_to(task)
        return self._program

    def _nearest(self, task: Scenario) -> Gait | None:
        """Return the nearest walk, the newest of those that are as near; None if none is."""
        place = Place.of(task)
        near = min(reversed(self._kept), key=lambda kept: kept.place.distance(place), default=None)
        return near.gait if near and near.place.distance(place) <= NEAR else None
