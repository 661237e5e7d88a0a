"""A walk in a notebook: shown below the cell, which is given back, and nowhere else."""

import sys
from types import SimpleNamespace

import nbformat
import pytest
from lxml import html
from nbclient import NotebookClient
from walking import guessed_gait

import human_gait as hg
from human_gait.playback.inline import in_notebook
from human_gait.playback.page import playback_page

GAIT = guessed_gait()


def frame(shown):
    (found,) = html.fromstring(shown).xpath("//iframe | self::iframe")
    return found


def test_the_page_is_in_a_frame_as_it_is():
    shown = hg.play(GAIT, inline=True)
    inside = frame(shown._repr_html_())
    assert inside.get("srcdoc") == playback_page(GAIT)
    assert inside.get("title") == GAIT.scenario.name
    assert inside.get("sandbox") == "allow-scripts"
    assert len(repr(shown)) < 100


def test_two_walks_by_path_and_gait(tmp_path):
    folder = GAIT.save(tmp_path / "guess")
    shown = hg.play(str(folder), second=GAIT, overlay=True, strides=2, inline=True)
    assert shown.page == playback_page(hg.load(folder), 2, GAIT, True)


@pytest.mark.parametrize(
    ("shell", "there"),
    [
        (None, False),
        (SimpleNamespace(), False),  # IPython in a terminal
        (SimpleNamespace(kernel=object()), True),
    ],
)
def test_only_a_kernel_is_a_notebook(monkeypatch, shell, there):
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    assert in_notebook() is there


def test_ipython_need_not_be_there(monkeypatch):
    monkeypatch.delitem(sys.modules, "IPython", raising=False)
    assert not in_notebook()


def test_in_a_kernel_the_cell_shows_the_walk_and_is_given_back(tmp_path):
    GAIT.save(tmp_path / "guess")
    cells = ["import human_gait as hg", "hg.play('guess')", "hg.load('guess')", "print('on')"]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    resources = {"metadata": {"path": str(tmp_path)}}
    run = NotebookClient(notebook, timeout=120, resources=resources).execute()
    _, played, loaded, printed = (cell.outputs for cell in run.cells)
    assert "setPlaying" in frame(played[0].data["text/html"]).get("srcdoc")
    assert "<table>" in loaded[0].data["text/html"]
    assert printed[0].text == "on\n"
