"""A program for Newton steps: against Drake's values, and each derivative against differences."""

import numpy as np
import pytest
from walks import BACKPACK, central_difference, near_walk, scenario

from human_gait.newton.matrix import matrix_of
from human_gait.newton.nonlinear_program import Duals
from human_gait.problem.constraints import LIMITS, SYMMETRY
from human_gait.problem.program import build_program
from human_gait.problem.units import COST_SCALE
from human_gait.solving.mathematical_program import ProgramFunctions

TASKS = {
    "mirrored": scenario(load=BACKPACK, dynamics_per_interval=2),
    "clamped": scenario(control_points=5, periodicity="velocity"),
    "three free control points": scenario(control_points=6, limits={"frozen": ["wrist_flexion_r"]}),
}
TOLERANCE = 1e-6  # of the largest slope: rounding leaves about 1e-10 of the values over 1e-6


class Case:
    """A stage as plain functions, a point near a walk, and Drake's program of the same."""

    def __init__(self, task, stage, friction=False):
        self.program = build_program(task)
        if friction:
            self.program = self.program.with_friction()
        guess = self.program.guess()
        stages = {"torques": self.program.torques, "posture": self.program.posture(guess, 0.7, 0.2)}
        self.stage = stages[stage]
        self.functions = ProgramFunctions(self.stage.prog)
        self.bindings = [part.binding for part in self.functions.constraints]
        self.problem = self.functions.problem()
        self.x = near_walk(self.program) / self.program.unit
        self.directions = np.random.default_rng(1).normal(size=(len(self.x), 8))
        self.directions *= 0.1  # units of the variables are large

    def jacobian(self, x):
        """All rows, dense; entries that occur twice are added."""
        dense = np.zeros((len(self.problem.row_lower), len(x)))
        np.add.at(dense, self.problem.jacobian_entries, self.problem.jacobian(x))
        return dense

    def hessian(self, factor, multipliers, curvature=None):
        """Second derivatives of factor * cost + multipliers * rows and J' diag(curvature) J."""
        curvature = np.zeros_like(multipliers) if curvature is None else curvature
        return matrix_of(self.problem.hessian(self.x, factor, multipliers, curvature)).dense()

    def named(self, duals):
        """Duals by description of the constraint, in Drake's sign."""
        found = self.functions.duals_by_binding(duals)
        return {evaluator.get_description(): dual for (evaluator, _), dual in found.items()}

    def random_duals(self):
        rng = np.random.default_rng(3)
        return Duals(rng.normal(size=len(self.problem.row_lower)), rng.normal(size=len(self.x)))


@pytest.fixture(params=TASKS, scope="module")
def task(request):
    return TASKS[request.param]


@pytest.fixture(params=["torques", "posture"], scope="module")
def case(request, task):
    return Case(task, request.param)


def worst(found, slopes):
    return np.abs(found - slopes).max() / np.abs(slopes).max()


def test_the_cases_are_of_every_kind():
    """Rows of symmetry, and entries of the Jacobian that occur twice."""
    cases = {name: Case(task, "torques") for name, task in TASKS.items()}
    ties = [c for c in cases.values() if c.stage.prog.linear_equality_constraints()]
    assert ties == [cases["clamped"]]
    doubled = [c for c in cases.values() if not distinct(c.problem.jacobian_entries)]
    assert doubled == [cases["three free control points"]]


def distinct(entries):
    return len(set(zip(*entries, strict=True))) == len(entries[0])


def test_bounds_are_drakes_and_none_is_left_out(case):
    names = [b.evaluator().get_description() for b in case.bindings]
    sides = (by_binding(case, side) for side in (case.problem.row_lower, case.problem.row_upper))
    found = dict(zip(names, zip(*sides, strict=True), strict=True))
    found[LIMITS.name] = case.problem.lower, case.problem.upper
    bindings = case.stage.prog.GetAllConstraints()
    assert len(bindings) == len(found) == len(names) + 1
    for rows in (b.evaluator() for b in bindings):
        lower, upper = found.pop(rows.get_description())
        np.testing.assert_array_equal(lower, rows.lower_bound())
        np.testing.assert_array_equal(upper, rows.upper_bound())


