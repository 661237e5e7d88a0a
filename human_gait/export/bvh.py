"""The walk as BVH, for animation programs.

BVH's own axes are those here: y up, the walker faces z, x is to the left. Lengths are in metres.
The rotations of a joint follow each other in the order of their channels, as the degrees of freedom
do: the channels are the degrees of freedom, with a sign where the axis points the other way, and
zeros that complete the three axes that programs expect.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.joints import WORLD, SegmentJoint, segment_joints
from human_gait.body.person import Body
from human_gait.body.skeleton import PRISMATIC
from human_gait.export.rules import check_names, check_numbers

Channel = tuple[str, int, float]
"""A channel's name, its degree of freedom, and the sign; the sign of an unused axis is zero."""

_AXES = "XYZ"
_TIPS = {"head": (1, "L_hd"), "hand": (1, "-L_hn"), "toe": (2, "L_toe")}  # axis and length


def save_bvh(body: Body, q: FloatArray, rate: float, path: Path) -> None:
    """Write postures (K, 55), `rate` a second, as BVH."""
    joints = segment_joints(body)
    lines, channels = ["HIERARCHY"], list[Channel]()
    _add_joint(lines, channels, joints, body, 0)
    lines += ["MOTION", f"Frames: {len(q)}", f"Frame Time: {1.0 / rate:.12g}"]
    dofs, signs = [dof for _, dof, _ in channels], np.array([sign for _, _, sign in channels])
    values = np.where(PRISMATIC, q, np.rad2deg(q))[:, dofs] * signs + 0.0
    check_names(path.name, [joint.segment for joint in joints], r"\s{}")
    check_numbers(path.name, {"MOTION": values})
    lines += [" ".join(f"{x:.10g}" for x in row) for row in values.tolist()]
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")


def _add_joint(
    lines: list[str],
    channels: list[Channel],
    joints: Sequence[SegmentJoint],
    body: Body,
    depth: int,
    at: int = 0,
) -> None:
    """Add a joint and all that hangs on it, in the order of the file."""
    joint, indent = joints[at], "  " * depth
    own = _channels(joint)
    channels += own
    lines += [f"{indent}{'ROOT' if joint.parent == WORLD else 'JOINT'} {joint.segment}"]
    lines += [f"{indent}{{", f"{indent}  OFFSET {_text(joint.offset)}"]
    lines += [f"{indent}  CHANNELS {len(own)} {' '.join(name for name, _, _ in own)}"]
    for i, other in enumerate(joints):
        if other.parent == joint.segment:
            _add_joint(lines, channels, joints, body, depth + 1, i)
    if tip := _TIPS.get(joint.segment.removesuffix("_r").removesuffix("_l")):
        end = np.zeros(3)
        end[tip[0]] = body.measures.length(tip[1])
        lines += [f"{indent}  End Site", f"{indent}  {{"]
        lines += [f"{indent}    OFFSET {_text(end)}", f"{indent}  }}"]
    lines += [f"{indent}}}"]


def _channels(joint: SegmentJoint) -> list[Channel]:
    """Return the channels of a joint: translations, rotations, and the axes that are missing."""
    found = [
        (_AXES[axis] + ("position" if PRISMATIC[dof] else "rotation"), dof, sign)
        for dof, axis, sign in zip(joint.dofs, *_axis_and_sign(joint.axes), strict=True)
    ]
    moved = sorted(channel for channel in found if channel[0].endswith("position"))
    turned = [channel for channel in found if channel not in moved]
    names = [name for name, _, _ in turned]
    still = [f"{axis}rotation" for axis in _AXES if f"{axis}rotation" not in names]
    return moved + turned + [(name, joint.dofs[0], 0.0) for name in still]


def _axis_and_sign(axes: FloatArray) -> tuple[list[int], list[float]]:
    return np.abs(axes).argmax(axis=1).tolist(), axes.sum(axis=1).tolist()


def _text(values: FloatArray) -> str:
    return " ".join(f"{x:.10g}" for x in values.tolist())
