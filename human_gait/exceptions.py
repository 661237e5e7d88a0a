"""Everything that can go wrong for a user, as one family of exceptions."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait

SHOWN_CHARACTERS = 60


class GaitError(Exception):
    """Base of all errors that are explained to the user in one line."""


@dataclass(eq=False)
class ScenarioError(GaitError):
    """A value in a scenario that cannot be used.

    Parameters
    ----------
    key : str
        Dotted key, for example ``walk.speed``; empty when the whole file is meant.
    allowed : str
        What is wrong or what is allowed, as the end of a sentence.
    value : object, optional
        The value found; left out of the message when it is None.
    source : str, optional
        The file that holds the value.
    others : tuple of ScenarioError, optional
        What else is wrong in the same scenario.
    """

    key: str
    allowed: str
    value: object = None
    source: str = ""
    others: tuple[ScenarioError, ...] = ()

    @classmethod
    def of(cls, errors: Sequence[ScenarioError]) -> ScenarioError:
        """Return one error that stands for several, the first of them ahead."""
        first, *others = [each for error in errors for each in error.errors]
        return cls(first.key, first.allowed, first.value, first.source, tuple(others))

    @property
    def errors(self) -> tuple[ScenarioError, ...]:
        """Everything that is wrong, one error each."""
        first = ScenarioError(self.key, self.allowed, self.value, self.source)
        return (first, *self.others)

    def __str__(self) -> str:
        """Return ``source: key = value: allowed`` of each error, one line each."""
        return "\n".join(error.line for error in self.errors)

    @property
    def line(self) -> str:
        """``source: key = value: allowed`` without the parts that are empty."""
        setting = self.key if self.value is None else f"{self.key} = {shown(self.value)}"
        return ": ".join(part for part in (self.source, setting, self.allowed) if part)

    def found_in(self, source: str) -> ScenarioError:
        """Return the same error with the name of the file that holds the value."""
        each = [
            ScenarioError(error.key, error.allowed, error.value, source) for error in self.errors
        ]
        return ScenarioError.of(each)


class ModelError(GaitError):
    """A body model that contradicts itself, such as a wrong order of the DOF."""


class ResultError(GaitError):
    """A result folder that is missing, incomplete or unreadable."""


class TrialError(GaitError):
    """A file of a measured trial that cannot be read, or leaves open what has to be told."""


class UnsupportedProgram(GaitError):
    """A MathematicalProgram with something in it that the chosen solver cannot honour."""


class NoSolutionFound(GaitError):
    """The solver stopped without a walk that is optimal and passes every check.

    Parameters
    ----------
    message : str
        The solver's verdict in one line.
    gait : Gait, optional
        The best gait so far.
    report : sequence, optional
        Which constraints and checks failed, when and by how much, and what to try.
    """

    def __init__(
        self, message: str, gait: Gait | None = None, report: Sequence[object] | None = None
    ) -> None:
        super().__init__(message)
        self.gait = gait
        self.report = report


class SolveInterrupted(NoSolutionFound, KeyboardInterrupt):
    """The user stopped a prediction, which carries the best gait so far."""


def shown(value: object) -> str:
    """Return a value as it would stand in a scenario file, cut to a readable length."""
    try:
        text = repr(value) if isinstance(value, float) else json.dumps(value, default=str)
    except ValueError:  # an integer of more digits than Python agrees to print
        text = "a number of thousands of digits"
    except RecursionError:
        text = "lists within lists without end"
    return text if len(text) <= SHOWN_CHARACTERS else text[: SHOWN_CHARACTERS - 3] + "..."
