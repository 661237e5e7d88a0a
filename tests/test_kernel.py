"""The compiled kernel against what it stands for in numpy, through the functions that use it."""

import os
import re
import shutil
from copy import deepcopy
from itertools import chain

import numpy as np
import pytest
from walks import BACKPACK, near_walk, scenario

from human_gait import kernel
from human_gait.body.skeleton import N_DOF
from human_gait.dynamics.inverse_dynamics import symmetric
from human_gait.newton.cyclic_band import CyclicBand
from human_gait.problem.chain_rule import ABOVE_PELVIS
from human_gait.problem.grid import Half
from human_gait.problem.program import build_program
from human_gait.solving.solver import solve
from human_gait.walk.adjoint import Adjoint, Block
from human_gait.walk.feet import Feet
from human_gait.walk.ground_reaction import (
    LOWER,
    N_LOWER,
    add_torques_to_adjoint,
    ground_reaction,
    load_partials,
)
from human_gait.walk.muscles import UPPER

SAME = 1e-12  # of the largest entry
TASKS = {
    "effort": scenario(),
    "effort, three free control points": scenario(control_points=6, load=BACKPACK),
    "effort, clamped": scenario(control_points=5, periodicity="velocity"),
    "paper, a backpack as a force": scenario(
        objective={"formulation": "paper"}, load=BACKPACK | {"model": "force"}
    ),
    "human": scenario(objective={"formulation": "human"}, dynamics_per_interval=2),
    "human, three free control points": scenario(
        control_points=6, objective={"formulation": "human"}
    ),
    "human, clamped": scenario(
        control_points=8, periodicity="velocity", objective={"formulation": "human"}
    ),
    "human, many control points": scenario(
        control_points=24, intervals=42, objective={"formulation": "human"}
    ),
    "paper, many control points, clamped": scenario(
        control_points=20,
        intervals=34,
        periodicity="velocity",
        objective={"formulation": "paper"},
    ),
}
ALL_ROWS = {"posture.limbs": "apart", "posture.swing_knee": "bent"}
TASKS = {name: task.replace(ALL_ROWS) for name, task in TASKS.items()}


def is_used():
    return kernel.function("dense") is not None


@pytest.fixture(scope="module")
def built():
    if not is_used():
        pytest.skip(f"no kernel is built, or {kernel.SWITCH}=0 leaves it out")


def test_where_there_is_a_compiler_the_tests_of_a_repository_have_a_kernel():
    """Nothing else would be missed: without one everything is computed in numpy."""
    if not os.environ.get("CI") or os.environ.get(kernel.SWITCH) == "0":
        pytest.skip("not on CI, or there to run without a kernel")
    if not any(shutil.which(name) for name in ("c++", "g++", "clang++")):
        pytest.skip("no C++ compiler is there to build one")
    assert kernel.LIBRARY.is_file()
    assert is_used()


class Walking:
    """A program with all its rows and what is known at a point near a walk."""

    def __init__(self, task):
        self.program = build_program(task).with_friction().with_strength()
        self.free, functions = near_walk(self.program), self.program.functions
        self.walker, self.grid = functions.walker, functions.transcription.grid
        self.now = functions.instants(self.free)

    def random(self, *shape):
        """Numbers (K, *shape), always the same ones."""
        return np.random.default_rng(3).normal(size=(len(self.now.t), *shape))

    def tree(self):
        now = self.now
        return self.walker._tree.first(now.dynamics, now.v, now.a)

    def tree_hessian(self):
        return self.walker._tree.second(self.tree(), self.random(N_DOF), self.random(6))

    def hessian(self, springs=1.0):
        """Of the Lagrangian with springs, all multipliers random, from the motion on."""
        functions, rng = self.program.functions, np.random.default_rng(4)
        rows = [(c, *rng.normal(size=(2, len(c.lower)))) for c in self.program.constraints]
        rows = [(c, multipliers, springs * curvature) for c, multipliers, curvature in rows]
        functions._known = None
        return functions.hessian(self.free, [(term, 1.0) for term in self.program.terms], rows)


@pytest.fixture(params=TASKS.values(), ids=TASKS, scope="module")
def walking(request, built):  # noqa: ARG001
    return Walking(request.param)


