"""What the arithmetic of a Newton step takes at least: bare Pinocchio, and products of matrices.

First and second derivatives of the inverse dynamics by Pinocchio alone, the second in C++ where
there is a compiler (`second_derivatives.cpp`, compiled once), how quickly this machine multiplies,
and how many operations a step is.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import re
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from human_gait.body.person import make_body
from human_gait.problem.grid import Grid, Half
from human_gait.problem.program import GaitProgram
from human_gait.scenario import load_scenario
from human_gait.solving.mathematical_program import ProgramFunctions

SOURCE = Path(__file__).with_name("second_derivatives.cpp")
REPEAT = 11
NEAR = 0.3  # largest q, v, a of a random state
SAME = 1e-9  # of torques of one state, relative
SIDE = 512  # of square matrices


def measured(folder: Path, instants: int) -> dict[str, Any]:
    """Return times at all instants [ms], and what products of matrices do [GFLOP/s]."""
    scenario = load_scenario("paper-normal")
    model = make_body(scenario.subject, scenario.load).pinocchio_model()
    found: dict[str, Any] = {
        "first_ms": 1e3 * first_derivatives(model, instants),
        "gemm_gflops": 2 * SIDE**3 / product() / 1e9,
    }
    program = compiled(folder)
    if isinstance(program, str):
        return {**found, "no_second": program}
    each = second_derivatives(program, model, instants)
    return {**found, "second_ms": each["second_us"] * instants / 1e3}


def median(function: Callable[[], object]) -> float:
    """Return the median of the CPU time of a function, [s]."""
    spent = []
    for _ in range(REPEAT):
        began = time.process_time()
        function()
        spent.append(time.process_time() - began)
    return float(np.median(spent))


def first_derivatives(model: pin.Model, instants: int) -> float:
    """Return the time of first derivatives by Pinocchio at instants, [s]."""
    states = np.random.default_rng(0).uniform(-NEAR, NEAR, (instants, 3, model.nv))
    data = model.createData()

    def all_of_them() -> None:
        for q, v, a in states:
            pin.computeRNEADerivatives(model, data, q, v, a)

    return median(all_of_them)


def product() -> float:
    """Return the time of a product of square matrices, [s]."""
    A = np.random.default_rng(0).uniform(size=(SIDE, SIDE))
    return median(lambda: A @ A)


def second_derivatives(program: Path, model: pin.Model, instants: int) -> dict[str, float]:
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
    state = np.full(model.nv, 0.1)
    torques = float(pin.rnea(model, model.createData(), state, state, state).sum())
    if abs(found["torque_sum"] - torques) > SAME * abs(torques):
        raise RuntimeError(f"torques in C++ add up to {found['torque_sum']}, not to {torques}")
    return dict(found)


@contextmanager
def counted() -> Iterator[list[int]]:
    """Yield a list that gets the operations of every product that a Hessian is made of."""
    found: list[int] = []
    kept = Half.add, Half.add_onward, Grid.onto_points

    def noted(sums: Callable[..., None]) -> Callable[..., None]:
        def products(half: Half, left: Any, right: Any, *rest: Any) -> None:
            K, r, points, n = left[1].shape
            found.append(2 * K * r * (points * n) * (points * len(right[0])))
            sums(half, left, right, *rest)

        return products

    def onto_points(grid: Grid, rows: Any) -> Any:
        found.append(2 * 4 * rows.size)  # four control points
        return kept[2](grid, rows)

    Half.add, Half.add_onward, Grid.onto_points = noted(kept[0]), noted(kept[1]), onto_points
    try:
        yield found
    finally:
        Half.add, Half.add_onward, Grid.onto_points = kept


def flops(program: GaitProgram) -> int:
    """Count the operations of a Newton step: products of its Hessian, and Cholesky's method."""
    functions = ProgramFunctions(program.torques.prog)
    rows = np.ones(len(functions.problem().row_lower))
    with counted() as found:
        functions.hessian(program.guess() / program.unit, 1.0, rows, rows)
    return sum(found) + len(program.variables) ** 3 // 3


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
    definitions = found[1].split(";") if found else []
    definitions.append("PINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION")
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
