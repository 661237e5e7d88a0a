import base64
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
import umsgpack
from walking import guessed_gait

from human_gait.body import dh
from human_gait.body.skeleton import GRAVITY, SIDES_IN_WORDS, index
from human_gait.playback.drawn_body import torque_sizes
from human_gait.playback.forces import ARROW_HEAD
from human_gait.playback.ground import support_polygons
from human_gait.playback.looks import ARROW_LENGTH
from human_gait.playback.scene import FRAMES_PER_STEP, scene_commands, stride_of
from human_gait.playback.shapes import rounded

SINGLE = 2e-6  # rounding of numbers of a few metres to single precision

GAIT = guessed_gait()
PATH = "/human_gait/first/path"


class Scene:
    """What MeshCat is told, by path."""

    def __init__(self, *gaits):
        packed = scene_commands([stride_of(gait) for gait in gaits])
        self.commands = [umsgpack.unpackb(base64.b64decode(command)) for command in packed]
        (self.animation,) = [c for c in self.commands if c["type"] == "set_animation"]
        self.clips = {a["path"]: a["clip"] for a in self.animation["animations"]}
        self.objects = {c["path"]: c["object"] for c in self.commands if c["type"] == "set_object"}

    def track(self, path, name):
        (track,) = [t for t in self.clips[path]["tracks"] if t["name"] == "." + name]
        return np.array([key["value"] for key in track["keys"]])

    def geometry(self, path):
        return self.objects[path]["geometries"][0]


def array(packed, dtype, width):
    return np.frombuffer(packed["array"].data, dtype=dtype).reshape(-1, width)


def mesh(geometry):
    data = geometry["data"]
    vertices = array(data["attributes"]["position"], np.float32, 3)
    return vertices, array(data["index"], np.uint32, 3)


@pytest.fixture(scope="module")
def scene():
    return Scene(GAIT)


@pytest.fixture(scope="module")
def instants():
    times = np.linspace(GAIT.step_time, 3 * GAIT.step_time, 2 * FRAMES_PER_STEP + 1)
    return GAIT.instants(times)


def rotated(quaternions, vectors):
    return np.array(
        [pin.Quaternion(*q[[3, 0, 1, 2]]) * v for q, v in zip(quaternions, vectors, strict=True)]
    )


def test_everything_exists_before_it_is_animated(scene):
    assert scene.commands[-1]["type"] == "set_animation"
    parts = set(scene.objects)
    for path in scene.clips:
        assert any(f"{part}/".startswith(path + "/") for part in parts), path


def test_every_track_lasts_one_stride_for_ever_and_waits_for_the_page(scene):
    for clip in scene.clips.values():
        for track in clip["tracks"]:
            times = np.array([key["time"] / clip["fps"] for key in track["keys"]])
            assert (times[0], times[-1]) == (0.0, 1.0)
            assert (np.diff(times) > 0).all()
    assert scene.animation["options"] == {"play": False, "repetitions": float("inf")}


def test_up_is_up_and_left_is_left_in_meshcat(scene):
    (turn,) = [c for c in scene.commands if c.get("path") == "/human_gait" and "matrix" in c]
    matrix = np.reshape(turn["matrix"], (4, 4)).T
    np.testing.assert_allclose(matrix[:3, :3] @ [0, 1, 0], [0, 0, 1])
    assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1.0)


def test_the_links_are_where_the_dh_frames_are(scene, instants):
    names = list(GAIT.body.pinocchio_model().names)
    _, A = dh.frames(GAIT.body.table, instants.q)
    U = A @ dh.inverse(dh.link_to_dh(GAIT.body.table))
    drawn = [path for path in scene.clips if path.startswith(PATH + "/body/")]
    assert len(drawn) > 20
    for path in drawn:
        expected = U[:, names.index(path.rsplit("/", 1)[1]) - 1]
        np.testing.assert_allclose(scene.track(path, "position"), expected[:, :3, 3], atol=SINGLE)
        turned = rotated(scene.track(path, "quaternion"), np.tile([1.0, 2.0, 3.0], (len(U), 1)))
        np.testing.assert_allclose(turned, expected[:, :3, :3] @ [1.0, 2.0, 3.0], atol=1e-5)


