import base64

import numpy as np
import pinocchio as pin
import pytest
import umsgpack
from walking import guessed_gait

from human_gait import dh
from human_gait.model import build_model
from human_gait.scene import ARROW_LENGTH, FEET, FRAMES_PER_STEP, scene_commands
from human_gait.skeleton import GRAVITY
from human_gait.urdf import link_to_dh

STRIDES = 2
SINGLE = 2e-6  # rounding of numbers of a few metres to single precision

GAIT = guessed_gait()
PATH = "/human_gait/path"


class Scene:
    """What MeshCat is told, by path."""

    def __init__(self, gait, repetitions=float("inf")):
        packed = scene_commands(gait, STRIDES, repetitions)
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
    frames = 2 * STRIDES * FRAMES_PER_STEP
    return GAIT.instants(np.linspace(0.0, 2 * STRIDES * GAIT.step_time, frames + 1))


def rotated(quaternions, vectors):
    return np.array(
        [pin.Quaternion(*q[[3, 0, 1, 2]]) * v for q, v in zip(quaternions, vectors, strict=True)]
    )


def test_everything_exists_before_it_is_animated(scene):
    assert scene.commands[-1]["type"] == "set_animation"
    parts = set(scene.objects)
    for path in scene.clips:
        assert any(part.startswith(path + "/") for part in parts), path


def test_the_animation_runs_in_real_time_and_for_ever(scene):
    for clip in scene.clips.values():
        for track in clip["tracks"]:
            ends = [track["keys"][k]["time"] / clip["fps"] for k in (0, -1)]
            assert ends == pytest.approx([0.0, 2 * STRIDES * GAIT.step_time])
    assert scene.animation["options"] == {"play": True, "repetitions": float("inf")}


def test_up_is_up_and_left_is_left_in_meshcat(scene):
    (turn,) = [c for c in scene.commands if c.get("path") == "/human_gait" and "matrix" in c]
    matrix = np.reshape(turn["matrix"], (4, 4)).T
    np.testing.assert_allclose(matrix[:3, :3] @ [0, 1, 0], [0, 0, 1])
    assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1.0)


def test_the_links_are_where_the_dh_frames_are(scene, instants):
    names = list(build_model(GAIT.body).names)
    _, A = dh.frames(GAIT.body.table, instants.q)
    U = A @ dh.inverse(link_to_dh(GAIT.body.table))
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
    for f, name in enumerate(FEET):
        path = f"{PATH}/ground_reaction/{name}"
        shown = scene.track(path, "visible")
        length = scene.track(path + "/shaft", "scale")[:, 1]
        drawn = rotated(scene.track(path, "quaternion"), np.outer(length, [0.0, 1.0, 0.0]))
        np.testing.assert_allclose(drawn[shown], unit * instants.grf[shown, f], atol=1e-5)
        start = scene.track(path, "position")
        np.testing.assert_allclose(start[shown], instants.cop[shown, f], atol=SINGLE)
        tip = scene.track(path + "/tip", "position")
        np.testing.assert_allclose(tip[:, 1], length)


def test_a_foot_in_the_air_has_no_arrow_and_its_hidden_arrow_stays_by_the_walker(scene, instants):
    for f, name in enumerate(FEET):
        path = f"{PATH}/ground_reaction/{name}"
        unloaded = instants.grf[:, f, 1] == 0
        assert unloaded.any()
        assert not scene.track(path, "visible")[unloaded].any()
        assert np.isin(scene.track(path, "position"), instants.cop[:, f].astype(np.float32)).all()


def test_the_walker_stays_in_view_and_every_stride_looks_the_same(scene):
    slide = scene.track(PATH, "position")
    pelvis = scene.track(PATH + "/body/j06_pelvis_ry", "position")
    assert np.abs((pelvis + slide)[:, 2]).max() < GAIT.step_length
    per_stride = 2 * FRAMES_PER_STEP
    np.testing.assert_allclose((pelvis + slide)[per_stride], (pelvis + slide)[0], atol=1e-5)
    np.testing.assert_allclose(slide[per_stride], [0.0, 0.0, -2 * GAIT.step_length], atol=1e-5)


def test_the_footholds_are_those_of_the_plan_again_and_again(scene):
    for step in (0, 1, 5, -2):
        side, outline = GAIT.plan.outline(step)
        vertices, _ = mesh(scene.geometry(f"{PATH}/footholds/{FEET[side]}"))
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


def body_geometries(scene):
    return [scene.geometry(path) for path in scene.objects if path.startswith(PATH + "/body/")]


def volume(geometry):
    vertices, faces = mesh(geometry)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    assert {tuple(edge) for edge in edges} == {tuple(edge) for edge in edges[:, ::-1]}
    return np.linalg.det(vertices[faces].astype(float)).sum() / 6


def test_a_backpack_is_drawn_only_if_it_has_mass(scene):
    loaded = Scene(guessed_gait(18.1), repetitions=1)
    assert not [g for g in body_geometries(scene) if g["type"] == "BoxGeometry"]
    (box,) = [g for g in body_geometries(loaded) if g["type"] == "BoxGeometry"]
    size = guessed_gait(18.1).body.load.size
    assert [box["width"], box["height"], box["depth"]] == pytest.approx(size)
    assert loaded.animation["options"]["repetitions"] == 1
