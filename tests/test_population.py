"""People are drawn as they are measured: 2,000 of each sex, beside the tables of ANSUR II."""

import re
from functools import cache
from pathlib import Path
from statistics import NormalDist

import numpy as np
import pytest
from test_anthropometry import UPRIGHT

import human_gait as hg
from human_gait import data
from human_gait.body.anthropometry import body_measures
from human_gait.people.population import MEASURES, SEXES, correlations
from human_gait.scenario.lengths import LENGTHS, usual_lengths
from human_gait.scenario.survey import at_percentile, at_score, percentile_of

N = 2000
MOST = 3.7  # standard errors; of some 100 numbers one lies beyond once in 50 seeds
BODY = {"stature": 1000.0, "mass": 1.0}  # units of the survey


@cache
def drawn(sex):
    return hg.Population(sex, N, seed=1).to_table()


@cache
def survey(sex):
    rows = [row for row in data.rows("ansur2/percentiles") if row["sex"] == sex]
    return {row["measure"]: row for row in rows}


def of_survey(sex, name, column):
    return float(survey(sex)[name][column])


def number_of(sex):
    return int(survey(sex)["stature"]["n"])


def standard_error(sex, of_one):
    """Of a difference between the sample and the survey, which is a sample as well."""
    return of_one * np.sqrt(1.0 / N + 1.0 / number_of(sex))


def close(sex, found, expected, of_one):
    return abs(found - expected) < MOST * standard_error(sex, of_one)


@pytest.mark.parametrize("sex", SEXES)
@pytest.mark.parametrize("name", BODY)
def test_stature_and_mass_have_mean_and_percentiles_of_the_survey(sex, name):
    values = drawn(sex)[name] * BODY[name]
    mean, sd = (of_survey(sex, name, column) for column in ("mean", "sd"))
    assert close(sex, values.mean(), mean, sd)
    assert close(sex, values.std(), sd, sd * 0.85)  # kurtosis of mass: (1.2 / 2)^0.5
    for percent in (5, 10, 25, 50, 75, 90, 95):
        share = np.mean(values <= of_survey(sex, name, f"p{percent}"))
        assert close(sex, share, percent / 100, np.sqrt(percent / 100 * (1 - percent / 100)))


@pytest.mark.parametrize("sex", SEXES)
def test_stature_and_mass_go_together_as_in_the_survey(sex):
    found = np.corrcoef(drawn(sex)["stature"], drawn(sex)["mass"])[0, 1]
    expected = correlations(sex, ["stature", "mass"])[0, 1]
    assert close(sex, found, expected, 1 - expected**2)
    of_logs = np.corrcoef(np.log(drawn(sex)["stature"]), np.log(drawn(sex)["mass"]))[0, 1]
    assert close(sex, of_logs, {"male": 0.47, "female": 0.54}[sex], 1 - of_logs**2)


def of_a_sum(sex, parts, other="stature"):
    """Mean, standard deviation and correlation with stature of a sum of measures."""
    signs = np.array(list(parts.values()))
    mean, sd = (
        np.array([of_survey(sex, name, column) for name in parts]) for column in ("mean", "sd")
    )
    r = correlations(sex, [other, *parts])
    spread = np.sqrt((signs * sd) @ r[1:, 1:] @ (signs * sd))
    return signs @ mean, spread, (signs * sd) @ r[0, 1:] / spread


@pytest.mark.parametrize("sex", SEXES)
@pytest.mark.parametrize("name", LENGTHS)
def test_lengths_have_mean_spread_and_correlations_of_their_measures(sex, name):
    """As shares of the median: lengths are between joints, measures between landmarks."""
    median = {one: at_percentile(sex, one, 50.0) for one in BODY}
    rows = {row["measure"]: row for row in data.rows("ansur2/length_regressions")
            if row["sex"] == sex}  # fmt: skip
    columns = ("intercept_mm", "per_mm_stature", "per_kg_mass")
    expected = 0.0
    for part, sign in MEASURES[name].items():
        if part == "stature":
            expected += sign * median["stature"]
        else:
            a, b, c = (float(rows[part][column]) for column in columns)
            expected += sign * (a + b * median["stature"] + c * median["mass"])
    usual = usual_lengths(sex, median["stature"] / 1000.0)[name]
    measures = drawn(sex)[name] / usual * expected
    mean, sd, of_stature = of_a_sum(sex, MEASURES[name])
    assert close(sex, measures.mean(), mean, sd)
    assert close(sex, measures.std(), sd, sd / np.sqrt(2))
    for other, r in (("stature", of_stature), ("mass", of_a_sum(sex, MEASURES[name], "mass")[2])):
        assert close(sex, np.corrcoef(drawn(sex)[other], measures)[0, 1], r, 1 - r**2), other


@pytest.mark.parametrize("sex", SEXES)
def test_lengths_go_with_each_other_as_their_measures(sex):
    found = np.corrcoef([drawn(sex)[name] for name in ("foot", "hand", "upper_arm", "forearm")])
    names = ["footlength", "handlength", "acromionradialelength", "radialestylionlength"]
    expected = correlations(sex, names)
    errors = standard_error(sex, 1 - expected**2)
    assert np.all(abs(found - expected) <= MOST * errors + 1e-12)


