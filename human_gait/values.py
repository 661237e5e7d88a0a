"""Values that hold arrays: compared by what they hold, pickled without what they have cached.

A frozen dataclass compares its fields as one tuple; with arrays among them that ends in numpy's
"truth value of an array is ambiguous". A dataclass that is a `Value` compares arrays as a whole::

    @dataclass(frozen=True, eq=False)
    class Foot(Value):
        points: FloatArray
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Self, TypeVar

import numpy as np

T = TypeVar("T", bound=tuple[Any, ...])

_SMALL = 6  # elements of an array that is shown


@dataclass(frozen=True, eq=False)
class Value:
    """Base of frozen dataclasses with arrays among their fields.

    Two are equal if they are of one class and all fields are equal: arrays by shape and elements,
    mappings and sequences by what is in them; NaN is equal to itself; an array is equal to arrays
    only, not to a list or a number; fields declared with ``compare=False`` do not count. Equal
    values have equal hashes. Copies and pickles hold the fields only, hence no cached property.

    Notes
    -----
    Subclasses are decorated with ``eq=False``, else `dataclass` would write its own comparison, and
    with ``repr=False`` for a text that has the shapes of arrays instead of their elements.
    """

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return self is other or _same(self._compared(), other._compared())

    def __hash__(self) -> int:
        return hash((type(self), _key(self._compared())))

    def __repr__(self) -> str:
        shown = (f"{item.name}={_short(getattr(self, item.name))}" for item in fields(self))
        return f"{type(self).__name__}({', '.join(shown)})"

    def __getstate__(self) -> dict[str, Any]:
        return {item.name: getattr(self, item.name) for item in fields(self)}

    def frozen(self) -> Self:
        """Return the value itself, whose arrays nobody can write to from now on."""
        _freeze(self)
        return self

    def _compared(self) -> dict[str, Any]:
        return {item.name: getattr(self, item.name) for item in fields(self) if item.compare}


def tuple_of_arrays(kind: type[T]) -> type[T]:
    """Have a named tuple of arrays compare, hash and show itself as a `Value` does."""

    def same(self: T, other: object) -> bool:
        return type(other) is kind and _same(self, other)

    def other_than(self: T, other: object) -> bool:
        return not same(self, other)

    def hashed(self: T) -> int:
        return hash((kind, _key(self)))

    def shown(self: T) -> str:
        pairs = zip(kind._fields, self, strict=True)  # type: ignore[attr-defined]
        return f"{kind.__name__}({', '.join(f'{name}={_short(item)}' for name, item in pairs)})"

    kind.__eq__, kind.__ne__ = same, other_than  # type: ignore[method-assign, assignment]
    kind.__hash__, kind.__repr__ = hashed, shown  # type: ignore[method-assign, assignment]
    return kind


def _short(value: object) -> str:
    """Return a value as text; of arrays that are not small the shape."""
    if isinstance(value, np.ndarray):
        return f"<{' x '.join(map(str, value.shape))} array>" if value.size > _SMALL else str(value)
    if isinstance(value, Mapping):
        return f"<{len(value)} by name>"
    return repr(value)


def _freeze(value: object) -> None:
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
    elif isinstance(value, Value):
        _freeze(value.__getstate__())
    elif isinstance(value, Mapping):
        _freeze(tuple(value.values()))
    elif isinstance(value, tuple | list):
        for item in value:
            _freeze(item)


def _same(one: object, other: object) -> bool:
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return _same_arrays(one, other)
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, tuple | list) and isinstance(other, tuple | list):
        pairs = zip(one, other, strict=False)
        alike = type(one) is type(other) and len(one) == len(other)
        return alike and all(_same(*pair) for pair in pairs)
    both_nan = one != one and other != other  # noqa: PLR0124, what only NaN is
    return bool(one == other) or both_nan


def _same_arrays(one: object, other: object) -> bool:
    if not isinstance(one, np.ndarray) or not isinstance(other, np.ndarray):
        return False  # a list of the same numbers has another hash
    can_be_nan = one.dtype.kind in "fc" and other.dtype.kind in "fc"
    return bool(np.array_equal(one, other, equal_nan=can_be_nan))


def _key(value: object) -> object:
    """Return something to hash that is the same for equal values: of arrays the shape alone."""
    if isinstance(value, np.ndarray):
        return value.shape
    if isinstance(value, Mapping):
        return frozenset((name, _key(item)) for name, item in value.items())
    if isinstance(value, tuple | list):
        return tuple(_key(item) for item in value)
    return None if value != value else value  # noqa: PLR0124, NaN has a hash for each object
