"""Every constraint of the built program, and the cost, against central differences."""

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from walks import BACKPACK, central_difference, near_walk, scenario

from human_gait.problem.drake import tell_sparsity
from human_gait.problem.program import build_program
from human_gait.problem.units import COST_SCALE

SCENARIOS = {
    "normal": scenario(step_length=0.7),
    "female with a backpack": scenario(subject={"sex": "female"}, load=BACKPACK),
    "six control points": scenario(control_points=6),
    "nine control points": scenario(control_points=9, dynamics_per_interval=2),
    "all torques paid, none weighted": scenario(
        control_points=6, objective={"passive_torques": "none", "weighting": "none"}
    ),
    "the paper's five control points": scenario(control_points=5, periodicity="velocity"),
    "a backpack as a force": scenario(control_points=6, load=BACKPACK | {"model": "force"}),
    "human": scenario(control_points=6, objective={"formulation": "human"}),
    "uneven grid and phases": scenario(
        control_points=8, intervals=13, phases={"double_support": 0.21, "heel_off": 0.7}
    ),
}
ALL_ROWS = {"posture.limbs": "apart", "posture.swing_knee": "bent"}
SCENARIOS = {name: task.replace(ALL_ROWS) for name, task in SCENARIOS.items()}


def with_all_rows(task):
    return build_program(task).with_friction().with_strength()


CONSTRAINTS = with_all_rows(SCENARIOS["normal"]).constraints
NAMES = [constraint.name for constraint in CONSTRAINTS]
CURVED = [constraint.name for constraint in CONSTRAINTS if not constraint.linear]
TOLERANCE = 1e-6  # of the largest slope: rounding leaves about 1e-10 of the values over 1e-6


class Problem:
    """A program, a point near a walk and directions that move every control point."""

    def __init__(self, task):
        self.program = with_all_rows(task)
        self.free, self.unit = near_walk(self.program), self.program.unit
        self.variables = self.free / self.unit
        self.directions = self._directions()

    def _directions(self):
        n = len(self.free)
        if self.program.basis.n_free == 3:
            return np.eye(n)
        dense = np.random.default_rng(1).normal(size=(n, 6))
        single = np.eye(n)[:, np.random.default_rng(2).choice(n, 60, replace=False)]
        return np.hstack([dense, single])

    def by_name(self, name):
        return next(c for c in self.program.constraints if c.name == name)

    def all_rows(self, free):
        """All residuals and the cost, one after the other."""
        rows = [self.program.rows(c, free).value for c in self.program.constraints]
        once = [(term, 1.0) for term in self.program.terms]
        return np.concatenate([*rows, [self.program.functions.value(free, once)]])


@pytest.fixture(params=SCENARIOS.values(), ids=SCENARIOS, scope="module")
def problem(request):
    return Problem(request.param)


@pytest.fixture(scope="module")
def slopes(problem):
    """Central differences of every constraint by name, and of the cost."""
    found = central_difference(problem.all_rows, problem.free, problem.directions)
    ends = np.cumsum([len(c.lower) for c in problem.program.constraints])
    names = [*(c.name for c in problem.program.constraints), "cost"]
    return dict(zip(names, np.split(found, ends), strict=True))


@pytest.mark.parametrize("name", NAMES)
def test_gradients_of_constraints(problem, slopes, name):
    value, jacobian = problem.program.residual(problem.by_name(name), problem.free)
    assert jacobian.shape == (len(value), len(problem.free))
    assert worst(jacobian @ problem.directions, slopes[name]) < TOLERANCE


def test_gradient_of_the_cost(problem, slopes):
    _, gradient = problem.program.cost(problem.free)
    assert worst(gradient @ problem.directions, slopes["cost"][0]) < TOLERANCE


def test_every_constraint_is_held_against_differences(slopes):
    assert set(slopes) == {*NAMES, "cost"}


@pytest.mark.parametrize("name", NAMES)
def test_the_sparsity_pattern_covers_the_jacobian(problem, name):
    constraint = problem.by_name(name)
    pattern = entries(problem, constraint)
    for seed in range(3):
        free = near_walk(problem.program, seed)
        _, jacobian = problem.program.residual(constraint, free)
        assert np.all(pattern | (jacobian == 0.0))


@pytest.mark.parametrize("name", ["contact position", "soft impact", "arm-leg coupling"])
def test_the_sparsity_pattern_is_sparse(problem, name):
    """A foot hangs on 13 of 55 DOF, an arm-leg product on 2: most entries are empty."""
    pattern = entries(problem, problem.by_name(name))
    assert pattern.mean() < 0.5


def test_drakes_solvers_get_the_pattern(problem):
    tell_sparsity(problem.program.torques.prog)
    for constraint, binding in bindings(problem):
        if not constraint.linear:
            rows, columns = np.nonzero(entries(problem, constraint))
            given = binding.evaluator().gradient_sparsity_pattern()
            assert given == list(zip(rows, columns, strict=True))


