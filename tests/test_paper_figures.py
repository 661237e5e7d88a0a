"""The paper's figures, from walks that needed no solver."""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image
from walking import guessed_gait

from human_gait import cli
from human_gait.body.skeleton import GRAVITY
from human_gait.exceptions import ResultError
from human_gait.people.reference import correlation, references
from human_gait.pictures.backpacks import (
    backpack_faces,
    backpack_postures,
    knee_torques,
    load_label,
    vertical_forces,
)
from human_gait.pictures.paper_figures import (
    FIGURES,
    MAKE_TARGETS,
    PAPER,
    load_results,
    save_figures,
    validation,
)
from human_gait.walk.described import with_story
from human_gait.walk.gait_cycle import PERCENT, gait_cycle
from human_gait.walk.gait_file import save_gait

LOADS = {"backpack-0": 0.0, "backpack-20": 9.07, "backpack-40": 18.14}
GAITS = {name: guessed_gait(LOADS.get(name, 0.0)) for name in MAKE_TARGETS}
BACKPACKS = [GAITS[name] for name in LOADS]
NAMES = (
    "fig07_stick_diagram",
    "fig08_joint_torques",
    "fig09_backpack_postures",
    "fig10_vertical_forces",
    "fig11_knee_torques",
    "fig12_validation",
)
CYCLE = "gait cycle from right heel strike [%]"
LOADED = ("0 lb (0.0 kg)", "20 lb (9.1 kg)", "40 lb (18.1 kg)")
LABELS = {
    "fig07_stick_diagram": ("right leg and arm", "left leg and arm", "ZMP", "0.5", " m"),
    "fig08_joint_torques": ("right hip", "right knee", "right ankle", "[N m/kg]", "[N m]", CYCLE),
    "fig09_backpack_postures": (*LOADED, "(a)", "(b)", "(c)", "% of step", "°", "0.5 m"),
    "fig10_vertical_forces": (*LOADED, "right foot", "both feet", "[BW]", "[N]", CYCLE),
    "fig11_knee_torques": (*LOADED, "right knee, extension +", "[N m/kg]", "[N m]", CYCLE),
    "fig12_validation": ("(a) knee", "(b) ankle", "[deg]", "[%]", "mean ± SD, r = ", "m/s"),
}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    for name, gait in GAITS.items():
        (folder / name).mkdir()
        save_gait(gait, folder / name)
    return folder


@pytest.fixture(scope="module")
def pictures(results, tmp_path_factory):
    folder = tmp_path_factory.mktemp("figures") / "new"
    return folder, save_figures(results, folder)


def copy_without(results, folder, *names):
    for name in GAITS:
        if name not in names:
            (folder / name).symlink_to(results / name)


def over_the_cycle(ax):
    return [line.get_ydata() for line in ax.get_lines() if len(line.get_xdata()) == len(PERCENT)]


def texts(path):
    return " | ".join(
        "".join(e.itertext()) for e in ET.parse(path).iter() if e.tag.endswith("text")
    )


def test_every_figure_is_written_twice_and_nothing_else(pictures):
    folder, files = pictures
    expected = sorted(f"{name}.{kind}" for name in NAMES for kind in ("png", "svg"))
    assert sorted(path.name for path in files) == expected
    assert sorted(path.name for path in folder.iterdir()) == expected
    assert {path.parent for path in files} == {folder}


@pytest.mark.parametrize("name", NAMES)
def test_a_picture_is_large_and_can_be_read_in_grey(pictures, name):
    with Image.open(pictures[0] / f"{name}.png") as picture:
        assert picture.width >= 1200
        assert len(picture.convert("L").getcolors()) > 10


@pytest.mark.parametrize("name", NAMES)
def test_a_drawing_holds_its_labels_and_units_as_text(pictures, name):
    written = texts(pictures[0] / f"{name}.svg")
    assert [label for label in LABELS[name] if label not in written] == []


