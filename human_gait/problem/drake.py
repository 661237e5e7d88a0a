"""Functions of the walk as Drake's evaluators, and what they offer to Newton steps besides.

This is the only place that meets Drake's AutoDiff. An evaluator holds the functions
(`functions.WalkFunctions`), which know no program: a MathematicalProgram that held the object it
belongs to would be a cycle through C++, and never be freed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.math import BsplineBasis
from pydrake.solvers import Binding, EvaluatorBase, MathematicalProgram
from pydrake.trajectories import BsplineTrajectory

from human_gait.arrays import FloatArray, IntArray
from human_gait.newton.cyclic_band import CyclicBand
from human_gait.newton.second_order import Alone, SecondOrder, Weighted
from human_gait.problem.functions import WalkFunctions
from human_gait.problem.residual import Constraint, Demand
from human_gait.problem.term import Term
from human_gait.problem.violation import Violation
from human_gait.walk.bspline import DEGREE
from human_gait.walk.gait import Gait
from human_gait.walk.gait_file import gait_of

ObjectArray = npt.NDArray[np.object_]

Hessian = Callable[[FloatArray, FloatArray], FloatArray]

_OFFERS: WeakKeyDictionary[EvaluatorBase, SecondOrder | Hessian] = WeakKeyDictionary()
"""What evaluators offer: nothing in it holds its evaluator."""


@dataclass(frozen=True)
class Stage:
    """A problem as the solvers get it: that of the torques, or an easier one before it.

    Attributes
    ----------
    prog : MathematicalProgram
        Its first variables are the control points in parts of their units.
    variables : (m * 55,) array of Variable
    constraints : list of Constraint
    own : list of EvaluatorBase
        Constraints of the scenario; others were added by Drake's calls.
    costs : list of EvaluatorBase
        Terms of the scenario's objective; others were added.
    """

    prog: MathematicalProgram
    variables: FloatArray
    constraints: list[Constraint]
    own: list[EvaluatorBase]
    costs: list[EvaluatorBase]

    def point(self, P: FloatArray) -> FloatArray:
        """Return all decision variables: P, and those that were added as they are guessed."""
        x: FloatArray = np.nan_to_num(self.prog.initial_guess())
        x[: len(P)] = P
        return x

    def added(self) -> list[Binding]:
        """Return the constraints that were added by Drake's calls."""
        return [b for b in self.prog.GetAllConstraints() if b.evaluator() not in self.own]

    def missing(self) -> list[str]:
        """Return the names of constraints of the scenario that were taken out by Drake's calls."""
        bound = [binding.evaluator() for binding in self.prog.GetAllConstraints()]
        return [rows.get_description() for rows in self.own if rows not in bound]

    def changed_cost(self, x: FloatArray) -> float | None:
        """Return the sum of all costs at x; None if there are those of the scenario and no more."""
        bindings = self.prog.GetAllCosts()
        if [binding.evaluator() for binding in bindings] == self.costs:
            return None
        return float(sum(self.prog.EvalBinding(binding, x).item() for binding in bindings))

    def added_violations(self, x: FloatArray) -> list[Violation]:
        """Return the worst row at x of every constraint that was added."""
        return [_worst_of(self.prog, binding, x) for binding in self.added()]


@dataclass(frozen=True, eq=False)
class Curvature:
    """Second derivatives of terms and constraints in one pass; the variables are parts of a unit.

    Attributes
    ----------
    functions : WalkFunctions
    unit : (n,) array
    """

    functions: WalkFunctions
    unit: FloatArray

    def cost(self, x: FloatArray, members: Sequence[TermOfWalk]) -> float:
        """Return the sum of terms."""
        return self.functions.value(self.unit * x, [(f.term, f.scale) for f in members])

    def gradient(self, x: FloatArray, members: Sequence[TermOfWalk]) -> FloatArray:
        """Return the gradient (n,) of the sum of terms."""
        terms = [(f.term, f.scale) for f in members]
        return self.unit * self.functions.gradient(self.unit * x, terms)

    def hessian(
        self, x: FloatArray, weighted: Sequence[Weighted[TermOfWalk | RowsOfWalk]]
    ) -> CyclicBand:
        """Return the second derivatives (n, n) of terms and of functions of rows."""
        terms = [(f.term, f.scale * y[0]) for f, y, _ in weighted if isinstance(f, TermOfWalk)]
        rows = [(f.constraint, y, s) for f, y, s in weighted if isinstance(f, RowsOfWalk)]
        return self.functions.hessian(self.unit * x, terms, rows).scaled(self.unit)


