"""Two results of one problem held against each other."""

import csv
import io
import json

import numpy as np
import pytest
from rich.console import Console
from walking import guessed_gait

from human_gait.reporting.agreement import agreement_to_folder, curve_differences
from human_gait.walk.gait_cycle import load_gait_cycle, save_gait_cycle

COST = {"newton": 3960.0, "snopt": 4000.0, "ipopt": 3900.0}


@pytest.fixture
def folder(tmp_path):
    """The same curves of all, but for a knee that is bent by 2 deg more by the last one."""
    for name, cost in COST.items():
        target = tmp_path / name
        target.mkdir()
        save_gait_cycle(guessed_gait(), target / "gait_cycle.csv")
        summary = {"success": True, "solver_status": "done", "wall_time_s": 1.0, "evaluations": 9}
        (target / "summary.json").write_text(json.dumps(summary | {"cost": cost}))
    bend(tmp_path / "ipopt" / "gait_cycle.csv", 2.0)
    return tmp_path


def bend(path, angle):
    columns = load_gait_cycle(path)
    columns["knee_flexion_deg"] = columns["knee_flexion_deg"] + angle
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(np.stack(list(columns.values()), axis=1))


def test_the_same_curves_do_not_differ(folder):
    for row in curve_differences(folder / "snopt", folder / "snopt"):
        assert (row.rms, row.largest) == (0.0, 0.0)
        assert row.r == pytest.approx(1.0)


def test_a_shift_is_its_own_difference_and_correlates(folder):
    rows = {row.curve: row for row in curve_differences(folder / "snopt", folder / "ipopt")}
    knee = rows.pop("knee_flexion_deg")
    assert (knee.rms, knee.largest) == (pytest.approx(2.0), pytest.approx(2.0))
    assert knee.r == pytest.approx(1.0)
    assert max(row.largest for row in rows.values()) == 0.0


def test_costs_and_curves_are_written_and_shown(folder):
    table = agreement_to_folder(folder, tuple(COST))
    found = json.loads((folder / "agreement.json").read_text())
    assert found["cost_relative_to_first"] == {
        "newton": 0.0,
        "snopt": pytest.approx(1.0 / 99.0),
        "ipopt": pytest.approx(-1.0 / 66.0),
    }
    assert found["results"]["ipopt"]["cost"] == 3900.0
    assert set(found["curves"]) == {"snopt", "ipopt"}
    curves = [row["curve"] for row in found["curves"]["ipopt"]]
    assert len(curves) == 18
    console = Console(width=200, file=io.StringIO())
    console.print(table)
    text = console.file.getvalue()
    assert "snopt: a walk, cost 4000.0" in text
    assert "snopt - newton" in text
    assert "ipopt - newton" in text
    assert "2 deg" in text
