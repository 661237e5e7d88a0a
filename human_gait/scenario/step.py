"""How fast and how far the steps go, and when the feet meet and leave the ground."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from human_gait.exceptions import ScenarioError
from human_gait.scenario.declarations import number
from human_gait.scenario.schema import HUMAN, About, Section, section

_STEP = (0.152, 0.306)  # step length [m] by stature and, [s], by speed: Fukuchi et al. 2018


@section
class Walk(Section):
    """The gait that is asked for: V and L of the paper."""

    speed: float = number("mean walking speed, V of the paper", "m/s", 0.1, 3.0)
    step_length: float = number(
        "from heel strike to heel strike of the other foot, L of the paper",
        "m",
        0.1,
        2.0,
        default=None,
        default_words="0.152 stature + 0.306 s x speed",
        source="22 young adults at 8 speeds: SD 0.025 m, Fukuchi et al. 2018",
    )
    step_width: float = number(
        "distance between the lines that the two feet walk on",
        "m",
        0.0,
        0.4,
        default=0.10,
        source="measured: 0.08-0.11 m",
    )

    @classmethod
    def defaults(cls, given: Mapping[str, Any], about: About) -> dict[str, Any]:
        """Return the step that people take at a speed, and the other defaults."""
        by_stature, by_speed = _STEP
        usual = by_stature * about.stature + by_speed * given.get("speed", about.speed)
        found = {**super().defaults(given, about), "step_length": round(usual, 3)}
        return found if "speed" in given else {"step_width": found["step_width"]}

    @property
    def step_time(self) -> float:
        """Duration of one step T = L / V [s]."""
        return self.step_length / self.speed


@section
class Phases(Section):
    """Events of the feet as fractions of one step, heel strike = 0, the other foot's = 1.

    In the formulation ``human`` double support follows from the speed, as people's does, and the
    ball leaves the ground so much earlier: the trailing foot needs time to roll over its toes.
    """

    foot_flat: float = number(
        "the leading foot has rolled down and stands flat",
        "of the step",
        0.01,
        0.99,
        default=0.175,
        effort=0.15,
        default_words="0.175, 0.15 for effort; the end of double support at most",
        source="measured, 1.2 m/s",
    )
    ball_off: float = number(
        "the ball of the trailing foot leaves the ground, its toes stay",
        "of the step",
        0.01,
        0.99,
        default=0.20,
        effort=0.15,
        default_words="0.10 before double support ends, 0.05 at least; 0.15 for effort",
        source="assumed: the trailing foot rolls to its toes",
    )
    double_support: float = number(
        "the trailing toes leave the ground: one foot stands from here on",
        "of the step",
        0.01,
        0.99,
        default=0.30,
        effort=0.25,
        default_words="0.30 - 0.11 s/m x (speed - 1.2 m/s), to a fortieth; 0.25 for effort",
        source="measured: loads of 5 % of the weight and more on both feet at 0.84 to 1.95 m/s",
    )
    heel_unloading: float = number(
        "the pressure starts to leave the heel of the standing foot",
        "of the step",
        0.01,
        0.99,
        default=0.35,
        source="assumed: the pressure leaves the heel",
    )
    mid_swing: float = number(
        "the swinging knee is bent to 60 deg",
        "of the step",
        0.01,
        0.99,
        default=0.40,
        source="knee most flexed at 70 % of the cycle, Eq. 25",
    )
    heel_off: float = number(
        "the heel of the standing foot leaves the ground",
        "of the step",
        0.01,
        0.99,
        default=0.70,
        effort=0.65,
        source="measured 0.6-0.7, 1.2 m/s",
    )

    @classmethod
    def defaults(cls, given: Mapping[str, Any], about: About) -> dict[str, Any]:
        """Return the events as people's follow from their speed."""
        usual = super().defaults(given, about)
        if about.formulation != HUMAN:
            return usual
        least, most = _DOUBLE_SUPPORT
        by_speed = 0.30 - 0.11 * (about.speed - 1.2)
        both = given.get("double_support", round(40.0 * min(max(by_speed, least), most)) / 40.0)
        usual["foot_flat"] = min(usual["foot_flat"], both)
        ball_off = min(round(max(both - 0.10, 0.05), 4), both)
        return {**usual, "double_support": both, "ball_off": ball_off}

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> Iterator[ScenarioError]:
        """Yield the events that do not follow each other, each once."""
        told = set()
        for event, earlier, together, words in _ORDER:
            if event in told or not {event, earlier} <= values.keys():
                continue
            time, limit = values[event], values[earlier]
            if not (time <= limit if together else limit < time):
                told.add(event)
                yield ScenarioError(cls.dotted(event), f"{words} ({limit:g})", time)


_DOUBLE_SUPPORT = (0.175, 0.325)  # the heel begins to unload at 0.35
_NOT_AFTER = "must not come after the end of double support"
_AFTER = "must come after the end of double support"
_ORDER = (  # event, the one it is compared with, whether it is to be at or before it
    ("foot_flat", "double_support", True, _NOT_AFTER),
    ("ball_off", "double_support", True, _NOT_AFTER),
    ("mid_swing", "double_support", False, _AFTER),
    ("heel_unloading", "double_support", False, _AFTER),
    ("heel_off", "double_support", False, _AFTER),
    ("heel_off", "heel_unloading", False, "must come after the heel starts to unload"),
)
