"""The checks of a gait as a value: a list that tells whether all are passed and prints a table."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import fields
from html import escape
from pathlib import Path
from typing import SupportsIndex, overload

import numpy as np

from human_gait.checks.check import Check
from human_gait.checks.folder import folder_check
from human_gait.checks.measured import is_measured
from human_gait.checks.verification import verify as verify_record
from human_gait.exceptions import ResultError
from human_gait.walk.gait import Gait, Samples
from human_gait.walk.gait_file import Record, check_splines, folder_of, load_record, make_record

_SHOWN = 10
_HEAD = ("check", "found", "limit", "unit", "t [s]", "")


class Checks(list[Check]):
    """The checks of a gait, in their order; a list that also takes names.

    ``print(checks)`` shows the whole table, ``checks["name"]`` is one check, and ``checks.passed``
    tells whether the gait is a walk.
    """

    @property
    def passed(self) -> bool:
        """Whether every check is passed."""
        return all(check.passed for check in self)

    @property
    def failed(self) -> Checks:
        """The checks that are not passed."""
        return Checks(check for check in self if not check.passed)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the checks."""
        return tuple(check.name for check in self)

    @overload
    def __getitem__(self, key: SupportsIndex) -> Check: ...
    @overload
    def __getitem__(self, key: slice) -> Checks: ...
    @overload
    def __getitem__(self, key: str) -> Check: ...
    def __getitem__(self, key: SupportsIndex | slice | str) -> Check | Checks:
        """Return a check by its name or place, or some of them.

        Raises
        ------
        KeyError
            If no check is called so; with the nearest name.
        IndexError
            If there are not as many.
        """
        if isinstance(key, slice):
            return Checks(super().__getitem__(key))
        if not isinstance(key, str):
            return super().__getitem__(key)
        for check in self:
            if check.name == key:
                return check
        nearest = difflib.get_close_matches(key, self.names, n=1, cutoff=0.4)
        hint = f"did you mean {nearest[0]!r}?" if nearest else "checks.names lists all"
        raise KeyError(f"no check is called {key!r}, {hint}")

    def __str__(self) -> str:
        return "\n".join([self._verdict(), *_lines(self)])

    def __repr__(self) -> str:
        shown = self.failed[:_SHOWN]
        more = len(self.failed) - len(shown)
        rest = [f"... and {more} more"] if more else []
        return "\n".join([self._verdict(), *(_lines(shown) if shown else ()), *rest])

    def _repr_html_(self) -> str:
        head = "".join(f'<th scope="col">{escape(name)}</th>' for name in _HEAD)
        rows = "".join(
            f'<tr><th scope="row" style="text-align:left">{escape(check.told)}</th>'
            + "".join(f"<td>{escape(cell)}</td>" for cell in _cells(check)[1:])
            + "</tr>"
            for check in self
        )
        caption = f"<caption>{escape(self._verdict())}</caption>"
        return f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"

    def _verdict(self) -> str:
        n = len(self) - len(self.failed)
        if is_measured(self):
            held = [check for check in self if check.verdict != "note"]
            sound = f"{n - len(self) + len(held)} of {len(held)} checks of its file passed"
            return f"a measured walk, no prediction: {sound}"
        return f"{'a walk' if self.passed else 'no walk'}: {n} of {len(self)} checks passed"


def verify(result: Gait | Record | str | Path) -> Checks:
    """Check whether forces and torques of a gait are those of its motion, and it is a walk.

    Three engines compute the torques anew (Pinocchio, Drake, the paper's recursion), on a grid ten
    times finer than the one that was constrained.

    Parameters
    ----------
    result : Gait, str or Path
        A gait, or the folder of a result, or its ``gait.npz``: then what the file says is checked.

    Returns
    -------
    Checks
        A list of `Check` that prints as a table, with ``.passed`` and ``checks["name"]``.

    Raises
    ------
    ResultError
        If there is no gait that can be read, or it holds what is not a finite number or no splines.
    """
    if isinstance(result, Gait):
        return Checks(verify_record(_finite_record(result)))
    if isinstance(result, Record):
        return Checks(verify_record(result))
    record = load_record(result)
    return Checks([*verify_record(record), folder_check(record.gait, folder_of(result))])


def _finite_record(gait: Gait) -> Record:
    """Return what a gait claims, as far as the engines can look at it: Drake ends the process."""
    for name in ("breaks", "control_points"):
        if not (isinstance(held := getattr(gait, name), np.ndarray) and held.dtype.kind in "fiu"):
            raise ResultError(f"the {name} of the gait are no array of numbers")
    _refuse_not_finite(gait, "breaks", "control_points")
    try:
        check_splines(gait.scenario, gait.breaks, gait.control_points)
    except (ValueError, IndexError) as error:
        raise ResultError(f"the gait cannot be checked: {error}") from None
    with np.errstate(all="ignore"):
        record = make_record(gait)
    _refuse_not_finite(record.samples, *(item.name for item in fields(Samples)))
    return record


def _refuse_not_finite(holder: Gait | Samples, *names: str) -> None:
    wrong = [name for name in names if not np.all(np.isfinite(getattr(holder, name)))]
    if wrong:
        raise ResultError(f"the gait holds what is not a finite number: {', '.join(wrong)}")


def _cells(check: Check) -> tuple[str, ...]:
    found, at = f"{check.value:.2g}", f"{check.time:.3f}"
    return check.name, found, check.shown_limit, check.unit, at, check.verdict


def _lines(checks: Iterable[Check]) -> list[str]:
    shown = list(checks)
    rows = [_HEAD, *map(_cells, shown)]
    wide = [max(map(len, column)) for column in zip(*rows, strict=True)]
    head, *lines = ["  ".join(map(str.ljust, row, wide)).rstrip() for row in rows]
    for k, check in reversed(list(enumerate(shown))):
        lines[k + 1 : k + 1] = [f"  {check.what}"] if check.what else []
    return [head, *lines]