def test_the_zmp_marker_is_at_the_zmp(scene, instants):
    np.testing.assert_allclose(scene.track(PATH + "/zmp", "position"), instants.zmp, atol=SINGLE)


def test_an_arrow_is_the_force_at_its_centre_of_pressure(scene, instants):
    subject = GAIT.body.subject
    unit = ARROW_LENGTH * subject.stature / (subject.mass * GRAVITY)
    for f, name in enumerate(SIDES_IN_WORDS):
        path = f"{PATH}/ground_reaction/{name}"
        shown = scene.track(path, "visible")
        shaft = scene.track(path + "/shaft", "scale")[:, 1]
        tip = scene.track(path + "/tip", "scale")
        length = shaft + ARROW_HEAD * subject.stature * tip[:, 1]
        drawn = rotated(scene.track(path, "quaternion"), np.outer(length, [0.0, 1.0, 0.0]))
        np.testing.assert_allclose(drawn[shown], unit * instants.grf[shown, f], atol=1e-5)
        start = scene.track(path, "position")
        np.testing.assert_allclose(start[shown], instants.cop[shown, f], atol=SINGLE)
        np.testing.assert_allclose(scene.track(path + "/tip", "position")[:, 1], shaft)
        assert (np.ptp(tip, axis=1) == 0).all()
        assert 0 < tip.min() < tip.max() == 1


def test_a_foot_in_the_air_has_no_arrow_and_its_hidden_arrow_stays_by_the_walker(scene, instants):
    for f, name in enumerate(SIDES_IN_WORDS):
        path = f"{PATH}/ground_reaction/{name}"
        unloaded = instants.grf[:, f, 1] == 0
        assert unloaded.any()
        assert not scene.track(path, "visible")[unloaded].any()
        assert np.isin(scene.track(path, "position"), instants.cop[:, f].astype(np.float32)).all()


def test_the_walker_stays_in_view_and_every_stride_looks_the_same(scene):
    slide = scene.track(PATH, "position")
    pelvis = scene.track(PATH + "/body/j06_pelvis_ry", "position")
    assert np.abs((pelvis + slide)[:, 2]).max() < GAIT.step_length
    np.testing.assert_allclose((pelvis + slide)[-1], (pelvis + slide)[0], atol=1e-5)
    np.testing.assert_allclose(slide[-1] - slide[0], [0, 0, -2 * GAIT.step_length], atol=1e-5)


def test_the_footholds_are_those_of_the_plan_again_and_again(scene):
    for step in (0, 1, 5, -2):
        side, outline = GAIT.plan.outline(step)
        vertices, _ = mesh(scene.geometry(f"{PATH}/footholds/{SIDES_IN_WORDS[side]}"))
        away = np.linalg.norm(vertices[None] - outline[:, None], axis=-1).min(axis=1)
        assert away.max() < 1e-5


def test_the_ground_looks_up(scene):
    for name in ("ground/plane", "ground/tiles", "footholds/right", "footholds/left"):
        vertices, faces = mesh(scene.geometry(f"{PATH}/{name}"))
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        assert np.ptp(vertices[:, 1]) == 0
        assert len(set(np.sign(np.cross(b - a, c - a)[:, 1]))) == 1


def test_the_parts_of_the_body_are_closed_and_face_outward(scene):
    volumes = [volume(g) for g in body_geometries(scene) if g["type"] == "BufferGeometry"]
    assert min(volumes) > 0
    assert 0.04 < sum(volumes) < 0.2  # [m^3]: a person, parts overlapping


def test_balls_are_joined_to_their_hull():
    """Capsule: a cylinder between two half balls, which polyhedra fill from inside."""
    radius, length = 0.1, 0.3
    joined = rounded(np.array([[0, 0, 0], [0, length, 0]]), radius)
    exact = np.pi * radius**2 * (length + 4 / 3 * radius)
    filled = np.linalg.det(joined.vertices[joined.faces].astype(float)).sum() / 6
    assert 0.97 * exact < filled < exact


def body_geometries(scene):
    return [scene.geometry(path) for path in scene.objects if path.startswith(PATH + "/body/")]


def volume(geometry):
    vertices, faces = mesh(geometry)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    assert {tuple(edge) for edge in edges} == {tuple(edge) for edge in edges[:, ::-1]}
    return np.linalg.det(vertices[faces].astype(float)).sum() / 6


