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
from numbers import Real
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import N_DOF
from human_gait.problem.residual import Constraint, Demand, Residual
from human_gait.problem.term import UNIT, Term
from human_gait.values import Value, tuple_of_arrays
from human_gait.walk.adjoint import Adjoint
from human_gait.walk.instant import Instants

_STEP = 1e-6  # of a difference, [rad], [m] and their rates; of torques by _TORQUE_STEP
_TORQUE_STEP = 1e-3  # [N m]
_FEW = 2  # instants, at which given second derivatives are checked


@tuple_of_arrays
class Motion(NamedTuple):
    """The motion at K instants of a step.

    Those that functions are given cannot be written to.

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

    def checked(self, now: Instants) -> Self:
        """Return the cost itself, if it can be used at instants like these.

        Raises
        ------
        TypeError
            If the name is no text, the weight no number, or the function returns no `Rows`.
        ValueError
            If the weight, or what the functions return, is not finite or of another shape.
        """
        _check_texts(self, "name")
        weight: object = self.weight
        if not isinstance(weight, Real):
            raise TypeError(f"{self.name}: weight is {weight!r}, must be a number")
        if not np.isfinite(self.weight):
            raise ValueError(f"{self.name}: weight is {self.weight}, must be finite")
        _checked_rows(self, now)
        return self

    def term(self) -> Term:
        """Return it as a term of the objective."""
        return Term(self.name, UNIT, "", self._value, self._add_to_adjoint)

    def _slopes(self, rows: Rows, spacing: FloatArray) -> FloatArray:
        """Return the derivatives (K, r) of the integral by the rows."""
        weight = self.weight * spacing[:, None]
        return 2.0 * weight * rows.value if self.squared else weight + 0.0 * rows.value

    def _value(self, now: Instants, spacing: FloatArray) -> float:
        rows = _rows(self, _motion(now))
        density = (rows.value**2 if self.squared else rows.value).sum(axis=1)
        return float(self.weight * spacing @ density)

    def _add_to_adjoint(
        self, now: Instants, spacing: FloatArray, factor: float, adjoint: Adjoint
    ) -> None:
        rows, spacing = _rows(self, _motion(now)), factor * spacing
        slopes = self._slopes(rows, spacing)
        for order, partial in enumerate(rows[1:4]):
            if partial is not None:
                adjoint.state[:, order] += np.einsum("kr,kri->ki", slopes, partial)
        if rows.by_torque is not None:
            adjoint.torque[:] += np.einsum("kr,kri->ki", slopes, rows.by_torque)
        if adjoint.first_only:
            return
        if self.squared:  # Gauss and Newton: 2 w J^T J
            J = _by_state(rows, now)
            _add_products(self.weight * spacing[:, None, None] * J, J, adjoint)
        if self.second or not self.squared:
            _add_second(self, now, slopes, adjoint)


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
        Bounds of the rows; infinite where there are none. Each row has one at least.
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
        TypeError
            If name, unit, words or meaning are no text, or the function returns no `Rows`.
        ValueError
            If bounds or words are not as many as the rows, a row has no bounds or such that nothing
            is between, or what the functions return is not finite or of another shape.
        """
        _check_texts(self, "name", "unit", "meaning")
        K, r = _checked_rows(self, now).value.shape
        what, (lower, upper) = self._words(r), self._bounds(r)
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

    def _words(self, r: int) -> tuple[str, ...]:
        """Return what each row is about."""
        what = tuple(self.what) or tuple(f"row {i + 1}" for i in range(r))
        if isinstance(self.what, str) or not all(isinstance(word, str) for word in what):
            raise TypeError(f"{self.name}: what is {self.what!r}, must be a list of texts")
        if len(what) != r:
            raise ValueError(f"{self.name}: {len(what)} words for {r} rows")
        return what

    def _bounds(self, r: int) -> tuple[FloatArray, FloatArray]:
        """Return the bounds (r,) of the rows of an instant."""
        lower, upper = (self._bound(bound, r) for bound in (self.lower, self.upper))
        for i, (low, high) in enumerate(zip(lower, upper, strict=True), start=1):
            given = f"{self.name}: row {i} has the bounds {low:g} and {high:g}"
            if not low <= high:  # nor is NaN
                raise ValueError(f"{given}, must be numbers, lower <= upper")
            if np.isinf(low) and np.isinf(high):
                raise ValueError(f"{given}, one of them must be finite")
        return lower, upper

    def _bound(self, bound: npt.ArrayLike, r: int) -> FloatArray:
        given = _numbers(bound, self.name, "bounds")
        try:
            return np.broadcast_to(given, (r,))
        except ValueError:
            message = f"{self.name}: bounds of shape {np.shape(bound)} for {r} rows"
            raise ValueError(message) from None

    def _evaluate(self, now: Instants) -> Residual:
        rows = _rows(self, _motion(now))
        by_state = _by_state(rows, now).reshape(-1, 3 * N_DOF)
        return Residual(rows.value.ravel(), *np.split(by_state, 3, axis=1))

    def _add_to_adjoint(
        self, now: Instants, multipliers: FloatArray, curvature: FloatArray, adjoint: Adjoint
    ) -> None:
        rows = _rows(self, _motion(now))
        if curvature.any():
            J = _by_state(rows, now)
            _add_products(curvature.reshape(*J.shape[:2], 1) / 2.0 * J, J, adjoint)
        slopes = multipliers.reshape(rows.value.shape)
        if rows.by_torque is not None:
            adjoint.torque[:] += np.einsum("kr,kri->ki", slopes, rows.by_torque)
        _add_second(self, now, slopes, adjoint)


