"""A study from Python and for the command: planned, told how much it is, run, and written."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from human_gait.exceptions import GaitError, ResultError, ScenarioError
from human_gait.results.folder import whole_file
from human_gait.results.names import STUDY
from human_gait.scenario.schema import refuse, unknown
from human_gait.studies.engine import (
    Order,
    Tell,
    dashboard,
    find_by_dask,
    find_here,
    n_processors,
    workers_here,
    workers_of,
)
from human_gait.studies.extra import parquet
from human_gait.studies.index import columns, write_index
from human_gait.studies.limits import parse_limits
from human_gait.studies.opened import Study, open_study
from human_gait.studies.plan import Job, Plan, package_version, plan_of
from human_gait.studies.store import Store, check_store
from human_gait.studies.study_file import StudyFile
from human_gait.studies.work import AGAIN, OUT_OF_TIME, Terms

COLD_SECONDS, WARM_SECONDS = 3.0, 1.6  # measured, docs/studies.md
BYTES = 50_000  # of a walk: its file, its row and its curves


class Amount(NamedTuple):
    """How much a study is, before it begins.

    Attributes
    ----------
    walks, left, cold : int
        All, those that are left to be found, and of these the ones found from nothing.
    seconds : float
        About, for all workers together.
    bytes : int
        About, on the disk.
    """

    walks: int
    left: int
    cold: int
    seconds: float
    bytes: int


@dataclass(frozen=True)
class Begun:
    """A study about to be run.

    Attributes
    ----------
    whole, plan : Plan
        Of all walks, and of those that are to be done here: a part, in a job of an array.
    store : Store
    there : set of str
        Keys of the walks that are there and need not be done again.
    """

    whole: Plan
    plan: Plan
    store: Store
    there: set[str]

    @property
    def amount(self) -> Amount:
        """How much is to be done."""
        left = self.left
        cold = sum(1 for job in left if not job.start and job.scenario)
        warm = sum(1 for job in left if job.start)
        seconds = cold * COLD_SECONDS + warm * WARM_SECONDS
        return Amount(len(self.plan.jobs), len(left), cold, seconds, BYTES * len(left))

    @property
    def left(self) -> list[Job]:
        """The walks that are to be done."""
        return [job for job in self.plan.jobs if job.key not in self.there]

    @property
    def missing(self) -> set[str]:
        """Keys of the walks of the whole study that are not there by now."""
        return {job.key for job in self.whole.jobs} - self.store.keys()

    @property
    def order(self) -> Order:
        """The walks that are left."""
        return Order(self.left, self.there)

    @property
    def terms(self) -> Terms:
        """What holds for all of them."""
        study = self.plan.study
        folder = str(self.store.folder.resolve())
        return Terms(folder, package_version(), study.tries, study.time_limit)


def study(
    file: str | Path | Mapping[str, Any],
    out: str | Path | None = None,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    tell: Tell = lambda _: None,
) -> Study:
    """Run a study, or go on with one: what is in its folder is not done again.

    Parameters
    ----------
    file : str, Path or mapping
        A study file, the name of one of the package, the same as tables, or the folder of a study.
    out : str or Path, optional
        Folder to write to, else ``out/<name of the study>``.
    workers : int, optional
        Processes on this computer, else one for each processor; 0 for none: one walk after another
        in this process, which needs no Dask.
    scheduler : str, optional
        Address of a Dask scheduler whose workers are to do it.
    tell : function, optional
        Is given what is told of each walk that is done, a `Told`.

    Returns
    -------
    Study

    Raises
    ------
    ScenarioError
        If the file cannot be used, with all reasons.
    ResultError
        If the folder cannot be written to.
    GaitError
        If a package is missing or the scheduler cannot be reached.
    """
    asked, place = study_of(file)
    begun = begin(asked, Path(out) if out else place)
    try:
        with workers_for(workers, scheduler) as (finding, _):
            finding(begun.order, begun.terms, tell)
    finally:
        write(begun)
    return open_study(begun.store.folder)


def study_of(file: str | Path | Mapping[str, Any]) -> tuple[StudyFile, Path]:
    """Return what a study file, its tables or the folder of a study ask for, and where it goes.

    Raises
    ------
    ScenarioError
        If it cannot be used.
    """
    if isinstance(file, Mapping):
        asked = StudyFile.from_table({"name": "study", **file})
    elif Path(file).is_dir():
        return StudyFile.read(Path(file) / STUDY), Path(file)
    else:
        asked = StudyFile.read(file)
    return asked, Path("out") / asked.name


Finding = Callable[[Order, Terms, Tell], None]


def begin(asked: StudyFile, folder: Path, part: tuple[int, int] | None = None) -> Begun:
    """Plan a study and see what of it is there; its file is written into the folder.

    Parameters
    ----------
    asked : StudyFile
    folder : Path
    part : (int, int), optional
        The number of a part, from 1, and how many there are; else all of it.

    Raises
    ------
    ScenarioError
        If no walk of it is allowed.
    ResultError
        If the folder cannot be written to.
    """
    parquet()  # rather than after hours
    _check_outputs(asked)
    whole, store = plan_of(asked), Store(folder)
    check_store(folder)
    there = store.keys() & {job.key for job in whole.jobs}
    plan = whole.part(*part) if part else whole
    _check_same(asked, folder / STUDY)
    with whole_file(folder / STUDY) as path:
        path.write_text(asked.to_toml(), encoding="utf-8")
    mine = there & {job.key for job in plan.jobs}
    return Begun(whole, plan, store, there - _to_try_again(store, mine, asked))


def _check_outputs(asked: StudyFile) -> None:
    """Refuse outputs that no index has, before anything is solved."""
    known = [column.name for column in columns()]
    strange = [one for one in asked.show if one not in known]
    refuse([unknown("outputs.show", one, known, "column") for one in strange])
    try:
        parse_limits(asked.limits, [column.name for column in columns() if not column.words])
    except GaitError as error:
        raise ScenarioError("outputs.limits", str(error)) from None


def _check_same(asked: StudyFile, file: Path) -> None:
    """Refuse to put a study into the folder of another one, whose index it would replace."""
    if not file.is_file():
        return
    there = StudyFile.read(file).name
    if there != asked.name:
        message = f"holds the study {there}, this one is {asked.name}: choose another place (--out)"
        raise ResultError(f"{file.parent}: {message}")


def _to_try_again(store: Store, there: set[str], asked: StudyFile) -> set[str]:
    """Return the walks that were not found where more is asked now, or their workers were lost."""
    again = set[str]()
    for key in there:
        try:
            row = store.row(key)
        except ResultError:  # a damaged file is no walk
            again.add(key)
            continue
        fewer = int(row.get("tries", 0)) < asked.tries
        sooner = row.get(OUT_OF_TIME) and float(row.get("time_limit", 0.0)) < asked.time_limit
        if not row.get("success") and (fewer or sooner or row.get(AGAIN)):
            again.add(key)
    return again


@contextmanager
def workers_for(workers: int | None, scheduler: str | None) -> Iterator[tuple[Finding, str]]:
    """Yield what finds walks: this process, workers here, or those of a scheduler.

    Beside it the address of Dask's dashboard, if there is one.

    Raises
    ------
    GaitError
        If the number of workers is not allowed, or the scheduler cannot be reached.
    """
    if scheduler is not None:
        if workers is not None:
            raise GaitError("--workers and --scheduler: give one of them")
        with workers_of(scheduler) as client:
            yield partial(find_by_dask, client=client), dashboard(client)
    elif workers == 0:
        yield find_here, ""
    else:
        if workers is not None and not 0 < workers <= 1024:
            raise GaitError(f"--workers {workers}: must be from 0 to 1024")
        with workers_here(workers or n_processors()) as client:
            yield partial(find_by_dask, client=client), dashboard(client)


def write(begun: Begun) -> int:
    """Write the index of all walks of a study that are there, and return how many."""
    there = begun.store.keys() & {job.key for job in begun.whole.jobs}
    return write_index(begun.whole, begun.store, there) if there else 0
