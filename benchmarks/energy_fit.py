"""Calibrate the metabolic model, and tell how well it foretells what people take.

    python benchmarks/energy_fit.py [--speeds V ...] [--only-speeds]

Predicts walks of the default formulation at the speeds of Abe et al. (2015) up to 1.83 m/s, with
the steps that people take, and fits h, the heat of torques, and w, what a joule of the fibres'
positive work takes, to the oxygen of level walking; the rate of standing is given. Prints them, and
with those in use, ``human_gait/data/metabolic_model.csv``, the error at each speed, its RMS and the
speed of least cost. What is not fitted is scored: 2.03 m/s, and how much more mass on waist and
feet costs, Browning et al. (2007). The constants go into the table by hand.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import NamedTuple
from unittest.mock import patch

import numpy as np
from rich.console import Console
from rich.table import Table

from human_gait import data
from human_gait.body.person import Body, make_body
from human_gait.body.skeleton import SEGMENTS
from human_gait.problem.program import build_program
from human_gait.scenario import Load, Scenario, Subject
from human_gait.solving.starts import best, climb
from human_gait.walk.metabolic import (
    FIBRE_WORK,
    STANDING_RATE,
    TORQUE_HEAT,
    positive_work,
    squared_torque,
)

FITTED_TO = 1.9  # [m/s]: beyond, people are about to run
PLACES = {"waist": ("pelvis",), "foot": ("foot_r", "foot_l"), "none": ()}
_MODEL = {row["name"]: float(row["value"]) for row in data.rows("metabolic_model")}
_MEASURED = data.rows("metabolic_measured")


@dataclass(frozen=True)
class Walked:
    """What the model takes of a predicted walk, per kilogram of the body.

    Attributes
    ----------
    speed : float, [m/s]
    torque : float, [N m/kg]
        Sum of the squared muscle torques over body weight times stature, on average.
    work : float, [W/kg]
        Positive work of the fibres.
    found : bool
        Whether it is a walk, verified.
    """

    speed: float
    torque: float
    work: float
    found: bool

    def rate(self, fit: Fit) -> float:
        """Return the gross metabolic rate, [W/kg]."""
        return STANDING_RATE + self.net(fit)

    def net(self, fit: Fit) -> float:
        """Return the rate above standing, [W/kg]."""
        return fit.heat * self.torque + fit.work * self.work


class Fit(NamedTuple):
    """The constants that are fitted: h [W/(N m)] and w."""

    heat: float
    work: float


IN_USE = Fit(TORQUE_HEAT, FIBRE_WORK)


def measured_rates() -> dict[float, float]:
    """Return the measured gross rate [W/kg] by speed [m/s]."""
    joule_per_metre = _MODEL["oxygen_energy"] / 1000.0  # of 1 mL/kg/km
    rows = [row for row in _MEASURED if row["kind"] == "speed"]
    costs = {float(row["speed_m_per_s"]): float(row["value"]) for row in rows}
    return {speed: speed * joule_per_metre * cost for speed, cost in costs.items()}


def fitted(walks: Sequence[Walked], rates: dict[float, float]) -> Fit:
    """Return the constants of least squared relative error: linear in both."""
    measured = np.array([rates[one.speed] for one in walks])
    parts = np.array([(one.torque, one.work) for one in walks]) / measured[:, None]
    return Fit(*map(float, np.linalg.lstsq(parts, 1.0 - STANDING_RATE / measured)[0]))


def errors(walks: Sequence[Walked], rates: dict[float, float], fit: Fit) -> np.ndarray:
    """Return the relative errors of some walks, (n,)."""
    return np.array([one.rate(fit) / rates[one.speed] - 1.0 for one in walks])


def least(speeds: Sequence[float], costs: Sequence[float]) -> float:
    """Return the speed of least cost: of the parabola through the least of three and more."""
    k = int(np.clip(np.argmin(costs), 1, len(costs) - 2))
    near = slice(k - 1, k + 2)
    a, b, _ = np.polyfit(speeds[near], costs[near], 2)
    return float(np.clip(-b / (2.0 * a), speeds[k - 1], speeds[k + 1])) if a > 0 else float("nan")


@contextmanager
def heavier(place: str, added: float) -> Iterator[None]:
    """Hang a mass [kg] on the body of every walk, shared out at the centres of some segments."""
    links = [SEGMENTS[segment] for segment in PLACES[place]]

    def made(subject: Subject, load: Load | None = None) -> Body:
        body = make_body(subject, load)
        mass = body.mass.copy()
        mass[links] += added / max(len(links), 1)
        return replace(body, mass=mass)

    with patch("human_gait.walk.instant.make_body", made):
        yield


def walked(speed: float, place: str = "none", added: float = 0.0) -> Walked:
    """Predict a walk; no scenario has masses on pelvis or feet: the body itself is changed."""
    scenario = Scenario.from_dict({"name": f"{place} {added:g} kg", "walk": {"speed": speed}})
    subject, tendon = scenario.subject, scenario.objective.tendon_stiffness
    with heavier(place, added):
        kept = best(climb(build_program(scenario), "newton"))
        now = kept.solution.gait.fine_samples
    parts = squared_torque(now, subject), positive_work(now, tendon)
    return Walked(speed, *(part / subject.mass for part in parts), kept.success)


def show_speeds(console: Console, walks: Sequence[Walked], fit: Fit) -> None:
    """Print the calibration: measured and modelled rates, error, speed of least cost."""
    rates = measured_rates()
    table = Table(
        title=f"Level walking: h = {fit.heat:.1f} W/(N m), w = {fit.work:.2f}", title_justify="left"
    )
    for column in ("speed", "walk", "measured W/kg", "model", "J/(kg m)", "model", "error %"):
        table.add_column(column, justify="right")
    for one, error in zip(walks, errors(walks, rates, fit), strict=True):
        pair = rates[one.speed], one.rate(fit)
        cells = (*pair, *(rate / one.speed for rate in pair))
        verdict = "yes" if one.found else "NO"
        numbers = (f"{cell:.2f}" for cell in cells)
        table.add_row(f"{one.speed:.3f}", verdict, *numbers, f"{100.0 * error:+.1f}")
    console.print(table)
    known = [one for one in walks if one.speed < FITTED_TO]
    error = errors(known, rates, fit)
    rms, largest = 100.0 * np.sqrt(np.mean(error**2)), 100.0 * np.abs(error).max()
    console.print(
        f"on {len(known)} speeds up to {FITTED_TO:g} m/s: RMS {rms:.1f} %, largest {largest:.1f} %"
    )
    if len(walks) > 2:
        speeds = [one.speed for one in walks]
        own = least(speeds, [one.rate(fit) / one.speed for one in walks])
        people = least(speeds, [rates[v] / v for v in speeds])
        console.print(f"least cost of transport at {own:.2f} m/s, people {people:.2f}")
    heats = np.mean([fit.heat * one.torque / one.net(fit) for one in walks])
    console.print(f"heat of torques is {100.0 * heats:.0f} % of the net rate, on average")


def show_loads(console: Console, fit: Fit) -> None:
    """Print by how much the net rate grows with mass on waist and feet, against people."""
    rows = [row for row in _MEASURED if row["kind"] == "load"]
    table = Table(title="Net rate against no load, not fitted", title_justify="left")
    for column in ("place", "kg", "walk", "people", "model"):
        table.add_column(column, justify="right")
    alone = None
    for row in rows:
        one = walked(float(row["speed_m_per_s"]), row["place"], float(row["added_kg"]))
        alone = alone or (float(row["value"]), one.net(fit))  # the first is without a load
        ratios = float(row["value"]) / alone[0], one.net(fit) / alone[1]
        verdict = "yes" if one.found else "NO"
        table.add_row(row["place"], row["added_kg"], verdict, *(f"{ratio:.3f}" for ratio in ratios))
    console.print(table)


def main() -> None:
    """Predict, fit and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    speeds = list(measured_rates())
    parser.add_argument("--speeds", type=float, nargs="+", choices=speeds, default=speeds)
    parser.add_argument("--only-speeds", action="store_true", help="leave out what is not fitted")
    options = parser.parse_args()
    console = Console()
    walks = [walked(speed) for speed in sorted(options.speeds)]
    found = fitted([one for one in walks if one.speed < FITTED_TO], measured_rates())
    console.print(f"least squares: h = {found.heat:.1f} W/(N m), w = {found.work:.2f}")
    show_speeds(console, walks, IN_USE)
    if not options.only_speeds:
        show_loads(console, IN_USE)


if __name__ == "__main__":
    main()
