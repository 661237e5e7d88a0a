"""What the user states of files that do not say it themselves: units, axes, names, events."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TypedDict

from human_gait.body.skeleton import SIDES
from human_gait.exceptions import TrialError, shown
from human_gait.trials.axes import DIRECTIONS

ANGLE: Mapping[str, float] = {"deg": math.pi / 180.0, "rad": 1.0}
LENGTH: Mapping[str, float] = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
FORCE: Mapping[str, float] = {"N": 1.0}
MOMENT: Mapping[str, float] = {"Nm": 1.0, "Nmm": 1e-3, "Nm/kg": 1.0, "Nmm/kg": 1e-3}
UNITS: tuple[str, ...] = (*ANGLE, *LENGTH, *MOMENT)
"""What ``--units`` can be."""

THRESHOLD = 20.0
"""Vertical force on a foot that stands, [N]."""

_NAMED = re.compile(r"\s*([^=\s]+)\s*=\s*([+-]?)\s*(\S.*?)\s*")


class Options(TypedDict, total=False):
    """The arguments of `stated`, for the signatures of those that pass them on."""

    units: str | Iterable[str]
    up: str
    forward: str
    map: Iterable[str] | Mapping[str, str]
    events: str | Iterable[float]
    feet: Iterable[str] | Mapping[str, str]
    mass: float | None
    side: str


@dataclass(frozen=True)
class Stated:
    """What the user states.

    Attributes
    ----------
    units : tuple of str
        Of ``UNITS``.
    up, forward : str
        Of ``axes.DIRECTIONS``; empty where nothing is stated.
    names : mapping of str to (str, float)
        Column of the source and its sign by curve of the gait cycle.
    strikes : tuple of float, [s]
        When the heel of the side meets the ground.
    feet : mapping of str to str
        ``r`` or ``l`` by the name of a force plate.
    mass : float or None, [kg]
    side : str
        ``r`` or ``l``: the leg whose cycles count.
    threshold : float, [N]
    """

    units: tuple[str, ...] = ()
    up: str = ""
    forward: str = ""
    names: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    strikes: tuple[float, ...] = ()
    feet: Mapping[str, str] = field(default_factory=dict)
    mass: float | None = None
    side: str = "r"
    threshold: float = THRESHOLD

    def unit(self, kind: Mapping[str, float]) -> str:
        """Return the unit that is stated of a kind, such as ``ANGLE``; empty if none is."""
        return next((unit for unit in self.units if unit in kind), "")


def stated(  # noqa: PLR0913, as many as the command has options
    *,
    units: str | Iterable[str] = (),
    up: str = "",
    forward: str = "",
    map: Iterable[str] | Mapping[str, str] = (),  # noqa: A002, as the option is called
    events: str | Iterable[float] = "",
    feet: Iterable[str] | Mapping[str, str] = (),
    mass: float | None = None,
    side: str = "r",
) -> Stated:
    """Return what is stated, as options of the command or arguments of a call have it.

    Parameters
    ----------
    units : str or iterable of str
        ``deg``, ``rad``, ``mm``, ``m``, ...
    up, forward : str
        Along which axis of the files, or against it: ``z``, ``-x``.
    map : iterable of str, or mapping
        ``knee_flexion_deg=-knee_angle_r``: curve, sign and column.
    events : str or iterable of float
        Strikes of the foot, [s]: ``0.52,1.63``.
    feet : iterable of str, or mapping
        ``1=r``: which foot is on a force plate.
    mass : float, optional, [kg]
    side : str
        ``r`` or ``l``: the leg whose cycles count.

    Raises
    ------
    TrialError
        If something is not of its form; in one line that names the option.
    """
    given = [units] if isinstance(units, str) else list(units)
    listed = [unit for text in given for unit in text.split(",") if unit]
    return Stated(
        tuple(_one_of("--units", unit.strip(), UNITS) for unit in listed),
        _one_of("--up", up, DIRECTIONS) if up else "",
        _one_of("--forward", forward, DIRECTIONS) if forward else "",
        dict(_name(text) for text in _pairs(map)),
        _times(events),
        dict(_foot(text) for text in _pairs(feet)),
        _mass(mass),
        _one_of("--side", side, SIDES),
    )


def _pairs(given: Iterable[str] | Mapping[str, str]) -> list[str]:
    if isinstance(given, Mapping):
        return [f"{key}={value}" for key, value in given.items()]
    return [given] if isinstance(given, str) else list(given)


def _one_of(option: str, value: str, allowed: Sequence[str]) -> str:
    if value not in allowed:
        raise TrialError(f"{option} = {shown(value)}: must be one of {', '.join(allowed)}")
    return value


def _name(text: str) -> tuple[str, tuple[str, float]]:
    if not (matched := _NAMED.fullmatch(text)):
        form = "must be of the form knee_flexion_deg=-knee_angle_r: a curve, a sign, a column"
        raise TrialError(f"--map = {shown(text)}: {form}")
    curve, sign, column = matched.groups()
    return curve, (column, -1.0 if sign == "-" else 1.0)


def _foot(text: str) -> tuple[str, str]:
    plate, _, side = text.rpartition("=")
    if "=" not in text or side not in SIDES:
        form = "must be of the form 1=r: the name of a force plate, which may be empty, and r or l"
        raise TrialError(f"--feet = {shown(text)}: {form}")
    return plate, side


def _times(events: str | Iterable[float]) -> tuple[float, ...]:
    parts = [x for x in events.split(",") if x.strip()] if isinstance(events, str) else events
    try:
        times = tuple(float(part) for part in parts)
    except (TypeError, ValueError):
        times = (math.nan,)
    rises = all(a < b for a, b in pairwise(times))
    if not (all(map(math.isfinite, times)) and rises) or len(times) == 1:
        form = "must be the times of two strikes of the foot or more, rising: 0.52,1.63"
        raise TrialError(f"--events = {shown(events)}: {form} [s]")
    return times


def _mass(mass: float | None) -> float | None:
    if mass is not None and not 1.0 <= mass <= 500.0:
        raise TrialError(f"--mass = {mass!r}: must be from 1 to 500 [kg]")
    return mass