@pytest.mark.parametrize("sex", SEXES)
def test_a_body_is_as_high_as_its_stature_and_has_its_lengths(sex):
    for who in hg.Population(sex, 20, seed=2):
        measures = body_measures(who)
        found = measures.lengths
        assert sum(found[name] for name in UPRIGHT) == pytest.approx(who.stature, rel=1e-12)
        assert found["L_th"] == pytest.approx(who.thigh, rel=1e-12)
        assert found["L_heel"] + found["L_f"] + found["L_toe"] == pytest.approx(who.foot)
        assert 2 * (found["x_sc"] + found["L_cl"]) == pytest.approx(who.shoulder_width)
        assert 2 * found["w_hip"] == pytest.approx(who.hip_width)
        assert sum(s.mass for s in measures.segments.values()) == pytest.approx(who.mass)


def test_somebody_is_the_same_however_many_there_are():
    for sex in ("male", "female", "both"):
        few, many = hg.Population(sex, 4, seed=5), hg.Population(sex, 9, seed=5)
        assert many[:4] == tuple(few)
        assert few[-1] == many[3]
    assert len(set(hg.Population("both", 100))) == 100
    assert len({hg.Population("male", 1, seed)[0] for seed in range(5)}) == 5
    women, men, both = (hg.Population(sex, 6, seed=5) for sex in (*SEXES, "both"))
    assert both[0::2] == women[:3]
    assert both[1::2] == men[:3]
    with pytest.raises(IndexError):
        many[9]


def test_strength_is_drawn_where_that_is_asked_and_changes_nobody_else():
    weak, usual = (hg.Population("both", 200, 3, strength=drawn) for drawn in (True, False))
    strength = weak.to_table()["strength"]
    assert set(usual.to_table()["strength"]) == {50.0}
    assert strength.min() >= 1.0
    assert strength.max() <= 99.0
    assert abs(strength.mean() - 50.0) < MOST * 98.0 / np.sqrt(12 * 200)
    assert abs(np.mean(strength < 25.5) - 0.25) < MOST * np.sqrt(0.1875 / 200)
    for name in ("stature", "mass", *LENGTHS):
        np.testing.assert_array_equal(weak.to_table()[name], usual.to_table()[name])


def test_the_table_has_a_row_for_each_and_tells_percentiles_and_ages():
    people = hg.Population("both", 300)
    table = people.to_table()
    assert {len(column) for column in table.values()} == {300}
    assert [who.mass for who in people] == list(table["mass"])
    assert [who.leg_length for who in people] == list(table["leg_length"])
    for name in BODY:
        share = table[f"{name}_percentile"] / 100.0
        assert abs(share.mean() - 0.5) < MOST / np.sqrt(12 * 300)
    assert table["age"].min() >= 17.0
    assert table["age"].max() <= 58.0
    assert abs(np.mean(table["age"] <= 28.0) - 0.5) < MOST * 0.5 / np.sqrt(300)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("men", 3), "sex is 'men', must be one of male, female, both"),
        (("male", 0), "n is 0, must be a whole number from 1"),
        (("male", 2.5), "n is 2.5"),
        (("male", 2, -1), "seed is -1, must be a whole number from 0"),
    ],
)
def test_what_is_no_population_is_refused(given, said):
    with pytest.raises(ValueError, match=said):
        hg.Population(*given)


@pytest.mark.parametrize("sex", SEXES)
def test_percentiles_are_those_of_the_table_and_invert(sex):
    for name in ("stature", "mass", "age"):
        for column in ("p1", "p2.5", "p50", "p95", "p99"):
            percent = float(column[1:])
            value = of_survey(sex, name, column)
            assert at_percentile(sex, name, percent) == pytest.approx(value)
            if name != "age":  # several percentiles have one age
                assert percentile_of(sex, name, value) == pytest.approx(percent)
        assert at_score(sex, name, -9.0) == of_survey(sex, name, "min")
        assert at_score(sex, name, 9.0) == of_survey(sex, name, "max")
    between = at_percentile(sex, "stature", 85.0)
    normal = NormalDist(of_survey(sex, "stature", "mean"), of_survey(sex, "stature", "sd"))
    assert between == pytest.approx(normal.inv_cdf(0.85), abs=5.0)
    for z in (-3.0, 3.0):  # 13 in 10,000, beyond the percentiles of the table
        assert at_score(sex, "stature", z) == pytest.approx(normal.mean + z * normal.stdev, abs=20)


PAGE = (Path(__file__).resolve().parent.parent / "docs" / "people.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("code", re.findall(r"^```python\n(.*?)^```$", PAGE, re.M | re.S))
def test_the_page_runs_as_it_stands(code, capsys):
    exec(compile(code, "people.md", "exec"), {})
    assert capsys.readouterr().out


def test_the_page_tells_the_percentiles_and_every_length():
    for sex, row in (("male", "men"), ("female", "women")):
        people = [hg.Subject(sex, percentile=p) for p in (5, 50, 95)]
        statures = " / ".join(f"{who.stature:.3f}" for who in people)
        masses = " / ".join(f"{who.mass:.1f}" for who in people)
        assert f"| {row} | {statures} | {masses} |" in PAGE
    rows = re.findall(r"^\| `subject\.(\w+)` \| (.*?) \|", PAGE, re.M)
    assert [name for name, _ in rows] == list(LENGTHS) == list(MEASURES)
    assert ["-" in words for _, words in rows] == [len(parts) > 1 for parts in MEASURES.values()]
