"""The three walks of the paper with 0, 20 and 40 lb on the back (Figs. 9-11)."""

import numpy as np
import pytest
from solves import solved

from human_gait.body.skeleton import GRAVITY
from human_gait.reporting.agreement import curve_differences

pytestmark = pytest.mark.solve

NAMES = ("paper-backpack-0", "paper-backpack-20", "paper-backpack-40")
LOADS = (0.0, 9.072, 18.144)  # [kg]


@pytest.fixture(scope="module")
def results():
    return [solved(name) for name in NAMES]


def test_all_are_walks(results):
    assert [result.success for result in results] == [True] * 3
    loads = [result.summary["load_kg"] for result in results]
    assert loads == list(LOADS)


def test_the_ground_carries_exactly_the_carried_weight_more(results):
    """The mean vertical force of both feet over the step; 1e-4 is left by the integration."""
    for result, load in zip(results, LOADS, strict=True):
        gait = result.gait
        t = np.linspace(0.0, gait.step_time, 801)
        vertical = gait.instants(t).grf[..., 1].sum(axis=1)
        mean = np.trapezoid(vertical, t) / gait.step_time
        assert mean == pytest.approx((78.4 + load) * GRAVITY, rel=1e-4)


def test_the_trunk_bends_forward_with_the_load(results):
    lean = [result.cycle["trunk_flexion_deg"].mean() for result in results]
    assert lean[0] + 1.0 < lean[1]
    assert lean[1] + 1.0 < lean[2]


def test_the_knee_extends_harder_with_the_load(results):
    peak = [result.cycle["knee_extension_Nm_per_kg"].max() for result in results]
    assert peak[0] < peak[1] < peak[2]


def test_a_load_as_a_force_walks_much_like_a_rigid_one(results):
    """Same weight at the same place; what differs is the inertia of the pack."""
    force = solved("backpack-40-force")
    assert force.success
    differences = {d.curve: d for d in curve_differences(results[2].cycle, force.cycle)}
    for curve in ("hip_flexion_deg", "knee_flexion_deg", "ankle_dorsiflexion_deg"):
        assert differences[curve].r > 0.95
    assert differences["vertical_up_BW"].r > 0.97
