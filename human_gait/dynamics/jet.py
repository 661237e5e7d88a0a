"""Values together with their partial derivatives at each instant."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.values import Value


@dataclass(frozen=True, eq=False)
class Linearised(Value):
    """A quantity at K instants and its gradient in the S = 165 of the state (q, v, a).

    Attributes
    ----------
    value : (K, ...) array
    partials : (K, ..., S) array
    """

    value: FloatArray
    partials: FloatArray

    def __getitem__(self, key: Any) -> Linearised:
        """Index the value; the partials follow."""
        return Linearised(self.value[key], self.partials[key])

    def __sub__(self, other: Linearised) -> Linearised:
        return Linearised(self.value - other.value, self.partials - other.partials)


@dataclass(frozen=True, eq=False)
class Jet(Value):
    """A quantity at K instants with its first and second derivatives in a few (S) variables.

    Arithmetic follows the sum, product and quotient rules; anything that is not a Jet is constant.

    Attributes
    ----------
    value : (K, ...) array
    partials : (K, ..., S) array
    second : (K, ..., S, S) array
        Symmetric.
    """

    value: FloatArray
    partials: FloatArray
    second: FloatArray

    __array_ufunc__ = None  # array * jet is left to the jet

    @classmethod
    def variables(cls, value: FloatArray) -> Jet:
        """Return S independent variables (K, S)."""
        K, S = value.shape
        return cls(value, np.tile(np.eye(S), (K, 1, 1)), np.zeros((K, S, S, S)))

    def __getitem__(self, key: Any) -> Jet:
        """Index the value; the derivatives follow."""
        return Jet(self.value[key], self.partials[key], self.second[key])

    def reshaped(self, *shape: int) -> Jet:
        """Return the value (K, *shape); the derivatives follow."""
        K, n = len(self.value), self.partials.shape[-1]
        return Jet(
            self.value.reshape(K, *shape),
            self.partials.reshape(K, *shape, n),
            self.second.reshape(K, *shape, n, n),
        )

    def __neg__(self) -> Jet:
        return Jet(-self.value, -self.partials, -self.second)

    def __add__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            sums = self.partials + other.partials, self.second + other.second
            return Jet(self.value + other.value, *sums)
        return Jet(self.value + other, self.partials, self.second)

    def __sub__(self, other: Any) -> Jet:
        return self.__add__(-other)

    def __mul__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            x = np.asarray(other)[..., None]
            return Jet(self.value * x[..., 0], self.partials * x, self.second * x[..., None])
        x, y = self.value[..., None], other.value[..., None]
        mixed = self.partials[..., :, None] * other.partials[..., None, :]
        second = mixed + mixed.swapaxes(-1, -2)
        second += x[..., None] * other.second + y[..., None] * self.second
        return Jet(self.value * other.value, x * other.partials + y * self.partials, second)

    def __truediv__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            return self * other.map(lambda y: 1 / y, lambda y: -1 / y**2, lambda y: 2 / y**3)
        return self * (1.0 / np.asarray(other))

    __radd__ = __add__
    __rmul__ = __mul__

    def __rsub__(self, other: Any) -> Jet:
        return (-self).__add__(other)

    def map(
        self,
        f: Callable[[FloatArray], FloatArray],
        df: Callable[[FloatArray], FloatArray],
        ddf: Callable[[FloatArray], FloatArray],
    ) -> Jet:
        """Return f of the quantity, given its first and second derivatives df and ddf."""
        slope, bend = df(self.value)[..., None], ddf(self.value)[..., None, None]
        squares = self.partials[..., :, None] * self.partials[..., None, :]
        second = slope[..., None] * self.second + bend * squares
        return Jet(f(self.value), slope * self.partials, second)

    def where(self, condition: npt.NDArray[np.bool_], otherwise: Jet | float) -> Jet:
        """Return the quantity where `condition` holds and another, or a constant, elsewhere."""
        other = otherwise if isinstance(otherwise, Jet) else Jet(np.asarray(otherwise), *_NONE)
        on = condition.reshape(*condition.shape, *[1] * (self.value.ndim - condition.ndim))
        return Jet(
            np.where(on, self.value, other.value),
            np.where(on[..., None], self.partials, other.partials),
            np.where(on[..., None, None], self.second, other.second),
        )


_NONE = (np.zeros(()), np.zeros(()))  # the derivatives of a constant


def joined(parts: Sequence[Jet]) -> Jet:
    """Return jets of vectors (K, n) one after the other."""
    return Jet(
        np.concatenate([part.value for part in parts], axis=1),
        np.concatenate([part.partials for part in parts], axis=1),
        np.concatenate([part.second for part in parts], axis=1),
    )


def stack(parts: Sequence[Jet]) -> Jet:
    """Return jets side by side, as a new last axis of the value."""
    value = np.stack([part.value for part in parts], axis=-1)
    partials = np.stack([part.partials for part in parts], axis=-2)
    return Jet(value, partials, np.stack([part.second for part in parts], axis=-3))


def cross(a: Jet, b: Jet) -> Jet:
    """Return the cross product of two vectors (K, 3)."""
    (ax, ay, az), (bx, by, bz) = ((j[:, 0], j[:, 1], j[:, 2]) for j in (a, b))
    return stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
