"""Two results of one problem held against each other."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console
from walking import guessed_gait

from human_gait.body.skeleton import index
from human_gait.reporting.agreement import agreement_to_folder, curve_differences
from human_gait.results.sealed import is_broken
from human_gait.walk.described import gait_digest
from human_gait.walk.gait_cycle import gait_cycle
from human_gait.walk.gait_file import load_gait, save_gait

COST = {"newton": 3960.0, "snopt": 4000.0, "ipopt": 3900.0}


GAIT = guessed_gait()


def bent(angle):
    """The gait with a right knee that is bent by more, [deg]."""
    points = GAIT.control_points.copy()
    points[:, index("knee_flexion_r")] += np.deg2rad(angle)
    return replace(GAIT, control_points=points)


@pytest.fixture
def folder(tmp_path):
    """The same curves of all, but for a knee that is bent by 2 deg more by the last one."""
    for name, cost in COST.items():
        target = tmp_path / name
        target.mkdir()
        gait = bent(2.0) if name == "ipopt" else GAIT
        save_gait(replace(gait, solution={"cost": cost}), target)
        summary = {"success": True, "solver_status": "done", "wall_time_s": 1.0, "evaluations": 9}
        (target / "summary.json").write_text(json.dumps(summary | {"cost": cost}))
    return tmp_path


def test_the_same_curves_do_not_differ():
    for row in curve_differences(gait_cycle(GAIT), gait_cycle(GAIT)):
        assert (row.rms, row.largest) == (0.0, 0.0)
        assert row.r == pytest.approx(1.0)


def test_a_shift_is_its_own_difference_and_correlates():
    cycle = gait_cycle(GAIT)
    shifted = cycle | {"knee_flexion_deg": cycle["knee_flexion_deg"] + 2.0}
    rows = {row.curve: row for row in curve_differences(cycle, shifted)}
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
    assert found["gaits"] == {
        name: gait_digest(load_gait(folder / name)) for name in ("newton", "snopt", "ipopt")
    }
    assert not is_broken(found)
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
