"""Tables of a report about its walks: what was asked, what came out, how far they differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from human_gait.body.limits import mirrored_limits
from human_gait.reporting.agreement import CurveDifference, curve_differences
from human_gait.reporting.cells import (
    Cell,
    Row,
    Table,
    by_result,
    curve_cells,
    form_of,
    groups,
    number,
)
from human_gait.reporting.outcome import Finding
from human_gait.reporting.results import Result
from human_gait.settings.departures import departures
from human_gait.walk.dimensionless import froude_number
from human_gait.walk.gait_cycle import COLUMNS
from human_gait.walk.measured import was_measured

_BOUNDS = 12  # of those that shape a walk


# What was asked, what came out

_ASKED: Sequence[Row] = (
    ("walking speed [m/s]", lambda one: number(one.gait.scenario.walk.speed, "g")),
    ("step length [m]", lambda one: number(one.gait.scenario.walk.step_length, "g")),
    ("step width [m]", lambda one: number(one.gait.scenario.walk.step_width, "g")),
    ("step time [s]", lambda one: number(one.gait.step_time)),
    ("sex", lambda one: Cell(one.gait.scenario.subject.sex)),
    ("stature [m]", lambda one: number(one.gait.scenario.subject.stature, "g")),
    ("body mass [kg]", lambda one: number(one.gait.scenario.subject.mass, "g")),
    ("leg length [m]", lambda one: number(one.gait.scenario.subject.leg_length)),
    ("lengths that do not follow from the stature [m]", lambda one: Cell(_own_lengths(one))),
    ("Froude number", lambda one: number(_froude(one))),
    ("load [kg]", lambda one: number(one.gait.scenario.load.mass, "g")),
    (
        "friction of the floor [coefficient]",
        lambda one: number(one.gait.scenario.ground.friction, "g"),
    ),
    ("joints with limits of their own", lambda one: Cell(_own_limits(one))),
    (
        "control points per degree of freedom",
        lambda one: number(one.gait.scenario.discretisation.control_points, "d"),
    ),
    ("settings that move limits", lambda one: Cell(_moved(one))),
    ("solver", lambda one: Cell(one.outcome.first_solver)),
    ("dynamics", lambda one: Cell(one.outcome.dynamics)),
)


def _own_lengths(one: Result) -> str:
    lengths = one.gait.scenario.subject.own_lengths
    return ", ".join(f"{name} {length:.4g}" for name, length in lengths.items()) or "none"


def _froude(one: Result) -> float:
    return froude_number(one.gait.scenario.subject, one.gait.scenario.walk.speed)


def _own_limits(one: Result) -> str:
    limits = one.gait.scenario.limits
    names = ", ".join([*limits.frozen, *(limited.name for limited in limits.ranges)])
    return "; ".join([names or "none", *mirrored_limits(one.gait.scenario)])


def _moved(one: Result) -> str:
    return "; ".join(map(str, departures(one.gait.scenario))) or "none"


def asked(results: Sequence[Result]) -> Table:
    """Return what was asked for; what differs between results is marked."""
    table = by_result("asked for", results, _ASKED)
    return replace(table, rows=tuple(map(_differing, table.rows)))


def _differing(row: tuple[Cell, ...]) -> tuple[Cell, ...]:
    if len({cell.text for cell in row[1:]}) < 2:
        return row
    return tuple(replace(cell, mark="differs") for cell in row)


def solved(results: Sequence[Result]) -> Table:
    """Return how the walks were solved."""
    return by_result("solved", results, _SOLVED)


def _outcome(one: Result) -> Cell:
    return Cell("measured") if was_measured(one.gait) else _verdict(one.outcome.success)


_SOLVED: Sequence[Row] = (
    ("outcome", _outcome),
    ("checks passed", lambda one: _passed(one.outcome.checks)),
    ("solving time [s]", lambda one: number(one.outcome.wall_time, ".1f")),
    ("found by", lambda one: Cell(one.outcome.solver)),
    ("status of the solver", lambda one: Cell(one.outcome.status)),
    ("started from", lambda one: Cell(one.outcome.start)),
    ("attempts", lambda one: number(len(one.outcome.trials), "d")),
    ("iterations", lambda one: number(one.outcome.iterations, "d")),
    ("evaluations", lambda one: number(one.outcome.evaluations, "d")),
    ("variables", lambda one: number(one.outcome.n_variables, "d")),
    ("constraints", lambda one: number(one.outcome.n_constraints, "d")),
    ("cost, what was minimised [N² m² s]", lambda one: number(one.outcome.cost, ".1f")),
)


def _verdict(success: bool) -> Cell:
    return Cell("a walk", mark="good") if success else Cell("no walk", mark="bad")


def _passed(checks: Sequence[Finding]) -> Cell:
    passed = sum(check.passed for check in checks)
    return Cell(f"{passed} of {len(checks)}", mark="good" if passed == len(checks) else "bad")


def trials(result: Result) -> Table:
    """Return every attempt at solving."""
    columns = (
        "start",
        "solver",
        "status",
        "walk",
        "time [s]",
        "checks failed",
        "cost [N² m² s]",
    )
    rows = tuple(
        (
            Cell(trial.start),
            Cell(trial.solver),
            Cell(trial.status),
            _verdict(trial.success),
            number(trial.wall_time, ".1f"),
            Cell(", ".join(trial.failed) or "none"),
            number(trial.cost, ".1f"),
        )
        for trial in result.outcome.trials
    )
    return Table(columns, rows)


# Differences


def differences(results: Sequence[Result]) -> Table:
    """Return how far the curves of the other results are from those of the first."""
    first, *others = results
    heads = ("r", "RMS", "largest")
    found = [curve_differences(first.cycle, one.cycle) for one in others]
    rows = [
        (*curve_cells(column), *(cell for curves in found for cell in _difference(curves[k])))
        for k, column in enumerate(COLUMNS[1:])
    ]
    columns = ("curve", "unit", *(head for _ in others for head in heads))
    groups = (("", 2), *((f"{one.label} against {first.label}", len(heads)) for one in others))
    return Table(columns, tuple(rows), groups)


def _difference(found: CurveDifference) -> tuple[Cell, ...]:
    form = form_of(found.curve, 3)
    return number(found.r, ".3f"), number(found.rms, form), number(found.largest, form)


def ranges(results: Sequence[Result]) -> Table:
    """Return the least and the greatest value of every curve."""
    rows = [
        (
            *curve_cells(column),
            *(
                number(float(end(one.cycle[column])), form_of(column))
                for one in results
                for end in (min, max)
            ),
        )
        for column in COLUMNS[1:]
    ]
    columns = ("curve", "unit", *(end for _ in results for end in ("least", "greatest")))
    return Table(columns, tuple(rows), groups(2, results, 2))


def shapes(result: Result) -> Table:
    """Return the bounds that shape a walk, the most costly first."""
    columns = ("bound", "because", "most at [% of step]", "more room", "saves [% of cost]")
    rows = tuple(
        (
            Cell(f"{bound.name}: {bound.what}"),
            Cell(bound.meaning),
            number(100.0 * bound.share, ".0f"),
            Cell(bound.step),
            number(100.0 * bound.saving, ".2f"),
        )
        for bound in result.bounds[:_BOUNDS]
    )
    return Table(columns, rows)
