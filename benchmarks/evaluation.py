"""Where the time of a solve goes, and what Pinocchio alone would take.

    python benchmarks/evaluation.py [--runs N] [--solvers NAME ...] [--out DIR]

Three tables, all of the same run and medians of N: the parts of a cold solve of normal walking, by
a clock that runs in one function at a time; the cost of one evaluation and of one Hessian per
instant, against first and second derivatives of the inverse dynamics by bare Pinocchio, from Python
and, where there is a compiler, in C++ (`second_derivatives.cpp`, compiled once into DIR); and the
budget: the time of the Newton solve against that of the derivatives that it cannot do without, one
first and one second at every instant of every iteration. Writes DIR/evaluation.json.

Run it with OMP_NUM_THREADS=1: the matrices are small.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import json
import os
import platform
import re
import shutil
import subprocess
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import numpy as np
import pinocchio as pin
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from human_gait.body.person import make_body
from human_gait.dynamics.inverse_dynamics import make_dynamics
from human_gait.problem.program import GaitProgram, build_program
from human_gait.scenario import Scenario, load_scenario
from human_gait.solving.mathematical_program import ProgramFunctions
from human_gait.solving.solver import Solution, solve

NORMAL = Path(__file__).parent.parent / "scenarios" / "normal.toml"
SOURCE = Path(__file__).with_name("second_derivatives.cpp")
REPEAT = 11  # evaluations of each kind in a run
NEAR = 0.3  # largest q, v, a of a random state
SAME = 1e-9  # of torques of one state, relative
WIDTH = 120

BUILD = "building the program"
OUTSIDE = {
    "newton": "interior-point method",
    "snopt": "SNOPT and Drake",
    "ipopt": "IPOPT and Drake",
}
SEAM = "AutoDiff seam"
PARTS: dict[str, dict[str, tuple[str, ...]]] = {
    "dynamics": {
        "human_gait.dynamics.inverse_dynamics:PinocchioDynamics": ("inverse",),
        "human_gait.dynamics.inverse_dynamics:RecursiveDynamics": ("inverse",),
    },
    "ground reaction and joint torques": {
        "human_gait.walk.instant": ("ground_reaction", "joint_torques")
    },
    "feet": {"human_gait.walk.feet:Feet": ("motion",)},
    "passive joints": {  # and taking their torques away from the others
        "human_gait.dynamics.tissues:PassiveJoints": ("torque",),
        "human_gait.walk.instant:Walker": ("at",),
    },
    "objective": {"human_gait.problem.functions:WalkFunctions": ("cost",)},
    "rows of the constraints": {
        "human_gait.problem.functions:WalkFunctions": ("rows", "residual"),
        "human_gait.problem.residual:Constraint": ("add_to_adjoint",),
    },
    "second derivatives on the tree": {
        "human_gait.dynamics.second_derivatives:TreeCurvature": ("hessian",)
    },
    "other second derivatives": {"human_gait.walk.instant:Walker": ("second_derivatives",)},
    "chain rule, first derivatives": {
        "human_gait.problem.transcription:Transcription": (
            "motion",
            "gradient",
            "values",
            "jacobian",
        )
    },
    "chain rule, second derivatives": {
        "human_gait.problem.transcription:Transcription": ("hessian",)
    },
    "putting the Lagrangian together": {
        "human_gait.problem.functions:WalkFunctions": ("hessian",),
        "human_gait.solving.mathematical_program:ProgramFunctions": (
            "cost",
            "gradient",
            "rows",
            "jacobian",
            "hessian",
        ),
    },
    "watch": {
        "human_gait.solving.watch:Watch": ("__call__",),
        "human_gait.problem.program:GaitProgram": ("violations",),
    },
}
"""Functions by the part that their time belongs to, without that of the parts that they call."""

Function = Callable[..., Any]


class Clock:
    """Time by parts; while a part waits for another one, its time stands still.

    Attributes
    ----------
    spent : dict of str to float, [s]
    calls : dict of str to int
    """

    def __init__(self, now: Callable[[], float] = time.perf_counter) -> None:
        self._now, self._open, self._since = now, list[str](), 0.0
        self.clear()

    def clear(self) -> None:
        """Forget all times."""
        self.spent: dict[str, float] = defaultdict(float)
        self.calls: dict[str, int] = defaultdict(int)

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Let the time go to a part, until it is left or another one is entered."""
        self._turn()
        self._open.append(name)
        self.calls[name] += 1
        try:
            yield
        finally:
            self._turn()
            self._open.pop()

    def _turn(self) -> None:
        now = self._now()
        if self._open:
            self.spent[self._open[-1]] += now - self._since
        self._since = now

    def timed(self, name: str, function: Function) -> Function:
        """Return a function whose time goes to a part."""

        @wraps(function)
        def measured(*arguments: Any, **named: Any) -> Any:
            with self.part(name):
                return function(*arguments, **named)

        return measured


