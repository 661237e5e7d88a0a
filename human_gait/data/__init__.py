"""The tables of the body: every row names its source or its assumption."""

import csv
from importlib.resources import files


def rows(table: str) -> list[dict[str, str]]:
    """Return the rows of one of the package's CSV tables, keyed by column.

    Parameters
    ----------
    table : str
        Name without extension: ``anthropometry``, ``dh_table``, ``joint_limits``, ``capsules``,
        ``passive_joints``, ``markers``.
    """
    text = (files(__name__) / f"{table}.csv").read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))
