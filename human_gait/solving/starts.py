"""Ways to start a solve, one after another, until one ends in a walk that passes every check.

Most scenarios need the first one only. Every rung is recorded; for a given seed the ladder takes
the same way every time.

0. Of many control points: the walk with as many as usual, refined.
1. The guess from the plan alone: as it is (for ``newton``), then by three posture paths, as a rule,
   freer, more gently.
2. Continuation: the same person walks comfortably and unladen first; speed, step and load then move
   to those asked for in two strides, each solve starting from the one before.
3. The guess, disturbed at random.
4. The other solvers.

An attempt that ends feasible but not optimal is taken up again where it ended. If all that is wrong
with a walk is that it would slip, or needs more strength than the person has, it is taken up with
that as a constraint: hardly any walk needs it, and the solvers are quicker without.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain, count, islice

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import N_DOF, index
from human_gait.checks.check import Check, Kind
from human_gait.checks.verification import verify
from human_gait.problem.program import GaitProgram
from human_gait.scenario import Scenario
from human_gait.scenario.problem import MANY_CONTROL_POINTS
from human_gait.solving.drake_solvers import SOLVERS
from human_gait.solving.neighbours import NEIGHBOURS, SPENT, WARM_ITERATIONS, there_and_back
from human_gait.solving.solver import POSTURE, Solution, solve
from human_gait.solving.warm_start import adapted, fitting, stretched
from human_gait.solving.watch import FEASIBLE, Tell
from human_gait.stopping import running, under_way
from human_gait.walk.bspline import Basis
from human_gait.walk.dimensionless import comfortable_walk
from human_gait.walk.gait import Gait
from human_gait.walk.gait_file import make_record

Run = Callable[..., Solution]

OWN_GUESS, GIVEN, WARM = "own guess", "given start", "warm start"
GUESSED = "given guess"
"""What a rung is called whose guess is given instead of the own one."""
_PATHS: dict[str, tuple[float, float] | None] = {
    OWN_GUESS: None,
    "own guess, by a posture path": POSTURE,
    "own guess, freer": (0.3, 1e-2),
    "own guess, more gently": (1.0, 1.0),
}
_STRIDES = (0.0, 0.5, 1.0)  # of the way from comfortable walking to the walk that is asked for
_RANDOM_STARTS = 2
_HELD: Mapping[Kind, Callable[[GaitProgram], GaitProgram]] = {
    Kind.FRICTION: GaitProgram.with_friction,
    Kind.STRENGTH: GaitProgram.with_strength,
}
_HEIGHT = index("pelvis_ty")
_SHAKEN = 8  # control points at most that are disturbed
_SAMPLES = 101  # of a step
_DISTURBANCE = 0.1  # standard deviation of every control point, [rad] or [m]


@dataclass(frozen=True)
class Start:
    """Where to start instead of the ladder's own guesses.

    Attributes
    ----------
    name : str
    point : (m * 55,) array
        Free control points.
    multipliers : mapping of str to array
        That belong to the point, for a warm start (`solver.solve`).
    alone : bool
        Whether it is the only one; else the ladder's own follow.
    most_iterations : int or None
        After which ``newton`` gives it up.
    """

    name: str
    point: FloatArray
    multipliers: Mapping[str, FloatArray] = field(default_factory=dict)
    alone: bool = True
    most_iterations: int | None = None


def from_walk(gait: Gait, program: GaitProgram) -> Start:
    """Return a walk with its multipliers as the first start of a program; its own ones follow."""
    multipliers = fitting(gait.multipliers, program) if gait.multipliers else {}
    most = WARM_ITERATIONS if multipliers else None
    return Start(WARM, adapted(gait, program), multipliers, alone=False, most_iterations=most)


def guess_of(gait: Gait, program: GaitProgram) -> FloatArray:
    """Return the motion of a gait, a walk or not, as a guess of a program, (m * 55,).

    The pelvis of a person with longer legs is higher by as much.
    """
    points = adapted(gait, program).reshape(-1, N_DOF)
    legs = program.scenario.subject.leg_length / gait.scenario.subject.leg_length
    points[:, _HEIGHT] *= legs
    return np.clip(points, *program.limits).ravel()


@dataclass(frozen=True)
class Attempt:
    """One solve on the ladder.

    Attributes
    ----------
    start : str
        How it was started.
    program : GaitProgram
        What was solved.
    solution : Solution
    checks : list of Check
        Of the gait it ended with.
    """

    start: str
    program: GaitProgram
    solution: Solution
    checks: list[Check]

    @property
    def success(self) -> bool:
        """Whether the solver is content and every check is passed."""
        return self.solution.converged and all(check.passed for check in self.checks)

    @property
    def beyond(self) -> set[Kind]:
        """What it is beyond, where stronger people or a rougher floor would make it a walk."""
        failed = {check.kind for check in self.checks if not check.passed}
        return failed if self.solution.converged and failed <= _HELD.keys() else set()

    @property
    def feasible(self) -> bool:
        """Whether every constraint is kept."""
        return max(violation.value for violation in self.solution.violations) <= FEASIBLE


def climb(  # noqa: PLR0913, options that are given by name
    program: GaitProgram,
    solver: str = "newton",
    start: Start | None = None,
    seed: int = 0,
    tell: Callable[[str], Tell | None] = lambda _: None,
    guess: FloatArray | None = None,
    *,
    starts: int = 1,
    tries: int | None = None,
) -> list[Attempt]:
    """Solve a program from one start after another until there is a walk, or several.

    Parameters
    ----------
    program : GaitProgram
    solver : str
        One of ``solver.SOLVERS``.
    start : Start, optional
        What to start from before the ladder's own guesses, or instead.
    seed : int
        Of the random starts.
    tell : function, optional
        Is given the name of a start and returns what is given every evaluated point.
    guess : (m * 55,) array, optional
        Free control points instead of the program's own guess on the first rungs.
    starts : int
        How many to solve from: the first one that leads to a walk, and others after it.
    tries : int, optional
        How many of the ladder's own rungs there are at most; else all.

    Returns
    -------
    list of Attempt
        In the order they were made: until the first walk, then from further starts; or all have
        failed. A run that is over (`stopping`) ends it with what there is.

    Raises
    ------
    ValueError
        If there is no such solver.
    KeyboardInterrupt
        If there is nothing to keep yet.
    """
    rungs: Iterator[tuple[str, Run]] = islice(own_starts(program, solver, seed, guess), tries)
    if start is not None:
        given = partial(
            solve,
            program,
            solver,
            start.point,
            multipliers=start.multipliers,
            most_iterations=start.most_iterations,
        )
        rungs = chain([(start.name, given)], () if start.alone else rungs)
    attempts: list[Attempt] = []
    with running() as run, run.asked.held():  # nothing is lost between a solve and its being noted
        try:
            for attempt in _attempts(program, rungs, solver, seed, tell, starts - 1):
                attempts.append(attempt)
                if attempt.solution.interrupted or run.over:
                    break
        except KeyboardInterrupt:  # of a solve that had nothing to keep
            if not attempts:
                raise
    return attempts


def best(attempts: list[Attempt]) -> Attempt:
    """Return the attempt to keep: a walk, else what is feasible, else what violates least."""

    def rank(attempt: Attempt) -> tuple[bool, bool, float, float]:
        worst = max(violation.value for violation in attempt.solution.violations)
        failed = not attempt.success, not attempt.solution.converged
        return *failed, max(worst, FEASIBLE), attempt.solution.cost

    return min(attempts, key=rank)


def disturbed(program: GaitProgram, rng: np.random.Generator) -> FloatArray:
    """Return the program's guess (m * 55,), disturbed within its limits.

    Every control point of a spline of a few is: the same shake at each point of a finer one would
    be a much rougher motion.
    """
    guess, basis = program.guess().reshape(-1, N_DOF), program.basis
    few = Basis.uniform(basis.cycle, min(_SHAKEN, basis.n_control_points), basis.mirrored)
    t = np.linspace(0.0, basis.step_time, _SAMPLES)
    q = basis.matrix(t) @ basis.expand(guess)
    coarse = few.fit(t, q)
    shaken = coarse + rng.normal(0.0, _DISTURBANCE, coarse.shape)
    apart = few.matrix(t) @ (few.expand(shaken) - few.expand(coarse))
    return np.clip(basis.fit(t, q + apart), *program.limits).ravel()


def own_starts(
    program: GaitProgram, solver: str, seed: int, first: FloatArray | None
) -> Iterator[tuple[str, Run]]:
    """Yield the rungs below each other: what a start is called, and the solve that it begins.

    Parameters
    ----------
    program : GaitProgram
    solver : str
    seed : int
        Of the random starts.
    first : (m * 55,) array, optional
        Guess of the first rungs, else the program's own.
    """
    if program.scenario.discretisation.control_points > MANY_CONTROL_POINTS and first is None:
        yield "fewer control points first", partial(refined, program, solver)
    for name, weights in _PATHS.items():
        if weights == POSTURE and solver != "newton":
            continue  # the others take this path anyway
        called = name if first is None else name.replace(OWN_GUESS, GUESSED)
        yield called, partial(solve, program, solver, guess=first, weights=weights)
    yield "continuation", partial(continued, program, solver)
    rng = np.random.default_rng(seed)
    for n in range(1, _RANDOM_STARTS + 1):
        guess = disturbed(program, rng)
        yield f"random start {n} of seed {seed}", partial(solve, program, solver, guess=guess)
    for other in SOLVERS:
        if other != solver:
            yield f"{other} instead", partial(solve, program, other)


def further_starts(found: Attempt, solver: str, seed: int) -> Iterator[tuple[str, Run]]:
    """Yield ways to other local optima than the walk that was found, without end.

    Parameters
    ----------
    found : Attempt
    solver : str
    seed : int
        Of the random starts.
    """
    program = found.program
    for neighbour in NEIGHBOURS:
        if (beside := neighbour.beside(program)) is not None:
            yield neighbour.name, partial(there_and_back, program, beside, solver, found.solution)
    rng = np.random.default_rng(seed)
    for n in count(1):
        guess = disturbed(program, rng)
        yield f"random start {n} of seed {seed}", partial(solve, program, solver, guess=guess)


def _attempts(
    program: GaitProgram,
    rungs: Iterable[tuple[str, Run]],
    solver: str,
    seed: int,
    tell: Callable[[str], Tell | None],
    more: int,
) -> Iterator[Attempt]:
    """Yield attempts until the first walk, then those of some more starts."""
    for name, run in rungs:
        for attempt in _taken(program, name, run, tell):
            yield attempt
            if attempt.success:
                for further, way in islice(further_starts(attempt, solver, seed), more):
                    yield from _taken(attempt.program, further, way, tell)
                return


def _taken(
    program: GaitProgram, name: str, run: Run, tell: Callable[[str], Tell | None]
) -> Iterator[Attempt]:
    """Yield an attempt and, where that may help, others that start from its end."""
    attempt = _attempt(program, name, run, tell)
    yield attempt
    if attempt.feasible and not attempt.solution.converged:
        attempt = _again(program, f"{name}, taken up again", attempt, tell)
        yield attempt
    held = set[Kind]()
    while more := attempt.beyond - held:  # a walk that slips no more may need more strength
        held |= more
        for kind in sorted(more):
            program = _HELD[kind](program)
        words = " and ".join(sorted(held))
        attempt = _again(program, f"{name}, held by {words}", attempt, tell)
        yield attempt


def _again(
    program: GaitProgram, name: str, ended: Attempt, tell: Callable[[str], Tell | None]
) -> Attempt:
    """Solve from where an attempt ended, warm if it has multipliers."""
    solver, end = ended.solution.solver, ended.solution.gait.free
    run = partial(solve, program, solver, end, multipliers=ended.solution.multipliers)
    return _attempt(program, name, run, tell)


def _attempt(
    program: GaitProgram, name: str, run: Run, tell: Callable[[str], Tell | None]
) -> Attempt:
    solution = run(tell=tell(name))
    return Attempt(name, program, solution, verify(make_record(solution.gait)))


def continued(program: GaitProgram, solver: str, tell: Tell | None = None) -> Solution:
    """Solve walks on the way from comfortable walking; each is the guess of the next."""
    guess, step_length = None, 0.0
    spent: list[Solution] = []
    for share in _STRIDES:
        task = on_the_way(program.scenario, share)
        stride = program if share == 1.0 else program.for_scenario(task)
        if guess is not None:
            guess = stretched(guess, task.walk.step_length / step_length)
        solution = solve(stride, solver, tell=tell, guess=guess)
        if share < 1.0 and (solution.interrupted or under_way().over):
            raise KeyboardInterrupt  # another walk is nothing to keep
        spent.append(solution)
        guess, step_length = solution.gait.free, task.walk.step_length
    total = {name: sum(getattr(one, name) for one in spent) for name in SPENT}
    return replace(solution, **total)


def refined(program: GaitProgram, solver: str, tell: Tell | None = None) -> Solution:
    """Solve the walk with as many control points as usual; it is the start of the finer one."""
    grid = program.scenario.discretisation
    usual = type(grid)().completed(program.scenario.about)
    usual = replace(usual, intervals=min(grid.intervals, usual.intervals))
    coarse = program.for_scenario(replace(program.scenario, discretisation=usual))
    before = solve(coarse, solver, tell=tell)
    solution = solve(program, solver, adapted(before.gait, program), tell=tell)
    total = {name: getattr(before, name) + getattr(solution, name) for name in SPENT}
    return replace(solution, **total)


def on_the_way(scenario: Scenario, share: float) -> Scenario:
    """Return a walk between comfortable, unladen walking (share 0) and a scenario (share 1).

    Comfortable speed and step grow with the leg (`comfortable_walk`).
    """
    walk, easy = scenario.walk, comfortable_walk(scenario.subject)
    between = replace(
        walk,
        speed=easy.speed + share * (walk.speed - easy.speed),
        step_length=easy.step_length + share * (walk.step_length - easy.step_length),
    )
    load = replace(scenario.load, mass=share * scenario.load.mass)
    return replace(scenario, walk=between, load=load)