@contextmanager
def patched(clock: Clock) -> Iterator[None]:
    """Let a clock time the functions of ``PARTS`` and Drake's seam."""
    kept: list[tuple[Any, str, Function]] = []

    def put(owner: Any, name: str, new: Callable[[Function], Function]) -> None:
        before = getattr(owner, name)
        kept.append((owner, name, before))
        setattr(owner, name, new(before))

    try:
        for part, owners in PARTS.items():
            for owner, names in owners.items():
                for name in names:
                    put(resolve_name(owner), name, lambda f, part=part: clock.timed(part, f))
        put(resolve_name("human_gait.problem.drake"), "_seam", lambda f: clock.timed(SEAM, f))
        yield
    finally:
        for owner, name, before in reversed(kept):
            setattr(owner, name, before)


def parts_of_a_solve(scenario: Scenario, solver: str) -> tuple[dict[str, float], Solution]:
    """Return the time of every part of a cold solve, [s], and the solution."""
    clock = Clock()
    with patched(clock):
        began = time.perf_counter()
        program = build_program(scenario)
        built = time.perf_counter() - began
        clock.clear()
        with clock.part(OUTSIDE[solver]):
            solution = solve(program, solver, time_limit=None)
    return {BUILD: built, **clock.spent}, solution


def cold_solve(scenario: Scenario) -> tuple[float, Solution]:
    """Return how long building and solving take by Newton steps, unpatched, and the solution."""
    began = time.perf_counter()
    solution = solve(build_program(scenario))
    return time.perf_counter() - began, solution


