"""Step length, cadence and double support beside those of measured people.

References
----------
C. A. Fukuchi, R. K. Fukuchi, M. Duarte, "A public dataset of overground and treadmill walking
kinematics and kinetics in healthy individuals", PeerJ 6 (2018) e4640.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy import stats

from human_gait import data
from human_gait.arrays import FloatArray
from human_gait.people.reference import Cycle, references, stance, stance_of
from human_gait.values import Value

_TRIALS = "measured/fukuchi2018_h2a_spatiotemporal_by_subject"


@dataclass(frozen=True, eq=False)
class StepScore(Value):
    """A quantity of the step against what people do.

    Attributes
    ----------
    name, unit : str
    predicted, measured : float
    lower, upper : float
        Range in which a measured person is expected, see `basis`.
    basis : str
    """

    name: str
    unit: str
    predicted: float
    measured: float
    lower: float
    upper: float
    basis: str

    @property
    def inside(self) -> bool:
        """Whether the prediction lies in the range."""
        return self.lower <= self.predicted <= self.upper


@dataclass(frozen=True)
class StepLengthRegression:
    """Step length of young adults against speed, a straight line.

    Attributes
    ----------
    speed, step_length : (n,) arrays, [m/s] and [m]
        The trials.
    intercept : float, [m]
    slope : float, [s]
    """

    speed: FloatArray
    step_length: FloatArray
    intercept: float
    slope: float

    def at(self, speed: float) -> float:
        """Return the expected step length, [m]."""
        return self.intercept + self.slope * speed

    def interval(self, speed: float, coverage: float = 0.95) -> tuple[float, float]:
        """Return the prediction interval of one person's step length, [m].

        Notes
        -----
        L +- t s sqrt(1 + 1/n + (v - mean v)^2 / S_vv), s the residual standard deviation. A
        subject's trials at several speeds are taken as independent, which they are not quite.
        """
        n, centred = len(self.speed), self.speed - self.speed.mean()
        residual = self.step_length - self.intercept - self.slope * self.speed
        variance = residual @ residual / (n - 2)
        leverage = 1.0 / n + (speed - self.speed.mean()) ** 2 / (centred @ centred)
        half = float(stats.t.ppf((1 + coverage) / 2, n - 2) * np.sqrt(variance * (1 + leverage)))
        return self.at(speed) - half, self.at(speed) + half


@cache
def step_length_regression() -> StepLengthRegression:
    """Return the regression of the young adults' step length on their speed."""
    rows = [row for row in data.rows(_TRIALS, __package__) if row["age_group"] == "Young"]
    speed, length = (
        np.array([float(row[name]) for row in rows]) for name in ("speed_m_per_s", "step_length_m")
    )
    slope, intercept = np.polyfit(speed, length, 1)
    return StepLengthRegression(speed, length, float(intercept), float(slope))


def step_scores(cycle: Cycle, speed: float, step_length: float) -> tuple[StepScore, ...]:
    """Return step length, cadence and double support beside the measured ones.

    Parameters
    ----------
    cycle : mapping of str to (101,) array
    speed : float, [m/s]
    step_length : float, [m]
    """
    regression = step_length_regression()
    expected, (shorter, longer) = regression.at(speed), regression.interval(speed)
    basis = (
        f"22 young adults, Fukuchi 2018: {regression.intercept:.3f} m + {regression.slope:.3f} s"
        f" x speed, 95 % prediction interval"
    )
    length = StepScore("step length", "m", step_length, expected, shorter, longer, basis)
    return length, _cadence(speed, length), _double_support(cycle)


def _cadence(speed: float, length: StepScore) -> StepScore:
    """Return the cadence, [steps/min]: at a given speed, step length once more."""
    metres = (length.predicted, length.measured, length.upper, length.lower)
    predicted, measured, lower, upper = (60.0 * speed / m for m in metres)
    basis = "60 \N{MULTIPLICATION SIGN} speed / step length"
    return StepScore("cadence", "steps/min", predicted, measured, lower, upper, basis)


def _double_support(cycle: Cycle) -> StepScore:
    """Return the share of a symmetric step with both feet down: toe-off less half a cycle."""
    falisse = next(reference for reference in references() if not reference.stance_only)
    force = falisse.curves["vertical_up_BW"]
    middle, low, high = (
        _double_support_share(stance_of(force.percent, force.mean + k * force.sd))
        for k in (0.0, -2.0, 2.0)
    )
    band = "vertical force, and that \N{PLUS-MINUS SIGN} 2 SD"
    basis = f"{falisse.label}, at the speed they chose: {band}"
    return StepScore(
        "double support",
        "% of step",
        _double_support_share(stance(cycle)),
        middle,
        low,
        high,
        basis,
    )


def _double_support_share(stands: tuple[float, float]) -> float:
    return 2.0 * (stands[1] - stands[0] - 50.0)
