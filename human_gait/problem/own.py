"""Costs and constraints of one's own: functions of the motion and of the muscle torques.

    running cost       integral over the step of  weight * sum_r rows_r^2   (or of weight * rows)
    path constraint    lower <= rows <= upper at the instants of the grid

A function gets the motion at K instants and returns r rows with their partials. Second derivatives
may be given; else a squared cost takes those of Gauss and Newton, everything else differences of
the first ones. All solvers honour both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import N_DOF
from human_gait.problem.objective import UNIT, Term
from human_gait.problem.residual import Constraint, Demand, Residual
from human_gait.values import Value, tuple_of_arrays
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.instant import Instants

_STEP = 1e-6  # of a difference, [rad], [m] and their rates; of torques by _TORQUE_STEP
_TORQUE_STEP = 1e-3  # [N m]


@tuple_of_arrays
class Motion(NamedTuple):
    """The motion at K instants of a step.

    Attributes
    ----------
    t : (K,) array, [s]
    q, v, a : (K, 55) array, [rad], [m] and their rates
        In the order of `Gait.joint_names`.
    torque : (K, 55) array, [N m]
        Of the muscles; 0 for the six global DOF.
    """

    t: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    torque: FloatArray


@tuple_of_arrays
class Rows(NamedTuple):
    """What a function of the motion returns.

    Attributes
    ----------
    value : (K, r) array
    by_q, by_v, by_a, by_torque : (K, r, 55) array, optional
        Partials; None where nothing depends on it.
    """

    value: FloatArray
    by_q: FloatArray | None = None
    by_v: FloatArray | None = None
    by_a: FloatArray | None = None
    by_torque: FloatArray | None = None


Function = Callable[[Motion], Rows]
SecondDerivative = Callable[[Motion, FloatArray], FloatArray]
_INPUTS = ("q", "v", "a", "torque")


@dataclass(frozen=True, eq=False, repr=False)
class RunningCost(Value):
    """A cost of one's own, an integral over the step that is added to the objective.

    Attributes
    ----------
    name : str
    rows : function
        `Motion` at K instants -> `Rows`.
    weight : float, [N^2 m^2] per unit of the squared rows (or of the rows)
    squared : bool
        Whether the rows are squared; else they are integrated as they are.
    second : function, optional
        Motion, multipliers (K, r) -> second derivatives (K, 220, 220), by q, v, a and torque, of
        the sum of multipliers * rows.
    """

    name: str
    rows: Function
    weight: float = 1.0
    squared: bool = True
    second: SecondDerivative | None = None

    def term(self) -> Term:
        """Return it as a term of the objective."""
        return Term(self.name, UNIT, "", self._evaluate, self._add_to_adjoint)

    def _slopes(self, rows: Rows, spacing: FloatArray) -> FloatArray:
        """Return the derivatives (K, r) of the integral by the rows."""
        weight = self.weight * spacing[:, None]
        return 2.0 * weight * rows.value if self.squared else weight + 0.0 * rows.value

    def _evaluate(self, now: Instants, spacing: FloatArray) -> tuple[float, FloatArray]:
        rows = _rows(self.rows, self.name, now)
        density = (rows.value**2 if self.squared else rows.value).sum(axis=1)
        partials = np.einsum("kr,krs->ks", self._slopes(rows, spacing), _by_state(rows, now))
        return float(self.weight * spacing @ density), partials

    def _add_to_adjoint(
        self, now: Instants, spacing: FloatArray, factor: float, adjoint: Adjoint
    ) -> None:
        rows, spacing = _rows(self.rows, self.name, now), factor * spacing
        if self.squared:  # Gauss and Newton: 2 w J^T J
            J = _by_state(rows, now)
            size = np.sqrt(np.abs(2.0 * self.weight * spacing))[:, None, None]
            if self.weight > 0.0:
                adjoint.squares.append(size * J)
            else:
                adjoint.products.append((self.weight * spacing[:, None, None] * J, J))
        slopes = self._slopes(rows, spacing)
        if rows.by_torque is not None:
            adjoint.torque[:] += np.einsum("kr,kri->ki", slopes, rows.by_torque)
        if self.second or not self.squared:
            _add_second(self.rows, self.second, now, rows, slopes, adjoint)


@dataclass(frozen=True, eq=False, repr=False)
class PathConstraint(Value):
    """A constraint of one's own, at all instants at which the ground's forces are constrained.

    Attributes
    ----------
    name : str
        Unlike that of any other constraint.
    rows : function
        `Motion` at K instants -> `Rows`.
    lower, upper : float or (r,) array
        Bounds of the rows; infinite where there are none.
    unit : str
    what : sequence of str, r of them, optional
        What each row is about, in words.
    meaning : str, optional
        What it stands for, as an answer to "why does it walk like this?".
    second : function, optional
        As that of `RunningCost`.
    """

    name: str
    rows: Function
    lower: npt.ArrayLike = -np.inf
    upper: npt.ArrayLike = np.inf
    unit: str = ""
    what: Sequence[str] = ()
    meaning: str = ""
    second: SecondDerivative | None = None

    def constraint(self, now: Instants) -> Constraint:
        """Return it as a constraint of the problem at instants like these.

        Raises
        ------
        ValueError
            If bounds or words are not as many as the rows.
        """
        K, r = _rows(self.rows, self.name, now).value.shape
        what = tuple(self.what) or tuple(f"row {i + 1}" for i in range(r))
        if len(what) != r:
            raise ValueError(f"{self.name}: {len(what)} words for {r} rows")
        lower, upper = (self._bound(bound, r) for bound in (self.lower, self.upper))
        k = np.repeat(np.arange(K), r)
        return Constraint(
            demand=Demand(name=self.name, meaning=self.meaning),
            unit=self.unit,
            lower=np.tile(lower, K),
            upper=np.tile(upper, K),
            instants=k,
            columns=np.tile(np.arange(N_DOF), (K * r, 1)),
            what=np.tile(np.array(what), K),
            evaluate=self._evaluate,
            to_adjoint=self._add_to_adjoint,
        )

    def _bound(self, bound: npt.ArrayLike, r: int) -> FloatArray:
        try:
            return np.broadcast_to(np.asarray(bound, dtype=float), (r,))
        except ValueError:
            message = f"{self.name}: bounds of shape {np.shape(bound)} for {r} rows"
            raise ValueError(message) from None

    def _evaluate(self, now: Instants) -> Residual:
        rows = _rows(self.rows, self.name, now)
        by_state = _by_state(rows, now).reshape(-1, 3 * N_DOF)
        return Residual(rows.value.ravel(), *np.split(by_state, 3, axis=1))

    def _add_to_adjoint(self, now: Instants, multipliers: FloatArray, adjoint: Adjoint) -> None:
        rows = _rows(self.rows, self.name, now)
        slopes = multipliers.reshape(rows.value.shape)
        if rows.by_torque is not None:
            adjoint.torque[:] += np.einsum("kr,kri->ki", slopes, rows.by_torque)
        _add_second(self.rows, self.second, now, rows, slopes, adjoint)


def _motion(now: Instants) -> Motion:
    return Motion(now.t, now.q, now.v, now.a, now.muscle_torque.value)


def _rows(function: Function, name: str, now: Instants) -> Rows:
    """Return what a function says of instants, of the shapes that it should have."""
    rows = Rows(*function(_motion(now)))
    K = len(now.t)
    if np.ndim(rows.value) != 2 or len(rows.value) != K:
        raise ValueError(f"{name}: rows of shape {np.shape(rows.value)}, must be ({K}, r)")
    shape = (*np.shape(rows.value), N_DOF)
    for label, partial in zip(_INPUTS, rows[1:], strict=True):
        if partial is not None and np.shape(partial) != shape:
            raise ValueError(f"{name}: by_{label} of shape {np.shape(partial)}, must be {shape}")
    return rows


def _by_state(rows: Rows, now: Instants) -> FloatArray:
    """Return the partials (K, r, 165) in q, v, a, those of the torques included."""
    by = np.zeros((*rows.value.shape, 3, N_DOF))
    for order, partial in enumerate(rows[1:4]):
        if partial is not None:
            by[:, :, order] = partial
    flat = by.reshape(*rows.value.shape, 3 * N_DOF)
    if rows.by_torque is not None:
        flat += rows.by_torque @ now.muscle_torque.partials
    return flat


def _add_second(
    function: Function,
    second: SecondDerivative | None,
    now: Instants,
    rows: Rows,
    slopes: FloatArray,
    adjoint: Adjoint,
) -> None:
    """Add the second derivatives of the sum of slopes * rows, torques taken as they are.

    With those by (q, v, a, torque), L, and the partials S of (q, v, a, torque) in q, v, a they are
    S^T L S; what the torques add by their own second derivatives the adjoint knows already.
    """
    motion = _motion(now)
    given = second(motion, slopes) if second else _differences(function, motion, rows, slopes)
    S = np.zeros((len(now.t), 4 * N_DOF, 3 * N_DOF))
    S[:, : 3 * N_DOF] = np.eye(3 * N_DOF)
    S[:, 3 * N_DOF :] = now.muscle_torque.partials
    used = np.flatnonzero(given.any(axis=(0, 1)))
    L = given[:, used[:, None], used]
    S = S[:, used]
    adjoint.products.append((L @ S / 2.0, S))


def _differences(function: Function, motion: Motion, rows: Rows, slopes: FloatArray) -> FloatArray:
    """Return second derivatives (K, 220, 220) as central differences of the first ones."""
    kinds = [i for i, partial in enumerate(rows[1:]) if partial is not None]
    second = np.zeros((len(motion.t), 4 * N_DOF, 4 * N_DOF))
    for kind in kinds:
        step = _TORQUE_STEP if _INPUTS[kind] == "torque" else _STEP
        for dof in range(N_DOF):
            ahead, behind = (
                _gradient(function(_moved(motion, kind, dof, by)), slopes) for by in (step, -step)
            )
            second[:, kind * N_DOF + dof] = (ahead - behind) / (2.0 * step)
    return (second + second.swapaxes(1, 2)) / 2.0


def _moved(motion: Motion, kind: int, dof: int, by: float) -> Motion:
    """Return the motion with one coordinate changed at all instants."""
    changed = motion[1 + kind].copy()
    changed[:, dof] += by
    return motion._replace(**{_INPUTS[kind]: changed})


def _gradient(rows: Rows, slopes: FloatArray) -> FloatArray:
    """Return the gradient (K, 220) of the sum of slopes * rows by q, v, a, torque."""
    none = np.zeros((len(slopes), N_DOF))
    parts = [
        none if partial is None else np.einsum("kr,kri->ki", slopes, partial)
        for partial in Rows(*rows)[1:]
    ]
    return np.concatenate(parts, axis=1)