class Evaluations:
    """What is evaluated at the instants of a program, and by bare Pinocchio at as many."""

    def __init__(self, scenario: Scenario) -> None:
        self.program: GaitProgram = build_program(scenario)
        self._functions = ProgramFunctions(self.program.torques.prog)
        self._random = np.random.default_rng(0)
        self._guess = self.program.guess()
        now = self.program.instants(self._guess)
        self._state = now.q, now.v, now.a
        body = make_body(scenario.subject, scenario.load)
        self._dynamics = make_dynamics(body, "pinocchio")
        self.model = body.pinocchio_model()
        self._data = self.model.createData()
        rows = len(self._functions.problem().row_lower)
        self._multipliers = self._random.uniform(-1.0, 1.0, rows)
        self._bare = self._random.uniform(-NEAR, NEAR, (len(self.program.times), 3, self.model.nv))

    def times(self) -> dict[str, float]:
        """Return medians of the times per instant, [us]."""
        kinds: dict[str, tuple[Function, Function]] = {
            "bare_first_python": (lambda: None, self._first),
            "dynamics": (lambda: None, lambda _: self._dynamics.inverse(*self._state)),
            "instants": (self._somewhere, self._instants),
            "evaluation": (self._somewhere, self._evaluation),
            "hessian": (self._evaluated, self._hessian),
        }
        found: dict[str, list[float]] = {kind: [] for kind in kinds}
        for _ in range(REPEAT + 1):
            for kind, (prepared, evaluate) in kinds.items():
                given = prepared()
                began = time.perf_counter()
                evaluate(given)
                found[kind].append(time.perf_counter() - began)
        per_instant = 1e6 / len(self.program.times)
        return {kind: per_instant * float(np.median(x[1:])) for kind, x in found.items()}

    def torque_sum(self) -> float:
        """Return the sum of the torques at the state that the C++ program tells it of."""
        all_of_them = np.full(self.model.nv, 0.1)
        torque = pin.rnea(self.model, self._data, all_of_them, all_of_them, all_of_them)
        return float(torque.sum())

    def _first(self, _: object) -> None:
        for q, v, a in self._bare:
            pin.computeRNEADerivatives(self.model, self._data, q, v, a)

    def _somewhere(self) -> Any:
        """Return variables that the program has not seen."""
        size = self._guess.shape
        return (self._guess + self._random.uniform(-0.02, 0.02, size)) / self.program.unit

    def _instants(self, x: Any) -> None:
        self.program.instants(x * self.program.unit)

    def _evaluation(self, x: Any) -> None:
        """Evaluate all first derivatives, as the solver wants them at every iterate."""
        of = self._functions
        for function in (of.cost, of.gradient, of.rows, of.jacobian):
            function(x)

    def _evaluated(self) -> Any:
        x = self._somewhere()
        self._evaluation(x)
        return x

    def _hessian(self, x: Any) -> None:
        self._functions.hessian(x, 1.0, self._multipliers)


# Bare Pinocchio in C++


def joints(model: pin.Model) -> str:
    """Return gravity and joints of a model as text, for the C++ program."""
    lines = [_numbers(model.gravity.linear), str(model.njoints - 1)]
    for i in range(1, model.njoints):
        place, inertia = model.jointPlacements[i], model.inertias[i]
        where = _numbers(place.rotation, place.translation)
        what = _numbers(np.array([inertia.mass]), inertia.lever, inertia.inertia)
        lines.append(f"{model.parents[i]} {model.joints[i].shortname()} {where} {what}")
    return "\n".join(lines) + "\n"


def _numbers(*arrays: Any) -> str:
    return " ".join(repr(float(x)) for array in arrays for x in np.ravel(array))


def compiled(folder: Path) -> Path | str:
    """Return the C++ program, compiled now or before, or why there is none."""
    compiler = shutil.which("g++") or shutil.which("c++")
    if not compiler:
        return "there is no C++ compiler"
    prefix = Path(pin.__file__).parents[4]
    eigen = _eigen(prefix)
    targets = prefix / "lib/cmake/pinocchio/pinocchioTargets.cmake"
    if not eigen or not targets.exists():
        return "there are no headers of Eigen or Pinocchio"
    found = re.search(r'INTERFACE_COMPILE_DEFINITIONS "([^"$]*)"', targets.read_text())
    definitions = [
        *(found[1].split(";") if found else []),
        "PINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION",
    ]
    lib = prefix / "lib"
    options = ["-O3", "-DNDEBUG", "-std=c++17", *(f"-D{name}" for name in definitions)]
    options += [f"-I{prefix / 'include'}", f"-I{eigen}", str(SOURCE)]
    options += [f"-L{lib}", f"-Wl,-rpath,{lib}", "-lpinocchio_default"]
    key = "\n".join([compiler, pin.__version__, *options]).encode() + SOURCE.read_bytes()
    program = folder / f"second_derivatives-{hashlib.sha256(key).hexdigest()[:12]}"
    if not program.exists():
        command = [compiler, *options, "-o", str(program)]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        if done.returncode:
            (folder / "compiler.log").write_text(done.stderr, encoding="utf-8")
            return f"it could not be compiled, see {folder / 'compiler.log'}"
    return program


