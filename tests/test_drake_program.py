"""What is added by Drake's own calls: every solver solves it to the same optimum, or refuses it.

On a small problem, and on the program of a gait.
"""

import gc
import weakref

import numpy as np
import pytest
from pydrake.solvers import MathematicalProgram, SolutionResult, SolverOptions
from walks import scenario

from human_gait.body.skeleton import index
from human_gait.exceptions import UnsupportedProgram
from human_gait.newton.barrier import COLD
from human_gait.newton.interior_point import InteriorPoint, minimise
from human_gait.problem.drake import offer_hessian, offered
from human_gait.problem.program import build_program
from human_gait.problem.units import COST_SCALE
from human_gait.solving import newton_solver
from human_gait.solving.drake_solvers import (
    OPTIONS,
    SOLVERS,
    duals_of,
    engine,
    refuse,
    solve_program,
)
from human_gait.solving.mathematical_program import ProgramFunctions
from human_gait.solving.newton_solver import NewtonSolver
from human_gait.solving.solver import run_stage, solve

START = np.array([0.3, 0.2, 0.6])
TIGHT = {
    "newton": {"stationary": 1e-8, "complementary": 1e-9},
    "snopt": {"Major optimality tolerance": 1e-8},
    "ipopt": {"tol": 1e-9},
}


def banana(x):
    return 10.0 * (x[1] - x[0] ** 2) ** 2 + (1.0 - x[0]) ** 2 + 2.0 * (x[2] - x[0]) ** 2


def base():
    """A curved valley in three variables."""
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(3, "x")
    prog.AddCost(banana, x)
    return prog, x


COSTS = {
    "generic": lambda p, x: p.AddCost(lambda v: np.exp(v[0]) * v[1], x[:2]),
    "generic, of variables in another order": lambda p, x: p.AddCost(
        lambda v: v[0] ** 2 + 3.0 * v[1] ** 3, x[[2, 0]]
    ),
    "symbolic": lambda p, x: p.AddCost(x[0] ** 4 + x[1] ** 2 * x[2] ** 2),
    "linear": lambda p, x: p.AddLinearCost(3.0 * x[0] + x[2] + 2.0),
    "quadratic": lambda p, x: p.AddQuadraticCost(4.0 * np.eye(2), np.array([1.0, -2.0]), x[1:]),
    "quadratic error": lambda p, x: p.AddQuadraticErrorCost(np.eye(3), np.ones(3) / 2, x),
    "generic, of one variable twice": lambda p, x: p.AddCost(
        lambda v: v[0] * v[1] + v[1] ** 3 + v[2], np.array([x[0], x[0], x[2]])
    ),
    "one evaluator on two pairs of variables": lambda p, x: p.AddCost(
        p.AddCost(lambda v: np.exp(v[0]) + v[0] * v[1], x[:2]).evaluator(), x[1:]
    ),
    "norm": lambda p, x: p.AddL2NormCost(np.eye(3), np.array([3.0, 0.0, 0.0]), x),
}
CONSTRAINTS = {
    "bounding box": lambda p, x: p.AddBoundingBoxConstraint(-0.4, 0.6, x),
    "two bounding boxes": lambda p, x: [
        p.AddBoundingBoxConstraint(-1.0, 0.7, x[:2]),
        p.AddBoundingBoxConstraint(-2.0, 0.8, x[0]),
    ],
    "fixed variable": lambda p, x: p.AddBoundingBoxConstraint(0.5, 0.5, x[1]),
    "linear": lambda p, x: p.AddLinearConstraint(x[0] + 2.0 * x[1] - x[2] <= 0.5),
    "linear equality": lambda p, x: p.AddLinearEqualityConstraint(x[0] + x[1] + x[2] == 1.0),
    "quadratic": lambda p, x: p.AddQuadraticConstraint(
        2.0 * np.eye(3), np.ones(3), -np.inf, 1.5, x
    ),
    "generic": lambda p, x: p.AddConstraint(
        lambda v: [v[0] * v[1] * v[2], v[0] + v[1] ** 2], [0.1, -1.0], [0.1, 0.9], x
    ),
    "symbolic": lambda p, x: p.AddConstraint(x[0] ** 3 + x[1] <= 0.5),
    "generic, of one variable twice": lambda p, x: p.AddConstraint(
        lambda v: [v[0] * v[1] + v[2]], [-np.inf], [1.2], np.array([x[0], x[0], x[1]])
    ),
    "one evaluator on two pairs of variables": lambda p, x: p.AddConstraint(
        p.AddConstraint(lambda v: [v[0] ** 2 + v[1]], [-1.0], [1.1], x[:2]).evaluator(), x[1:]
    ),
    "cone": lambda p, x: p.AddLorentzConeConstraint(
        np.vstack([np.zeros(3), np.eye(3)]), np.array([0.8, 0.0, 0.0, 0.0]), x
    ),
    "rotated cone": lambda p, x: p.AddRotatedLorentzConeConstraint(
        np.vstack([np.eye(3)[:1], np.zeros((1, 3)), np.eye(3)[1:]]),
        np.array([0.0, 0.5, 0.1, 0.1]),
        x,
    ),
}
KINDS = {f"{what}: {name}": add for what, table in (("cost", COSTS), ("constraint", CONSTRAINTS))
         for name, add in table.items()}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_every_solver_comes_to_the_same_optimum(kind):
    found = {}
    for solver in SOLVERS:
        prog, x = base()
        KINDS[kind](prog, x)
        result = solve_program(prog, solver, START, TIGHT[solver])
        assert result.is_success(), solver
        assert prog.CheckSatisfied(prog.GetAllConstraints(), result.get_x_val(), 1e-5)
        found[solver] = result.get_x_val(), result.get_optimal_cost()
    plain = solve_program(base()[0], "newton", START, TIGHT["newton"]).get_x_val()
    for x, cost in found.values():
        np.testing.assert_allclose(x, found["snopt"][0], atol=2e-4)
        assert cost == pytest.approx(found["snopt"][1], abs=1e-6)
        assert np.abs(x - plain).max() > 1e-2  # what was added matters


