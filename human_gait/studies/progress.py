"""How a study goes, on a terminal: how many walks are done, how many were not found, time left."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from human_gait.studies.work import Told
from human_gait.terminal import say, screen

_EVERY = 10.0  # [s] between lines, where there is no terminal


@contextmanager
def shown_progress(count: int) -> Iterator[Callable[[Told], None]]:
    """Yield what is given each walk that is done: a live line on a terminal, else some lines.

    Parameters
    ----------
    count : int
        Of the walks to be done.
    """
    terminal = screen(stderr=True)
    if not terminal.is_terminal:
        yield _Lines(count).tell
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("not found: {task.fields[failed]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=terminal, transient=True) as bar:
        task, failed = bar.add_task("walks", total=count, failed=0), 0

        def tell(told: Told) -> None:
            nonlocal failed
            failed += not told.success
            bar.update(task, advance=1, failed=failed)

        yield tell


class _Lines:
    """Tells a line now and then.

    Parameters
    ----------
    count : int
        Of the walks to be done.
    """

    def __init__(self, count: int) -> None:
        self._count, self._done, self._failed = count, 0, 0
        self._begin = self._last = time.monotonic()

    def tell(self, told: Told) -> None:
        """Take note of a walk."""
        self._done += 1
        self._failed += not told.success
        now = time.monotonic()
        if now - self._last >= _EVERY or self._done == self._count:
            self._last = now
            left = (now - self._begin) / self._done * (self._count - self._done)
            say(
                f"{self._done} of {self._count} walks, {self._failed} not found, "
                f"about {left:.0f} s left"
            )
