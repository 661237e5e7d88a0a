"""OpenSim reads its files, moves its model and finds our torques by its own inverse dynamics."""

import os
import subprocess
import sys
from dataclasses import replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from exports import LOADS, from_opensim, joint_centres, marker_places, walking
from solves import solved

from human_gait.body.limits import joint_limits
from human_gait.body.skeleton import DOF_NAMES, SEGMENTS
from human_gait.export.formats import MARGIN, export_gait, sampled
from human_gait.export.markers import marker_set
from human_gait.walk.gait_file import carried_mass

READER = Path(__file__).with_name("opensim_reader.py")
OPENSIM = ("osim", "mot", "grf", "sto")

pytestmark = pytest.mark.skipif(
    find_spec("opensim") is None and not os.environ.get("CI"),
    reason="opensim (70 MB) is not installed: pip install opensim",
)


def read_by_opensim(gait, folder, rate, formats=OPENSIM):
    """An export and all that OpenSim says about it, part by part."""
    export_gait(gait, folder / "export", formats, rate)
    stride = sampled(gait, rate)
    now = stride.padded
    np.savez(folder / "export" / "state.npz", names=DOF_NAMES, v=now.v, a=now.a)
    archive = folder / "found.npz"
    command = [sys.executable, str(READER), str(folder / "export"), str(archive)]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    found = {}
    for name, values in np.load(archive).items():
        part, _, key = name.partition(".")
        found.setdefault(part, {})[key] = values
    parts = {part: SimpleNamespace(**values) for part, values in found.items()}
    return SimpleNamespace(gait=gait, stride=stride, now=now, said=run.stdout + run.stderr, **parts)


@pytest.fixture(scope="module")
def everything(tmp_path_factory):
    """What OpenSim says about a walk, by its load; each is read once."""

    @cache
    def read(load):
        folder = tmp_path_factory.mktemp("opensim")
        return read_by_opensim(walking(load), folder, 50, (*OPENSIM, "trc"))

    return read


@pytest.fixture(params=LOADS)
def found(everything, request):
    return everything(request.param)


def column(table, label):
    return table.values[:, list(table.labels).index(label)]


def test_the_motion_is_that_of_the_gait(found):
    assert list(found.motion.labels) == list(DOF_NAMES)
    np.testing.assert_allclose(found.motion.t, found.now.t, atol=1e-9)
    np.testing.assert_allclose(found.motion.values, found.now.q, atol=1e-9)


def test_the_torques_are_those_of_the_gait(found):
    kinds = ["force" if name.startswith("pelvis_t") else "moment" for name in DOF_NAMES]
    expected = [f"{name}_{kind}" for name, kind in zip(DOF_NAMES, kinds, strict=True)]
    assert list(found.torques.labels) == expected
    np.testing.assert_allclose(found.torques.values, found.now.tau, atol=1e-6)


def test_the_model_is_the_body(found):
    body, model = found.gait.body, found.model
    assert sorted(model.coordinates) == sorted(DOF_NAMES)
    order = [DOF_NAMES.index(name) for name in model.coordinates]
    lower, upper = joint_limits(found.gait.scenario)
    np.testing.assert_allclose(model.lower, lower[order], atol=1e-12)
    np.testing.assert_allclose(model.upper, upper[order], atol=1e-12)
    rigid = body.load.mass > 0 and body.load.model == "rigid"
    assert list(model.bodies) == [*SEGMENTS, *(["backpack"] if rigid else [])]
    assert list(model.markers) == [marker.name for marker in marker_set(body)]
    mass = carried_mass(body).sum() if rigid else body.subject.mass
    assert model.mass == pytest.approx(mass, rel=1e-12)
    np.testing.assert_allclose(model.gravity, [0, -9.81, 0])
    assert "warn" not in found.said.lower()


def test_it_is_drawn_as_the_urdf(found):
    """Balls and cylinders where Pinocchio has those of the URDF; the sense of an axis is free."""
    body = found.gait.body
    model = body.pinocchio_model()
    visual = pin.buildGeomFromUrdfString(model, body.urdf, pin.GeometryType.VISUAL)
    data, drawn = model.createData(), visual.createData()
    pin.updateGeometryPlacements(model, data, visual, drawn, np.zeros(55))
    centres, axes = from_opensim(found.model.centres), np.abs(from_opensim(found.model.axes))
    shown = np.column_stack([centres, found.model.radii, axes])
    expected = [
        (pose, shape.geometry)
        for pose, shape in zip(drawn.oMg, visual.geometryObjects, strict=True)
        if hasattr(shape.geometry, "radius")
    ]
    assert len(shown) == len(expected) > 100
    for pose, shape in expected:
        row = [*pose.translation, shape.radius]
        if hasattr(shape, "halfLength"):
            row += np.abs(pose.rotation[:, 2]).tolist()
        assert np.abs(shown[:, : len(row)] - row).max(axis=1).min() < 1e-9


