"""The sections of a scenario: every setting with its meaning, unit, range, default and source.

SI units throughout, except for the joint ranges of `Limits`, which stay in degrees (or metres) as
in the file until they are asked for in SI.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

from human_gait.exceptions import ScenarioError
from human_gait.schema import Section, checked, choice, free, number, section, unknown

MEDIAN_BODY = {  # stature [m]: ANSUR II medians; mass [kg]: ANSUR 1988 means
    "male": {"stature": 1.755, "mass": 78.4},
    "female": {"stature": 1.626, "mass": 62.0},
}
LEG_LENGTH = {"male": 0.530, "female": 0.514}  # hip centre above the sole / stature
STEP_HALF_ANGLE_DEG = 35.0  # hip extension limit 30 deg + rising onto the toes, pelvis rotation
MIRRORED_CONTROL_POINTS = 6  # per DOF; three of them repeat the first three
_MIRRORED_BY_DEFAULT = 7  # with fewer the ends of the step are too stiff for most walks
TRANSLATION_DOFS = ("pelvis_tz", "pelvis_tx", "pelvis_ty")
RANGE_RULES: dict[bool, dict[str, Any]] = {  # of a DOF's [lower, upper], by "is it a translation?"
    True: {"unit": "m", "range": (-20.0, 20.0)},
    False: {"unit": "deg", "range": (-180.0, 180.0)},
}


def _of_the_sex(name: str) -> str:
    return ", ".join(f"{body[name]} ({sex})" for sex, body in MEDIAN_BODY.items())


@section
class Subject(Section):
    """The person who walks."""

    sex: str = choice(
        "whose proportions and strength; also the stature and mass if left out",
        "male",
        "female",
        default_words='"male"',
    )
    stature: float = number(
        "standing height",
        "m",
        1.3,
        2.2,
        default_words=_of_the_sex("stature"),
        source="adults; default 50th percentile of the sex",
    )
    mass: float = number(
        "body mass, without the load",
        "kg",
        30.0,
        200.0,
        default_words=_of_the_sex("mass"),
        source="adults; default 50th percentile of the sex",
    )

    @classmethod
    def default(cls, sex: str = "male") -> Self:
        """Return the 50th percentile of one sex."""
        return cls.from_table({"sex": sex})

    @classmethod
    def with_defaults(cls, table: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return `table` with the stature and mass of the sex where they are left out."""
        sex = checked("subject.sex", table.get("sex", "male"), str, cls.rule("sex"))
        return {"sex": sex, **MEDIAN_BODY[sex], **table}

    @property
    def leg_length(self) -> float:
        """Height of the hip centre above the sole of the straight leg [m]."""
        return LEG_LENGTH[self.sex] * self.stature


@section
class Walk(Section):
    """The gait that is asked for: V and L of the paper."""

    speed: float = number("mean walking speed, V of the paper", "m/s", 0.1, 3.0)
    step_length: float = number(
        "from heel strike to heel strike of the other foot, L of the paper", "m", 0.1, 2.0
    )
    step_width: float = number(
        "distance between the lines that the two feet walk on",
        "m",
        0.0,
        0.4,
        default=0.10,
        source="measured: 0.08-0.11 m",
    )

    @property
    def step_time(self) -> float:
        """Duration of one step T = L / V [s]."""
        return self.step_length / self.speed


@section
class Phases(Section):
    """Events of the feet as fractions of one step, heel strike = 0, the other foot's = 1."""

    foot_flat: float = number(
        "the leading foot has rolled down and stands flat",
        "of the step",
        0.01,
        0.99,
        default=0.15,
        source="measured, 1.2 m/s",
    )
    ball_off: float = number(
        "the ball of the trailing foot leaves the ground, its toes stay",
        "of the step",
        0.01,
        0.99,
        default=0.15,
        source="assumed: the trailing foot rolls to its toes",
    )
    double_support: float = number(
        "the trailing toes leave the ground: one foot stands from here on",
        "of the step",
        0.01,
        0.99,
        default=0.25,
        source="measured, 1.2 m/s",
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
        default=0.65,
        source="measured 0.6-0.7, 1.2 m/s",
    )

    def __post_init__(self) -> None:
        """Check that the events follow each other."""
        super().__post_init__()
        for name in ("foot_flat", "ball_off"):
            if not getattr(self, name) <= self.double_support:
                allowed = f"must not come after the end of double support ({self.double_support:g})"
                raise ScenarioError(f"phases.{name}", allowed, getattr(self, name))
        for name in ("mid_swing", "heel_unloading", "heel_off"):
            if not self.double_support < getattr(self, name):
                allowed = f"must come after the end of double support ({self.double_support:g})"
                raise ScenarioError(f"phases.{name}", allowed, getattr(self, name))
        if not self.heel_unloading < self.heel_off:
            allowed = f"must come after the heel starts to unload ({self.heel_unloading:g})"
            raise ScenarioError("phases.heel_off", allowed, self.heel_off)


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


