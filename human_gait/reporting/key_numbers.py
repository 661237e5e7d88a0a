"""What a reader wants to know first: a sentence, and a dozen numbers of each walk."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from human_gait.body.skeleton import GRAVITY
from human_gait.reporting.cells import Cell, Table, number
from human_gait.reporting.results import Result
from human_gait.walk.metabolic import ERROR


@dataclass(frozen=True)
class Quantity:
    """A number of a walk.

    Attributes
    ----------
    label, unit, form : str
        How it is called and written.
    of : function
        Takes a result and returns the number.
    kind : str
        ``angle``: what changes is told in degrees; of all others in per cent.
    """

    label: str
    unit: str
    form: str
    of: Callable[[Result], float]
    kind: str


def _peak(curve: str, end: Callable[..., float] = np.max) -> Callable[[Result], float]:
    return lambda one: float(end(one.cycle[curve]))


def _torque(curve: str) -> Callable[[Result], float]:
    peak = _peak(f"{curve}_Nm_per_kg")
    return lambda one: peak(one) * one.gait.scenario.subject.mass


def _force(one: Result) -> float:
    weight = one.gait.scenario.subject.mass * GRAVITY
    return float(np.max(one.cycle["vertical_up_BW"]) * weight)


COST = Quantity(
    f"metabolic cost of transport, {ERROR}",
    "J/(kg m)",
    ".2f",
    lambda one: one.energy.cost_of_transport,
    "energy",
)
WORK = Quantity(
    "positive work of the joints",
    "J/(kg m)",
    ".2f",
    lambda one: one.energy.per_kg_and_metre(one.energy.positive_work),
    "energy",
)
EFFORT = Quantity("effort, Eq. (18)", "N² m² s", ".1f", lambda one: one.energy.effort, "effort")


def _angle(label: str, of: Callable[[Result], float]) -> Quantity:
    return Quantity(label, "deg", ".1f", of, "angle")


def _peak_torque(name: str) -> Quantity:
    return Quantity(f"peak {name} torque", "N m", ".1f", _torque(name.replace(" ", "_")), "torque")


QUANTITIES: Sequence[Quantity] = (
    COST,
    WORK,
    Quantity(
        "positive work of the joints in a step",
        "J",
        ".1f",
        lambda one: one.energy.positive_work,
        "energy",
    ),
    Quantity(
        "peak L5/S1 extension moment",
        "N m",
        ".1f",
        lambda one: one.energy.spine[0].greatest,
        "moment",
    ),
    Quantity(
        "muscle torque nearest to its strength",
        "% of strength",
        ".0f",
        lambda one: 100.0 * one.energy.strength[0].share,
        "strength",
    ),
    _angle("largest hip flexion", _peak("hip_flexion_deg")),
    _angle("least hip flexion", _peak("hip_flexion_deg", np.min)),
    _angle("largest knee flexion", _peak("knee_flexion_deg")),
    _angle("largest ankle dorsiflexion", _peak("ankle_dorsiflexion_deg")),
    _angle("mean forward lean of the trunk", _peak("trunk_flexion_deg", np.mean)),
    *map(_peak_torque, ("hip extension", "knee extension", "ankle plantarflexion")),
    Quantity("peak force of the ground on a foot", "N", ".0f", _force, "force"),
    EFFORT,
)
"""The key numbers, of the right leg where there are two."""


def key_numbers(results: Sequence[Result]) -> Table:
    """Return the key numbers of all walks, of the others with what changed against the first."""
    first, *others = results
    rows = []
    for quantity in QUANTITIES:
        values = [quantity.of(one) for one in results]
        changes = [_change(quantity, values[0], value) for value in values[1:]]
        cells = [number(values[0], quantity.form)]
        for value, change in zip(values[1:], changes, strict=True):
            cells += [number(value, quantity.form), change]
        rows.append((Cell(quantity.label), Cell(quantity.unit), *cells))
    heads = [first.label, *(head for one in others for head in (one.label, "change"))]
    return Table(("key number", "unit", *heads), tuple(rows))


def _change(quantity: Quantity, before: float, after: float) -> Cell:
    if quantity.kind == "angle":
        return _signed(after - before, "\N{DEGREE SIGN}")
    share = 100.0 * (after / before - 1.0) if before else np.nan
    return _signed(share, "\N{NO-BREAK SPACE}%")


def _signed(value: float, unit: str) -> Cell:
    cell = number(round(value, 1) + 0.0, "+.1f")  # no -0.0
    return cell if cell.value is None else Cell(cell.text + unit, float(value))


def sentences(results: Sequence[Result]) -> tuple[str, ...]:
    """Return what there is to say of a walk, or of each against the first, in one sentence."""
    first, *others = results
    return tuple(_against(first, one) for one in others) if others else (_alone(first),)


def _alone(one: Result) -> str:
    walk, subject, load = one.gait.scenario.walk, one.gait.scenario.subject, one.gait.scenario.load
    carries = f" with {load.mass:.3g} kg to carry" if load.mass else ""
    peaks = {q.label: q.of(one) for q in QUANTITIES if q.kind == "torque"}
    who = "woman" if subject.sex == "female" else "man"
    hardest = max(peaks, key=lambda label: peaks[label])
    cost, work = one.energy.cost_of_transport, one.energy.positive_work
    return (
        f"A {who} of {subject.stature:.4g} m and {subject.mass:.4g} kg{carries} walks at "
        f"{walk.speed:.4g} m/s with steps of {walk.step_length:.4g} m: the {hardest} is "
        f"{peaks[hardest]:.0f} N m, the joints do {work:.0f} J of work in a step, and it costs "
        f"{cost:.1f} J of metabolic energy per kilogram and metre "
        f"({one.energy.error_in_words})."
    )


def _against(first: Result, one: Result) -> str:
    cost, work, effort = (_change(q, q.of(first), q.of(one)).text for q in (COST, WORK, EFFORT))
    torque, angle = _most_changed(first, one, "torque"), _most_changed(first, one, "angle")
    return (
        f"{one.label} against {first.label}: metabolic cost of transport {cost}, positive work of "
        f"the joints {work}; most changed are the {torque} and the {angle}; effort {effort}."
    )


def _most_changed(first: Result, one: Result, kind: str) -> str:
    changes = {q.label: _change(q, q.of(first), q.of(one)) for q in QUANTITIES if q.kind == kind}
    label = max(changes, key=lambda name: abs(changes[name].value or 0.0))
    return f"{label} ({changes[label].text})"
