"""Quantities as people write them: ``"40 lb"``, ``"5 ft 9 in"``, ``"4 km/h"``, ``"-10 deg"``.

All factors are exact (BIPM; the yard and pound agreement of 1959) but those with pi, and a sum is
rounded once: ``"180 cm"`` is the same number as 1.8.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple

_INCH, _POUND = Fraction("0.0254"), Fraction("0.45359237")  # [m], [kg]
_MILE, _HOUR = 63360 * _INCH, 3600  # [m], [s]
_RADIAN = 180 / Fraction(math.pi)  # [deg]


class QuantityError(ValueError):
    """A quantity of the wrong kind or in an unknown unit; the message ends a sentence."""


class Dimension(NamedTuple):
    """Everything of one kind that can be measured.

    Attributes
    ----------
    noun : str
        Its name with its article.
    example : str
        A quantity of the kind.
    units : dict
        Factor to the unit of the settings by the names of each unit, in lower case.
    parts : tuple of pairs
        Names of units that are said together, the greater one and the smaller.
    """

    noun: str
    example: str
    units: dict[str, Fraction]
    parts: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = ()

    def names(self) -> list[str]:
        """Return one name of each unit, the first."""
        first: dict[Fraction, str] = {}
        for name, factor in self.units.items():
            first.setdefault(factor, name)
        return list(first.values())


def _by_name(*units: tuple[str, Fraction | int]) -> dict[str, Fraction]:
    return {name: Fraction(factor) for names, factor in units for name in names.split()}


_FEET, _INCHES = ("ft", "foot", "feet", "'"), ("in", "inch", "inches", '"', "''")
_STONES, _POUNDS = ("st", "stone"), ("lb", "lbs", "pound", "pounds")

_LENGTH = Dimension(
    "a length",
    '"180 cm"',
    _by_name(
        ("m metre metres meter meters", 1),
        ("cm", Fraction("0.01")),
        ("mm", Fraction("0.001")),
        ("km", 1000),
        (" ".join(_INCHES), _INCH),
        (" ".join(_FEET), 12 * _INCH),
        ("yd yard yards", 36 * _INCH),
    ),
    ((_FEET, _INCHES),),
)
_MASS = Dimension(
    "a mass",
    '"40 lb"',
    _by_name(
        ("kg", 1),
        ("g", Fraction("0.001")),
        (" ".join(_POUNDS), _POUND),
        ("oz ounce ounces", _POUND / 16),
        (" ".join(_STONES), 14 * _POUND),
    ),
    ((_STONES, _POUNDS),),
)
_SPEED = Dimension(
    "a speed",
    '"4 km/h"',
    _by_name(
        ("m/s", 1),
        ("cm/s", Fraction("0.01")),
        ("km/h kmh kph", Fraction(1000, _HOUR)),
        ("mph mi/h", _MILE / _HOUR),
        ("ft/s", 12 * _INCH),
        ("m/min", Fraction(1, 60)),
    ),
)
_ANGLE = Dimension(
    "an angle", '"10 deg"', _by_name(("deg degree degrees °", 1), ("rad radian radians", _RADIAN))
)
_SQUARED_ANGLE = Dimension(
    "a squared angle", '"30 deg^2"', _by_name(("rad^2 rad²", 1), ("deg^2 deg²", 1 / _RADIAN**2))
)
_SHARE = Dimension("a share", '"15 %"', _by_name(("% percent", Fraction("0.01"))))

DIMENSIONS = {
    "m": _LENGTH,
    "kg": _MASS,
    "m/s": _SPEED,
    "deg": _ANGLE,
    "rad^2": _SQUARED_ANGLE,
    "of the step": _SHARE,
    "of the load": _SHARE,
}
"""Dimension by the unit of a setting; settings in other units are plain numbers."""

_NUMBER = r"(?:[0-9]{1,12}(?:\.[0-9]{0,15})?|\.[0-9]{1,15})(?:[eE][-+]?[0-9]{1,2})?"
_LONGEST = 100  # signs of a quantity: of more the expressions take for ever
_TYPED = {"'": "'\u2032\u2019", '"': '"\u2033\u201d', "-": "-\u2212"}  # signs that look alike
_PLAIN = str.maketrans({sign: plain for plain, signs in _TYPED.items() for sign in signs})


def in_unit(written: str, unit: str) -> float:
    """Return a quantity as a number in the unit of a setting.

    Parameters
    ----------
    written : str
        Number and unit, or two of them such as feet and inches (which may do without its unit).
    unit : str
        A key of `DIMENSIONS`.

    Raises
    ------
    QuantityError
        If it is a quantity of another dimension or its unit is unknown.
    ValueError
        If it is no quantity at all.
    """
    wanted = DIMENSIONS[unit]
    if len(written) > _LONGEST:
        raise ValueError
    value = _value(written, wanted)
    if value is not None:
        return float(value)
    for other in DIMENSIONS.values():
        if _value(written, other) is not None:
            what = f"is {other.noun}, {wanted.noun} is wanted, such as {wanted.example}"
            raise QuantityError(what)
    if found := re.fullmatch(rf"\s*[-+\u2212]?\s*{_NUMBER}\s*([^\W\d_]\S*)\s*", written):
        raise QuantityError(_unknown(found[1], wanted))
    raise ValueError


def quantity_pattern(unit: str) -> str:
    """Return the regular expression of what `in_unit` takes, in what JavaScript has of them."""
    dimension = DIMENSIONS[unit]
    forms = [_form(greater, smaller) for greater, smaller in _said(dimension)]
    return rf"^\s*[-+\u2212]?\s*(?:{'|'.join(forms)})\s*$"


def _said(dimension: Dimension) -> tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]:
    """Return which units can follow each other; none need to."""
    return ((tuple(dimension.units), ()), *dimension.parts)


def _form(greater: tuple[str, ...], smaller: tuple[str, ...], group: str = "(?:") -> str:
    """Return the expression of a number with its unit and, if there is one, of the smaller part."""
    form = rf"{group}{_NUMBER})\s*{group}{_any_of(greater)})"
    if smaller:
        form += rf"\s*{group}{_NUMBER})\s*{group}{_any_of(smaller)})?"
    return form


def _any_of(names: tuple[str, ...]) -> str:
    """Return the expression of any of the names, in small or capital letters."""
    return "|".join("".join(map(_sign, name)) for name in names)


def _sign(sign: str) -> str:
    if sign in _TYPED:
        return f"[{_TYPED[sign]}]"
    return f"[{sign}{sign.upper()}]" if sign.isalpha() else re.escape(sign)


def _value(written: str, dimension: Dimension) -> Fraction | None:
    """Return the number, or None if the text is no quantity of the dimension."""
    for greater, smaller in _said(dimension):
        form = rf"\s*([-+\u2212]?)\s*{_form(greater, smaller, '(')}\s*"
        if match := re.fullmatch(form, written):
            sign, *parts = match.groups()
            size = sum(_terms(parts, dimension, smaller), Fraction(0))
            return -size if sign in set(_TYPED["-"]) else size
    return None


def _terms(
    parts: list[str | None], dimension: Dimension, smaller: tuple[str, ...]
) -> Iterator[Fraction]:
    """Yield each number times its unit; the last unit may be left out."""
    for number, name in zip(parts[::2], parts[1::2], strict=True):
        plain = name.translate(_PLAIN).lower() if name else smaller[0]
        yield Fraction(str(number)) * dimension.units[plain]


def _unknown(name: str, wanted: Dimension) -> str:
    known = [each for dimension in DIMENSIONS.values() for each in dimension.units]
    nearest = difflib.get_close_matches(name.lower(), known, n=1)
    hint = f"did you mean {nearest[0]}?" if nearest else f"known are {', '.join(wanted.names())}"
    return f"has an unknown unit, {name}, {hint}"
