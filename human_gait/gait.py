"""A gait as a value: the control points of one step and the scenario they belong to."""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from human_gait.body import Body
from human_gait.bspline import DEGREE, Basis
from human_gait.contact_plan import ContactPlan
from human_gait.exceptions import ResultError, ScenarioError
from human_gait.instant import Instants, Walker
from human_gait.scenario import Scenario
from human_gait.skeleton import DOF_NAMES, N_DOF, index, mirror

FloatArray = npt.NDArray[np.float64]

FILE = "gait.npz"
_UNREADABLE = (  # what numpy, zipfile, zlib and json raise at a damaged file
    OSError,
    EOFError,
    ValueError,
    TypeError,
    LookupError,
    RuntimeError,
    MemoryError,
    zipfile.BadZipFile,
    zlib.error,
    ScenarioError,
)
FORMAT = "human_gait gait 1"
_SAMPLES = 201
_FORWARD = index("pelvis_tz")
_ABOUT = """One step of a predicted walk, left heel strike (t = 0) to right heel strike (t = T).
World: y up, z forward, x to the left. SI units, angles in radians.
knots (n+4), control_points (n, 55): cubic B-splines of the 55 joint angles named in dof_names,
q(t) = sum_j N_j,4(t) P_j for 0 <= t <= T; the next step is the mirror image.
Sampled at t: q, v, a, tau (joint torques with ground reaction), active (without passive
torques), zmp (x, y, z), and for the right and the left foot grf, cop (centre of pressure),
yaw_moment and points (heel, ball_medial, ball_lateral, toe).
scenario and solution are JSON."""


@dataclass(frozen=True)
class Samples:
    """A gait at K instants, as plain arrays.

    Attributes
    ----------
    t : (K,) array, [s]
    q, v, a : (K, 55) array, [rad], [m] and their rates
    tau : (K, 55) array, [N m], [N]
        Joint torques with the ground reaction.
    active : (K, 55) array, [N m]
        The part of the muscles: `tau` without the passive torques.
    zmp : (K, 3) array, [m]
    grf : (K, 2, 3) array, [N]
        On the right and on the left foot.
    cop : (K, 2, 3) array, [m]
        Centre of pressure of each foot; without meaning where its force is zero.
    yaw_moment : (K, 2) array, [N m]
        Vertical moment at the centre of pressure of each foot.
    points : (K, 2, 4, 3) array, [m]
        Contact points of the right and of the left foot.
    """

    t: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    tau: FloatArray
    active: FloatArray
    zmp: FloatArray
    grf: FloatArray
    cop: FloatArray
    yaw_moment: FloatArray
    points: FloatArray


@dataclass(frozen=True)
class Gait:
    """The motion of one step, and by mirror symmetry of the whole walk (Eq. 26).

    Attributes
    ----------
    scenario : Scenario
    breaks : (n - 2,) array, [s]
        Where the polynomial pieces meet, 0 to T.
    control_points : (n, 55) array, [rad], [m]
        P_j of Eq. (28).
    solution : mapping
        How it was found: solver, status, cost, wall time, ...
    """

    scenario: Scenario
    breaks: FloatArray
    control_points: FloatArray
    solution: Mapping[str, Any] = field(default_factory=dict)

    @property
    def step_time(self) -> float:
        """T, [s]."""
        return self.scenario.walk.step_time

    @property
    def step_length(self) -> float:
        """L, [m]."""
        return self.scenario.walk.step_length

    @property
    def knots(self) -> FloatArray:
        """Knots of the B-splines, (n + 4,), [s]."""
        return self.basis.knots

    @property
    def body(self) -> Body:
        """The body that walks."""
        return self._walker.body

    @property
    def plan(self) -> ContactPlan:
        """Footholds and phases."""
        return self._walker.plan

    @cached_property
    def basis(self) -> Basis:
        """The basis functions N_j of Eq. (28)."""
        return Basis(self.breaks, self.scenario.discretisation.mirrored)

    @cached_property
    def _walker(self) -> Walker:
        return Walker(self.scenario)

    def q(self, t: npt.ArrayLike) -> FloatArray:
        """Return the posture (55,) or (K, 55) at times t >= 0, [rad] and [m]."""
        return self._motion(t, 0)

    def v(self, t: npt.ArrayLike) -> FloatArray:
        """Return the velocity (55,) or (K, 55) at times t >= 0."""
        return self._motion(t, 1)

    def a(self, t: npt.ArrayLike) -> FloatArray:
        """Return the acceleration (55,) or (K, 55) at times t >= 0."""
        return self._motion(t, 2)

    def tau(self, t: npt.ArrayLike) -> FloatArray:
        """Return the joint torques (55,) or (K, 55) at times t >= 0, [N m]; 0 for global DOF."""
        torques = self.instants(np.atleast_1d(t)).tau
        return torques if np.ndim(t) else torques[0]

    def instants(self, t: npt.ArrayLike) -> Samples:
        """Return the gait at times t (K,) >= 0, [s]; after T the next steps follow."""
        times = np.atleast_1d(np.asarray(t, dtype=float))
        step, within = self._steps(times)
        sampled = samples(self.step_instants(within), times)
        return _onward(sampled, step, self.step_length)

    def step_instants(self, t: FloatArray) -> Instants:
        """Return everything known at times t (K,) within the first step, with partials."""
        q, v, a = (self.basis.matrix(t, order) @ self.control_points for order in range(3))
        return self._walker.at(t, q, v, a)

    def _steps(self, times: FloatArray) -> tuple[npt.NDArray[np.intp], FloatArray]:
        if np.any(times < 0) or not np.all(np.isfinite(times)):
            raise ValueError("the walk starts at t = 0: times must be finite and not negative")
        step = np.floor(times / self.step_time + 1e-12).astype(np.intp)
        return step, np.clip(times - step * self.step_time, 0.0, self.step_time)

    def _motion(self, t: npt.ArrayLike, order: int) -> FloatArray:
        times = np.atleast_1d(np.asarray(t, dtype=float))
        step, within = self._steps(times)
        motion = self.basis.matrix(within, order) @ self.control_points
        motion = np.where((step % 2 == 1)[:, None], mirror(motion), motion)
        if order == 0:
            motion[:, _FORWARD] += step * self.step_length
        return motion if np.ndim(t) else motion[0]


