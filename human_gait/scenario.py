"""Scenario: who walks, how fast, with what load, and how finely the motion is resolved.

SI units throughout, except for the joint ranges of `Limits`, which stay in degrees (or metres) as
in the file until they are asked for in SI.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Self

from human_gait.exceptions import ScenarioError
from human_gait.schema import Section, checked, choice, number, section, text, unknown

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


@section
class Subject(Section):
    """The person who walks."""

    sex: str = choice("male", "female")
    stature: float = number("m", 1.3, 2.2, source="adults; default 50th percentile of the sex")
    mass: float = number("kg", 30.0, 200.0, source="adults; default 50th percentile of the sex")

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

    speed: float = number("m/s", 0.1, 3.0)
    step_length: float = number("m", 0.1, 2.0)
    step_width: float = number("m", 0.0, 0.4, default=0.10, source="measured: 0.08-0.11 m")

    @property
    def step_time(self) -> float:
        """Duration of one step T = L / V [s]."""
        return self.step_length / self.speed


@section
class Phases(Section):
    """Events of the feet as fractions of one step, heel strike = 0, the other foot's = 1."""

    foot_flat: float = number("of the step", 0.01, 0.99, default=0.15, source="measured, 1.2 m/s")
    ball_off: float = number(
        "of the step",
        0.01,
        0.99,
        default=0.15,
        source="assumed: the trailing foot rolls to its toes",
    )
    double_support: float = number(
        "of the step", 0.01, 0.99, default=0.25, source="measured, 1.2 m/s"
    )
    heel_unloading: float = number(
        "of the step", 0.01, 0.99, default=0.35, source="assumed: the pressure leaves the heel"
    )
    mid_swing: float = number(
        "of the step",
        0.01,
        0.99,
        default=0.40,
        source="knee most flexed at 70 % of the cycle, Eq. 25",
    )
    heel_off: float = number(
        "of the step", 0.01, 0.99, default=0.65, source="measured 0.6-0.7, 1.2 m/s"
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

    mass: float = number("kg", 0.0, 100.0, default=0.0)
    position: tuple[float, float, float] = number("m", -1.0, 1.0, default=(0.0, 0.05, -0.22))
    size: tuple[float, float, float] = number("m", 0.01, 2.0, default=(0.30, 0.45, 0.20))
    model: str = choice("rigid", "force", default="rigid", source="Eq. 9 has a force")


@section
class Discretisation(Section):
    """Resolution of the cubic B-splines (Eq. 28) and of the constraints in time.

    `periodicity` is the highest derivative that Eq. (26) ties: ``acceleration`` by splines that
    continue as their mirror image, the others by equations between the ends of clamped splines
    (the paper has ``position``).
    """

    control_points: int = number("per DOF", 5, 60, default=8, source="the paper has 5")
    periodicity: str = choice("acceleration", "velocity", "position", default="acceleration")
    intervals: int = number("per step", 12, 400, default=20)
    dynamics_per_interval: int = number(
        "instants", 1, 8, default=2, source="torques and ZMP change faster than the feet move"
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

    contact: float = number("m", 1e-4, 0.05, default=0.004, source="Eqs. 20, 21")
    contact_speed: float = number("m/s", 1e-3, 2.0, default=0.3, source="Eq. 24")
    load_transfer: float = number(
        "of the load", 0.05, 1.0, default=0.3, source="Eq. 17; 1: in whatever order"
    )
    feet_apart: float = number("m", -0.5, 0.2, default=0.06, source="breadth of the ankle")
    zmp_margin: float = number("m", 0.0, 0.02, default=0.005, source="Eq. 22: inside by so much")
    pelvis_speed: float = number("m/s", 1e-3, 1.0, default=0.1, source="Eq. 23")
    knee_flexion_deg: float = number("deg", 0.1, 30.0, default=5.0, source="epsilon of Eq. 25")
    arm_leg: float = number("rad^2", 1e-4, 0.2, default=0.01, source="Eq. 27")


@section
class Ground(Section):
    """How the feet share the ground reaction in double support, and how they hold on the floor.

    ``parallel`` is Eq. (17) as printed: both feet push in the direction of the sum. With ``pivot``
    they push towards one point above the ZMP, as people do: Eq. (17) and a force along the line
    between the feet that cancels in the sum.
    """

    sharing: str = choice("pivot", "parallel", default="pivot", source="parallel: Eq. 17")
    pivot_height: float = number(
        "statures above the ZMP",
        0.3,
        5.0,
        default=1.0,
        source="above the centre of mass: Maus et al. 2010",
    )
    friction: float = number(
        "", 0.05, 2.0, default=0.5, source="coefficient of dry floors; walking takes about 0.2"
    )


@section
class Objective(Section):
    """What the walker minimises."""

    kind: str = choice("torque_squared", default="torque_squared", source="Eq. 18")
    weighting: str = choice("none", "strength", default="none", source="none: as in Eq. 18")
    passive_torques: str = choice(
        "tissue", "none", default="tissue", source="none: every torque of Eq. 18 is paid for"
    )


@section
class Posture(Section):
    """How far the upper body may depart from upright, with hanging arms.

    Eq. 18 alone swings pelvis and spine much further than people do (they: 2 to 5 deg), and the
    arms like a runner's: a light limb costs next to nothing.
    """

    pelvis_deg: float = number("deg", 0.5, 45.0, default=8.0, source="assumed")
    spine_deg: float = number("deg", 0.5, 45.0, default=4.0, source="assumed, each spine joint")
    neck_deg: float = number("deg", 0.5, 45.0, default=5.0, source="assumed, each neck joint")
    arms_deg: float = number("deg", 0.5, 180.0, default=20.0, source="assumed, each arm joint")


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

    frozen: tuple[str, ...] = ()
    ranges: tuple[DofRange, ...] = ()

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


@section
class Scenario(Section):
    """Everything that defines one prediction."""

    root: ClassVar[bool] = True

    name: str = text(r"\w[\w .+-]*", "a name of letters, digits, '_', '-', '.' and blanks")
    walk: Walk
    subject: Subject = field(default_factory=Subject.default)
    phases: Phases = field(default_factory=Phases)
    load: Load = field(default_factory=Load)
    discretisation: Discretisation = field(default_factory=Discretisation)
    tolerances: Tolerances = field(default_factory=Tolerances)
    ground: Ground = field(default_factory=Ground)
    objective: Objective = field(default_factory=Objective)
    posture: Posture = field(default_factory=Posture)
    limits: Limits = field(default_factory=Limits)

    def __post_init__(self) -> None:
        """Check the values that depend on more than one section."""
        super().__post_init__()
        check_reach(self.subject, self.walk)
        if self.load.mass > 0.0 and self.load.position[0] != 0.0:
            rule = "must be in the middle (x = 0): left and right steps are mirror images"
            raise ScenarioError("load.position", rule, list(self.load.position))

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> Scenario:
        """Make a scenario from plain tables; inverse of `to_dict`."""
        return cls.from_table(table)

    def to_dict(self) -> dict[str, Any]:
        """Return the scenario as plain tables, lists, numbers and text."""
        return self.to_table()


def check_reach(subject: Subject, walk: Walk) -> None:
    """Refuse a step that the legs cannot span.

    Both legs straight at the angle s from the vertical span 2 l sin(s), l the leg length.

    Raises
    ------
    ScenarioError
        If the step is longer, with the longest possible one.
    """
    leg = subject.leg_length
    longest = 2.0 * leg * math.sin(math.radians(STEP_HALF_ANGLE_DEG))
    if walk.step_length > longest:
        rule = f"2 x {leg:.3f} m x sin({STEP_HALF_ANGLE_DEG:g} deg)"
        allowed = f"must be at most {longest:.2f} m, the reach of legs of {leg:.2f} m: {rule}"
        raise ScenarioError("walk.step_length", allowed, walk.step_length)


def load_scenario(path: str | Path) -> Scenario:
    """Read a scenario from a TOML file.

    Parameters
    ----------
    path : str or Path
        The file; its name without ending names the scenario unless it has a key ``name``.

    Returns
    -------
    Scenario

    Raises
    ------
    ScenarioError
        If the file cannot be read or a setting is unknown, missing, of wrong type or not allowed.
    """
    source = Path(path)
    try:
        return Scenario.from_dict({"name": source.stem, **_read_toml(source)})
    except ScenarioError as error:
        raise error.found_in(str(source)) from None


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        content = path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a path with a null character
        reason = error.strerror if isinstance(error, OSError) else error
        raise ScenarioError("", f"cannot be read: {reason}") from None
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise ScenarioError("", "is not a text file in UTF-8") from None
    except (ValueError, RecursionError) as error:
        raise ScenarioError("", f"is not TOML: {error}") from None
