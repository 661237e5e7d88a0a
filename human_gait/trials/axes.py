"""The axes that a file was measured in, and how they turn into those here.

Here x is to the left, y up, z forward. A file says where up and forward are along its own axes, and
so does the user; what neither says is asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import TrialError

DIRECTIONS = ("x", "-x", "y", "-y", "z", "-z")
"""Along an axis of the file, or against it."""

_UPRIGHT = 1.0  # [m]: markers that reach so far in one direction stand on a body that does
_WALKED = 0.5  # [m]: markers that go so far show where forward is
_AHEAD = 0.7  # cosine of about 45 deg


@dataclass(frozen=True)
class Axes:
    """Where up and forward are, in the axes of a file.

    Attributes
    ----------
    up, forward : str
        Of ``DIRECTIONS``.
    """

    up: str
    forward: str

    @property
    def turn(self) -> FloatArray:
        """(3, 3) rotation from the axes of the file to those here: left is up x forward."""
        up, forward = _unit(self.up), _unit(self.forward)
        return np.stack([np.cross(up, forward), up, forward])

    def here(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (..., 3) of the file in the axes here."""
        with np.errstate(invalid="ignore", over="ignore"):  # of numbers that a broken file holds
            return np.asarray(vectors @ self.turn.T + 0.0)  # no -0


OPENSIM = Axes("y", "x")
"""Of OpenSim: x forward, y up, z right."""

OURS = Axes("y", "z")
"""Of tables that this package writes."""


def axes_of(path: Path, up: str, forward: str, known: Axes | None) -> Axes:
    """Return the axes that the user gives, or else those that are known of the file.

    Parameters
    ----------
    path : Path
    up, forward : str
        As given; empty where not.
    known : Axes or None

    Raises
    ------
    TrialError
        If neither tells, or the two directions are along one axis.
    """
    if known:
        up, forward = up or known.up, forward or known.forward
    asked = [f"--{n} x|y|z" for n, given in (("up", up), ("forward", forward)) if not given]
    if asked:
        message = f"{path}: does not say which of its axes is up and which forward"
        raise TrialError(f"{message}: give {' and '.join(asked)}, with - for against it")
    if up[-1] == forward[-1]:
        message = f"up is {up} and forward {forward}, which is the same axis"
        raise TrialError(f"{path}: {message}: give --up and --forward")
    return Axes(up, forward)


def check_upright(path: Path, markers: Mapping[str, FloatArray], axes: Axes) -> None:
    """Raise TrialError if a body that stands or walks reaches furthest in another way than up.

    Parameters
    ----------
    path : Path
    markers : mapping of str to (K, 3) array, [m]
        In the axes here.
    axes : Axes
    """
    if len(markers) < 4:
        return
    reach, middle = _extent(np.stack(list(markers.values())))
    longest = int(reach.argmax())
    if reach[longest] > _UPRIGHT and longest != 1:
        seen = _named(axes, longest, float(middle[longest]))  # the ground is at 0
        message = f"the markers reach furthest along {seen}, {reach[longest]:.1f} m, and not along"
        raise TrialError(
            f"{path}: {message} {axes.up}, which would be up: give --up {seen}"
            f" (or --up {axes.up} if that is so)"
        )


def check_forward(path: Path, markers: Mapping[str, FloatArray], axes: Axes) -> None:
    """Raise TrialError if the markers go another way than forward; on a treadmill they stay."""
    gone = [_way(places) for places in markers.values()]
    known = [way for way in gone if np.isfinite(way).all()]
    if not known:
        return
    way = np.median(known, axis=0) * (1.0, 0.0, 1.0)
    length = float(np.linalg.norm(way))
    if length > _WALKED and way[2] < _AHEAD * length:
        axis = int(np.abs(way).argmax())
        seen = _named(axes, axis, float(way[axis]))
        message = f"the markers go {length:.1f} m along {seen}, and not along {axes.forward}"
        raise TrialError(
            f"{path}: {message}, which would be forward: give --forward {seen}"
            f" (or --forward {axes.forward} if that is so)"
        )


def _extent(places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the medians over time of how far markers (n, K, 3) reach, and where they are, (3,)."""
    seen = np.isfinite(places).all(axis=2).all(axis=0)
    if not seen.any():
        return np.zeros(3), np.zeros(3)
    known = places[:, seen]
    reach = np.median(np.ptp(known, axis=0), axis=0)
    return np.asarray(reach), np.asarray(np.median(known.mean(axis=0), axis=0))


def _way(places: FloatArray) -> FloatArray:
    seen = places[np.isfinite(places).all(axis=1)]
    return seen[-1] - seen[0] if len(seen) > 1 else np.full(3, np.nan)


def _unit(direction: str) -> FloatArray:
    sign = -1.0 if direction.startswith("-") else 1.0
    return np.asarray(sign * np.eye(3)["xyz".index(direction[-1])])


def _named(axes: Axes, axis: int, sign: float = 1.0) -> str:
    """Return which direction of the file an axis here is, with its sign."""
    along = np.sign(sign) * axes.turn[axis]
    number = int(np.abs(along).argmax())
    return ("-" if along[number] < 0 else "") + "xyz"[number]
