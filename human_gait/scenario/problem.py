"""What is asked of the motion, and how finely it is resolved."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from numbers import Integral
from typing import Any

from human_gait.exceptions import ScenarioError
from human_gait.scenario.declarations import choice, number
from human_gait.scenario.schema import Section, section

MIRRORED_CONTROL_POINTS = 6  # per DOF; three of them repeat the first three
MIRRORED_BY_DEFAULT = 7  # with fewer the ends of the step are too stiff for most walks
MOST_INSTANTS = 1000  # what is looked at in a step: more takes minutes for each point of a solve
MANY_CONTROL_POINTS = 20  # of more, splines are free between 20 instants: intervals follow


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
        default_words=f'"acceleration", below {MIRRORED_BY_DEFAULT} control points "velocity"',
    )
    intervals: int = number(
        "equal parts of the step: feet and joints are constrained at their ends",
        "per step",
        12,
        400,
        default=20,
        default_words=f"20, above {MANY_CONTROL_POINTS} control points two to each spline piece",
    )
    dynamics_per_interval: int = number(
        "how often torques and balance are looked at in each interval",
        "instants",
        1,
        8,
        default=2,
        source="torques and ZMP change faster than the feet move",
    )

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> Iterator[ScenarioError]:
        """Yield an error where too few control points are free, or there are too many instants."""
        intervals = values.get("intervals", cls.intervals)
        each = values.get("dynamics_per_interval", cls.dynamics_per_interval)
        if intervals * each > MOST_INSTANTS:
            rule = f"must be at most {MOST_INSTANTS // each} with dynamics_per_interval = {each}"
            yield ScenarioError(cls.dotted("intervals"), rule, intervals)
        n = values.get("control_points", MIRRORED_CONTROL_POINTS)
        if values.get("periodicity") == "acceleration" and n < MIRRORED_CONTROL_POINTS:
            rule = f"must be at least {MIRRORED_CONTROL_POINTS} where accelerations are periodic"
            yield ScenarioError(cls.dotted("control_points"), rule, n)

    @classmethod
    def with_defaults(cls, table: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return `table` with what follows from the number of control points.

        Few are too few to mirror; many need more instants to be held at.
        """
        n = table.get("control_points", cls.control_points)
        if not isinstance(n, Integral):
            return table  # to be told later
        periodicity = "velocity" if n < MIRRORED_BY_DEFAULT else "acceleration"
        intervals = cls.intervals if n <= MANY_CONTROL_POINTS else 2 * (min(int(n), 60) - 3)
        return {"periodicity": periodicity, "intervals": intervals, **table}

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
    limbs_apart: float = number(
        "how much deeper in each other than at rest limbs may be",
        "m",
        1e-3,
        0.2,
        default=0.005,
        source="what skin and clothes give way",
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
    """How far the upper body may depart from upright, with hanging arms, and the swinging knee.

    Eq. 18 alone swings pelvis and spine much further than people do (they: 2 to 5 deg), and the
    arms like a runner's: a light limb costs next to nothing. A knee that cannot bend by 60 deg, in
    an orthosis or a cast, has no walk unless ``swing_knee`` is ``free``.
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
    swing_knee: str = choice(
        "bent: the swinging knee bends by 60 deg at mid-swing; free: as far as it likes",
        "bent",
        "free",
        default="bent",
        source="bent: Eq. 25",
    )
    limbs: str = choice(
        "apart: arms, legs and trunk do not pass through each other; free: they may",
        "apart",
        "free",
        default="free",
        source="free: as in the paper",
    )
