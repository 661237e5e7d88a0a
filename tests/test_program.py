"""One problem, whatever its dynamics is computed with."""

import numpy as np
import pytest
from walks import BACKPACK, near_walk, scenario

from human_gait.body.skeleton import index, mirror
from human_gait.exceptions import ScenarioError
from human_gait.problem.program import build_program

TASKS = {
    "plain": scenario(control_points=6, objective={"passive_torques": "none"}),
    "with a backpack": scenario(load=BACKPACK, dynamics_per_interval=2),
    "with a backpack as a force": scenario(load=BACKPACK | {"model": "force"}),
}
TOLERANCE = 1e-9  # of the largest value: rounding, which the ground reaction magnifies


class Pair:
    """A problem with Pinocchio and with the paper's recursion, at a point near a walk."""

    def __init__(self, task):
        self.programs = [build_program(task, dynamics=name) for name in ("pinocchio", "dh")]
        self.free = near_walk(self.programs[0])


@pytest.fixture(params=TASKS.values(), ids=TASKS, scope="module")
def pair(request):
    return Pair(request.param)


def assert_same(found, expected, tolerance=TOLERANCE):
    atol = tolerance * max(np.abs(expected).max(), 1e-3)
    np.testing.assert_allclose(found, expected, rtol=0, atol=atol)


def test_the_program_knows_its_dynamics(pair):
    assert [program.dynamics for program in pair.programs] == ["pinocchio", "dh"]
    engines = [type(program.functions.walker._dynamics).__name__ for program in pair.programs]
    assert engines == ["PinocchioDynamics", "RecursiveDynamics"]


def test_the_cost_and_its_gradient_do_not_depend_on_the_engine(pair):
    (expected, slope), (cost, found) = (program.cost(pair.free) for program in pair.programs)
    assert cost == pytest.approx(expected, rel=TOLERANCE)
    assert_same(found, slope)


def test_the_constraints_and_their_gradients_do_not_depend_on_the_engine(pair):
    ours, theirs = pair.programs
    for one, other in zip(ours.constraints, theirs.constraints, strict=True):
        expected, found = ours.residual(one, pair.free), theirs.residual(other, pair.free)
        for part, reference in zip(found, expected, strict=True):
            assert_same(part, reference)


def test_the_units_of_the_variables_do_not_depend_on_the_engine(pair):
    ours, theirs = pair.programs
    np.testing.assert_array_equal(ours.unit, theirs.unit)


def test_the_torques_do_not_depend_on_the_engine(pair):
    expected, found = (program.instants(pair.free) for program in pair.programs)
    assert_same(found.torque, expected.torque)
    assert_same(found.muscle_torque, expected.muscle_torque)


def test_a_stage_is_built_from_nothing_that_was_evaluated_before(pair):
    """Building observes nothing, and is the same however often and wherever the program was."""
    for program in pair.programs:
        told = []
        program.functions.watched_by(told.append)
        stages = [program.posture(program.guess(), 1.0, 0.1) for _ in range(2)]
        assert (told, program.functions.evaluations) == ([], 0)
        program.cost(pair.free)
        program.functions.observe = None
        stages += [program.posture(program.guess(), 1.0, 0.1) for _ in range(8)]
        first, *others = (linear_rows(stage) for stage in stages)
        assert len(first) == 3 * 2
        for other in others:
            for found, expected in zip(other, first, strict=True):
                np.testing.assert_array_equal(found, expected)


def linear_rows(stage):
    """Matrices and bounds of the linear rows of a stage."""
    rows = [binding.evaluator() for binding in stage.prog.linear_constraints()]
    return [part for r in rows for part in (r.GetDenseA(), r.lower_bound(), r.upper_bound())]


def test_linear_rows_are_those_of_their_constraints_everywhere(pair):
    program = pair.programs[0]
    rows = iter(program.torques.prog.linear_constraints())
    x = pair.free / program.unit
    for constraint in (one for one in program.constraints if one.linear):
        binding, value = next(rows).evaluator(), program.rows(constraint, pair.free).value
        found = binding.GetDenseA() @ x
        assert_same(found - binding.lower_bound(), value - constraint.lower, 1e-12)
        assert_same(binding.upper_bound() - found, constraint.upper - value, 1e-12)


