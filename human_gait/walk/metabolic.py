"""The metabolic rate of a walk, by a model of joint torques.

    P = p_0 M + h sum_i tau_i^2 / (M g H) + w sum_i max(tau_i (v_i + dtau_i/dt / k_i), 0)

averaged over a step. M is the body mass, H the stature, p_0 the rate of standing; tau_i are the
muscle torques. The second part is heat: muscles that hold cost without work. It goes with the
square of the torque: in proportion to it, what people carry would cost too little. Strength goes
with weight times stature, M g H, and so size alone leaves the cost per kilogram as it is. The third
part is the positive work of the muscle fibres, a joule of which takes w: work and heat of
shortening. A tendon of stiffness k_i is in series with the fibres: while the torque rises it gives
way, and as the torque falls it gives back what no fibre has to do (the ankle in push-off; all other
joints have k = infinity). k is `objective.tendon_stiffness` of the scenario; the other constants
stand in ``data/metabolic_model.csv``.

``benchmarks/energy_fit.py`` calibrates h and w on the oxygen that people take at seven speeds and
tells the error. The model is for level walking at 0.7 to 1.8 m/s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from human_gait import data
from human_gait.arrays import FloatArray
from human_gait.body.skeleton import ANKLES, GRAVITY, mirror

if TYPE_CHECKING:
    from human_gait.scenario import Subject
    from human_gait.walk.gait import Samples

_MODEL = {row["name"]: float(row["value"]) for row in data.rows("metabolic_model")}

STANDING_RATE = _MODEL["standing_rate"]
"""p_0, [W/kg]."""

TORQUE_HEAT = _MODEL["torque_heat"]
"""h, [W/(N m)]."""

FIBRE_WORK = _MODEL["fibre_work"]
"""w, joules of food for one of positive work, beside the heat of the torque."""

ERROR_RMS, ERROR_LARGEST = _MODEL["error_rms"], _MODEL["error_largest"]
"""Error of the model on the data of its calibration, as a share: RMS, and at a single speed."""

ERROR = f"\N{PLUS-MINUS SIGN} {100.0 * ERROR_RMS:.0f} %"
"""The same in words."""

SPEEDS = 0.65, 1.85
"""Least and greatest speed of level walking that the model is for, [m/s]: those fitted, rounded."""


@dataclass(frozen=True)
class MetabolicRate:
    """Mean metabolic rate over a step, by its parts, [W].

    Attributes
    ----------
    standing : float
        p_0 M.
    heat : float
        Of the muscle torques.
    work : float
        What positive work of the fibres takes.
    """

    standing: float
    heat: float
    work: float

    @property
    def net(self) -> float:
        """What walking takes above standing, [W]."""
        return self.heat + self.work

    @property
    def gross(self) -> float:
        """All of it, [W]."""
        return self.standing + self.net


def metabolic_rate(now: Samples, subject: Subject, tendon: float) -> MetabolicRate:
    """Return the mean metabolic rate over the time of some samples, which is to be one step.

    Parameters
    ----------
    now : Samples
    subject : Subject
        Who walks: mass without a load, and stature.
    tendon : float, [N m/rad]
        k of the ankle's flexion.
    """
    heat, work = TORQUE_HEAT * squared_torque(now, subject), FIBRE_WORK * positive_work(now, tendon)
    return MetabolicRate(STANDING_RATE * subject.mass, heat, work)


def squared_torque(now: Samples, subject: Subject) -> float:
    """Return the sum of the squared muscle torques over M g H, on average, [N m]."""
    squares = np.trapezoid((now.active**2).sum(axis=1), now.t) / (now.t[-1] - now.t[0])
    return float(squares / (subject.mass * GRAVITY * subject.stature))


def positive_work(now: Samples, tendon: float) -> float:
    """Return the power that the fibres give, without what they take up, on average, [W]."""
    return float(np.maximum(fibre_work(now, tendon), 0.0).sum() / (now.t[-1] - now.t[0]))


def fibre_work(now: Samples, tendon: float) -> FloatArray:
    """Return the work (K, 55) of muscle fibres from each sample of a step to the next, [J].

    The last is what a jump of the torques to those of the next step takes, if there is one.

    Notes
    -----
    Mean torque times the turn of the fibres, dq + dtau / k. What the tendon takes up and gives
    back, tau dtau / k, is the exact difference of its energy tau^2 / 2 k, and nothing over a step.
    """
    tau = np.concatenate([now.active, mirror(now.active[:1])])
    turn = np.diff(now.q, axis=0, append=now.q[-1:])
    turn[:, ANKLES] += np.diff(tau[:, ANKLES], axis=0) / tendon
    return np.asarray((tau[1:] + tau[:-1]) / 2 * turn)
