"""Own trials as a further reference: scored and drawn as the built-in ones, told what they are."""

import csv
import json
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

import human_gait as hg
from human_gait import cli
from human_gait.exceptions import TrialError
from human_gait.people.comparison import compare_cycle
from human_gait.people.own import own_trials
from human_gait.people.pictures import PANELS, compare_figure
from human_gait.people.readings import readings_text
from human_gait.people.reference import references_near
from human_gait.trials.stated import Stated, stated
from human_gait.walk.gait_cycle import COLUMNS, PERCENT, gait_cycle
from human_gait.walk.gait_file import save_gait

MEASURED = Path(str(files("human_gait.people") / "measured"))
FALISSE = [MEASURED / f"falisse2019_subject1_{part}.csv" for part in ("angles", "moments", "grf")]
FUKUCHI = MEASURED / "fukuchi2018_treadmill_1p26_angles.csv"
STANCE = MEASURED / "fukuchi2018_subject04_treadmill_1p30_stance_grf.csv"


@pytest.fixture(scope="module")
def cycle(exported):
    return gait_cycle(exported[0])


def table(path, cycle, noise=0.0, names=COLUMNS):
    """Curves over percent as a table of one cycle."""
    rows = np.column_stack([cycle[name] for name in names])
    rows[:, 1:] += noise
    text = "\n".join(",".join(f"{x:.9g}" for x in row) for row in rows)
    path.write_text(f"{','.join(names)}\n{text}\n")
    return path


def test_tables_of_others_score_as_the_built_in_ones_do(cycle):
    """The files that the package has, as anybody would give them."""
    own = own_trials([*FALISSE, FUKUCHI, STANCE], Stated())
    found = compare_cycle(cycle, 1.2, 0.66, "walk", own)
    built_in, theirs = found.references[:3], found.references[3:]
    assert [one.name for one in theirs] == [FALISSE[0].stem, FUKUCHI.stem, STANCE.stem]
    for known, other in zip(built_in, theirs, strict=True):
        scores = {s.curve: s for s in found.scores if s.reference == known.name}
        again = {s.curve: s for s in found.scores if s.reference == other.name}
        assert set(again) == set(scores)
        for curve, score in scores.items():
            assert again[curve].r == pytest.approx(score.r, nan_ok=True)
            assert again[curve].within_1sd == score.within_1sd


def test_cycles_over_percent_make_a_mean_and_a_band(cycle, tmp_path):
    paths = [table(tmp_path / f"{k}.csv", cycle, noise) for k, noise in enumerate((-1.0, 0.0, 1.0))]
    (own,) = own_trials(paths, Stated()).references
    assert own.label == "own: 3 trials and 3 cycles"
    for name in COLUMNS[1:]:
        np.testing.assert_allclose(own.curves[name].mean, cycle[name], atol=1e-6)
        np.testing.assert_allclose(own.curves[name].sd, 1.0, atol=1e-6)
    found = compare_cycle(cycle, 1.2, 0.66, "walk", own_trials(paths, Stated()))
    scores = [score for score in found.scores if score.reference == "own"]
    assert all(score.rmse < 1e-6 and score.within_1sd == 1.0 for score in scores)


def test_a_single_cycle_has_no_band(cycle, tmp_path):
    own = own_trials([table(tmp_path / "a.csv", cycle)], Stated())
    found = compare_cycle(cycle, 1.2, 0.66, "walk", own)
    assert all(np.isnan(score.within_1sd) for score in found.scores if score.reference == "own")
    figure = compare_figure(cycle, found.references)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "own: 1 trial and 1 cycle" in labels
    assert "nan" not in str(found)


def test_the_picture_has_every_reference_in_a_style_of_its_own(cycle, tmp_path):
    own = own_trials([*FALISSE, FUKUCHI, table(tmp_path / "a.csv", cycle)], Stated())
    measured = (*references_near(1.2), *own.references)
    figure = compare_figure(cycle, measured)
    column = [name for row in PANELS for name in row].index("knee_flexion_deg")
    lines = [x for x in figure.axes[column].get_lines() if x.get_label()[0] != "_"]
    assert len(lines) == 1 + sum("knee_flexion_deg" in one.curves for one in measured)
    assert len({(x.get_color(), x.get_linestyle()) for x in lines}) == len(lines)
    texts = figure.axes[column].texts
    assert len({text.xyann for text in texts}) == len(texts) == len(lines) - 1


