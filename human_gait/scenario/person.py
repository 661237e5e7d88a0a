"""Who walks, and what is carried."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

from human_gait.scenario.declarations import choice, number
from human_gait.scenario.schema import About, Section, section

MEDIAN_BODY = {  # stature [m]: ANSUR II medians; mass [kg]: ANSUR 1988 means
    "male": {"stature": 1.755, "mass": 78.4},
    "female": {"stature": 1.626, "mass": 62.0},
}
LEG_LENGTH = {"male": 0.530, "female": 0.514}  # hip centre above the sole / stature


def _of_the_sex(name: str) -> str:
    return ", ".join(f"{body[name]} ({sex})" for sex, body in MEDIAN_BODY.items())


@section
class Subject(Section):
    """The person who walks."""

    sex: str = choice(
        "whose proportions and strength; also the stature and mass if left out",
        "male",
        "female",
        default=None,
        default_words='"male"',
    )
    stature: float = number(
        "standing height",
        "m",
        1.3,
        2.2,
        default=None,
        default_words=_of_the_sex("stature"),
        source="adults; default 50th percentile of the sex",
    )
    mass: float = number(
        "body mass, without the load",
        "kg",
        30.0,
        200.0,
        default=None,
        default_words=_of_the_sex("mass"),
        source="adults; default 50th percentile of the sex",
    )

    strength: float = number(
        "percentile of muscle strength among people of that sex, stature and mass",
        "%",
        1.0,
        99.0,
        default=50.0,
    )

    @classmethod
    def default(cls, sex: str = "male") -> Self:
        """Return the 50th percentile of one sex."""
        return cls.from_table({"sex": sex})

    @classmethod
    def defaults(cls, given: Mapping[str, Any], about: About) -> dict[str, Any]:
        """Return the sex, and the stature and mass of its median."""
        sex = given.get("sex", "male")
        return {**super().defaults(given, about), "sex": sex, **MEDIAN_BODY[sex]}

    @property
    def leg_length(self) -> float:
        """Height of the hip centre above the sole of the straight leg [m]."""
        return LEG_LENGTH[self.sex] * self.stature


@section
class Load(Section):
    """A box carried on the thorax, such as a backpack.

    `position` is that of its centre from the T8/T9 joint centre, x left, y up, z forward when
    upright; `size` are its edges along the same axes, which give its inertia. As ``rigid`` it is a
    body of its own on the thorax; as ``force`` only its weight acts there, as in Eq. (9).
    """

    mass: float = number("mass of what is carried, 0 for nothing", "kg", 0.0, 100.0, default=0.0)
    position: tuple[float, float, float] = number(
        "centre of the load from the T8/T9 joint: left, up, forward",
        "m",
        -1.0,
        1.0,
        default=(0.0, 0.05, -0.22),
    )
    size: tuple[float, float, float] = number(
        "edges of the load along the same axes, which give its inertia",
        "m",
        0.01,
        2.0,
        default=(0.30, 0.45, 0.20),
    )
    model: str = choice(
        "rigid: a body with inertia; force: its weight alone acts on the thorax",
        "rigid",
        "force",
        default="rigid",
        source="Eq. 9 has a force",
    )
