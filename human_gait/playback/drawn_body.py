"""Body and load of a walker in a scene of MeshCat, and the torques above each segment."""

from __future__ import annotations

import numpy as np
from meshcat import Visualizer
from meshcat.animation import Animation
from scipy.spatial.transform import Rotation

from human_gait.arrays import FloatArray
from human_gait.body.person import Body
from human_gait.body.skeleton import BRANCHES, PARENT, SEGMENTS
from human_gait.body.urdf import JOINT_NAMES
from human_gait.playback.drawing import add_track, geometry, matte
from human_gait.playback.parts import drawn_parts, link_poses


def draw_body(node: Visualizer, body: Body) -> None:
    """Draw a walker: parts go below the node, each under the name of its joint."""
    for part in drawn_parts(body):
        drawn = node[f"{JOINT_NAMES[part.link]}/{part.name}"]
        drawn.set_object(geometry(part.mesh), matte(part.colour))


def animate_body(motion: Animation, node: Visualizer, body: Body, q: FloatArray) -> None:
    """Move the parts through the postures (K, 55) of a stride."""
    poses = link_poses(body, q)
    for link in sorted({part.link for part in drawn_parts(body)}):
        joint = node[JOINT_NAMES[link]]
        add_track(motion, joint, "position", poses[:, link, :3, 3])
        turns = Rotation.from_matrix(poses[:, link, :3, :3]).as_quat()
        add_track(motion, joint, "quaternion", _continuous(turns))


def _continuous(quaternions: FloatArray) -> FloatArray:
    """Return quaternions (K, 4) with signs that make each close to the one before."""
    same = np.einsum("ij,ij->i", quaternions[1:], quaternions[:-1]) >= 0
    signs = np.cumprod(np.append(1.0, np.where(same, 1.0, -1.0)))
    return np.asarray(quaternions * signs[:, None])


def torque_sizes(tau: FloatArray) -> dict[str, FloatArray]:
    """Return how large the torques of the joint above each drawn segment are.

    Parameters
    ----------
    tau : (K, 55) array, [N m]
        Joint torques.

    Returns
    -------
    dict of (K,) array, [N m]
        By the name of the segment's node: the root of the sum of squares over the axes of its
        joint. The pelvis has no joint above it.
    """
    return {
        JOINT_NAMES[link]: np.linalg.norm(tau[:, _joint_above(link)], axis=1)
        for link in SEGMENTS.values()
        if link not in BRANCHES["virtual"]
    }


def _joint_above(link: int) -> list[int]:
    """Return the degrees of freedom between a segment and the next one above."""
    dofs = [link]
    while (above := int(PARENT[dofs[-1]])) not in SEGMENTS.values():
        dofs.append(above)
    return dofs
