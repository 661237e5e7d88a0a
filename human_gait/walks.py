"""Walks from Python: predict one, read one, keep it as a whole result.

The command line goes by `prediction`, which writes a folder and tells how it goes; here a `Gait` is
what goes in and comes out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from human_gait import console
from human_gait.arrays import FloatArray
from human_gait.checks.costs import costs
from human_gait.checks.table import Checks, verify
from human_gait.exceptions import NoSolutionFound, SolveInterrupted
from human_gait.problem.balance_rows import TURNING_FRICTION
from human_gait.problem.own import PathConstraint, RunningCost
from human_gait.problem.posture_rows import STRENGTH
from human_gait.problem.program import GaitProgram, build_program
from human_gait.problem.tracking import Tracking
from human_gait.results.names import EXPLANATION, GAIT_CYCLE, SUMMARY, result_files
from human_gait.results.ours import given_path, our_folder
from human_gait.results.reading import read_json
from human_gait.results.sealed import write_json
from human_gait.results.shapes import FOUND
from human_gait.scenario import Scenario, scenario_of
from human_gait.solving.diagnosis import not_kept, suggestions
from human_gait.solving.drake_solvers import SOLVERS
from human_gait.solving.seeds import checked_seed, checked_starts
from human_gait.solving.solver import Solution
from human_gait.solving.starts import GIVEN, Attempt, Start, best, climb, from_walk, guess_of
from human_gait.solving.summary import (
    explanation_content,
    found_gait,
    save_found,
    summary_content,
)
from human_gait.solving.warm_start import load_multipliers, save_multipliers
from human_gait.solving.watch import Iterate, Tell
from human_gait.stopping import TIME_LIMIT, checked_limit, running, under_way
from human_gait.walk.described import gait_digest, was_changed
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import save_gait_cycle
from human_gait.walk.gait_file import folder_of, load_gait
from human_gait.walk.measured import was_measured

Progress = bool | Callable[[Iterate], None]


def predict(  # noqa: PLR0913, options that are given by name
    scenario: Scenario | str | Path,
    solver: str = "newton",
    dynamics: str = "pinocchio",
    seed: int = 0,
    *,
    warm_from: Gait | str | Path | None = None,
    guess: Gait | str | Path | None = None,
    starts: int = 1,
    progress: Progress = False,
    costs: Sequence[RunningCost | Tracking] = (),
    constraints: Sequence[PathConstraint] = (),
    time_limit: float | None = TIME_LIMIT,
) -> Gait:
    """Return the predicted gait of a scenario.

    Parameters
    ----------
    scenario : Scenario, str or Path
        A scenario, or its TOML file, or the name of one that comes with the package, ``"normal"``.
    solver : str
        ``newton``, ``snopt`` or ``ipopt``.
    dynamics : str
        ``pinocchio``, or ``dh`` for the paper's own recursion: the same numbers, more slowly.
    seed : int
        Of the random starts that are tried where all others fail.
    warm_from : Gait, str or Path, optional
        A walk to start from, or the folder of its result: after a small change of the scenario it
        takes half a second. If that leads nowhere the usual starts follow.
    guess : Gait, str or Path, optional
        A motion to start from instead of the own guess, a walk or not: that of a trial (`fit`), or
        of another prediction.
    starts : int
        How many starts to solve from: the first one that leads to a walk, then walks beside that,
        then random ones. Of all walks the cheapest is kept; its `Gait.solution` tells how many
        ``walks`` there are and their ``cost_spread``.
    progress : bool or function
        True shows on the terminal how the solver proceeds; a function is given every `Iterate`.
    costs : sequence of RunningCost or Tracking
        Of one's own, added to the objective.
    constraints : sequence of PathConstraint
        Of one's own.
    time_limit : float or None, [s]
        When it gives up at the latest; None for when all ways have been tried.

    Returns
    -------
    Gait
        It carries how it was found (`Gait.solution`) and what each bound costs
        (`Gait.multipliers`), from which another prediction can start.

    Raises
    ------
    ScenarioError
        If the scenario cannot be read or used.
    ResultError
        If there is no walk, or motion, to start from.
    NoSolutionFound
        If the solver did not converge, had no time left, or a check fails; it carries the best gait
        so far and, as its report, the constraints that are not kept, the checks that failed and
        what to try.
    SolveInterrupted
        If it is interrupted (Ctrl-C, in a notebook "interrupt the kernel"): it carries the same,
        and is a KeyboardInterrupt as well.
    KeyboardInterrupt
        If it is interrupted before there is anything to carry.
    ValueError
        If there is no such solver, dynamics, time limit, seed or number of starts, or a cost or
        constraint of one's own returns what it should not, or has bounds that nothing is between.
    TypeError
        If `warm_from` or `guess` is no gait or path, or own costs and constraints are none.
    """
    if solver not in SOLVERS:
        raise ValueError(f"no solver is called {solver!r}: choose one of {', '.join(SOLVERS)}")
    seed, starts = checked_seed(seed), checked_starts(starts)
    task = scenario_of(scenario)
    before, motion = _gait_given("warm_from", warm_from), _gait_given("guess", guess)
    with running(checked_limit(time_limit)):
        program = build_program(task, None, dynamics, costs, constraints)
        start = None if before is None else from_walk(before, program)
        free = None if motion is None else guess_of(motion, program)
        return walk_of(program, solver, start, seed, progress, starts, free)


def walk_of(
    program: GaitProgram,
    solver: str,
    start: Start | None,
    seed: int,
    progress: Progress,
    starts: int = 1,
    guess: FloatArray | None = None,
) -> Gait:
    """Return a verified walk of a program, as a part of the run that is under way.

    Raises
    ------
    NoSolutionFound, SolveInterrupted, KeyboardInterrupt
        As `predict`.
    """
    under_way().asked.hold()
    with _telling(progress) as tell:
        attempts = climb(program, solver, start, seed, tell, guess, starts=starts)
    kept = best(attempts)
    gait = found_gait(kept, seed, attempts)
    if not kept.success:
        raise _no_solution(kept, gait)
    return gait


def load(path: str | Path) -> Gait:
    """Read the gait of a result.

    Parameters
    ----------
    path : str or Path
        The folder of a result, or its ``gait.npz``.

    Returns
    -------
    Gait
        With what the folder knows of how it was found.

    Raises
    ------
    ResultError
        If there is no gait that can be read, or a file beside it is damaged.
    """
    gait, folder = load_gait(path), folder_of(path)
    solution = dict(gait.solution)
    if not solution.keys() >= FOUND.keys() and (folder / SUMMARY).is_file():
        found = read_json(folder / SUMMARY, FOUND)
        solution |= {key: found[key] for key in FOUND}
    return replace(gait, solution=solution, multipliers=load_multipliers(gait, folder))


def save(gait: Gait, folder: str | Path) -> Path:
    """Write a gait as a result without pictures, as `Gait.save` says, and return the folder."""
    seed = int(gait.solution.get("seed", 0))
    with our_folder(given_path(folder), result_files(SOLVERS), solved=False) as new:
        attempt = _attempt(gait)
        kept = replace(attempt, checks=verify(found_gait(attempt, seed)))
        saved = save_found(kept, seed, new)
        save_multipliers(saved, new)
        save_gait_cycle(saved, new / GAIT_CYCLE)
        contents = {
            SUMMARY: summary_content(kept, [kept], seed, saved),
            EXPLANATION: explanation_content(kept.program, kept.solution),
        }
        for name, content in contents.items():
            write_json(new / name, content, gait_digest(saved))
    return Path(folder)


def _gait_given(name: str, given: object) -> Gait | None:
    if given is None or isinstance(given, Gait):
        return given
    if isinstance(given, str | Path):
        return load(given)
    kind = type(given).__name__
    raise TypeError(f"{name} must be a gait or the folder of its result, not {kind}")


@contextmanager
def _telling(progress: Progress) -> Iterator[Callable[[str], Tell | None]]:
    """Yield what is given the name of each start and returns who is told of its iterates."""
    if progress is True:
        with console.progress() as tell:
            yield tell
    else:
        told = progress if callable(progress) else None
        yield lambda _: told


def _no_solution(kept: Attempt, gait: Gait) -> NoSolutionFound:
    solution, checks = kept.solution, Checks(kept.checks)
    broken = not_kept(kept.program.scenario, solution.violations)
    tries = suggestions(kept.program, solution, kept.checks)
    run = under_way()
    parts = dict.fromkeys([solution.status, run.over])
    message = f"{solution.solver} stopped: {', '.join(part for part in parts if part)}"
    kind = SolveInterrupted if run.asked.signal else NoSolutionFound
    return kind(message, gait, [*broken, *checks.failed, *tries])


def _attempt(gait: Gait) -> Attempt:
    """Return the attempt that a gait came from, as far as it is known, without its checks."""
    found = gait.solution
    program = _program(gait)
    solution = Solution(
        gait=gait,
        converged=bool(gait.multipliers) and not was_changed(gait),  # nothing else leaves any
        interrupted=False,
        solver=str(found.get("solver", "unknown")),
        status=str(found.get("status", "unknown")),
        iterations=int(found.get("iterations", 0)),
        evaluations=int(found.get("evaluations", 0)),
        cost=_cost(gait, program),
        wall_time=float(found.get("wall_time_s", 0.0)),
        violations=program.violations(gait.free),
        multipliers=dict(gait.multipliers),
    )
    return Attempt(str(found.get("start", GIVEN)), program, solution, [])


def _cost(gait: Gait, program: GaitProgram) -> float:
    """Return the cost that is told, with costs of one's own; else what the scenario's would be."""
    if "cost" in gait.solution:
        return float(gait.solution["cost"])
    return costs(gait) if was_measured(gait) else program.cost(gait.free)[0]


def _program(gait: Gait) -> GaitProgram:
    """Return the problem that a gait solves, with friction and strength where it had them.

    Costs and constraints of one's own are functions, which no gait carries; it knows only what
    their bounds cost (`own_bounds`).
    """
    program = GaitProgram(gait.scenario, gait.basis, gait.solution.get("dynamics", "pinocchio"))
    return held_like(gait, program)


def held_like(gait: Gait, program: GaitProgram) -> GaitProgram:
    """Return a problem with friction and strength as constraints where a gait had them."""
    if TURNING_FRICTION.name in gait.multipliers:
        program = program.with_friction()
    return program.with_strength() if STRENGTH.name in gait.multipliers else program
