"""How a command ends: its exit code, and one line on standard error if it is not 0."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import typer

from human_gait.exceptions import GaitError, NoSolutionFound, ScenarioError

NO_SOLUTION = 1
BAD_INPUT = 2
INTERRUPTED = 130
LONGEST_MESSAGE = 500
MOST_ERRORS = 20


def complain(message: object, code: int) -> int:
    """Print one line on standard error and return the exit code."""
    printable = "".join(sign if sign.isprintable() else " " for sign in str(message))
    if len(printable) > LONGEST_MESSAGE:
        printable = printable[: LONGEST_MESSAGE - 3] + "..."
    typer.echo(f"error: {printable}", err=True)
    return code


def complain_of_each(errors: Sequence[ScenarioError]) -> int:
    """Print what is wrong with a scenario, a line each, and return the exit code."""
    for error in errors[:MOST_ERRORS]:
        complain(error, BAD_INPUT)
    if errors[MOST_ERRORS:]:
        complain(f"and {len(errors) - MOST_ERRORS} more", BAD_INPUT)
    return BAD_INPUT


def exit_code(command: Callable[[], int | None]) -> int:
    """Run a command and return its exit code; an error that a user can cause is one line."""
    try:
        code = command() or 0
    except NoSolutionFound as error:
        return complain(error, NO_SOLUTION)
    except typer.BadParameter as error:
        return complain(error.format_message().replace("Value error, ", ""), BAD_INPUT)
    except ScenarioError as error:
        return complain_of_each(error.errors)
    except (GaitError, typer.TyperException, OSError) as error:
        return complain(error, BAD_INPUT)
    except MemoryError:
        return complain("the memory is not enough for this", BAD_INPUT)
    return complain("interrupted", INTERRUPTED) if code == INTERRUPTED else code
