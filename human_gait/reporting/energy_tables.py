"""Tables of a report about energy and what a walk takes of the body."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from human_gait.reporting.cells import Cell, Row, Table, by_result, groups, number
from human_gait.reporting.results import Result
from human_gait.walk.dimensionless import Dimensionless, dimensionless
from human_gait.walk.energy import Energy
from human_gait.walk.joint_work import JOINTS, LEG
from human_gait.walk.metabolic import ERROR, ERROR_LARGEST, ERROR_RMS

MODEL = (
    "The metabolic rate is that of a model of joint torques, made for level walking at 0.7 to "
    f"1.8 m/s: against the oxygen that people take its error is {100.0 * ERROR_RMS:.0f} % (RMS), "
    f"up to {100.0 * ERROR_LARGEST:.0f} % at single speeds. That is the error of walks by the "
    "formulation human without a load; of others it is not known."
)
"""What has to stand beside a metabolic number."""

_NEAREST = 5  # muscle torques nearest to their strength

Of = Callable[[Energy], float]


def _row(name: str, of: Of, form: str = ".2f") -> Row:
    return name, lambda one: number(of(one.energy), form)


def _alike(name: str, of: Callable[[Dimensionless], float]) -> Row:
    """Return a row of a number that compares between people of any size."""
    return name, lambda one: number(of(dimensionless(one.gait)), ".4f")


def _nearest(k: int) -> Row:
    def cell(one: Result) -> Cell:
        found = one.energy.strength[k]
        return Cell(f"{found.joint} {100.0 * found.share:.0f} %")

    return f"muscle torque near its strength, {k + 1}.", cell


def _three(name: str, work: Of) -> tuple[Row, ...]:
    """Return rows of work in a step, per kilogram, and per kilogram and metre."""
    return (
        _row(f"{name} [J/(kg m)]", lambda found: found.per_kg_and_metre(work(found)), ".3f"),
        _row(f"{name} in a step [J/kg]", lambda found: work(found) / found.mass, ".3f"),
        _row(f"{name} in a step [J]", work, ".1f"),
    )


_ROWS: Sequence[Row] = (
    _row(f"metabolic cost of transport, {ERROR} [J/(kg m)]", lambda e: e.cost_of_transport),
    _row("the same less standing [J/(kg m)]", lambda e: e.net_cost_of_transport),
    _row(f"metabolic rate, {ERROR} [W/kg]", lambda e: e.metabolic.gross / e.mass),
    _row("of it standing [W/kg]", lambda e: e.metabolic.standing / e.mass),
    _row("of it heat of muscle torques [W/kg]", lambda e: e.metabolic.heat / e.mass),
    _row("of it for positive work of muscle fibres [W/kg]", lambda e: e.metabolic.work / e.mass),
    *_three("positive work of the joints", lambda e: e.positive_work),
    *_three("negative work of the joints", lambda e: e.negative_work),
    _row("L5/S1 extension moment, greatest [N m]", lambda e: e.spine[0].greatest, ".1f"),
    _row(
        "L5/S1 extension moment, greatest [N m/kg]",
        lambda e: e.spine[0].greatest / e.mass,
        ".3f",
    ),
    _row("L5/S1 extension moment, least [N m]", lambda e: e.spine[0].least, ".1f"),
    _row("L5/S1 extension moment, mean [N m]", lambda e: e.spine[0].mean, ".1f"),
    _row("L5/S1 lateral bending moment, greatest [N m]", lambda e: e.spine[1].greatest, ".1f"),
    _row("L5/S1 rotation moment, greatest [N m]", lambda e: e.spine[2].greatest, ".1f"),
    *map(_nearest, range(_NEAREST)),
    _row("effort [N² m² s/(kg m)]", lambda e: e.per_kg_and_metre(e.effort), ".1f"),
    _row("effort, Eq. (18) [N² m² s]", lambda e: e.effort, ".1f"),
    _alike("cost of transport, of weight and way", lambda d: d.cost_of_transport),
    _alike("positive work, of weight and way", lambda d: d.positive_work),
    _alike("peak hip extension moment, of weight and leg", lambda d: d.hip_extension),
    _alike("peak knee extension moment, of weight and leg", lambda d: d.knee_extension),
    _alike("peak ankle plantarflexion moment, of weight and leg", lambda d: d.ankle_plantarflexion),
    _alike("peak L5/S1 extension moment, of weight and leg", lambda d: d.L5S1_extension),
    _alike("effort, of (weight and leg)² √(leg / g), per leg length", lambda d: d.effort),
)


def energy(results: Sequence[Result]) -> Table:
    """Return how hard the walks are."""
    return by_result("energy and load", results, _ROWS)


def work(results: Sequence[Result]) -> Table:
    """Return the work of every joint."""
    heads = ("positive [J/(kg m)]", "share [%]", "negative [J/(kg m)]", "share [%]")
    rows = [
        (Cell(joint), *(cell for one in results for cell in _work(one.energy, k)))
        for k, joint in enumerate(JOINTS)
    ]
    columns = ("joint", *(head for _ in results for head in heads))
    return Table(columns, tuple(rows), groups(1, results, len(heads)))


def _work(found: Energy, k: int) -> tuple[Cell, ...]:
    one = found.joints[k]
    shares = found.share_of_leg(one.joint) if one.joint in LEG else (float("nan"),) * 2
    up, down = (number(found.per_kg_and_metre(w), ".3f") for w in (one.positive, one.negative))
    of_up, of_down = (number(100.0 * share, ".0f") for share in shares)
    return up, of_up, down, of_down
