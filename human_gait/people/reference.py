"""Measured gait, and how close a predicted gait cycle comes to it.

The curves are those of ``people/measured``; its README names their sources and licences.

References
----------
A. Falisse et al., "Rapid predictive simulations with complex musculoskeletal models suggest that
diverse healthy and pathological human gaits can emerge from similar control strategies", Journal of
the Royal Society Interface 16 (2019) 20190402.

C. A. Fukuchi, R. K. Fukuchi, M. Duarte, "A public dataset of overground and treadmill walking
kinematics and kinetics in healthy individuals", PeerJ 6 (2018) e4640.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from human_gait import data
from human_gait.arrays import FloatArray
from human_gait.exceptions import ResultError
from human_gait.scenario import Scenario
from human_gait.scenario.schema import HUMAN
from human_gait.trials.profile import profile_of
from human_gait.values import Value
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import COLUMNS
from human_gait.walk.measured import tracked_words, was_measured, was_tracked

Cycle = Mapping[str, FloatArray]

STANCE_THRESHOLD = 0.05
"""Vertical force of a foot that stands, [BW]; the measured stance begins and ends near it."""

_CALIBRATED = (
    "Some sizes of the formulation human are calibrated on the curves of Falisse et al. and "
    "Fukuchi et al. at 1.2 m/s, which do not test it."
)


@dataclass(frozen=True, eq=False, repr=False)
class MeasuredCurve(Value):
    """Mean and standard deviation of one quantity.

    Attributes
    ----------
    percent : (n,) array
        Of the gait cycle, or of stance.
    mean, sd : (n,) array
        In the unit that the name of the curve ends with; NaN for the SD of a single cycle.
    """

    percent: FloatArray
    mean: FloatArray
    sd: FloatArray


@dataclass(frozen=True, eq=False, repr=False)
class Reference(Value):
    """Measured curves from one source.

    Attributes
    ----------
    name, label : str
        Key, and what it is called in tables and plots.
    citation, licence : str
    stance_only : bool
        Whether the curves run over stance instead of the gait cycle.
    speed : float or None, [m/s]
        None where each subject chose it.
    curves : mapping of str to MeasuredCurve
        Keyed by the columns of the gait cycle.
    """

    name: str
    label: str
    citation: str
    licence: str
    stance_only: bool
    speed: float | None
    curves: Mapping[str, MeasuredCurve]


@dataclass(frozen=True, eq=False)
class Score(Value):
    """How close a predicted curve comes to a measured one.

    Attributes
    ----------
    reference, curve : str
    r : float
        Pearson's correlation; NaN for a curve that is constant.
    rmse, rmse_offset_free : float
        Root mean square difference, and that with both means removed, in the curve's unit.
    offset : float
        Mean predicted minus mean measured.
    predicted_range, measured_range : tuple of float
        Least and greatest value.
    predicted_peak_percent, measured_peak_percent : float
        When the greatest value is reached.
    within_1sd, within_2sd : float
        Share of the time, 0 to 1, within so many standard deviations of the measured mean; NaN
        where there is no standard deviation.
    """

    reference: str
    curve: str
    r: float
    rmse: float
    rmse_offset_free: float
    offset: float
    predicted_range: tuple[float, float]
    measured_range: tuple[float, float]
    predicted_peak_percent: float
    measured_peak_percent: float
    within_1sd: float
    within_2sd: float


@cache
def tuned_on(*scenarios: Scenario) -> str:
    """Return in a sentence which measured curves had a say in walks, and so do not test them."""
    if all(scenario.objective.formulation != HUMAN for scenario in scenarios):
        return "No measured curve enters the prediction."
    return f"No measured motion is followed. {_CALIBRATED}"


def tuned_by(*gaits: Gait) -> str:
    """Return in sentences which measured curves had a say in walks, and which are measured."""
    predicted = [gait for gait in gaits if not was_measured(gait)]
    said = [f"{gait.scenario.name} is measured itself." for gait in gaits if was_measured(gait)]
    said += [words for gait in predicted if (words := tracked_words(gait))]
    asked = [gait.scenario for gait in predicted]
    if asked and not any(was_tracked(gait) for gait in predicted):
        said.append(tuned_on(*asked))
    elif any(scenario.objective.formulation == HUMAN for scenario in asked):
        said.append(_CALIBRATED)
    return " ".join(said)


def references() -> tuple[Reference, ...]:
    """Return all measured curves that have a counterpart in the gait cycle."""
    return tuple(_reference(row) for row in data.rows("measured/sources", __package__))


def references_near(speed: float) -> tuple[Reference, ...]:
    """Return the references to compare a walk of some speed, [m/s], with.

    Of the one subject whose stance was measured at several speeds, only the nearest is kept.
    """
    stance = [reference for reference in references() if reference.stance_only]
    nearest = min(stance, key=lambda reference: abs((reference.speed or np.inf) - speed))
    return (*(reference for reference in references() if not reference.stance_only), nearest)


def _reference(row: Mapping[str, str]) -> Reference:
    curves: dict[str, MeasuredCurve] = {}
    for file in row["files"].split():
        curves |= _curves(f"measured/{file}")
    return Reference(
        row["name"],
        row["label"],
        row["citation"],
        row["licence"],
        stance_only=row["domain"] == "stance",
        speed=float(row["speed_m_per_s"]) if row["speed_m_per_s"] else None,
        curves={column: curves[column] for column in COLUMNS if column in curves},
    )


def _curves(table: str) -> dict[str, MeasuredCurve]:
    rows = data.rows(table, __package__)
    columns = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    read = profile_of(Path(table), columns)
    return {
        name: MeasuredCurve(read.percent, mean, read.sd[name]) for name, mean in read.mean.items()
    }


def scores(cycle: Cycle, reference: Reference) -> tuple[Score, ...]:
    """Return the scores of a gait cycle, one for each curve of a reference.

    Parameters
    ----------
    cycle : mapping of str to (101,) array
        As from `gait_cycle`.
    reference : Reference

    Raises
    ------
    ResultError
        If the reference covers stance only and the foot never stands.
    """
    start, end = stance(cycle) if reference.stance_only else (0.0, 100.0)
    result = []
    for name, measured in reference.curves.items():
        at = start + measured.percent / 100.0 * (end - start)
        predicted = np.interp(at, cycle["gait_cycle_percent"], cycle[name])
        result.append(score(reference.name, name, predicted, measured))
    return tuple(result)


def score(reference: str, name: str, predicted: FloatArray, measured: MeasuredCurve) -> Score:
    """Return the score of one curve, sampled at the percentages of the measured one."""
    difference = predicted - measured.mean
    offset = float(difference.mean())
    return Score(
        reference,
        name,
        r=correlation(predicted, measured.mean),
        rmse=_rms(difference),
        rmse_offset_free=_rms(difference - offset),
        offset=offset,
        predicted_range=(float(predicted.min()), float(predicted.max())),
        measured_range=(float(measured.mean.min()), float(measured.mean.max())),
        predicted_peak_percent=float(measured.percent[predicted.argmax()]),
        measured_peak_percent=float(measured.percent[measured.mean.argmax()]),
        within_1sd=_share_within(difference, measured.sd),
        within_2sd=_share_within(difference, 2.0 * measured.sd),
    )


def correlation(x: FloatArray, y: FloatArray) -> float:
    """Return Pearson's r, NaN if a curve is constant but for rounding."""
    x, y = x - x.mean(), y - y.mean()
    norm = float(np.sqrt((x @ x) * (y @ y)))
    return float(x @ y) / norm if norm > 1e-12 else float("nan")


