"""The constraints of the paper, Eqs. (19)-(27), and what the floor's friction adds to them.

Eq. (26) needs no row here: the splines are symmetric by construction, or `program` ties their ends
(`bspline`). Eq. (19) bounds the control points, whose convex hull holds the curve.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import N_DOF
from human_gait.problem.balance_rows import (
    ground_pushes,
    load_transfer,
    sliding_friction,
    turning_friction,
    zmp_stability,
)
from human_gait.problem.contact_rows import (
    contact_position,
    feet_apart,
    ground_penetration,
    soft_impact,
)
from human_gait.problem.limb_rows import limbs_apart
from human_gait.problem.posture_rows import arm_leg_coupling, knee_at_mid_swing, pelvic_velocity
from human_gait.problem.residual import Constraint, Demand
from human_gait.scenario import Scenario
from human_gait.walk.bspline import Basis
from human_gait.walk.contact_plan import ContactPlan

_TIED = {"acceleration": 0, "position": 1, "velocity": 2}  # derivatives that have rows of Eq. 26

LIMITS = Demand(
    name="joint limit",
    equation="19",
    meaning="joints are at the end of the range that they are given",
)
"""What bounds the control points."""

SYMMETRY = Demand(
    name="symmetry condition",
    equation="26",
    meaning="the next step has to be the mirror image of this one",
)
"""What ties the ends of splines that are not symmetric by construction."""


def paper_constraints(scenario: Scenario, plan: ContactPlan, times: FloatArray) -> list[Constraint]:
    """Return all constraints of the paper that a scenario has instants for.

    Parameters
    ----------
    scenario : Scenario
    plan : ContactPlan
    times : (K,) array, [s]
        The grid. Forces are constrained at all of its instants; the motion of feet, pelvis and
        arms, which is smoother, at the ends of the scenario's intervals.
    """
    on = np.arange(0, len(times), scenario.discretisation.dynamics_per_interval)
    rows = [
        ground_penetration(plan, times, on),
        contact_position(scenario, plan, times, on),
        soft_impact(plan, times, on),
        feet_apart(scenario, plan, times, on),
        zmp_stability(plan, times),
        load_transfer(scenario, plan, times),
        ground_pushes(times, plan),
        pelvic_velocity(scenario, on),
        *([knee_at_mid_swing(scenario, times)] if scenario.posture.swing_knee == "bent" else []),
        arm_leg_coupling(scenario, on),
        *([limbs_apart(scenario, times)] if scenario.posture.limbs == "apart" else []),
    ]
    return with_rows(rows)


def with_rows(constraints: Iterable[Constraint]) -> list[Constraint]:
    """Return the constraints that have any rows: where no foot swings, none has to pass."""
    return [constraint for constraint in constraints if len(constraint.lower)]


def friction_constraints(plan: ContactPlan, times: FloatArray) -> list[Constraint]:
    """Return what the floor's friction allows. The paper has no such limits."""
    return [sliding_friction(plan, times), turning_friction(plan, times)]


def symmetry_rows(scenario: Scenario, basis: Basis) -> tuple[FloatArray, FloatArray]:
    """Return Eq. (26) as rows (r, m * 55) and right-hand sides (r,); none for mirrored splines.

    Postures of both ends, q(T) - mirror(q(0)) = L z, and velocities where they are tied too.
    """
    derivatives = range(_TIED[scenario.discretisation.periodicity])
    rows = [basis.symmetry(derivative) for derivative in derivatives]
    ends = np.zeros((len(rows), N_DOF))
    ends[:1] = basis.cycle.advance
    return np.concatenate([np.zeros((0, basis.n_free * N_DOF)), *rows]), ends.ravel()
