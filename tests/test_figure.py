from itertools import pairwise

import numpy as np
import pytest
from walking import guessed_gait

from human_gait.body.figure import capsules
from human_gait.body.person import make_body
from human_gait.body.skeleton import SEGMENTS
from human_gait.playback.carried import KINDS, kind_of_load
from human_gait.playback.parts import LOAD, drawn_parts
from human_gait.playback.picture import Walker, stage_for
from human_gait.playback.raster import seen
from human_gait.scenario import Load, Scenario, Subject
from human_gait.walk.gait import Gait

GAIT = guessed_gait()
BOX = (0.30, 0.45, 0.20)


def drawn(**subject):
    body = make_body(Subject.from_table(subject))
    return capsules(body.measures)


def volume(found):
    return sum(
        np.pi * c.radius**2 * (np.linalg.norm(c.ends[1] - c.ends[0]) + 4 / 3 * c.radius)
        for c in found
    )


def carrying(position, size=BOX, **subject):
    return make_body(Subject.from_table(subject), Load(10.0, position, size))


@pytest.mark.parametrize("sex", ["male", "female"])
def test_the_right_side_is_the_mirror_image_of_the_left(sex):
    found = drawn(sex=sex)
    by_side = [[c for c in found if c.segment.endswith(side)] for side in ("_l", "_r")]
    assert len(by_side[0]) == len(by_side[1]) > 10
    left = sorted(by_side[0], key=lambda c: (c.segment, c.radius, c.ends[0, 1]))
    right = sorted(by_side[1], key=lambda c: (c.segment, c.radius, c.ends[0, 1]))
    for one, other in zip(left, right, strict=True):
        assert one.segment[:-2] == other.segment[:-2]
        assert one.radius == other.radius
    middle = sum(c.ends[:, 0].sum() for c in found if not c.segment.endswith(("_l", "_r")))
    assert middle == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("sex", ["male", "female"])
def test_who_is_heavier_is_thicker_everywhere_but_hardly_in_the_face(sex):
    people = [drawn(sex=sex, stature=1.65, mass=mass) for mass in (40.0, 60.0, 90.0, 150.0)]
    for light, heavy in pairwise(people):
        for one, other in zip(light, heavy, strict=True):
            assert one.radius <= other.radius
    growth = {
        segment: max(
            b.radius / a.radius
            for a, b in zip(people[1], people[3], strict=True)
            if a.segment == segment
        )
        for segment in ("head", "thorax", "spine2", "thigh_r", "hand_l")
    }
    assert growth["head"] < growth["hand_l"] < growth["thigh_r"] < growth["spine2"]
    assert growth["head"] < 1.1
    assert growth["spine2"] > 1.6
    assert volume(people[3]) > 1.8 * volume(people[1])


def test_equal_people_of_other_stature_have_the_same_shape():
    short, tall = (drawn(stature=h, mass=78.4 * (h / 1.755) ** 3) for h in (1.5, 2.0))
    for one, other in zip(short, tall, strict=True):
        assert other.radius / one.radius == pytest.approx(2.0 / 1.5)
        np.testing.assert_allclose(other.ends, one.ends * 2.0 / 1.5, atol=1e-12)


def test_a_woman_is_broader_at_the_hips_and_narrower_above_than_a_man_of_her_size():
    def breadth(sex, segment):
        pieces = [c for c in drawn(sex=sex, stature=1.7, mass=70.0) if c.segment == segment]
        return max(c.radius + abs(c.ends[:, 0]).max() for c in pieces)

    waist = [breadth(sex, "spine2") / breadth(sex, "pelvis") for sex in ("male", "female")]
    assert waist[1] < 0.95 * waist[0]
    assert breadth("female", "thorax") < breadth("male", "thorax")


@pytest.mark.parametrize(
    ("position", "size", "kind"),
    [
        ((0.0, 0.05, -0.22), BOX, "backpack"),
        ((0.0, 0.0, -0.3), (0.4, 0.6, 0.3), "backpack"),
        ((0.0, 0.0, 0.25), BOX, "front pack"),
        ((0.0, -0.3, 0.4), (0.4, 0.3, 0.3), "box"),
        ((0.0, 0.05, -0.6), BOX, "box"),
        ((0.0, 0.75, 0.0), BOX, "box on the head"),
        ((0.0, 0.5, 0.02), (0.4, 0.1, 0.4), "box on the head"),
        ((0.0, 0.9, 0.6), BOX, "box"),
        ((0.0, 0.05, 0.0), (0.3, 0.4, 0.25), "vest"),
        ((0.0, 0.2, 0.0), (1.6, 0.1, 0.1), "box"),
    ],
)
def test_a_load_is_what_its_place_and_size_make_it(position, size, kind):
    body = carrying(position, size)
    assert kind_of_load(body) == kind
    assert kind in KINDS
    names = {part.name for part in drawn_parts(body) if part.name.startswith(LOAD)}
    straps = {f"{LOAD}/strap_left", f"{LOAD}/strap_right"}
    assert straps <= names if "pack" in kind else not straps & names


def test_a_box_is_drawn_where_the_scenario_has_it_and_as_large():
    """But for what is on a thorax that is turned: the parts are in the frame of their link."""
    for position in ((0.0, 0.05, -0.3), (0.0, 0.0, 0.3), (0.0, 0.8, 0.0), (0.0, 0.3, 0.35)):
        parts = [p for p in drawn_parts(carrying(position)) if p.name.startswith(f"{LOAD}/")]
        mine = [p for p in parts if p.name.split("/")[1].startswith(("pack", "edge"))]
        corners = np.concatenate([part.mesh.vertices for part in mine])
        extent = np.sort(np.ptp(corners, axis=0))
        np.testing.assert_allclose(extent, sorted(BOX), atol=0.01)


def front_of_the_face(load):
    """How many pixels of the face are seen from the front, at each of two phases."""
    table = GAIT.scenario.to_dict() | ({"load": load} if load else {})
    gait = Gait(Scenario.from_dict(table), GAIT.breaks, GAIT.control_points)
    alone, walker = Walker(GAIT), Walker(gait)
    stage = stage_for([alone], "front", (120, 160))
    camera = stage.camera
    parts = drawn_parts(gait.body)
    of_part = np.repeat(np.arange(len(parts)), [len(part.mesh.faces) for part in parts])
    head = [k for k, part in enumerate(parts) if part.link == SEGMENTS["head"]]
    counts = []
    for phase in (0.1, 0.6):
        vertices, _ = walker.placed(phase)
        faces = walker.surface.faces
        found = seen(camera.project(vertices), faces, camera.width, camera.height)
        counts.append(np.isin(of_part[found.face], head).sum())
    return np.array(counts)


@pytest.mark.parametrize("height", [0.0, 0.2, 0.3])
def test_what_is_carried_in_front_does_not_hide_the_face(height):
    free = front_of_the_face(None)
    load = {"mass": 10.0, "position": [0.0, height, 0.25]}
    assert (front_of_the_face(load) > 0.6 * free).all()
