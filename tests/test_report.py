"""The report, read by a foreign parser: it says what the files say, and loads and runs nothing."""

import atexit
import csv
import json
import re
import shlex
import shutil
import tomllib
from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pytest
from lxml import html
from pages import PLAYBACK, sparing
from solves import solved
from walking import guessed_gait

import human_gait as hg
from human_gait import cli
from human_gait.checks.ground import SLIDING
from human_gait.checks.verification import verify
from human_gait.exceptions import ResultError
from human_gait.people import comparison
from human_gait.people.comparison import compare_folder
from human_gait.people.reference import references_near
from human_gait.playback.page import page_of, page_policy, save_playback
from human_gait.prediction import OURS
from human_gait.reporting import page as report
from human_gait.reporting import panels
from human_gait.reporting.figures import (
    ENERGY_GROUPS,
    GROUPS,
    MEASURED,
    RESULTS,
    VARIABLES,
    curve_panel,
    styled,
    svg,
)
from human_gait.reporting.page import report_page, report_to_file
from human_gait.scenario import Scenario
from human_gait.solving.starts import GIVEN, WARM
from human_gait.solving.summary import checks_content
from human_gait.walk.described import gait_digest
from human_gait.walk.gait_cycle import (
    COLUMNS,
    POWERS,
    TRUNK_MOMENTS,
    label_and_unit,
    save_gait_cycle,
)
from human_gait.walk.gait_file import load_record, save_gait

HOSTILE = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)>&amp;{{ 7*7 }}${x}$"
OLD_PLAYBACK = "<!DOCTYPE html><title>of an old version</title>"
LOADS = (0.0, 9.072, 18.144)
OLD_FIELDS = ("name", "unit", "value", "limit", "time", "passed")
DIAGNOSIS = {
    "not_kept": ["right toe, height: 40 mm beyond its limit"],
    "try": [{"key": "walk.speed", "change": "at most 1.20", "because": "people walk"}],
}


@pytest.fixture(scope="module")
def checks(tmp_path_factory):
    """What the verification finds wrong with a guess, and right."""
    folder = tmp_path_factory.mktemp("checked")
    save_gait(guessed_gait(), folder)
    found = verify(load_record(folder))
    assert 0 < sum(check.passed for check in found) < len(found)
    return checks_content(found)


def summary(gait, checks, success):
    walk = gait.scenario.walk
    trial = {
        "start": "own guess",
        "solver": "newton",
        "solver_status": "optimal",
        "converged": True,
        "success": success,
        "failed_checks": [] if success else ["depth below the ground"],
        "wall_time_s": 1.25,
        "cost": 4000.5 + gait.scenario.load.mass,
    }
    return {
        **{key: trial[key] for key in ("start", "solver", "solver_status", "wall_time_s", "cost")},
        "success": success,
        "dynamics": "dh",
        "seed": 7,
        "attempts": [trial],
        "iterations": 42,
        "evaluations": 45,
        "n_variables": 275,
        "n_constraints": 910,
        "violations": {
            "contact position": {
                "what": "right toe, height",
                "value": 1.25e-8,
                "unit": "m",
                "time_s": 0.0875,
                "equation": "20, 21",
            }
        },
        "checks": checks,
        "diagnosis": None if success else DIAGNOSIS,
        "walking_speed_m_per_s": walk.speed,
        "step_length_m": walk.step_length,
        "versions": {"python": "3.11.7", "human-gait": "0.1.0"},
    }


EXPLANATION = {
    "step_time_s": 0.55,
    "shapes": [
        {
            "constraint": "ZMP stability",
            "what": "left foot, rear edge",
            "meaning": "the pressure has to stay under the foot",
            "time_s": 0.3575,
            "step": "1 mm",
            "saving": 0.00725,
        }
    ],
}