def test_the_cost_is_drakes(case):
    prog = case.stage.prog
    for seed in range(3):
        x = near_walk(case.program, seed) / case.program.unit
        expected = sum(prog.EvalBinding(b, x).item() for b in prog.GetAllCosts())
        assert case.problem.cost(x) == pytest.approx(expected, rel=1e-12)


def test_the_rows_are_drakes(case):
    prog = case.stage.prog
    expected = np.concatenate([prog.EvalBinding(b, case.x) for b in case.bindings])
    np.testing.assert_allclose(case.problem.rows(case.x), expected, atol=1e-12)


def test_the_gradient_is_the_slope_of_the_cost(case):
    found = case.problem.gradient(case.x) @ case.directions
    slopes = central_difference(case.problem.cost, case.x, case.directions)
    assert worst(found, slopes) < TOLERANCE


def test_the_jacobian_is_the_slope_of_the_rows(case):
    found = case.jacobian(case.x) @ case.directions
    slopes = central_difference(case.problem.rows, case.x, case.directions)
    for binding, part, expected in zip(
        case.bindings, *(by_binding(case, rows) for rows in (found, slopes)), strict=True
    ):
        assert worst(part, expected) < TOLERANCE, binding.evaluator().get_description()


def by_binding(case, rows):
    sizes = [b.evaluator().num_constraints() for b in case.bindings]
    return np.split(rows, np.cumsum(sizes)[:-1])


@pytest.mark.parametrize("of", ["cost", "rows", "both"])
def test_the_hessian_is_the_slope_of_the_gradients(case, of):
    factor = 0.0 if of == "rows" else 0.7
    multipliers = case.random_duals().rows * (of != "cost")

    def gradient(x):
        return factor * case.problem.gradient(x) + multipliers @ case.jacobian(x)

    found = case.hessian(factor, multipliers) @ case.directions
    slopes = central_difference(gradient, case.x, case.directions)
    assert worst(found, slopes) < 1e-5


def test_the_curvature_of_every_row_comes_with_its_gradient_twice(case):
    """J' diag(curvature) J, of rows that are linear in the variables too."""
    rng = np.random.default_rng(4)
    multipliers, J = case.random_duals().rows, case.jacobian(case.x)
    for part in case.bindings:
        on = by_row(case, part)
        curvature = on * rng.uniform(0.1, 9.0, len(on))
        found = case.hessian(1.0, multipliers, curvature) - case.hessian(1.0, multipliers)
        assert worst(found, J.T @ (curvature[:, None] * J)) < 1e-9


def by_row(case, binding):
    """1 for the rows of a binding, 0 for all others."""
    sizes = [b.evaluator().num_constraints() for b in case.bindings]
    return np.repeat([float(b is binding) for b in case.bindings], sizes)


def test_with_friction_too():
    """Its rows come last of the curved ones."""
    case = Case(TASKS["mirrored"], "torques", friction=True)
    names = [b.evaluator().get_description() for b in case.bindings]
    assert "sliding friction" in names
    multipliers = case.random_duals().rows
    found = case.hessian(1.0, multipliers) @ case.directions
    slopes = central_difference(
        lambda x: case.problem.gradient(x) + multipliers @ case.jacobian(x),
        case.x,
        case.directions,
    )
    assert worst(found, slopes) < 1e-5


def test_second_derivatives_are_symmetric_and_in_an_array_of_their_own(case):
    multipliers = case.random_duals().rows
    first, again = (case.hessian(1.0, multipliers) for _ in range(2))
    assert first is not again
    assert worst(first, first.T) < 1e-12
    first[:] = np.nan
    assert np.all(np.isfinite(case.hessian(1.0, multipliers)))