def test_drawing_again_gives_the_same_bytes_and_leaves_no_trace(results, pictures, tmp_path):
    before = dict(mpl.rcParams)
    save_figures(results, tmp_path)
    assert dict(mpl.rcParams) == before
    for path in pictures[1]:
        assert (tmp_path / path.name).read_bytes() == path.read_bytes(), path.name


def test_no_date_is_written(pictures):
    assert all(b"dc:date" not in path.read_bytes() for path in pictures[0].glob("*.svg"))


@pytest.mark.parametrize("name", MAKE_TARGETS)
def test_a_missing_result_is_named_with_its_target_and_nothing_is_written(results, tmp_path, name):
    copy_without(results, tmp_path, name)
    with pytest.raises(ResultError) as raised:
        save_figures(tmp_path, tmp_path / "figures")
    message = str(raised.value)
    assert message == f"no gait.npz in {tmp_path / name} (make {MAKE_TARGETS[name]})"
    assert not (tmp_path / "figures").exists()


def test_all_missing_results_are_named_at_once(tmp_path):
    with pytest.raises(ResultError) as raised:
        load_results(tmp_path)
    expected = [f"{tmp_path / name} (make {target})" for name, target in MAKE_TARGETS.items()]
    assert [part for part in expected if part not in str(raised.value)] == []


def test_a_damaged_result_leaves_the_old_figures(results, tmp_path):
    copy_without(results, tmp_path, "preferred")
    (tmp_path / "preferred").mkdir()
    (tmp_path / "preferred" / "gait.npz").write_bytes(b"junk")
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "fig07_stick_diagram.png").write_bytes(b"old")
    with pytest.raises(ResultError, match=r"preferred.gait\.npz"):
        save_figures(tmp_path, tmp_path / "figures")
    assert [path.read_bytes() for path in (tmp_path / "figures").iterdir()] == [b"old"]


