"""The checks of a walk that was measured: what is true of its file, and what it does not keep.

Its file has to be whole, and its torques those of motion and forces, by all engines. Feet that
slide, forces that motion does not take and limits that are passed are facts about a person, two
instruments and a model: they are told, and held against nothing.
"""

from __future__ import annotations

import math
from dataclasses import replace

from human_gait.checks.check import NO_LIMIT, Check, Claim, Kind
from human_gait.checks.laws import BALANCE
from human_gait.walk.gait import Gait
from human_gait.walk.measured import measured_words, was_measured

_LARGEST = 1e300  # of a number that is one: a foot that stands where none was planned is anywhere

MEASURED = Claim("measured, not predicted", "", Kind.NOTE)


def of_measured(gait: Gait, checks: list[Check]) -> list[Check]:
    """Return the checks of a gait; of one that was measured most are notes, after one that says so.

    Parameters
    ----------
    gait : Gait
    checks : list of Check
        Of a walk as it is predicted.
    """
    if was_measured(gait) is None:
        return checks
    told = [one if _holds(one) else _noted(one) for one in checks]
    missed = [one.name for one in checks if not one.passed and not _holds(one)]
    beyond = f" Of what a predicted walk keeps: {', '.join(missed)}." if missed else ""
    return [MEASURED.noted(float(len(missed)), 0.0, measured_words(gait) + beyond), *told]


def is_measured(checks: list[Check]) -> bool:
    """Tell whether checks are those of a walk that was measured."""
    return any(check.name == MEASURED.name for check in checks)


def _holds(check: Check) -> bool:
    """Tell whether a check is one of a file and its arithmetic, not of a walk."""
    return check.kind in (Kind.FILE, Kind.LAWS) and check.name != BALANCE.name


def _noted(check: Check) -> Check:
    beyond = f"a predicted walk keeps {check.limit:g}" if not check.passed else ""
    what = "; ".join(filter(None, [check.what, beyond]))
    value = check.value if check.value < _LARGEST else math.inf
    return replace(check, value=value, limit=NO_LIMIT, kind=Kind.NOTE, what=what)
