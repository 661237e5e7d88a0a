"""Who finds the walks of a study: this process, or the workers of a Dask scheduler.

A walk is handed out when the one that it starts from is done. Dask replaces workers that are lost
and gives their walks to others; the scheduler is never given more than is needed to keep all
workers busy, so that a million walks take it no more memory than a thousand.
"""

from __future__ import annotations

import logging
import os
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from human_gait.exceptions import GaitError
from human_gait.studies.extra import dask
from human_gait.studies.plan import Job
from human_gait.studies.store import Store
from human_gait.studies.work import Terms, Told, find, lost

if TYPE_CHECKING:
    from distributed import Client

AHEAD = 4
"""Walks that are handed out ahead for each worker."""

_ASKED_EVERY = 1.0  # [s]
_WAIT = 20  # [s] for the first worker of a scheduler
_RETRIES = 2  # of what is no fault of the walk, such as a disk that was full for a moment

Tell = Callable[[Told], None]


class Order:
    """Walks that are left, each after the one it starts from.

    Parameters
    ----------
    jobs : sequence of Job
        Those to be done.
    there : set of str
        Keys of walks that are done already.
    """

    def __init__(self, jobs: Sequence[Job], there: Iterable[str]) -> None:
        waiting = {job.key for job in jobs} - set(there)
        self._after: dict[str, list[Job]] = {}
        self._ready: deque[Job] = deque()
        for job in jobs:
            if job.start in waiting:
                self._after.setdefault(job.start, []).append(job)
            else:
                self._ready.append(job)

    def next(self) -> Job | None:
        """Return a walk that can be begun, None if there is none now."""
        return self._ready.popleft() if self._ready else None

    def done(self, key: str) -> None:
        """Take note of a walk that is done: those that start from it are next."""
        self._ready.extendleft(reversed(self._after.pop(key, [])))


def find_here(order: Order, terms: Terms, tell: Tell) -> None:
    """Find all walks one after another in this process."""
    while (job := order.next()) is not None:
        tell(find(job, terms))
        order.done(job.key)


def find_by_dask(order: Order, terms: Terms, tell: Tell, client: Client) -> None:
    """Find all walks by the workers of a Dask scheduler.

    Raises
    ------
    ResultError
        If a worker has another version of the package, or cannot write to the store.
    """
    from distributed import as_completed  # noqa: PLC0415, an extra

    handed: dict[str, Job] = {}
    futures, workers = as_completed(), _Workers(client)
    ours = f"-{uuid4().hex}"  # others may have the same walk found on the same scheduler
    while True:
        for job in _more(order, AHEAD * workers.count() - len(handed)):
            handed[job.key] = job
            futures.add(client.submit(find, job, terms, key=job.key + ours, retries=_RETRIES))
        if not handed:
            return
        future = next(futures)
        job = handed.pop(future.key.removesuffix(ours))
        tell(_outcome(future, job, terms))
        order.done(job.key)


def _more(order: Order, count: int) -> Iterator[Job]:
    for _ in range(count):
        if (job := order.next()) is None:
            return
        yield job


def _outcome(future: Any, job: Job, terms: Terms) -> Told:
    """Return what a worker told; a walk that killed one worker after another was not found."""
    from asyncio import CancelledError  # noqa: PLC0415, with those of the extra

    from distributed.client import FutureCancelledError  # noqa: PLC0415, an extra
    from distributed.comm import CommClosedError  # noqa: PLC0415, an extra
    from distributed.scheduler import KilledWorker  # noqa: PLC0415, an extra

    try:
        told: Told = future.result()
    except KilledWorker:
        return lost(job, terms, "the workers that tried it died, one after another")
    except (CancelledError, FutureCancelledError, CommClosedError):
        raise GaitError("the scheduler is gone; the same command goes on with the study") from None
    if not Store(Path(terms.folder)).path(job.key).is_file():
        raise GaitError(f"a worker does not see {terms.folder} as this computer does: share it")
    return told


class _Workers:
    """How many threads of workers there are; the scheduler is asked now and then only.

    Parameters
    ----------
    client : Client
    """

    def __init__(self, client: Client) -> None:
        self._client, self._known, self._again = client, 1, 0.0

    def count(self) -> int:
        """Return how many there are, at least 1."""
        if (now := time.monotonic()) >= self._again:
            self._known = max(sum(self._client.nthreads().values()), 1)
            self._again = now + _ASKED_EVERY
        return self._known


@contextmanager
def workers_here(count: int) -> Iterator[Client]:
    """Yield a client of workers that are started for it on this computer, a process each."""
    whole, distributed = dask()
    with ExitStack() as closing:
        scratch = closing.enter_context(tempfile.TemporaryDirectory(prefix="human-gait-"))
        settings = {
            "distributed.worker.memory.terminate": False,
            "distributed.worker.memory.pause": False,
            "distributed.comm.timeouts.connect": "60s",
            "distributed.nanny.pre-spawn-environ": _one_thread_each(),
        }
        closing.enter_context(whole.config.set(settings))
        closing.enter_context(_script_hidden())
        cluster = closing.enter_context(
            distributed.LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                memory_limit=0,
                dashboard_address="127.0.0.1:0",
                local_directory=scratch,
                silence_logs=logging.CRITICAL,
            )
        )
        yield closing.enter_context(distributed.Client(cluster))


@contextmanager
def _script_hidden() -> Iterator[None]:
    """Keep new processes from running the script that runs a study: each would run one, too.

    They need nothing of it, and scripts need no ``if __name__ == "__main__":`` for our sake.
    """
    main = sys.modules["__main__"]
    file, spec = vars(main).pop("__file__", None), main.__spec__
    main.__spec__ = None
    try:
        yield
    finally:
        main.__spec__ = spec
        if file is not None:
            main.__file__ = file


@contextmanager
def workers_of(address: str) -> Iterator[Client]:
    """Yield a client of a scheduler that is running.

    Raises
    ------
    GaitError
        If nobody answers there, or it has no workers.
    """
    _, distributed = dask()
    try:
        client = distributed.Client(address, timeout=_WAIT)
    except (OSError, ValueError, TimeoutError):
        raise GaitError(f"--scheduler {address}: no Dask scheduler answers there") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_WAIT)
        except TimeoutError:
            start = f"start some: dask worker {address} --nthreads 1"
            raise GaitError(f"--scheduler {address}: it has no workers, {start}") from None
        yield client


def dashboard(client: Client) -> str:
    """Return the address of the page on which Dask shows its work; empty without bokeh."""
    try:
        import bokeh  # noqa: F401, PLC0415, an extra
    except ImportError:
        return ""
    return str(client.dashboard_link)


def _one_thread_each() -> dict[str, str]:
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    return dict.fromkeys(names, "1")


def n_processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
