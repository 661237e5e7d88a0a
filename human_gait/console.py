"""What a run tells on a terminal: its task, how it goes, checks, verdict and diagnosis."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from rich.console import RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from human_gait.body.limits import mirrored_limits
from human_gait.checks.check import Check
from human_gait.problem.program import GaitProgram
from human_gait.results.explanation import diagnosis_text
from human_gait.scenario import Scenario
from human_gait.settings.departures import departures
from human_gait.solving.starts import GIVEN, GUESSED, OWN_GUESS, WARM, Attempt
from human_gait.solving.summary import diagnosis_content, spread
from human_gait.solving.watch import Iterate
from human_gait.stopping import under_way
from human_gait.terminal import one_line, screen
from human_gait.walk.energy import energy, headline
from human_gait.walk.gait import Gait
from human_gait.walk.gait_file import Record

Tell = Callable[[str], Callable[[Iterate], None]]
"""Takes the name of a start and returns what shows the iterates of its solve."""

_NO_DIGESTS = (
    "The file has no digests: an older version wrote it. What cannot be computed anew, such as the "
    "solver's words, is taken as it is."
)
_LINE_EVERY = 25  # iterates, where there is no terminal


def show(what: RenderableType) -> None:
    """Print a line or a table."""
    screen().print(what)


def show_task(program: GaitProgram, solver: str) -> None:
    """Print what is to be solved, in one line, and what limits hold for both sides."""
    show(
        f"{program.scenario.name}: {len(program.variables)} variables, "
        f"{program.n_constraint_rows} constraints, {solver}, dynamics by {program.dynamics}"
    )
    _show_mirrored(program.scenario)


def _show_mirrored(scenario: Scenario) -> None:
    for note in mirrored_limits(scenario):
        screen().print(f"note: {note}", soft_wrap=True)


@contextmanager
def progress() -> Iterator[Tell]:
    """Yield a function that takes the name of a start and returns one that shows iterates.

    On a terminal there is one live line, else a line now and then.
    """
    console = screen()

    def some(now: Iterate) -> None:
        if now.number % _LINE_EVERY == 1:
            console.print(_line(now), soft_wrap=True)

    def begin(start: str, show: Callable[[Iterate], None]) -> Callable[[Iterate], None]:
        if start not in (OWN_GUESS, GIVEN, WARM, GUESSED):
            console.print(f"next start: {start}")
        return show

    if not console.is_terminal:
        yield lambda start: begin(start, some)
        return
    with Live(console=console, refresh_per_second=8, transient=False) as live:
        yield lambda start: begin(start, lambda now: live.update(_line(now)))


def _line(now: Iterate) -> Text:
    worst = now.worst
    equation = f" (Eq. {worst.equation})" if worst.equation else ""
    return Text(
        f"{now.stage:>8} {now.number:5d}  {now.elapsed:6.1f} s  cost {now.cost:10.1f} N2 m2 s  "
        f"worst: {worst.name}{equation} {worst.value:.1e} {worst.unit}"
    )


def show_outcome(kept: Attempt, attempts: list[Attempt], folder: Path, gait: Gait) -> None:
    """Print the checks, how hard the walk is and the verdict.

    Where there is no walk, what is wrong and what to try.

    Parameters
    ----------
    kept : Attempt
    attempts : list of Attempt
        All of them.
    folder : Path
        Where the result is.
    gait : Gait
        What is in it.
    """
    _show_table(kept.checks)
    for line in headline(energy(gait)) if kept.success else ():
        screen().print(line, soft_wrap=True)
    for line in _spread(attempts):
        screen().print(line, soft_wrap=True)
    show(_verdict(kept, attempts, folder))
    if not kept.success:
        diagnosis = diagnosis_text(diagnosis_content(kept))
        screen().print(diagnosis, soft_wrap=True)


def show_checks(record: Record, checks: list[Check]) -> None:
    """Print the claims that a walk is held against, and the table of its checks."""
    told = screen()
    told.print(_asked_for(record.gait.scenario))
    _show_mirrored(record.gait.scenario)
    for line in _moved_limits(record.gait.scenario):
        told.print(line, soft_wrap=True)
    if record.altered is None:
        told.print(_NO_DIGESTS, soft_wrap=True)
    _show_table(checks)


def _show_table(checks: list[Check]) -> None:
    """Print the table of checks, and below it what there is to say of some of them."""
    show(_check_table(checks))
    for check in checks:
        if check.what:
            screen().print(check.told, soft_wrap=True)


def warn(what: object) -> None:
    """Print a warning on standard error, in one line."""
    screen(stderr=True).print(f"warning: {one_line(what)}", soft_wrap=True)


def _asked_for(scenario: Scenario) -> str:
    """Return the claims that a walk is held against, in one line."""
    walk, subject, limits = scenario.walk, scenario.subject, scenario.limits
    own = [*limits.frozen, *(limited.name for limited in limits.ranges)]
    return (
        f"{scenario.name}: {walk.speed:g} m/s, step {walk.step_length:g} m; {subject.sex}, "
        f"{subject.stature:g} m, {subject.mass:g} kg, load {scenario.load.mass:g} kg; "
        f"friction {scenario.ground.friction:g}; joints with limits of their own: {len(own)}"
    )


def _moved_limits(scenario: Scenario) -> list[str]:
    """Return a heading and the settings that move limits of the checks, a line each, if any."""
    moved = departures(scenario)
    return ["limits are moved by:", *(f"  {one}" for one in moved)] if moved else []


def _check_table(checks: list[Check]) -> Table:
    table = Table(box=None, padding=(0, 1, 0, 0), title="The walk, on a grid ten times finer")
    table.title_justify = "left"
    for column in ("check", "found", "limit", "unit", "t [s]", ""):
        side: Literal["left", "right"] = "right" if column in ("found", "limit") else "left"
        table.add_column(column, justify=side, no_wrap=True)
    for check in checks:
        found, at = f"{check.value:.2g}", f"{check.time:.3f}"
        row = (check.name, found, check.shown_limit, check.unit, at, check.verdict)
        table.add_row(*row)
    return table


def _spread(attempts: list[Attempt]) -> list[str]:
    """Return how far the costs of several walks differ, in one line; nothing of a single one."""
    found = spread(attempts)
    if found["walks"] < 2:
        return []
    apart = 100 * (found["cost_spread"] or 0.0)
    costs = f"their costs differ by {apart:.2g} %, the cheapest is kept"
    return [f"{found['walks']} walks in {len(attempts)} attempts: {costs}"]


def _verdict(kept: Attempt, attempts: list[Attempt], folder: Path) -> str:
    """Return how it ended, in one line; the solver's own word only where there is no walk."""
    solution, outcome = kept.solution, "found a walk" if kept.success else "found no walk"
    if all(check.passed for check in kept.checks) and not kept.success:
        outcome = "found a walk that is not the cheapest: it stopped before the optimum,"
    seconds = sum(attempt.solution.wall_time for attempt in attempts)
    said = [] if kept.success else [solution.status]
    if len(attempts) > 1:
        which = "the last one" if kept is attempts[-1] else "the best"
        said.append(f"{len(attempts)} starts, {which}: {kept.start}")
    over = under_way().over
    cut_short = not kept.success or len(attempts) > 1
    said += [over] if over and over not in said and cut_short else []
    more = f" ({'; '.join(said)})" if said else ""
    return f"{solution.solver} {outcome} in {seconds:.1f} s{more}; result in {folder}"
