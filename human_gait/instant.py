"""Everything known at the instants of a step: torques, ground reaction and feet, with partials."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from human_gait.body import make_body
from human_gait.carried_load import CarriedForce
from human_gait.contact_plan import ContactPlan
from human_gait.dynamics import make_dynamics
from human_gait.feet import Feet, FootMotion
from human_gait.ground_reaction import GroundReaction, ground_reaction, joint_torques
from human_gait.jet import Jet
from human_gait.passive import PassiveJoints
from human_gait.scenario import Scenario

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Instants:
    """K instants of a step.

    Attributes
    ----------
    t : (K,) array, [s]
    q, v, a : (K, 55) array
    torque : Jet (K, 55), [N m], [N]
        Joint torques with the ground reaction: what muscles and tissues give together.
    muscle_torque : Jet (K, 55), [N m]
        The part that the muscles give: `torque` without the passive torques.
    ground : GroundReaction
    feet : FootMotion of the right and of the left foot
    """

    t: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    torque: Jet
    muscle_torque: Jet
    ground: GroundReaction
    feet: tuple[FootMotion, FootMotion]


class Walker:
    """The body of a scenario on the ground of its plan.

    Parameters
    ----------
    scenario : Scenario
    dynamics : str
        One of ``dynamics.ENGINES``.
    """

    def __init__(self, scenario: Scenario, dynamics: str = "pinocchio") -> None:
        self.body = make_body(scenario.subject, scenario.load)
        self.plan = ContactPlan(scenario, self.body)
        self._dynamics = make_dynamics(self.body, dynamics)
        self._feet = Feet(self.body)
        self._carried = CarriedForce(self.body) if scenario.load.model == "force" else None
        pays_for_all = scenario.objective.passive_torques == "none"
        self._passive = None if pays_for_all else PassiveJoints()

    def at(self, t: FloatArray, q: FloatArray, v: FloatArray, a: FloatArray) -> Instants:
        """Return what is known at the times t (K,) in [0, T] of the motion q, v, a (K, 55)."""
        dynamics = self._dynamics.inverse(q, v, a)
        if self._carried:
            dynamics = self._carried.added(dynamics, q)
        ground = ground_reaction(dynamics, self.plan, t)
        torque = joint_torques(dynamics, ground)
        muscle_torque = torque - self._passive.torque(q, v) if self._passive else torque
        feet = self._feet.motion(dynamics, v)
        return Instants(t, q, v, a, torque, muscle_torque, ground, feet)
