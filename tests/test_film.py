import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageSequence
from scipy import ndimage
from walking import guessed_gait

import human_gait as hg
from human_gait import cli
from human_gait.playback import encoder, picture
from human_gait.playback import film as room
from human_gait.playback.film import film
from human_gait.playback.parts import LOAD, drawn_parts
from human_gait.playback.picture import VIEWS, Walker, downscaled, stage_for
from human_gait.playback.raster import Camera, seen
from human_gait.playback.still import still_address
from human_gait.results import names
from human_gait.results.ours import is_ours
from human_gait.walk.described import gait_digest
from human_gait.walk.gait import Gait
from human_gait.walk.gait_file import save_gait

GAIT = guessed_gait()
FAILED = replace(GAIT, solution={"success": False, "solver": "newton", "status": "stopped"})
SIZE = (96, 128)
RED = (179, 38, 30)  # of the banner


@pytest.fixture(scope="module")
def gif(tmp_path_factory):
    return film(GAIT, tmp_path_factory.mktemp("film") / "walk.gif", size=SIZE)


@pytest.fixture
def few_frames(monkeypatch):
    monkeypatch.setattr(room, "_RATE", 4)


def changed_to(**tables):
    """The motion of the walk in another scenario: of somebody else, or with a load."""
    return Gait(
        hg.Scenario.from_dict({**GAIT.scenario.to_dict(), **tables}),
        GAIT.breaks,
        GAIT.control_points,
    )


def somebody(**subject):
    return Walker(changed_to(subject=subject))


def loaded(position, size=(0.3, 0.45, 0.2), **subject):
    load = {"mass": 10.0, "position": list(position), "size": list(size)}
    more = {"subject": subject} if subject else {}
    return changed_to(load=load, **more)


def seen_pixels(walker, view="side", size=(120, 160)):
    """Which pixels show body or load, on white without the shadow."""
    stage = stage_for([walker], view, size, plain=True)
    vertices, _ = walker.placed(0.1)
    camera = stage.camera
    found = seen(camera.project(vertices), walker.surface.faces, camera.width, camera.height)
    shown = np.zeros(camera.height * camera.width, dtype=bool)
    shown[found.pixel] = True
    return shown.reshape(camera.height, camera.width)


def test_a_gif_repeats_one_stride_at_its_own_pace_for_ever(gif):
    with Image.open(gif) as picture:
        assert picture.size == SIZE
        assert picture.info["loop"] == 0
        durations = [frame.info["duration"] for frame in ImageSequence.Iterator(picture)]
    assert sum(durations) == pytest.approx(2000 * GAIT.step_time, abs=10)
    assert max(durations) <= 50  # [ms]


def test_the_last_frame_leads_to_the_first(gif):
    """It is as far from it as any frame from the next; half a stride is farther."""
    with Image.open(gif) as picture:
        frames = [np.asarray(f.convert("RGB"), float) for f in ImageSequence.Iterator(picture)]
    n = len(frames)
    steps = [abs(frames[k] - frames[(k + 1) % n]).mean() for k in range(n)]
    assert min(steps) > 0
    assert steps[-1] < 1.2 * max(steps[:-1])
    stage, walker = stage_for([Walker(GAIT)], "quarter", SIZE), Walker(GAIT)
    np.testing.assert_allclose(stage.draw(walker, 0.0), stage.draw(walker, 1.0), atol=20)


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize(
    "gait",
    [
        GAIT,
        loaded((0.0, 0.75, 0.0)),
        loaded((0.0, 0.0, 0.6)),
        loaded((0.0, 0.2, 0.0), (1.6, 0.1, 0.1)),
    ],
    ids=["nothing", "on the head", "far in front", "across"],
)
def test_body_and_load_are_inside_the_picture_of_every_view(gait, view):
    shown = seen_pixels(Walker(gait), view)
    assert shown.any()
    rim = np.concatenate([shown[0], shown[-1], shown[:, 0], shown[:, -1]])
    assert not rim.any()
    rows, columns = np.nonzero(shown)
    height, width = shown.shape
    assert max(np.ptp(rows) / height, np.ptp(columns) / width) > 0.6  # and it is not lost in it


