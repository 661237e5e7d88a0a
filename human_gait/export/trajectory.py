"""The walk as a joint trajectory of the URDF, for robot programs: CSV, JSON, and for controllers.

The messages have the layout of ROS 2's ``trajectory_msgs/JointTrajectory``. Joints are those of the
URDF (`urdf`), in its axes (x left, y up, z forward); efforts are the net joint torques.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import BRANCHES, N_DOF
from human_gait.body.urdf import JOINT_NAMES
from human_gait.export.notes import Note
from human_gait.export.ranges import JointRanges
from human_gait.export.rules import check_numbers
from human_gait.export.tables import save_csv
from human_gait.results.names import TRAJECTORY_CONTROLLER
from human_gait.walk.gait import Samples

_FIELDS = {"positions": "q", "velocities": "v", "accelerations": "a", "effort": "tau"}
_SINGULAR = {"positions": "position", "velocities": "velocity", "accelerations": "acceleration"}
_NANOSECONDS = 1_000_000_000
_DRIVEN = [i for i in range(N_DOF) if i not in BRANCHES["virtual"]]
_LEAD, _RUN_OUT = 2.0, 0.5  # [s], to get into the first posture, and to come to rest after the last

_FOR_VIEWING = (
    "One stride as a message trajectory_msgs/JointTrajectory, for viewing and computing: its first "
    "point is at t = 0, its last one moves, and the first six joints are the pelvis, which nothing "
    f"drives. Controllers take {TRAJECTORY_CONTROLLER}."
)
_FOR_CONTROLLERS = (
    "One stride as a message trajectory_msgs/msg/JointTrajectory, as controllers take it: without",
    "the six joints of the pelvis, which nothing drives, and without effort, which",
    "joint_trajectory_controller refuses unless it commands it. The first posture, left heel",
    f"strike, is to be reached {_LEAD:g} s after the start, and the joints come to rest within",
    f"{_RUN_OUT:g} s after the stride, since most controllers refuse an end that moves.",
    "Nothing here keeps a body upright.",
    "ros2 topic pub --once /joint_trajectory_controller/joint_trajectory \\",
    f"  trajectory_msgs/msg/JointTrajectory --yaml-file {TRAJECTORY_CONTROLLER}",
)


def save_trajectory_csv(now: Samples, path: Path) -> None:
    """Write time [s] and ``<joint>/position``, ``/velocity``, ``/acceleration``, ``/effort``.

    Units are rad, N m, for the three translations of the pelvis m, N, and rates per second.
    """
    columns = {"time_s": now.t}
    for field, attribute in _FIELDS.items():
        quantity = _SINGULAR.get(field, field)
        names = [f"{joint}/{quantity}" for joint in JOINT_NAMES]
        columns |= dict(zip(names, getattr(now, attribute).T, strict=True))
    save_csv(columns, path)


def save_trajectory_json(now: Samples, about: Mapping[str, Any], path: Path) -> None:
    """Write the trajectory as a message, in SI units; what else there is to say comes after it."""
    values = {field: getattr(now, name) for field, name in _FIELDS.items()}
    check_numbers(path.name, values)
    content = {**_message(JOINT_NAMES, now.t, values), "note": _FOR_VIEWING, **about}
    path.write_text(json.dumps(content) + "\n", encoding="utf-8")


def save_controller_trajectory(now: Samples, ranges: JointRanges, note: Note, path: Path) -> None:
    """Write the trajectory as controllers take it: a message as YAML, whose comments tell the rest.

    The joints stop half as far on as their last velocity would take them, within their ranges.
    """
    values = {name: getattr(now, _FIELDS[name])[:, _DRIVEN] for name in list(_FIELDS)[:3]}
    check_numbers(path.name, values)
    rest = values["positions"][-1] + values["velocities"][-1] * _RUN_OUT / 2
    rest = np.clip(rest, ranges.lower[_DRIVEN], ranges.upper[_DRIVEN])
    values = {name: np.vstack([x, np.zeros(len(_DRIVEN))]) for name, x in values.items()}
    values["positions"][-1] = rest
    t = np.append(now.t, now.t[-1] + _RUN_OUT) + _LEAD
    message = _message([JOINT_NAMES[i] for i in _DRIVEN], t, values)
    points = [f"- {_yaml(point)}" for point in message.pop("points")]
    rest_of_it = [f"{key}: {json.dumps(value)}" for key, value in message.items()]
    comments = [f"# {line}" for line in (*note.lines(), *_FOR_CONTROLLERS)]
    lines = [*comments, *rest_of_it, "points:", *points, ""]
    path.write_text("\n".join(lines), encoding="utf-8")


def _yaml(point: Mapping[str, Any]) -> str:
    """Return a point as JSON that is YAML, too, to which 1e-05 is a text and 1.0e-05 a number."""
    return re.sub(r"(?<![\w.])(-?\d+)e", r"\1.0e", json.dumps(point))


def _message(
    joints: Sequence[str], t: FloatArray, values: Mapping[str, FloatArray]
) -> dict[str, Any]:
    """Return the message of values (K, n) by field at times t (K,)."""
    rows = {field: (x + 0.0).tolist() for field, x in values.items()}
    points = [
        {field: rows[field][k] for field in rows} | {"time_from_start": _stamp(time)}
        for k, time in enumerate(t.tolist())
    ]
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "world"}
    return {"header": header, "joint_names": list(joints), "points": points}


def _stamp(time: float) -> dict[str, int]:
    sec, nanosec = divmod(int(np.rint(time * _NANOSECONDS)), _NANOSECONDS)
    return {"sec": sec, "nanosec": nanosec}