@section
class Discretisation(Section):
    """Resolution of the cubic B-splines (Eq. 28) and of the constraints in time.

    `periodicity` is the highest derivative that Eq. (26) ties: ``acceleration`` by splines that
    continue as their mirror image, the others by equations between the ends of clamped splines
    (the paper has ``position``).
    """

    control_points: int = number(
        "how many spline control points describe the step of each DOF",
        "per DOF",
        5,
        60,
        default=8,
        source="the paper has 5",
    )
    periodicity: str = choice(
        "up to which derivative the end of a step fits the start of the next",
        "acceleration",
        "velocity",
        "position",
        default="acceleration",
        default_words='"acceleration", with fewer than 7 control points "velocity"',
    )
    intervals: int = number(
        "equal parts of the step: feet and joints are constrained at their ends",
        "per step",
        12,
        400,
        default=20,
    )
    dynamics_per_interval: int = number(
        "how often torques and balance are looked at in each interval",
        "instants",
        1,
        8,
        default=2,
        source="torques and ZMP change faster than the feet move",
    )

    def __post_init__(self) -> None:
        """Check that enough control points are free."""
        super().__post_init__()
        if self.mirrored and self.control_points < MIRRORED_CONTROL_POINTS:
            rule = f"must be at least {MIRRORED_CONTROL_POINTS} where accelerations are periodic"
            raise ScenarioError("discretisation.control_points", rule, self.control_points)

    @classmethod
    def with_defaults(cls, table: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return `table` with clamped splines where there are too few control points to mirror."""
        n = checked(
            "discretisation.control_points",
            table.get("control_points", cls.control_points),
            int,
            cls.rule("control_points"),
        )
        few = n < _MIRRORED_BY_DEFAULT
        return {"periodicity": "velocity" if few else "acceleration", **table}

    @property
    def mirrored(self) -> bool:
        """Whether the splines continue as their mirror image."""
        return self.periodicity == "acceleration"


@section
class Tolerances(Section):
    """How closely the optimised motion has to follow the equalities of the paper."""

    contact: float = number(
        "how far a standing foot may be from its place on the ground",
        "m",
        1e-4,
        0.05,
        default=0.004,
        source="Eqs. 20, 21",
    )
    contact_speed: float = number(
        "how fast a point of a foot that stands may move",
        "m/s",
        1e-3,
        2.0,
        default=0.3,
        source="Eq. 24",
    )
    load_transfer: float = number(
        "how far the weight may be ahead of or behind an even transfer",
        "of the load",
        0.05,
        1.0,
        default=0.3,
        source="Eq. 17; 1: in whatever order",
    )
    feet_apart: float = number(
        "how far apart, sideways, the feet stay while one passes the other",
        "m",
        -0.5,
        0.2,
        default=0.06,
        source="breadth of the ankle",
    )
    zmp_margin: float = number(
        "how far inside the edges of the standing feet the pressure stays",
        "m",
        0.0,
        0.02,
        default=0.005,
        source="Eq. 22: inside by so much",
    )
    pelvis_speed: float = number(
        "how far the pelvis may be from the walking speed",
        "m/s",
        1e-3,
        1.0,
        default=0.1,
        source="Eq. 23",
    )
    knee_flexion_deg: float = number(
        "how far the knee may be from 60 deg at mid-swing",
        "deg",
        0.1,
        30.0,
        default=5.0,
        source="epsilon of Eq. 25",
    )
    arm_leg: float = number(
        "how far arm and leg of a side may swing together: shoulder x hip angle",
        "rad^2",
        1e-4,
        0.2,
        default=0.01,
        source="Eq. 27",
    )


@section
class Ground(Section):
    """How the feet share the ground reaction in double support, and how they hold on the floor.

    ``parallel`` is Eq. (17) as printed: both feet push in the direction of the sum. With ``pivot``
    they push towards one point above the ZMP, as people do: Eq. (17) and a force along the line
    between the feet that cancels in the sum.
    """

    sharing: str = choice(
        "pivot: both feet push towards one point; parallel: both in the same direction",
        "pivot",
        "parallel",
        default="pivot",
        source="parallel: Eq. 17",
    )
    pivot_height: float = number(
        "height of the point that both feet push towards",
        "statures above the ZMP",
        0.3,
        5.0,
        default=1.0,
        source="above the centre of mass: Maus et al. 2010",
    )
    friction: float = number(
        "coefficient of friction between foot and floor",
        "",
        0.05,
        2.0,
        default=0.5,
        source="coefficient of dry floors; walking takes about 0.2",
    )


@section
class Objective(Section):
    """What the walker minimises."""

    kind: str = choice(
        "the cost: squared joint torques summed over the step",
        "torque_squared",
        default="torque_squared",
        source="Eq. 18",
    )
    weighting: str = choice(
        "none: all torques count alike; strength: as a share of the joint's strength",
        "none",
        "strength",
        default="none",
        source="none: as in Eq. 18",
    )
    passive_torques: str = choice(
        "tissue: what tissues bear costs nothing; none: the whole torque costs",
        "tissue",
        "none",
        default="tissue",
        source="none: every torque of Eq. 18 is paid for",
    )


@section
class Posture(Section):
    """How far the upper body may depart from upright, with hanging arms.

    Eq. 18 alone swings pelvis and spine much further than people do (they: 2 to 5 deg), and the
    arms like a runner's: a light limb costs next to nothing.
    """

    pelvis_deg: float = number(
        "how far the pelvis may turn from upright, about each axis",
        "deg",
        0.5,
        45.0,
        default=8.0,
        source="assumed",
    )
    spine_deg: float = number(
        "how far each joint of the spine may bend",
        "deg",
        0.5,
        45.0,
        default=4.0,
        source="assumed, each spine joint",
    )
    neck_deg: float = number(
        "how far each joint of the neck may bend",
        "deg",
        0.5,
        45.0,
        default=5.0,
        source="assumed, each neck joint",
    )
    arms_deg: float = number(
        "how far each joint of the arms may be from hanging",
        "deg",
        0.5,
        180.0,
        default=20.0,
        source="assumed, each arm joint",
    )


@dataclass(frozen=True)
class DofRange:
    """Own range of one DOF, in degrees (metres for the translations of the pelvis)."""

    name: str
    lower: float
    upper: float


@section
class Limits(Section):
    """Exceptions to the joint limits: DOF held at zero and DOF with a range of their own.

    In the file ``frozen = ["name", ...]`` and, for each range, ``name = [lower, upper]``.
    """

    frozen: tuple[str, ...] = free(
        "joints held at zero", "a list of names of DOF", "frozen", default=()
    )
    ranges: tuple[DofRange, ...] = free(
        "own range of a joint, in the place of the usual one",
        "[lower, upper] in deg, from -180 to 180; of pelvis_tz, _tx, _ty in m, from -20 to 20",
        "<joint>",
        default=(),
        default_words="the usual range of the joint",
    )

    def __post_init__(self) -> None:
        """Leave the check of names and numbers to `from_table` and to the known DOF."""

    @classmethod
    def from_table(cls, table: object) -> Self:
        """Make the section from the list ``frozen`` and one range per further key."""
        if not isinstance(table, Mapping):
            raise ScenarioError("limits", "must be a table of joint ranges", table)
        frozen = _names(table.get("frozen", []))
        for name in set(frozen) & {"pelvis_tz", "pelvis_ty"}:
            raise ScenarioError("limits.frozen", "cannot hold the pelvis at the origin", name)
        ranges = [_dof_range(name, table[name]) for name in table if name != "frozen"]
        for limited in ranges:
            if limited.name in frozen:
                raise ScenarioError(cls.dotted(limited.name), "is frozen and cannot have a range")
        return cls(frozen, tuple(ranges))

    def to_table(self) -> dict[str, Any]:
        """Return the section as it stands in a file."""
        ranges = {limited.name: [limited.lower, limited.upper] for limited in self.ranges}
        return {"frozen": list(self.frozen), **ranges}

    def frozen_dofs(self, dof_names: Sequence[str]) -> tuple[str, ...]:
        """Return the names of the DOF held at zero, all of them among `dof_names`."""
        for name in self.frozen:
            if name not in dof_names:
                raise unknown("limits.frozen", name, dof_names, f"DOF {name!r}")
        return self.frozen

    def ranges_si(self, dof_names: Sequence[str]) -> dict[str, tuple[float, float]]:
        """Return lower and upper limit [rad] or [m] by name, all of them among `dof_names`."""
        for limited in self.ranges:
            if limited.name not in dof_names:
                raise unknown(self.dotted(limited.name), limited.name, dof_names, "DOF")
        return {limited.name: _in_si(limited) for limited in self.ranges}


def _names(value: object) -> tuple[str, ...]:
    if not isinstance(value, list | tuple) or not all(isinstance(name, str) for name in value):
        raise ScenarioError("limits.frozen", "must be a list of names of DOF", value)
    return tuple(value)


def _dof_range(name: str, value: object) -> DofRange:
    key, rule = Limits.dotted(name), RANGE_RULES[name in TRANSLATION_DOFS]
    lower, upper = checked(key, value, tuple[float, float], rule)
    if lower > upper:
        raise ScenarioError(key, "must be [lower, upper] with lower not above upper", value)
    return DofRange(name, lower, upper)


def _in_si(limited: DofRange) -> tuple[float, float]:
    unit = 1.0 if limited.name in TRANSLATION_DOFS else math.radians(1.0)
    return limited.lower * unit, limited.upper * unit
