"""How a command ends: its exit code, and one line on standard error if it is not 0.

0 done, 1 no walk and nothing else, 2 bad input, a result that cannot be written or a fault of the
environment, 3 what was not foreseen, 128 and the number of the signal that interrupted it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

import typer

from human_gait.exceptions import GaitError, NoSolutionFound, ScenarioError
from human_gait.faults import BAD_INPUT, failed, interrupted
from human_gait.terminal import complain

NO_SOLUTION = 1
MOST_ERRORS = 20
_PROGRAM, _COMPLETION = "human-gait", "_HUMAN_GAIT_COMPLETE"


def complain_of_each(errors: Sequence[ScenarioError]) -> int:
    """Print what is wrong with a scenario, a line each, and return the exit code."""
    for error in errors[:MOST_ERRORS]:
        complain(error, BAD_INPUT)
    if errors[MOST_ERRORS:]:
        complain(f"and {len(errors) - MOST_ERRORS} more", BAD_INPUT)
    return BAD_INPUT


def invoked(command: Any, words: list[str]) -> int | None:
    """Run a command of Typer's; return its exit code if it has one, and raise what it raises."""
    try:
        if _COMPLETION in os.environ:  # a shell asks what could follow
            command.main(words, _PROGRAM, complete_var=_COMPLETION)
        context = command.make_context(_PROGRAM, words)
    except SystemExit as end:  # Typer's own, of completion
        return int(end.code or 0)
    with context:
        command.invoke(context)
    return None


def exit_code(command: Callable[[], int | None]) -> int:
    """Run a command and return its exit code; whatever it raises is one line."""
    try:
        return command() or 0
    except typer.Exit as end:
        return end.exit_code
    except KeyboardInterrupt:
        return interrupted()
    except (typer.TyperException, GaitError, OSError, MemoryError) as error:
        return _told(error)
    except BaseException as error:  # noqa: BLE001, nothing ends with a traceback
        return failed(error)


def _told(error: Exception) -> int:
    """Print the line, or lines, of what was given wrong; return the exit code."""
    if isinstance(error, ScenarioError):
        return complain_of_each(error.errors)
    if isinstance(error, typer.BadParameter):
        return complain(error.format_message().replace("Value error, ", ""), BAD_INPUT)
    if isinstance(error, MemoryError):
        return complain("the memory is not enough for this", BAD_INPUT)
    return complain(error, NO_SOLUTION if isinstance(error, NoSolutionFound) else BAD_INPUT)
