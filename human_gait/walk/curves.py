"""The curves of a gait by name, one at a time or as a table."""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import DOF_NAMES, index
from human_gait.walk.gait import Gait, Samples

if TYPE_CHECKING:
    import pandas as pd

STRIDE_INSTANTS = 201
"""Of one stride: one for each half per cent, both ends included."""

_GLOBAL = 6  # degrees of freedom without a torque
_MOTION = {"": "q", "_velocity": "v", "_acceleration": "a"}
_TORQUES = {"_torque": "tau", "_muscle_torque": "active"}
_ON_FEET = {"grf": "xyz", "cop": "xyz"}

NAMES: tuple[str, ...] = (
    *(f"{dof}{ending}" for ending in _MOTION for dof in DOF_NAMES),
    *(f"{dof}{ending}" for ending in _TORQUES for dof in DOF_NAMES[_GLOBAL:]),
    *(f"{what}_{side}_{axis}" for what, axes in _ON_FEET.items() for side in "rl" for axis in axes),
    *("yaw_moment_r", "yaw_moment_l", "zmp_x", "zmp_z"),
)
"""Names of all curves, in their order in a table."""


def stride_times(gait: Gait) -> FloatArray:
    """Return one stride in even instants, (201,), [s]."""
    return np.linspace(0.0, 2 * gait.step_time, STRIDE_INSTANTS)


def curve(gait: Gait, name: str) -> FloatArray:
    """Return a curve of one stride by its name, (201,).

    Raises
    ------
    KeyError
        If there is no such curve; with the nearest name.
    """
    if name not in NAMES:
        raise KeyError(_unknown(name))
    if name in DOF_NAMES:
        return np.asarray(gait.q(stride_times(gait))[:, index(name)])
    return columns(gait.stride)[name]


def _unknown(name: object) -> str:
    nearest = difflib.get_close_matches(name, NAMES, n=1) if isinstance(name, str) else []
    hint = f"did you mean {nearest[0]}?" if nearest else "gait.keys() lists all"
    return f"no curve is called {name!r}, {hint}"


def columns(now: Samples) -> dict[str, FloatArray]:
    """Return all curves of K samples by name, each (K,), in the order of ``NAMES``."""
    values = [now.q, now.v, now.a, now.tau[:, _GLOBAL:], now.active[:, _GLOBAL:]]
    values += [now.grf.reshape(-1, 6), now.cop.reshape(-1, 6), now.yaw_moment, now.zmp[:, ::2]]
    return dict(zip(NAMES, np.concatenate(values, axis=1).T.copy(), strict=True))


def to_dataframe(gait: Gait, t: npt.ArrayLike | None = None) -> pd.DataFrame:
    """Return all curves at times t (K,) as a table; by default of one stride.

    Raises
    ------
    ImportError
        If pandas is not installed.
    """
    try:
        import pandas as pd  # noqa: PLC0415, an extra
    except ImportError:
        message = "a table needs pandas: pip install 'human-gait[pandas]'"
        raise ImportError(message) from None
    now = gait.stride if t is None else gait.instants(np.atleast_1d(np.asarray(t, dtype=float)))
    return pd.DataFrame(columns(now), index=pd.Index(now.t, name="time"))
