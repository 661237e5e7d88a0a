"""The quick parts: options, interruption, what is told and kept. `test_gait_solve` solves."""

import signal
import threading

import numpy as np
import pytest
from pydrake.solvers import MathematicalProgram
from small_problems import VALLEY_END, VALLEY_START, corner, cube, numbers, run, valley
from walks import STILL, near_walk, scenario

from human_gait.problem.constraints import LIMITS
from human_gait.problem.program import build_program
from human_gait.solving import solver as room
from human_gait.solving.drake_solvers import OPTIONS, SOLVERS, solve_program, status_of
from human_gait.solving.solver import solve
from human_gait.solving.watch import FEASIBLE

LIMIT = {"newton": "most_iterations", "snopt": "Major iterations limit", "ipopt": "max_iter"}
OPTIMALITY = {"newton": "stationary", "snopt": "Major optimality tolerance", "ipopt": "tol"}
FEASIBILITY = {
    "newton": "feasible",
    "snopt": "Major feasibility tolerance",
    "ipopt": "constr_viol_tol",
}
LIMIT_REACHED = {
    "newton": "iteration limit reached",
    "snopt": "32",
    "ipopt": "Max iteration exceeded",
}


@pytest.fixture(params=SOLVERS)
def solver(request):
    return request.param


def small_problem():
    return build_program(scenario(control_points=6, limits=STILL))


@pytest.fixture
def program():
    return small_problem()


@pytest.fixture
def short(monkeypatch):
    """Stop each stage after a few iterations."""

    def limit(iterations):
        for name in SOLVERS:
            change = {LIMIT[name]: iterations}
            for options in (OPTIONS, room.POSTURE_OPTIONS):
                monkeypatch.setitem(options, name, options[name] | change)

    return limit


def test_our_options_are_accepted(solver):
    """A solver that is content has understood them: see the next test."""
    for changes in ({}, room.POSTURE_OPTIONS[solver]):
        x, solved, _ = run(valley(), solver, VALLEY_START, changes)
        assert solved
        np.testing.assert_allclose(x, VALLEY_END, atol=1e-2)


@pytest.mark.parametrize("solver", ["newton", "ipopt"])
def test_an_option_that_does_not_exist_is_refused(solver):
    with pytest.raises((RuntimeError, ValueError), match="no_such_option"):
        run(valley(), solver, np.zeros(2), {"no_such_option": 3})


def test_our_options_of_snopt_are_in_its_manual():
    """SNOPT passes over a name that it does not know."""
    run(valley(), "snopt", VALLEY_START, {"no such option": 3})
    ours = {name for table in (OPTIONS, room.POSTURE_OPTIONS) for name in table["snopt"]}
    assert ours <= MANUAL


MANUAL = {  # Gill, Murray, Saunders, Wong: User's Guide for SNOPT 7, optional parameters
    "Check frequency",
    "Crash option",
    "Elastic weight",
    "Expand frequency",
    "Factorization frequency",
    "Function precision",
    "Hessian flush",
    "Hessian frequency",
    "Hessian updates",
    "Infinite bound",
    "Iterations limit",
    "Linesearch tolerance",
    "Major feasibility tolerance",
    "Major iterations limit",
    "Major optimality tolerance",
    "Major step limit",
    "Minor feasibility tolerance",
    "Minor iterations limit",
    "New superbasics limit",
    "Penalty parameter",
    "Proximal point method",
    "Reduced Hessian dimension",
    "Scale option",
    "Scale tolerance",
    "Superbasics limit",
    "Time limit",
    "Unbounded objective",
    "Unbounded step size",
    "Verify level",
    "Violation limit",
}


def test_the_iteration_limit_takes_effect(solver):
    _, solved, status = run(valley(), solver, VALLEY_START, {LIMIT[solver]: 1})
    assert not solved
    assert LIMIT_REACHED[solver] in status


def test_the_optimality_tolerance_takes_effect(solver):
    evaluations = []
    for tolerance in (1e-6, 10.0):
        points = []

        def height(x, points=points):
            points.append(x)
            return valley().cost(x)

        changes = {OPTIMALITY[solver]: tolerance}
        changes |= {"complementary": tolerance} if solver == "newton" else {}
        run(valley(cost=height), solver, VALLEY_START, changes)
        evaluations.append(len(points))
    assert evaluations[1] < evaluations[0]


