"""The body as segments and joints of up to three axes (the pelvis: six), as other programs have it.

The links of the Denavit-Hartenberg table have one degree of freedom each, and most have no mass.
Here those that lead to one segment are one joint: its rotations follow each other about axes that
meet in its centre. In the upright posture q = 0 every axis is an axis of the world, and the frame
of a segment stands in its joint, parallel to the world (anatomical axes: x left, y up, z forward).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.dh import frames
from human_gait.body.links import Links, anatomical_to_link
from human_gait.body.skeleton import N_DOF, PARENT, SEGMENTS
from human_gait.values import Value

WORLD = "ground"
"""What the pelvis hangs on."""


@dataclass(frozen=True, eq=False)
class SegmentJoint(Value):
    """A segment and the joint that it hangs on.

    Attributes
    ----------
    segment, parent : str
        Names of ``skeleton.SEGMENTS``; the parent of the pelvis is ``WORLD``.
    dofs : tuple of int
        Indices of the degrees of freedom, from the parent to the segment.
    axes : (n, 3) array
        Their axes where all of them are zero, in the axes of the parent.
    offset : (3,) array, [m]
        Centre of the joint, from that of the parent's and in the axes of the parent.
    """

    segment: str
    parent: str
    dofs: tuple[int, ...]
    axes: FloatArray
    offset: FloatArray


def segment_joints(body: Links) -> tuple[SegmentJoint, ...]:
    """Return the joints of all segments of a body, parents first."""
    P, _ = frames(body.table, np.zeros(N_DOF))
    segment_of = {link: segment for segment, link in SEGMENTS.items()}
    found = []
    for segment, link in SEGMENTS.items():
        dofs, parent = [link], int(PARENT[link])
        while parent >= 0 and parent not in segment_of:
            dofs.insert(0, parent)
            parent = int(PARENT[parent])
        origin = P[parent, :3, 3] if parent >= 0 else np.zeros(3)
        above = segment_of.get(parent, WORLD)
        axes, offset = np.rint(P[dofs, :3, 2]), np.round(P[link, :3, 3] - origin, 12)
        found.append(SegmentJoint(segment, above, tuple(dofs), axes + 0.0, offset + 0.0))
    return tuple(found)


def segment_frames(body: Links, q: FloatArray) -> FloatArray:
    """Return the frames of the segments in the world, (..., n, 4, 4), at postures q (..., 55)."""
    links = np.array(list(SEGMENTS.values()))
    _, A = frames(body.table, q)
    return np.asarray(A[..., links, :, :] @ anatomical_to_link(body.table)[links])
