"""What the calibrated sizes are, how close they bring a walk to people, and what each of them does.

    python benchmarks/calibration.py [SCENARIO ...] [--size KEY=VALUE ...] [--list]

Some sizes of the human formulation have no source of their own: they were chosen so that preferred
walking comes near to `DATA`. This lists them, predicts the scenarios (``preferred`` if none is
named) and prints how near each comes to those curves and to what else is known of walking people,
with what is to be reached. ``--size`` predicts once more for each size that is given, one changed
at a time: a setting by its key, ``objective.knee=1``, or the stiffness [N m/rad] of a joint of
``human_gait/data/passive_joints.csv``, ``spine_rotation=200``.
"""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from typing import NamedTuple
from unittest.mock import patch

import numpy as np
from rich.console import Console
from rich.table import Table

from human_gait import data
from human_gait.body.dh import frames
from human_gait.body.limits import joint_limits
from human_gait.body.skeleton import DOF_NAMES, SIDES, index
from human_gait.people.reference import Cycle, Score, references, scores
from human_gait.people.spatiotemporal import step_scores
from human_gait.problem.program import build_program
from human_gait.scenario import Scenario, load_scenario
from human_gait.settings.records import all_settings, as_text
from human_gait.solving.starts import best, climb
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import gait_cycle

FALISSE, FUKUCHI = "falisse2019_subject1", "fukuchi2018_treadmill_1p26"
STANCE = "fukuchi2018_subject04_1p30"
LABELS = {FALISSE: "Falisse", FUKUCHI: "Fukuchi", STANCE: "Fukuchi, subject 4"}
TISSUES = "passive_joints"
ROUNDED = 0.005  # what a target of two digits leaves open
DATA = "Falisse et al. 2019, subject 1, and Fukuchi et al. 2018, mean of nine, at about 1.2 m/s"
TARGETS = {  # least r and largest RMSE without the offset, in the unit of the curve
    (FALISSE, "hip_flexion_deg"): (0.97, 4.0),
    (FALISSE, "knee_flexion_deg"): (0.97, 4.5),
    (FALISSE, "ankle_dorsiflexion_deg"): (0.94, 3.5),
    (FALISSE, "hip_extension_Nm_per_kg"): (0.92, 0.15),
    (FALISSE, "knee_extension_Nm_per_kg"): (0.94, 0.12),
    (FALISSE, "ankle_plantarflexion_Nm_per_kg"): (0.98, 0.08),
    (FALISSE, "vertical_up_BW"): (0.98, 0.08),
    (FALISSE, "foreaft_forward_BW"): (0.96, 0.03),
    (FALISSE, "pelvis_obliquity_up_deg"): (0.90, 1.5),
    (FALISSE, "pelvis_rotation_internal_deg"): (0.70, 2.0),
    (FALISSE, "hip_adduction_deg"): (0.80, 3.0),
    (FUKUCHI, "hip_flexion_deg"): (0.98, 3.0),
    (FUKUCHI, "knee_flexion_deg"): (0.97, 4.5),
    (FUKUCHI, "ankle_dorsiflexion_deg"): (0.88, 5.0),
    (STANCE, "vertical_up_BW"): (0.90, 0.12),
}
ON_BOUND = 1e-3  # from it, [rad]
FOR_SO_LONG = 0.05  # of the cycle


class Fact(NamedTuple):
    """A number of a walk and the range in which people have it."""

    name: str
    value: float
    low: float
    high: float


def calibrated(scenario: Scenario) -> Iterator[tuple[str, str, str]]:
    """Yield the sizes that were chosen on `DATA`: key, value with its unit, source."""
    for one in all_settings():
        if "calibrated" in one.source:
            value = getattr(getattr(scenario, one.section), one.key)
            yield one.dotted, f"{as_text(value)} {one.unit}".strip(), one.source
    for row in data.rows(TISSUES):
        if "calibrated" in row["measured_source"]:
            size = f"{row['measured_stiffness']} N m/rad, {row['measured_damping']} N m s/rad"
            yield row["joint"], size, row["measured_source"]


def facts(gait: Gait) -> list[Fact]:
    """Return what is known of walking people besides the curves."""
    cycle, stride = gait_cycle(gait), gait.stride
    near = {one.curve: one for one in scores(cycle, references()[0])}
    double = {one.name: one for one in step_scores(cycle, 1.0, 1.0)}["double support"]
    shoulder, elbow = (
        np.rad2deg(stride.q[:, index(f"{joint}_flexion_r")]) for joint in ("shoulder", "elbow")
    )
    return [
        Fact("middle of push-off [% of cycle]", push_off(cycle), 57.0, 61.0),
        Fact("largest knee flexion in stance [deg]", cycle["knee_flexion_deg"][5:30].max(), 15, 22),
        Fact("double support by force [% of step]", double.predicted, 24.0, 27.0),
        Fact("pelvis tilt against Falisse [deg]", near["pelvis_tilt_anterior_deg"].offset, -4, 4),
        Fact("hip flexion against Falisse [deg]", near["hip_flexion_deg"].offset, -6.0, 6.0),
        Fact("hand beside the shoulder, at most [cm]", hand_beside(gait), 0.0, 12.0),
        Fact("swing of the shoulder [deg]", np.ptp(shoulder), 15.0, 35.0),
        Fact("least elbow flexion [deg]", elbow.min(), 5.0, 45.0),
        Fact("largest elbow flexion [deg]", elbow.max(), 5.0, 45.0),
        Fact("DOF on a bound for 5 % of the cycle", len(on_bounds(gait)), 0, 0),
    ]


