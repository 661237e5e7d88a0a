"""Is this gait a walk? Every claim of its file is checked anew, by three engines.

The motion is that of the splines, on a grid at least ten times finer than the constrained one.
What its arrays should be is computed from scenario and control points (`contents`).
Pinocchio, Drake and the paper's recursion each compute the torques that it takes under the forces
of the file (`engines`); Drake, which no solve uses, also tells where the feet are and what momentum
and energy do. How the optimiser found motion, forces and torques plays no part.
"""

from __future__ import annotations

import numpy as np

from human_gait.checks.check import Check
from human_gait.checks.contents import contents_checks
from human_gait.checks.engines import DrakeEngine
from human_gait.checks.ground import ground_checks
from human_gait.checks.laws import dynamics_checks, loads_of
from human_gait.checks.limbs import limbs_checks
from human_gait.checks.measured import of_measured
from human_gait.checks.motion import feet_checks, walk_checks
from human_gait.walk.gait_file import Record


def verify(record: Record) -> list[Check]:
    """Return the checks of a gait: what its file says, the laws of motion, the ground, the walk."""
    gait, now = record.gait, record.samples
    with np.errstate(all="ignore"):  # absurd numbers of a file fail their checks
        drake, loads = DrakeEngine(gait.body, gait.scenario.ground.ball), loads_of(gait, now)
        found = drake.mechanics((now.q, now.v, now.a), loads)
        checks = [
            *contents_checks(record),
            *dynamics_checks(record, drake, loads, found),
            *ground_checks(gait.plan, now),
            *feet_checks(record, found),
            *walk_checks(gait, now),
            *limbs_checks(gait, now),
        ]
    return of_measured(gait, checks)
