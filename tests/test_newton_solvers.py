"""Our interior-point method against IPOPT, both with the same exact second derivatives."""

import numpy as np
import pytest
from small_problems import VALLEY_START, corner, cube, numbers, random_quadratic, valley
from walks import scenario

from benchmarks import casadi_ipopt
from human_gait.newton import interior_point
from human_gait.problem.program import build_program
from human_gait.solving.mathematical_program import ProgramFunctions


def ends(problem, start):
    """Where both end, ours first."""
    found = interior_point.minimise(problem, start), casadi_ipopt.minimise(problem, start)
    assert all(end.solved for end in found)
    return found


@pytest.mark.parametrize(
    ("problem", "start"),
    [(valley(), VALLEY_START), (corner(), numbers(0.3, 0.3)), (cube(), numbers(5.0))],
    ids=["valley", "corner", "cube"],
)
def test_both_end_at_the_same_point_with_the_same_multipliers(problem, start):
    ours, theirs = ends(problem, start)
    np.testing.assert_allclose(ours.x, theirs.x, atol=1e-4)
    np.testing.assert_allclose(ours.duals.rows, theirs.duals.rows, atol=1e-3)
    np.testing.assert_allclose(ours.duals.variables, theirs.duals.variables, atol=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_both_find_the_minimum_of_a_convex_program(seed):
    problem = random_quadratic(seed, np.linspace(0.1, 5.0, 10))
    ours, theirs = ends(problem, np.zeros(10))
    np.testing.assert_allclose(ours.x, theirs.x, atol=1e-3)


@pytest.mark.parametrize("error", [ZeroDivisionError("a mistake"), KeyboardInterrupt()])
def test_what_a_function_raises_is_raised_again_by_the_other_too(error):
    def fail(_):
        raise error

    with pytest.raises(type(error)) as raised:
        casadi_ipopt.minimise(valley(rows=fail), VALLEY_START)
    assert raised.value is error


@pytest.mark.solve
def test_both_find_the_same_walk():
    """The legs and the pelvis in any case: spines that hardly cost anything differ more."""
    program = build_program(scenario(1.2, 0.66))
    problem = ProgramFunctions(program.torques.prog).problem()
    ours, theirs = ends(problem, program.guess() / program.unit)
    costs = [problem.cost(end.x) for end in (ours, theirs)]
    assert costs[0] == pytest.approx(costs[1], rel=1e-3)
    lower_body = np.arange(program.basis.n_free * 55) % 55 < 20
    change = np.abs((ours.x - theirs.x) * program.unit)[lower_body].max()
    assert change < 0.02
