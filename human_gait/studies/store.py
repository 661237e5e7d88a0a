"""The folder of a study: a file for each walk, which is there as a whole or not at all.

The files are what is known: whatever a study has done is told by which of them there are. Several
processes, and several computers that share a disk, may write at the same time.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import ResultError
from human_gait.results.archive import numbers, opened, told
from human_gait.results.folder import whole_file
from human_gait.results.names import WALKS
from human_gait.results.unfinished import make_folder, sweep_folder
from human_gait.scenario import Scenario
from human_gait.studies.numbers import CURVES
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import PERCENT

_ENDING = ".npz"
_PRICE = "price "  # before the name of a constraint, of its multipliers


@dataclass(frozen=True, eq=False)
class Kept:
    """What is kept of one walk.

    Attributes
    ----------
    row : mapping of str to value
        By the columns of the index.
    curves : (19, 101) array or None
        Of the gait cycle; None where there is no walk.
    gait : Gait or None
        The walk, or the best attempt at it.
    """

    row: Mapping[str, Any]
    curves: FloatArray | None = None
    gait: Gait | None = None


@dataclass(frozen=True)
class Store:
    """The walks in the folder of a study, by their keys."""

    folder: Path

    def path(self, key: str) -> Path:
        """Return the file of a walk: in 256 folders, since large ones are slow."""
        return self.folder / WALKS / key[:2] / f"{key}{_ENDING}"

    def keys(self) -> set[str]:
        """Return the keys of all walks that are there."""
        folder = self.folder / WALKS
        return {path.stem for path in folder.glob(f"??/[0-9a-f]*{_ENDING}")}

    def save(self, key: str, kept: Kept) -> None:
        """Write a walk: at once it is there as a whole, whoever else writes it.

        Raises
        ------
        ResultError
            If it cannot be written.
        """
        with whole_file(self.path(key)) as path, path.open("wb") as file:
            np.savez_compressed(file, **_members(kept))

    def row(self, key: str) -> dict[str, Any]:
        """Return the row of a walk.

        Raises
        ------
        ResultError
            If it is not there or damaged.
        """
        with opened(self.path(key), "a walk of a study") as file:
            return _row(file)

    def curves(self, key: str) -> tuple[dict[str, Any], FloatArray | None]:
        """Return the row and the curves of a walk, (19, 101) or None.

        Raises
        ------
        ResultError
            As `row`.
        """
        with opened(self.path(key), "a walk of a study") as file:
            row = _row(file)
            if "curves" not in file:
                return row, None
            curves = np.asarray(file["curves"])
            if curves.shape != (len(CURVES), len(PERCENT)) or curves.dtype != np.float32:
                raise ValueError("curves are not those of a gait cycle")
            return row, curves

    def gait(self, key: str) -> Gait:
        """Return a walk, or the best attempt at it, with its multipliers.

        Raises
        ------
        ResultError
            As `row`, and if there is none: the scenario was not allowed.
        """
        with opened(self.path(key), "a walk of a study") as file:
            if "control_points" not in file:
                raise ValueError(f"nothing was solved: {_row(file).get('reason')}")
            scenario = Scenario.from_record(told(file, "scenario"))
            breaks, points = numbers(file, "breaks"), numbers(file, "control_points")
            prices = {
                name.removeprefix(_PRICE): numbers(file, name)
                for name in file
                if name.startswith(_PRICE)
            }
            return Gait(scenario, breaks, points, told(file, "solution"), prices)


def check_store(folder: Path) -> None:
    """Raise ResultError unless walks can be written to a folder; sweep what was left unfinished."""
    try:
        make_folder(folder / WALKS)
        with tempfile.TemporaryFile(dir=folder / WALKS):
            pass
        for each in (folder / WALKS).iterdir():
            sweep_folder(each)
    except OSError as error:
        why = error.strerror or str(error)
        raise ResultError(f"{folder}: a study cannot be written here: {why}") from None


def _row(file: Mapping[str, Any]) -> dict[str, Any]:
    row = told(file, "row")
    if not isinstance(row, dict):
        raise TypeError("row is no table")
    return row


def _members(kept: Kept) -> dict[str, Any]:
    members: dict[str, Any] = {"row": np.array(json.dumps(dict(kept.row)))}
    if kept.curves is not None:
        members["curves"] = kept.curves
    if kept.gait is not None:
        gait = kept.gait
        members |= {
            "scenario": np.array(json.dumps(gait.scenario.to_dict())),
            "solution": np.array(json.dumps(dict(gait.solution))),
            "breaks": gait.breaks,
            "control_points": gait.control_points,
            **{f"{_PRICE}{name}": price for name, price in gait.multipliers.items()},
        }
    return members
