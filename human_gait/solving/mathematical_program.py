"""A MathematicalProgram of Drake's as the functions that Newton steps need.

Costs and constraints whose evaluators offer exact second derivatives (`problem.drake.offers`) give
them in one pass; quadratic and linear ones have them; of all others they are differences of their
gradients. What Newton steps cannot honour is refused by name.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pydrake.solvers import (
    Binding,
    Constraint,
    EvaluatorBase,
    LinearConstraint,
    LinearCost,
    MathematicalProgram,
    ProgramAttribute,
    QuadraticConstraint,
    QuadraticCost,
)
from scipy.sparse import coo_array

from human_gait.arrays import FloatArray, IntArray
from human_gait.exceptions import UnsupportedProgram
from human_gait.newton.cyclic_band import CyclicBand
from human_gait.newton.matrix import Matrix, Sparse, matrix_of
from human_gait.newton.nonlinear_program import Duals, NonlinearProgram
from human_gait.newton.second_order import (
    Family,
    Linear,
    QuadraticForm,
    SecondOrder,
    Weighted,
    by_differences,
)
from human_gait.problem.drake import jacobian_of, offered, plain

HONOURED = {
    ProgramAttribute.kGenericCost,
    ProgramAttribute.kGenericConstraint,
    ProgramAttribute.kQuadraticCost,
    ProgramAttribute.kQuadraticConstraint,
    ProgramAttribute.kLinearCost,
    ProgramAttribute.kLinearConstraint,
    ProgramAttribute.kLinearEqualityConstraint,
    ProgramAttribute.kLorentzConeConstraint,
    ProgramAttribute.kRotatedLorentzConeConstraint,
    ProgramAttribute.kL2NormCost,
    ProgramAttribute.kCallback,
}
"""What a program may hold."""


@dataclass(frozen=True)
class _Part:
    """One cost or constraint: its function and which of the program's variables are its own."""

    binding: Binding
    function: SecondOrder
    columns: IntArray
    on: slice | IntArray

    @property
    def evaluator(self) -> EvaluatorBase:
        return self.binding.evaluator()


class _Members(NamedTuple):
    """Members of a family that are on the same variables, and which rows of the program are theirs.

    On all variables in their order they are given as a slice, so that nothing is copied.
    """

    family: Family
    on: slice | IntArray
    members: list[SecondOrder]
    rows: list[slice]


