"""What shapes a gait: the bounds that hold it, and the cost that more room would save.

The multipliers of the solver are shadow prices: by how much the objective, Eq. (18), would change
with a bound. Bounds of one kind are taken together over all instants.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import (
    DOF_NAMES,
    DOF_UNITS,
    N_DOF,
    in_words,
)
from human_gait.problem.constraints import LIMITS, SYMMETRY
from human_gait.problem.objective import objective
from human_gait.problem.program import GaitProgram
from human_gait.problem.residual import Demand
from human_gait.solving.solver import Solution
from human_gait.walk.bspline import DEGREE

NEGLIGIBLE = 1e-4
"""Bounds that cost less than this share of the objective per unit step are left out."""

STEPS = {  # by how much a limit is moved to tell what it costs
    "m": (1e-3, "1 mm"),
    "rad": (np.deg2rad(1.0), "1 deg"),
    "m/s": (0.01, "1 cm/s"),
    "rad/s": (np.deg2rad(1.0), "1 deg/s"),
    "of the load": (0.01, "1 % of the load"),
    "body weight": (0.01, "1 % of body weight"),
    "N m": (1.0, "1 N m"),
    "rad^2": (1e-3, "0.001 rad^2"),
}


def unit_step(unit: str) -> tuple[float, str]:
    """Return by how much a limit is moved to tell what it costs, in its unit and in words."""
    return STEPS.get(unit, (0.01, f"0.01 {unit}"))


@dataclass(frozen=True)
class Influence:
    """A bound that holds a gait, over all instants.

    Attributes
    ----------
    name, equation, what, meaning : str
        Constraint, its equation, which of its rows, and what it stands for.
    unit : str
    price : float, [N^2 m^2 s] per unit
        By how much the objective falls, to first order, per unit of more room at all instants.
    step : str
        More room that is easy to imagine, such as ``1 mm``.
    saving : float
        Share of the objective that it would save, to first order; of the scenario's own terms
        where rewards of one's own leave nothing of the objective.
    time : float, [s]
        When the bound costs most.
    """

    name: str
    equation: str
    what: str
    meaning: str
    unit: str
    price: float
    step: str
    saving: float
    time: float

    def to_dict(self) -> dict[str, Any]:
        """Return what ``explanation.json`` tells of it."""
        named = {"constraint": self.name, "time_s": self.time}
        return named | {k: v for k, v in asdict(self).items() if k not in ("name", "time")}


def influences(program: GaitProgram, solution: Solution) -> list[Influence]:
    """Return the bounds that hold a gait, the most costly first; none unless it converged."""
    priced = _priced(program, solution.multipliers)
    whole = _whole(program, solution) if priced else 0.0
    found = [_influence(rows, whole) for rows in priced.values()]
    counted = [one for one in found if one.saving >= NEGLIGIBLE]
    return sorted(counted, key=lambda one: -one.saving)


@dataclass(frozen=True)
class PricedRow:
    """One bound with a price, of one instant or control point.

    Attributes
    ----------
    demand : Demand
        Of the constraint that the bound belongs to.
    what, unit : str
        What the row is about, and its unit.
    price : float, [N^2 m^2 s] per unit
        d objective / d bound: positive at a lower bound, negative at an upper one.
    time : float, [s]
    """

    demand: Demand
    what: str
    unit: str
    price: float
    time: float


def _whole(program: GaitProgram, solution: Solution) -> float:
    """Return what savings are shares of, positive: a rewarded walk can cost less than nothing."""
    if solution.cost > 0.0:
        return solution.cost
    terms = objective(program.scenario)
    return program.functions.cost(terms, solution.gait.free)[0]


def _influence(rows: list[PricedRow], whole: float) -> Influence:
    """Return what the rows of one kind cost together."""
    demand, unit = rows[0].demand, rows[0].unit
    price = sum(abs(row.price) for row in rows)
    size, step = unit_step(unit)
    return Influence(
        name=demand.name,
        equation=demand.equation,
        what=rows[0].what,
        meaning=demand.meaning or f"of {demand.name}",
        unit=unit,
        price=price,
        step=step,
        saving=float(price * size / whole),
        time=max(rows, key=lambda row: abs(row.price)).time,
    )


def _priced(
    program: GaitProgram, multipliers: Mapping[str, FloatArray]
) -> dict[tuple[Demand, str], list[PricedRow]]:
    """Return the bounds with a price by what they demand and by what they are about."""
    groups: dict[tuple[Demand, str], list[PricedRow]] = {}
    for row in _rows(program, multipliers) if multipliers else ():
        groups.setdefault((row.demand, row.what), []).append(row)
    return groups


def _rows(program: GaitProgram, multipliers: Mapping[str, FloatArray]) -> Iterator[PricedRow]:
    for c in program.constraints:
        prices = multipliers[c.name]
        for r in np.flatnonzero(prices):
            time = float(program.times[c.instants[r]])
            yield PricedRow(c.demand, str(c.what[r]), c.unit, float(prices[r]), time)
    ties = multipliers.get(SYMMETRY.name, ())
    for (what, unit), price in zip(program.symmetry_words, ties, strict=True):
        yield PricedRow(SYMMETRY, what, unit, float(price), program.basis.step_time)
    for r in np.flatnonzero(multipliers[LIMITS.name]):
        yield limit_row(program, int(r), float(multipliers[LIMITS.name][r]))


def limit_row(program: GaitProgram, r: int, price: float) -> PricedRow:
    """Return the joint limit of a control point; one before t = 0 belongs to the step before."""
    j, dof = divmod(r, N_DOF)
    basis = program.basis
    time = float(np.mean(basis.knots[j + 1 : j + 1 + DEGREE]))
    side = np.sign(price)
    if time < 0.0:
        time += basis.step_time
        side, dof = side * basis.cycle.sign[dof], int(basis.cycle.index[dof])
    lower, upper = (limit[dof] for limit in program.limits)
    word = "not below" if side > 0 else "not above"
    limit = lower if side > 0 else upper
    bound = "held at" if lower == upper else word
    what = f"{in_words(DOF_NAMES[dof])}, {bound} {limit_text(limit, DOF_UNITS[dof])}"
    return PricedRow(LIMITS, what, DOF_UNITS[dof], price, time)


def limit_text(value: float, unit: str) -> str:
    """Return a joint limit with its unit, as in a scenario."""
    return f"{np.rad2deg(value) + 0.0:.0f} deg" if unit == "rad" else f"{value:.2f} m"
