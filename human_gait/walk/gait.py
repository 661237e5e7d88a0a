"""A gait as a value: the control points of one step and the scenario they belong to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray, IntArray
from human_gait.body.person import Body
from human_gait.scenario import Scenario
from human_gait.values import Value
from human_gait.walk.bspline import Basis
from human_gait.walk.contact_plan import ContactPlan
from human_gait.walk.cycle import Cycle, step_cycle
from human_gait.walk.instant import Instants, Walker
from human_gait.walk.measured import GroundForces, under_forces
from human_gait.walk.uses import Uses

REFINEMENT = 10
"""How much finer the grid of the samples in a file is than the constrained one."""

_CHUNK = 50  # instants at once: partials take 0.3 MB each


@dataclass(frozen=True, eq=False, repr=False)
class Samples(Value):
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
    toe_share : (K, 2) array
        Share of each foot's force and moment that acts on its toes, the rest on the rear foot.
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
    toe_share: FloatArray
    points: FloatArray


@dataclass(frozen=True, eq=False, repr=False)
class Gait(Uses, Value):
    """The motion of one step, and by mirror symmetry of the whole walk (Eq. 26).

    Two are equal if they are the same motion asked for by the same scenario, however found.

    Attributes
    ----------
    scenario : Scenario
    breaks : (n - 2,) array, [s]
        Where the polynomial pieces meet, 0 to T.
    control_points : (n, 55) array, [rad], [m]
        P_j of Eq. (28).
    solution : mapping
        How it was found: solver, status, cost, wall time, ...
    multipliers : mapping of str to (n,) array, [N^2 m^2 s] per unit of the bound
        What each bound costs, by name of its constraint: a solve that starts from here needs them.
    forces : GroundForces or None
        Those of the ground, of a walk whose forces were measured; else those that the motion takes.
    """

    scenario: Scenario
    breaks: FloatArray
    control_points: FloatArray
    solution: Mapping[str, Any] = field(default_factory=dict, compare=False)
    multipliers: Mapping[str, FloatArray] = field(default_factory=dict, compare=False)
    forces: GroundForces | None = None

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
    def free(self) -> FloatArray:
        """The free control points, flat, (m * 55,): what a program starts from."""
        return self.control_points[: self.basis.n_free].ravel()

    @property
    def body(self) -> Body:
        """The body that walks."""
        return self._walker.body

    @property
    def plan(self) -> ContactPlan:
        """Footholds and phases."""
        return self._walker.plan

    @property
    def fine_times(self) -> FloatArray:
        """A grid from 0 to T, ``REFINEMENT`` times finer than instants and pieces, [s]."""
        grid = self.scenario.discretisation
        n = REFINEMENT * max(grid.intervals * grid.dynamics_per_interval, self.basis.n_pieces)
        return np.linspace(0.0, self.step_time, n + 1)

    @cached_property
    def fine_samples(self) -> Samples:
        """What scenario and control points give at `fine_times`; nobody can write to it."""
        return self.step_samples(self.fine_times).frozen()

    @cached_property
    def cycle(self) -> Cycle:
        """How the walk goes on after the step, Eq. (26)."""
        return step_cycle(self.scenario.walk)

    @cached_property
    def basis(self) -> Basis:
        """The basis functions N_j of Eq. (28)."""
        return Basis(self.breaks, self.cycle, self.scenario.discretisation.mirrored)

    @cached_property
    def stride(self) -> Samples:
        """One stride, at the instants of `times`: what curves by name are taken from."""
        return self.instants(self.times)

    @cached_property
    def _walker(self) -> Walker:
        return Walker(self.scenario)

    @cached_property
    def right_stride(self) -> Samples:
        """One stride from right heel strike to the next, at every percent of it."""
        return self.instants(self.step_time * (1.0 + np.arange(101.0) / 50.0)).frozen()

    @cached_property
    def seen_samples(self) -> Samples:
        """The gait at the instants that it is constrained at (`constrained_grid`)."""
        return self.step_samples(constrained_grid(self.scenario)[0]).frozen()

    def retold(self, solution: Mapping[str, Any], multipliers: Mapping[str, FloatArray]) -> Gait:
        """Return the same motion, found in another way; what is known of it is not made again."""
        told = replace(self, solution=solution, multipliers=multipliers)
        own = {item.name for item in fields(self)}
        vars(told).update({name: made for name, made in vars(self).items() if name not in own})
        return told

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
        torques = self.instants(t).tau
        return torques if np.ndim(t) else torques[0]

    def muscle_torque(self, t: npt.ArrayLike) -> FloatArray:
        """Return what muscles give of `tau`, (55,) or (K, 55) at times t >= 0, [N m].

        The rest is given by passive tissues.
        """
        torques = self.instants(t).active
        return torques if np.ndim(t) else torques[0]

    def instants(self, t: npt.ArrayLike) -> Samples:
        """Return the gait at times t (K,) >= 0, [s]; after T the next steps follow."""
        times = _times(t)
        step, within = self._steps(times)
        return onward(replace(self.step_samples(within), t=times), step, self.cycle)

    def step_samples(self, t: FloatArray) -> Samples:
        """Return the gait at times t (K,) within the first step, its end T included."""
        some = t if len(t) else np.zeros(1)  # of no times the shapes are those of one
        parts = [some[k : k + _CHUNK] for k in range(0, len(some), _CHUNK)]
        return _joined([self._samples(part) for part in parts], len(t))

    def _samples(self, t: FloatArray) -> Samples:
        now = self.step_instants(t)
        found = samples(now, t)
        if self.forces is None:
            return found
        return under_forces(found, now, self.forces, t / self.step_time, self.plan.balls)

    def step_instants(self, t: FloatArray) -> Instants:
        """Return everything known at times t (K,) within the first step, with partials."""
        q, v, a = (self.basis.matrix(t, order) @ self.control_points for order in range(3))
        return self._walker.at(t, q, v, a)

    def _steps(self, times: FloatArray) -> tuple[IntArray, FloatArray]:
        if np.any(times < 0) or not np.all(np.isfinite(times)):
            raise ValueError("the walk starts at t = 0: times must be finite and not negative")
        step = np.floor(times / self.step_time + 1e-12).astype(np.intp)
        return step, np.clip(times - step * self.step_time, 0.0, self.step_time)

    def _motion(self, t: npt.ArrayLike, order: int) -> FloatArray:
        times = _times(t)
        step, within = self._steps(times)
        motion = self.basis.matrix(within, order) @ self.control_points
        motion = (self.cycle.turned if order else self.cycle.image)(motion, step)
        return motion if np.ndim(t) else motion[0]


def constrained_grid(scenario: Scenario) -> tuple[FloatArray, FloatArray]:
    """Return the instants (K,) that a walk is constrained at, and the time that each stands for.

    Both in [s]. T itself is left out where it is the mirror image of 0.
    """
    grid, T = scenario.discretisation, scenario.walk.step_time
    n = grid.intervals * grid.dynamics_per_interval
    times = np.arange(n + (not grid.mirrored)) * T / n
    spacing = np.full(len(times), T / n)
    if not grid.mirrored:
        spacing[[0, -1]] /= 2  # trapezoids
    return times, spacing


def instant_spacing(scenario: Scenario) -> float:
    """Return the time from one instant of the constrained grid to the next, [s]."""
    grid = scenario.discretisation
    return scenario.walk.step_time / (grid.intervals * grid.dynamics_per_interval)


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
        now.torque,
        now.muscle_torque,
        _on_ground(now.ground.zmp.value),
        grf,
        cop,
        yaw_moment,
        now.ground.toe_share.value,
        np.stack([foot.position for foot in now.feet], axis=1),
    )


def _times(t: npt.ArrayLike) -> FloatArray:
    """Return one time or many as an array (K,), [s]."""
    wanted = "times must be a number or a list of numbers"
    try:
        times = np.atleast_1d(np.asarray(t, dtype=float))
    except (TypeError, ValueError):
        raise ValueError(f"{wanted}, not {t!r:.60}") from None
    if times.ndim > 1:
        raise ValueError(f"{wanted}, not an array of shape {times.shape}")
    return times


def _joined(parts: list[Samples], n: int) -> Samples:
    """Return the first n instants of several samples."""
    names = [item.name for item in fields(Samples)]
    arrays = (np.concatenate([getattr(part, name) for part in parts])[:n] for name in names)
    return Samples(*arrays)


def _on_ground(xz: FloatArray) -> FloatArray:
    return np.stack([xz[:, 0], np.zeros(len(xz)), xz[:, 1]], axis=1)


def onward(first: Samples, step: IntArray, cycle: Cycle) -> Samples:
    """Return samples (K) of the first step as those of the steps (K,), Eq. (26)."""
    joints = {
        name: cycle.turned(getattr(first, name), step) for name in ("v", "a", "tau", "active")
    }
    points, cop, grf, yaw, toes = (
        cycle.exchanged(getattr(first, name), step)
        for name in ("points", "cop", "grf", "yaw_moment", "toe_share")
    )
    return Samples(
        first.t,
        cycle.image(first.q, step),
        **joints,
        zmp=cycle.placed(first.zmp, step),
        grf=cycle.reflected(grf, step),
        cop=cycle.placed(cop, step),
        yaw_moment=np.where(cycle.swaps(step)[:, None], -yaw, yaw),  # a mirror turns it round
        toe_share=toes,
        points=cycle.placed(points, step),
    )
