"""What is asked of the motion, and how finely it is resolved."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from human_gait.exceptions import ScenarioError
from human_gait.scenario.declarations import choice, number
from human_gait.scenario.schema import HUMAN, About, Section, section

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
        default=14,
        effort=8,
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
        default=40,
        effort=20,
        default_words=f"40, 20 for effort; there, above {MANY_CONTROL_POINTS} control points, "
        "two to each spline piece",
    )
    dynamics_per_interval: int = number(
        "how often torques and balance are looked at in each interval",
        "instants",
        1,
        8,
        default=1,
        effort=2,
        source="torques and ZMP change faster than the feet move",
    )

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> Iterator[ScenarioError]:
        """Yield an error where too few control points are free, or there are too many instants."""
        intervals = values.get("intervals", 1)
        each = values.get("dynamics_per_interval", 1)
        if intervals * each > MOST_INSTANTS:
            rule = f"must be at most {MOST_INSTANTS // each} with dynamics_per_interval = {each}"
            yield ScenarioError(cls.dotted("intervals"), rule, intervals)
        n = values.get("control_points", MIRRORED_CONTROL_POINTS)
        if values.get("periodicity") == "acceleration" and n < MIRRORED_CONTROL_POINTS:
            rule = f"must be at least {MIRRORED_CONTROL_POINTS} where accelerations are periodic"
            yield ScenarioError(cls.dotted("control_points"), rule, n)

    @classmethod
    def defaults(cls, given: Mapping[str, Any], about: About) -> dict[str, Any]:
        """Return the defaults; some follow from the number of control points.

        Few are too few to mirror; many need more instants to be held at.
        """
        found = super().defaults(given, about)
        n = given.get("control_points", found["control_points"])
        if n < MIRRORED_BY_DEFAULT:
            found["periodicity"] = "velocity"
        if n > MANY_CONTROL_POINTS:
            found["intervals"] = max(found["intervals"], 2 * (n - 3))
        return found

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
    contact_height: float = number(
        "how far above or below the ground it may be: a floor that yields does work",
        "m",
        1e-4,
        0.05,
        default=0.001,
        effort=0.004,
        default_words="0.001, for effort as contact; contact at most",
        source="Eqs. 20, 21",
    )
    contact_speed: float = number(
        "how fast a point of a foot that stands may move",
        "m/s",
        1e-3,
        2.0,
        default=0.1,
        effort=0.3,
        default_words="0.1 x (speed / 1.2 m/s)^2, 0.01 at least; 0.3 for effort",
        source="Eq. 24; calibrated",
    )
    landing_speed: float = number(
        "the same just after landing: of the heel, then of ball and toes",
        "m/s",
        1e-3,
        2.0,
        default=0.4,
        effort=0.3,
        default_words="0.4, for effort as contact_speed; contact_speed at least",
        source="Eq. 24; calibrated",
    )
    toe_off_speed: float = number(
        "the same for the toe tip of the trailing foot",
        "m/s",
        1e-3,
        2.0,
        default=0.25,
        effort=0.3,
        default_words="0.25, for effort as contact_speed; contact_speed at least",
        source="Eq. 24; calibrated: it sets the time of push-off",
    )
    load_transfer: float = number(
        "how far the weight may be ahead of or behind an even transfer",
        "of the load",
        0.05,
        1.0,
        default=0.08,
        effort=0.3,
        source="Eq. 17; calibrated; 1: in whatever order",
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
        default=0.15,
        effort=0.1,
        default_words="an eighth of the walking speed; 0.1 for effort",
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

    @classmethod
    def defaults(cls, given: Mapping[str, Any], about: About) -> dict[str, Any]:
        """Return the defaults; a faster walker's feet come down and leave faster."""
        found = super().defaults(given, about)
        human = about.formulation == HUMAN
        if human:
            found["contact_speed"] = round(max(0.1 * (about.speed / 1.2) ** 2, 0.01), 4)
            found["pelvis_speed"] = round(about.speed / 8.0, 4)
        place = given.get("contact", found["contact"])
        found["contact_height"] = min(found["contact_height"], place) if human else place
        speed = given.get("contact_speed", found["contact_speed"])
        for name in ("landing_speed", "toe_off_speed"):
            found[name] = max(found[name], speed) if human else speed
        return found