def _check_texts(own: RunningCost | PathConstraint, *fields: str) -> None:
    """Raise TypeError if a field is no text."""
    for field in fields:
        if not isinstance(given := getattr(own, field), str):
            raise TypeError(f"{own.name}: {field} is {given!r}, must be text")


def _motion(now: Instants) -> Motion:
    """Return the motion as views that cannot be written to: the arrays are those of the walk."""
    views = [given.view() for given in (now.t, now.q, now.v, now.a, now.muscle_torque)]
    for view in views:
        view.flags.writeable = False
    return Motion(*views)


def _numbers(given: object, name: str, what: str) -> FloatArray:
    """Return an array of numbers, or raise ValueError if that is not what is given."""
    try:
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: {what} are no array of numbers") from None


def _rows(own: RunningCost | PathConstraint, motion: Motion) -> Rows:
    """Return what a function says of a motion, of the shapes that it should have."""
    given: object = own.rows(motion)
    if not isinstance(given, Rows):
        raise TypeError(f"{own.name}: the function returns {type(given).__name__}, must be Rows")
    partials = {
        f"by_{label}": None if part is None else _numbers(part, own.name, f"by_{label}")
        for label, part in zip(_INPUTS, given[1:], strict=True)
    }
    rows = Rows(_numbers(given.value, own.name, "rows"), **partials)
    K, shape = len(motion.t), rows.value.shape
    if len(shape) != 2 or shape[0] != K or shape[1] == 0:
        raise ValueError(f"{own.name}: rows of shape {shape}, must be ({K}, r) with r > 0")
    for label, partial in partials.items():
        if partial is not None and partial.shape != (*shape, N_DOF):
            wanted = f"must be {(*shape, N_DOF)}"
            raise ValueError(f"{own.name}: {label} of shape {partial.shape}, {wanted}")
    return rows


def _second(
    own: RunningCost | PathConstraint,
    second: SecondDerivative,
    motion: Motion,
    slopes: FloatArray,
) -> FloatArray:
    """Return the second derivatives that are given with a function, of the shape they must have."""
    given = _numbers(second(motion, slopes), own.name, "second derivatives")
    shape = (len(motion.t), 4 * N_DOF, 4 * N_DOF)
    if given.shape != shape:
        wanted = f"must be {shape}"
        raise ValueError(f"{own.name}: second derivatives of shape {given.shape}, {wanted}")
    return given


def _checked_rows(own: RunningCost | PathConstraint, now: Instants) -> Rows:
    """Return the rows at instants, where they and all derivatives must be finite."""
    motion = _motion(now)
    rows = _rows(own, motion)
    parts = dict(zip(("rows", *(f"by_{label}" for label in _INPUTS)), rows, strict=True))
    if own.second:  # a few instants tell: those of all take much memory
        few = Motion(*(given[:_FEW] for given in motion))
        parts["second derivatives"] = _second(own, own.second, few, np.ones_like(rows.value[:_FEW]))
    for label, part in parts.items():
        if part is not None and not np.isfinite(part).all():
            raise ValueError(f"{own.name}: {label} at the first guess must be finite numbers")
    return rows


def _by_state(rows: Rows, now: Instants) -> FloatArray:
    """Return the partials (K, r, 165) in q, v, a, those of the torques included."""
    by = np.zeros((*rows.value.shape, 3, N_DOF))
    for order, partial in enumerate(rows[1:4]):
        if partial is not None:
            by[:, :, order] = partial
    flat = by.reshape(*rows.value.shape, 3 * N_DOF)
    if rows.by_torque is not None:
        flat += rows.by_torque @ now.muscle_partials
    return flat


def _add_second(
    own: RunningCost | PathConstraint,
    now: Instants,
    slopes: FloatArray,
    adjoint: Adjoint,
) -> None:
    """Add the second derivatives of the sum of slopes * rows, torques taken as they are.

    With those by (q, v, a, torque), L, and the partials S of (q, v, a, torque) in q, v, a they are
    S^T L S; what the torques add by their own second derivatives the adjoint knows already.
    """
    motion = _motion(now)
    if own.second:
        given = _second(own, own.second, motion, slopes)
    else:
        given = _differences(own, motion, slopes)
    S = np.zeros((len(now.t), 4 * N_DOF, 3 * N_DOF))
    S[:, : 3 * N_DOF] = np.eye(3 * N_DOF)
    S[:, 3 * N_DOF :] = now.muscle_partials
    used = np.flatnonzero(given.any(axis=(0, 1)))
    L = given[:, used[:, None], used]
    S = S[:, used]
    _add_products(L @ S / 2.0, S, adjoint)


def _add_products(B: FloatArray, C: FloatArray, adjoint: Adjoint) -> None:
    """Add B^T C + C^T B of rows (K, r, 165) in q, v, a."""
    shape = *C.shape[:2], 3, N_DOF
    adjoint.products.append((np.arange(N_DOF), B.reshape(shape), C.reshape(shape)))


def _differences(
    own: RunningCost | PathConstraint, motion: Motion, slopes: FloatArray
) -> FloatArray:
    """Return second derivatives (K, 220, 220) as central differences of the first ones."""
    kinds = [i for i, partial in enumerate(_rows(own, motion)[1:]) if partial is not None]
    second = np.zeros((len(motion.t), 4 * N_DOF, 4 * N_DOF))
    for kind in kinds:
        step = _TORQUE_STEP if _INPUTS[kind] == "torque" else _STEP
        for dof in range(N_DOF):
            ahead, behind = (
                _gradient(_rows(own, _moved(motion, kind, dof, by)), slopes) for by in (step, -step)
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
        for partial in rows[1:]
    ]
    return np.concatenate(parts, axis=1)
