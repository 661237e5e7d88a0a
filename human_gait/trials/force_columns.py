"""Columns of ground reaction in tables, by the several ways in which programs name them.

A column is a part (force ``v``, point ``p``, torque) of a plate along an axis. Of the plate's name
the column has what is left when these are taken away: ``1``, ``r``, ``calcn_r``, or nothing.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import TrialError
from human_gait.trials.axes import Axes
from human_gait.trials.recording import Plate

_COLUMN = re.compile(
    r"(?P<before>\w*?)_?(?:ground|grf?)_?(?P<kind>force|torque|moment)_?(?P<after>\w*?)_?"
    r"(?P<part>[vpmt]?)(?P<axis>[xyz])(?:_(?:N|m|Nm))?",
    re.IGNORECASE,
)
_OWN = re.compile(
    r"(?P<plate>right|left)_(?P<part>force|pressure|free_moment)_(?P<axis>[xyz])_(?:N|m|Nm)"
)
_SIDE = re.compile(r"(?:.*_)?(r|l|right|left)", re.IGNORECASE)
_AT_REST = 1e-9  # [N]


@dataclass(frozen=True)
class ForceColumn:
    """One column of ground reaction.

    Attributes
    ----------
    plate : str
        ``r`` or ``l`` where the name tells the foot, else what it calls the plate, or nothing.
    part : str
        ``force``, ``point`` or ``torque``.
    axis : int
    """

    plate: str
    part: str
    axis: int


def force_column(name: str) -> ForceColumn | None:
    """Return what a column of ground reaction is, None for any other."""
    if own := _OWN.fullmatch(name):
        kinds = {"force": "force", "pressure": "point", "free_moment": "torque"}
        return ForceColumn(own["plate"][0], kinds[own["part"]], "xyz".index(own["axis"]))
    if not (matched := _COLUMN.fullmatch(name)):
        return None
    part = {"v": "force", "p": "point", "m": "torque", "t": "torque"}.get(matched["part"].lower())
    if not part:
        part = "force" if matched["kind"].lower() == "force" else "torque"
    words = [word for word in (matched["before"], matched["after"]) if word]
    return ForceColumn(_plate_name("_".join(words)), part, "xyz".index(matched["axis"].lower()))


def plates_of(
    path: Path, time: FloatArray, columns: Mapping[str, FloatArray], axes: Axes
) -> tuple[Plate, ...]:
    """Return the plates that the columns (K,) of a table make, in the axes here.

    Columns of other quantities are left out.

    Raises
    ------
    TrialError
        If a plate has no force along an axis.
    """
    found: dict[str, dict[tuple[str, int], FloatArray]] = {}
    for name, values in columns.items():
        if column := force_column(name):
            found.setdefault(column.plate, {})[column.part, column.axis] = values
    return tuple(_plate(path, name, time, parts, axes) for name, parts in found.items())


def on_the_foot(plates: Iterable[Plate]) -> tuple[tuple[Plate, ...], str]:
    """Return plates with the force on the foot, and a note where it was the one on the plate.

    The ground only pushes: a mean force that points down is that of the foot on the plate.
    """
    turned, names = [], []
    for plate in plates:
        if np.nanmean(plate.force[:, 1]) < -_AT_REST:
            names.append(plate.name or "of no name")
            plate = Plate(plate.time, -plate.force, plate.point, -plate.free_moment, plate.name)  # noqa: PLW2901
        turned.append(plate)
    told = f"the forces of plate {', '.join(names)} point down: taken as those on the plate"
    return tuple(turned), told if names else ""


def check_vertical(path: Path, plates: Iterable[Plate], axes: Axes) -> None:
    """Raise TrialError if the forces of walkers point mostly in another way than up or down."""
    total = np.zeros(3)
    for plate in plates:
        total += np.nansum(np.abs(plate.force), axis=0)
    axis = int(total.argmax())
    if total[axis] > _AT_REST and axis != 1:
        along = int(np.abs(axes.turn[axis]).argmax())
        message = f"the forces are largest along {'xyz'[along]}, and not along {axes.up}"
        raise TrialError(
            f"{path}: {message}, which would be up: give --up {'xyz'[along]}"
            f" (or --up {axes.up} if that is so)"
        )


def _plate_name(text: str) -> str:
    matched = _SIDE.fullmatch(text)
    return matched[1][0].lower() if matched else text


def _plate(
    path: Path,
    name: str,
    time: FloatArray,
    parts: Mapping[tuple[str, int], FloatArray],
    axes: Axes,
) -> Plate:
    missing = [axis for k, axis in enumerate("xyz") if ("force", k) not in parts]
    if missing:
        which = f"the plate {name!r}" if name else "the plate"
        raise TrialError(f"{path}: {which} has no force along {', '.join(missing)}")
    flat = np.zeros(len(time))

    def vectors(part: str) -> FloatArray:
        return axes.here(np.stack([parts.get((part, k), flat) for k in range(3)], axis=1))

    force = np.nan_to_num(vectors("force"))
    loaded = np.asarray((np.abs(force) > _AT_REST).any(axis=1))
    located = any(part == "point" for part, _ in parts)
    point = np.where(loaded[:, None] & located, vectors("point"), np.nan)
    moment = np.where(loaded, np.nan_to_num(vectors("torque")[:, 1]), 0.0)
    return Plate(time, force, point, moment, name)
