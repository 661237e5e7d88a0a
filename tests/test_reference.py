from importlib.resources import files

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from human_gait.exceptions import ResultError
from human_gait.people.reference import (
    STANCE_THRESHOLD,
    MeasuredCurve,
    Reference,
    correlation,
    references,
    references_near,
    score,
    scores,
    stance,
)
from human_gait.walk.gait_cycle import COLUMNS, PERCENT

WAVE = np.sin(2 * np.pi * PERCENT / 100)


def measured(mean, sd=1.0):
    return MeasuredCurve(PERCENT, mean, np.full(len(mean), sd))


def reference(curve, name="knee_flexion_deg", stance_only=False):
    return Reference("someone", "Someone", "", "", stance_only, None, {name: curve})


def cycle(**columns):
    return {"gait_cycle_percent": PERCENT, **columns}


def by_name(name):
    return next(found for found in references() if found.name == name)


def as_cycle(source):
    """A prediction that is exactly the measured mean."""
    columns = {
        name: np.interp(PERCENT, curve.percent, curve.mean) for name, curve in source.curves.items()
    }
    return cycle(**columns)


def test_a_curve_against_itself_is_perfect():
    same = score("x", "knee_flexion_deg", WAVE, measured(WAVE))
    assert same.r == pytest.approx(1)
    assert same.rmse == same.rmse_offset_free == same.offset == 0
    assert same.within_1sd == same.within_2sd == 1
    assert same.predicted_range == same.measured_range == pytest.approx((-1, 1))
    assert same.predicted_peak_percent == same.measured_peak_percent == 25


@given(st.floats(-50, 50))
def test_a_shift_changes_the_rmse_alone(shift):
    moved = score("x", "knee_flexion_deg", WAVE + shift, measured(WAVE))
    assert moved.rmse == pytest.approx(abs(shift), abs=1e-9)
    assert moved.offset == pytest.approx(shift, abs=1e-9)
    assert moved.rmse_offset_free == pytest.approx(0, abs=1e-9)
    assert moved.r == pytest.approx(1)


def test_rmse_joins_offset_and_shape():
    """RMSE^2 = offset^2 + RMSE^2 of the curves with the means removed."""
    found = score("x", "knee_flexion_deg", 2 * WAVE**2 + 3, measured(WAVE))
    assert found.rmse**2 == pytest.approx(found.offset**2 + found.rmse_offset_free**2)


def test_the_mirrored_curve_has_r_minus_one():
    assert correlation(-WAVE, WAVE) == pytest.approx(-1)


def test_a_constant_curve_has_no_correlation():
    assert np.isnan(correlation(np.full(101, 0.3), WAVE))


def test_shares_within_the_sd_are_counted():
    difference = np.repeat([0.5, 1.5, 2.5, -0.5], [40, 30, 21, 10])
    found = score("x", "knee_flexion_deg", WAVE + difference, measured(WAVE, sd=1.0))
    assert found.within_1sd == pytest.approx(50 / 101)
    assert found.within_2sd == pytest.approx(80 / 101)


def test_the_prediction_is_taken_at_the_measured_percentages():
    coarse = MeasuredCurve(np.arange(0.0, 101.0, 2.0), WAVE[::2], np.ones(51))
    (found,) = scores(cycle(knee_flexion_deg=WAVE), reference(coarse))
    assert (found.reference, found.curve) == ("someone", "knee_flexion_deg")
    assert found.rmse == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize("name", [found.name for found in references() if not found.stance_only])
def test_a_measured_person_is_perfect_against_himself(name):
    source = by_name(name)
    for found in scores(as_cycle(source), source):
        assert found.r > 0.995
        assert found.within_2sd > 0.9


def bump(start, end):
    """Vertical force of a foot that stands from start to end, [% of the cycle]."""
    inside = np.clip((PERCENT - start) / (end - start), 0, 1)
    return np.sin(np.pi * inside)


def test_stance_is_where_the_force_exceeds_the_threshold():
    vertical = bump(0, 62)
    start, end = stance(cycle(vertical_up_BW=vertical))
    assert 0 < start < 2
    assert 60 < end < 62
    at = np.interp([start, end], PERCENT, vertical)
    np.testing.assert_allclose(at, STANCE_THRESHOLD)