@pytest.mark.parametrize(
    ("name", "value", "status"),
    [("Iterations limit", 1, "31"), ("Superbasics limit", 1, "33")],
)
def test_other_limits_of_snopt_take_effect(name, value, status):
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(4)
    prog.AddCost(lambda x: sum((x - 1.0) ** 4) + x[0] * x[1] * x[2] * x[3], x)
    prog.AddConstraint(lambda x: [x.dot(x)], [-np.inf], [9.0], x)
    prog.AddLinearConstraint(x[0] + x[1] + x[2] >= 1.0)
    result = solve_program(prog, "snopt", np.zeros(4), {name: value})
    assert not result.is_success()
    assert status_of(result)[0].startswith(status)


def test_the_feasibility_tolerance_takes_effect(solver):
    name, optimality = FEASIBILITY[solver], {OPTIMALITY[solver]: 1e-10}
    loose = {"stationary": 0.1} if solver == "newton" else {}
    ends = [
        run(cube(), solver, numbers(5.0), {name: tolerance, **others})[0].item()
        for tolerance, others in ((1e-10, optimality), (0.1, loose))
    ]
    assert abs(ends[0] - 2.0) < abs(ends[1] - 2.0)


def test_bounds_are_kept_to_the_last_digit(solver):
    """Joint limits are never exceeded, not even by the 1e-8 that some relax bounds by."""
    end, _, _ = run(corner(), solver, numbers(0.3, 0.3), {})
    assert np.all((end >= 0.0) & (end <= 0.7))
    np.testing.assert_allclose(end, [0.7, 0.0], atol=1e-2)


def test_an_unknown_solver_is_refused(program):
    with pytest.raises(ValueError, match="choose one of newton, snopt, ipopt"):
        solve(program, "simplex")


def test_a_solve_that_runs_out_of_iterations_says_so_and_keeps_what_it_has(program, solver, short):
    short(1)
    solution = solve(program, solver)
    assert not solution.converged
    assert not solution.interrupted
    assert LIMIT_REACHED[solver] in solution.status
    assert (solution.solver, solution.gait.solution["solver"]) == (solver, solver)
    assert max(violation.value for violation in solution.violations) > FEASIBLE
    assert {v.name for v in solution.violations} == {c.name for c in program.constraints}
    assert np.all(np.isfinite(solution.gait.control_points))
    assert solution.multipliers == {}
    assert solution.cost == pytest.approx(program.cost(solution.gait.free)[0])


def test_every_evaluated_point_is_told_once(program, solver, short):
    short(2)
    told = []
    solution = solve(program, solver, tell=told.append)
    assert [now.number for now in told] == list(range(1, len(told) + 1))
    assert solution.iterations == (2 if solver == "newton" else len(told))
    assert stages(told) == (["torque"] if solver == "newton" else ["posture", "torque"])
    assert np.all(np.diff([now.elapsed for now in told]) > 0.0)
    for now in told[::3]:
        assert now.cost == pytest.approx(program.cost(now.free)[0])
        assert now.worst.value == max(v.value for v in program.violations(now.free))


def stages(told):
    """The stages that were told, in order."""
    found = [now.stage for now in told]
    return [stage for i, stage in enumerate(found) if i == 0 or stage != found[i - 1]]


def test_with_weights_a_posture_path_comes_first_whatever_solver(program, solver, short):
    short(1)
    told = []
    solve(program, solver, tell=told.append, weights=(0.3, 1e-2))
    assert stages(told) == ["posture", "torque"]


def test_newton_starts_at_the_guess_of_the_program_or_at_one_that_is_given(program, short):
    """But for joints at a limit, which are moved off by a hundredth of their range."""
    short(1)
    for guess in (None, near_walk(program)):
        told = []
        solve(program, "newton", tell=told.append, guess=guess)
        expected = program.guess() if guess is None else guess
        lower, upper = (np.tile(limit, program.basis.n_free) for limit in program.limits)
        inside = np.minimum(expected - lower, upper - expected) > 0.02 * (upper - lower)
        inside &= np.minimum(expected - lower, upper - expected) > 0.02 * program.unit
        assert np.count_nonzero(inside) > 40
        np.testing.assert_allclose(told[0].free[inside], expected[inside], atol=1e-12)


