"""The tables of the body: every row names its source or its assumption."""

import csv
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from types import MappingProxyType


@cache
def rows(table: str, package: str = __name__) -> tuple[Mapping[str, str], ...]:
    """Return the rows of a CSV table, keyed by column.

    Parameters
    ----------
    table : str
        Name without extension: ``anthropometry``, ``dh_table``, ``joint_limits``, ``capsules``,
        ``passive_joints``, ``markers``; or a path in another package.
    package : str, optional
        The package that holds it, where it is no table of the body.
    """
    text = (files(package) / f"{table}.csv").read_text(encoding="utf-8")
    return tuple(map(MappingProxyType, csv.DictReader(text.splitlines())))
