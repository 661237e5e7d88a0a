"""The walk as a joint trajectory of the URDF, for robot programs: CSV and JSON.

The JSON has the layout of the ROS message ``trajectory_msgs/JointTrajectory``. Joints are those of
the URDF (`urdf`), in its axes (x left, y up, z forward); efforts are the net joint torques.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from human_gait.body.urdf import JOINT_NAMES
from human_gait.export.tables import save_csv
from human_gait.walk.gait import Samples

_FIELDS = {"positions": "q", "velocities": "v", "accelerations": "a", "effort": "tau"}
_SINGULAR = {"positions": "position", "velocities": "velocity", "accelerations": "acceleration"}
_NANOSECONDS = 1_000_000_000


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


def save_trajectory_json(now: Samples, path: Path) -> None:
    """Write the trajectory in the layout of ``trajectory_msgs/JointTrajectory``, in SI units."""
    values = {field: (getattr(now, name) + 0.0).tolist() for field, name in _FIELDS.items()}
    points = [
        {field: rows[k] for field, rows in values.items()} | {"time_from_start": _stamp(time)}
        for k, time in enumerate(now.t.tolist())
    ]
    content = {
        "header": {"frame_id": "world"},
        "joint_names": list(JOINT_NAMES),
        "points": points,
    }
    path.write_text(json.dumps(content) + "\n", encoding="utf-8")


def _stamp(time: float) -> dict[str, int]:
    sec, nanosec = divmod(int(np.rint(time * _NANOSECONDS)), _NANOSECONDS)
    return {"sec": sec, "nanosec": nanosec}
