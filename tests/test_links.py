import numpy as np
import pytest
from bodies import BODIES, LOADED, MALE
from scipy.spatial import ConvexHull

from human_gait.body import dh, skeleton
from human_gait.body.person import make_body
from human_gait.scenario import Load


def _in_world(body, foot):
    _, A = dh.frames(body.table, np.zeros(55))
    links = A[foot.links]
    return np.einsum("snij,snj->sni", links[..., :3, :3], foot.points) + links[..., :3, 3]


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_all_foot_points_lie_in_the_plane_of_the_sole(body):
    lengths = body.measures.lengths
    sole = -(lengths["L_th"] + lengths["L_sh"] + lengths["h_ank"])
    for foot in (body.contact, body.outline):
        np.testing.assert_allclose(_in_world(body, foot)[..., 1], sole, atol=1e-15)


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_the_feet_are_mirror_images_as_long_as_the_foot(body):
    for foot in (body.contact, body.outline):
        right, left = _in_world(body, foot)
        np.testing.assert_allclose(right * [-1, 1, 1], left, atol=1e-15)
        lengths = body.measures.lengths
        length = lengths["L_heel"] + lengths["L_f"] + lengths["L_toe"]
        assert np.ptp(right[:, 2]) == pytest.approx(length)


def test_medial_points_are_nearer_to_the_midline():
    names = MALE.contact.names
    x = np.abs(_in_world(MALE, MALE.contact)[..., 0])
    assert np.all(x[:, names.index("ball_medial")] < x[:, names.index("ball_lateral")])


def test_the_outline_goes_around_a_convex_sole_that_holds_the_contact_points():
    outline = _in_world(MALE, MALE.outline)[..., [0, 2]]
    contact = _in_world(MALE, MALE.contact)[..., [0, 2]]
    for corners, points in zip(outline, contact, strict=True):
        hull = ConvexHull(corners)
        assert len(hull.vertices) == len(corners)
        steps = np.diff(hull.vertices) % len(corners)
        assert len(set(steps)) == 1
        inside = hull.equations[:, :2] @ points.T + hull.equations[:, 2:]
        assert np.all(inside <= 1e-12)


def test_the_load_hangs_where_the_scenario_puts_it():
    thorax = skeleton.SEGMENTS["thorax"]
    P, A = dh.frames(LOADED.table, np.zeros(55))
    centre = A[thorax, :3, :3] @ LOADED.load_com + A[thorax, :3, 3]
    np.testing.assert_allclose(centre - P[thorax, :3, 3], LOADED.load.position, atol=1e-14)
    turned = A[thorax, :3, :3] @ LOADED.load_inertia @ A[thorax, :3, :3].T
    x, y, z = np.square(LOADED.load.size)
    expected = LOADED.load.mass / 12 * np.diag([y + z, x + z, x + y])
    np.testing.assert_allclose(turned, expected, atol=1e-14)


def test_pseudo_inertia_adds_the_load_to_the_thorax_alone():
    more = LOADED.pseudo_inertia() - MALE.pseudo_inertia()
    assert np.flatnonzero(np.abs(more).max(axis=(1, 2))).tolist() == [skeleton.SEGMENTS["thorax"]]
    assert more[:, 3, 3].sum() == pytest.approx(LOADED.load.mass)
    assert LOADED.total_mass == pytest.approx(78.4 + LOADED.load.mass)


def test_pseudo_inertia_gives_the_inertia_back():
    """I about the frame = tr(S) 1 - S, by the parallel axis theorem I_c + m (c.c 1 - c c^T)."""
    for J, m, c, inertia in zip(
        MALE.pseudo_inertia(), MALE.mass, MALE.com, MALE.inertia, strict=True
    ):
        S = J[:3, :3]
        about_frame = inertia + m * (c @ c * np.eye(3) - np.outer(c, c))
        np.testing.assert_allclose(np.trace(S) * np.eye(3) - S, about_frame, atol=1e-15)


def test_every_tip_of_the_tree_has_mass():
    """Else the mass matrix would be singular."""
    tips = set(range(55)) - set(skeleton.PARENT.tolist())
    assert all(MALE.mass[tip] > 0 for tip in tips)


def test_no_load_is_the_default():
    body = make_body(MALE.subject)
    assert body.load == Load()
    np.testing.assert_array_equal(body.pseudo_inertia(), MALE.pseudo_inertia())