def _share_within(difference: FloatArray, band: FloatArray) -> float:
    """Return the share of the time within a band, NaN where there is none."""
    if np.isnan(band).any():
        return float("nan")
    return float(np.mean(np.abs(difference) <= band))


def _rms(x: FloatArray) -> float:
    return float(np.sqrt(np.mean(x**2)))


def stance(cycle: Cycle) -> tuple[float, float]:
    """Return when the foot begins and ceases to stand, [% of the gait cycle].

    It stands from the first sample with more than ``STANCE_THRESHOLD`` on it to the end of that
    run of samples; the crossings are interpolated.

    Raises
    ------
    ResultError
        If it never does.
    """
    return stance_of(cycle["gait_cycle_percent"], cycle["vertical_up_BW"])


def stance_of(percent: FloatArray, vertical: FloatArray) -> tuple[float, float]:
    """Return the same from the vertical force, [BW], of any foot."""
    stands = vertical > STANCE_THRESHOLD
    if not stands.any():
        message = (
            f"vertical_up_BW never exceeds {STANCE_THRESHOLD:g}: the right foot does not stand"
        )
        raise ResultError(message)
    first = int(stands.argmax())
    rest = stands[first:]
    last = first + (len(rest) if rest.all() else int(rest.argmin())) - 1
    return _crossing(percent, vertical, first, -1), _crossing(percent, vertical, last, 1)


def _crossing(percent: FloatArray, vertical: FloatArray, inside: int, step: int) -> float:
    """Return where the force crosses the threshold between a sample and the next one outside."""
    outside = inside + step
    if not 0 <= outside < len(percent):
        return float(percent[inside])
    share = (vertical[inside] - STANCE_THRESHOLD) / (vertical[inside] - vertical[outside])
    return float(percent[inside] + share * (percent[outside] - percent[inside]))
