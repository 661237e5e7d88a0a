"""Commands for many walks: a study is run, and told of before, meanwhile and after."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from human_gait.commands.arguments import whole_number
from human_gait.commands.exits import NO_SOLUTION
from human_gait.exceptions import ResultError
from human_gait.results.names import INDEX, STUDY
from human_gait.terminal import say

if TYPE_CHECKING:
    from human_gait.studies.calls import Amount
    from human_gait.studies.opened import Study


def study(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A study file, TOML, or a name: people; or a folder."),
    ],
    workers: Annotated[
        int | None,
        typer.Option(
            parser=whole_number,
            metavar="N",
            help="Processes on this computer, else one for each processor.",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Use the workers of a Dask scheduler that runs."),
    ] = None,
    array: Annotated[
        str, typer.Option(metavar="I/N", help="Do the I-th of N parts here, as a job of an array.")
    ] = "",
    *,
    resume: Annotated[
        bool, typer.Option("--resume", help="Only go on with a study that was begun.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of the study, else out/<name>.")
    ] = None,
) -> None:
    """Predict many walks by one file: settings varied, people drawn; write index and page."""
    from human_gait.studies.calls import begin, study_of, workers_for, write
    from human_gait.studies.progress import shown_progress

    asked, place = study_of(file)
    folder = out or place
    if resume and not (folder / STUDY).is_file():
        raise ResultError(f"{folder}: no study was begun here (no {STUDY}): leave out --resume")
    part = _part(array) if array else None
    begun = begin(asked, folder, part)
    if part:
        workers = 0 if workers is None and scheduler is None else workers
    _tell_amount(begun.amount, 1 if scheduler else workers)
    try:
        if begun.amount.left:
            with workers_for(workers, scheduler) as (finding, dashboard):
                if dashboard:
                    say(f"dashboard: {dashboard}")
                with shown_progress(begun.amount.left) as tell:
                    finding(begun.order, begun.terms, tell)
    finally:
        whole = part is None or not begun.missing  # of a part that is not the last, no index yet
        n_written = write(begun) if whole else 0
        if n_written:
            say(f"wrote {n_written} of {len(begun.whole.jobs)} walks to {folder / INDEX}")
    if whole:
        _conclude(folder)
    else:
        say(f"done with part {array}; {len(begun.missing)} walks of other parts are missing")


def _exceeded(done: Study) -> Iterator[str]:
    """Yield how many of the walks that were found go beyond each limit of the study."""
    from human_gait.studies.limits import parse_limits

    for limit in parse_limits(done.limits, done.columns):
        values = done.table([limit.name])[limit.name].to_numpy()
        beyond, of = limit.exceeded(values).sum(), (values == values).sum()  # noqa: PLR0124, NaN
        yield f"{beyond} of {of} go beyond {limit} {done.units[limit.name]}".rstrip()


def _part(given: str) -> tuple[int, int]:
    """Return the number of a part, from 1, and how many there are."""
    number, slash, of = given.partition("/")
    if not (slash and number.isdecimal() and of.isdecimal() and 1 <= int(number) <= int(of)):
        raise typer.BadParameter(
            f"{given!r} must be I/N with I from 1 to N, such as 3/20", param_hint="--array"
        )
    return int(number), int(of)


def _tell_amount(amount: Amount, workers: int | None) -> None:
    """Say how many walks there are, how long it takes and how much disk, before it begins."""
    from human_gait.studies.engine import n_processors

    at_once = max(workers if workers is not None else n_processors(), 1)
    n_there = amount.walks - amount.left
    there = f", {n_there} of them there already" if n_there else ""
    walks = "1 walk" if amount.walks == 1 else f"{amount.walks} walks"
    say(f"{walks}{there}: {amount.left} to find, {amount.cold} of them from nothing")
    if amount.left:
        long = _duration(amount.seconds / at_once)
        say(f"about {long} with {at_once} at a time, {_size(amount.bytes)} on the disk")


def _duration(seconds: float) -> str:
    for unit, name in ((86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2.0 * unit:
            return f"{seconds / unit:.1f} {name}"
    return f"{max(seconds, 1.0):.0f} s"


def _size(count: int) -> str:
    for unit, name in ((1e9, "GB"), (1e6, "MB")):
        if count >= unit:
            return f"{count / unit:.1f} {name}"
    return f"{count / 1e3:.0f} kB"


def _conclude(folder: Path) -> None:
    """Say what came out, write the page, and end with 1 if no walk was found."""
    from human_gait.studies.opened import open_study

    done = open_study(folder)
    table = done.table(["success", "reason"])
    found, reasons = table["success"].to_pylist(), table["reason"].to_pylist()
    say(f"found {sum(found)} of {len(found)} walks")
    failed = Counter(why for why, success in zip(reasons, found, strict=True) if not success)
    for why, count in failed.most_common(5):
        say(f"  {count} not: {why}")
    for line in _exceeded(done):
        say(f"  {line}")
    from human_gait.findings.page import study_report

    say(f"wrote {study_report(folder)}")
    if not any(found):
        raise typer.Exit(NO_SOLUTION)
