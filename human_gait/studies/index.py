"""The index of a study, ``index.parquet``, and the curves beside it, ``cycles.parquet``.

Both are made from the files of the walks, and can be made again at any time. Units and meanings
stand in the metadata of the columns; pandas, Polars, DuckDB and R (arrow) read them.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from human_gait.exceptions import ResultError
from human_gait.results.folder import whole_file
from human_gait.results.names import CYCLES, INDEX
from human_gait.studies.extra import arrow, parquet
from human_gait.studies.numbers import (
    CURVES,
    Column,
    cells_of_setting,
    number_columns,
    settings_columns,
)
from human_gait.studies.plan import Job, Plan, package_version
from human_gait.studies.store import Store
from human_gait.studies.study_file import StudyFile
from human_gait.walk.gait_cycle import PERCENT, label_and_unit

if TYPE_CHECKING:
    import pyarrow as pa

METADATA = b"human_gait"
_ROWS = 1000  # of a group in the file of curves
_HEAD = (
    Column("key", "of the scenario and the version of the package", words=True),
    Column("success", "whether it is a walk: found, and every check passed"),
    Column("reason", "why there is no walk", words=True),
    Column("diagnosis", "what is not kept, and what to try", words=True),
    Column("strength_joint", "axis whose muscle is nearest to its strength", words=True),
    Column("start", "cold, or the key of the walk it started from", words=True),
    Column("person", "number in the population, from 0"),
)
_TAIL = (
    Column("attempts", "how often it was tried"),
    Column("iterations", "of the solver"),
    Column("seconds", "that it took, the only column that differs between runs", "s"),
)
_WHOLE = ("person", "attempts", "iterations")


def columns() -> tuple[Column, ...]:
    """Return all columns of an index, in their order."""
    return (*_HEAD, *settings_columns(), *number_columns(), *_TAIL)


def write_index(plan: Plan, store: Store, there: set[str]) -> int:
    """Write the index of the walks that are there, in the order of the plan; return how many.

    Parameters
    ----------
    plan : Plan
    store : Store
    there : set of str
        Keys of the walks that are there.

    Raises
    ------
    ResultError
        If the files cannot be written.
    """
    pa, pq = arrow(), parquet()
    jobs = [job for job in plan.jobs if job.key in there]
    schema, curves = _index_schema(pa, plan), _curves_schema(pa)
    tables: list[Any] = []
    with (
        whole_file(store.folder / CYCLES) as path,
        pq.ParquetWriter(path, curves, compression="zstd") as file,
    ):
        for first in range(0, len(jobs), _ROWS):
            some = jobs[first : first + _ROWS]
            found = [one for job in some if (one := _read(job, store)) is not None]
            tables.append(_index_table(pa, schema, [row for row, _ in found]))
            file.write_table(_curves_table(pa, curves, found))
    index = pa.concat_tables(tables)
    with whole_file(store.folder / INDEX) as path:
        pq.write_table(index, path, compression="zstd")
    return int(index.num_rows)


def _read(job: Job, store: Store) -> tuple[dict[str, Any], Any] | None:
    """Return the row and the curves of a walk; what the study varies stands in it, too.

    A damaged file is no walk, as if it were not there: None.
    """
    try:
        row, curves = store.curves(job.key)
    except ResultError:
        return None
    plain: dict[str, Any] = {}
    for key, value in job.settings.items():
        plain |= cells_of_setting(key, value)
    known = {name: value for name, value in plain.items() if name not in row}
    return {**known, **row, "person": job.person}, curves


def _index_schema(pa: Any, plan: Plan) -> pa.Schema:
    fields = [_field(pa, column) for column in columns()]
    return pa.schema(fields, metadata={METADATA: json.dumps(_about(plan)).encode()})


def _index_table(pa: Any, schema: pa.Schema, rows: Sequence[dict[str, Any]]) -> pa.Table:
    arrays = [
        pa.array([_cell(row.get(field.name), field.type, pa) for row in rows], field.type)
        for field in schema
    ]
    return pa.Table.from_arrays(arrays, schema=schema)


def _cell(value: Any, kind: Any, pa: Any) -> Any:
    """Return a value for a column: None where there is none, or where it is of another kind."""
    if value is None:
        return np.nan if kind == pa.float64() else None
    if kind == pa.string():
        return str(value)
    number = isinstance(value, int | float)
    return value if number else (np.nan if kind == pa.float64() else None)


def _field(pa: Any, column: Column) -> Any:
    kind = pa.float64()
    if column.words:
        kind = pa.string()
    elif column.name in _WHOLE:
        kind = pa.int64()
    elif column.name == "success":
        kind = pa.bool_()
    return pa.field(column.name, kind, metadata={"unit": column.unit, "meaning": column.meaning})


def _about(plan: Plan) -> dict[str, Any]:
    """Return what the metadata of an index tell of the study."""
    study = plan.study
    return {
        "study": study.name,
        "version": package_version(),
        "walks": len(plan.jobs),
        "varied": _varied(study),
        "population": vars(study.people) if study.people else None,
        "pace": study.pace,
        "outputs": list(study.show),
        "limits": list(study.limits),
    }


def _varied(study: StudyFile) -> list[str]:
    """Return the columns of what is varied; of three numbers those that are not always the same."""
    found: list[str] = []
    for key, values in study.vary.items():
        cells = [cells_of_setting(key, value) for value in values.steps]
        changing = [name for name in cells[0] if len({cell[name] for cell in cells}) > 1]
        found += changing or list(cells[0])
    return found


def _curves_schema(pa: Any) -> pa.Schema:
    curve = pa.list_(pa.float32(), len(PERCENT))
    fields = [pa.field("key", pa.string())]
    for name in CURVES:
        label, unit = label_and_unit(name)
        fields.append(pa.field(name, curve, metadata={"unit": unit, "meaning": label}))
    return pa.schema(fields)


def _curves_table(pa: Any, schema: pa.Schema, found: Sequence[tuple[dict[str, Any], Any]]) -> Any:
    """Return the curves of some walks; nothing where there is no walk."""
    arrays = [pa.array([row["key"] for row, _ in found], pa.string())]
    for i in range(len(CURVES)):
        one = [None if curves is None else curves[i] for _, curves in found]
        arrays.append(pa.array(one, schema.field(i + 1).type))
    return pa.Table.from_arrays(arrays, schema=schema)
