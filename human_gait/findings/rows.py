"""The index of a study in memory: a row a walk, what was set and what came out.

Everything here knows the folder only through `studies.opened.Study`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.exceptions import ResultError
from human_gait.findings.columns import Column, column_of, encoded_words, labelled
from human_gait.studies.numbers import settings_columns

if TYPE_CHECKING:
    from human_gait.studies.opened import Study

FOUND = "success"
"""The output that is 1 where a walk was found, else 0."""

_BESIDE = {
    *("key", FOUND, "reason", "diagnosis", "start", "person"),
    *("seconds", "iterations", "attempts"),
}
_SHOWN_FIRST = ("cost_of_transport", "strength_share")  # where the study does not say
_NAMED = ("key", FOUND, "reason", "diagnosis", "seconds")


@dataclass(frozen=True, eq=False)
class Rows:
    """The index of a study.

    Attributes
    ----------
    name, version : str
    folder : Path
    keys : list of str
    found : (n,) bool array
        Whether there is a walk.
    reasons : tuple of str
        Why there is none, the most frequent first.
    reason : (n,) int array
        Place in `reasons`, -1 where there is a walk.
    diagnoses : tuple of str
        An example for each reason.
    seconds : (n,) array, [s]
    settings : tuple of Column
        Those that vary: what the study varies first.
    causes : tuple of str
        Settings that the study itself varied, its people's measures included; the others follow.
    outputs : tuple of Column
        Those that vary: what the study names first, then in the order of the index.
    constant : tuple of Column
        Numbers that have one value in all walks, or none.
    persons : (n,) array
        Number of the person in the population, NaN where there is none.
    people : bool
        Whether a population walks.
    """

    name: str
    version: str
    folder: Path
    keys: list[str]
    found: Any
    reasons: tuple[str, ...]
    reason: IntArray
    diagnoses: tuple[str, ...]
    seconds: FloatArray
    settings: tuple[Column, ...]
    causes: tuple[str, ...]
    outputs: tuple[Column, ...]
    constant: tuple[Column, ...]
    persons: FloatArray
    people: bool

    def __len__(self) -> int:
        return len(self.keys)

    def column(self, name: str) -> Column:
        """Return a column by its name."""
        every = (*self.settings, *self.outputs, *self.constant)
        return next(one for one in every if one.name == name)

    def numbers(self) -> list[str]:
        """Return the names of all columns of numbers, what the study names first ahead."""
        every = (*self.outputs, *self.settings, *self.constant)
        return [one.name for one in every if not one.words]


def read_rows(study: Study) -> Rows:
    """Read the index of a study.

    Raises
    ------
    ResultError
        If it has no rows, or a column is missing.
    """
    table = study.table()
    if not table.num_rows:
        raise ResultError(f"{study.folder}: the study has no walks yet")
    if missing := [name for name in _NAMED if name not in table.column_names]:
        raise ResultError(f"{study.folder}: the index has no column {', '.join(missing)}")
    about = json.loads((table.schema.metadata or {}).get(b"human_gait", b"{}"))
    found = table[FOUND].to_numpy(zero_copy_only=False).astype(bool)
    reasons, reason, diagnoses = _reasons(table, found)
    settings, outputs, constant = _columns(study, table, found)
    people = bool(about.get("population"))
    return Rows(
        study.name,
        str(about.get("version", "")),
        study.folder,
        table["key"].to_pylist(),
        found,
        reasons,
        reason,
        diagnoses,
        table["seconds"].to_numpy(zero_copy_only=False).astype(float),
        tuple(settings),
        _causes(settings, study.varied, people),
        tuple(outputs),
        tuple(constant),
        _persons(table),
        people,
    )


def _reasons(table: Any, found: Any) -> tuple[tuple[str, ...], IntArray, tuple[str, ...]]:
    """Return why walks are missing, most frequent first, whose reason is which, and examples."""
    words, codes = encoded_words(table["reason"])
    counts = np.bincount(codes[~found & (codes >= 0)], minlength=len(words))
    order = [int(k) for k in np.argsort(-counts, kind="stable") if counts[k]]
    place = np.full(len(words) + 1, len(order))  # the last: no reason is told
    place[order] = np.arange(len(order))
    reason = np.where(found, -1, place[codes])
    names = [words[k] or "no reason is told" for k in order]
    if np.any(reason == len(order)):
        names.append("no reason is told")
    firsts = [int(np.argmax(reason == k)) for k in range(len(names))]
    return tuple(names), reason, tuple(table["diagnosis"][k].as_py() or "" for k in firsts)


def _persons(table: Any) -> FloatArray:
    if "person" not in table.column_names:
        return np.full(table.num_rows, np.nan)
    return np.asarray(table["person"].cast("double").to_numpy(zero_copy_only=False))


def _columns(
    study: Study, table: Any, found: Any
) -> tuple[list[Column], list[Column], list[Column]]:
    """Return the settings and outputs that vary, what the study names ahead, and other numbers."""
    units, meanings = study.units, study.meanings
    varied = [*study.varied]
    known = {column.name for column in settings_columns()}
    every = [name for name in table.column_names if name not in _BESIDE]
    columns: list[Column] = []
    for name in _ahead([*varied, *(study.outputs or _SHOWN_FIRST)], every):
        asked = name in varied or name in known
        one = column_of(table[name], name, meanings.get(name, ""), units.get(name, ""), asked)
        if one is None:
            continue
        if not asked:  # of an attempt that failed numbers tell nothing
            one = replace(one, values=np.where(found, one.values, np.nan))
        columns.append(one)
    named = labelled(columns)
    varying = [one for one in named if one.varies()]
    return (
        [one for one in varying if one.setting],
        [one for one in varying if not one.setting],
        [one for one in named if not one.words and not one.varies()],
    )


def _ahead(first: Sequence[str], every: Sequence[str]) -> Iterable[str]:
    return dict.fromkeys([*(name for name in first if name in every), *every])


def _causes(settings: Sequence[Column], varied: Sequence[str], people: bool) -> tuple[str, ...]:
    names = [one.name for one in settings]
    return tuple(
        name
        for name in names
        if name in varied or (people and name.startswith("subject_")) or not varied
    )