def agree(function, same=SAME):
    """What a function returns with the kernel is what it returns without, array by array."""
    found = [*arrays(function())]
    with kernel.without():
        assert not is_used()
        expected = [*arrays(function())]
    for one, other in zip(found, expected, strict=True):
        assert one.shape == other.shape
        assert np.abs(one - other).max(initial=0.0) <= same * np.abs(other).max(initial=0.0)


def arrays(given):
    """All arrays in tuples and objects."""
    if isinstance(given, np.ndarray):
        return [given]
    parts = given if isinstance(given, (list, tuple)) else vars(given).values()
    return chain.from_iterable(arrays(part) for part in parts)


def test_the_tree(walking):
    agree(walking.tree)
    agree(lambda: walking.tree().wrench)
    agree(walking.tree_hessian)


@pytest.mark.parametrize("dofs", [np.arange(N_DOF), UPPER, np.arange(N_DOF)[LOWER]], ids=len)
def test_the_tree_on_control_points(walking, dofs):
    agree(lambda: walking.tree_hessian().on_points(walking.grid.N, dofs))


def test_the_ground(walking):
    """With a lean of its own as the seventh variable, and without."""
    now = walking.now
    agree(lambda: ground_reaction(now.ground.variables, walking.walker.plan, now.t))


def test_what_forces_on_the_feet_do_to_torques(walking):
    now = walking.now
    loads = now.dynamics.axes, now.ground.on_links

    def second():
        adjoint = Adjoint.none(*now.ground.variables.value.shape)
        adjoint.torque[:] = walking.random(N_DOF)
        adjoint.ground[:] = 1.0
        adjoint.ground_second[:] = 1.0
        return *add_torques_to_adjoint(*loads, adjoint), adjoint.ground, adjoint.ground_second

    agree(lambda: load_partials(*loads))
    agree(second)


@pytest.mark.parametrize("ball", ["foot", "toes"])
def test_the_feet(walking, ball):
    now, feet = walking.now, Feet(walking.walker.body, ball)

    def motion():
        return feet.motion(now.dynamics, now.v)

    def second():
        weights = walking.random(4, 2, 4, 3).swapaxes(0, 1)
        into = np.ones((3, len(now.t), N_LOWER, N_LOWER))
        feet.add_hessian(now.dynamics.axes, now.v, motion(), weights, into)
        return into

    agree(motion)
    agree(second)


@pytest.mark.parametrize("branch", ABOVE_PELVIS)
def test_torques_on_control_points(walking, branch):
    N, muscles = walking.grid.N, walking.now.muscles
    agree(lambda: muscles.on_points(N, branch, ABOVE_PELVIS[branch]))


def test_rows_on_control_points(walking):
    """Also of rows that lie otherwise in memory."""
    rows = walking.random(5, 3, 9)
    agree(lambda: walking.grid.onto_points(rows))
    agree(lambda: walking.grid.onto_points(walking.random(9, 3, 5).swapaxes(1, 3)))


def test_rows_with_their_weights(walking):
    P, own = walking.random(6, 4, 9), 2
    weights = walking.random(3, 6).swapaxes(0, 1)
    agree(lambda: walking.grid.weighted(P, P[0, ::-1], own, weights))


def rows_of(K, dofs):
    """Rows of K instants by the control points of some DOF."""
    return dofs, np.random.default_rng(len(dofs)).normal(size=(K, 7, 4, len(dofs)))


@pytest.mark.parametrize("onward", [False, True], ids=["within", "onward"])
def test_sums_of_products(walking, onward):
    """Of instants and the next ones, which are a piece further on; with a mask, or without."""
    grid, K = walking.grid, len(walking.grid.first)
    left, right = (np.array([0, 3, 54, 20]), np.arange(2, 40, 3))
    mask = np.random.default_rng(5).uniform(size=(len(left), len(right)))

    def sums():
        half = Half(grid, onward)
        half.add(rows_of(K, left), rows_of(K, right), mask)
        half.add(rows_of(K, right), rows_of(K, left))
        if onward:
            ends = len(grid.ends)
            half.add_onward(rows_of(ends, left), rows_of(ends, right))
        return half.blocks.copy(), half.folded()

    agree(sums)