def _eigen(prefix: Path) -> Path | None:
    """Return a folder with the headers of Eigen; CasADi, of the extra `test`, brings them."""
    casadi = importlib.util.find_spec("casadi")
    places = [prefix / "include/eigen3", Path("/usr/include/eigen3")]
    if casadi and casadi.origin:
        places.insert(0, Path(casadi.origin).parent / "include/eigen3")
    return next((place for place in places if (place / "Eigen/Core").exists()), None)


def bare_cpp(program: Path, model: pin.Model, torque_sum: float, instants: int) -> dict[str, float]:
    """Return the times of bare Pinocchio in C++ per instant, [us].

    Raises
    ------
    RuntimeError
        If it does not compute the torques of Python.
    """
    text = program.with_suffix(".txt")
    text.write_text(joints(model), encoding="utf-8")
    command = [str(program), str(text), str(instants), str(REPEAT)]
    found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    if abs(found["torque_sum"] - torque_sum) > SAME * abs(torque_sum):
        raise RuntimeError(f"torques in C++ add up to {found['torque_sum']}, not to {torque_sum}")
    return {"bare_first_cpp": found["first_us"], "bare_second_cpp": found["second_us"]}


# All of it


def measured(solvers: list[str], runs: int, folder: Path, tell: Function) -> dict[str, Any]:
    """Return the medians of everything, measured in turn."""
    scenario = load_scenario(NORMAL)
    evaluations = Evaluations(scenario)
    tell("compiling bare Pinocchio")
    program = compiled(folder)
    walls, counts, times = [], dict[str, Any](), []
    parts: dict[str, list[dict[str, float]]] = {solver: [] for solver in solvers}
    cold_solve(scenario)  # the first one loads libraries
    for number in range(runs):
        tell(f"run {number + 1} of {runs}")
        wall, solution = cold_solve(scenario)
        walls.append(wall)
        counts["newton"] = _counts(solution)
        one = evaluations.times()
        if isinstance(program, Path):
            instants = len(evaluations.program.times)
            one |= bare_cpp(program, evaluations.model, evaluations.torque_sum(), instants)
        times.append(one)
        for solver in solvers:
            tell(f"run {number + 1} of {runs}: parts of {solver}")
            spent, solution = parts_of_a_solve(scenario, solver)
            parts[solver].append(spent)
            counts[solver] = _counts(solution)
    found = {
        "machine": machine(),
        "runs": runs,
        "instants": len(evaluations.program.times),
        "solves": counts,
        "cold_newton_s": float(np.median(walls)),
        "parts_s": {solver: medians(each) for solver, each in parts.items()},
        "per_instant_us": medians(times),
        "no_cpp": None if isinstance(program, Path) else program,
    }
    return {**found, "budget": budget(found)}


def machine() -> dict[str, Any]:
    """Return what the times depend on."""
    return {
        "cpu_count": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "pinocchio": pin.__version__,
        "numpy": np.__version__,
    }


def _counts(solution: Solution) -> dict[str, Any]:
    keys = ("status", "iterations", "evaluations", "cost")
    return {key: getattr(solution, key) for key in keys}


def medians(each: list[dict[str, float]]) -> dict[str, float]:
    """Return the median of every number over some runs, 0 where a run has none."""
    names = dict.fromkeys(name for one in each for name in one)
    return {name: float(np.median([one.get(name, 0.0) for one in each])) for name in names}


def budget(found: Mapping[str, Any]) -> dict[str, float] | None:
    """Return the time of the derivatives that a Newton solve needs, and how often it fits in."""
    us = found["per_instant_us"]
    if "bare_second_cpp" not in us:
        return None
    states = found["solves"]["newton"]["iterations"] * found["instants"]
    bare = 1e-6 * states * (us["bare_first_cpp"] + us["bare_second_cpp"])
    return {"states": states, "bare_s": bare, "ratio": found["cold_newton_s"] / bare}