def test_a_figure_that_fails_leaves_nothing(results, tmp_path, monkeypatch):
    """The last one, when another has been drawn."""

    def fail(_):
        raise ValueError

    table = {
        "fig08_joint_torques": FIGURES["fig08_joint_torques"],
        "fig12_validation": (fail, ("preferred",)),
    }
    monkeypatch.setattr("human_gait.pictures.paper_figures.FIGURES", table)
    with pytest.raises(ValueError):  # noqa: PT011, it is ours
        save_figures(results, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_loads_are_compared_on_the_same_person_and_walk(results, tmp_path):
    copy_without(results, tmp_path, "backpack-20")
    (tmp_path / "backpack-20").mkdir()
    gait = GAITS["backpack-20"]
    subject = replace(gait.scenario.subject, mass=60.0)
    other = replace(gait, scenario=replace(gait.scenario, subject=subject))
    save_gait(other, tmp_path / "backpack-20")
    with pytest.raises(ResultError, match="differs in more than the load"):
        load_results(tmp_path)


def test_knee_torques_are_those_of_the_gait_cycle():
    figure = knee_torques(*BACKPACKS)
    for drawn, gait in zip(over_the_cycle(figure.axes[0]), BACKPACKS, strict=True):
        np.testing.assert_array_equal(drawn, gait_cycle(gait)["knee_extension_Nm_per_kg"])


def test_vertical_forces_are_those_of_the_right_foot_and_of_both():
    right, both = vertical_forces(*BACKPACKS).axes
    for drawn, total, gait in zip(
        over_the_cycle(right), over_the_cycle(both), BACKPACKS, strict=True
    ):
        np.testing.assert_array_equal(drawn, gait_cycle(gait)["vertical_up_BW"])
        instants = gait.instants(gait.step_time * (1.0 + PERCENT / 50.0))
        weight = gait.body.subject.mass * GRAVITY
        np.testing.assert_allclose(total * weight, instants.grf[..., 1].sum(axis=1), rtol=1e-12)


def test_both_feet_carry_body_and_load_on_average():
    """In any periodic walk; 2 %: the sampled force jumps where a foot lands or leaves."""
    _, both = vertical_forces(*BACKPACKS).axes
    for total, gait in zip(over_the_cycle(both), BACKPACKS, strict=True):
        carried = gait.body.total_mass / gait.body.subject.mass
        assert np.mean(total[:-1]) == pytest.approx(carried, rel=0.02)


def test_loads_differ_in_colour_and_in_line():
    ax = knee_torques(*BACKPACKS).axes[0]
    lines = [line for line in ax.get_lines() if len(line.get_xdata()) == len(PERCENT)]
    assert [line.get_label() for line in lines] == list(LOADED)
    assert len({line.get_color() for line in lines}) == 3
    assert len({line.get_linestyle() for line in lines}) == 3


def test_a_load_is_named_by_what_the_scenario_says():
    assert load_label(guessed_gait(13.6)) == "30 lb (13.6 kg)"


def test_postures_have_one_scale_and_a_backpack_only_where_one_is_carried():
    figure = backpack_postures(*BACKPACKS)
    figure.draw_without_rendering()
    assert len({(ax.get_xlim(), ax.get_ylim()) for ax in figure.axes}) == 1
    assert all(ax.get_aspect() == 1.0 for ax in figure.axes)
    sizes = {tuple(np.round(ax.get_window_extent().size, 6)) for ax in figure.axes}
    assert len(sizes) == 1
    faces = [[p for p in ax.patches if len(p.get_path().vertices) == 5] for ax in figure.axes]
    assert [len(drawn) for drawn in faces] == [0, 9, 9]


def test_the_backpack_is_the_box_of_the_load():
    """1e-12 m: its edges stay as long as the scenario says."""
    gait = BACKPACKS[-1]
    faces = backpack_faces(gait.body, gait.q(np.linspace(0.0, gait.step_time, 5)))
    right, top, front = faces[:, 0], faces[:, 1], faces[:, 2]
    width, height, depth = gait.body.load.size
    np.testing.assert_allclose(
        np.linalg.norm(right[:, 1] - right[:, 0], axis=-1), depth, atol=1e-12
    )
    np.testing.assert_allclose(
        np.linalg.norm(right[:, 2] - right[:, 1], axis=-1), height, atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.norm(top[:, 2] - top[:, 1], axis=-1), width, atol=1e-12)
    np.testing.assert_array_equal(front[:, 2], top[:, 2])


def test_the_backpack_stands_where_the_scenario_puts_it():
    """Upright, its centre is that of the load, left, up and ahead of the thorax' joint."""
    from human_gait.body.dh import frames
    from human_gait.body.skeleton import N_DOF, SEGMENTS

    body = BACKPACKS[-1].body
    upright = np.zeros((1, N_DOF))
    faces = backpack_faces(body, upright)[0]
    centre = (faces[0, 0] + faces[1, 2]) / 2  # opposite corners
    thorax = SEGMENTS["thorax"]
    A = frames(body.table, upright)[1][0, thorax]
    np.testing.assert_allclose(centre, A[:3, :3] @ body.load_com + A[:3, 3], atol=1e-12)
    assert faces[0, :, 0].max() < faces[2, 1, 0], "the right face is at the right, x < 0"
    assert faces[2, :, 2].min() > faces[0, 0, 2], "the front face is ahead"


def test_the_angles_and_the_measured_means_are_drawn_with_their_r():
    gait = GAITS["preferred"]
    cycle = gait_cycle(gait)
    columns = ("knee_flexion_deg", "ankle_dorsiflexion_deg")
    for ax, column in zip(validation(gait).axes, columns, strict=True):
        labels = [text.get_text() for text in ax.get_legend().get_texts()]
        *means, predicted = [line for line in ax.get_lines() if len(line.get_xdata()) > 2]
        np.testing.assert_array_equal(predicted.get_ydata(), cycle[column])
        measured = [source for source in references() if not source.stance_only]
        for source, mean, label in zip(measured, means, labels[1:], strict=True):
            curve = source.curves[column]
            np.testing.assert_array_equal(mean.get_ydata(), curve.mean)
            r = correlation(np.interp(curve.percent, PERCENT, cycle[column]), curve.mean)
            assert label == f"{source.label}, mean ± SD, r = {r:.2f}"


def test_the_command_writes_beside_the_results_or_where_it_is_told(results, tmp_path, capsys):
    copy_without(results, tmp_path)
    assert cli.run(["figures", str(tmp_path)]) == 0
    assert len(list((tmp_path / "figures").iterdir())) == 12
    assert capsys.readouterr().out == f"wrote 12 files to {tmp_path / 'figures'}\n"


def test_those_of_the_paper_are_drawn_of_its_walks_beside_the_others(
    results, tmp_path, capsys, monkeypatch
):
    table = {"fig08_joint_torques": FIGURES["fig08_joint_torques"]}
    monkeypatch.setattr("human_gait.pictures.paper_figures.FIGURES", table)
    for name in GAITS:
        (tmp_path / f"{PAPER}{name}").symlink_to(results / name)
    assert cli.run(["figures", str(tmp_path), "--paper"]) == 0
    assert len(list((tmp_path / "figures-paper").iterdir())) == 2
    assert not (tmp_path / "figures").exists()
    (tmp_path / "paper-normal").unlink()
    assert cli.run(["figures", str(tmp_path), "--paper"]) == cli.BAD_INPUT
    message = f"no gait.npz in {tmp_path / 'paper-normal'} (make paper-normal)"
    assert message in capsys.readouterr().err


def test_the_command_explains_a_missing_result_in_one_line(tmp_path, capsys):
    assert cli.run(["figures", str(tmp_path), "--out", str(tmp_path / "new")]) == cli.BAD_INPUT
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("error: ")
    assert captured.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_result_without_a_walk_is_drawn_with_a_note(results, tmp_path, capsys, monkeypatch):
    """The note is of the result, whatever figure: one is drawn."""
    table = {"fig11_knee_torques": FIGURES["fig11_knee_torques"]}
    monkeypatch.setattr("human_gait.pictures.paper_figures.FIGURES", table)
    copy_without(results, tmp_path, "backpack-20", "normal")
    for name, summary in {
        "normal": json.dumps({"success": True}),
        "backpack-20": json.dumps({"success": False}),
    }.items():
        (tmp_path / name).mkdir()
        save_gait(GAITS[name], tmp_path / name)
        (tmp_path / name / "summary.json").write_text(summary)
    assert cli.run(["figures", str(tmp_path)]) == 0
    notes = capsys.readouterr().err.splitlines()
    assert len(notes) == 1
    assert notes[0].startswith(f"note: {tmp_path / 'backpack-20'}: ")


def test_a_damaged_or_foreign_summary_is_refused_and_nothing_drawn(results, tmp_path, capsys):
    copy_without(results, tmp_path)
    summary = tmp_path / "normal" / "summary.json"
    for text in ("not JSON", json.dumps({"load_kg": 18.0})):
        summary.write_text(text)
        assert cli.run(["figures", str(tmp_path)]) == cli.BAD_INPUT
        error = capsys.readouterr().err
        assert str(summary) in error
        assert error.count("\n") == 1
    assert not (tmp_path / "figures").exists()


def test_a_figure_of_what_is_no_walk_says_so(results, tmp_path):
    copy_without(results, tmp_path, "normal")
    (tmp_path / "normal").mkdir()
    save_gait(with_story(GAITS["normal"], False), tmp_path / "normal")
    save_figures(tmp_path, tmp_path / "figures")
    warned = [
        path.stem
        for path in (tmp_path / "figures").glob("*.svg")
        if "This is no walk" in path.read_text()
    ]
    assert sorted(warned) == ["fig07_stick_diagram", "fig08_joint_torques"]
