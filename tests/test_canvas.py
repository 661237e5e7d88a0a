"""Pictures are the same whatever a user has set, and the user's settings stay as they are."""

import os
import subprocess
import sys
from io import BytesIO

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image
from walking import guessed_gait

from human_gait.people import pictures as people
from human_gait.people.reference import references_near
from human_gait.pictures.paper_figures import validation
from human_gait.pictures.plots import PLOTS
from human_gait.reporting.figures import curve_panel, styled, svg
from human_gait.walk.gait_cycle import gait_cycle
from human_gait.walk.gait_file import save_gait

GAIT = guessed_gait()
CYCLE = gait_cycle(GAIT)
NEAR = references_near(1.2)

HOSTILE = {
    "text.usetex": True,
    "font.family": ["serif"],
    "font.size": 17.0,
    "axes.facecolor": "red",
    "axes.grid": True,
    "savefig.dpi": 30,
    "savefig.bbox": "tight",
    "savefig.format": "pdf",
    "savefig.transparent": True,
    "figure.dpi": 37,
    "lines.linewidth": 9.0,
    "path.sketch": (3.0, 100.0, 2.0),
    "xtick.direction": "in",
    "xtick.minor.visible": True,
    "figure.autolayout": True,
    "text.hinting": "none",
    "axes.unicode_minus": False,
    "svg.fonttype": "path",
}


def report_panel():
    with styled():
        return svg(curve_panel("knee_flexion_deg", [CYCLE], NEAR, GAIT), "k", "knee").encode()


DRAWN = {
    "torques": lambda: PLOTS["joint_torques"](GAIT).png(),
    "footprints": lambda: PLOTS["zmp"](GAIT).png(),
    "people": lambda: people.compare_figure(CYCLE, NEAR[:1]).png(),
    "figure 12": lambda: validation(GAIT).png(),
    "report": report_panel,
}


def pixels(png):
    with Image.open(BytesIO(png)) as picture:
        return np.array(picture)


def settings():
    """All of them but the backend, which matplotlib chooses when it is looked at."""
    return {key: mpl.rcParams[key] for key in mpl.rcParams if key != "backend"}


@pytest.mark.parametrize("name", DRAWN)
def test_a_style_that_is_set_in_python_does_not_reach_pictures_and_stays(name, monkeypatch):
    monkeypatch.setattr(people, "PANELS", people.PANELS[2:4])
    expected = DRAWN[name]()
    with mpl.rc_context(HOSTILE):
        before = settings()
        assert DRAWN[name]() == expected
        assert settings() == before


def test_a_figure_keeps_its_look_where_it_is_shown_and_saved_later():
    figures, saved = [PLOTS["ground_reaction"](GAIT) for _ in range(3)], BytesIO()
    expected = pixels(figures.pop().png())
    with mpl.rc_context(HOSTILE):
        shown = figures.pop()._repr_png_()
        figures.pop().savefig(saved)
    np.testing.assert_array_equal(pixels(shown), expected)
    np.testing.assert_array_equal(pixels(saved.getvalue()), expected)


# --- what is read when matplotlib is imported


def process(code, place, **variables):
    """Run a program in a folder with variables of the environment; return what it says."""
    inherited = {name: text for name, text in os.environ.items() if not name.startswith("MPL")}
    command = [sys.executable, "-c", code]
    options = {"cwd": place, "env": inherited | variables, "text": True}
    return subprocess.run(command, capture_output=True, check=False, timeout=100, **options)


def settings_file(folder, **more):
    lines = [f"{key}: {value}" for key, value in (HOSTILE | more).items()]
    lines += ["no such key: 3", "no colon", "timezone: Asia/Tokyo", "axes.formatter.use_locale: 1"]
    text = "\n".join(lines).translate(str.maketrans("", "", "[]()'"))
    (folder / "matplotlibrc").write_text(text)


