"""The functions of the walk in its free control points: costs, rows, first and second derivatives.

Nothing here knows Drake or who asks. What has been computed at a point is kept until the next one:
solvers ask for costs and rows at the same points one after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import N_DOF
from human_gait.newton.cyclic_band import CyclicBand
from human_gait.problem import chain_rule
from human_gait.problem.residual import Constraint, Residual
from human_gait.problem.term import Term
from human_gait.problem.transcription import Transcription
from human_gait.scenario import Scenario
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.bspline import Basis
from human_gait.walk.gait import constrained_grid
from human_gait.walk.instant import Instants, Walker


class WalkFunctions:
    """Costs and rows of a scenario as functions of the free control points, (m * 55,).

    Attributes
    ----------
    walker : Walker
    basis : Basis
    times : (K,) array, [s]
        The grid of instants. T itself is left out where it is the mirror image of 0.
    spacing : (K,) array, [s]
        The time that each instant stands for in an integral.
    transcription : Transcription
    evaluations : int
        How many points were evaluated.
    observe : function or None
        Is given every point when it is evaluated.
    """

    def __init__(
        self,
        scenario: Scenario,
        basis: Basis,
        dynamics: str = "pinocchio",
        like: WalkFunctions | None = None,
    ) -> None:
        self.basis = basis
        self.walker: Walker = like.walker.moved_to(scenario) if like else Walker(scenario, dynamics)
        self.times, self.spacing = constrained_grid(scenario)
        self.transcription = Transcription(basis, self.times)
        self.evaluations = 0
        self.observe: Callable[[FloatArray], None] | None = None
        self._known: tuple[bytes, Instants, dict[Constraint | Term, Any]] | None = None

    def instants(self, free: FloatArray) -> Instants:
        """Return everything known at the instants of the grid; the last result is kept."""
        key = free.tobytes()
        if self._known is None or self._known[0] != key:
            self._known = key, self.evaluated(free), {}
            self.evaluations += 1
            if self.observe:
                self.observe(free)
        return self._known[1]

    def watched_by(self, observe: Callable[[FloatArray], None]) -> None:
        """Give every point that is evaluated from now on to a function, and count anew."""
        self._known, self.observe, self.evaluations = None, observe, 0

    def evaluated(self, free: FloatArray) -> Instants:
        """Return everything known at the instants, unseen by who watches."""
        return self.walker.at(self.times, *self.transcription.motion(self.expanded(free)))

    def expanded(self, free: FloatArray) -> FloatArray:
        """Return all control points (n, 55) from the free ones, Eq. (26)."""
        return self.basis.expand(free.reshape(-1, N_DOF))

    def cost(self, terms: Iterable[Term], free: FloatArray) -> tuple[float, FloatArray]:
        """Return the sum of terms [N^2 m^2 s] and its gradient in the free control points."""
        once = [(term, 1.0) for term in terms]
        return self.value(free, once), self.gradient(free, once)

    def value(self, free: FloatArray, terms: Iterable[tuple[Term, float]]) -> float:
        """Return the sum of terms times factors."""
        return sum(factor * self.integral(term, free) for term, factor in terms)

    def gradient(self, free: FloatArray, terms: Iterable[tuple[Term, float]]) -> FloatArray:
        """Return the gradient (m * 55,) of the sum of terms times factors, in one pass."""
        now = self.instants(free)
        K, n = now.ground.variables.value.shape
        adjoint = Adjoint.none(K, n, first_only=True)
        for term, factor in terms:
            term.add_to_adjoint(now, self.spacing, factor, adjoint)
        return self.transcription.gradient(self.walker.gradient(now, adjoint))

    def integral(self, term: Term, free: FloatArray) -> float:
        """Return a term [N^2 m^2 s]."""
        return float(self._once(term, free, lambda now: term.value(now, self.spacing)))

    def rows(self, constraint: Constraint, free: FloatArray) -> Residual:
        """Return the rows of a constraint with their partials in q, v, a."""
        found: Residual = self._once(constraint, free, constraint.evaluate)
        return found

    def _once(
        self, what: Constraint | Term, free: FloatArray, evaluate: Callable[[Instants], Any]
    ) -> Any:
        """Return what is known of a constraint or a term at a point."""
        now = self.instants(free)
        known = self._known[2] if self._known else {}
        if what not in known:
            known[what] = evaluate(now)
        return known[what]

    def residual(self, constraint: Constraint, free: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rows (r,) of a constraint and their Jacobian (r, m * 55)."""
        residual = self.rows(constraint, free)
        return residual.value, self.transcription.jacobian(constraint, residual)

    def hessian(
        self,
        free: FloatArray,
        terms: Sequence[tuple[Term, float]],
        constraints: Iterable[tuple[Constraint, FloatArray, FloatArray]],
    ) -> CyclicBand:
        """Return the Hessian of the Lagrangian in the free control points, (m * 55, m * 55).

        Of the sum of terms times factors and of functions of rows of constraints that have the
        multipliers (r,) as derivatives and the curvature (r,) as second derivatives by each row.
        """
        now = self.instants(free)
        adjoint = Adjoint.none(*now.ground.variables.value.shape)
        for term, factor in terms:
            term.add_to_adjoint(now, self.spacing, factor, adjoint)
        for constraint, multipliers, curvature in constraints:
            constraint.to_adjoint(now, multipliers, curvature, adjoint)
        second = self.walker.second_derivatives(now, adjoint)
        return chain_rule.hessian(self.transcription.grid, second)
