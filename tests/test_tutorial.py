"""The tutorial runs from top to bottom, and what it shows at its end is what the files say."""

import json
from pathlib import Path

import nbformat
import numpy as np
import pytest
from lxml import html
from nbclient import NotebookClient

from human_gait.walk.gait_cycle import load_gait_cycle

NOTEBOOK = Path(__file__).resolve().parent.parent / "docs" / "tutorial.ipynb"


def test_it_is_stored_small_and_without_outputs():
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(notebook)
    assert NOTEBOOK.stat().st_size < 100_000
    for cell in notebook.cells:
        if cell.cell_type == "code":
            assert cell.outputs == []
            assert cell.execution_count is None


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("tutorial")


@pytest.fixture(scope="module")
def run(folder):
    """The notebook as it was run in a folder of its own; a cell that fails is an error."""
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    resources = {"metadata": {"path": str(folder)}}
    return NotebookClient(notebook, timeout=300, resources=resources).execute()


def shown(cell, kind):
    """Return what a cell shows as its value."""
    (output,) = [one for one in cell.outputs if one.output_type == "execute_result"]
    return output.data[kind]


def table(run):
    rows = [
        line.strip("| ").split(" | ") for line in shown(run.cells[-1], "text/markdown").splitlines()
    ]
    return {row[0]: row[1:] for row in rows[2:]}


@pytest.mark.solve
def test_the_last_table_is_what_the_files_say(run, folder):
    found = table(run)
    results = [folder / "out" / name for name in ("plain", "loaded")]
    summaries = [json.loads((result / "summary.json").read_text()) for result in results]
    cycles = [load_gait_cycle(result / "gait_cycle.csv") for result in results]
    assert found["a walk"] == ["True", "True"]
    assert found["iterations"] == [str(one["iterations"]) for one in summaries]
    assert (
        found["started from"] == ["own guess", "own guess"] == [one["start"] for one in summaries]
    )
    exact = {
        "load [kg]": [one["scenario"]["load"]["mass"] for one in summaries],
        "metabolic cost [J/(kg m)]": [
            one["energy"]["metabolic_cost_of_transport_J_per_kg_m"] for one in summaries
        ],
        "effort [N² m² s]": [one["energy"]["effort_N2_m2_s"] for one in summaries],
        "mean lean of the trunk [deg]": [one["trunk_flexion_deg"].mean() for one in cycles],
        "largest vertical force [BW]": [one["vertical_up_BW"].max() for one in cycles],
    }
    for name, values in exact.items():
        np.testing.assert_allclose([float(text) for text in found[name]], values, rtol=1e-5)
    assert len(found) == 3 + len(exact) + 2


@pytest.mark.solve
def test_it_shows_what_its_text_says(run):
    """More energy, a trunk that leans forward, a larger force, and legs that hardly differ."""
    found = {name: [float(text) for text in row] for name, row in table(run).items() if "[" in name}
    for name, (plain, loaded) in found.items():
        assert loaded > plain, name
    r = [float(text) for text in table(run)["knee flexion, r with Falisse 2019"]]
    assert abs(r[0] - r[1]) < 0.05
    text = "".join(
        output.get("text", "") for cell in run.cells for output in cell.get("outputs", ())
    )
    assert "did you mean step_length?" in text


@pytest.mark.solve
def test_its_pictures_and_pages_are_there(run, folder):
    frames = [
        html.fromstring(output.data["text/html"]).xpath("//iframe")[0]
        for cell in run.cells
        for output in cell.get("outputs", ())
        if "<iframe" in output.get("data", {}).get("text/html", "")
    ]
    animation, report = frames
    assert "setPlaying" in animation.get("srcdoc")
    assert report.get("src") == "out/report.html"
    assert (folder / report.get("src")).is_file()
    assert any(
        "image/png" in output.get("data", {})
        for cell in run.cells
        for output in cell.get("outputs", ())
    )