@pytest.mark.parametrize(
    "position", [(0, 0.05, -0.22), (0, 0, 0.25), (0, 0.75, 0), (0, -0.3, 0.4), (0, 0, 0)]
)
def test_a_load_is_seen(position):
    gait = loaded(position)
    parts = drawn_parts(gait.body)
    walker = Walker(gait)
    of_part = np.repeat(np.arange(len(parts)), [len(part.mesh.faces) for part in parts])
    stage = stage_for([walker], "side", (120, 160))
    camera = stage.camera
    found = seen(
        camera.project(walker.placed(0.1)[0]), walker.surface.faces, camera.width, camera.height
    )
    mine = [parts[k].name.startswith(LOAD) for k in of_part[found.face]]
    assert np.mean(mine) > 0.05


def test_a_heavy_person_is_wider_and_no_woman_is_a_scaled_man():
    def breadth(walker, view):
        shown = seen_pixels(walker, view)
        rows, _ = np.nonzero(shown)
        return shown.sum() / np.ptp(rows) ** 2

    for view in ("side", "front"):
        light, usual, heavy = (
            breadth(somebody(sex="female", stature=1.6, mass=mass), view) for mass in (45, 60, 130)
        )
        assert 1.05 * light < usual < heavy / 1.2
    man = somebody(sex="male", stature=1.7, mass=70.0).surface
    woman = somebody(sex="female", stature=1.7, mass=70.0).surface
    assert len(man.vertices) != len(woman.vertices)


def test_what_is_nearer_hides_what_is_behind_it():
    far, near = 3.0, 2.0
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=float)
    away = np.array([0.0, 0.0, -1.0])
    points = np.concatenate([square + far * away, square / 4 + near * away])
    camera = Camera(np.zeros(3), away, 60, 60, 0.5)
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    for order in (faces, faces[::-1]):
        found = seen(camera.project(points), order, 60, 60)
        assert len(np.unique(found.pixel)) == len(found.pixel)
        small = np.isin(order[found.face], [4, 5, 6, 7]).all(axis=1)
        assert small.sum() == pytest.approx((60 * 0.5 / near / 2 * 2) ** 2, rel=0.15)
        assert len(found.pixel) > 3 * small.sum()
        assert (found.weights >= 0).all()
    assert len(seen(camera.project(points), faces[:, ::-1], 60, 60).pixel) == 0  # from behind


def test_shadows_are_softened_and_read_between_cells_as_scipy_does():
    """Within an edge of nothing, as shadows have; scipy cuts its Gaussian off at four widths."""
    rng = np.random.default_rng(0)
    dark = np.pad(rng.random((20, 30)), 12).astype(np.float32)
    expected = ndimage.gaussian_filter(dark, picture._SOFT)
    found = picture._softened(dark)
    np.testing.assert_allclose(found, expected, atol=1e-4)
    places = rng.uniform(0.0, np.array([[43.0], [53.0]]), (2, 200))
    between = ndimage.map_coordinates(found, places, order=1)
    np.testing.assert_allclose(picture._between(found, *places), between, atol=1e-12)


def test_a_film_says_which_walk_it_shows_and_that_it_is_none(gif, tmp_path):
    with Image.open(gif) as picture:
        assert gait_digest(GAIT) in picture.info["comment"].decode()
    still = film(FAILED, tmp_path / "walk.png", size=SIZE)
    assert is_ours(still)
    with Image.open(still) as picture:
        assert gait_digest(FAILED) in picture.text["Comment"]
        assert "This is no walk" in picture.text["Comment"]
        assert RED in {colour for _, colour in picture.convert("RGB").getcolors(1 << 20)}
    with Image.open(gif) as picture:
        assert RED not in {colour for _, colour in picture.convert("RGB").getcolors(1 << 20)}


@pytest.mark.usefixtures("few_frames")
def test_every_frame_of_what_is_no_walk_says_so(tmp_path):
    with Image.open(film(FAILED, tmp_path / "walk.gif", size=SIZE)) as picture:
        for frame in ImageSequence.Iterator(picture):
            foot = np.asarray(frame.convert("RGB"), float)[-3:]
            assert abs(foot - RED).max() < 40


@pytest.mark.parametrize("size", [(64, 64), (64, 300), (640, 64), (65, 77)])
@pytest.mark.usefixtures("few_frames")
def test_a_picture_has_the_size_that_was_asked_for_with_a_warning_in_it_or_without(tmp_path, size):
    for name, gait in (("walk", GAIT), ("none", FAILED)):
        with Image.open(film(gait, tmp_path / f"{name}.gif", size=size)) as picture:
            assert picture.size == size