def parts_table(found: Mapping[str, Any], solver: str) -> Table:
    """Return the parts of a solve, the largest first."""
    parts, bare = found["parts_s"][solver], found["budget"]
    counts, total = found["solves"][solver], sum(parts.values())
    effort = "iterations" if solver == "newton" else "evaluations"  # Drake does not tell the first
    title = f"A cold solve by {solver}, {counts[effort]} {effort}"
    shown = Table(title=title, title_justify="left")
    shown.add_column("part")
    for column in (escape("[s]"), "%", *(["of bare Pinocchio"] if _compared(solver, bare) else [])):
        shown.add_column(column, justify="right")
    rows = sorted(parts.items(), key=lambda row: -row[1])
    for name, seconds in [*rows, ("together", total)]:
        entries = [f"{seconds:.3f}", f"{100 * seconds / total:.1f}"]
        if _compared(solver, bare):
            entries.append(f"{seconds / bare['bare_s']:.2f}")
        shown.add_row(name, *entries)
    return shown


def _compared(solver: str, bare: Mapping[str, float] | None) -> bool:
    return solver == "newton" and bare is not None


def instant_table(found: Mapping[str, Any]) -> Table:
    """Return what is evaluated, per instant."""
    us, words = found["per_instant_us"], found["no_cpp"]
    shown = Table(title=f"Per instant, of {found['instants']}: medians", title_justify="left")
    for column in ("what", escape("[us]"), "of bare Pinocchio"):
        shown.add_column(column, justify="left" if column == "what" else "right")
    first, second = us.get("bare_first_cpp"), us.get("bare_second_cpp")
    rows = {
        "first derivatives, bare Pinocchio in C++": (first, first),
        "first derivatives, bare Pinocchio from Python": (us["bare_first_python"], first),
        "dynamics with axes and feet": (us["dynamics"], first),
        "an instant: dynamics, ground reaction, feet": (us["instants"], first),
        "an evaluation: cost, rows, all first derivatives": (us["evaluation"], first),
        "second derivatives, bare Pinocchio in C++": (second, second),
        "the Hessian of the Lagrangian": (us["hessian"], second),
    }
    for what, (time_us, bare) in rows.items():
        if time_us is None:
            shown.add_row(what, f"none: {words}", "")
        else:
            shown.add_row(what, f"{time_us:.1f}", f"{time_us / bare:.2f}" if bare else "")
    return shown


def budget_lines(found: Mapping[str, Any]) -> str:
    """Return the budget in words."""
    wall, counts = found["cold_newton_s"], found["solves"]["newton"]
    line = f"Cold solve by newton: {wall:.2f} s, {counts['iterations']} iterations."
    if found["budget"] is None:
        return f"{line} No budget: {found['no_cpp']}."
    us = found["per_instant_us"]
    return (
        f"{line}\nBare first and second derivatives at {counts['iterations']} x "
        f"{found['instants']} instants, {us['bare_first_cpp']:.0f} + {us['bare_second_cpp']:.0f} us"
        f" each: {found['budget']['bare_s']:.2f} s.\nRatio: {found['budget']['ratio']:.2f}"
    )


def main() -> None:
    """Measure, print the tables and write the numbers."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=5, help="of everything; odd numbers are best")
    choices = tuple(OUTSIDE)
    parser.add_argument("--solvers", nargs="+", choices=choices, default=["newton", "snopt"])
    parser.add_argument("--out", type=Path, default=Path("out/bench"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    console = Console()
    if not console.is_terminal:
        console.width = WIDTH
    with Console(stderr=True).status("") as status:
        found = measured(options.solvers, options.runs, options.out, status.update)
    for solver in options.solvers:
        console.print(parts_table(found, solver))
    console.print(instant_table(found))
    console.print(budget_lines(found), soft_wrap=True)
    text = json.dumps(found, indent=2)
    (options.out / "evaluation.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
