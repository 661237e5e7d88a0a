import sys
from io import BytesIO
from itertools import combinations

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image
from walking import guessed_gait

from human_gait.body.skeleton import GRAVITY
from human_gait.pictures import plots
from human_gait.pictures.plots import PLOTS, half_a_cycle_later, plot, save_plots
from human_gait.pictures.sticks import project, stick_figures
from human_gait.results import names
from human_gait.walk.described import no_walk, with_story
from human_gait.walk.gait_cycle import COLUMNS, gait_cycle

GAIT = guessed_gait()
CYCLE = gait_cycle(GAIT)


@pytest.fixture(scope="module")
def figures():
    return {name: draw(GAIT) for name, draw in PLOTS.items()}


def curves(ax):
    """The lines over the gait cycle, without those that mark phases."""
    return [line.get_ydata() for line in ax.get_lines() if len(line.get_xdata()) == 101]


def test_every_picture_is_written_large_and_not_empty(tmp_path):
    save_plots(GAIT, tmp_path / "new")
    assert {path.name for path in (tmp_path / "new").iterdir()} == set(names.PLOTS)
    for name in names.PLOTS:
        with Image.open(tmp_path / "new" / name) as picture:
            assert picture.width >= 1200
            assert len(picture.convert("L").getcolors()) > 10


def test_drawing_leaves_no_trace_in_matplotlib(tmp_path):
    before = dict(mpl.rcParams)
    save_plots(GAIT, tmp_path)
    assert dict(mpl.rcParams) == before
    assert "human_gait.pictures.plots" in sys.modules
    assert not hasattr(plots, "pyplot")


def test_every_axis_has_a_unit(figures):
    for name in ("joint_torques", "ground_reaction", "zmp"):
        axes = figures[name].axes
        assert all("[" in ax.get_ylabel() for ax in axes), name
        assert "[" in axes[-1].get_xlabel(), name
    assert "[%]" in figures["joint_angles"].get_supxlabel()
    assert "[deg]" in figures["joint_angles"].get_supylabel()
    assert figures["stick_diagram"].axes[0].texts[-1].get_text().endswith(" m")


@pytest.mark.parametrize("name", PLOTS)
def test_panels_with_all_their_texts_are_whole_and_apart(figures, name):
    """Where they are is fixed: nothing makes room for a longer text."""
    figure = figures[name]
    figure.draw_without_rendering()
    texts = [text.get_window_extent() for text in figure.texts if text.get_text()]
    boxes = texts + [ax.get_tightbbox() for ax in figure.axes]
    assert len(texts) == {"joint_angles": 2, "stick_diagram": 1}.get(name, 0)
    for box in boxes:
        np.testing.assert_array_less(figure.bbox.min - 1.0, box.min)
        np.testing.assert_array_less(box.max, figure.bbox.max + 1.0)
    pairs = (mpl.transforms.Bbox.intersection(*pair) for pair in combinations(boxes, 2))
    shared = [np.ptp(both.get_points(), axis=0).min() for both in pairs if both]
    assert max(shared, default=0.0) <= 1.0


def test_a_picture_is_what_matplotlib_would_save():
    """It draws one whose parts it arranges twice."""
    content, failed = BytesIO(), with_story(GAIT, False)
    plot(failed, "zmp").savefig(content, format="png")
    saved, ours = (Image.open(one) for one in (content, BytesIO(plot(failed, "zmp").png())))
    np.testing.assert_array_equal(np.asarray(saved), np.asarray(ours))
    assert saved.info["dpi"] == ours.info["dpi"]


def test_torques_are_those_of_the_gait_cycle(figures):
    drawn = [curves(ax)[0] for ax in figures["joint_torques"].axes]
    for values, joint in zip(
        drawn, ("hip_extens", "knee_extens", "ankle_plantarflex"), strict=True
    ):
        np.testing.assert_array_equal(values, CYCLE[f"{joint}ion_Nm_per_kg"])


def test_the_second_scale_is_in_newton_metres(figures):
    ax = figures["joint_torques"].axes[0]
    (second,) = ax.child_axes
    figures["joint_torques"].draw_without_rendering()
    ratio = np.divide(second.get_ylim(), ax.get_ylim())
    np.testing.assert_allclose(ratio, GAIT.body.subject.mass)