@cache
def drawn_up(load, name):
    """The files of a result that take a while; to be copied."""
    folder = Path(mkdtemp(prefix="report-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    gait = guessed_gait(load)
    gait = replace(gait, scenario=replace(gait.scenario, name=name))
    save_gait(gait, folder)
    save_gait_cycle(gait, folder / "gait_cycle.csv")
    return folder


def write(folder, checks, load=0.0, success=True, name=None):
    """Write a result folder; return it."""
    shutil.copytree(drawn_up(load, name or f"load {load:g}"), folder)
    found = summary(guessed_gait(load), checks, success)
    (folder / "summary.json").write_text(json.dumps(found))
    (folder / "explanation.json").write_text(json.dumps(EXPLANATION))
    (folder / "playback.html").write_text(OLD_PLAYBACK)
    return folder


@pytest.fixture
def one_panel(monkeypatch):
    """Draw one curve only: all figures take a second, and the still a third of one."""
    sparing(monkeypatch, {"Joint angles": ("knee_flexion_deg",)})


@pytest.fixture(scope="module")
def three(tmp_path_factory, checks):
    folder = tmp_path_factory.mktemp("results")
    return [write(folder / f"load-{load:g}", checks, load) for load in LOADS]


@pytest.fixture(scope="module")
def one_page(three):
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(report, "page_of", lambda *_, **__: PLAYBACK)
        return report_page(three[:1])


@pytest.fixture(scope="module")
def three_page(three):
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(report, "page_of", lambda *_, **__: PLAYBACK)
        return report_page(three)


@pytest.fixture(scope="module", params=["one", "three"])
def page(request):
    return request.getfixturevalue(f"{request.param}_page")


def table(page, heading):
    """Return the cells of the table whose first column has that heading: numbers, else words."""
    for found in html.document_fromstring(page).iter("table"):
        heads = [cell.text_content() for cell in found.xpath("thead/tr[last()]/th")]
        if heads[0] == heading:
            rows = [[content(cell) for cell in row] for row in found.xpath("tbody/tr")]
            assert {len(row) for row in rows} == {len(heads)}
            return heads, {row[0]: row[1:] for row in rows}, rows
    pytest.fail(f"no table {heading}")


def content(cell):
    number = cell.find("data")
    return cell.text_content() if number is None else float(number.get("value"))


def read_json(path):
    return json.loads(path.read_text())


# Numbers


def test_the_checks_are_those_of_the_summary(three, one_page, three_page):
    stored = read_json(three[0] / "summary.json")["checks"]
    heads, rows, _ = table(one_page, "check")
    assert heads == ["check", "Eq.", "unit", "limit", "found", "passed", "t [s]", "what"]
    assert list(rows) == list(stored)
    assert "note" in {row[4] for row in rows.values()}
    for name, (equation, unit, limit, found, passed, time, what) in rows.items():
        one = stored[name]
        assert name == one["name"]
        assert (unit, found, time) == (one["unit"], one["value"], one["time"])
        assert (limit, passed) == limit_and_verdict(one)
        assert (equation, what) == (one["equation"], one["what"])
    _, rows, _ = table(three_page, "check")
    for name, row in rows.items():
        limit, passed = limit_and_verdict(stored[name])
        assert row[2:] == [limit, *[stored[name]["value"], passed] * 3]


def limit_and_verdict(one):
    if one["limit"] is None:
        return "none", "note"
    return one["limit"], "yes" if one["passed"] else "NO"


@pytest.mark.usefixtures("one_panel")
def test_checks_of_older_results_have_no_equation_of_their_own(tmp_path, checks):
    """Beside a newer result its equations serve both."""
    old = {name: {k: one[k] for k in OLD_FIELDS} for name, one in checks.items()}
    folders = [write(tmp_path / "a", old, name="a"), write(tmp_path / "b", checks, name="b")]
    _, rows, _ = table(report_page(folders[:1]), "check")
    assert {row[0] for row in rows.values()} == {""}
    _, rows, _ = table(report_page(folders), "check")
    assert {name: row[0] for name, row in rows.items()} == {
        name: one["equation"] for name, one in checks.items()
    }


def test_what_shapes_the_walk_is_what_the_explanation_says(one_page):
    _, rows, _ = table(one_page, "bound")
    one = EXPLANATION["shapes"][0]
    share, saving = 100 * one["time_s"] / EXPLANATION["step_time_s"], 100 * one["saving"]
    bound = f"{one['constraint']}: {one['what']}"
    assert rows == {bound: [one["meaning"], pytest.approx(share), one["step"], saving]}


@pytest.mark.usefixtures("one_panel")
def test_limits_that_differ_are_all_shown(tmp_path, checks):
    name = SLIDING.name
    other = checks | {name: checks[name] | {"limit": 0.7}}
    folders = [write(tmp_path / "a", checks, name="a"), write(tmp_path / "b", other, name="b")]
    _, rows, _ = table(report_page(folders), "check")
    assert rows[name][2] == "0.5 or 0.7"


def test_the_constraints_are_those_of_the_summary(one_page):
    _, rows, _ = table(one_page, "constraint")
    assert rows == {
        "contact position": ["20, 21", "m", 1.25e-8, 0.0875, "right toe, height"],
    }


def test_what_was_asked_is_what_the_gait_says(three_page):
    heads, rows, _ = table(three_page, "asked for")
    scenario = guessed_gait().scenario
    assert heads == ["asked for", *(f"load {load:g}" for load in LOADS)]
    assert rows["load [kg]"] == list(LOADS)
    assert rows["walking speed [m/s]"] == [scenario.walk.speed] * 3
    assert rows["step length [m]"] == [scenario.walk.step_length] * 3
    assert rows["body mass [kg]"] == [scenario.subject.mass] * 3
    assert rows["stature [m]"] == [scenario.subject.stature] * 3
    marked = html.document_fromstring(three_page).xpath("//tr/th[@class='differs']")
    assert [cell.text_content() for cell in marked] == ["load [kg]"]


def test_how_it_was_solved_is_what_the_summary_says_and_comes_last(three, three_page):
    _, rows, _ = table(three_page, "solved")
    stored = [read_json(folder / "summary.json") for folder in three]
    assert rows["iterations"] == [42, 42, 42]
    assert rows["solving time [s]"] == [1.25] * 3
    passed = sum(check["passed"] for check in stored[0]["checks"].values())
    assert rows["checks passed"] == [f"{passed} of {len(stored[0]['checks'])}"] * 3
    sections = html.document_fromstring(three_page).xpath("//section/@id")
    assert sections[0] == "key"
    assert sections[-2:] == ["solved", "again"]
    first = html.document_fromstring(three_page).get_element_by_id("key").text_content()
    assert not re.search(r"evaluations|iterations|variables|optimal", first)


def test_the_key_numbers_are_those_of_the_walks_with_what_changed(three, three_page):
    heads, rows, _ = table(three_page, "key number")
    labels = [f"load {load:g}" for load in LOADS]
    assert heads == ["key number", "unit", labels[0], labels[1], "change", labels[2], "change"]
    curves = [curves_of(folder) for folder in three]
    energies = [hg.energy(folder) for folder in three]
    knee = [found["knee flexion"].max() for found in curves]
    moment = [found["ankle plantarflexion moment"].max() * 78.4 for found in curves]
    _, *knees = rows["largest knee flexion"]
    np.testing.assert_allclose(
        knees, [knee[0], knee[1], knee[1] - knee[0], knee[2], knee[2] - knee[0]], atol=1e-6
    )
    for label, values in (
        ("peak ankle plantarflexion torque", moment),
        ("effort, Eq. (18)", [one.effort for one in energies]),
        ("positive work of the joints in a step", [one.positive_work for one in energies]),
        ("metabolic cost of transport, ± 4 %", [one.cost_of_transport for one in energies]),
    ):
        changes = [100 * (value / values[0] - 1) for value in values]
        wanted = [values[0], values[1], changes[1], values[2], changes[2]]
        np.testing.assert_allclose(rows[label][1:], wanted, rtol=1e-7)  # the CSV has 9 digits
    assert list(rows)[-1] == "effort, Eq. (18)"


def test_a_report_begins_with_a_sentence_for_each_walk_that_is_compared(one_page, three_page):
    said = html.document_fromstring(three_page).find_class("said")
    assert [one.text_content().partition(":")[0] for one in said] == [
        f"load {load:g} against load 0" for load in LOADS[1:]
    ]
    _, rows, _ = table(three_page, "key number")
    for label, word in (
        ("metabolic cost of transport, ± 4 %", "metabolic cost of transport"),
        ("effort, Eq. (18)", "effort"),
    ):
        percent = f"{rows[label][3]:+.1f}\N{NO-BREAK SPACE}%"
        assert f"{word} {percent}" in said[0].text_content()
    (alone,) = html.document_fromstring(one_page).find_class("said")
    assert alone.text_content().startswith("A man of 1.755 m and 78.4 kg walks at 1.2 m/s")


def test_the_section_on_energy_has_the_numbers_of_every_walk(three, one_page, three_page):
    found = [hg.energy(folder) for folder in three]
    _, rows, _ = table(three_page, "energy and load")
    for label, values in {
        "metabolic cost of transport, ± 4 % [J/(kg m)]": [e.cost_of_transport for e in found],
        "positive work of the joints in a step [J]": [e.positive_work for e in found],
        "negative work of the joints in a step [J/kg]": [e.negative_work / e.mass for e in found],
        "L5/S1 extension moment, least [N m]": [e.spine[0].least for e in found],
        "effort, Eq. (18) [N² m² s]": [e.effort for e in found],
    }.items():
        np.testing.assert_allclose(rows[label], values, rtol=1e-12)
    assert list(rows)[-1].startswith("effort")
    nearest = rows["muscle torque near its strength, 1."]
    assert [text.rpartition(" ")[0].rpartition(" ")[0] for text in nearest] == [
        e.strength[0].joint for e in found
    ]
    _, rows, _ = table(one_page, "joint")
    assert list(rows) == [one.joint for one in found[0].joints]
    for one in found[0].joints:
        up, _, down, _ = rows[one.joint]
        per = found[0].mass * found[0].step_length
        assert (up * per, down * per) == pytest.approx((one.positive, one.negative))
    assert rows["ankle"][1::2] == pytest.approx([100 * s for s in found[0].share_of_leg("ankle")])
    said = html.document_fromstring(one_page).get_element_by_id("energy").text_content()
    assert "up to 6 % at single speeds" in said


def test_the_scores_are_those_of_compare(three, one_page, three_page):
    wanted = [compare_folder(folder) for folder in three]
    _, _, rows = table(one_page, "measured by")
    assert len(rows) == len(wanted[0].scores)
    for row, score in zip(rows, wanted[0].scores, strict=True):
        label, unit = label_and_unit(score.curve)
        assert row[1:3] == [label, unit.replace(" ", "\N{NO-BREAK SPACE}")]
        within = [100 * score.within_1sd, 100 * score.within_2sd]
        numbers = [known(score.r), score.rmse, score.rmse_offset_free]
        assert row[3:] == [*numbers, *score.predicted_range, *score.measured_range, *within]
    _, _, rows = table(three_page, "measured by")
    for k, row in enumerate(rows):
        scores = [one.scores[k] for one in wanted]
        assert row[3:] == [x for one in scores for x in (known(one.r), one.rmse)]
    _, steps, _ = table(one_page, "quantity")
    assert steps == {
        step.name: [
            *(step.unit, step.predicted, step.measured, step.lower, step.upper),
            "inside" if step.inside else "outside",
        ]
        for step in wanted[0].step_scores
    }


def known(r):
    """A correlation as it is shown: that with a constant curve is none."""
    return "\N{EN DASH}" if np.isnan(r) else r


def curves_of(folder):
    with (folder / "gait_cycle.csv").open() as file:
        rows = list(csv.DictReader(file))
    return {
        label_and_unit(name)[0]: np.array([float(row[name]) for row in rows])
        for name in COLUMNS[1:]
    }


def test_ranges_and_differences_are_those_of_the_curves(three, three_page):
    curves = [curves_of(folder) for folder in three]
    found = html.document_fromstring(three_page).xpath("//section[@id='differences']//table")
    differences, ranges = (
        {
            row[0].text_content(): [content(cell) for cell in row[2:]]
            for row in one.xpath("tbody/tr")
        }
        for one in found
    )
    assert list(differences) == list(ranges) == list(curves[0])
    for name in curves[0]:
        first, *others = (one[name] for one in curves)
        ends = [end for one in curves for end in (one[name].min(), one[name].max())]
        assert ranges[name] == pytest.approx(ends, rel=1e-8, abs=1e-12)  # the table has nine digits
        for k, other in enumerate(others):
            _, rms, largest = differences[name][3 * k : 3 * k + 3]
            assert rms == pytest.approx(np.sqrt(np.mean((other - first) ** 2)), abs=1e-6)
            assert largest == pytest.approx(np.abs(other - first).max(), abs=1e-6)


def test_what_is_read_is_the_number(page):
    """The digits that are shown belong to the exact number that stands behind them."""
    numbers = list(html.document_fromstring(page).iter("data"))
    assert len(numbers) > 200
    for data in numbers:
        text = re.sub("[°%\\s]", "", data.text_content().replace("\N{MINUS SIGN}", "-"))
        digits = len(re.sub(r"e.*|\D", "", text).lstrip("0"))
        decimals = len(text.partition("e")[0].partition(".")[2])
        exact, exponent = float(data.get("value")), int(text.partition("e")[2] or 0)
        assert abs(float(text) - exact) <= 0.501 * 10.0 ** (exponent - decimals), (text, digits)


# Figures


def test_every_panel_names_its_axes_with_units(page):
    root = html.document_fromstring(page)
    panels = root.xpath("//div[@class='panels']/figure")
    columns = (*COLUMNS[1:], *POWERS, *TRUNK_MOMENTS)
    wanted = {
        label_and_unit(column)[0].capitalize(): label_and_unit(column)[1] for column in columns
    }
    groups = (*GROUPS.values(), *ENERGY_GROUPS.values())
    assert sum(map(len, groups)) == len(panels) == len(wanted)
    for panel in panels:
        words = [text.text_content() for text in panel.iter("text")]
        across, up = (word for word in words if not re.fullmatch("[\\d.\N{MINUS SIGN}]+", word))
        assert across == "gait cycle [%]"
        assert up.endswith(f" [{wanted[panel.find('figcaption').text_content().capitalize()]}]")
    footprints = root.xpath("//figure[contains(figcaption, 'ootprints')]")
    for figure in footprints:
        words = {text.text_content() for text in figure.iter("text")}
        assert {"forward [m]", "to the left [m]"} <= words


def test_a_panel_shows_the_curves_over_the_measured_ones():
    cycles = [
        {"gait_cycle_percent": np.arange(101.0), "knee_flexion_deg": np.arange(101.0) + k}
        for k in range(3)
    ]
    measured = references_near(1.2)
    (ax,) = curve_panel("knee_flexion_deg", cycles, measured, None).axes
    sources = [
        source.curves["knee_flexion_deg"]
        for source in measured
        if "knee_flexion_deg" in source.curves
    ]
    means, predicted = ax.get_lines()[: len(sources)], ax.get_lines()[len(sources) :]
    for cycle, line, look in zip(cycles, predicted, RESULTS, strict=False):
        np.testing.assert_array_equal(line.get_ydata(), cycle["knee_flexion_deg"])
        assert line.get_color() == look.colour
    for curve, mean, band in zip(sources, means, ax.collections, strict=True):
        np.testing.assert_array_equal(mean.get_ydata(), curve.mean)
        heights = band.get_paths()[0].vertices[:, 1]
        assert heights.max() == (curve.mean + curve.sd).max()
        assert heights.min() == (curve.mean - curve.sd).min()


def test_a_foot_that_never_stands_has_no_measured_stance():
    cycle = {"gait_cycle_percent": np.arange(101.0), "vertical_up_BW": np.zeros(101)}
    stance_only = [source for source in references_near(1.2) if source.stance_only]
    (ax,) = curve_panel("vertical_up_BW", [cycle], stance_only, None).axes
    assert len(ax.collections) == 0


def test_phases_are_marked_where_they_are_those_of_all():
    cycle = {"gait_cycle_percent": np.arange(101.0), "knee_flexion_deg": np.arange(101.0)}
    with_phases, without = (
        curve_panel("knee_flexion_deg", [cycle], (), gait).axes[0]
        for gait in (guessed_gait(), None)
    )
    assert len(with_phases.patches) == 2
    assert len(without.patches) == 0


def test_lines_can_be_told_apart():
    assert len({(line.colour, line.dashes) for line in RESULTS}) == len(RESULTS)
    assert len({line.dashes for line in RESULTS}) == len(RESULTS)  # on grey paper, too


def test_figures_have_the_colours_of_the_page_in_light_and_dark(page):
    styles = re.search("<style>(.*?)</style>", page, re.DOTALL)[1]
    light, dark = (
        set(re.findall(r"--([\w-]+):", block))
        for block in re.findall(r":root {(.*?)}", styles, re.DOTALL)
    )
    assert set(VARIABLES.values()) <= light == dark
    drawn = "".join(re.findall("<svg.*?</svg>", page, re.DOTALL))
    assert set(re.findall(r"var\(--([\w-]+)\)", drawn)) <= light
    assert not re.search(r"#[0-9a-fA-F]{6}\b|rgb\(|black|white", drawn)


def test_an_svg_keeps_what_might_be_a_formula_or_a_tag_as_text():
    cycle = {"gait_cycle_percent": np.arange(101.0), "knee_flexion_deg": np.arange(101.0)}
    with styled():
        figure = curve_panel("knee_flexion_deg", [cycle], (), None)
        figure.axes[0].set_title("a_b$c$ <b>")
        drawn = html.fragment_fromstring(svg(figure, "key", 'what "it" <shows>'))
    assert "a_b$c$ <b>" in [text.text_content() for text in drawn.iter("text")]
    assert drawn.get("aria-label") == 'what "it" <shows>'


def test_noise_of_a_still_joint_is_not_drawn_large():
    noise = 40.0 + 1e-12 * np.random.default_rng(0).standard_normal(101)
    cycle = {"gait_cycle_percent": np.arange(101.0), "elbow_flexion_deg": noise}
    (ax,) = curve_panel("elbow_flexion_deg", [cycle], (), None).axes
    low, high = ax.get_ylim()
    assert low < 40.0 < high
    assert high - low >= 1.0


# The page


def contrast(one, other):
    """The ratio of two colours, of which 4.5 is asked for text and 3 for lines."""

    def luminance(colour):
        shares = [
            share / 12.92 if share <= 0.03928 else ((share + 0.055) / 1.055) ** 2.4
            for share in colour
        ]
        return np.dot(shares, [0.2126, 0.7152, 0.0722])

    low, high = sorted(map(luminance, (one, other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_words_and_lines_stand_out(page, theme):
    styles = re.search("<style>(.*?)</style>", page, re.DOTALL)[1]
    block = re.findall(r":root {(.*?)}", styles, re.DOTALL)[theme]
    colours = {
        name: np.array([int(code[k : k + 2], 16) / 255 for k in (0, 2, 4)])
        for name, code in re.findall(r"--([\w-]+): #(\w{6})", block)
    }
    for name in ("ink", "quiet", "good", "bad", "blue"):
        for ground in ("paper", "stripe"):
            assert contrast(colours[name], colours[ground]) >= 4.5, (name, ground)
    for ground in (colours["paper"], colours["shade"]):
        for line in RESULTS:
            assert contrast(colours[VARIABLES[line.colour]], ground) >= 3, line
        for k in range(1, len(MEASURED) + 1):
            mean = colours[f"measured-{k}"]
            band = 0.35 * mean + 0.65 * ground
            assert contrast(mean, colours["paper"]) >= 4.5
            assert contrast(mean, band) >= 3


def test_tables_can_be_heard(page):
    tables = list(html.document_fromstring(page).iter("table"))
    assert len(tables) > 5
    captions = [found.findtext("caption") for found in tables]
    assert all(captions)
    assert len(set(captions)) == len(captions)
    for found in tables:
        heads = found.xpath("thead//th")
        assert {head.get("scope") for head in heads} <= {"col", "colgroup"}
        assert all(head.text_content() for head in heads)
        for row in found.xpath("tbody/tr"):
            assert row[0].tag == "th"
            assert all(name.get("scope") == "row" for name in row.iter("th"))


def test_pages_are_sealed_and_say_of_which_gaits_they_are(three, one_page, three_page):
    for page, folders in ((one_page, three[:1]), (three_page, three)):
        root = html.document_fromstring(outer(page))
        (policy,) = root.xpath("//meta[@http-equiv='Content-Security-Policy']/@content")
        assert policy == page_policy()
        digests = [gait_digest(load_record(folder).gait) for folder in folders]
        assert root.xpath("//meta[@name='gait']/@content") == digests


@pytest.mark.usefixtures("one_panel")
def test_a_gait_that_is_no_walk_says_so_and_its_summary_has_to_agree(tmp_path, checks):
    folder = write(tmp_path / "a", checks, success=False)
    gait = guessed_gait()
    save_gait(replace(gait, solution={**gait.solution, "success": False}), folder)
    warnings = html.document_fromstring(report_page([folder])).xpath("//p[@role='alert']")
    assert any("This is no walk" in warning.text_content() for warning in warnings)
    found = read_json(folder / "summary.json") | {"success": True}
    (folder / "summary.json").write_text(json.dumps(found))
    with pytest.raises(ResultError, match=r"summary\.json: success = true, but gait\.npz"):
        report_page([folder])


def test_ids_are_unique_and_lead_somewhere(page):
    root = html.document_fromstring(page)
    ids = Counter(root.xpath("//@id"))
    assert [name for name, times in ids.items() if times > 1] == []
    drawn = re.findall(r"url\(#([^)]+)\)", page)
    links = [link[1:] for link in root.xpath("//@href") if link.startswith("#")]
    uses = [element.get("xlink:href")[1:] for element in root.iter("use")]
    assert len(drawn) > 20
    assert len(uses) > 100
    assert set(drawn) | set(links) | set(uses) <= set(ids)


def outer(page):
    """The page without the animation in it."""
    return re.sub(r'srcdoc="[^"]*"', "", page)


def test_the_page_loads_nothing(page):
    root = html.document_fromstring(outer(page))
    assert root.xpath("//script | //link | //object | //embed | //base") == []
    assert all(source.startswith("data:image/png") for source in root.xpath("//@src"))
    assert not re.search(r"://|@import|url\((?!#)|@font-face", outer(page))
    assert all(not link.startswith(("/", "//")) for link in root.xpath("//@href"))


def test_the_animation_is_in_the_page_that_of_the_gaits_whatever_files_there_are(
    three, monkeypatch
):
    """Of three; that of one is looked at in the report of a prediction."""
    monkeypatch.setattr(report, "GROUPS", {})
    monkeypatch.setattr(report, "ENERGY_GROUPS", {})
    monkeypatch.setattr(panels, "pictures", lambda *_: ())
    page = report_page(three)
    (frame,) = html.document_fromstring(page, parser=html.HTMLParser(huge_tree=True)).iter("iframe")
    assert frame.get("sandbox") == "allow-scripts"
    gaits = [load_record(folder).gait for folder in three]
    assert unpacked(frame.get("srcdoc")) == unpacked(page_of(gaits))
    assert "of an old version" not in page


def test_several_walkers_are_in_one_animation_each_with_its_name():
    names = ["one", "two", "three"]
    page = page_of([guessed_gait(load) for load in LOADS], called=names)
    (data,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page)
    assert [walk["name"] for walk in json.loads(data)["walks"]] == names
    assert len(page.encode()) < 4_000_000


def test_paper_has_a_still_of_every_walk(page):
    (still,) = html.document_fromstring(page).xpath("//img[@id='still']")
    assert still.get("src").startswith("data:image/png;base64,")
    assert "phases of a stride" in still.get("alt")


def unpacked(page):
    """A page without the commands of its scene, in which things have new names every time."""
    return re.sub(r'"[A-Za-z0-9+/=]{20,}"', '""', page)


def test_pages_are_small_enough_to_send(one_page, three_page):
    assert len(one_page.encode()) < 1_000_000
    assert len(three_page.encode()) < 2_000_000


def test_the_same_results_give_the_same_page(three, monkeypatch):
    monkeypatch.setattr(report, "GROUPS", {"Joint angles": ("knee_flexion_deg",)})
    monkeypatch.setattr(report, "ENERGY_GROUPS", {})
    monkeypatch.setattr(report, "page_of", lambda *_, **__: PLAYBACK)
    assert report_page(three[:1]) == report_page(three[:1])


def test_pictures_of_a_kind_stand_in_a_row_in_the_order_of_the_results(three_page):
    root = html.document_fromstring(three_page)
    rows = [
        [caption.text_content() for caption in row.iter("figcaption")]
        for row in root.xpath("//div[@class='pictures']")
    ]
    assert [[text.partition(": ")[0] for text in row] for row in rows] == 2 * [
        [f"load {load:g}" for load in LOADS]
    ]
    assert [len({text.partition(": ")[2] for text in row}) for row in rows] == [1, 1]


@pytest.mark.usefixtures("one_panel")
def test_results_stand_in_their_order(three):
    labels = [f"load {load:g}" for load in reversed(LOADS)]
    page = report_page(three[::-1])
    root = html.document_fromstring(page)
    assert table(page, "asked for")[0][1:] == table(page, "solved")[0][1:] == labels
    (legend, *_) = root.xpath("//ul[@class='legend']")
    assert [item.text_content() for item in legend][:3] == labels
    groups = root.xpath("//section[@id='checks']//tr[@class='groups']/th")
    assert [cell.text_content() for cell in groups][:3] == labels


@pytest.mark.usefixtures("one_panel")
def test_the_solver_that_was_asked_for_is_the_first_one(tmp_path, checks):
    folder = write(tmp_path / "a", checks)
    found = read_json(folder / "summary.json")
    later = found["attempts"][0] | {"solver": "snopt", "start": "snopt instead"}
    found |= {"solver": "snopt", "attempts": [*found["attempts"], later]}
    (folder / "summary.json").write_text(json.dumps(found))
    page = report_page([folder])
    assert "--solver newton" in html.document_fromstring(page).text_content()
    assert table(page, "asked for")[1]["solver"] == ["newton"]
    assert table(page, "solved")[1]["found by"] == ["snopt"]
    assert len(table(page, "start")[1]) == 2


@pytest.mark.usefixtures("one_panel")
def test_results_of_one_scenario_are_told_apart_by_their_folders(tmp_path, checks):
    folders = [write(tmp_path / name, checks, name="same") for name in "ab"]
    assert table(report_page(folders), "asked for")[0][1:] == ["a", "b"]
    folders = [write(tmp_path / name / "walk", checks, name="same") for name in "cd"]
    assert table(report_page(folders), "asked for")[0][1:] == list(map(str, folders))


def test_it_can_be_made_again(three, one_page, monkeypatch, tmp_path):
    root = html.document_fromstring(one_page)
    scenario, command = (
        found.text_content() for found in root.xpath("//section[@id='again']//pre")
    )
    assert Scenario.from_dict(tomllib.loads(scenario)) == load_record(three[0]).gait.scenario
    program, *arguments = shlex.split(command)
    assert program == "human-gait"
    calls = []
    monkeypatch.chdir(tmp_path)
    Path("load 0.toml").write_text(scenario)
    monkeypatch.setattr(
        "human_gait.prediction.predict_to_folder", lambda *given, **_: calls.append(given) or True
    )
    assert cli.run(arguments) == 0
    task = load_record(three[0]).gait.scenario
    assert [call[:6] for call in calls] == [(task, "newton", Path("out/load 0"), "dh", 7, None)]
    assert "human-gait==0.1.0" in root.xpath("string(//section[@id='again'])")


@pytest.mark.usefixtures("one_panel")
@pytest.mark.parametrize(("start", "said"), [(WARM, "--warm-from"), (GIVEN, "refine")])
def test_a_start_that_no_command_repeats_is_told(tmp_path, checks, start, said):
    folder = write(tmp_path / "a", checks)
    found = read_json(folder / "summary.json")
    found["attempts"][0]["start"] = start
    (folder / "summary.json").write_text(json.dumps(found))
    root = html.document_fromstring(report_page([folder]))
    assert said in root.xpath("string(//section[@id='again'])")


# Text of files


def spoiled(value):
    """Return what was read of a JSON file with every text hostile."""
    if isinstance(value, dict):
        return {key: spoiled(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [spoiled(inner) for inner in value]
    return value + HOSTILE if isinstance(value, str) else value


@pytest.mark.usefixtures("one_panel")
def test_text_of_files_and_names_of_folders_stay_text(tmp_path, checks):
    name = "<img src=x onerror=alert(1)> & \"'"
    folders = [write(tmp_path / f"{name}{k}", checks, success=False, name="same") for k in range(2)]
    for folder in folders:
        for file in ("summary.json", "explanation.json"):
            found = spoiled(read_json(folder / file))
            if "checks" in found:
                found["checks"][HOSTILE] = found["checks"].pop("masses off the body")
                found["violations"][HOSTILE] = found["violations"].pop("contact position")
                found["versions"][HOSTILE] = "1"
            (folder / file).write_text(json.dumps(found))
    for given in (folders, folders[:1]):
        page = report_page(given)
        root = html.document_fromstring(outer(page))
        assert root.xpath("//script | //img[not(@id='still')] | //@onerror") == []
        said = root.text_content()
        assert said.count(HOSTILE) > 15
        assert str(folders[0]) in said


@pytest.mark.usefixtures("one_panel")
def test_no_walk_is_told_with_what_to_try(tmp_path, checks):
    folder = write(tmp_path / "a", checks, success=False)
    root = html.document_fromstring(report_page([folder]))
    (verdict,) = root.find_class("failed")
    said = verdict.text_content()
    assert "no walk was found" in said
    for words in (DIAGNOSIS["not_kept"][0], "walk.speed", "at most 1.20", "people walk"):
        assert words in said
    _, rows, _ = table(report_page([folder]), "start")
    assert rows == {
        "own guess": [
            *("newton", "optimal", "no walk", 1.25),
            *("depth below the ground", 4000.5),
        ]
    }


@pytest.mark.usefixtures("one_panel")
def test_an_attempt_that_cannot_be_compared_is_reported_all_the_same(tmp_path, checks, monkeypatch):
    folder = write(tmp_path / "a", checks, success=False)

    def refuse(*_):
        raise ResultError("the foot does not stand")

    monkeypatch.setattr(comparison, "scores", refuse)
    page = report_page([folder])
    assert "no walk was found" in page
    assert 'id="people"' not in page
    found = read_json(folder / "summary.json") | {"success": True}
    (folder / "summary.json").write_text(json.dumps(found))
    with pytest.raises(ResultError, match="does not stand"):
        report_page([folder])


# What goes wrong


@pytest.mark.parametrize("name", ["gait.npz", "summary.json", "explanation.json"])
def test_a_folder_that_is_no_whole_result_is_named(tmp_path, checks, name):
    folder = write(tmp_path / "a", checks)
    (folder / name).unlink()
    with pytest.raises(ResultError, match=f"{folder}.*{name}"):
        report_page([folder])


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("summary.json", "{", "is damaged"),
        ("summary.json", "[]", "is damaged"),
        ("summary.json", "{}", "has no"),
        ("explanation.json", '{"step_time_s": 0, "shapes": [1]}', "step_time_s = 0, but gait.npz"),
        ("explanation.json", '{"step_time_s": 0.55, "shapes": [1]}', "shapes.0 must be a table"),
        ("explanation.json", "[" * 100_000, "is damaged"),
        ("gait.npz", "junk", "not a gait"),
        ("gait_cycle.csv", "junk", "must hold 101 rows"),
    ],
)
def test_a_damaged_file_is_named(tmp_path, checks, file, text, said):
    folder = write(tmp_path / "a", checks)
    (folder / file).write_text(text)
    with pytest.raises(ResultError, match=f"{re.escape(str(folder / file))}.*{said}"):
        report_page([folder])


def test_a_number_that_is_none_is_refused(tmp_path, checks):
    folder = write(tmp_path / "a", checks)
    found = read_json(folder / "summary.json") | {"wall_time_s": None}
    (folder / "summary.json").write_text(json.dumps(found))
    with pytest.raises(ResultError, match=r"summary\.json: wall_time_s must be a number"):
        report_page([folder])


def test_there_is_room_for_as_many_results_as_there_are_lines():
    with pytest.raises(ResultError, match=f"1 to {len(RESULTS)} results, not {len(RESULTS) + 1}"):
        report_page([Path(str(k)) for k in range(len(RESULTS) + 1)])


def test_a_result_cannot_be_compared_with_itself(three):
    again = three[0] / ".." / three[0].name
    with pytest.raises(ResultError, match="given twice"):
        report_page([three[0], again])


@pytest.mark.usefixtures("one_panel")
def test_the_command_writes_beside_one_result_and_into_out_for_several(
    three, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(three[0], "one")
    shutil.copytree(three[1], "two")
    assert cli.run(["report", "one"]) == 0
    assert cli.run(["report", "one", "two"]) == 0
    assert cli.run(["report", "two", "one", "--out", "new/place.html"]) == 0
    files = ["one/report.html", "out/report.html", "new/place.html"]
    assert capsys.readouterr().out.splitlines() == [f"wrote {file}" for file in files]
    titles = [html.parse(file).getroot().findtext(".//title") for file in files]
    assert [title.partition(" \N{EN DASH} ")[0] for title in titles] == [
        "load 0",
        "load 0, load 9.072",
        "load 9.072, load 0",
    ]
    assert "report.html" in OURS  # it goes with the old result


@pytest.mark.usefixtures("one_panel")
def test_a_mistake_is_one_line_and_leaves_nothing_behind(three, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("")
    for arguments in (
        [str(three[0]), "nowhere"],
        [str(three[0]), "--out", "file/report.html"],
        [str(three[0]), "--out", "."],
        [],
    ):
        assert cli.run(["report", *arguments]) == cli.BAD_INPUT
        error = capsys.readouterr().err
        assert error.startswith("error: ")
        assert error.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.solve
def test_the_report_of_a_prediction(tmp_path):
    result = solved("paper-normal")
    target = report_to_file([result.folder], tmp_path / "report.html")
    page = target.read_text()
    assert 2_000_000 < len(page.encode()) < 5_000_000
    _, rows, _ = table(page, "check")
    assert {name: row[3] for name, row in rows.items()} == {
        name: check["value"] for name, check in result.summary["checks"].items()
    }
    (effort,) = table(page, "key number")[1]["effort, Eq. (18)"][1:]
    assert effort == pytest.approx(result.summary["cost"], rel=1e-12)
    (frame,) = html.document_fromstring(page, parser=html.HTMLParser(huge_tree=True)).iter("iframe")
    save_playback(result.gait, tmp_path / "playback.html")
    assert unpacked(frame.get("srcdoc")) == unpacked((tmp_path / "playback.html").read_text())
