"""Being asked to stop, by a signal that ends a job or by the clock.

A run is asked, not killed: what solves looks at `Run.over` at every point that it evaluates and
ends with the best it has. Where there is nothing to keep a signal raises KeyboardInterrupt at once,
as Ctrl-C does.
"""

from __future__ import annotations

import math
import signal
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from numbers import Real
from types import FrameType
from typing import Any

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGXCPU", "SIGUSR1", "SIGUSR2")
JOB_SIGNALS = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))
"""What terminals, ``docker stop``, service managers and the queues of clusters end jobs with."""

TIME_LIMIT = 300.0
"""Seconds that a solve may take unless told otherwise."""
LONGEST_LIMIT = 604_800.0  # [s], a week
_SHOWN = 1e20  # [s]

INTERRUPTED, OUT_OF_TIME = "interrupted", "time limit"
_AGAIN = 1.0  # [s]: what is asked sooner belongs to the last request, whose cleaning up goes on


class Asked:
    """The handler of signals: what they have asked for.

    Attributes
    ----------
    signal : int
        The first that came; 0 if none did.
    times : int
        How many came.
    """

    def __init__(self) -> None:
        self.signal, self.times = 0, 0
        self._held, self._raised = 0, -math.inf

    def __call__(self, number: int, _frame: FrameType | None) -> None:
        """Take note of a signal; raise KeyboardInterrupt unless it is held back."""
        self.signal, self.times = self.signal or number, self.times + 1
        now = time.monotonic()
        if not self._held and now - self._raised > _AGAIN:
            self._raised = now
            raise KeyboardInterrupt

    def hold(self) -> None:
        """Only take note of signals from now on: there is something to keep."""
        self._held += 1

    @property
    def raised(self) -> bool:
        """Whether KeyboardInterrupt was raised, be it that libraries made something else of it."""
        return self._raised > -math.inf

    @contextmanager
    def held(self) -> Iterator[None]:
        """Only take note of signals for a while."""
        self.hold()
        try:
            yield
        finally:
            self._held -= 1

    @contextmanager
    def heeded(self) -> Iterator[None]:
        """Let signals raise for a while, whoever holds them."""
        before, self._held = self._held, 0
        try:
            yield
        finally:
            self._held = before


class Run:
    """What may be asked to stop.

    Parameters
    ----------
    limit : float or None, [s]
    within : Run or None
        The run that it is a part of: it shares its signals and ends with it.
    """

    def __init__(self, limit: float | None = None, within: Run | None = None) -> None:
        self.limit = limit
        self.asked: Asked = within.asked if within else Asked()
        self._within = within
        self._until = math.inf if limit is None else time.monotonic() + limit

    @property
    def over(self) -> str:
        """Why it has to end; empty as long as it may go on."""
        if self.asked.signal:
            return INTERRUPTED
        if time.monotonic() >= self._until:
            return f"{OUT_OF_TIME} of {self.limit:g} s reached"
        return self._within.over if self._within else ""

    @property
    def left(self) -> float:
        """Time until the limit, [s]: at least 0, infinite if there is none."""
        own = max(self._until - time.monotonic(), 0.0)
        return min(own, self._within.left) if self._within else own


_NOW: ContextVar[Run | None] = ContextVar("run", default=None)


@contextmanager
def running(limit: float | None = None, signals: Iterable[int] = (signal.SIGINT,)) -> Iterator[Run]:
    """Yield a run: within the one under way, else one of its own that heeds signals.

    Parameters
    ----------
    limit : float or None, [s]
        Time limit of this run.
    signals : iterable of int
        What the outermost run heeds, in the main thread; handlers are then put back. A signal that
        was ignored stays so (``nohup``), but for Ctrl-C, which shells ignore for every job in the
        background.
    """
    outer = _NOW.get()
    new = Run(limit, outer)
    token = _NOW.set(new)
    try:
        with nullcontext() if outer else _handled(signals, new.asked):
            yield new
    finally:
        _NOW.reset(token)


def heed_for_good(signals: Iterable[int]) -> None:
    """Begin a run that ends with the process, whose handlers stay."""
    new = Run()
    _NOW.set(new)
    _handlers_instead(signals, new.asked)


def under_way() -> Run:
    """Return the run that is under way; one that nothing ends if there is none."""
    return _NOW.get() or Run()


def outermost() -> bool:
    """Tell whether a run that begins now is no part of another."""
    return _NOW.get() is None


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Let no signal in between; outside of a run Ctrl-C is raised afterwards."""
    with running() as run, run.asked.held():
        yield
    if run.asked.signal and outermost():
        raise KeyboardInterrupt


def checked_limit(limit: float | None) -> float | None:
    """Return a time limit [s], or None for none.

    Raises
    ------
    ValueError
        If it is not above 0 and at most a week.
    TypeError
        If it is no number.
    """
    if limit is None:
        return None
    given: object = limit
    if isinstance(given, bool) or not isinstance(given, Real):  # numpy's numbers, too
        raise TypeError(f"a time limit is a number of seconds, not a {type(limit).__name__}")
    if not 0.0 < limit <= LONGEST_LIMIT:
        shown = f"{limit:g}" if abs(limit) < _SHOWN else "a number"
        raise ValueError(f"{shown}: must be above 0 and at most {LONGEST_LIMIT:g} s")
    return float(limit)


@contextmanager
def _handled(signals: Iterable[int], asked: Asked) -> Iterator[None]:
    """Give signals to a handler; in the main thread only, no other can."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before: dict[int, Any] = {}
    try:
        before = _handlers_instead(signals, asked)
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _handlers_instead(signals: Iterable[int], asked: Asked) -> dict[int, Any]:
    """Put a handler in the place of others, and return those."""
    old = {number: signal.getsignal(number) for number in signals}
    before = {
        number: handler
        for number, handler in old.items()
        if handler is not None and (handler != signal.SIG_IGN or number == signal.SIGINT)
    }
    for number in before:
        signal.signal(number, asked)
    return before
