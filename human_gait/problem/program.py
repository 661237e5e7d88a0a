"""The walk as a Drake MathematicalProgram: control points in, cost and constraints out.

Decision variables are the free control points of all 55 DOF (`bspline`). Rows of constraints know
their partials in q, v, a (`constraints`); gradients in control points follow by the chain rule
(`transcription`). The program is the one statement of the problem: every solver reads it, and what
is added to it by Drake's own calls counts like the rest.

The solvers see the control points in units that even out how strongly the torques depend on them:
a swaying pelvis moves the whole body, a turning wrist a hand (`GaitProgram.unit`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
from pydrake.solvers import MathematicalProgram

from human_gait.arrays import FloatArray
from human_gait.body.limits import joint_limits
from human_gait.body.skeleton import DOF_NAMES, DOF_UNITS, N_DOF, in_words
from human_gait.problem.constraints import (
    LIMITS,
    SYMMETRY,
    friction_constraints,
    paper_constraints,
    symmetry_rows,
    with_rows,
)
from human_gait.problem.drake import (
    Curvature,
    RowsOfWalk,
    Stage,
    TermOfWalk,
    add_rows,
    add_term,
    offer,
    tell_sparsity,
)
from human_gait.problem.functions import WalkFunctions
from human_gait.problem.given import OwnCost, as_term, of_kind, without_twins
from human_gait.problem.impossible import refusals
from human_gait.problem.objective import objective
from human_gait.problem.own import PathConstraint, RunningCost
from human_gait.problem.posture_rows import within_strength
from human_gait.problem.residual import Constraint, Residual
from human_gait.problem.term import Term
from human_gait.problem.tracking import Tracking
from human_gait.problem.units import COST_SCALE, units
from human_gait.problem.violation import Violation, worst_row
from human_gait.scenario import Scenario, scenario_of
from human_gait.scenario.schema import refuse
from human_gait.walk.bspline import Basis
from human_gait.walk.cycle import step_cycle
from human_gait.walk.gait import Gait
from human_gait.walk.initial_guess import initial_guess
from human_gait.walk.instant import Instants

_OF_UNITS = "discretisation", "objective"  # sections that units of the variables go by

_AT_LIMIT = 1e-4  # [rad or m]: IPOPT ends so near to a bound that matters


class GaitProgram:
    """One scenario as an optimisation problem.

    Attributes
    ----------
    scenario : Scenario
    dynamics : str
        What the dynamics is computed with, one of ``dynamics.ENGINES``.
    functions : WalkFunctions
        Costs and rows in the free control points, without Drake.
    basis : Basis
    times : (K,) array, [s]
        The grid of instants. T itself is left out where it is the mirror image of 0.
    own_costs, own_constraints : tuple of RunningCost or Term, and of PathConstraint
        What was added to the scenario's.
    terms : list of Term
        Of the objective.
    constraints : list of Constraint
    limits : two (55,) arrays, [rad] or [m]
        Eq. (19).
    symmetry : (r, m * 55) array, (r,) array
        Eq. (26) as linear rows and their right-hand sides; none for mirrored splines.
    reference : (m * 55,) array and Instants
        Free control points, and what is known there, from which units and linear rows come.
    unit : (m * 55,) array, [rad] or [m]
        By how much a control point changes when its decision variable changes by one.
    torques : Stage
        Objective Eq. (18) subject to Eqs. (19)-(27).
    """

    def __init__(
        self,
        scenario: Scenario,
        basis: Basis | None = None,
        dynamics: str = "pinocchio",
        costs: Sequence[OwnCost] = (),
        constraints: Sequence[PathConstraint] = (),
        *,
        like: GaitProgram | None = None,
    ) -> None:
        of_kind("costs", costs, (RunningCost, Tracking, Term))
        of_kind("constraints", constraints, (PathConstraint,))
        grid = scenario.discretisation
        if basis is None:
            basis = Basis.uniform(step_cycle(scenario.walk), grid.control_points, grid.mirrored)
        # what is asked for
        self.scenario, self.dynamics, self.basis = scenario, dynamics, basis
        self.own_costs, self.own_constraints = tuple(costs), tuple(constraints)
        # functions of control points, and their values at the first guess
        known: WalkFunctions | None = like.functions if like else None
        self.functions: WalkFunctions = WalkFunctions(scenario, basis, dynamics, known)
        self.times, plan = self.functions.times, self.functions.walker.plan
        self.limits, self.symmetry = joint_limits(scenario), symmetry_rows(scenario, basis)
        self.reference: tuple[FloatArray, Instants] = self._first(like)
        # the problem: terms, constraints, units of the variables, and Drake's program of them
        self.terms = objective(scenario)
        self.terms += [as_term(own, self.reference[1], basis.step_time) for own in costs]
        self.constraints = paper_constraints(scenario, plan, self.times)
        self.constraints += [own.constraint(self.reference[1]) for own in constraints]
        without_twins(self.constraints)
        self.unit: FloatArray = like.unit if like else self._units()
        self._curvature = Curvature(self.functions, self.unit)
        self.torques = self.stage(self.constraints)
        for term in self.terms:
            scaled = TermOfWalk(self._curvature, term, COST_SCALE)
            evaluator = add_term(self.torques.prog, scaled, self.variables)
            self.torques.costs.append(evaluator)

    def __repr__(self) -> str:
        size = f"{len(self.variables)} variables, {self.n_constraint_rows} constraint rows"
        own = [one.name for one in (*self.own_costs, *self.own_constraints)]
        added = f", own: {', '.join(own)}" if own else ""
        return f"GaitProgram({self.scenario.name!r}: {size}, dynamics by {self.dynamics}{added})"

    @property
    def variables(self) -> FloatArray:
        """The free control points, row by row, in parts of `unit`: (m * 55,) of Variable."""
        return self.torques.variables

    @property
    def n_constraint_rows(self) -> int:
        """Number of rows of all constraints."""
        rows = sum(len(constraint.lower) for constraint in self.constraints)
        return rows + len(self.symmetry[1])

    def for_scenario(self, scenario: Scenario) -> GaitProgram:
        """Return the problem of another scenario, with the same own costs and constraints."""
        own = self.own_costs, self.own_constraints
        return GaitProgram(scenario, None, self.dynamics, *own)

    def moved_to(self, scenario: Scenario) -> GaitProgram:
        """Return the problem of a scenario like this one's, from what is known of this one.

        Units of the variables are those of this problem, so that nothing has to be evaluated.

        Raises
        ------
        ScenarioError
            As `build_program`.
        """
        alike = all(getattr(scenario, name) == getattr(self.scenario, name) for name in _OF_UNITS)
        if not alike:
            program = self.for_scenario(scenario)
        else:
            own = self.own_costs, self.own_constraints
            program = GaitProgram(scenario, None, self.dynamics, *own, like=self)
        refuse([*refusals(scenario, program.functions.walker, program.basis)])
        return program

    def with_friction(self) -> GaitProgram:
        """Return the same problem on a floor that holds by friction alone.

        What has been added to the MathematicalProgram stays in it.
        """
        return self._with(friction_constraints(self.functions.walker.plan, self.times))

    def with_strength(self) -> GaitProgram:
        """Return the same problem for muscles that are no stronger than the person's.

        What has been added to the MathematicalProgram stays in it.
        """
        return self._with([within_strength(self.scenario, self.times)])

    def _with(self, added: list[Constraint]) -> GaitProgram:
        program, stage, prog = copy(self), self.torques, self.torques.prog.Clone()
        program.constraints = self.constraints + added
        program.torques = replace(
            stage, prog=prog, constraints=program.constraints, own=list(stage.own)
        )
        for constraint in added:
            self._add(program.torques, constraint)
        return program

    def _first(self, like: GaitProgram | None) -> tuple[FloatArray, Instants]:
        """Return the guess and its instants; with a program like this one those of its reference.

        At these only the motion is the new one: linear rows, which ask for it, know no more.
        """
        if like is None:
            guess = self.guess()
            return guess, self.functions.evaluated(guess)
        free, now = like.reference
        q, v, a = self.functions.transcription.motion(self.functions.expanded(free))
        return free, replace(now, t=self.times, q=q, v=v, a=a)

    def guess(self) -> FloatArray:
        """Return the free control points of the first guess, flat, within the joint limits."""
        walker = self.functions.walker
        points = initial_guess(self.scenario, walker.body, walker.plan, self.basis)
        return np.clip(points, *self.limits).ravel()

    def posture(self, guess: FloatArray, nearness: float, gentleness: float) -> Stage:
        """Return an easier problem: near the guess, gently moving, forces at every interval only.

        Its cost is quadratic: `nearness` [1/rad^2 s] weighs the distance from the guess,
        `gentleness` [s^3/rad^2] the accelerations. Its constraints are those of `torques` without
        the instants between the ends of the intervals.
        """
        on = np.arange(0, len(self.times), self.scenario.discretisation.dynamics_per_interval)
        stage = self.stage(with_rows(one.rows_at(on) for one in self.constraints))
        near, gentle = self.basis.design(self.times), self.basis.design(self.times, 2)
        weight = self.basis.step_time / len(self.times)
        Q = 2.0 * weight * (nearness * near.T @ near + gentleness * gentle.T @ gentle)
        b = -2.0 * weight * nearness * near.T @ (near @ guess)
        unit = self.unit
        stage.prog.AddQuadraticCost(Q * np.outer(unit, unit), b * unit, stage.variables)
        return stage

    def gait(self, free: FloatArray, **solution: object) -> Gait:
        """Return the gait of flat free control points."""
        return Gait(self.scenario, self.basis.breaks, self.functions.expanded(free), solution)

    def instants(self, free: FloatArray) -> Instants:
        """Return everything known at the instants of the grid; the last result is kept."""
        return self.functions.instants(free)

    def cost(self, free: FloatArray) -> tuple[float, FloatArray]:
        """Return the objective [N^2 m^2 s] and its gradient in the free control points."""
        return self.functions.cost(self.terms, free)

    def residual(self, constraint: Constraint, free: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rows (r,) of a constraint and their Jacobian (r, m * 55)."""
        return self.functions.residual(constraint, free)

    def rows(self, constraint: Constraint, free: FloatArray) -> Residual:
        """Return the rows of a constraint with their partials in q, v, a."""
        return self.functions.rows(constraint, free)

    def total_cost(self, free: FloatArray, x: FloatArray | None = None) -> float:
        """Return the sum of all costs that the MathematicalProgram holds, [N^2 m^2 s].

        `x` are all decision variables; without them those that were added are as they are guessed.
        """
        x = self.torques.point(free / self.unit) if x is None else x
        changed = self.torques.changed_cost(x)
        if changed is not None:
            return changed / COST_SCALE
        return sum(self.functions.integral(term, free) for term in self.terms)

    def violations(self, free: FloatArray, x: FloatArray | None = None) -> list[Violation]:
        """Return the worst row of every constraint, of those added by Drake's calls too.

        `x` as in `total_cost`.
        """
        worst = [worst_row(c, self.rows(c, free), self.times) for c in self.constraints]
        matrix, ends = self.symmetry
        if len(ends):
            apart = np.abs(matrix @ free - ends)
            row = int(np.argmax(apart))
            what, unit = self.symmetry_words[row]
            T = self.basis.step_time
            worst.append(Violation(SYMMETRY, unit, float(apart[row]), T, what))
        x = self.torques.point(free / self.unit) if x is None else x
        return worst + self.torques.added_violations(x)

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
        names = [*(constraint.name for constraint in self.constraints), LIMITS.name, SYMMETRY.name]
        prices = {name: duals[name] / COST_SCALE for name in names if name in duals}
        lower, upper = (np.tile(limit, self.basis.n_free) for limit in self.limits)
        price = prices[LIMITS.name] / self.unit
        away = np.where(price > 0.0, at - lower, upper - at)
        # SNOPT gives the slopes that are left of free variables too: no bound holds these
        prices[LIMITS.name] = np.where(away <= _AT_LIMIT, price, 0.0)
        return prices

    def duals(self, multipliers: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the duals of `torques` by name from multipliers; inverse of `multipliers`."""
        duals = {name: COST_SCALE * price for name, price in multipliers.items()}
        return {**duals, LIMITS.name: duals.get(LIMITS.name, 0.0 * self.unit) * self.unit}

    @property
    def symmetry_words(self) -> list[tuple[str, str]]:
        """What the rows of Eq. (26) are about, in words, and their units."""
        orders = (("posture", ""), ("velocity", "/s"))[: len(self.symmetry[1]) // N_DOF]
        return [
            (f"{in_words(name)}, {which}", unit + per_time)
            for which, per_time in orders
            for name, unit in zip(DOF_NAMES, DOF_UNITS, strict=True)
        ]

    def stage(self, constraints: list[Constraint]) -> Stage:
        """Return a program with limits and constraints, without cost."""
        prog = MathematicalProgram()
        variables = prog.NewContinuousVariables(self.basis.n_free * N_DOF, "P")
        lower, upper = (np.tile(limit, self.basis.n_free) / self.unit for limit in self.limits)
        box = prog.AddBoundingBoxConstraint(lower, upper, variables)
        box.evaluator().set_description(LIMITS.name)
        stage = Stage(prog, variables, constraints, [box.evaluator()], [])
        for constraint in constraints:
            self._add(stage, constraint)
        matrix, ends = self.symmetry
        if len(ends):
            ties = prog.AddLinearEqualityConstraint(matrix * self.unit, ends, variables)
            ties.evaluator().set_description(SYMMETRY.name)
            stage.own.append(ties.evaluator())
        return stage

    def _add(self, stage: Stage, constraint: Constraint) -> None:
        if not constraint.linear:
            rows_of_walk = RowsOfWalk(self._curvature, constraint)
            stage.own.append(add_rows(stage.prog, rows_of_walk, stage.variables))
            return
        free, now = self.reference
        rows = constraint.evaluate(now)
        jacobian = self.functions.transcription.jacobian(constraint, rows)
        apart = rows.value - jacobian @ free
        lower, upper = constraint.lower - apart, constraint.upper - apart
        linear = stage.prog.AddLinearConstraint(jacobian * self.unit, lower, upper, stage.variables)
        linear.evaluator().set_description(constraint.name)
        offer(stage.prog, linear, RowsOfWalk(self._curvature, constraint, apart))
        stage.own.append(linear.evaluator())

    def _units(self) -> FloatArray:
        """Return the unit (m * 55,) of each control point."""
        partials = self.reference[1].muscle_partials
        return np.tile(units(self.scenario, self.basis, self.times, partials), self.basis.n_free)


def build_program(
    scenario: Scenario | str | Path,
    basis: Basis | None = None,
    dynamics: str = "pinocchio",
    costs: Sequence[OwnCost] = (),
    constraints: Sequence[PathConstraint] = (),
) -> GaitProgram:
    """Return the optimisation problem of a scenario.

    Parameters
    ----------
    scenario : Scenario, str or Path
        A scenario, or its TOML file, or the name of one that comes with the package.
    basis : Basis, optional
        B-splines of the joint angles; by default those of the scenario's discretisation.
    dynamics : str
        ``pinocchio``, or ``dh`` for the paper's own recursion: the same numbers, more slowly.
    costs : sequence of RunningCost or Tracking
        Of one's own, added to the objective.
    constraints : sequence of PathConstraint
        Of one's own.

    Raises
    ------
    ScenarioError
        If the scenario cannot be read, names a DOF that does not exist, or asks for what no walk
        can keep (`problem.impossible`).
    ValueError
        If there is no such dynamics, two constraints have one name, or a function of one's own
        returns what it should not at the first guess.
    TypeError
        If what is given as own costs or constraints are none.
    """
    task = scenario_of(scenario)
    program = GaitProgram(task, basis, dynamics, costs, constraints)
    refuse([*refusals(task, program.functions.walker, program.basis)])
    tell_sparsity(program.torques.prog)
    return program