def test_a_walk_is_compared_with_its_own_exports(exported):
    """Recordings of motion, forces and torques: the left leg's stride is whole in the files."""
    gait, folder = exported
    names = ("coordinates.mot", "ground_reaction.mot", "joint_torques.sto")
    events = [0.0, 2 * gait.step_time]
    mass = gait.body.subject.mass
    paths = [folder / name for name in names]
    found = hg.compare(gait, with_=paths, side="l", events=events, mass=mass)
    scores = {s.curve: s for s in found.scores if s.reference == "own"}
    assert set(COLUMNS[1:]) <= set(scores)
    assert all(score.rmse < 0.5 for score in scores.values())
    assert min(score.r for score in scores.values()) > 0.999
    text = str(found)
    assert "knee_flexion_l -> knee_flexion_deg, sign +: this package's name" in text
    assert "strikes as given" in text
    assert "own: 1 trial and 1 cycle" in text
    np.testing.assert_array_equal(found.references[-1].curves["hip_flexion_deg"].percent, PERCENT)


def test_the_command_writes_own_trials_beside_people(exported, tmp_path, capsys):
    gait, folder = exported
    save_gait(gait, tmp_path)
    c3d = str(folder / "markers.c3d")
    assert cli.run(["compare", str(tmp_path), "--with", str(FALISSE[0]), c3d]) == 0
    said = capsys.readouterr().out
    assert "as they are: pelvis_tilt_anterior_deg" in said
    assert "left out: subtalar_inversion_deg" in said
    assert "strikes from the events of the file" in said
    stored = json.loads((tmp_path / "compare.json").read_text())
    assert [one["name"] for one in stored["references"]][3:] == ["own", FALISSE[0].stem]
    read = {one["curve"]: one["column"] for one in stored["own"]["read"]}
    assert read["vertical_up_BW"] == "force plate 1"
    rows = list(csv.DictReader((tmp_path / "compare.csv").read_text().splitlines()))
    assert {"own", FALISSE[0].stem} <= {row["reference"] for row in rows}
    assert (tmp_path / "compare.png").read_bytes().startswith(b"\x89PNG")


def test_files_without_the_option_are_refused(exported, tmp_path, capsys):
    save_gait(exported[0], tmp_path)
    assert cli.run(["compare", str(tmp_path), str(FUKUCHI)]) == cli.BAD_INPUT
    assert "follow --with" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--map", "knee=knee_flexion_deg"], "no curve is called so"),
        (["--map", "knee_flexion_deg=knee_flexoin_deg"], "did you mean knee_flexion_deg"),
        (["--units", "ell"], '--units = "ell": must be one of deg, rad'),
        (["--side", "x"], "must be one of r, l"),
        (["--events", "1"], "two strikes"),
    ],
)
def test_a_wrong_option_is_one_line(exported, tmp_path, capsys, options, message):
    save_gait(exported[0], tmp_path)
    assert cli.run(["compare", str(tmp_path), "--with", str(FUKUCHI), *options]) == cli.BAD_INPUT
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert message in error


def test_a_table_is_mapped_by_hand_too(cycle, tmp_path):
    names = ("gait_cycle_percent", "knee_flexion_deg")
    path = table(tmp_path / "a.csv", cycle, names=names)
    path.write_text(path.read_text().replace("knee_flexion_deg", "bend_deg"))
    with pytest.raises(TrialError, match="no curve of the gait cycle is called so: bend_deg"):
        own_trials([path], Stated())
    own = own_trials([path], stated(map={"knee_flexion_deg": "-bend_deg"}))
    np.testing.assert_allclose(
        own.references[0].curves["knee_flexion_deg"].mean, -cycle["knee_flexion_deg"], atol=1e-6
    )
    assert "bend_deg -> knee_flexion_deg, sign -: as stated" in readings_text(own)


def test_curves_of_stance_need_a_band(tmp_path, cycle):
    path = table(tmp_path / "a.csv", cycle, names=("gait_cycle_percent", "vertical_up_BW"))
    path.write_text(path.read_text().replace("gait_cycle", "stance"))
    with pytest.raises(TrialError, match="curves of stance need an SD"):
        own_trials([path], Stated())