def test_a_foot_that_never_leaves_the_ground_stands_all_the_time():
    assert stance(cycle(vertical_up_BW=np.full(101, 0.5))) == (0, 100)


def test_the_load_of_the_next_heel_strike_is_not_counted():
    vertical = bump(0, 62)
    vertical[-1] = 0.2
    assert stance(cycle(vertical_up_BW=vertical))[1] < 62


def test_a_foot_that_never_stands_is_refused():
    with pytest.raises(ResultError, match="does not stand"):
        stance(cycle(vertical_up_BW=np.zeros(101)))


def test_a_reference_of_stance_is_stretched_over_the_predicted_stance():
    """A force that only depends on the share of stance fits whatever the duration of stance."""
    shape = measured(STANCE_THRESHOLD + np.sin(np.pi * PERCENT / 100))
    for end in (55.0, 70.0):
        inside = np.clip(PERCENT / end, 0, 1)
        vertical = np.where(inside < 1, STANCE_THRESHOLD + np.sin(np.pi * inside), 0.0)
        source = reference(shape, "vertical_up_BW", stance_only=True)
        (found,) = scores(cycle(vertical_up_BW=vertical), source)
        assert found.r > 0.999
        assert found.rmse < 0.02


def test_every_reference_has_curves_citation_and_licence():
    assert len({found.name for found in references()}) == len(references()) == 6
    readme = (files("human_gait.people") / "measured" / "README.md").read_text(encoding="utf-8")
    for found in references():
        assert found.curves
        assert set(found.curves) <= set(COLUMNS)
        assert found.citation
        assert found.licence in readme
    assert "Copyright (c) 2019 antoinefalisse" in readme
    assert "Permission is hereby granted" in readme


def test_the_curves_are_whole():
    for found in references():
        for name, curve in found.curves.items():
            assert curve.percent[0] == 0, name
            assert curve.percent[-1] == 100, name
            assert np.all(np.diff(curve.percent) > 0), name
            assert np.all(curve.sd >= 0), name
            assert np.all(np.isfinite(curve.mean)), name


def test_falisse_holds_all_columns_but_the_trunk():
    missing = set(COLUMNS) - set(by_name("falisse2019_subject1").curves)
    assert missing == {"gait_cycle_percent", "trunk_flexion_deg"}


SIGNS = {  # column: (from, to) in % of the cycle, sign there in everybody's walk
    "hip_flexion_deg": (85, 95, 1),
    "knee_flexion_deg": (65, 80, 1),
    "ankle_dorsiflexion_deg": (40, 48, 1),
    "hip_extension_Nm_per_kg": (5, 15, 1),
    "hip_abduction_Nm_per_kg": (15, 50, 1),
    "knee_extension_Nm_per_kg": (12, 20, 1),
    "ankle_plantarflexion_Nm_per_kg": (30, 55, 1),
    "hip_adduction_deg": (15, 45, 1),
    "pelvis_obliquity_up_deg": (15, 25, 1),
    "vertical_up_BW": (10, 50, 1),
    "foreaft_forward_BW": (8, 20, -1),
    "mediolateral_medial_BW": (15, 45, 1),
}


@pytest.mark.parametrize("name", [found.name for found in references()])
def test_the_measured_curves_have_the_signs_of_walking(name):
    source = by_name(name)
    scale = 0.62 if source.stance_only else 1.0
    for column in set(SIGNS) & set(source.curves):
        begin, end, sign = SIGNS[column]
        curve = source.curves[column]
        there = (curve.percent * scale >= begin) & (curve.percent * scale <= end)
        assert np.all(sign * curve.mean[there] > 0), column


@pytest.mark.parametrize(("speed", "nearest"), [(0.8, 1.30), (1.2, 1.30), (1.6, 1.69), (2.5, 1.88)])
def test_of_the_stance_at_several_speeds_the_nearest_is_compared(speed, nearest):
    chosen = references_near(speed)
    assert [found.speed for found in chosen if found.stance_only] == [nearest]
    assert len(chosen) == 3
