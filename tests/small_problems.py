"""Small problems for all solvers, written once, exact and for Drake; what their ends leave."""

from dataclasses import replace

import numpy as np
from pydrake.solvers import MathematicalProgram

from human_gait.newton.nonlinear_program import NonlinearProgram
from human_gait.solving.drake_solvers import solve_program, status_of


def numbers(*values):
    return np.array(values, dtype=float)


def free(n):
    return np.full(n, -np.inf), np.full(n, np.inf)


def valley(**changes):
    """Rosenbrock's curved valley with the circle of radius 1 as a limit."""
    problem = NonlinearProgram(
        *free(2),
        numbers(-np.inf),
        numbers(1.0),
        lambda x: 100.0 * (x[1] - x[0] ** 2) ** 2 + (1.0 - x[0]) ** 2,
        lambda x: numbers(
            -400.0 * x[0] * (x[1] - x[0] ** 2) - 2.0 * (1.0 - x[0]), 200.0 * (x[1] - x[0] ** 2)
        ),
        lambda x: [x[0] ** 2 + x[1] ** 2],
        (np.array([0, 0]), np.array([0, 1])),
        lambda x: 2.0 * x,
        lambda x, factor, by_row, springs: (
            factor
            * np.array(
                [[1200.0 * x[0] ** 2 - 400.0 * x[1] + 2.0, -400.0 * x[0]], [-400.0 * x[0], 200.0]]
            )
            + by_row[0] * 2.0 * np.eye(2)
            + springs[0] * 4.0 * np.outer(x, x)
        ),
    )
    return replace(problem, **changes)


VALLEY_START = numbers(-0.9, 0.2)
VALLEY_END = numbers(0.78641515, 0.61769831)  # the root of the condition of tangency, by bisection


def cube():
    """x^3 = 8, at no cost."""
    return NonlinearProgram(
        *free(1),
        numbers(8.0),
        numbers(8.0),
        lambda x: 0.0 * x[0],
        lambda x: 0.0 * x,
        lambda x: [x[0] ** 3],
        (np.array([0]), np.array([0])),
        lambda x: 3.0 * x**2,
        lambda x, _, by_row, springs: np.diag(6.0 * by_row * x + 9.0 * springs * x**4),
    )


def corner():
    """The corner (0.7, 0) of a box is nearest to a point outside; one row that never matters."""
    return NonlinearProgram(
        numbers(0.0, 0.0),
        numbers(0.7, 0.7),
        numbers(-9.0),
        numbers(9.0),
        lambda x: (x[0] - 2.0) ** 2 + (x[1] + 1.0) ** 2,
        lambda x: 2.0 * (x - numbers(2.0, -1.0)),
        lambda x: [x[0] + x[1]],
        (np.array([0, 0]), np.array([0, 1])),
        lambda _: numbers(1.0, 1.0),
        lambda _, factor, __, springs: factor * 2.0 * np.eye(2) + springs.sum() * np.ones((2, 2)),
    )


def quadratic(H, g, A, lower, upper, row_lower, row_upper):
    """x' H x / 2 + g' x with linear rows."""
    n, m = len(g), len(A)
    at = np.indices((m, n))
    return NonlinearProgram(
        lower,
        upper,
        row_lower,
        row_upper,
        lambda x: x @ H @ x / 2.0 + g @ x,
        lambda x: H @ x + g,
        lambda x: A @ x,
        (at[0].ravel(), at[1].ravel()),
        lambda _: A.ravel(),
        lambda _, factor, __, springs: factor * H + A.T @ (springs[:, None] * A),
    )


def random_quadratic(seed, curvature):
    """Ten variables, eight rows: two equalities, bounds on both, on one and on no side."""
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.normal(size=(10, 10)))[0]
    H, A = Q @ np.diag(curvature) @ Q.T, rng.normal(size=(8, 10))
    inside = rng.uniform(-0.5, 0.5, 10)
    lower, upper = np.full(10, -1.0), np.full(10, 1.0)
    row_lower, row_upper = A @ inside - 0.1, A @ inside + 0.1
    row_lower[:2] = row_upper[:2] = (A @ inside)[:2]
    row_lower[2], row_upper[3] = -np.inf, np.inf
    row_lower[4], row_upper[4] = -np.inf, np.inf
    return quadratic(H, 3.0 * rng.normal(size=10), A, lower, upper, row_lower, row_upper)


def left(problem, end):
    """What is left of the gradient of the Lagrangian, (n,): nothing where it is stationary."""
    rows, columns = problem.jacobian_entries
    slope = problem.gradient(end.x) + end.duals.variables
    np.add.at(slope, columns, end.duals.rows[rows] * problem.jacobian(end.x))
    return slope


def in_drake(problem):
    """The same as a program of Drake, which differentiates by itself."""
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(len(problem.lower))
    prog.AddBoundingBoxConstraint(problem.lower, problem.upper, x)
    prog.AddCost(problem.cost, x)
    prog.AddConstraint(problem.rows, problem.row_lower, problem.row_upper, x)
    return prog


def run(problem, solver, start, changes):
    """Where a solver ends with our options and changes of them: x, solved, status."""
    result = solve_program(in_drake(problem), solver, start, changes)
    return result.get_x_val(), result.is_success(), status_of(result)[0]
