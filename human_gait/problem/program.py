"""The walk as a Drake MathematicalProgram: control points in, cost and constraints out.

Decision variables are the free control points of all 55 DOF (`bspline`). Rows of constraints know
their partials in q, v, a (`constraints`); gradients in control points follow by the chain rule
(`transcription`).

The solvers see the control points in units that even out how strongly the torques depend on them:
a swaying pelvis moves the whole body, a turning wrist a hand (`GaitProgram.unit`).

This is the only place that meets Drake's AutoDiff.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.math import BsplineBasis
from pydrake.solvers import MathematicalProgram
from pydrake.trajectories import BsplineTrajectory

from human_gait.arrays import FloatArray
from human_gait.body.limits import joint_limits
from human_gait.body.skeleton import DOF_NAMES, DOF_UNITS, N_DOF, in_words
from human_gait.exceptions import ScenarioError
from human_gait.problem.constraints import (
    LIMITS,
    SYMMETRY,
    friction_constraints,
    paper_constraints,
)
from human_gait.problem.objective import lean_on_torques, torque_squared, torque_weights
from human_gait.problem.residual import Constraint, Residual
from human_gait.problem.transcription import Transcription
from human_gait.problem.violation import Violation, worst_row
from human_gait.scenario import Scenario
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.bspline import DEGREE, Basis
from human_gait.walk.cycle import step_cycle
from human_gait.walk.gait import Gait
from human_gait.walk.initial_guess import initial_guess
from human_gait.walk.instant import Instants, Walker

COST_SCALE = 1e-3
"""The solvers see the cost in kN^2 m^2 s: of the order of one to ten."""

_AT_LIMIT = 1e-4  # [rad or m]: IPOPT ends so near to a bound that matters
_TIED = {"acceleration": 0, "position": 1, "velocity": 2}  # derivatives that have rows of Eq. 26
_LEAST_CURVATURE = 1e-4  # [kN^2 m^2 / rad^2] keeps the units of the lightest joints below 10 rad


@dataclass(frozen=True)
class Stage:
    """A problem as the solvers get it: that of the torques, or an easier one before it.

    Attributes
    ----------
    prog : MathematicalProgram
        Its variables are parts of the units of the control points.
    constraints : list of Constraint
        The nonlinear ones come in the order of ``prog.generic_constraints()``.
    cost_factor : float
        Of the objective Eq. (18) in the cost; 0 where the cost is quadratic.
    """

    prog: MathematicalProgram
    constraints: list[Constraint]
    cost_factor: float


class GaitProgram:
    """One scenario as an optimisation problem.

    Attributes
    ----------
    scenario : Scenario
    dynamics : str
        What the dynamics is computed with, one of ``dynamics.ENGINES``.
    friction : bool
        Whether the floor's friction bounds the forces, which the paper leaves out.
    basis : Basis
    times : (K,) array, [s]
        The grid of instants. T itself is left out where it is the mirror image of 0.
    constraints : list of Constraint
    unit : (m * 55,) array, [rad] or [m]
        By how much a control point changes when its decision variable changes by one.
    torques : Stage
        Objective Eq. (18) subject to Eqs. (19)-(27).
    variables : (m * 55,) array of Variable
        The free control points, row by row, in parts of `unit`.
    """

    def __init__(
        self,
        scenario: Scenario,
        basis: Basis | None = None,
        dynamics: str = "pinocchio",
        friction: bool = False,
    ) -> None:
        self.scenario, self.dynamics, self.friction = scenario, dynamics, friction
        step_time, grid = scenario.walk.step_time, scenario.discretisation
        n = grid.intervals * grid.dynamics_per_interval
        self.limits = joint_limits(scenario)
        self.basis = basis or Basis.uniform(
            step_cycle(scenario.walk), grid.control_points, grid.mirrored
        )
        self.times = np.arange(n + (not grid.mirrored)) * step_time / n
        self._walker = Walker(scenario, dynamics)
        self.transcription = Transcription(self.basis, self.times)
        self._weights = torque_weights(scenario)
        self._spacing = _trapezoids(step_time / n, len(self.times), grid.mirrored)
        self._symmetry = self._symmetry_rows()
        self._known: tuple[bytes, Instants, dict[Constraint, Residual]] | None = None
        self.evaluations = 0
        self.observe: Callable[[FloatArray], None] | None = None
        plan = self._walker.plan
        self.constraints = paper_constraints(scenario, plan, self.times)
        self.constraints += friction_constraints(plan, self.times) if friction else []
        self._guess = self.guess()
        self._at_guess = self._evaluated(self._guess)
        self.unit = np.tile(self._unit(), self.basis.n_free)
        prog, self.variables = self._program(self.constraints)
        prog.AddCost(self._cost, self.variables)
        self.torques = Stage(prog, self.constraints, COST_SCALE)

    @property
    def n_constraint_rows(self) -> int:
        """Number of rows of all constraints."""
        rows = sum(len(constraint.lower) for constraint in self.constraints)
        return rows + len(self._symmetry[1])

    def with_friction(self) -> GaitProgram:
        """Return the same problem on a floor that holds by friction alone."""
        return GaitProgram(self.scenario, self.basis, self.dynamics, friction=True)

    def guess(self) -> FloatArray:
        """Return the free control points of the first guess, flat, within the joint limits."""
        plan, body = self._walker.plan, self._walker.body
        return np.clip(initial_guess(self.scenario, body, plan, self.basis), *self.limits).ravel()

    def posture(self, guess: FloatArray, nearness: float, gentleness: float) -> Stage:
        """Return an easier problem: near the guess, gently moving, forces at every interval only.

        Its cost is quadratic: `nearness` [1/rad^2 s] weighs the distance from the guess,
        `gentleness` [s^3/rad^2] the accelerations. Its constraints are those of `torques` without
        the instants between the ends of the intervals.
        """
        on = np.arange(0, len(self.times), self.scenario.discretisation.dynamics_per_interval)
        constraints = [constraint.rows_at(on) for constraint in self.constraints]
        prog, variables = self._program(constraints)
        near, gentle = self.basis.design(self.times), self.basis.design(self.times, 2)
        weight = self.basis.step_time / len(self.times)
        Q = 2.0 * weight * (nearness * near.T @ near + gentleness * gentle.T @ gentle)
        b = -2.0 * weight * nearness * near.T @ (near @ guess)
        unit = self.unit
        prog.AddQuadraticCost(Q * np.outer(unit, unit), b * unit, variables)
        return Stage(prog, constraints, 0.0)

    def gait(self, free: FloatArray, **solution: object) -> Gait:
        """Return the gait of flat free control points."""
        control_points = self._expanded(free)
        return Gait(self.scenario, self.basis.breaks, control_points, solution)

    def instants(self, free: FloatArray) -> Instants:
        """Return everything known at the instants of the grid; the last result is kept."""
        key = free.tobytes()
        if self._known is None or self._known[0] != key:
            self._known = key, self._evaluated(free), {}
            self.evaluations += 1
            if self.observe:
                self.observe(free)
        return self._known[1]

    def watched_by(self, observe: Callable[[FloatArray], None]) -> None:
        """Give every point that is evaluated from now on to a function, and count anew."""
        self._known, self.observe, self.evaluations = None, observe, 0

    def _evaluated(self, free: FloatArray) -> Instants:
        return self._walker.at(self.times, *self.transcription.motion(self._expanded(free)))

    def _expanded(self, free: FloatArray) -> FloatArray:
        return self.basis.expand(free.reshape(-1, N_DOF))

    def cost(self, free: FloatArray) -> tuple[float, FloatArray]:
        """Return the objective [N^2 m^2 s] and its gradient in the free control points."""
        value, partials = torque_squared(self.instants(free), self._spacing, self._weights)
        return value, self.transcription.gradient(partials)

    def residual(self, constraint: Constraint, free: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rows (r,) of a constraint and their Jacobian (r, m * 55)."""
        residual = self.rows(constraint, free)
        return residual.value, self.transcription.jacobian(constraint, residual)

    def rows(self, constraint: Constraint, free: FloatArray) -> Residual:
        """Return the rows of a constraint with their partials in q, v, a."""
        now = self.instants(free)
        known = self._known[2] if self._known else {}
        if constraint not in known:
            known[constraint] = constraint.evaluate(now)
        return known[constraint]

    def hessian(
        self, free: FloatArray, cost_factor: float, leaning: Iterable[tuple[Constraint, FloatArray]]
    ) -> FloatArray:
        """Return the Hessian of the Lagrangian in the free control points, (m * 55, m * 55).

        Of cost_factor * objective + sum of multipliers * rows, `leaning` being constraints with
        their multipliers.
        """
        now = self.instants(free)
        adjoint = Adjoint.none(len(self.times))
        lean_on_torques(now, cost_factor * self._spacing, self._weights, adjoint)
        for constraint, multipliers in leaning:
            constraint.add_to_adjoint(now, multipliers, adjoint)
        return self.transcription.hessian(self._walker.second_derivatives(now, adjoint))

    def violations(self, free: FloatArray) -> list[Violation]:
        """Return the worst row of every constraint."""
        worst = [worst_row(c, self.rows(c, free), self.times) for c in self.constraints]
        matrix, ends = self._symmetry
        if len(ends):
            apart = np.abs(matrix @ free - ends)
            row = int(np.argmax(apart))
            what, unit = self.symmetry_words[row]
            T = self.basis.step_time
            worst.append(Violation(SYMMETRY, unit, float(apart[row]), T, what))
        return worst

    def multipliers(self, duals: Mapping[str, FloatArray], at: FloatArray) -> dict[str, FloatArray]:
        """Return the shadow price of every bound by name of its constraint.

        That is d objective / d bound, [N^2 m^2 s] per unit of the row: positive at a lower bound
        that is active, negative at an upper one, 0 elsewhere. Those of `LIMITS` are (m * 55,), of
        the bounds of the control points.

        Parameters
        ----------
        duals : mapping of str to array
            d cost / d bound of `torques`, as Drake gives them, by name of the constraint.
        at : (m * 55,) array
            The free control points where they hold.
        """
        prices = {name: dual / COST_SCALE for name, dual in duals.items()}
        lower, upper = (np.tile(limit, self.basis.n_free) for limit in self.limits)
        price = prices[LIMITS.name] / self.unit
        away = np.where(price > 0.0, at - lower, upper - at)
        # SNOPT gives the slopes that are left of free variables too: no bound holds these
        prices[LIMITS.name] = np.where(away <= _AT_LIMIT, price, 0.0)
        return prices

    def duals(self, multipliers: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the duals of `torques` by name from multipliers; inverse of `multipliers`."""
        duals = {name: COST_SCALE * price for name, price in multipliers.items()}
        return {**duals, LIMITS.name: duals[LIMITS.name] * self.unit}

    @property
    def symmetry_words(self) -> list[tuple[str, str]]:
        """What the rows of Eq. (26) are about, in words, and their units."""
        orders = (("posture", ""), ("velocity", "/s"))[: len(self._symmetry[1]) // N_DOF]
        return [
            (f"{in_words(name)}, {which}", unit + per_time)
            for which, per_time in orders
            for name, unit in zip(DOF_NAMES, DOF_UNITS, strict=True)
        ]

    def _program(self, constraints: list[Constraint]) -> tuple[MathematicalProgram, FloatArray]:
        """Return a program with limits and constraints, without cost, and its variables."""
        prog = MathematicalProgram()
        variables = prog.NewContinuousVariables(self.basis.n_free * N_DOF, "P")
        lower, upper = (np.tile(limit, self.basis.n_free) / self.unit for limit in self.limits)
        box = prog.AddBoundingBoxConstraint(lower, upper, variables)
        box.evaluator().set_description(LIMITS.name)
        for constraint in constraints:
            self._add(prog, constraint, variables)
        matrix, ends = self._symmetry
        if len(ends):
            ties = prog.AddLinearEqualityConstraint(matrix * self.unit, ends, variables)
            ties.evaluator().set_description(SYMMETRY.name)
        return prog, variables

    def _symmetry_rows(self) -> tuple[FloatArray, FloatArray]:
        """Return Eq. (26) as rows (r, m * 55) and right-hand sides (r,); none for mirrored splines.

        Postures of both ends, q(T) - mirror(q(0)) = L z, and velocities where they are tied too.
        """
        derivatives = range(_TIED[self.scenario.discretisation.periodicity])
        rows = [self.basis.symmetry(derivative) for derivative in derivatives]
        ends = np.zeros((len(rows), N_DOF))
        ends[:1] = self.basis.cycle.advance
        return np.concatenate([np.zeros((0, self.basis.n_free * N_DOF)), *rows]), ends.ravel()

    def _add(
        self, prog: MathematicalProgram, constraint: Constraint, variables: FloatArray
    ) -> None:
        if constraint.linear:
            rows = constraint.evaluate(self._at_guess)
            jacobian = self.transcription.jacobian(constraint, rows)
            apart = rows.value - jacobian @ self._guess
            lower, upper = constraint.lower - apart, constraint.upper - apart
            linear = prog.AddLinearConstraint(jacobian * self.unit, lower, upper, variables)
            linear.evaluator().set_description(constraint.name)
            return
        function = _seam(lambda free: self.residual(constraint, free), self.unit)
        binding = prog.AddConstraint(function, constraint.lower, constraint.upper, variables)
        pattern = np.zeros((len(constraint.lower), len(variables)), dtype=bool)
        pattern[self.transcription.entries(constraint)] = True
        binding.evaluator().set_description(constraint.name)
        binding.evaluator().SetGradientSparsityPattern(
            list(zip(*(part.tolist() for part in np.nonzero(pattern)), strict=True))
        )

    def _cost(self, x: npt.NDArray[np.object_]) -> object:
        def scaled(free: FloatArray) -> tuple[FloatArray, ...]:
            return tuple(COST_SCALE * np.atleast_1d(part) for part in self.cost(free))

        return _seam(scaled, self.unit)(x)[0]

    def _unit(self) -> FloatArray:
        """Return the unit (55,) of each DOF's control points from the slopes of the torques.

        With d = sum_i w_i (dtau_i/dP)^2 at the first guess, the Gauss-Newton diagonal of the
        objective, units d^(-1/2) would give every variable the same curvature. Constraints, in
        metres for all, want none of it: d^(-1/4) is between the two. Powers of two: no rounding.
        """
        torque = self._at_guess.muscle_torque
        by_order = torque.partials.reshape(*torque.value.shape, 3, N_DOF)
        squares = np.einsum("kiod,kipd,i->kopd", by_order, by_order, self._weights)
        N = np.stack([self.basis.matrix(self.times, order) for order in range(3)])
        overlap = np.einsum("okn,pkn->kop", N, N) * COST_SCALE / len(self.times)
        d = np.einsum("kop,kopd->d", overlap, squares)
        d = np.maximum((d + d[self.basis.cycle.index]) / 2, _LEAST_CURVATURE)
        return np.asarray(np.exp2(np.round(-np.log2(d) / 4)))


def build_program(
    scenario: Scenario, basis: Basis | None = None, dynamics: str = "pinocchio"
) -> GaitProgram:
    """Return the optimisation problem of a scenario.

    Parameters
    ----------
    scenario : Scenario
    basis : Basis, optional
        B-splines of the joint angles; by default those of the scenario's discretisation.
    dynamics : str
        ``pinocchio``, or ``dh`` for the paper's own recursion: the same numbers, more slowly.

    Raises
    ------
    ScenarioError
        If the scenario names a DOF that does not exist.
    ValueError
        If there is no such dynamics.
    """
    return GaitProgram(scenario, basis, dynamics)


def refined_program(
    gait: Gait, n_control_points: int, dynamics: str = "pinocchio"
) -> tuple[GaitProgram, FloatArray]:
    """Return the problem of a gait with more control points, and where to start: the same gait.

    Knots are inserted, so that the curves stay as they are. The constrained grid grows by whole
    multiples, until there are two intervals to each polynomial piece.

    Parameters
    ----------
    gait : Gait
    n_control_points : int
        Per DOF.
    dynamics : str
        As in `build_program`.

    Raises
    ------
    ScenarioError
        If these are not more control points than the gait has, or too many.
    """
    grid = gait.scenario.discretisation
    if n_control_points <= gait.basis.n_control_points:
        allowed = f"must be more than the {gait.basis.n_control_points} there are"
        raise ScenarioError("discretisation.control_points", allowed, n_control_points)
    basis = gait.basis.refined(n_control_points)
    multiple = int(np.ceil(2 * basis.n_pieces / grid.intervals))
    finer = replace(grid, control_points=n_control_points, intervals=multiple * grid.intervals)
    scenario = replace(gait.scenario, discretisation=finer)
    P = gait.basis.insert(basis, gait.control_points)
    return build_program(scenario, basis, dynamics), P[: basis.n_free].ravel()


def bspline_trajectory(gait: Gait) -> BsplineTrajectory:
    """Return one step of a gait as a trajectory of Drake."""
    basis = BsplineBasis(DEGREE + 1, gait.knots)
    return BsplineTrajectory(basis, gait.control_points.T)


def _seam(
    function: Callable[[FloatArray], tuple[FloatArray, ...]], unit: FloatArray
) -> Callable[[npt.NDArray[np.object_]], npt.NDArray[np.object_]]:
    """Return a Drake evaluator of a function of unit * x that returns value and Jacobian."""

    def evaluate(x: npt.NDArray[np.object_]) -> npt.NDArray[np.object_]:
        if x.dtype != object:
            return np.asarray(function(unit * np.asarray(x, dtype=float))[0])
        value, jacobian = function(unit * ExtractValue(x).ravel())
        seed = ExtractGradient(x)
        by_seed = np.atleast_2d(jacobian) * unit
        if not np.array_equal(seed, np.eye(len(x))):
            by_seed = by_seed @ seed
        return np.asarray(InitializeAutoDiff(value, by_seed)).ravel()

    return evaluate


def _trapezoids(interval: float, n: int, periodic: bool) -> FloatArray:
    """Return the time (n,) that each instant stands for in an integral, [s]."""
    spacing = np.full(n, interval)
    if not periodic:
        spacing[[0, -1]] /= 2
    return spacing
