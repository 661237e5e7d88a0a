"""What no walk can keep, known from the scenario before anything is solved.

Only what follows from geometry or from the form of the problem is refused: a step that is merely
unusual is tried (`solving.diagnosis` says so if it fails).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.limits import joint_limits
from human_gait.body.skeleton import DOF_NAMES, MIRROR_INDEX, PRISMATIC, index
from human_gait.exceptions import ScenarioError
from human_gait.problem.reach import MISSED, Nearest, nearest
from human_gait.scenario import DofRange, Limits, Scenario
from human_gait.walk.bspline import Basis
from human_gait.walk.contact_plan import LEFT
from human_gait.walk.gait import constrained_grid
from human_gait.walk.instant import Walker

_PART = 0.1  # of what would help most: a joint that is in the way
_MOST_NAMES = 6
_LOADED = 0.1  # of the load: a foot that carries so much can slide
_FORWARD = index("pelvis_tz")


@dataclass(frozen=True)
class Suggestion:
    """Something to try.

    Attributes
    ----------
    key : str
        Setting of the scenario, or option of the command line.
    change, because : str
        What to do with it, and the numbers that say so.
    """

    key: str
    change: str
    because: str

    def __str__(self) -> str:
        """Return ``key: change (because)``."""
        return f"{self.key}: {self.change} ({self.because})"

    def refusal(self, value: object) -> ScenarioError:
        """Return the error for a setting that leaves no walk."""
        return ScenarioError(self.key, f"leaves no walk: {self.because}; try {self.change}", value)


def refusals(scenario: Scenario, walker: Walker, basis: Basis) -> Iterator[ScenarioError]:
    """Yield an error for everything in a scenario that no walk can keep."""
    for reason in impossible(scenario, walker, basis):
        yield reason.refusal(_value(scenario, reason.key))


def impossible(scenario: Scenario, walker: Walker, basis: Basis) -> list[Suggestion]:
    """Return why a scenario has no walk, as far as that is known without solving; mostly nothing.

    Parameters
    ----------
    scenario : Scenario
    walker : Walker
        Its body on its ground.
    basis : Basis
        Of its splines.

    Raises
    ------
    ScenarioError
        If it names a DOF that does not exist or leaves one without range.
    """
    return [
        *_resolution(scenario, basis),
        *_knee(scenario),
        *_progress(scenario, basis),
        *_slope(scenario, walker),
        *_heel(scenario, walker),
        *_reach(scenario, walker, basis),
    ]


def _resolution(scenario: Scenario, basis: Basis) -> Iterator[Suggestion]:
    """Find more polynomial pieces than there are instants that say what they do."""
    grid = scenario.discretisation
    instants = grid.intervals * grid.dynamics_per_interval
    if basis.n_pieces > instants:
        least = math.ceil(basis.n_pieces / grid.dynamics_per_interval)
        because = (
            f"{grid.control_points} control points are {basis.n_pieces} spline pieces, more than "
            f"the {instants} instants at which anything holds them"
        )
        yield Suggestion("discretisation.intervals", f"at least {least}", because)


def _knee(scenario: Scenario) -> Iterator[Suggestion]:
    """Find limits that exclude the knee of 60 deg of Eq. (25)."""
    if scenario.posture.swing_knee == "free":
        return
    lower, upper = (limit[index("knee_flexion_r")] for limit in joint_limits(scenario))
    low, high = np.rad2deg(lower), np.rad2deg(upper)
    tolerance = scenario.tolerances.knee_flexion_deg
    if low <= 60.0 + tolerance and high >= 60.0 - tolerance:
        return
    because = f"mid-swing needs 60 +- {tolerance:g} deg, Eq. (25); the knee has {low:g} to {high:g}"
    free = 'posture.swing_knee = "free"'
    names = [name for name in scenario.limits.frozen if name.startswith("knee_flexion")]
    if names:
        yield Suggestion("limits.frozen", f"to leave out {', '.join(names)}, or {free}", because)
    for limited in scenario.limits.ranges:
        if limited.name.startswith("knee_flexion"):
            change = f"a range with 60 deg in it, or {free}"
            yield Suggestion(f"limits.{limited.name}", change, because)


def _progress(scenario: Scenario, basis: Basis) -> Iterator[Suggestion]:
    """Find a range too narrow for the pelvis to go on evenly, Eq. (23): a linear program."""
    own = [limited for limited in scenario.limits.ranges if limited.name == DOF_NAMES[_FORWARD]]
    if not own:
        return
    least = _least_progress(scenario, basis)
    if own[0].upper - own[0].lower < least:
        walk = scenario.walk
        because = (
            f"a step of {walk.step_length:g} m at {walk.speed:g} +- "
            f"{scenario.tolerances.pelvis_speed:g} m/s, Eq. (23), takes a range of {least:.2f} m"
        )
        yield Suggestion(f"limits.{own[0].name}", f"one of {rounded_up(least)} m or more", because)


def _least_progress(scenario: Scenario, basis: Basis) -> float:
    """Return the least range [m] of the control points of a pelvis that keeps to its speed."""
    from scipy.optimize import linprog  # noqa: PLC0415, hardly ever needed

    grid, walk, m = scenario.discretisation, scenario.walk, basis.n_free
    t = np.arange(grid.intervals + (not grid.mirrored)) * walk.step_time / grid.intervals
    rate = basis.matrix(t, 1)
    folded = rate[:, :m].copy()  # control points past the free ones are further on by the step
    folded[:, : basis.n_control_points - m] += rate[:, m:]
    ahead = rate[:, m:].sum(axis=1) * walk.step_length
    most = walk.speed + scenario.tolerances.pelvis_speed - ahead
    least = walk.speed - scenario.tolerances.pelvis_speed - ahead
    none, one = np.zeros((len(t), 2)), np.ones((m, 1))
    rows = [
        np.hstack([folded, none]),
        np.hstack([-folded, none]),
        np.hstack([np.eye(m), 0.0 * one, -one]),  # below the upper end
        np.hstack([-np.eye(m), one, 0.0 * one]),  # above the lower end
    ]
    bounds = np.concatenate([most, -least, np.zeros(2 * m)])
    cost = np.append(np.zeros(m), [-1.0, 1.0])
    found = linprog(cost, np.vstack(rows), bounds, bounds=(None, None))
    return float(found.fun) if found.success else 0.0


def _slope(scenario: Scenario, walker: Walker) -> Iterator[Suggestion]:
    """Find a floor that cannot hold feet that push towards one point.

    In double support the forces of both feet meet at the height H above the ZMP
    (`ground_reaction`): their slopes differ by |B - A| / H, so that one of them is at least half.
    """
    plan, t = walker.plan, _both_loaded(scenario, walker)
    if not len(t) or plan.spread == 0.0 or plan.least_effort:
        return
    A, B = plan.transfer_points(t)
    apart = float(np.linalg.norm(B - A, axis=1).max())
    least = apart * plan.spread / 2.0
    if plan.friction < least:
        because = (
            f"where both feet are loaded they push towards one point {1.0 / plan.spread:.2f} m up, "
            f"{apart:.2f} m apart"
        )
        change = f'at least {rounded_up(least)}, or ground.sharing = "parallel"'
        yield Suggestion("ground.friction", change, because)


def _heel(scenario: Scenario, walker: Walker) -> Iterator[Suggestion]:
    """Find a heel that is loaded ahead of what carries of it, Eqs. (17) and (22).

    Where both feet are loaded the pressure of the leading one is at B, or beside it across AB;
    until the foot is flat it has to be on the pad of the heel.
    """
    plan, t = walker.plan, _both_loaded(scenario, walker)
    t = t[plan.fraction(t) < plan.phases.foot_flat]
    if not len(t):
        return
    (A, B), foot = plan.transfer_points(t), plan.feet[LEFT]
    across = np.abs((B - A)[:, 0] / (B - A)[:, 2]) * (foot.half_breadth - plan.margin)
    ahead = B[:, 2] - plan.ankles[LEFT, 2] - foot.heel
    least = float((ahead - across).max()) / foot.length
    if plan.pad < least:
        because = (
            f"before it is flat the leading foot is loaded {1e3 * ahead.max():.0f} mm ahead of its "
            f"heel, of which {1e3 * plan.pad * foot.length:.0f} mm carry"
        )
        if least <= scenario.ground.rule("pad")["range"][1]:
            change = f"at least {rounded_up(least)}, or ground.loading nearer to the heel"
            yield Suggestion("ground.pad", change, because)
        else:
            yield Suggestion("ground.loading", "places nearer to the heel", because)


def _both_loaded(scenario: Scenario, walker: Walker) -> FloatArray:
    """Return the instants at which both feet have a good part of the load, [s]."""
    plan, (t, _) = walker.plan, constrained_grid(scenario)
    shared = plan.fraction(t) / plan.phases.double_support
    least_share = scenario.tolerances.load_transfer + _LOADED
    both = plan.double_support(t) & (shared > least_share) & (shared < 1.0 - least_share)
    return np.asarray(t[both])


def _reach(scenario: Scenario, walker: Walker, basis: Basis) -> Iterator[Suggestion]:
    """Find limits of joints within which the feet do not get to where the plan has them."""
    limits = scenario.limits
    if limits == Limits():
        return  # postures that are as usual reach as far as a step may be long (`Scenario`)
    found = nearest(scenario, walker, basis)
    if found.missed <= MISSED:
        return
    usual = nearest(scenario, walker, basis, joint_limits(replace(scenario, limits=Limits())))
    because = f"{found.what}, is at least {1e3 * found.missed:.0f} mm off, whatever the posture"
    helps = found.in_the_way
    names = [name for name in DOF_NAMES if helps[_sides(name)].max() > _PART * helps.max()]
    held = [name for name in names if name in limits.frozen]
    if held:
        more = ", ..." if len(held) > _MOST_NAMES else ""
        change = f"to leave out {', '.join(held[:_MOST_NAMES])}{more}"
        yield Suggestion("limits.frozen", change, because)
    for limited in limits.ranges:
        if limited.name in names:
            yield Suggestion(f"limits.{limited.name}", _wider(limited, usual), because)
    if not held and not {limited.name for limited in limits.ranges} & set(names):
        yield Suggestion("limits", "wider ranges", because)


def _sides(name: str) -> list[int]:
    """Return the DOF that a limit of one DOF holds for: its mirror image, too."""
    i = index(name)
    return [i, int(MIRROR_INDEX[i])]


def _wider(limited: DofRange, usual: Nearest) -> str:
    """Return a range that holds what postures without limits of their own need."""
    if usual.missed > MISSED:
        return "a wider range"
    q = usual.q[:, _sides(limited.name)]
    unit, step = (1.0, 0.01) if PRISMATIC[index(limited.name)] else (np.rad2deg(1.0), 1.0)
    low = min(limited.lower, math.floor(unit * q.min() / step) * step)
    high = max(limited.upper, math.ceil(unit * q.max() / step) * step)
    return f"a wider range, such as [{low:.4g}, {high:.4g}]"


def rounded_up(value: float) -> str:
    """Return a bound with two decimals, rounded so that it holds."""
    return f"{math.ceil(100.0 * value - 1e-9) / 100.0:.2f}"


def _value(scenario: Scenario, key: str) -> object:
    """Return the value of a setting as it stands in a file; none of a list of frozen joints."""
    section, _, name = key.partition(".")
    table = getattr(scenario, section).to_table()
    return None if name in ("", "frozen") else table[name]
