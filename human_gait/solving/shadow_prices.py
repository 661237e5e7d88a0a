"""What shapes a gait: the bounds that hold it, and the effort that more room would save.

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
from human_gait.problem.program import LIMITS, SYMMETRY, GaitProgram
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
    "rad^2": (1e-3, "0.001 rad^2"),
}
_MEANING = {
    "ground penetration": "the swinging foot has to clear the ground",
    "contact position": "a standing foot has to stay where it was put down",
    "soft impact": "a standing foot has to rest",
    "feet apart": "the swinging foot has to pass beside the other leg",
    "ZMP stability": "the pressure has to stay under the foot",
    "load transfer": "the load has to pass evenly from foot to foot",
    "ground pushes": "the ground cannot pull",
    "sliding friction": "the floor can hold a foot only by friction",
    "turning friction": "the floor can hold a foot only by friction",
    "pelvic velocity": "the pelvis has to keep to the walking speed",
    "knee at mid-swing": "the swinging knee has to bend by 60 deg",
    "arm-leg coupling": "arms have to swing against the legs",
    SYMMETRY[0]: "the next step has to be the mirror image of this one",
    LIMITS[0]: "joints are at the end of the range that they are given",
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
        Share of the objective that it would save, to first order.
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
    found = [
        _influence(rows, solution.cost) for rows in _priced(program, solution.multipliers).values()
    ]
    counted = [one for one in found if one.saving >= NEGLIGIBLE]
    return sorted(counted, key=lambda one: -one.saving)


@dataclass(frozen=True)
class _Row:
    """One bound with a price, of one instant or control point."""

    name: str
    equation: str
    what: str
    unit: str
    price: float
    time: float


def _influence(rows: list[_Row], cost: float) -> Influence:
    first, most = rows[0], max(rows, key=lambda row: abs(row.price))
    price = sum(abs(row.price) for row in rows)
    size, step = unit_step(first.unit)
    meaning, saving = _MEANING.get(first.name, f"of {first.name}"), price * size / cost
    return Influence(
        first.name, first.equation, first.what, meaning, first.unit, price, step, saving, most.time
    )


def _priced(
    program: GaitProgram, multipliers: Mapping[str, FloatArray]
) -> dict[tuple[str, str], list[_Row]]:
    """Return the bounds with a price by name of the constraint and by what they are about."""
    groups: dict[tuple[str, str], list[_Row]] = {}
    for row in _rows(program, multipliers) if multipliers else ():
        groups.setdefault((row.name, row.what), []).append(row)
    return groups


def _rows(program: GaitProgram, multipliers: Mapping[str, FloatArray]) -> Iterator[_Row]:
    for c in program.constraints:
        prices = multipliers[c.name]
        for r in np.flatnonzero(prices):
            time = float(program.times[c.instants[r]])
            yield _Row(c.name, c.equation, str(c.what[r]), c.unit, float(prices[r]), time)
    ties = multipliers.get(SYMMETRY[0], ())
    for (what, unit), price in zip(program.symmetry_words, ties, strict=True):
        yield _Row(*SYMMETRY, what, unit, float(price), program.basis.step_time)
    for r in np.flatnonzero(multipliers[LIMITS[0]]):
        yield _limit_row(program, int(r), float(multipliers[LIMITS[0]][r]))


def _limit_row(program: GaitProgram, r: int, price: float) -> _Row:
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
    return _Row(*LIMITS, what, DOF_UNITS[dof], price, time)


def limit_text(value: float, unit: str) -> str:
    """Return a joint limit with its unit, as in a scenario."""
    return f"{np.rad2deg(value) + 0.0:.0f} deg" if unit == "rad" else f"{value:.2f} m"