def backpack(scene):
    return {
        path.split("/backpack/")[1]: scene.geometry(path)
        for path in scene.objects
        if "/backpack/" in path
    }


def test_a_backpack_is_drawn_only_if_it_has_mass(scene):
    assert not backpack(scene)
    drawn = backpack(Scene(guessed_gait(18.1)))
    assert {"pack", "strap_left", "strap_right"} <= set(drawn)
    box = guessed_gait(18.1).body.load.size
    rounded_off = volume(drawn["pack"]) / np.prod(box)
    assert 0.9 < rounded_off < 1.0
    assert min(volume(part) for part in drawn.values()) > 0


def test_the_straps_mirror_each_other_and_pass_the_neck():
    loaded = Scene(guessed_gait(18.1))
    left, right = (mesh(backpack(loaded)[f"strap_{side}"])[0] for side in ("left", "right"))
    across = np.concatenate([left, right]).mean(axis=0) - left.mean(axis=0)
    apart = np.linalg.norm(across) * 2
    assert 0.1 < apart < 0.4  # [m]
    assert np.ptp(left, axis=0) == pytest.approx(np.ptp(right, axis=0), abs=0.01)


def test_one_support_polygon_is_shown_at_a_time_and_it_is_that_of_the_plan(scene):
    node = PATH + "/support"
    shown = {path: scene.clips[path]["tracks"][0]["keys"] for path in scene.clips if node in path}
    for phase in np.linspace(0.003, 0.997, 50):
        step, within = divmod(2 * phase, 1)  # steps from t = T on: the first of them is mirrored
        corners = GAIT.plan.support_polygon(within * GAIT.step_time)
        expected = corners * ([1, 1] if step else [-1, 1]) + [0, (step + 1) * GAIT.step_length]
        (path,) = [
            path
            for path, keys in shown.items()
            if [key["value"] for key in keys if key["time"] <= phase][-1]
        ]
        vertices, _ = mesh(scene.geometry(path))
        away = np.linalg.norm(vertices[None, :, [0, 2]] - expected[:, None], axis=-1)
        assert away.min(axis=0).max() < 1e-5
        assert away.min(axis=1).max() < 1e-5


def test_the_support_polygons_follow_one_another_without_a_gap():
    spans = [(start, end) for start, end, _ in support_polygons(GAIT)]
    assert (spans[0][0], spans[-1][1]) == (0.0, 1.0)
    assert all(before[1] == after[0] for before, after in pairwise(spans))


def test_a_segment_has_the_torque_of_the_joint_above_it(instants):
    sizes = torque_sizes(instants.tau)
    knee = instants.tau[:, index("knee_flexion_r")]
    np.testing.assert_allclose(sizes[joint_name("knee_flexion_r")], abs(knee))
    hip = instants.tau[:, [index(f"hip_{axis}_r") for axis in ("flexion", "abduction", "rotation")]]
    np.testing.assert_allclose(sizes[joint_name("hip_rotation_r")], np.linalg.norm(hip, axis=1))
    assert joint_name("pelvis_ry") not in sizes
    total = sum(size**2 for size in sizes.values())
    np.testing.assert_allclose(total, (instants.tau[:, 6:] ** 2).sum(axis=1))  # none is lost


def joint_name(dof):
    return f"j{index(dof) + 1:02d}_{dof}"


def test_every_segment_with_a_torque_is_drawn_under_its_name(scene, instants):
    drawn = {path.split("/body/")[1].split("/")[0] for path in scene.objects if "/body/" in path}
    assert set(torque_sizes(instants.tau)) == drawn - {joint_name("pelvis_ry")}


def test_two_walkers_are_both_there_on_one_height_with_one_set_of_lights(scene):
    both = Scene(GAIT, guessed_gait(18.1))
    second = [path for path in both.objects if path.startswith("/human_gait/second/")]
    assert len(second) > len([path for path in scene.objects if path.startswith(PATH)])
    own = {path: clip for path, clip in both.clips.items() if path.startswith(PATH)}
    assert own == scene.clips  # the other one changes nothing
    lights = [path for path in both.objects if path.startswith("/Lights/")]
    assert lights == [path for path in scene.objects if path.startswith("/Lights/")]
    assert len([c for c in both.commands if c.get("path") == "/human_gait"]) == 1
