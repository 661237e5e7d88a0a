import csv
import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console
from test_reference import as_cycle, by_name

from human_gait.exceptions import ResultError
from human_gait.people import comparison as room
from human_gait.people.comparison import compare, compare_cycle, save_comparison
from human_gait.people.comparison_table import comparison_table
from human_gait.people.pictures import PANELS, compare_figure
from human_gait.people.reference import references_near, tuned_on
from human_gait.problem.program import build_program
from human_gait.scenario import load_scenario
from human_gait.walk.gait_cycle import COLUMNS, PERCENT


def person():
    """The gait cycle of the person measured by Falisse."""
    source = as_cycle(by_name("falisse2019_subject1"))
    return {"gait_cycle_percent": PERCENT, "trunk_flexion_deg": np.zeros(101)} | source


def compared(cycle=None, warning=""):
    found = compare_cycle(cycle or person(), 1.2, 0.66, "the person")
    return replace(found, no_walk=warning, gait="0123456789abcdef")


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("result")
    save_comparison(compared(), folder)
    return folder, comparison_table(compared())


def test_a_measured_person_walks_like_himself():
    comparison = compared()
    own = [s for s in comparison.scores if s.reference == "falisse2019_subject1"]
    assert len(own) == len(COLUMNS) - 2
    assert min(s.r for s in own) > 0.995
    assert (comparison.speed, comparison.step_length) == (1.2, 0.66)


def test_other_people_walk_alike():
    """Two laboratories and two people agree in what the goals of a prediction are made of."""
    others = {
        (s.reference, s.curve): s.r
        for s in compared().scores
        if s.reference != "falisse2019_subject1"
    }
    assert others["fukuchi2018_treadmill_1p26", "knee_flexion_deg"] > 0.95
    assert others["fukuchi2018_treadmill_1p26", "hip_flexion_deg"] > 0.95
    assert others["fukuchi2018_subject04_1p30", "vertical_up_BW"] > 0.9
    assert others["fukuchi2018_subject04_1p30", "foreaft_forward_BW"] > 0.9


@pytest.mark.parametrize("width", [80, 140])
def test_the_table_has_a_row_for_each_score(result, width):
    _, table = result
    assert table.row_count == 17 + 3 + 3 + 3
    console = Console(width=width)
    with console.capture() as capture:
        console.print(table)
    text = capture.get()
    assert "knee" in text
    assert "95 %" in text
    assert max(map(len, text.splitlines())) <= width
    assert "…" not in text


def test_the_files_hold_the_same_scores(result):
    folder, _ = result
    stored = json.loads((folder / "compare.json").read_text())
    rows = list(csv.DictReader((folder / "compare.csv").read_text().splitlines()))
    assert len(rows) == len(stored["scores"]) == 23
    for row, score in zip(rows, stored["scores"], strict=True):
        assert (row["reference"], row["curve"]) == (score["reference"], score["curve"])
        assert float(row["rmse"]) == score["rmse"]
        assert float(row["measured_greatest"]) == score["measured_range"][1]
    assert [step["name"] for step in stored["step"]] == ["step length", "cadence", "double support"]
    assert all(source["citation"] and source["licence"] for source in stored["references"])


def test_the_plot_is_a_picture(result):
    folder, _ = result
    assert (folder / "compare.png").read_bytes().startswith(b"\x89PNG")


def test_the_plot_shows_every_column_with_its_unit_over_the_measured_ones():
    cycle, measured = person(), references_near(1.2)
    figure = compare_figure(cycle, measured)
    columns = [column for row in PANELS for column in row]
    assert sorted(columns) == sorted(COLUMNS[1:])
    for ax, column in zip(figure.axes, columns, strict=True):
        curves = [source.curves[column] for source in measured if column in source.curves]
        lines = [line for line in ax.get_lines() if line.get_label()[0] != "_"]
        assert len(lines) == len(curves) + 1
        assert len(ax.collections) == len(curves)
        np.testing.assert_array_equal(lines[-1].get_ydata(), cycle[column])
        assert ax.get_ylabel() in ("[deg]", "[N m/kg]", "[BW]")
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[0] == "predicted"
    assert len(labels) == 4


@pytest.fixture
def undrawn(monkeypatch):
    """Comparisons are saved without their picture, which takes seconds."""
    picture = SimpleNamespace(png=lambda *_: b"")
    monkeypatch.setattr(room, "compare_figure", lambda *_: picture)


@pytest.mark.usefixtures("undrawn")
def test_a_curve_without_a_correlation_is_null(tmp_path):
    save_comparison(compared(person() | {"elbow_flexion_deg": np.full(101, 20.0)}), tmp_path)
    stored = json.loads((tmp_path / "compare.json").read_text())
    assert {s["curve"] for s in stored["scores"] if s["r"] is None} == {"elbow_flexion_deg"}


def test_a_walk_without_stance_is_refused():
    with pytest.raises(ResultError, match=r"the person: .*does not stand"):
        compared(person() | {"vertical_up_BW": np.zeros(101)})


@pytest.mark.usefixtures("undrawn")
def test_what_is_no_walk_says_so_wherever_it_is_compared(tmp_path):
    warning = "This is no walk: newton ended with '[red]limit $x_1'."
    found = compared(warning=warning)
    save_comparison(found, tmp_path)
    assert json.loads((tmp_path / "compare.json").read_text())["no_walk"] == warning
    assert warning in str(found)
    assert repr(found).startswith(warning)
    figure = compare_figure(found.cycle, found.references, warning)
    assert figure.legends[0].get_title().get_text() == warning
    save_comparison(compared(), tmp_path)
    assert json.loads((tmp_path / "compare.json").read_text())["no_walk"] is None
    assert "no walk" not in str(compared())


@pytest.mark.parametrize("name", ["preferred", "paper-preferred"])
def test_a_comparison_says_which_curves_had_a_say_in_the_walk(name):
    """Of the human formulation sizes are calibrated on people; of those before none is."""
    scenario = load_scenario(name)
    program = build_program(scenario)
    told = str(compare(program.gait(program.guess())))
    assert ("calibrated on the curves of Falisse et al." in told) == (name == "preferred")
    assert ("No measured curve enters the prediction" in told) == (name == "paper-preferred")
    both = tuned_on(scenario, load_scenario("preferred"))
    assert both == tuned_on(load_scenario("preferred"))