def push_off(cycle: Cycle) -> float:
    """Return when the ankle is half-way from its largest dorsiflexion to its least, [%]."""
    ankle = cycle["ankle_dorsiflexion_deg"]
    top = 30 + int(ankle[30:60].argmax())
    least = 50 + int(ankle[50:75].argmin())
    falling = ankle[top : least + 1]
    return float(np.interp(-(falling[0] + falling[-1]) / 2.0, -falling, np.arange(top, least + 1)))


def hand_beside(gait: Gait) -> float:
    """Return how far the tip of a hand gets from its shoulder to the side, [cm]."""
    P, A = frames(gait.body.table, gait.stride.q)
    shoulders, hands = (
        frame[:, [index(f"{dof}_{side}") for side in SIDES], 0, 3]
        for frame, dof in ((P, "shoulder_abduction"), (A, "wrist_radial_deviation"))
    )
    return float(100.0 * np.abs(hands - shoulders).max())


def on_bounds(gait: Gait) -> list[str]:
    """Return the DOF that lie on one of their limits for more than a moment."""
    lower, upper = joint_limits(gait.scenario)
    q = gait.stride.q[:-1]
    share = ((q < lower + ON_BOUND) | (q > upper - ON_BOUND)).mean(axis=0)
    return [DOF_NAMES[i] for i in np.flatnonzero(share > FOR_SO_LONG)]


@contextmanager
def stiffness(joint: str, value: str) -> Iterator[None]:
    """Give a joint, or all of its kind, a stiffness [N m/rad] in every walk."""
    rows = data.rows

    def changed(table: str, package: str = data.__name__) -> tuple[Mapping[str, str], ...]:
        found = rows(table, package)
        if table != TISSUES:
            return found
        new = {"measured_stiffness": value}
        return tuple({**row, **new} if row["joint"] == joint else row for row in found)

    with patch.object(data, "rows", changed):
        yield


def walked(scenario: Scenario, size: str = "") -> tuple[Gait, str]:
    """Predict a scenario with one size changed, ``KEY=VALUE``; return the gait and how it ended."""
    key, _, value = size.partition("=")
    joint = key in {row["joint"] for row in data.rows(TISSUES)}
    if key and not joint:
        scenario = scenario.replace({key: tomllib.loads(f"value = {value}")["value"]})
    with stiffness(key, value) if joint else nullcontext():
        kept = best(climb(build_program(scenario), "newton"))
        solution = kept.solution
        found = "a walk" if kept.success else "NO walk"
        return solution.gait, f"{found}, cost {solution.cost:.1f}, {solution.iterations} iterations"


def show_sizes(console: Console, scenario: Scenario) -> None:
    """Print what was calibrated, and on what."""
    table = Table(title=f"Calibrated on {DATA}", title_justify="left")
    for column in ("size", "value", "source"):
        table.add_column(column)
    for size in calibrated(scenario):
        table.add_row(*size)
    console.print(table)


def show_walk(console: Console, title: str, gait: Gait) -> None:
    """Print how near a walk comes to people, and what is to be reached."""
    table = Table(title=title, title_justify="left")
    for column in ("", "people", "r", "RMSE", "to be reached", ""):
        table.add_column(column)
    for (name, curve), score in nearness(gait).items():
        r, error = TARGETS[name, curve]
        kept = score.r >= r - ROUNDED and score.rmse_offset_free <= error * (1.0 + ROUNDED)
        near = f"{score.r:.2f}", f"{score.rmse_offset_free:.3g}", f"{r:.2f}, {error:g}"
        table.add_row(curve, LABELS[name], *near, "" if kept else "SHORT")
    for one in facts(gait):
        kept = one.low <= one.value <= one.high
        reach = f"{one.low:g} to {one.high:g}"
        table.add_row(one.name, "", f"{one.value:.1f}", "", reach, "" if kept else "SHORT")
    console.print(table)


def nearness(gait: Gait) -> dict[tuple[str, str], Score]:
    """Return the scores of a walk that have a target, by reference and curve."""
    cycle = gait_cycle(gait)
    found = {(s.reference, s.curve): s for one in references() for s in scores(cycle, one)}
    return {key: found[key] for key in TARGETS}


def main() -> None:
    """List, predict and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenarios", nargs="*", default=["preferred"])
    parser.add_argument("--size", nargs="+", default=[], metavar="KEY=VALUE")
    parser.add_argument("--list", action="store_true", help="print the calibrated sizes alone")
    options = parser.parse_args()
    console = Console()
    show_sizes(console, load_scenario(options.scenarios[0]))
    for name in [] if options.list else options.scenarios:
        for size in ["", *options.size]:
            gait, how = walked(load_scenario(name), size)
            show_walk(console, f"{name} {size}: {how}", gait)


if __name__ == "__main__":
    main()