@pytest.mark.parametrize("parts", [("qq",), ("qq", "qv"), ("qv", "vv"), ("qq", "vv")], ids=str)
def test_what_stands_in_no_product(walking, parts):
    dofs = np.array([54, 0, 7, 30])
    mixed = walking.random(len(dofs), len(dofs))
    given = {"qq": symmetric(mixed), "qv": mixed, "vv": symmetric(2.0 + mixed)}

    def sums():
        half = Half(walking.grid, onward=False)
        half.add_block(Block(dofs, **{part: given[part] for part in parts}))
        return half.blocks

    agree(sums)


@pytest.mark.usefixtures("built")
@pytest.mark.parametrize("shape", [(12, 4, 3), (7, 3, 4), (3, 4, 2), (1, 2, 3)], ids=str)
def test_matrices_of_blocks(shape):
    m, width, b = shape
    blocks = np.random.default_rng(m).normal(size=(m, width, b, b))
    agree(lambda: CyclicBand(blocks).dense())


@pytest.mark.parametrize("springs", [0.0, 1.0])
def test_all_of_it_together(walking, springs):
    """In the units of the solver, in which no variable is much stiffer than another.

    A foot that hardly carries anything magnifies rounding.
    """
    agree(lambda: walking.hessian(springs).scaled(walking.program.unit).dense(), same=1e-10)


def test_each_term_on_its_own(walking):
    """Some rows are none then; and what numpy knows of an instant the kernel takes."""
    functions, unit = walking.program.functions, walking.program.unit
    for term in walking.program.terms:

        def hessian(term=term):
            return functions.hessian(walking.free, [(term, 1.0)], []).scaled(unit).dense()

        agree(hessian, same=1e-10)


@pytest.mark.solve
@pytest.mark.usefixtures("built")
def test_a_walk_is_found_without_it_on_the_same_way():
    with_it = solve(build_program(scenario()))
    with kernel.without():
        without = solve(build_program(scenario()))
    assert with_it.converged
    assert with_it.iterations == without.iterations
    assert with_it.cost == pytest.approx(without.cost, rel=1e-9)


def test_nothing_of_it_is_unused(walking, monkeypatch):
    """What `kernel.cpp` offers is what a Hessian asks for."""
    source, asked, function = kernel.LIBRARY.with_suffix(".cpp"), set(), kernel.function

    def asked_for(name):
        asked.add(name)
        return function(name)

    monkeypatch.setattr(kernel, "function", asked_for)
    walking.hessian().dense()
    _, _, offered = source.read_text().partition('extern "C" {')
    assert asked == {*re.findall(r"^void (\w+)\(", offered, re.MULTILINE)} - {"use_blas"}


def test_a_library_of_another_source_is_left_out(tmp_path, monkeypatch):
    """After a change of `kernel.cpp` it would be given other arguments than it takes."""
    if kernel._loaded() is None:
        pytest.skip("there is no kernel")
    other = tmp_path / "kernel.cpp"
    other.write_bytes(kernel.SOURCE.read_bytes() + b"// another")
    monkeypatch.setattr(kernel, "SOURCE", other)
    assert kernel._loaded() is None


def test_the_seam_refuses_what_c_would_take_for_something_else():
    run = kernel.function("dense")
    if run is None:
        pytest.skip("there is no kernel")
    blocks = np.ones((3, 1, 2, 2))
    with pytest.raises(TypeError, match="left out"):
        run(3, 1, 2, None, into=(np.zeros((6, 6)),))
    for wrong in (np.zeros((6, 6), dtype=np.float32), np.zeros((6, 12))[:, ::2]):
        with pytest.raises(TypeError, match="doubles in C order"):
            run(3, 1, 2, blocks, into=(wrong,))


def test_a_copy_of_the_motion_of_a_tree_has_the_same_second_derivatives():
    """Nothing that the kernel is given is found through a view."""
    program = build_program(scenario())
    now, tree = program.instants(program.guess()), program.functions.walker._tree
    weights = np.ones((len(now.t), 55)), np.ones((len(now.t), 6))
    for found, copied in zip(
        tree.second(now.tree, *weights)[1:5],
        tree.second(deepcopy(now.tree), *weights)[1:5],
        strict=True,
    ):
        np.testing.assert_array_equal(found, copied)