def test_a_start_makes_the_posture_stage_unnecessary(program, solver, short):
    short(1)
    told = []
    solve(program, solver, start=near_walk(program), tell=told.append)
    assert {now.stage for now in told} == {"torque"}


def test_snopt_starts_where_it_is_told(program, short):
    short(1)
    told, start = [], near_walk(program)
    solve(program, "snopt", start=start, tell=told.append)
    limits = (np.tile(limit, program.basis.n_free) for limit in program.limits)
    # SNOPT first moves to the nearest point that keeps the linear constraints: the knee at 60 deg
    moved = np.abs(told[0].free - np.clip(start, *limits)) > 1e-9
    assert np.count_nonzero(moved) < 5


def test_a_start_that_was_evaluated_before_is_told_too(program, solver, short):
    """Twice from one start, the second time right after a look at it."""
    short(1)
    told = [[], []]
    for one in told:
        solve(program, solver, start=near_walk(program), tell=one.append)
        program.cost(one[0].free)
    np.testing.assert_array_equal(told[1][0].free, told[0][0].free)


def test_a_solve_tells_nothing_of_a_guess_that_it_was_not_given(program, solver, short):
    short(1)
    told = []
    solve(program, solver, tell=told.append, guess=near_walk(program), weights=(0.3, 1e-2))
    assert all(np.abs(now.free - program.guess()).max() > 1e-3 for now in told)


def test_the_same_start_leads_to_the_same_gait(solver, short):
    short(1 if solver == "snopt" else 2)  # one of its iterations is a hundred smaller ones
    ends = [solve(small_problem(), solver) for _ in range(2)]
    np.testing.assert_array_equal(ends[0].gait.control_points, ends[1].gait.control_points)
    assert ends[0].iterations == ends[1].iterations


class Interrupt:
    """Presses Ctrl-C at the n-th point told; remembers the points."""

    def __init__(self, n):
        self.n, self.told = n, []

    def __call__(self, now):
        self.told.append(now)
        if now.number == self.n:
            signal.raise_signal(signal.SIGINT)

    def best(self):
        return min(self.told, key=lambda now: (max(now.worst.value, FEASIBLE), now.cost))


@pytest.mark.parametrize("n", [1, 4])
def test_ctrl_c_returns_the_best_point_so_far(program, solver, n):
    handler, interrupt = signal.getsignal(signal.SIGINT), Interrupt(n)
    solution = solve(program, solver, tell=interrupt)
    assert solution.interrupted
    assert not solution.converged
    assert solution.status == "interrupted"
    assert len(interrupt.told) == n
    np.testing.assert_array_equal(solution.gait.free, interrupt.best().free)
    assert signal.getsignal(signal.SIGINT) is handler
    assert program.functions.observe is None


def test_ctrl_c_works_in_the_torque_stage_too(program, solver):
    interrupt = Interrupt(3)
    solution = solve(program, solver, near_walk(program), tell=interrupt)
    assert solution.interrupted
    assert {now.stage for now in interrupt.told} == {"torque"}
    np.testing.assert_array_equal(solution.gait.free, interrupt.best().free)


def test_ctrl_c_between_the_stages_keeps_the_posture(program, solver, monkeypatch, short):
    short(2)
    run, interrupt = room.run_stage, Interrupt(-1)

    def run_and_press(program, stage, *arguments):
        end = run(program, stage, *arguments)
        if stage is not program.torques:
            signal.raise_signal(signal.SIGINT)
        return end

    monkeypatch.setattr(room, "run_stage", run_and_press)
    solution = solve(program, solver, tell=interrupt, weights=room.POSTURE)
    assert solution.interrupted
    assert stages(interrupt.told) == ["posture"]
    np.testing.assert_array_equal(solution.gait.free, interrupt.best().free)


def test_ctrl_c_before_the_first_point_stops_like_any_program(program, solver, monkeypatch):
    guess = program.guess

    def press():
        signal.raise_signal(signal.SIGINT)
        return guess()

    monkeypatch.setattr(program, "guess", press)
    with pytest.raises(KeyboardInterrupt):
        solve(program, solver)
    assert program.functions.observe is None


