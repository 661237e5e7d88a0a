"""One claim about a gait: what was found, what is allowed, and what kind of claim it is."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from human_gait.arrays import FloatArray

EQUAL = 1e-9
"""Numbers that are the same but for rounding."""

BETWEEN = 1.5
"""What may be reached between the constrained instants, of a tolerance at them."""


class Kind(StrEnum):
    """What it takes to keep a claim, and so what to try where it is not kept."""

    FILE = "file"
    """The parts of a file belong together: only a file that was changed breaks it."""

    LAWS = "laws"
    """The laws of motion: a wrong computation breaks it, no walk does."""

    TIES = "ties"
    """The laws of a periodic motion: kept if the velocities of step and next step are tied."""

    GROUND = "ground"
    """What any ground can do."""

    FRICTION = "friction"
    """What only a floor of enough friction can do."""

    STRENGTH = "strength"
    """What only people of enough strength can do."""

    INSTANTS = "instants"
    """Constrained at the instants of the grid: between them kept if they are close enough."""

    PASSING = "passing"
    """The feet pass each other: the setting ``tolerances.feet_apart`` may have allowed less."""

    WALK = "walk"
    """What was asked of the walk, at all times or at one of the instants."""

    NOTE = "note"
    """Told and held against nothing: nobody has asked it of the walk, or nothing can tell."""


NO_LIMIT = float("inf")
"""Of a note: whatever was found passes."""


@dataclass(frozen=True)
class Check:
    """One claim about a gait.

    Attributes
    ----------
    name, unit : str
    value : float
        What was found, in `unit`.
    limit : float
        The largest value that passes; infinite for a note.
    time : float, [s]
        When the worst was found.
    kind : Kind
    equation : str
        Equation of the paper, or law, that it stands for; empty if it is of this package.
    what : str
        What it was found at, or what else there is to say of it; may be empty.
    """

    name: str
    unit: str
    value: float
    limit: float
    time: float
    kind: Kind = Kind.WALK
    equation: str = ""
    what: str = ""

    @property
    def passed(self) -> bool:
        """Whether the value is within its limit."""
        return bool(self.value <= self.limit)

    @property
    def told(self) -> str:
        """The name, and what it was found at."""
        return f"{self.name}: {self.what}" if self.what else self.name

    @property
    def verdict(self) -> str:
        """``ok``, ``FAIL`` or, where there is no limit, ``note``."""
        if not self.passed:
            return "FAIL"
        return "note" if self.limit == NO_LIMIT else "ok"

    @property
    def shown_limit(self) -> str:
        """The limit as it stands in a table; nothing for a note."""
        return "" if self.limit == NO_LIMIT else f"{self.limit:g}"


@dataclass(frozen=True)
class Claim:
    """What a check claims: all that is said of it anywhere is said here.

    Attributes
    ----------
    name, unit : str
    kind : Kind
    equation : str
        As of a `Check`.
    """

    name: str
    unit: str
    kind: Kind
    equation: str = ""

    def worst(self, limit: float, values: FloatArray, times: FloatArray, what: str = "") -> Check:
        """Return the check of the largest of the values (K, ...).

        What is not a number is the largest.
        """
        by_time = np.nan_to_num(values.reshape(len(times), -1), nan=np.inf).max(axis=1)
        k = int(np.argmax(by_time))
        return self.found(float(by_time[k]), limit, float(times[k]), what)

    def apart(self, found: FloatArray, expected: FloatArray, times: FloatArray) -> Check:
        """Return the check that two arrays (K, ...) are the same, in units of `expected`."""
        return self.worst(EQUAL, np.abs(found - expected), times)

    def found(self, value: float, limit: float, time: float, what: str = "") -> Check:
        """Return the check of a value that was found at a time [s]."""
        return Check(self.name, self.unit, value, limit, time, self.kind, self.equation, what)

    def noted(self, value: float, time: float, what: str) -> Check:
        """Return a note of this name: what was found, held against nothing."""
        return Check(self.name, self.unit, value, NO_LIMIT, time, Kind.NOTE, self.equation, what)
