"""Which columns of a table over percent are which curves, by the same names as over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import TrialError
from human_gait.trials.known_names import CURVES, is_known, without_unit
from human_gait.trials.names import Reading, named
from human_gait.trials.profile import Profile
from human_gait.trials.recording import PER_MASS, Recording
from human_gait.trials.stated import ANGLE, MOMENT, Stated
from human_gait.values import Value


@dataclass(frozen=True, eq=False, repr=False)
class ProfileCurve(Value):
    """Mean and SD of a curve of the gait cycle, (n,) arrays in its unit; NaN for no SD."""

    mean: FloatArray
    sd: FloatArray


def profile_curves(
    profile: Profile, stated: Stated
) -> tuple[dict[str, ProfileCurve], tuple[Reading, ...]]:
    """Return the curves that the columns of a table over percent are, and how they were read.

    Raises
    ------
    TrialError
        If an angle has no unit, and none is stated.
    """
    units = {name: _unit(profile, name, stated) for name in profile.mean}
    factors = {name: ANGLE.get(unit) or MOMENT.get(unit) for name, unit in units.items()}
    scaled = {name: f * profile.mean[name] for name, f in factors.items() if f}
    direct = [name for name in profile.mean if name in CURVES and name not in scaled]
    over = Recording(
        profile.source,
        profile.percent,
        angles={name: x for name, x in scaled.items() if units[name] in ANGLE},
        moments={name: x for name, x in scaled.items() if units[name] in MOMENT},
        moment_unit=PER_MASS,
        ignored=tuple(x for x in profile.mean if x not in scaled and x not in direct),
    )
    curves, readings = named(over, stated, None, over)
    readings += tuple(
        Reading(str(profile.source), name, name, 1.0, "a curve of the gait cycle")
        for name in direct
    )
    curves |= {name: profile.mean[name] for name in direct}
    columns = {reading.curve: reading.column for reading in readings if reading.curve}
    found = {}
    for curve, mean in curves.items():
        sd = profile.sd.get(columns[curve], np.full(len(mean), np.nan))
        of_rad = units.get(columns[curve]) == "rad"
        found[curve] = ProfileCurve(mean, np.rad2deg(sd) if of_rad else sd)
    return {name: found[name] for name in CURVES if name in found}, readings


def _unit(profile: Profile, name: str, stated: Stated) -> str:
    base, unit = without_unit(name)
    if unit or name in CURVES or not is_known(base):
        return unit
    if not stated.unit(ANGLE):
        message = f"{profile.source}: column {name}: its name has no unit, as in {name}_deg"
        raise TrialError(f"{message}: give --units deg or --units rad")
    return stated.unit(ANGLE)