def test_joints_and_markers_of_the_model_are_pinocchios(found):
    body, q = found.gait.body, found.now.q
    centres = from_opensim(found.computed.bodies)[:, : len(SEGMENTS)]
    np.testing.assert_allclose(centres, joint_centres(body, q), atol=1e-9)
    places = from_opensim(found.computed.markers)
    np.testing.assert_allclose(places, marker_places(body, q), atol=1e-9)


def test_trc_holds_the_markers_of_the_model(found):
    """1e-6 mm: nine digits."""
    assert list(found.trc.labels) == list(found.model.markers)
    assert str(found.trc.units) == "mm"
    np.testing.assert_allclose(found.trc.t, found.stride.samples.t, atol=1e-9)
    places = from_opensim(found.trc.places)
    expected = marker_places(found.gait.body, found.stride.samples.q)
    np.testing.assert_allclose(places, 1000 * expected, atol=1e-5)


def test_the_ground_reaction_is_that_of_the_gait(found):
    for f, side in enumerate("rl"):
        force, place, moment, on_toes = (
            from_opensim(
                np.stack([column(found.ground, f"{name}{axis}") for axis in "xyz"], axis=1)
            )
            for name in (
                f"ground_force_{side}_v",
                f"ground_force_{side}_p",
                f"ground_torque_{side}_",
                f"toe_{side}_force_v",
            )
        )
        np.testing.assert_allclose(force, found.now.grf[:, f], atol=1e-6)
        loaded = force.any(axis=1)
        np.testing.assert_allclose(place[loaded], found.now.cop[loaded, f], atol=1e-9)
        np.testing.assert_allclose(moment[:, 1], found.now.yaw_moment[:, f], atol=1e-6)
        np.testing.assert_allclose(moment[:, [0, 2]], 0)
        share = found.now.toe_share[:, f, None]
        np.testing.assert_allclose(on_toes, share * found.now.grf[:, f], atol=1e-6)


def test_inverse_dynamics_of_opensim_finds_the_torques(found):
    """With the speeds and accelerations of the gait: 1e-6 of each peak; files have 12 digits."""
    peak = np.abs(found.now.tau).max(axis=0)
    off = np.abs(found.computed.tau - found.now.tau).max(axis=0)
    assert (off[6:] / peak[6:]).max() < 1e-6
    assert off[:6].max() < 1e-5  # N, N m: nothing is left for the pelvis to be held by


def tool_error(gait, folder, rate):
    """How far the tool is off within the stride, (49,), of each joint's peak."""
    folder.mkdir()
    found = read_by_opensim(gait, folder, rate)
    labels = [str(label) for label in found.torques.labels]
    order = [list(found.tool.labels).index(label) for label in labels]
    np.testing.assert_allclose(found.tool.t, found.now.t, atol=1e-9)
    stride = slice(int(MARGIN * rate), -int(MARGIN * rate))
    tau = found.now.tau[stride]
    off = np.abs(found.tool.values[stride][:, order] - tau).max(axis=0)
    return (off / np.abs(tau).max(axis=0))[6:]


def test_it_takes_frozen_joints_and_ranges_without_zero(tmp_path):
    """What is frozen is locked, which leaves its torque; a model rests within its ranges."""
    limits = {"frozen": ["neck_upper_rotation"], "knee_flexion_r": [5, 100]}
    gait = walking()
    q = gait.control_points.copy()
    q[:, DOF_NAMES.index("neck_upper_rotation")] = 0.0
    own = replace(gait, scenario=gait.scenario.replace(limits=limits), control_points=q)
    found = read_by_opensim(own, tmp_path, 50, (*OPENSIM, "trc"))
    held = dict(zip(found.model.coordinates, found.model.locked, strict=True))
    assert [name for name, locked in held.items() if locked] == ["neck_upper_rotation"]
    rest = dict(zip(found.model.coordinates, found.model.rest, strict=True))
    assert rest["knee_flexion_r"] == rest["knee_flexion_l"] == pytest.approx(np.deg2rad(5))
    assert rest["hip_flexion_r"] == 0.0
    assert "warn" not in found.said.lower()
    test_inverse_dynamics_of_opensim_finds_the_torques(found)


@pytest.mark.solve
def test_the_inverse_dynamics_tool_finds_the_torques_from_the_files_alone(tmp_path):
    """Within 1 % of each joint's peak, at 1000 Hz.

    The tool differentiates the angles by quintic splines, which round the corners that the
    accelerations of our cubic ones have at their knots: an error in proportion to the time between
    samples. With the accelerations given (above) there is none.
    """
    gait = solved("paper-normal").gait
    coarse, fine = (tool_error(gait, tmp_path / str(rate), rate) for rate in (250, 1000))
    assert fine.max() < 0.01
    assert coarse.max() / fine.max() == pytest.approx(4, rel=0.1)