def test_an_unknown_dynamics_is_refused():
    with pytest.raises(ValueError, match="newton"):
        build_program(TASKS["plain"], dynamics="newton")


@pytest.mark.parametrize(
    ("periodicity", "n_rows"), [("acceleration", 0), ("position", 55), ("velocity", 110)]
)
def test_rows_of_symmetry_hold_for_a_symmetric_clamped_spline(periodicity, n_rows):
    """Eq. (26): the last posture is the mirrored first one a step further on, and so its rate."""
    program = build_program(scenario(control_points=6, periodicity=periodicity))
    matrix, ends = program.symmetry
    assert matrix.shape == (n_rows, len(program.unit))
    assert len(ends) == n_rows
    if n_rows:
        free = near_walk(program).reshape(-1, 55)
        free[-1] = mirror(free[0])
        free[-1, index("pelvis_tz")] += program.scenario.walk.step_length
        free[-2] = free[-1] - mirror(free[1] - free[0])
        np.testing.assert_allclose(matrix @ free.ravel(), ends, atol=1e-12)
        free[-1, 0] += 0.01
        assert np.abs(matrix @ free.ravel() - ends).max() > 9e-3


def test_units_follow_the_weights_of_the_objective():
    plain, weighted = (
        build_program(scenario(objective={"weighting": kind})).unit for kind in ("none", "strength")
    )
    assert np.any(plain != weighted)
    np.testing.assert_array_equal(np.log2(plain) % 1.0, 0.0)  # powers of two


# --- moved to another scenario

MOVED = {
    "faster": {"speed": 1.3},
    "longer": {"step_length": 0.7},
    "heavier": {"load": BACKPACK | {"mass": 12.0}},
    "other feet": {"ground.ball": "toes"},
    "rougher": {"tolerances.pelvis_speed": 0.2},
}


@pytest.mark.parametrize("changes", MOVED.values(), ids=MOVED)
def test_a_moved_problem_is_the_one_that_is_built_from_nothing(changes):
    """Costs, rows and linear rows in control points; the units may be others."""
    before = build_program(scenario(control_points=6, load=BACKPACK))
    task = before.scenario.replace(changes)
    moved, anew = before.moved_to(task), build_program(task)
    assert moved.scenario == task
    np.testing.assert_array_equal(moved.unit, before.unit)
    free = near_walk(anew)
    for expected, found in zip(anew.cost(free), moved.cost(free), strict=True):
        assert_same(found, expected, 1e-12)
    for one, other in zip(anew.constraints, moved.constraints, strict=True):
        assert_same(other.lower, one.lower, 1e-12)
        for expected, found in zip(
            anew.residual(one, free), moved.residual(other, free), strict=True
        ):
            assert_same(found, expected, 1e-12)
    for expected, found in zip(rows_at(anew, free), rows_at(moved, free), strict=True):
        assert_same(found, expected, 1e-12)


def rows_at(program, free):
    """How far the linear rows of the MathematicalProgram are from their bounds."""
    found = []
    for binding in program.torques.prog.linear_constraints():
        rows = binding.evaluator()
        value = rows.GetDenseA() @ (free / program.unit)
        found += [value - rows.lower_bound(), value - rows.upper_bound()]
    return found


def test_a_problem_with_other_splines_is_not_moved_but_built():
    before = build_program(scenario(control_points=6))
    moved = before.moved_to(scenario(control_points=7))
    assert len(moved.variables) == 4 * 55
    np.testing.assert_array_equal(moved.unit, build_program(scenario(control_points=7)).unit)


def test_a_moved_problem_refuses_what_no_walk_can_keep():
    before = build_program(scenario(control_points=6))
    with pytest.raises(ScenarioError, match="leaves no walk"):
        before.moved_to(before.scenario.replace({"limits.knee_flexion_r": [0.0, 5.0]}))


def test_only_the_same_body_is_kept():
    before = build_program(scenario(control_points=6))
    faster = before.moved_to(before.scenario.replace(speed=1.3)).functions.walker
    fuller = before.moved_to(before.scenario.replace({"load.mass": 9.0})).functions.walker
    assert faster._dynamics is before.functions.walker._dynamics
    assert faster.plan.walk.speed == 1.3
    assert fuller._dynamics is not before.functions.walker._dynamics
    assert fuller.body.load.mass == 9.0
