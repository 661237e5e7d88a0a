"""Curves over percent of the gait cycle or of stance, as tables publish them: means, and SD."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import TrialError
from human_gait.values import Value

_PERCENT = re.compile(r"(?:(gait_cycle|cycle|stance)_)?percent|percent_(?:gait_cycle|stance)")
_MEAN = re.compile(r"(\w+)_mean_([A-Za-z]+(?:_per_kg)?)")
_SD = ("{}_sd_{}", "{}_sd_over_steps_{}")
_OWN_SIGN = {  # columns of Fukuchi et al. in the sign of their source, which is ours
    "foreaft_Fx_raw_BW": "foreaft_forward_BW",
    "mediolateral_Fz_raw_BW": "mediolateral_medial_BW",
}


@dataclass(frozen=True, eq=False, repr=False)
class Profile(Value):
    """Curves over percent.

    Attributes
    ----------
    source : Path
    percent : (n,) array
        Of the gait cycle, or of stance.
    stance_only : bool
    mean, sd : mapping of str to (n,) array
        Keyed by quantity and unit, such as ``knee_flexion_deg``; no SD where there is none.
    """

    source: Path
    percent: FloatArray
    stance_only: bool
    mean: Mapping[str, FloatArray]
    sd: Mapping[str, FloatArray]


def is_percent(column: str) -> bool:
    """Return whether a column counts percent."""
    return bool(_PERCENT.fullmatch(column.lower()))


def profile_of(source: Path, columns: Mapping[str, FloatArray]) -> Profile:
    """Return what a table holds whose first column counts percent.

    Parameters
    ----------
    source : Path
    columns : mapping of str to (n,) array
        ``knee_flexion_mean_deg`` with ``knee_flexion_sd_deg``; where no column is a mean, each is a
        curve.

    Raises
    ------
    TrialError
        If the percentages do not rise within 0 to 100.
    """
    first = next(iter(columns))
    percent = columns[first]
    inside = np.isfinite(percent).all() and percent[0] >= 0.0 and percent[-1] <= 100.0
    if not inside or not (np.diff(percent) > 0.0).all() or len(percent) < 3:
        raise TrialError(f"{source}: {first}: must rise within 0 to 100, in 3 rows or more")
    means, deviations = {}, {}
    for name, values in columns.items():
        if matched := _MEAN.fullmatch(name):
            quantity, unit = matched.groups()
            key = f"{quantity}_{unit}"
            key = _OWN_SIGN.get(key, key)
            means[key] = values
            deviation = [pattern.format(quantity, unit) for pattern in _SD]
            if known := next((one for one in deviation if one in columns), None):
                deviations[key] = columns[known]
    if not means:
        means = {name: values for name, values in columns.items() if name != first}
    return Profile(source, percent, "stance" in first.lower(), means, deviations)