@section
class Ground(Section):
    """How the feet share the ground reaction in double support, and how they hold on the floor.

    ``parallel`` is Eq. (17) as printed: both feet push in the direction of the sum. With ``pivot``
    they push towards one point above the ZMP, as people do: Eq. (17) and a force along the line
    between the feet that cancels in the sum. With ``least_effort`` that force is at every instant
    the one that takes the least squared torque of the legs' muscles; ``pivot_height`` then holds
    where one foot has hardly any load.
    """

    sharing: str = choice(
        "how both feet push: towards a point, in parallel, or as takes least effort",
        "pivot",
        "parallel",
        "least_effort",
        default="least_effort",
        effort="pivot",
        paper="parallel",
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
    pad: float = number(
        "how deep the part is that carries of a heel, or of toes, that stands alone",
        "of the foot's length",
        0.05,
        0.35,
        default=0.20,
        effort=0.11,
        source="pad of the heel bone: 5 to 6 cm",
    )
    loading: tuple[float, float, float] = number(
        "where the leading foot is loaded: at strike, when flat, as the other leaves",
        "of the way from heel to ankle",
        0.0,
        1.5,
        default=(0.40, 0.75, 1.10),
        effort=(0.22, 0.36, 0.90),
        source="B of Eq. 17; calibrated",
    )
    ball: str = choice(
        "whose part the ball is: toes, which stay when the heel rises, or the rear foot",
        "toes",
        "foot",
        default="toes",
        effort="foot",
        source="the axis of the metatarsal heads",
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
    """What the walker minimises, and the formulation that all other defaults are of.

    ``human``: squared muscle torques, their rates, the work of the fibres, what tissues bear, and a
    steady trunk and head; joints as far as they turn; contact as measured. ``effort``: squared
    torques alone, within assumed bounds of the posture. ``paper``: the same, as it is printed.
    """

    formulation: str = choice(
        "whose defaults hold: human; effort, as before 0.4; paper, as printed",
        "human",
        "effort",
        "paper",
        default="human",
        effort="effort",
        paper="paper",
        default_words='"human"',
        source="paper: Eqs. 17, 18 as printed",
    )
    kind: str = choice(
        "the term that is always there: squared torques of the muscles",
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
    knee: float = number(
        "how much squared knee torques count against those of other joints",
        "",
        0.05,
        5.0,
        default=0.4,
        effort=1.0,
        source="calibrated; strength of knee over ankle gives 0.58: Anderson et al. 2007",
    )
    arms: float = number(
        "how much squared torques of the arms count against those of other joints",
        "",
        0.05,
        100.0,
        default=5.0,
        effort=1.0,
        source="strength of hip over elbow and shoulder, squared: 4 to 10",
    )
    passive_torques: str = choice(
        "what tissues give: measured, with a stiff spine; tissue, a softer one; none",
        "measured",
        "tissue",
        "none",
        default="measured",
        effort="tissue",
        paper="none",
        source="none: every torque of Eq. 18 is paid for",
    )
    passive_cost: float = number(
        "how much squared torques of tissues cost, against those of muscles",
        "",
        0.0,
        10.0,
        default=2.0,
        effort=0.0,
        source="calibrated",
    )
    activation_time: float = number(
        "how slowly muscles follow their nerves: T in tau^2 + T^2 (dtau/dt)^2",
        "s",
        0.0,
        0.5,
        default=0.04,
        effort=0.0,
        source="activation 10-15 ms, deactivation 40-60 ms: Zajac 1989, Thelen 2003",
    )
    positive_work: float = number(
        "what a joule that the fibres of muscles give costs",
        "N^2 m^2 s/J",
        0.0,
        1000.0,
        default=34.0,
        effort=0.0,
        source="metabolic rate of torque against that of work",
    )
    negative_work: float = number(
        "what a joule that the fibres of muscles take up costs",
        "N^2 m^2 s/J",
        0.0,
        1000.0,
        default=0.0,
        source="metabolic rate of negative work is small",
    )
    tendon_stiffness: float = number(
        "of the tendon between the fibres and the ankle",
        "N m/rad",
        50.0,
        10000.0,
        default=350.0,
        source="Achilles tendon 150-190 N/mm at 45-50 mm",
    )
    steady_trunk: tuple[float, float, float] = number(
        "what the thorax's squared angular velocity costs: forward pitch, side roll, yaw",
        "N^2 m^2 s^2/rad^2",
        0.0,
        1e5,
        default=(770.0, 100.0, 3000.0),
        effort=(0.0, 0.0, 0.0),
        source="calibrated",
    )
    steady_head: float = number(
        "what the head's squared angle from upright costs",
        "N^2 m^2/rad^2",
        0.0,
        1e6,
        default=1e4,
        effort=0.0,
        source="calibrated",
    )

    @classmethod
    def defaults(cls, given: Mapping[str, Any], about: About) -> dict[str, Any]:
        """Return the defaults of the formulation that is given here."""
        formulation = given.get("formulation", about.formulation)
        return super().defaults(given, replace(about, formulation=formulation))

    def usual(self, name: str, about: About) -> object:
        """Return what a setting would be if it were left out: a formulation that of all others."""
        return HUMAN if name == "formulation" else super().usual(name, about)


@section
class Posture(Section):
    """How far the upper body may depart from upright, with hanging arms, and the swinging knee.

    In the formulation ``human`` as far as the joints turn. Eq. 18 alone swings pelvis and spine
    much further than people do (they: 2 to 5 deg), and the arms like a runner's: a light limb costs
    next to nothing; ``effort`` and ``paper`` bound them. A knee that cannot bend by 60 deg, in an
    orthosis or a cast, has no walk unless ``swing_knee`` is ``free``.
    """

    pelvis_deg: float = number(
        "how far the pelvis may turn from upright, about each axis",
        "deg",
        0.5,
        180.0,
        default=180.0,
        effort=8.0,
        source="effort: assumed",
    )
    spine_deg: float = number(
        "how far each joint of the spine may bend",
        "deg",
        0.5,
        180.0,
        default=180.0,
        effort=4.0,
        source="effort: assumed, each spine joint",
    )
    neck_deg: float = number(
        "how far each joint of the neck may bend",
        "deg",
        0.5,
        180.0,
        default=180.0,
        effort=5.0,
        source="effort: assumed, each neck joint",
    )
    arms_deg: float = number(
        "how far each joint of the arms may be from hanging",
        "deg",
        0.5,
        180.0,
        default=180.0,
        effort=20.0,
        source="effort: assumed, each arm joint",
    )
    swing_knee: str = choice(
        "bent: the swinging knee bends by 60 deg at mid-swing; free: as far as it likes",
        "bent",
        "free",
        default="free",
        effort="bent",
        source="bent: Eq. 25",
    )
    torques: str = choice(
        "strength: no muscle gives more than the person can; free: whatever it takes",
        "strength",
        "free",
        default="strength",
        effort="free",
        source="free: as in the paper",
    )
    limbs: str = choice(
        "apart: arms, legs and trunk do not pass through each other; free: they may",
        "apart",
        "free",
        default="apart",
        effort="free",
        source="free: as in the paper",
    )
