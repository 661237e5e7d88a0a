"""What Python calls to have a walk explained and reported: gaits or folders go in."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

from human_gait.reporting.page import report_page
from human_gait.reporting.results import Bound, read_bounds
from human_gait.results.explanation import explained
from human_gait.results.folder import whole_file
from human_gait.results.names import REPORT
from human_gait.results.ours import check_free, given_path
from human_gait.terminal import screen
from human_gait.walk.belonging import own_gait
from human_gait.walk.gait import Gait
from human_gait.walk.gait_file import folder_of
from human_gait.walk.measured import measured_words

_WIDTH = 100  # signs in a line of an explanation
_FEW_LINES = 12


@dataclass(frozen=True, repr=False)
class Explanation:
    """What shapes a walk, or why there is none; ``print`` shows it as a table and sentences.

    Attributes
    ----------
    bounds : tuple of Bound
        The bounds that hold the walk, that which costs most first; empty if it is no walk.
    text : str
        The same in words; for no walk what is not kept and what to try.
    """

    bounds: tuple[Bound, ...]
    text: str

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        lines = self.text.splitlines()
        more = ["... print() shows all"] if len(lines) > _FEW_LINES else []
        return "\n".join([*lines[:_FEW_LINES], *more])


def explain(result: Gait | str | Path) -> Explanation:
    """Tell what shapes a walk, or why there is none and what to try.

    Parameters
    ----------
    result : Gait, str or Path
        A gait, or the folder of a result, or its ``gait.npz``.

    Returns
    -------
    Explanation
        Bounds and what each costs; ``print`` shows it.

    Raises
    ------
    ResultError
        If there is no result that can be read, or a file in it is of another walk.
    """
    with _folders([result]) as (folder,):
        measured = measured_words(own_gait(folder))
        console = screen(width=_WIDTH, color_system=None, file=StringIO())
        with console.capture() as shown:
            console.print(explained(folder, measured), markup=False, highlight=False)
        lines = (line.rstrip() for line in shown.get().splitlines())
        return Explanation(read_bounds(folder), "\n".join(lines))


def report(
    results: Gait | str | Path | Sequence[Gait | str | Path], out: str | Path | None = None
) -> Path:
    """Write one page about a walk, or about several side by side, and return its path.

    Parameters
    ----------
    results : Gait, str or Path, or a sequence of them
        Gaits or folders of results, in the order in which they are shown; up to six. The first is
        what the others are compared with.
    out : str or Path, optional
        The file, HTML; else ``report.html`` in the folder of a single result, else
        ``out/report.html``.

    Returns
    -------
    Path

    Raises
    ------
    ResultError
        If there is no result that can be read, or there are too many, or the file cannot be
        written.
    """
    given = [results] if isinstance(results, Gait | str | Path) else list(results)
    target = _page_of(given) if out is None else given_path(out)
    with _folders(given) as folders:
        page = report_page(folders)
    if out is None:
        check_free(target.parent, [target.name])
    with whole_file(target) as path:
        path.write_text(page, encoding="utf-8")
    return target


def _page_of(given: Sequence[Gait | str | Path]) -> Path:
    if len(given) == 1 and not isinstance(given[0], Gait):
        return folder_of(given[0]) / REPORT
    return Path("out") / REPORT


@contextmanager
def _folders(given: Sequence[Gait | str | Path]) -> Iterator[list[Path]]:
    """Yield the folders of results; gaits have theirs for as long as they are needed."""
    with TemporaryDirectory() as place:
        yield [_folder(one, Path(place) / str(k)) for k, one in enumerate(given, start=1)]


def _folder(one: Gait | str | Path, place: Path) -> Path:
    if not isinstance(one, Gait):
        return folder_of(one)
    return one.save(place / one.scenario.name)
