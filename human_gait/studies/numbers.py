"""The numbers of a walk: its row in the index of a study."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Any, get_args

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import index
from human_gait.checks.check import Check
from human_gait.checks.ground import SLIDING, TURNING
from human_gait.people.reference import stance_of
from human_gait.scenario import Scenario
from human_gait.scenario.schema import Section
from human_gait.walk.dimensionless import Dimensionless, dimensionless
from human_gait.walk.energy import Energy, energy
from human_gait.walk.gait import Gait, Samples
from human_gait.walk.gait_cycle import COLUMNS, FURTHER, PERCENT, gait_cycle, label_and_unit

CURVES: tuple[str, ...] = COLUMNS[1:]
"""The curves of the gait cycle that are kept of every walk."""

_AXES = "xyz"
_JOINTS = ("hip", "knee", "ankle", "toes", "spine", "shoulder")
_DRIVEN = (
    *("hip_flexion_r", "hip_abduction_r", "hip_rotation_r", "knee_flexion_r"),
    *("ankle_dorsiflexion_r", "ankle_inversion_r"),
)
_FRICTION = {
    "friction_against_sliding": SLIDING.name,
    "friction_against_turning": TURNING.name,
}


@dataclass(frozen=True)
class Column:
    """A column of the index.

    Attributes
    ----------
    name : str
    meaning : str
        In a few plain words.
    unit : str
        Empty for pure numbers and words.
    words : bool
        Whether it holds words instead of numbers.
    """

    name: str
    meaning: str
    unit: str = ""
    words: bool = False


@dataclass(frozen=True)
class _Walk:
    """What the numbers are taken from."""

    gait: Gait
    cycle: Mapping[str, FloatArray]
    energy: Energy
    size: Dimensionless
    checks: Mapping[str, Check]

    def stance(self) -> float:
        """Share of the gait cycle that a foot stands."""
        begin, end = stance_of(PERCENT, self.cycle["vertical_up_BW"])
        return (end - begin) / 100.0


Take = Callable[[_Walk], float]


@cache
def settings_columns() -> tuple[Column, ...]:
    """Return the columns of all settings that are a number, some numbers or a choice."""
    found: list[Column] = []
    for section, kind in Scenario.sections().items():
        for name in kind.kinds():
            found += _columns_of(section, kind, name)
    return tuple(found)


def _columns_of(section: str, kind: type[Section], name: str) -> Iterator[Column]:
    rule = kind.rule(name)
    if "choices" in rule:
        yield Column(f"{section}_{name}", rule["meaning"], words=True)
    elif "range" in rule:
        for ending in _endings(kind, name):
            yield Column(f"{section}_{name}{ending}", rule["meaning"], rule["unit"])


def _endings(kind: type[Section], name: str) -> list[str]:
    parts = get_args(kind.kinds()[name])
    if len(parts) != 3 or float not in parts:
        return [""]
    named = _AXES if name in ("position", "size") else "123"
    return [f"_{one}" for one in named]


def settings_of(scenario: Scenario) -> dict[str, Any]:
    """Return the settings of a scenario by the names of their columns."""
    known = {column.name for column in settings_columns()}
    found: dict[str, Any] = {}
    for section, kind in scenario.sections().items():
        for name in kind.kinds():
            value = getattr(getattr(scenario, section), name)
            found |= cells_of_setting(f"{section}.{name}", value)
    return {column: value for column, value in found.items() if column in known}


def cells_of_setting(key: str, value: Any) -> dict[str, Any]:
    """Return a value of a setting, by its dotted key, by the columns that hold it."""
    section, _, name = key.partition(".")
    if not isinstance(value, list | tuple):
        return {f"{section}_{name}": value}
    endings = _endings(Scenario.sections()[section], name)
    return {f"{section}_{name}{ending}": x for ending, x in zip(endings, value, strict=False)}


@cache
def _numbers() -> Mapping[Column, Take]:
    """Return the columns of numbers and how each is taken from a walk."""
    found: dict[Column, Take] = dict(_of_the_whole())
    for curve in (*COLUMNS[1:], *(one for one in FURTHER if not one.startswith("left_"))):
        found |= _of_curve(curve)
    found |= _of_motors()
    for joint in _JOINTS:
        for sign in ("positive", "negative"):
            column = Column(
                f"{joint}_{sign}_work", f"{sign} work of the {joint}, both sides", "J/(kg m)"
            )
            found[column] = _work(joint, sign)
    return found


def number_columns() -> tuple[Column, ...]:
    """Return the columns of what a walk is like."""
    return tuple(_numbers())


def numbers_of(gait: Gait, checks: list[Check]) -> dict[str, float]:
    """Return what a walk is like by the names of the columns.

    Parameters
    ----------
    gait : Gait
    checks : list of Check
        Of that gait.
    """
    of = {check.name: check for check in checks}
    walk = _Walk(gait, gait_cycle(gait), energy(gait), dimensionless(gait), of)
    return {column.name: float(take(walk)) for column, take in _numbers().items()}


def nearest_to_strength(gait: Gait) -> str:
    """Return the axis of a joint whose muscle is nearest to its strength."""
    return energy(gait).strength[0].joint


def curves_of(gait: Gait) -> FloatArray:
    """Return the curves of the gait cycle, (len(CURVES), 101), of single precision."""
    cycle = gait_cycle(gait)
    return np.array([cycle[curve] for curve in CURVES], dtype=np.float32)


def _of_the_whole() -> Iterator[tuple[Column, Take]]:
    per_metre = "J/(kg m)"
    yield Column("cost", "objective of the optimiser", "N2 m2 s"), lambda w: w.gait.solution["cost"]
    yield Column("effort", "squared muscle torques, Eq. (18)", "N2 m2 s"), lambda w: w.energy.effort
    yield (
        Column("cost_of_transport", "metabolic energy per body mass and metre", per_metre),
        lambda w: w.energy.cost_of_transport,
    )
    yield (
        Column("net_cost_of_transport", "the same without that of standing", per_metre),
        lambda w: w.energy.net_cost_of_transport,
    )
    yield (
        Column("metabolic_rate", "metabolic power per body mass", "W/kg"),
        lambda w: w.energy.metabolic.gross / w.energy.mass,
    )
    yield (
        Column("positive_work", "positive work of all joints", per_metre),
        lambda w: w.energy.per_kg_and_metre(w.energy.positive_work),
    )
    yield (
        Column("negative_work", "negative work of all joints", per_metre),
        lambda w: w.energy.per_kg_and_metre(w.energy.negative_work),
    )
    yield (
        Column("strength_share", "muscle torque nearest to its strength", "of the strength"),
        lambda w: w.energy.strength[0].share,
    )
    yield Column("stance_share", "how long a foot stands", "of the cycle"), _Walk.stance
    yield Column("step_time", "of one step", "s"), lambda w: w.gait.step_time
    yield Column("cadence", "steps a minute", "1/min"), lambda w: 60.0 / w.gait.step_time
    yield Column("leg_length", "hip centre above the sole", "m"), _leg
    yield Column("load_share", "load over body mass", ""), lambda w: w.energy.load / w.energy.mass
    yield from _compared()
    for name, check in _FRICTION.items():
        yield Column(name, check, "coefficient"), _checked(check)


def _compared() -> Iterator[tuple[Column, Take]]:
    """Yield the numbers by which people of any size compare."""
    for item in fields(Dimensionless):
        name = item.name if item.name == "froude" else f"dimensionless_{item.name}"
        words = item.name.replace("_", " ")
        meaning = "v^2 / (g l), l the leg" if name == "froude" else f"{words}, without dimension"
        yield Column(name, meaning), _of_size(item.name)


def _of_size(name: str) -> Take:
    return lambda walk: getattr(walk.size, name)


def _leg(walk: _Walk) -> float:
    return walk.gait.scenario.subject.leg_length


def _checked(name: str) -> Take:
    return lambda walk: walk.checks[name].value if name in walk.checks else np.nan


def _work(joint: str, sign: str) -> Take:
    def taken(walk: _Walk) -> float:
        of = {one.joint: one for one in walk.energy.joints}
        return walk.energy.per_kg_and_metre(getattr(of[joint], sign))

    return taken


def _of_motors() -> dict[Column, Take]:
    """Return what a drive of each axis of a leg would have to do in a stride.

    Of both legs in one step, on the grid of the checks: forces jump where a foot lands.
    """
    found: dict[Column, Take] = {}
    for dof in _DRIVEN:
        name = dof.removesuffix("_r")
        i = index(dof), index(f"{name}_l")
        words = name.replace("_", " ")
        speed = Column(f"{name}_speed", f"largest speed of {words}, either way", "rad/s")
        torque = Column(f"{name}_torque", f"largest net torque of {words}, either way", "N m")
        power = Column(f"{name}_power_size", f"largest power of {words}, given or taken", "W")
        found |= {
            speed: _largest(lambda now: now.v, i),
            torque: _largest(lambda now: now.tau, i),
            power: _largest(lambda now: now.tau * now.v, i),
        }
    return found


def _largest(of: Callable[[Samples], FloatArray], axes: tuple[int, int]) -> Take:
    return lambda walk: np.abs(of(walk.gait.fine_samples)[:, axes]).max()


def _of_curve(curve: str) -> dict[Column, Take]:
    """Return the numbers of one curve: both ends, and of an angle how far they are apart."""
    label, unit = label_and_unit(curve)
    quantity = _bare(curve)
    most, least = ("max", "min") if unit == "deg" else ("peak", "least")
    found: dict[Column, Take] = {
        Column(f"{quantity}_{most}", f"greatest {label}", unit): lambda w: w.cycle[curve].max(),
        Column(f"{quantity}_{least}", f"least {label}", unit): lambda w: w.cycle[curve].min(),
    }
    if unit == "deg":
        column = Column(f"{quantity}_range", f"range of {label}", unit)
        found[column] = lambda w: np.ptp(w.cycle[curve])
    return found


def _bare(curve: str) -> str:
    """Return a curve without its unit; forces and powers are called so."""
    for ending, kind in (("_Nm_per_kg", ""), ("_deg", ""), ("_W_per_kg", "_power")):
        if curve.endswith(ending):
            return curve.removesuffix(ending) + kind
    return {"vertical_up_BW": "vertical_force", "foreaft_forward_BW": "forward_force"}.get(
        curve, "medial_force"
    )
