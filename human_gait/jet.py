"""Values together with their partial derivatives in the state (q, v, a) of the instant."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Jet:
    """A quantity at K instants and its gradient in the S state variables of each instant.

    Arithmetic follows the sum, product and quotient rules; anything that is not a Jet is constant.

    Attributes
    ----------
    value : (K, ...) array
    partials : (K, ..., S) array
    """

    value: FloatArray
    partials: FloatArray

    __array_ufunc__ = None  # array * jet is left to the jet

    def __getitem__(self, key: Any) -> Jet:
        """Index the value; the partials follow."""
        return Jet(self.value[key], self.partials[key])

    def __neg__(self) -> Jet:
        return Jet(-self.value, -self.partials)

    def __add__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            return Jet(self.value + other.value, self.partials + other.partials)
        return Jet(self.value + other, self.partials)

    def __sub__(self, other: Any) -> Jet:
        return self.__add__(-other)

    def __mul__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            partials = (
                self.value[..., None] * other.partials + other.value[..., None] * self.partials
            )
            return Jet(self.value * other.value, partials)
        factor = np.asarray(other)
        return Jet(self.value * factor, factor[..., None] * self.partials)

    def __truediv__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            return self * other.map(lambda y: 1.0 / y, lambda y: -1.0 / y**2)
        return self * (1.0 / np.asarray(other))

    __radd__ = __add__
    __rmul__ = __mul__

    def __rsub__(self, other: Any) -> Jet:
        return (-self).__add__(other)

    def map(
        self, f: Callable[[FloatArray], FloatArray], df: Callable[[FloatArray], FloatArray]
    ) -> Jet:
        """Return f of the quantity, given its derivative df."""
        return Jet(f(self.value), df(self.value)[..., None] * self.partials)

    def where(self, condition: npt.NDArray[np.bool_], otherwise: float) -> Jet:
        """Return the quantity where `condition` holds and a constant elsewhere."""
        partials = np.where(condition[..., None], self.partials, 0.0)
        return Jet(np.where(condition, self.value, otherwise), partials)


def stack(parts: Sequence[Jet]) -> Jet:
    """Return jets side by side, as a new last axis of the value."""
    value = np.stack([part.value for part in parts], axis=-1)
    return Jet(value, np.stack([part.partials for part in parts], axis=-2))


def cross(a: Jet, b: Jet) -> Jet:
    """Return the cross product of two vectors (K, 3)."""
    (ax, ay, az), (bx, by, bz) = ((j[:, 0], j[:, 1], j[:, 2]) for j in (a, b))
    return stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