def test_the_dynamics_is_evaluated_once_for_all_functions_of_a_point(case):
    before = case.program.functions.evaluations
    x, duals = case.x + 1e-3, case.random_duals()
    case.problem.cost(x)
    case.problem.gradient(x)
    case.problem.rows(x)
    case.problem.jacobian(x)
    case.problem.hessian(x, 1.0, duals.rows, np.abs(duals.rows))
    assert case.program.functions.evaluations <= before + 1


def test_duals_by_name_and_back_are_the_same(case):
    duals = case.random_duals()
    named = case.named(duals)
    back = case.functions.duals_from_names(named)
    np.testing.assert_array_equal(back.rows, duals.rows)
    np.testing.assert_array_equal(back.variables, duals.variables)
    expected = {c.name for c in case.stage.constraints} | {LIMITS.name}
    expected |= {SYMMETRY.name} if case.stage.prog.linear_equality_constraints() else set()
    assert set(named) == expected


def test_duals_by_name_belong_to_the_rows_of_their_constraint(case):
    """With the sign of Drake, d cost / d bound."""
    duals = case.random_duals()
    named = case.named(duals)
    slope = duals.rows @ case.jacobian(case.x)
    free = case.x * case.program.unit
    expected = np.zeros(len(case.x))
    for constraint in case.stage.constraints:
        jacobian = case.program.residual(constraint, free)[1] * case.program.unit
        expected -= named[constraint.name] @ jacobian
    if SYMMETRY.name in named:
        expected -= named[SYMMETRY.name] @ (case.program.symmetry[0] * case.program.unit)
    np.testing.assert_allclose(slope, expected, atol=1e-10 * np.abs(expected).max())
    np.testing.assert_array_equal(named[LIMITS.name], -duals.variables)


def test_rows_without_a_name_have_no_dual(case):
    nothing = case.functions.duals_from_names({"another constraint": np.ones(3)})
    np.testing.assert_array_equal(nothing.rows, np.zeros(len(case.problem.row_lower)))
    np.testing.assert_array_equal(nothing.variables, np.zeros(len(case.x)))


def test_multipliers_and_duals_are_each_others_inverse(task):
    """At a point where every control point is at the limit that its multiplier belongs to."""
    case = Case(task, "torques")
    program, named = case.program, case.named(case.random_duals())
    lower, upper = (np.tile(limit, program.basis.n_free) for limit in program.limits)
    at = np.where(named[LIMITS.name] > 0.0, lower, upper)
    back = program.duals(program.multipliers(named, at))
    assert set(back) == set(named)
    for name, dual in named.items():
        np.testing.assert_allclose(back[name], dual, rtol=1e-13)
    prices = program.multipliers(named, at)
    again = program.multipliers(program.duals(prices), at)
    for name, price in prices.items():
        np.testing.assert_allclose(again[name], price, rtol=1e-13)


def test_multipliers_are_in_units_of_objective_and_row(task):
    case = Case(task, "torques")
    program, named = case.program, case.named(case.random_duals())
    lower, upper = (np.tile(limit, program.basis.n_free) for limit in program.limits)
    at_limit = np.where(named[LIMITS.name] > 0.0, lower, upper)
    prices = program.multipliers(named, at_limit)
    for constraint in program.constraints:
        expected = named[constraint.name] / COST_SCALE
        np.testing.assert_allclose(prices[constraint.name], expected, rtol=1e-13)
    expected = named[LIMITS.name] / COST_SCALE / program.unit
    np.testing.assert_allclose(prices[LIMITS.name], expected, rtol=1e-13)


def test_a_limit_that_is_not_reached_has_no_multiplier(task):
    case = Case(task, "torques")
    program, named = case.program, case.named(case.random_duals())
    lower, upper = (np.tile(limit, program.basis.n_free) for limit in program.limits)
    prices = program.multipliers(named, (lower + upper) / 2)[LIMITS.name]
    np.testing.assert_array_equal(prices[upper - lower > 1e-3], 0.0)
