"""Numbers by which the walks of people of any size compare, and the walk that suits a size.

Bodies that differ in scale alone walk alike at one Froude number v^2 / (g l), the leg length l
being the height of the hip centre above the sole: lengths are then as l, times as sqrt(l / g),
moments and work as m g l. The mass m is that of the body, without a load.

References
----------
R. McN. Alexander, "Optimization and gaits in the locomotion of vertebrates", Physiological
Reviews 69 (1989) 1199-1227.
A. L. Hof, "Scaling gait data to body size", Gait & Posture 4 (1996) 222-223.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from human_gait.body.skeleton import GRAVITY
from human_gait.scenario import Subject, Walk
from human_gait.values import Value
from human_gait.walk.energy import energy
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import gait_cycle
from human_gait.walk.gait_file import gait_of

COMFORTABLE = 0.16
"""Froude number of comfortable walking: 1.21 m/s for the median man, 1.15 m/s for the woman."""

_STEP = (0.71, 1.02)  # in leg lengths when comfortable; more for each unit of v / sqrt(g l)


@dataclass(frozen=True)
class Scales:
    """What the numbers of a person's walk are divided by.

    Attributes
    ----------
    mass : float, [kg]
    leg : float, [m]
        Height of the hip centre above the sole.
    """

    mass: float
    leg: float

    @classmethod
    def of(cls, subject: Subject) -> Scales:
        """Return the scales of a person."""
        return cls(subject.mass, subject.leg_length)

    @property
    def speed(self) -> float:
        """Of sqrt(g l), [m/s]."""
        return float(np.sqrt(GRAVITY * self.leg))

    @property
    def time(self) -> float:
        """Of sqrt(l / g), [s]."""
        return float(np.sqrt(self.leg / GRAVITY))

    @property
    def force(self) -> float:
        """Weight m g, [N]."""
        return self.mass * GRAVITY

    @property
    def moment(self) -> float:
        """Of m g l, [N m]; also that of work, [J]."""
        return self.force * self.leg

    @property
    def power(self) -> float:
        """Of m g sqrt(g l), [W]."""
        return self.force * self.speed

    @property
    def effort(self) -> float:
        """Of (m g l)^2 sqrt(l / g), [N^2 m^2 s]."""
        return self.moment**2 * self.time


@dataclass(frozen=True, eq=False)
class Dimensionless(Value):
    """A walk in numbers that compare between people of any size.

    Attributes
    ----------
    froude : float
        v^2 / (g l).
    speed : float
        v / sqrt(g l).
    step_length : float
        Of leg lengths l.
    step_time : float
        Of sqrt(l / g).
    cost_of_transport : float
        Gross metabolic energy over weight and way, m g L.
    positive_work, negative_work : float
        Of the joints in a step, over weight and way, m g L.
    effort : float
        Integral of the squared muscle torques over a step, of (m g l)^2 sqrt(l / g), for each leg
        length of the way.
    hip_extension, knee_extension, ankle_plantarflexion : float
        Largest internal moments of the right leg, of m g l.
    L5S1_extension : float
        Largest moment, of m g l.
    """

    froude: float
    speed: float
    step_length: float
    step_time: float
    cost_of_transport: float
    positive_work: float
    negative_work: float
    effort: float
    hip_extension: float
    knee_extension: float
    ankle_plantarflexion: float
    L5S1_extension: float


def froude_number(subject: Subject, speed: float) -> float:
    """Return v^2 / (g l) of a person at a speed, [m/s]."""
    return (speed / Scales.of(subject).speed) ** 2


def comfortable_walk(subject: Subject, froude: float = COMFORTABLE) -> Walk:
    """Return speed and step length that suit a person, the same for all in proportion to the leg.

    Parameters
    ----------
    subject : Subject
    froude : float
        Froude number v^2 / (g l), above 0: 0.16 is comfortable, 0.3 brisk, 0.5 where people run.

    Returns
    -------
    Walk
        With a speed of sqrt(froude g l) and steps of (0.71 + 1.02 (sqrt(froude) - 0.4)) l.

    Raises
    ------
    ValueError
        If the Froude number is not above 0.
    ScenarioError
        If that is faster or longer than walks may be.

    Notes
    -----
    The slope is that of the 22 young adults of Fukuchi et al. (2018), 0.306 s by speed, for the
    mean of the median legs, 0.88 m: 0.306 s sqrt(g / l) = 1.02. Their step at a Froude number of
    0.16 is 0.68 l for the median man and 0.71 l for the median woman, SD 0.03 l.
    """
    if not froude > 0.0:
        raise ValueError(f"froude is {froude}, must be above 0")
    relative, scales = float(np.sqrt(froude)), Scales.of(subject)
    comfortable, slope = _STEP
    step = comfortable + slope * (relative - float(np.sqrt(COMFORTABLE)))
    return Walk(relative * scales.speed, step * scales.leg)


def dimensionless(result: Gait | str | Path) -> Dimensionless:
    """Return the numbers of a walk that compare between people of any size.

    Parameters
    ----------
    result : Gait, str or Path
        A gait, or the folder of a result, or its ``gait.npz``.

    Raises
    ------
    ResultError
        If there is no gait that can be read.
    """
    gait = gait_of(result)
    subject, walk, cycle = gait.scenario.subject, gait.scenario.walk, gait_cycle(gait)
    scales, found = Scales.of(subject), energy(gait)
    way = scales.force * walk.step_length
    hip, knee, ankle = (
        float(cycle[f"{name}_Nm_per_kg"].max() * subject.mass / scales.moment)
        for name in ("hip_extension", "knee_extension", "ankle_plantarflexion")
    )
    return Dimensionless(
        froude_number(subject, walk.speed),
        walk.speed / scales.speed,
        walk.step_length / scales.leg,
        walk.step_time / scales.time,
        found.cost_of_transport / GRAVITY,
        found.positive_work / way,
        found.negative_work / way,
        found.effort / scales.effort * scales.leg / walk.step_length,
        hip,
        knee,
        ankle,
        found.spine[0].greatest / scales.moment,
    )