class ProgramFunctions:
    """A MathematicalProgram as functions of its decision variables (n,).

    Rows are those of the generic constraints, then of quadratic ones and cones, then linear ones.

    Parameters
    ----------
    prog : MathematicalProgram

    Raises
    ------
    UnsupportedProgram
        If the program holds something that Newton steps cannot honour.
    """

    def __init__(self, prog: MathematicalProgram) -> None:
        if complaint := unsupported(prog):
            raise UnsupportedProgram(complaint)
        self.n = prog.num_vars()
        self._prog = prog
        costs = [*prog.generic_costs(), *prog.linear_costs(), *prog.quadratic_costs()]
        curved = [*prog.generic_constraints(), *prog.quadratic_constraints()]
        curved += [*prog.lorentz_cone_constraints(), *prog.rotated_lorentz_cone_constraints()]
        linear = [*prog.linear_constraints(), *prog.linear_equality_constraints()]
        self.costs = [self._part(b) for b in [*costs, *prog.l2norm_costs()]]
        self.constraints = [self._part(b) for b in [*curved, *linear]]
        self._ends = np.cumsum([p.evaluator.num_constraints() for p in self.constraints])
        rows = [
            slice(end - p.evaluator.num_constraints(), end)
            for p, end in zip(self.constraints, self._ends.tolist(), strict=True)
        ]
        m = rows[-1].stop if rows else 0
        of_costs = [(p, slice(m, m + 1)) for p in self.costs]
        self._costs = _families(of_costs)
        self._all = _families([*of_costs, *zip(self.constraints, rows, strict=True)])

    def problem(self) -> NonlinearProgram:
        """Return the program as plain functions of its variables."""
        lower, upper = self.variable_bounds()
        bounds = [(p.evaluator.lower_bound(), p.evaluator.upper_bound()) for p in self.constraints]
        none = np.zeros(0), np.zeros(0)
        row_lower, row_upper = (np.concatenate(side) for side in zip(none, *bounds, strict=True))
        return NonlinearProgram(
            lower,
            upper,
            row_lower,
            row_upper,
            self.cost,
            self.gradient,
            self.rows,
            self._entries(),
            self.jacobian,
            self.hessian,
        )

    def variable_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return the bounds (n,) that all bounding boxes leave."""
        lower, upper = np.full(self.n, -np.inf), np.full(self.n, np.inf)
        for box in self._prog.bounding_box_constraints():
            columns = self._columns(box)
            np.maximum.at(lower, columns, box.evaluator().lower_bound())
            np.minimum.at(upper, columns, box.evaluator().upper_bound())
        return lower, upper

    def cost(self, x: FloatArray) -> float:
        """Return the sum of all costs."""
        return float(sum(c.family.cost(x[c.on], c.members) for c in self._costs))

    def gradient(self, x: FloatArray) -> FloatArray:
        """Return the gradient (n,) of the sum of all costs; callbacks are called at its points."""
        for callback in self._prog.visualization_callbacks():
            callback.evaluator().Eval(x[self._columns(callback)])
        slope = np.zeros(self.n)
        for c in self._costs:
            _add(slope, c.on, c.family.gradient(x[c.on], c.members))
        return slope

    def rows(self, x: FloatArray) -> FloatArray:
        """Return all rows (m,)."""
        rows = [p.function.value(x[p.on]) for p in self.constraints]
        return np.concatenate([np.zeros(0), *rows])

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Return the entries of the rows' Jacobian."""
        entries = [p.function.jacobian(x[p.on]) for p in self.constraints]
        return np.concatenate([np.zeros(0), *entries])

    def hessian(
        self, x: FloatArray, factor: float, multipliers: FloatArray, curvature: FloatArray
    ) -> FloatArray | Matrix:
        """Return the second derivatives (n, n) of factor * cost + multipliers * rows.

        J' diag(curvature) J of the rows is added.
        """
        y = np.append(multipliers, factor)  # costs are one more row, without curvature
        s = np.append(curvature, 0.0)
        found = []
        for of in self._all:
            members = zip(of.members, of.rows, strict=True)
            weighted = [Weighted(member, y[rows], s[rows]) for member, rows in members]
            found.append((of.on, matrix_of(of.family.hessian(x[of.on], weighted))))
        if band := _banded(found, self.n):
            return band
        second = np.zeros((self.n, self.n))
        for on, part in found:
            _add(second, on, part.dense())
        return second

    def duals_by_binding(self, duals: Duals) -> dict[tuple[EvaluatorBase, bytes], FloatArray]:
        """Return duals by constraint, in Drake's sign: d cost / d bound.

        The dual of a variable goes to the bounding boxes whose bound is the one that holds it.
        """
        parts = np.split(-duals.rows, self._ends[:-1]) if self.constraints else []
        found = {
            binding_key(p.binding): part for p, part in zip(self.constraints, parts, strict=True)
        }
        lower, upper = self.variable_bounds()
        for box in self._prog.bounding_box_constraints():
            columns, price = self._columns(box), -duals.variables
            at_lower = (price[columns] > 0.0) & (box.evaluator().lower_bound() == lower[columns])
            at_upper = (price[columns] < 0.0) & (box.evaluator().upper_bound() == upper[columns])
            found[binding_key(box)] = np.where(at_lower | at_upper, price[columns], 0.0)
        return found

    def duals_from_names(self, by_name: Mapping[str, FloatArray]) -> Duals:
        """Return duals from those by description of the constraint; 0 for rows that have none."""

        def of(evaluator: Constraint) -> FloatArray:
            m = evaluator.num_constraints()
            given = by_name.get(evaluator.get_description(), np.zeros(m))
            return -given if len(given) == m else np.zeros(m)

        variables = np.zeros(self.n)
        for box in self._prog.bounding_box_constraints():
            np.add.at(variables, self._columns(box), of(box.evaluator()))
        rows = [of(p.evaluator) for p in self.constraints]
        return Duals(np.concatenate([np.zeros(0), *rows]), variables)

    def _part(self, binding: Binding) -> _Part:
        evaluator, columns = binding.evaluator(), self._columns(binding)
        function = offered(evaluator) or _function(evaluator)
        every = np.array_equal(columns, np.arange(self.n))
        return _Part(binding, function, columns, slice(None) if every else columns)

    def _columns(self, binding: Binding) -> IntArray:
        indices = self._prog.FindDecisionVariableIndices(binding.variables())
        return np.array(indices, dtype=np.intp)

    def _entries(self) -> tuple[IntArray, IntArray]:
        """Return rows and columns of the Jacobian's entries."""
        rows, columns = [np.zeros(0, dtype=np.intp)], [np.zeros(0, dtype=np.intp)]
        first = np.concatenate([[0], self._ends]).astype(np.intp)
        for start, part in zip(first, self.constraints, strict=False):
            own = part.function.entries
            rows.append(start + own[0])
            columns.append(part.columns[own[1]])
        return np.concatenate(rows), np.concatenate(columns)