@dataclass(frozen=True, eq=False)
class TermOfWalk:
    """A term of the objective in parts of the unit, times a scale."""

    family: Curvature
    term: Term
    scale: float

    @property
    def entries(self) -> tuple[IntArray, IntArray]:
        """The whole gradient."""
        n = len(self.family.unit)
        return np.zeros(n, dtype=np.intp), np.arange(n)

    def value(self, x: FloatArray) -> FloatArray:
        """Return the scaled term (1,)."""
        return np.array([self.family.cost(x, [self])])

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Return its gradient (n,)."""
        return self.family.gradient(x, [self])

    def dense(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return value (1,) and gradient (1, n)."""
        return self.value(x), self.jacobian(x)[None]


@dataclass(frozen=True, eq=False)
class RowsOfWalk:
    """The rows of a constraint in parts of the unit, less what they are where all of that is 0."""

    family: Curvature
    constraint: Constraint
    apart: FloatArray | float = 0.0

    @cached_property
    def entries(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the Jacobian that can differ from zero."""
        return self.family.functions.transcription.entries(self.constraint)

    @cached_property
    def _units(self) -> FloatArray:
        """The units of the entries' variables."""
        return self.family.unit[self.entries[1]]

    def value(self, x: FloatArray) -> FloatArray:
        """Return the rows (m,)."""
        return self.family.functions.rows(self.constraint, self.family.unit * x).value - self.apart

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Return the Jacobian's entries."""
        functions, unit = self.family.functions, self.family.unit
        rows = functions.rows(self.constraint, unit * x)
        return self._units * functions.transcription.values(self.constraint, rows)

    def dense(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rows (m,) and Jacobian (m, n)."""
        value, jacobian = self.family.functions.residual(self.constraint, self.family.unit * x)
        return value, jacobian * self.family.unit


def add_term(prog: MathematicalProgram, term: TermOfWalk, variables: FloatArray) -> EvaluatorBase:
    """Add a term of the objective to a program as a cost of its name; return its evaluator."""
    binding = prog.AddCost(lambda x: _seam(term.dense, x)[0], variables)
    binding.evaluator().set_description(term.term.name)
    offer(prog, binding, term)
    return binding.evaluator()


def add_rows(prog: MathematicalProgram, rows: RowsOfWalk, variables: FloatArray) -> EvaluatorBase:
    """Add the rows of a constraint to a program under its name; return their evaluator."""
    constraint = rows.constraint
    lower, upper = constraint.lower, constraint.upper
    binding = prog.AddConstraint(lambda x: _seam(rows.dense, x), lower, upper, variables)
    evaluator = binding.evaluator()
    evaluator.set_description(constraint.name)
    offer(prog, binding, rows)
    return evaluator


def tell_sparsity(prog: MathematicalProgram) -> None:
    """Tell Drake's own solvers which partials of the rows of a walk can differ from zero.

    It takes longer than all else that is built, and ``newton`` knows without.
    """
    for binding in prog.generic_constraints():
        evaluator, rows = binding.evaluator(), _OFFERS.get(binding.evaluator())
        if isinstance(rows, RowsOfWalk) and evaluator.gradient_sparsity_pattern() is None:
            n = evaluator.num_vars()
            places = np.unique(np.ravel_multi_index(rows.entries, (evaluator.num_outputs(), n)))
            pattern = (part.tolist() for part in np.divmod(places, n))
            evaluator.SetGradientSparsityPattern(list(zip(*pattern, strict=True)))


def offer(prog: MathematicalProgram, binding: Binding, function: SecondOrder | Hessian) -> None:
    """Let ``newton`` take second derivatives of a cost or constraint from a function.

    The program keeps it, and clones of the program find it as long as that one lives.
    """
    evaluator = binding.evaluator()
    if not hasattr(prog, "second_order"):
        prog.second_order = {}
    prog.second_order[evaluator] = _OFFERS[evaluator] = function


def offer_hessian(
    prog: MathematicalProgram,
    binding: Binding,
    hessian: Hessian,
) -> None:
    """Give the exact second derivatives of a cost or constraint of one's own to ``newton``.

    Without them it takes differences of the gradients. The other solvers use none.

    Parameters
    ----------
    prog : MathematicalProgram
        Such as ``build_program(scenario).torques.prog``.
    binding : Binding
        What ``prog.AddCost`` or ``prog.AddConstraint`` returned.
    hessian : function
        Variables (n,) of the binding, multipliers (m,) of its rows -> second derivatives (n, n) of
        the sum of multipliers * rows; of a cost m is 1.

    Raises
    ------
    ValueError
        If the cost or constraint is not in the program.
    """
    evaluator = binding.evaluator()
    if evaluator not in [b.evaluator() for b in [*prog.GetAllCosts(), *prog.GetAllConstraints()]]:
        raise ValueError("the program has no such cost or constraint")
    offer(prog, binding, hessian)


def offered(evaluator: EvaluatorBase) -> SecondOrder | None:
    """Return what an evaluator offers, if anything."""
    found = _OFFERS.get(evaluator)
    if found is None or not callable(found):
        return found
    return plain(evaluator, found)


def plain(evaluator: EvaluatorBase, second: Hessian) -> Alone:
    """Return any of Drake's evaluators as a function with second derivatives from elsewhere."""

    def value(x: FloatArray) -> FloatArray:
        return np.asarray(evaluator.Eval(x), dtype=float).ravel()

    shape = evaluator.num_outputs(), evaluator.num_vars()
    return Alone(shape, value, lambda x: jacobian_of(evaluator, x), second)


def jacobian_of(evaluator: EvaluatorBase, x: FloatArray) -> FloatArray:
    """Return the Jacobian (m, n) of one of Drake's evaluators, by AutoDiff."""
    found = np.asarray(ExtractGradient(evaluator.Eval(InitializeAutoDiff(x))), dtype=float)
    return found if found.size else np.zeros((evaluator.num_outputs(), len(x)))  # a constant


def _worst_of(prog: MathematicalProgram, binding: Binding, x: FloatArray) -> Violation:
    """Return the worst row at x of a constraint that was added by Drake's calls."""
    rows, evaluator = prog.EvalBinding(binding, x), binding.evaluator()
    excess = np.maximum(evaluator.lower_bound() - rows, rows - evaluator.upper_bound())
    excess = np.nan_to_num(excess, nan=np.inf)
    row = int(np.argmax(excess)) if len(excess) else 0
    name = evaluator.get_description() or " ".join(str(binding).split())
    worst = max(float(excess[row]), 0.0) if len(excess) else 0.0
    return Violation(Demand(name=name), "", worst, 0.0, f"row {row + 1}")


def bspline_trajectory(gait: Gait | str | Path) -> BsplineTrajectory:
    """Return one step of a gait as a trajectory of Drake.

    Parameters
    ----------
    gait : Gait, str or Path
        A gait, or the folder of a result, or its ``gait.npz``.

    Returns
    -------
    pydrake.trajectories.BsplineTrajectory
        From 0 to T [s]; 55 rows in the order of `Gait.joint_names`, [rad] and [m].

    Raises
    ------
    ResultError
        If there is no gait that can be read.
    """
    walk = gait_of(gait)
    basis = BsplineBasis(DEGREE + 1, walk.knots)
    return BsplineTrajectory(basis, walk.control_points.T)


def _seam(
    function: Callable[[FloatArray], tuple[FloatArray, FloatArray]], x: ObjectArray
) -> ObjectArray | FloatArray:
    """Evaluate a function that returns value (m,) and Jacobian (m, n) as Drake asks for it."""
    if x.dtype != object:
        return function(np.asarray(x, dtype=float))[0]
    value, jacobian = function(ExtractValue(x).ravel())
    seed = ExtractGradient(x)
    if not np.array_equal(seed, np.eye(len(x))):
        jacobian = jacobian @ seed
    return np.asarray(InitializeAutoDiff(value, jacobian)).ravel()
