"""What the calibrated sizes are, how close they bring a walk to people, and what each of them does.

    python benchmarks/calibration.py [SCENARIO ...] [--size KEY=VALUE ...] [--list]

Some sizes of the human formulation have no source of their own: they were chosen so that preferred
walking comes near to `DATA`. This lists them and prints how near the scenarios (``preferred`` if
none is named) come to people. ``--size`` predicts once more for each size that is given, one
changed at a time: a setting by its key, ``objective.knee=1``, or the stiffness [N m/rad] of a joint
of ``human_gait/data/passive_joints.csv``, ``spine_rotation=200``.
"""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
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
from human_gait.solving.starts import Attempt, best, climb
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import gait_cycle

FALISSE, FUKUCHI = "falisse2019_subject1", "fukuchi2018_treadmill_1p26"
STANCE = "fukuchi2018_subject04_1p30"
LABELS = {FALISSE: "Falisse", FUKUCHI: "Fukuchi", STANCE: "Fukuchi, subject 4"}
TISSUES = "passive_joints"
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


def facts(gait: Gait) -> dict[str, tuple[float, float, float]]:
    """Return what else is known of walking people: value, and the range of theirs."""
    cycle = gait_cycle(gait)
    near = {one.curve: one for one in scores(cycle, references()[0])}
    double = {one.name: one for one in step_scores(cycle, 1.0, 1.0)}["double support"]
    arm = [index(f"{joint}_flexion_r") for joint in ("shoulder", "elbow")]
    shoulder, elbow = np.rad2deg(gait.stride.q[:, arm]).T
    return {
        "middle of push-off, % of the cycle": (push_off(cycle), 57.0, 61.0),
        "knee flexion in stance, deg": (cycle["knee_flexion_deg"][5:30].max(), 15.0, 22.0),
        "double support by force, % of the step": (double.predicted, 24.0, 27.0),
        "pelvis tilt against Falisse, deg": (near["pelvis_tilt_anterior_deg"].offset, -4.0, 4.0),
        "hip flexion against Falisse, deg": (near["hip_flexion_deg"].offset, -6.0, 6.0),
        "hand beside the shoulder, cm": (hand_beside(gait), 0.0, 12.0),
        "swing of the shoulder, deg": (np.ptp(shoulder), 15.0, 35.0),
        "elbow flexion, least, deg": (elbow.min(), 5.0, 45.0),
        "elbow flexion, most, deg": (elbow.max(), 5.0, 45.0),
        "DOF on a bound, 5 % of the cycle and more": (len(on_bounds(gait)), 0.0, 0.0),
    }


def push_off(cycle: Cycle) -> float:
    """Return when the ankle is half-way from its largest dorsiflexion to its least, [%]."""
    ankle = cycle["ankle_dorsiflexion_deg"]
    top, least = 30 + int(ankle[30:60].argmax()), 50 + int(ankle[50:75].argmin())
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
    """Return the DOF that lie on one of their limits, within 1 mrad, for 5 % of the cycle."""
    lower, upper = joint_limits(gait.scenario)
    q = gait.stride.q[:-1]
    share = ((q < lower + 1e-3) | (q > upper - 1e-3)).mean(axis=0)
    return [DOF_NAMES[i] for i in np.flatnonzero(share > 0.05)]


@contextmanager
def stiffness(joint: str, value: str) -> Iterator[None]:
    """Give a joint, or all of its kind, a stiffness [N m/rad] in every walk."""
    rows, new = data.rows, {"measured_stiffness": value}

    def changed(*table: str) -> tuple[Mapping[str, str], ...]:
        return tuple({**row, **new} if row.get("joint") == joint else row for row in rows(*table))

    with patch.object(data, "rows", changed):
        yield


def walked(scenario: Scenario, size: str) -> Attempt:
    """Predict a scenario with one size changed, ``KEY=VALUE``, or none."""
    key, _, value = size.partition("=")
    if key and key not in {row["joint"] for row in data.rows(TISSUES)}:
        scenario = scenario.replace({key: tomllib.loads(f"value = {value}")["value"]})
    with stiffness(key, value):
        return best(climb(build_program(scenario), "newton"))


def show_sizes(console: Console, scenario: Scenario) -> None:
    """Print what was calibrated, and on what."""
    table = Table("size", "value", "source", title=f"Calibrated on {DATA}", title_justify="left")
    for size in calibrated(scenario):
        table.add_row(*size)
    console.print(table)


def show_walks(console: Console, title: str, walks: Mapping[str, Attempt]) -> None:
    """Print how near walks come to people, one in a column; ``!`` is short of what is to reach."""
    table = Table("", "to reach", *walks, title=title, title_justify="left")
    solutions = [walk.solution for walk in walks.values()]
    table.add_row("a walk", "", *("yes" if walk.success else "NO" for walk in walks.values()))
    table.add_row("cost, iterations", "", *(f"{s.cost:.1f}, {s.iterations}" for s in solutions))
    near = [
        {(s.reference, s.curve): s for one in references() for s in scores(cycle, one)}
        for cycle in (gait_cycle(solution.gait) for solution in solutions)
    ]
    for (name, curve), (r, error) in TARGETS.items():
        found = [one[name, curve] for one in near]
        table.add_row(
            f"{LABELS[name]}: {curve}",
            f"{r:.2f} {error:g}",
            *(f"{s.r:.2f} {s.rmse_offset_free:.3g}{_mark(reached(s, r, error))}" for s in found),
        )
    known = [facts(solution.gait) for solution in solutions]
    for name, (_, low, high) in known[0].items():
        values = [one[name][0] for one in known]
        told = (f"{value:.1f}{_mark(low <= value <= high)}" for value in values)
        table.add_row(name, f"{low:g} to {high:g}", *told)
    console.print(table)


def reached(score: Score, r: float, error: float) -> bool:
    """Whether a curve is as near as it is to be, rounded as that is."""
    return score.r >= r - 0.005 and score.rmse_offset_free <= 1.005 * error


def _mark(kept: bool) -> str:
    return "" if kept else " !"


def main() -> None:
    """List, predict and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenarios", nargs="*", default=["preferred"])
    parser.add_argument("--size", nargs="+", default=[], metavar="KEY=VALUE")
    parser.add_argument("--list", action="store_true", help="print the calibrated sizes alone")
    options = parser.parse_args()
    console = Console(width=140)
    show_sizes(console, load_scenario(options.scenarios[0]))
    for name in [] if options.list else options.scenarios:
        walks = {
            size or "as it is": walked(load_scenario(name), size) for size in ["", *options.size]
        }
        show_walks(console, name, walks)


if __name__ == "__main__":
    main()
