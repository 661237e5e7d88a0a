"""Who walks, and what is carried."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Self

from human_gait.exceptions import ScenarioError
from human_gait.scenario.declarations import choice, number
from human_gait.scenario.lengths import LENGTHS, UPRIGHT, fraction, trunk, usual_lengths
from human_gait.scenario.schema import ALONE, About, Section, section
from human_gait.scenario.survey import at_percentile

_SEXES = ("male", "female")
_FIRST = {  # who walked by default in the first versions: medians of ANSUR II, means of 1988
    "male": {"sex": "male", "stature": 1.755, "mass": 78.4},
    "female": {"sex": "female", "stature": 1.626, "mass": 62.0},
}
_TRUNK = (0.6, 1.4)  # what the other lengths must leave of its usual length


def _body(sex: str, percentile: float) -> dict[str, float]:
    """Return stature [m] and mass [kg] that are both at a percentile of the sex."""
    stature, mass = (at_percentile(sex, name, percentile) for name in ("stature", "mass"))
    return {"stature": round(stature / 1000.0, 4), "mass": round(mass, 2)}


def _of_the_sex(name: str) -> str:
    return ", ".join(f"{_body(sex, 50.0)[name]} ({sex})" for sex in _SEXES)


def _length(name: str, meaning: str, low: float, high: float) -> Any:
    """Declare a length that follows from sex and stature if it is left out."""
    shares = ", ".join(f"{fraction(name, sex):.4g} ({sex})" for sex in _SEXES)
    words = f"stature x {shares}"
    return number(meaning, "m", low, high, default=None, default_words=words)


@section
class Subject(Section):
    """The person who walks.

    Lengths are between the centres of joints. From the sole to the vertex they make the stature:
    the trunk takes what the others leave.
    """

    leads: ClassVar[Mapping[str, tuple[str, ...]]] = {"percentile": ("stature", "mass", *LENGTHS)}

    sex: str = choice(
        "whose proportions and strength; also the stature and mass if left out",
        *_SEXES,
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
        source="adults; default the percentile of the sex, ANSUR II",
    )
    mass: float = number(
        "body mass, without the load",
        "kg",
        30.0,
        200.0,
        default=None,
        default_words=_of_the_sex("mass"),
        source="adults; default the percentile of the sex, ANSUR II",
    )

    strength: float = number(
        "percentile of muscle strength among people of that sex, stature and mass",
        "%",
        1.0,
        99.0,
        default=50.0,
    )

    percentile: float = number(
        "percentile of that sex that stature and mass have where they are left out",
        "%",
        1.0,
        99.0,
        default=50.0,
        source="ANSUR II, 4,082 men and 1,986 women",
    )
    thigh: float = _length("thigh", "hip centre to knee centre", 0.2, 0.7)
    shank: float = _length("shank", "knee centre to ankle centre", 0.2, 0.7)
    ankle_height: float = _length("ankle_height", "ankle centre above the sole", 0.04, 0.15)
    foot: float = _length("foot", "heel to the tip of the toes", 0.15, 0.4)
    hip_width: float = _length("hip_width", "between the hip centres", 0.08, 0.3)
    shoulder_width: float = _length("shoulder_width", "between the shoulder centres", 0.2, 0.6)
    upper_arm: float = _length("upper_arm", "shoulder centre to elbow centre", 0.15, 0.5)
    forearm: float = _length("forearm", "elbow centre to wrist centre", 0.15, 0.45)
    hand: float = _length("hand", "wrist centre to the tip of the middle finger", 0.1, 0.3)
    head_and_neck: float = _length(
        "head_and_neck", "top of the trunk, C7/T1, to the vertex", 0.15, 0.4
    )

    @classmethod
    def default(cls, sex: str = "male") -> Self:
        """Return the 50th percentile of one sex."""
        return cls.from_table({"sex": sex})

    @classmethod
    def defaults(cls, given: Mapping[str, Any], about: About) -> dict[str, Any]:
        """Return the sex, stature and mass of its percentile, and the lengths of that stature."""
        usual = super().defaults(given, about)
        sex = given.get("sex", "male")
        body = _body(sex, given.get("percentile", usual["percentile"]))
        lengths = usual_lengths(sex, given.get("stature", body["stature"]))
        return {**usual, "sex": sex, **body, **lengths}

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> Iterator[ScenarioError]:
        """Yield lengths that leave the trunk what nobody has."""
        if not {"sex", "stature", *UPRIGHT} <= values.keys():
            return
        sex, stature = values["sex"], values["stature"]
        left, (low, high) = trunk(values, sex, stature), _TRUNK
        if not low <= left <= high:
            whole = stature * (1.0 - sum(fraction(name, sex) for name in UPRIGHT))
            others = ", ".join(UPRIGHT)
            rule = f"less {others} leaves {left * whole:.3f} m for the trunk, must leave"
            allowed = f"{rule} {low * whole:.3f} to {high * whole:.3f} m"
            yield ScenarioError(cls.dotted("stature"), allowed, stature)

    @property
    def lengths(self) -> dict[str, float]:
        """The lengths of the body, [m], as they are called in `Subject`."""
        return {name: getattr(self, name) for name in LENGTHS}

    @property
    def own_lengths(self) -> dict[str, float]:
        """The lengths, [m], that do not follow from sex and stature."""
        return {name: x for name, x in self.lengths.items() if not self.follows(name, ALONE)}

    @property
    def trunk(self) -> float:
        """Hip centres to C7/T1, [m]: what the others leave of the stature."""
        return float(self.stature - sum(getattr(self, name) for name in UPRIGHT))

    @property
    def leg_length(self) -> float:
        """Height of the hip centre above the sole of the straight leg [m]."""
        return self.ankle_height + self.shank + self.thigh

    @classmethod
    def first(cls, _default: Self) -> Self:
        """Return the person who walked by default in the first versions."""
        return cls.from_table(_FIRST["male"])

    @staticmethod
    def recorded(table: Mapping[str, Any]) -> dict[str, Any]:
        """Return the table of a record with what was by default in the first versions."""
        return {**_FIRST.get(str(table.get("sex")), _FIRST["male"]), **table}

    def own_table(self) -> dict[str, Any]:
        """Return what is not as in the first versions: no length that follows from the stature."""
        hidden = {"percentile", *LENGTHS} - self.own_lengths.keys()
        return {name: x for name, x in super().own_table().items() if name not in hidden}

    def place(self, name: str) -> object:
        """Return a setting as `Place` has it: of a length what it is more than the usual."""
        if name == "percentile":  # it is in stature and mass
            return 0.0
        usual = usual_lengths(self.sex, self.stature).get(name, 0.0)
        return getattr(self, name) - usual if usual else super().place(name)

    def _shown(self, name: str) -> bool:
        return super()._shown(name) and not (name in LENGTHS and self.follows(name, ALONE))


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