def test_all_angles_of_the_gait_cycle_are_drawn(figures):
    drawn = [curves(ax)[0] for ax in figures["joint_angles"].axes if curves(ax)]
    expected = [CYCLE[name] for name in COLUMNS if name.endswith("_deg")]
    assert len(drawn) == len(expected)
    assert {values.tobytes() for values in drawn} == {values.tobytes() for values in expected}


def test_the_feet_carry_the_body_on_average(figures):
    """In any periodic walk; 2 %: the sampled force jumps where a foot lands or leaves."""
    right, left = curves(figures["ground_reaction"].axes[0])
    assert np.mean((right + left)[:-1]) == pytest.approx(1.0, abs=0.02)


def test_the_left_foot_does_what_the_right_foot_did_half_a_cycle_before():
    """Without the ends of the contacts, where the force may jump."""
    instants = GAIT.instants(GAIT.step_time * (1.0 + np.arange(101) / 50.0))
    left = instants.grf[:, 1, 1] / (GAIT.body.subject.mass * GRAVITY)
    same = np.isclose(half_a_cycle_later(CYCLE["vertical_up_BW"]), left, atol=1e-9)
    assert same.mean() > 0.95


def test_phases_are_marked_where_the_scenario_puts_them(figures):
    both = 50.0 * GAIT.scenario.phases.double_support
    for name in ("joint_torques", "joint_angles", "ground_reaction"):
        ax = figures[name].axes[0]
        spans = sorted(tuple(np.round(p.get_bbox().intervalx, 9)) for p in ax.patches)
        assert spans == [(0.0, both), (50.0, 50.0 + both)]


def test_sticks_keep_their_length():
    """1e-9 m; the trunk bends and the feet roll over the ball, limbs and hips do not stretch."""
    sticks = stick_figures(GAIT, GAIT.instants(np.linspace(0.0, 1.0, 7)))
    for part, points in sticks.items():
        length = np.linalg.norm(np.diff(points, axis=1), axis=-1)
        if not part.startswith(("foot", "shoulders")):
            assert np.ptp(length, axis=0).max() < 1e-9, part


def test_legs_and_arms_hang_from_hips_and_shoulders():
    sticks = stick_figures(GAIT, GAIT.instants([0.1]))
    for end, side in ((0, "l"), (-1, "r")):
        np.testing.assert_array_equal(sticks["pelvis"][:, end], sticks[f"leg_{side}"][:, 0])
        np.testing.assert_array_equal(sticks["shoulders"][:, end], sticks[f"arm_{side}"][:, 0])
        np.testing.assert_array_equal(sticks[f"leg_{side}"][:, -1], sticks[f"foot_{side}"][:, 0])
    assert sticks["pelvis"][0, 0, 0] > sticks["pelvis"][0, -1, 0]


def test_the_picture_keeps_the_plane_of_walking_and_shifts_the_left_aside():
    points = np.array([[0.0, 1.5, 0.3], [0.2, 1.5, 0.3]])
    here, left = project(points)
    np.testing.assert_array_equal(here, [0.3, 1.5])
    assert (left > here).all()


def test_the_legend_of_the_sticks_names_lines_and_the_caption_tells_the_times(figures):
    figure = figures["stick_diagram"]
    (legend,) = (ax.get_legend() for ax in figure.axes)
    names = [text.get_text() for text in legend.get_texts()]
    assert names == ["right leg and arm", "left leg and arm", "ZMP"]
    heads = len(figure.axes[0].patches)  # one for each figure, from the first to the last instant
    every = 2000 * GAIT.step_time / (heads - 1)
    assert figure.get_supxlabel().endswith(f"a figure every {every:.0f} ms")


@pytest.mark.parametrize("name", PLOTS)
def test_a_picture_of_what_is_no_walk_says_so(name):
    def said(gait):
        figure = plot(gait, name)
        legends = [legend.get_title().get_text() for legend in figure.legends]
        return [text for text in (figure.get_suptitle(), *legends) if "no walk" in text]

    assert said(guessed_gait()) == []
    (warning,) = said(with_story(guessed_gait(), False, status="[red] $x_1$"))
    assert warning == no_walk(with_story(guessed_gait(), False))