@pytest.mark.usefixtures("few_frames")
def test_two_walkers_stand_beside_each_other(tmp_path):
    both = film(GAIT, tmp_path / "both.gif", size=(160, 100), second=guessed_gait(18.1))
    with Image.open(both) as picture:
        assert picture.size == (160, 100)
        left, right = np.split(np.asarray(picture.convert("RGB"), float), 2, axis=1)
    assert abs(left - right).mean() > 1


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "result").mkdir()
    save_gait(GAIT, tmp_path / "result")
    return tmp_path / "result"


@pytest.mark.usefixtures("few_frames")
def test_the_command_writes_beside_the_result_and_a_new_result_removes_it(folder, capsys):
    assert cli.run(["film", str(folder), "--size", "64x80"]) == 0
    assert capsys.readouterr().out == f"wrote {folder / 'walk.gif'}\n"
    assert is_ours(folder / "walk.gif")
    (folder / "walk.gif").write_bytes(b"GIF89a of my holidays")
    assert cli.run(["film", str(folder), "--size", "64x80"]) == 2
    assert "walk.gif: is in the way" in capsys.readouterr().err
    assert (folder / "walk.gif").is_file()
    assert set(names.FILMS) <= set(names.result_files(()))
    assert names.FILM == "walk.gif"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--out", "walk.avi"], "walk.avi: a film ends in .gif, .mp4 or .png"),
        (["--out", "walk"], "walk: a film ends in .gif, .mp4 or .png"),
        (["--view", "top"], "--view = 'top': must be side, front, quarter"),
        (["--size", "480"], "--size = '480': must be WIDTHxHEIGHT in pixels, as 480x600"),
        (["--size", "9x9"], "--size = 9x9: both must be from 64 to 1920 pixels"),
        (["--size", "99999x600"], "--size = 99999x600: both must be"),
        (["nowhere"], "nowhere: no result here"),
        (["--out", "/dev/null/walk.gif", "--size", "64x64"], "cannot be written: Not a directory"),
    ],
)
def test_what_cannot_be_filmed_is_told_in_one_line(folder, capsys, arguments, words):
    assert cli.run(["film", str(folder), *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert words in line


def test_without_an_encoder_it_says_how_to_get_one_before_it_draws(folder, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setattr(encoder.shutil, "which", lambda _: None)
    monkeypatch.setattr(Walker, "placed", pytest.fail)
    assert cli.run(["film", str(folder), "--out", str(folder / "a.mp4")]) == 2
    assert "needs an encoder: install human-gait[film] or ffmpeg" in capsys.readouterr().err


@pytest.mark.usefixtures("few_frames")
def test_an_encoder_that_fails_is_told_and_nothing_is_left(folder, tmp_path, monkeypatch):
    broken = tmp_path / "ffmpeg"
    broken.write_text("#!/bin/sh\necho no such codec >&2\nexit 3\n")
    broken.chmod(0o755)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setattr(encoder.shutil, "which", lambda _: str(broken))
    with pytest.raises(hg.ResultError, match="no such codec"):
        film(folder, folder / "walk.mp4", size=(64, 64))
    assert {path.name for path in folder.iterdir()} == {names.GAIT_FILE}


@pytest.mark.usefixtures("few_frames")
def test_an_mp4_has_some_strides(tmp_path):
    program = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    path = film(GAIT, tmp_path / "walk.mp4", size=(65, 81))
    told = subprocess.run([program, "-i", path], capture_output=True, text=True, check=False).stderr
    assert is_ours(path)
    assert "64x80" in told
    assert gait_digest(GAIT) in told
    assert "Duration: 00:00:08" in told or "Duration: 00:00:09" in told


def test_the_still_of_a_page_is_small():
    for gaits in ([GAIT], [GAIT, guessed_gait(18.1)]):
        address = still_address(gaits)
        assert address.startswith("data:image/png;base64,")
        assert len(address) < 60_000


def test_the_same_walk_gives_the_same_picture():
    walker = Walker(GAIT)
    stage = stage_for([walker], "side", SIZE)
    once, again = (downscaled(stage.draw(Walker(GAIT), 0.3)) for _ in range(2))
    np.testing.assert_array_equal(once, again)