def test_drake_evaluates_values_and_gradients(problem):
    for constraint, binding in bindings(problem):
        x = InitializeAutoDiff(problem.variables)
        found = binding.evaluator().Eval(x)
        value, jacobian = problem.program.residual(constraint, problem.free)
        if constraint.linear:
            value = jacobian @ problem.free
        np.testing.assert_allclose(ExtractValue(found).ravel(), value, atol=1e-12)
        np.testing.assert_allclose(ExtractGradient(found), jacobian * problem.unit, atol=1e-12)
        plain = problem.program.torques.prog.EvalBinding(binding, problem.variables)
        np.testing.assert_allclose(plain, value, atol=1e-12)


def test_drake_evaluates_the_scaled_cost(problem):
    """The terms one by one."""
    prog, x = problem.program.torques.prog, InitializeAutoDiff(problem.variables)
    cost, gradient = problem.program.cost(problem.free)
    found = [binding.evaluator().Eval(x) for binding in prog.generic_costs()]
    value = sum(ExtractValue(one).item() for one in found)
    assert value == pytest.approx(COST_SCALE * cost, rel=1e-13)
    expected = COST_SCALE * gradient * problem.unit
    slope = sum(ExtractGradient(one)[0] for one in found)
    np.testing.assert_allclose(slope, expected, rtol=1e-12, atol=1e-13 * np.abs(expected).max())
    plain = sum(prog.EvalBinding(one, problem.variables).item() for one in prog.generic_costs())
    assert plain == pytest.approx(COST_SCALE * cost, rel=1e-13)


@pytest.mark.parametrize("n_seeds", [1, 3])
def test_drake_may_differentiate_along_any_seed(problem, n_seeds):
    """The chain rule d/ds = J dx/ds, for any number of seeds."""
    seed = np.random.default_rng(4).normal(size=(len(problem.free), n_seeds))
    x = InitializeAutoDiff(problem.variables, seed)
    moved = problem.unit[:, None] * seed
    for constraint, binding in bindings(problem):
        _, jacobian = problem.program.residual(constraint, problem.free)
        found = ExtractGradient(binding.evaluator().Eval(x))
        scale = max(np.abs(jacobian).max(), 1.0)
        np.testing.assert_allclose(found, jacobian @ moved, atol=1e-11 * scale)
    expected = COST_SCALE * problem.program.cost(problem.free)[1] @ moved
    costs = problem.program.torques.prog.generic_costs()
    found = sum(ExtractGradient(cost.evaluator().Eval(x))[0] for cost in costs)
    np.testing.assert_allclose(found, expected, rtol=1e-11)


@pytest.mark.parametrize("name", [*CURVED, "cost", "all"])
def test_second_derivatives(problem, name):
    """Of each constraint with random multipliers, of the cost, and of all together."""
    program, rng = problem.program, np.random.default_rng(5)
    curved = [c for c in program.constraints if not c.linear]
    on = [c.name for c in curved if name in (c.name, "all")]
    multipliers = [rng.normal(size=len(c.lower)) * (c.name in on) for c in curved]
    cost_factor = float(name in ("cost", "all"))

    def gradient(free):
        parts = zip(curved, multipliers, strict=True)
        leans = [m @ program.residual(c, free)[1] for c, m in parts if c.name in on]
        return cost_factor * program.cost(free)[1] + sum(leans)

    terms = [(term, cost_factor) for term in program.terms]
    rows = [(c, y, 0.0 * y) for c, y in zip(curved, multipliers, strict=True)]
    second = program.functions.hessian(problem.free, terms, rows).dense()
    np.testing.assert_allclose(second, second.T, atol=1e-13 * np.abs(second).max())
    along = np.random.default_rng(6).normal(size=(len(problem.free), 3))
    slopes = central_difference(gradient, problem.free, along)
    assert worst(second @ along, slopes) < 1e-5


def test_second_derivatives_by_rows_are_products_of_their_gradients(problem):
    """J^T diag(s) J of each constraint, the springs s of either sign."""
    program, rng = problem.program, np.random.default_rng(7)
    for constraint in program.constraints:
        _, J = program.residual(constraint, problem.free)
        springs = rng.normal(size=len(J))
        rows = [(constraint, 0.0 * springs, springs)]
        found = program.functions.hessian(problem.free, [], rows).dense()
        expected = J.T @ (springs[:, None] * J)
        assert np.abs(found - expected).max() < 1e-11 * np.abs(expected).max(), constraint.name


def test_no_variable_is_much_stiffer_than_another(problem):
    """Units tame the slopes of the cost, which differ by a factor of thousands between joints."""
    _, gradient = problem.program.cost(problem.free)
    by_dof = np.abs(gradient).reshape(-1, 55).max(axis=0)
    in_units = np.abs(gradient * problem.unit).reshape(-1, 55).max(axis=0)
    assert in_units.max() / np.median(in_units) < 0.5 * by_dof.max() / np.median(by_dof)


def entries(problem, constraint):
    """True where the Jacobian of a constraint can differ from zero."""
    found = np.zeros((len(constraint.lower), len(problem.free)), dtype=bool)
    found[problem.program.functions.transcription.entries(constraint)] = True
    return found


def bindings(problem):
    """Our constraints with those of Drake, in order."""
    prog, constraints = problem.program.torques.prog, problem.program.constraints
    linear, generic = (iter(b) for b in (prog.linear_constraints(), prog.generic_constraints()))
    return [(c, next(linear) if c.linear else next(generic)) for c in constraints]


def worst(found, slopes):
    return np.abs(found - slopes).max() / np.abs(slopes).max()