def test_ctrl_c_in_the_posture_path_alone_stops_like_any_program(program):
    with pytest.raises(KeyboardInterrupt):
        room.posture(program, Interrupt(2))
    assert program.functions.observe is None


def test_ctrl_c_after_the_last_point_of_the_posture_path_is_not_forgotten(program, monkeypatch):
    def press(*_):
        signal.raise_signal(signal.SIGINT)
        return room.End(None, program.guess(), True, "feasible")

    monkeypatch.setattr(room, "posture_path", press)
    with pytest.raises(KeyboardInterrupt):
        room.posture(program)


def test_a_mistake_in_what_is_told_is_not_taken_for_an_interruption(program, solver):
    handler = signal.getsignal(signal.SIGINT)

    def fail(_):
        raise ZeroDivisionError("a mistake")

    with pytest.raises((ZeroDivisionError, RuntimeError), match="a mistake"):
        solve(program, solver, tell=fail)
    assert signal.getsignal(signal.SIGINT) is handler
    assert program.functions.observe is None


def test_it_solves_outside_the_main_thread(program, solver, short):
    """Signals belong to the main thread; elsewhere there is nothing to install."""
    short(1)
    solutions = []
    start = near_walk(program)
    thread = threading.Thread(target=lambda: solutions.append(solve(program, solver, start)))
    thread.start()
    thread.join()
    assert [LIMIT_REACHED[solver] in solution.status for solution in solutions] == [True]


def test_a_feasible_point_on_the_way_is_better_than_an_infeasible_end(program, monkeypatch):
    """Loosened bounds make the guess feasible; the solver then ends somewhere else."""
    for constraint in program.constraints:
        constraint.lower[:], constraint.upper[:] = -np.inf, np.inf
    program.constraints[0].lower[:] = -1.0  # no point a metre deep
    guess = program.guess()
    sunken = guess.reshape(-1, 55).copy()
    sunken[:, 2] -= 3.0

    def run(*_):
        program.instants(guess)
        return room.End(None, sunken.ravel(), True, "lost")

    monkeypatch.setattr(room, "run_stage", run)
    solution = solve(program, start=guess)
    np.testing.assert_array_equal(solution.gait.free, guess)
    assert not solution.converged


@pytest.fixture(scope="module")
def walk():
    """A coarse walk by newton, some seconds."""
    program = build_program(scenario())
    solution = solve(program)
    assert solution.converged
    return program, solution


def test_a_walk_started_warm_at_itself_is_found_again_soon(walk):
    """Slacks and multipliers are pushed off zero first, for walks that differ: not in a step."""
    program, solution = walk
    start, multipliers = solution.gait.free, solution.multipliers
    warm = solve(program, start=start, multipliers=multipliers)
    assert warm.converged
    assert warm.iterations < solution.iterations / 2
    assert warm.cost == pytest.approx(solution.cost, rel=1e-4)  # what the barrier leaves
    without = solve(program, start=start)
    assert warm.iterations < without.iterations


@pytest.mark.parametrize("solver", ["snopt", "ipopt"])
def test_multipliers_do_not_disturb_the_other_solvers(walk, solver, short):
    """They have no use for them."""
    short(1)
    program, solution = walk
    start = solution.gait.free
    given, without = (
        solve(program, solver, start, multipliers=multipliers)
        for multipliers in (solution.multipliers, None)
    )
    np.testing.assert_array_equal(given.gait.free, without.gait.free)


def test_every_constraint_of_a_walk_has_its_multipliers(walk):
    """As many as rows; nothing where a bound is not reached, and the sign of the bound."""
    program, solution = walk
    sizes = {c.name: len(c.lower) for c in program.constraints} | {LIMITS.name: len(program.unit)}
    found = solution.multipliers
    assert {name: len(price) for name, price in found.items()} == sizes
    for c in program.constraints:
        value, price = program.residual(c, solution.gait.free)[0], found[c.name]
        counts = np.abs(price) > 1e-2 * max(np.abs(price).max(), 1.0)
        away = np.where(price > 0.0, value - c.lower, c.upper - value)
        np.testing.assert_allclose(away[counts], 0.0, atol=1e-3)