def _families(parts: Iterable[tuple[_Part, slice]]) -> list[_Members]:
    """Return parts by family and variables, with their rows."""
    found: dict[tuple[Family, bytes], _Members] = {}
    for part, rows in parts:
        key = part.function.family, part.columns.tobytes()
        home = found.setdefault(key, _Members(part.function.family, part.on, [], []))
        home.members.append(part.function)
        home.rows.append(rows)
    return list(found.values())


def _add(total: FloatArray, on: slice | IntArray, part: FloatArray) -> None:
    """Add derivatives by some variables, any of which may occur twice, to those by all."""
    if isinstance(on, slice):
        total += part
    else:
        np.add.at(total, np.ix_(*[on] * part.ndim), part)


def _banded(parts: list[tuple[slice | IntArray, Matrix]], n: int) -> CyclicBand | None:
    """Return the sum of a band and of matrices with few entries; None if it is not one."""
    bands = [part for on, part in parts if isinstance(part, CyclicBand) and isinstance(on, slice)]
    others = [(np.arange(n)[on], part) for on, part in parts if isinstance(part, Sparse)]
    if len(bands) != 1 or len(others) != len(parts) - 1:
        return None
    if not others:
        return bands[0]
    places = [on[np.stack(part.entries.coords)] for on, part in others]
    values = np.concatenate([part.entries.data for _, part in others])
    return bands[0].plus(coo_array((values, tuple(np.concatenate(places, axis=1))), shape=(n, n)))


def unsupported(prog: MathematicalProgram) -> str | None:
    """Return what Newton steps cannot honour in a program, by name; None if there is nothing."""
    kinds = sorted(prog.required_capabilities() - HONOURED, key=lambda kind: kind.name)
    if not kinds:
        return None
    in_the_way = ", ".join(_named(prog, kind) for kind in kinds)
    return f"newton cannot honour {in_the_way}"


def binding_key(binding: Binding) -> tuple[EvaluatorBase, bytes]:
    """Return what tells a binding from the others of its program."""
    ids = [variable.get_id() for variable in np.ravel(binding.variables())]
    return binding.evaluator(), np.array(ids, dtype=np.int64).tobytes()


def _named(prog: MathematicalProgram, kind: ProgramAttribute) -> str:
    """Return a kind in words, and what of it is in a program."""
    name = kind.name.removeprefix("k")
    words = re.sub("(?<!^)([A-Z])", r" \1", name).lower()
    accessor = re.sub("([A-Z])", r"_\1", name).lower().strip("_") + "s"
    bindings = getattr(prog, accessor)() if hasattr(prog, accessor) else []
    if not bindings:
        return f"a {words}"
    return ", ".join(f"the {words} {_title(binding)}" for binding in bindings)


def _title(binding: Binding) -> str:
    """Return the description of a binding, else which variables it is on."""
    described = binding.evaluator().get_description()
    names = [str(variable) for variable in np.ravel(binding.variables())]
    shown = ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
    return repr(described) if described else f"on {shown}"


def _function(evaluator: EvaluatorBase) -> SecondOrder:
    """Return an evaluator that offers nothing as a function with second derivatives."""
    if isinstance(evaluator, LinearConstraint):
        return Linear(evaluator.get_sparse_A(), np.zeros(evaluator.num_outputs()))
    if isinstance(evaluator, LinearCost):
        return Linear(np.atleast_2d(evaluator.a()), np.atleast_1d(evaluator.b()))
    if isinstance(evaluator, QuadraticCost):
        return QuadraticForm(evaluator.Q(), evaluator.b(), float(evaluator.c()))
    if isinstance(evaluator, QuadraticConstraint):
        return QuadraticForm(evaluator.Q(), evaluator.b())
    return plain(evaluator, by_differences(lambda x: jacobian_of(evaluator, x)))
