"""What the tests of exports share: walks, and where Pinocchio has the segments and the markers."""

from functools import cache

import numpy as np
import pinocchio as pin
from walks import BACKPACK, near_walk, scenario

from human_gait.body.skeleton import SEGMENTS
from human_gait.export.markers import marker_set
from human_gait.problem.program import build_program

LOADS = {
    "no load": {},
    "a rigid backpack": {"load": BACKPACK},
    "a backpack as a force": {"load": {**BACKPACK, "model": "force"}},
}


@cache
def walking(load="no load", noise=0.01):
    """A disturbed guess: every joint moves, and ground and torques are those of its motion."""
    program = build_program(scenario(**LOADS[load]))
    return program.gait(near_walk(program, noise=noise))


def link_poses(body, q):
    """Poses (K, n, 4, 4) of the links of all segments in the world, by Pinocchio.

    Their origins are the centres of the joints.
    """
    model = body.pinocchio_model()
    data = model.createData()
    poses = []
    for posture in q:
        pin.forwardKinematics(model, data, posture)
        poses.append([data.oMi[link + 1].homogeneous for link in SEGMENTS.values()])
    return np.array(poses)


def joint_centres(body, q):
    """Centres (K, n, 3) of the joints of all segments in the world, [m]."""
    return link_poses(body, q)[..., :3, 3]


def marker_places(body, q):
    """Where the markers (K, m, 3) are, [m]: fixed to the links as in the upright posture."""
    upright, now = link_poses(body, np.zeros((1, 55)))[0], link_poses(body, q)
    places = []
    for marker in marker_set(body):
        i = list(SEGMENTS).index(marker.segment)
        at_rest = np.append(upright[i, :3, 3] + marker.position, 1.0)
        places.append(now[:, i] @ np.linalg.inv(upright[i]) @ at_rest)
    return np.stack(places, axis=1)[..., :3]


def from_opensim(vectors):
    """Vectors (..., 3) forward, up, right as left, up, forward."""
    forward, up, right = np.moveaxis(np.asarray(vectors), -1, 0)
    return np.stack([-right, up, forward], axis=-1)