def test_the_command_draws_the_same_whatever_surrounds_it(tmp_path):
    """Settings here and in a folder that is named, no such backend, no home, fonts hinted else."""
    (tmp_path / "walk").mkdir()
    save_gait(GAIT, tmp_path / "walk")
    settings_file(tmp_path)
    done = process(
        "import sys; from human_gait.cli import main; sys.argv[1:] = ['plot', 'walk']; main()",
        tmp_path,
        MPLCONFIGDIR=str(tmp_path),
        MPLBACKEND="Qt4Agg",
        HOME="/dev/null/nobody",
        XDG_CACHE_HOME="/dev/null/nowhere",
        FREETYPE_PROPERTIES="truetype:interpreter-version=35",
        LC_ALL="de_DE.UTF-8",
        TZ="Asia/Tokyo",
    )
    assert (done.returncode, done.stderr) == (0, "")
    for name in ("joint_torques", "stick_diagram"):
        drawn = (tmp_path / "walk" / f"{name}.png").read_bytes()
        np.testing.assert_array_equal(pixels(drawn), pixels(PLOTS[name](GAIT).png()))


OTHERS = """
import os, sys
before = dict(os.environ)
import human_gait.canvas
import matplotlib, logging
assert "matplotlib.pyplot" not in sys.modules
assert dict(os.environ) == before
assert matplotlib.rcParams["lines.linewidth"] == 9.0
assert matplotlib.rcParams["backend"] == "svg"
assert matplotlib.get_configdir() == before["MPLCONFIGDIR"]
assert logging.getLogger("matplotlib").level == logging.NOTSET
"""


def test_others_in_the_same_process_get_matplotlib_with_their_own_settings(tmp_path):
    settings_file(tmp_path, **{"axes.formatter.use_locale": 0})
    done = process(OTHERS, "/", MPLCONFIGDIR=str(tmp_path), MPLBACKEND="svg")
    assert (done.returncode, done.stderr) == (0, "")


def odd_file(folder, kind):
    path = folder / "matplotlibrc"
    match kind:
        case "bytes":
            path.write_bytes(b"font.family: caf\xe9\n")
        case "pipe":
            os.mkfifo(path)
        case "endless":
            path.symlink_to("/dev/zero")
        case "folder":
            path.mkdir()
        case "large":
            path.write_bytes(b"#" * 2**21)


@pytest.mark.parametrize(
    ("where", "kind"),
    [("here", "bytes"), ("named", "bytes"), ("home", "pipe"), ("named", "endless")],
)
def test_a_file_of_settings_that_cannot_be_read_stops_nothing(tmp_path, where, kind):
    (tmp_path / ".config" / "matplotlib").mkdir(parents=True)
    odd_file(tmp_path / ".config/matplotlib" if where == "home" else tmp_path, kind)
    named = {"MATPLOTLIBRC": str(tmp_path)} if where == "named" else {}
    place = tmp_path if where == "here" else "/"
    done = process(
        "import human_gait.canvas", place, HOME=str(tmp_path), MPLBACKEND="none", **named
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("kind", ["folder", "large"])
def test_nor_does_a_folder_or_a_large_file_in_its_place(tmp_path, kind):
    odd_file(tmp_path, kind)
    done = process("import human_gait.canvas", tmp_path, HOME="/dev/null")
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("date", ["tomorrow", "1e5", "", "9" * 17])
def test_a_date_that_is_none_stops_no_command(tmp_path, date):
    """SOURCE_DATE_EPOCH, which numpy and matplotlib read."""
    (tmp_path / "walk").mkdir()
    save_gait(GAIT, tmp_path / "walk")
    code = (
        "import sys; sys.argv[1:] = ['plot', 'walk']; from human_gait.command import main; main()"
    )
    done = process(code, tmp_path, SOURCE_DATE_EPOCH=date)
    assert (done.returncode, done.stderr) == (0, "")


def test_files_of_packages_are_read_as_what_they_are_whatever_the_locale(tmp_path):
    code = (
        "from human_gait.surroundings import process_is_ours; process_is_ours()\n"
        "from pydrake.multibody import plant"
    )
    done = process(code, tmp_path, LC_ALL="C", PYTHONUTF8="0")
    assert (done.returncode, done.stderr) == (0, "")