@pytest.mark.parametrize("kind", CONSTRAINTS)
def test_duals_are_those_of_drakes_solvers(kind):
    duals = {}
    for solver in ("newton", "ipopt"):
        prog, x = base()
        CONSTRAINTS[kind](prog, x)
        result = solve_program(prog, solver, START, TIGHT[solver])
        duals[solver] = [result.GetDualSolution(b) for b in prog.GetAllConstraints()]
    for ours, theirs in zip(*duals.values(), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-3)


def complementarity(prog, x):
    binding = prog.AddLinearComplementarityConstraint(np.eye(2), np.zeros(2), x[:2])
    binding.evaluator().set_description("either or")


def definite(prog, _):
    matrix = prog.NewSymmetricContinuousVariables(2, "S")
    prog.AddPositiveSemidefiniteConstraint(matrix)


REFUSED = {
    "complementarity": (complementarity, "newton", "'either or'", "snopt can"),
    "complementarity by ipopt": (complementarity, "ipopt", "LinearComplementarity", "snopt can"),
    "semidefinite": (definite, "newton", "positive semidefinite constraint on S", "no solver here"),
    "whole numbers": (
        lambda p, _: p.NewBinaryVariables(2, "b"),
        "newton",
        "binary variable",
        "no solver here",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_cannot_be_honoured_is_refused_by_name_in_one_line(kind):
    add, solver, what, who = REFUSED[kind]
    prog, x = base()
    add(prog, x)
    with pytest.raises(UnsupportedProgram) as raised:
        solve_program(prog, solver, np.zeros(prog.num_vars()))
    assert what in str(raised.value)
    assert who in str(raised.value)
    assert "\n" not in str(raised.value)


def test_the_solver_itself_refuses_too():
    prog, x = base()
    complementarity(prog, x)
    assert not NewtonSolver().AreProgramAttributesSatisfied(prog)
    assert "either or" in NewtonSolver().ExplainUnsatisfiedProgramAttributes(prog)
    with pytest.raises(UnsupportedProgram, match="either or"):
        NewtonSolver().Solve(prog)
    assert NewtonSolver().AreProgramAttributesSatisfied(base()[0])
    assert NewtonSolver().ExplainUnsatisfiedProgramAttributes(base()[0]) == ""


def test_a_result_is_read_like_drakes():
    prog, x = base()
    box = prog.AddBoundingBoxConstraint(-1.0, 0.5, x[:1])
    result = NewtonSolver().Solve(prog, START)
    assert result.is_success()
    assert result.get_solution_result() == SolutionResult.kSolutionFound
    assert result.get_solver_id().name() == "newton"
    assert result.get_solver_details().iterations > 0
    np.testing.assert_array_equal(result.GetSolution(), result.get_x_val())
    np.testing.assert_array_equal(result.GetSolution(x[[2, 0]]), result.get_x_val()[[2, 0]])
    assert result.GetSolution(x[1]) == result.get_x_val()[1]
    assert result.get_optimal_cost() == pytest.approx(banana(result.get_x_val()))
    assert result.GetDualSolution(box) < 0.0  # an upper bound holds it: Drake's sign
    with pytest.raises(KeyError):
        result.GetSolution(MathematicalProgram().NewContinuousVariables(1))
    other = MathematicalProgram()
    with pytest.raises(KeyError):
        result.GetDualSolution(other.AddLinearConstraint(other.NewContinuousVariables(1)[0] <= 1))


def test_the_guess_of_the_program_is_taken_where_none_is_given():
    prog, x = base()
    prog.SetInitialGuess(x, [1.0, 1.0, 1.0])  # the optimum
    assert NewtonSolver().Solve(prog).get_solver_details().iterations <= 1


def test_options_of_the_call_go_before_those_of_the_program():
    prog, _ = base()
    prog.SetSolverOption(NewtonSolver.id(), "most_iterations", 1)
    assert NewtonSolver().Solve(prog, START).get_solver_details().iterations == 1
    assert NewtonSolver().Solve(prog, START).get_solution_result() == SolutionResult.kIterationLimit
    options = SolverOptions()
    options.SetOption(NewtonSolver.id(), "most_iterations", 100)
    assert NewtonSolver().Solve(prog, START, options).is_success()


@pytest.mark.parametrize("first", [0.1, 3e-3])
def test_a_cold_start_begins_with_the_barrier_that_is_asked_for(monkeypatch, first):
    seen = barriers_of_steps(monkeypatch)
    prog, _ = base()
    prog.SetSolverOption(NewtonSolver.id(), "first_barrier", first)
    assert not NewtonSolver().Solve(prog, START).is_success()
    assert set(seen) == {first}


@pytest.mark.parametrize(
    ("formulation", "asked", "first"),
    [("effort", {}, 0.1), ("human", {}, 3e-3), ("human", {"first_barrier": 0.02}, 0.02)],
)
def test_the_first_barrier_is_that_of_the_formulation(monkeypatch, formulation, asked, first):
    seen = barriers_of_steps(monkeypatch)
    program = build_program(scenario(control_points=6, objective={"formulation": formulation}))
    for name, value in asked.items():
        program.torques.prog.SetSolverOption(NewtonSolver.id(), name, value)
    assert not solve(program).converged
    assert set(seen) == {first}


def test_a_cold_start_is_put_and_led_as_is_asked_for(monkeypatch):
    """Every option of it reaches the schedule of the method."""
    seen = []
    monkeypatch.setattr(
        newton_solver,
        "minimise",
        lambda problem, start, goal, *_, cold: seen.append(cold) or minimise(problem, start, goal),
    )
    prog, _ = base()
    NewtonSolver().Solve(prog, START)
    asked = {"first_barrier": 0.02, "patience": 30.0, "start_push": 0.2, "start_share": 0.3}
    for name, value in asked.items():
        prog.SetSolverOption(NewtonSolver.id(), name, value)
    NewtonSolver().Solve(prog, START)
    assert seen == [COLD, COLD._replace(first=0.02, patience=30.0, push=0.2, share=0.3)]


def barriers_of_steps(monkeypatch):
    """The barriers of the steps that are asked for from now on; none is found."""
    seen = []
    monkeypatch.setattr(InteriorPoint, "step", lambda *given: seen.append(given[2]))
    return seen


def test_second_derivatives_that_are_offered_are_taken():
    """As many steps as with differences, and the function is asked for far fewer gradients."""
    asked = []

    def counted(x):
        asked.append(x)
        return banana(x)

    def hessian(x, multipliers):
        diagonal = [120.0 * x[0] ** 2 - 40.0 * x[1] + 2.0, 20.0, 0.0]
        H = np.diag(diagonal)
        H[0, 1] = H[1, 0] = -40.0 * x[0]
        H[np.ix_([0, 2], [0, 2])] += 4.0 * np.array([[1.0, -1.0], [-1.0, 1.0]])
        return multipliers[0] * H

    spent = []
    for given in (True, False):
        prog = MathematicalProgram()
        x = prog.NewContinuousVariables(3)
        cost = prog.AddCost(counted, x)
        if given:
            offer_hessian(prog, cost, hessian)
        asked.clear()
        result = NewtonSolver().Solve(prog, START)
        np.testing.assert_allclose(result.get_x_val(), 1.0, atol=1e-4)
        spent.append((result.get_solver_details().iterations, len(asked)))
    assert abs(spent[0][0] - spent[1][0]) <= 1
    assert spent[0][1] < spent[1][1] / 2


def test_a_warm_start_takes_fewer_steps():
    prog, x = base()
    limit = prog.AddConstraint(lambda v: [v[0] * v[1] + v[2]], [-np.inf], [0.7], x)
    limit.evaluator().set_description("limit")
    cold = NewtonSolver().Solve(prog, START)
    warm = NewtonSolver(duals_of(prog, cold)).Solve(prog, cold.get_x_val())
    assert warm.is_success()
    assert warm.get_solver_details().iterations < cold.get_solver_details().iterations


# on the program of a gait


@pytest.fixture(scope="module")
def task():
    return scenario(control_points=6)


def added(program, kind):
    """One of each kind on the hips, which hardly move in a walk without it."""
    prog, P = program.torques.prog, program.variables.reshape(-1, 55)
    hip = index("hip_flexion_r")
    hips, unit = P[:, hip], program.unit.reshape(-1, 55)[:, hip]
    return {
        "generic cost": lambda: prog.AddCost(lambda x: 50.0 * np.sum((unit * x) ** 2), hips),
        "quadratic cost": lambda: prog.AddQuadraticCost(np.diag(unit**2), 0.0 * unit, hips),
        "linear cost": lambda: prog.AddLinearCost(unit, 0.0, hips),
        "linear constraint": lambda: prog.AddLinearConstraint(unit[None], [0.1], [np.inf], hips),
        "bounding box": lambda: prog.AddBoundingBoxConstraint(-0.1 / unit[0], 1.0, hips[:1]),
        "generic constraint": lambda: prog.AddConstraint(
            lambda x: [np.sum((unit * x) ** 2)], [0.0], [0.05], hips
        ),
    }[kind]()


KINDS_ON_A_GAIT = (
    *("generic cost", "quadratic cost", "linear cost"),
    *("linear constraint", "bounding box", "generic constraint"),
)


@pytest.mark.parametrize("kind", KINDS_ON_A_GAIT)
def test_newton_reads_what_is_added_to_the_program_of_a_gait(task, kind):
    """The Lagrangian knows it: another cost, another row, or a narrower bound."""
    program = build_program(task)
    before = ProgramFunctions(program.torques.prog).problem()
    added(program, kind)
    after = ProgramFunctions(program.torques.prog).problem()
    x = program.guess() / program.unit + 0.1
    changed = (
        before.cost(x) != after.cost(x),
        len(before.row_lower) != len(after.row_lower),
        not np.array_equal(before.lower, after.lower),
    )
    assert changed == ("cost" in kind, "constraint" in kind, "box" in kind)


def test_what_was_added_is_judged_too(task):
    """A row that cannot be kept makes no walk of it, in the words of its description."""
    program = build_program(task)
    prog, x = program.torques.prog, program.variables
    rows = prog.AddConstraint(lambda v: [v[0] ** 2], [-2.0], [-1.0], x[:1])
    rows.evaluator().set_description("a square below zero")
    prog.AddCost(lambda v: 1.0 + 0.0 * v[0], x[:1])
    few = OPTIONS["newton"] | {"most_iterations": 2}
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(OPTIONS, "newton", few)
        found = solve(program)
    assert not found.converged
    plain = program.cost(found.gait.free)[0]
    by_name = {v.name: v.value for v in found.violations}
    assert by_name["a square below zero"] >= 1.0
    assert found.cost == pytest.approx(plain + 1.0 / COST_SCALE)


def test_what_was_added_stays_on_a_floor_of_friction(task):
    program = build_program(task)
    added(program, "generic cost")
    added(program, "generic constraint")
    slippery = program.with_friction()
    assert len(slippery.torques.added()) == 1
    costs = slippery.torques.prog.GetAllCosts()
    assert len(costs) == len(program.terms) + 1
    assert all(offered(b.evaluator()) for b in slippery.torques.prog.generic_constraints()[-2:])
    assert len(slippery.torques.prog.generic_constraints()) > len(
        program.torques.prog.generic_constraints()
    )


def test_an_unsupported_addition_is_refused_before_solving(task):
    program = build_program(task)
    program.torques.prog.AddLinearComplementarityConstraint(
        np.eye(2), np.zeros(2), program.variables[:2]
    ).evaluator().set_description("contact")
    with pytest.raises(UnsupportedProgram, match=r"'contact'.*snopt can"):
        solve(program)
    refuse(program.torques.prog, "snopt")
    assert program.functions.evaluations == 0


def test_variables_that_are_added_are_solved_for(task):
    """A bound that is a variable of its own, as low as it can be."""
    program = build_program(task)
    prog, x = program.torques.prog, program.variables
    (most,) = prog.NewContinuousVariables(1, "most")
    prog.AddLinearConstraint(most >= x[index("hip_flexion_r")])
    prog.AddLinearCost(most)
    prog.SetInitialGuess(most, 0.7)
    assert program.torques.point(np.zeros(len(x)))[-1] == 0.7
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(OPTIONS, "newton", {"most_iterations": 0})
        end = run_stage(program, program.torques, "newton", program.guess())
    assert end.x[-1] == pytest.approx(0.7)
    assert len(end.free) == len(x)


def test_a_constraint_of_the_walk_that_was_taken_out_is_refused_by_name(task):
    program = build_program(task)
    prog = program.torques.prog
    prog.RemoveConstraint(prog.generic_constraints()[0])
    with pytest.raises(UnsupportedProgram, match="lacks '"):
        solve(program)


def test_a_cost_that_takes_the_place_of_ours_is_the_cost(task):
    program = build_program(task)
    prog = program.torques.prog
    prog.RemoveCost(prog.GetAllCosts()[0])
    prog.AddCost(lambda v: 4.0 + 0.0 * v[0], program.variables[:1])
    assert program.total_cost(program.guess()) == pytest.approx(4.0 / COST_SCALE)


def test_names_of_ones_own_do_not_reach_the_multipliers_of_the_walk(task):
    """Whatever a constraint that is added is called."""
    program = build_program(task)
    prog, x = program.torques.prog, program.variables
    prog.AddBoundingBoxConstraint(-9.0, 9.0, x[:2]).evaluator().set_description("joint limit")
    rows = prog.AddLinearConstraint(x[0] + x[1] <= 9.0)
    rows.evaluator().set_description("ZMP stability")
    result = NewtonSolver().Solve(prog, program.guess() / program.unit, few())
    found = duals_of(prog, Content(result), program.torques.own)
    assert len(found["joint limit"]) == len(x)
    assert len(found["ZMP stability"]) > 1


def test_an_end_has_the_duals_of_the_walks_own_constraints_alone(task):
    """With nothing but limits it is solved in a moment."""
    program = build_program(task)
    stage = program.stage([])
    n = len(stage.variables)
    stage.prog.AddQuadraticCost(np.eye(n), np.zeros(n), stage.variables)
    box = stage.prog.AddBoundingBoxConstraint(-9.0, 9.0, stage.variables[:2])
    box.evaluator().set_description("joint limit")
    end = run_stage(program, stage, "newton", program.guess())
    assert end.solved
    assert {name: len(dual) for name, dual in end.duals.items()} == {"joint limit": n}


def test_without_additions_the_total_cost_is_the_objective(task):
    program = build_program(task)
    free = program.guess()
    assert program.total_cost(free) == program.cost(free)[0] > 0.0


def few():
    """Options of a solve of a few steps."""
    options = SolverOptions()
    options.SetOption(NewtonSolver.id(), "most_iterations", 1)
    return options


class Content:
    """A result that is content with where it is."""

    def __init__(self, result):
        self.GetDualSolution = result.GetDualSolution

    def is_success(self):
        return True


def test_options_in_the_program_count_for_drakes_solvers_too():
    for solver, name in (("snopt", "Major iterations limit"), ("ipopt", "max_iter")):
        prog, _ = base()
        prog.SetSolverOption(engine(solver).solver_id(), name, 1)
        assert not solve_program(prog, solver, START).is_success()


def test_callbacks_are_called_on_the_way():
    prog, x = base()
    seen = []
    prog.AddVisualizationCallback(lambda v: seen.append(np.array(v)), x[[2, 0]])
    result = NewtonSolver().Solve(prog, START)
    assert len(seen) == result.get_solver_details().iterations + 1
    np.testing.assert_allclose(seen[0], START[[2, 0]])


def test_contradictory_bounds_are_no_error(task):
    """A solver may end at what is no number: then the best point counts."""
    program = build_program(task)
    program.torques.prog.AddBoundingBoxConstraint(1.0, 0.0, program.variables[:1])
    for solver in ("newton", "ipopt"):
        found = solve(program, solver, start=program.guess())
        assert not found.converged
        assert np.all(np.isfinite(found.gait.control_points))


def test_clones_keep_exact_second_derivatives(task):
    program = build_program(task)
    clone = program.torques.prog.Clone()
    for binding in clone.generic_constraints():
        assert offered(binding.evaluator()) is not None


def test_a_guess_of_another_size_is_refused():
    with pytest.raises(ValueError, match="2 numbers for 3 variables"):
        NewtonSolver().Solve(base()[0], np.zeros(2))


def test_expressions_have_values_too():
    prog, x = base()
    result = NewtonSolver().Solve(prog, START)
    expected = result.GetSolution(x[0]) + 2.0 * result.GetSolution(x[1])
    assert result.GetSolution(x[0] + 2.0 * x[1]) == pytest.approx(expected)


def test_a_program_without_variables_is_solved():
    assert NewtonSolver().Solve(MathematicalProgram()).is_success()


def test_a_hessian_is_offered_for_what_is_in_the_program():
    prog, _ = base()
    other, x = base()
    with pytest.raises(ValueError, match="no such cost"):
        offer_hessian(prog, other.AddCost(banana, x), lambda *_: np.eye(3))


def test_programs_leave_no_trace():
    """No cycle through C++, not even one for the collector of cycles to find."""
    gone = []
    gc.collect()
    gc.disable()
    try:
        for _ in range(3):
            program = build_program(scenario(control_points=6))
            prog = program.torques.prog
            prog.EvalBindings(prog.GetAllCosts(), program.guess() / program.unit)
            gone += [weakref.ref(program), weakref.ref(program.functions), weakref.ref(prog)]
        del program, prog
        assert [ref() for ref in gone] == [None] * len(gone)
    finally:
        gc.enable()


def test_a_mathematical_program_outlives_what_made_it():
    program = build_program(scenario(control_points=6))
    prog, x, expected = program.torques.prog, program.guess() / program.unit, program.cost
    value = expected(program.guess())[0]
    del program, expected
    assert prog.EvalBindings(prog.GetAllCosts(), x).item() == pytest.approx(COST_SCALE * value)
