"""What was measured of one trial, in SI units and the axes here, under the names of its source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.export.events import FootEvent
from human_gait.values import Value

NEWTON_METRES, PER_MASS = "N m", "N m/kg"
"""The units that moments can have."""


@dataclass(frozen=True, eq=False, repr=False)
class Plate(Value):
    """What one force plate, or one foot, gives to the walker.

    Vectors are in the axes of the world here: x left, y up, z forward.

    Attributes
    ----------
    time : (n,) array, [s]
        Its own: plates are sampled more often than markers.
    force : (n, 3) array, [N]
        On the foot.
    point : (n, 3) array, [m]
        Centre of pressure, NaN where nothing acts.
    free_moment : (n,) array, [N m]
        About the vertical through the point.
    name : str
        ``r`` or ``l`` where the file says which foot it is, else what the file calls it.
    """

    time: FloatArray
    force: FloatArray
    point: FloatArray
    free_moment: FloatArray
    name: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Value):
    """One measured trial, of one file or of several about the same.

    Attributes
    ----------
    source : Path
        The file; of several the first.
    time : (K,) array, [s]
        Increases; of all but the plates, which have their own.
    angles, translations : mapping of str to (K,) array, [rad] and [m]
        Keyed by the columns of the source, in its signs; NaN where missing.
    markers : mapping of str to (K, 3) array, [m]
        In the axes of the world here (x left, y up, z forward); NaN where missing.
    plates : tuple of Plate
    moments : mapping of str to (K,) array, [N m] or [N m/kg]
        Keyed and signed as the angles.
    moment_unit : str
        ``N m`` or ``N m/kg``.
    mass : float or None, [kg]
        Of the walker, if the source tells.
    events : tuple of FootEvent
        Strikes and offs of the feet, if the source has them.
    ignored : tuple of str
        Columns that are none of these.
    notes : tuple of str
        What a reader of the files should know, a sentence each.
    """

    source: Path
    time: FloatArray
    angles: Mapping[str, FloatArray] = field(default_factory=dict)
    translations: Mapping[str, FloatArray] = field(default_factory=dict)
    markers: Mapping[str, FloatArray] = field(default_factory=dict)
    plates: tuple[Plate, ...] = ()
    moments: Mapping[str, FloatArray] = field(default_factory=dict)
    moment_unit: str = NEWTON_METRES
    mass: float | None = None
    events: tuple[FootEvent, ...] = ()
    ignored: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def rate(self) -> float:
        """Samples a second, [Hz]; NaN of a single one."""
        steps = np.diff(self.time)
        return float(1.0 / np.median(steps)) if len(steps) else float("nan")
