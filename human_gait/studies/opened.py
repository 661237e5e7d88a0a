"""A study that was run, read from its folder."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from human_gait.arrays import IntArray
from human_gait.exceptions import ResultError
from human_gait.results.names import CYCLES, INDEX
from human_gait.studies.extra import arrow, parquet
from human_gait.studies.index import METADATA
from human_gait.studies.store import Store
from human_gait.values import Value
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import PERCENT

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa


@dataclass(frozen=True, eq=False, repr=False)
class Study(Value):
    """The walks of a study, a row each, and their curves.

    Attributes
    ----------
    folder : Path
        Of the study: with ``index.parquet`` in it.

    Raises
    ------
    ResultError
        If there is no index that can be read.
    GaitError
        If pyarrow is not installed.
    """

    folder: Path

    def __post_init__(self) -> None:
        object.__setattr__(self, "folder", Path(self.folder))
        _ = self._names

    def __repr__(self) -> str:
        return f"Study({self.name!r}, {self.n_walks} walks)"

    @cached_property
    def _schema(self) -> Any:
        if not (self.folder / INDEX).is_file():
            make = "make one with human-gait study"
            raise ResultError(f"{self.folder}: no study here (no {INDEX}), {make}")
        return self._schema_of(INDEX)

    @cached_property
    def _about(self) -> dict[str, Any]:
        try:
            about = json.loads((self._schema.metadata or {})[METADATA])
            return {**about, "varied": tuple(map(str, about["varied"]))}
        except (KeyError, ValueError, TypeError):
            message = "does not say what it is of: is it a study's?"
            raise ResultError(f"{self.folder / INDEX}: {message}") from None

    @cached_property
    def _names(self) -> tuple[str, tuple[str, ...]]:
        return str(self._about.get("study")), self._about["varied"]

    @property
    def name(self) -> str:
        """What it is called."""
        return self._names[0]

    @property
    def varied(self) -> tuple[str, ...]:
        """Columns of the settings that are varied."""
        return self._names[1]

    @property
    def about(self) -> Mapping[str, Any]:
        """What the index says of the study: population, pace, version, ..."""
        return self._about

    @property
    def outputs(self) -> tuple[str, ...]:
        """Columns that the study file names first."""
        return tuple(map(str, self._about.get("outputs", ())))

    @property
    def limits(self) -> tuple[str, ...]:
        """Limits that the study file gives, such as ``knee_extension_peak < 1.0``."""
        return tuple(map(str, self._about.get("limits", ())))

    @property
    def columns(self) -> tuple[str, ...]:
        """All columns of the index."""
        return tuple(self._schema.names)

    @property
    def units(self) -> dict[str, str]:
        """The unit of each column; empty for words and pure numbers."""
        return self._told("unit")

    @property
    def meanings(self) -> dict[str, str]:
        """What each column is, in a few words."""
        return self._told("meaning")

    @cached_property
    def n_walks(self) -> int:
        """How many rows there are, those without a walk as well."""
        return int(parquet().read_metadata(self.folder / INDEX).num_rows)

    def table(self, columns: Sequence[str] | None = None) -> pa.Table:
        """Return the index, or some columns of it.

        Raises
        ------
        ResultError
            If it cannot be read or has no such column.
        """
        if columns is not None and (missing := sorted(set(columns) - set(self.columns))):
            raise ResultError(f"{self.folder / INDEX}: no column {', '.join(missing)}")
        return self._read(INDEX, columns)

    def to_dataframe(self) -> pd.DataFrame:
        """Return the index as a data frame of pandas, indexed by the keys of the walks.

        ``frame.attrs["units"]`` has the units.

        Raises
        ------
        ResultError
            If it cannot be read.
        """
        frame = self.table().to_pandas().set_index("key")
        frame.attrs["units"] = self.units
        return frame

    def cycles(
        self, keys: Sequence[str] | None = None, columns: Sequence[str] | None = None
    ) -> dict[str, npt.NDArray[np.float32]]:
        """Return curves of the gait cycle by name, (n, 101) each, 0 to 100 %.

        Parameters
        ----------
        keys : sequence of str, optional
            Of the walks; else all, in the order of the index.
        columns : sequence of str, optional
            Names of the curves; else all.

        Raises
        ------
        ResultError
            If the file cannot be read, or has no such walk or curve.
        """
        names = [name for name in self._cycle_names() if columns is None or name in columns]
        if missing := sorted(set(columns or ()) - set(names)):
            raise ResultError(f"{self.folder / CYCLES}: no curve {', '.join(missing)}")
        if keys is None:
            table = self._read(CYCLES, names)
            return {name: _stacked(table[name]) for name in names}
        place = {key: i for i, key in enumerate(self._read(CYCLES, ["key"])["key"].to_pylist())}
        if missing := [key for key in keys if key not in place]:
            raise ResultError(f"{self.folder / CYCLES}: no walk {missing[0]}")
        return self._some_cycles(np.array([place[key] for key in keys], dtype=np.intp), names)

    def gait(self, key: str) -> Gait:
        """Return a walk by its key; of one that was not found the best attempt.

        Raises
        ------
        ResultError
            If there is none that can be read.
        """
        if not re.fullmatch("[0-9a-f]{32}", str(key)):
            raise ResultError(f"{self.folder}: {key!r} is no key of a walk, see the index")
        return Store(self.folder).gait(key)

    def _some_cycles(
        self, rows: IntArray, names: Sequence[str]
    ) -> dict[str, npt.NDArray[np.float32]]:
        """Return the curves of some rows, (n, 101) each, read a group of rows at a time."""
        found = {name: np.full((len(rows), len(PERCENT)), np.nan, np.float32) for name in names}
        try:
            file = parquet().ParquetFile(self.folder / CYCLES)
            first = 0
            for group in range(file.num_row_groups):
                last = first + file.metadata.row_group(group).num_rows
                here = np.flatnonzero((rows >= first) & (rows < last))
                if len(here):
                    table = file.read_row_group(group, [*names]).take(rows[here] - first)
                    for name in names:
                        found[name][here] = _stacked(table[name])
                first = last
        except (OSError, arrow().ArrowException) as error:
            raise self._unreadable(CYCLES, error) from None
        return found

    def _cycle_names(self) -> list[str]:
        return [name for name in self._schema_of(CYCLES).names if name != "key"]

    def _told(self, what: str) -> dict[str, str]:
        return {
            field.name: (field.metadata or {}).get(what.encode(), b"").decode()
            for field in self._schema
        }

    def _schema_of(self, name: str) -> Any:
        pq = parquet()
        try:
            return pq.read_schema(self.folder / name)
        except (OSError, arrow().ArrowException) as error:
            raise self._unreadable(name, error) from None

    def _read(self, name: str, columns: Sequence[str] | None) -> Any:
        pq = parquet()
        try:
            return pq.read_table(self.folder / name, columns=columns and [*columns])
        except (OSError, arrow().ArrowException) as error:
            raise self._unreadable(name, error) from None

    def _unreadable(self, name: str, error: BaseException) -> ResultError:
        return ResultError(f"{self.folder / name}: cannot be read: {' '.join(str(error).split())}")


def open_study(folder: str | Path) -> Study:
    """Open a study that was run.

    Parameters
    ----------
    folder : str or Path
        Of the study.

    Returns
    -------
    Study
        ``to_dataframe()`` has a row for each walk.

    Raises
    ------
    ResultError
        If there is none that can be read.
    GaitError
        If pyarrow is not installed.
    """
    return Study(Path(folder))


def _stacked(column: Any) -> npt.NDArray[np.float32]:
    """Return curves as an array (n, 101); NaN where there is no walk."""
    found = np.full((len(column), len(PERCENT)), np.nan, dtype=np.float32)
    row = 0
    for chunk in column.chunks:
        there = np.asarray(chunk.is_valid())
        values = chunk.drop_null().flatten().to_numpy(zero_copy_only=False)
        found[row : row + len(chunk)][there] = values.reshape(-1, len(PERCENT))
        row += len(chunk)
    return found