def samples(now: Instants, times: FloatArray) -> Samples:
    """Return instants as plain arrays without partials, stamped with `times`."""
    pressure = [point.value for point in now.ground.pressure]
    cop = np.stack([_on_ground(point) for point in pressure], axis=1)
    wrench = np.stack([wrench.value for wrench in now.ground.wrenches], axis=1)
    grf = wrench[..., :3]
    yaw_moment = wrench[..., 4] - np.cross(cop, grf)[..., 1]
    return Samples(
        times,
        now.q,
        now.v,
        now.a,
        now.torque.value,
        now.muscle_torque.value,
        _on_ground(now.ground.zmp.value),
        grf,
        cop,
        yaw_moment,
        np.stack([foot.position for foot in now.feet], axis=1),
    )


def _on_ground(xz: FloatArray) -> FloatArray:
    return np.stack([xz[:, 0], np.zeros(len(xz)), xz[:, 1]], axis=1)


def _onward(first: Samples, step: npt.NDArray[np.intp], step_length: float) -> Samples:
    """Return samples of the first step as those of the given steps: mirrored, further on."""
    odd, forward = step % 2 == 1, step * step_length
    q = np.where(odd[:, None], mirror(first.q), first.q)
    q[:, _FORWARD] += forward
    others = {
        name: np.where(odd[:, None], mirror(getattr(first, name)), getattr(first, name))
        for name in ("v", "a", "tau", "active")
    }
    points = _mirrored(first.points, odd)
    zmp, cop = _mirrored(first.zmp, odd, feet=False), _mirrored(first.cop, odd)
    for place in (zmp, cop, points):
        place[..., 2] += forward.reshape(-1, *[1] * (place.ndim - 2))
    yaw = np.where(odd[:, None], -first.yaw_moment[:, ::-1], first.yaw_moment)
    grf = _mirrored(first.grf, odd)
    return Samples(first.t, q, **others, zmp=zmp, grf=grf, cop=cop, yaw_moment=yaw, points=points)


def _mirrored(vectors: FloatArray, odd: npt.NDArray[np.bool_], feet: bool = True) -> FloatArray:
    """Return vectors (K, [2 feet, ...] 3) with those of odd steps mirrored at x = 0."""
    mirrored = (vectors[:, ::-1] if feet else vectors) * [-1.0, 1.0, 1.0]
    return np.where(odd.reshape(-1, *[1] * (vectors.ndim - 1)), mirrored, vectors)


def save_gait(gait: Gait, folder: Path) -> None:
    """Write a gait, and its samples for readers without this package, to ``gait.npz``."""
    sampled = gait.instants(np.linspace(0.0, gait.step_time, _SAMPLES))
    arrays = {name: getattr(sampled, name) for name in Samples.__dataclass_fields__}
    temporary = folder / f".{FILE}.tmp"
    with temporary.open("wb") as file:
        np.savez_compressed(
            file,
            format=FORMAT,
            about=_ABOUT,
            scenario=json.dumps(gait.scenario.to_dict()),
            solution=json.dumps(dict(gait.solution)),
            dof_names=np.array(DOF_NAMES),
            breaks=gait.breaks,
            knots=gait.knots,
            control_points=gait.control_points,
            **arrays,
        )
    temporary.replace(folder / FILE)


def load_gait(folder: str | Path) -> Gait:
    """Read the gait of a result folder.

    Raises
    ------
    ResultError
        If there is no ``gait.npz``, or it is not one of ours, or its content contradicts itself.
    """
    path = Path(folder) / FILE
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            return _restored(file)
    except _UNREADABLE as error:
        raise ResultError(f"{path}: not a gait that can be read: {error}") from None


def _restored(file: Mapping[str, Any]) -> Gait:
    if str(file["format"]) != FORMAT:
        raise ValueError(f"format {file['format']!s}, expected {FORMAT!r}")
    scenario = Scenario.from_dict(json.loads(str(file["scenario"])))
    solution = dict(json.loads(str(file["solution"])))
    breaks, control_points = (_numbers(file, name) for name in ("breaks", "control_points"))
    T = scenario.walk.step_time
    if breaks.ndim != 1 or not np.allclose(breaks[[0, -1]], [0.0, T], rtol=0.0, atol=1e-9 * T):
        raise ValueError(f"breaks do not go from 0 to the step time {T:g} s")
    fewest = DEGREE if scenario.discretisation.mirrored else 1
    if len(breaks) <= fewest or np.any(np.diff(breaks) <= 0.0):
        raise ValueError("breaks are too few or do not increase")
    if control_points.shape != (len(breaks) + 2, N_DOF):
        raise ValueError(f"control_points of shape {control_points.shape} do not fit")
    return Gait(scenario, breaks, control_points, solution)


def _numbers(file: Mapping[str, Any], name: str) -> FloatArray:
    numbers = np.asarray(file[name], dtype=float)
    if not np.all(np.isfinite(numbers)):
        raise ValueError(f"{name} holds what is not a finite number")
    return numbers
