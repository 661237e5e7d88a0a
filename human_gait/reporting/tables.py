"""Tables of a report: what was asked, what came out, checks, people, differences."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from human_gait.people.agreement import CurveDifference, curve_differences
from human_gait.people.comparison import Comparison
from human_gait.people.reference import Score
from human_gait.people.spatiotemporal import StepScore
from human_gait.reporting.results import Finding, Result
from human_gait.walk.gait_cycle import COLUMNS, label_and_unit

_MINUS = "\N{MINUS SIGN}"
_BOUNDS = 12  # of those that shape a walk


@dataclass(frozen=True)
class Cell:
    """A cell of a table.

    Attributes
    ----------
    text : str
        As it is shown.
    value : float or None
        The number itself, with all its digits; None for words.
    mark : str
        ``good``, ``bad`` or ``differs``: how it is set off.
    """

    text: str
    value: float | None = None
    mark: str = ""


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes
    ----------
    columns : tuple of str
    rows : tuple of tuple of Cell
    groups : tuple of (str, int)
        What stands above the columns, and above how many; may be empty.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    groups: tuple[tuple[str, int], ...] = ()

    @property
    def starts(self) -> frozenset[int]:
        """Return the columns, from 0, that a group begins with."""
        spans = [0, *(span for _, span in self.groups)]
        return frozenset(sum(spans[: k + 1]) for k in range(1, len(spans) - 1))


Row = tuple[str, Callable[[Result], Cell]]


def number(value: float, form: str = ".3g", mark: str = "") -> Cell:
    """Return a cell with a number."""
    if math.isnan(value):
        return Cell("\N{EN DASH}", mark=mark)
    return Cell(format(value, form).replace("-", _MINUS), float(value), mark)


# What was asked, what came out

_ASKED: Sequence[Row] = (
    ("walking speed [m/s]", lambda one: number(one.gait.scenario.walk.speed, "g")),
    ("step length [m]", lambda one: number(one.gait.scenario.walk.step_length, "g")),
    ("step width [m]", lambda one: number(one.gait.scenario.walk.step_width, "g")),
    ("step time [s]", lambda one: number(one.gait.step_time)),
    ("sex", lambda one: Cell(one.gait.scenario.subject.sex)),
    ("stature [m]", lambda one: number(one.gait.scenario.subject.stature, "g")),
    ("body mass [kg]", lambda one: number(one.gait.scenario.subject.mass, "g")),
    ("load on the back [kg]", lambda one: number(one.gait.scenario.load.mass, "g")),
    (
        "friction of the floor [coefficient]",
        lambda one: number(one.gait.scenario.ground.friction, "g"),
    ),
    ("joints with limits of their own", lambda one: Cell(_own_limits(one))),
    (
        "control points per degree of freedom",
        lambda one: number(one.gait.scenario.discretisation.control_points, "d"),
    ),
    ("solver", lambda one: Cell(one.outcome.first_solver)),
    ("dynamics", lambda one: Cell(one.outcome.dynamics)),
)


def _own_limits(one: Result) -> str:
    limits = one.gait.scenario.limits
    return ", ".join([*limits.frozen, *(limited.name for limited in limits.ranges)]) or "none"


def asked(results: Sequence[Result]) -> Table:
    """Return what was asked for; what differs between results is marked."""
    table = _by_result("asked for", results, _ASKED)
    return replace(table, rows=tuple(map(_differing, table.rows)))


def _differing(row: tuple[Cell, ...]) -> tuple[Cell, ...]:
    if len({cell.text for cell in row[1:]}) < 2:
        return row
    return tuple(replace(cell, mark="differs") for cell in row)


def came_out(results: Sequence[Result]) -> Table:
    """Return what came out of the solves."""
    first = results[0].outcome.cost
    against: Sequence[Row] = (
        (
            f"effort against {results[0].label} [%]",
            lambda one: (
                Cell("\N{EN DASH}")
                if one is results[0]
                else number(100.0 * (one.outcome.cost / first - 1.0), "+.1f")
            ),
        ),
    )
    rows = [*_CAME_OUT[:2], *(against if len(results) > 1 and first else ()), *_CAME_OUT[2:]]
    return _by_result("came out", results, rows)


_CAME_OUT: Sequence[Row] = (
    ("outcome", lambda one: _verdict(one.outcome.success)),
    (
        "effort, Eq. (18) [N\N{SUPERSCRIPT TWO} m\N{SUPERSCRIPT TWO} s]",
        lambda one: number(one.outcome.cost, ".1f"),
    ),
    ("checks passed", lambda one: _passed(one.outcome.checks)),
    ("solving time [s]", lambda one: number(one.outcome.wall_time, ".1f")),
    ("found by", lambda one: Cell(one.outcome.solver)),
    ("which says", lambda one: Cell(one.outcome.status)),
    ("started from", lambda one: Cell(one.outcome.start)),
    ("attempts", lambda one: number(len(one.outcome.trials), "d")),
    ("iterations", lambda one: number(one.outcome.iterations, "d")),
    ("evaluations", lambda one: number(one.outcome.evaluations, "d")),
    ("variables", lambda one: number(one.outcome.n_variables, "d")),
    ("constraints", lambda one: number(one.outcome.n_constraints, "d")),
)


def _verdict(success: bool) -> Cell:
    return Cell("a walk", mark="good") if success else Cell("no walk", mark="bad")


def _passed(checks: Sequence[Finding]) -> Cell:
    passed = sum(check.passed for check in checks)
    return Cell(f"{passed} of {len(checks)}", mark="good" if passed == len(checks) else "bad")


def _by_result(heading: str, results: Sequence[Result], rows: Sequence[Row]) -> Table:
    """Return a table with a column for each result."""
    cells = tuple((Cell(name), *(cell(one) for one in results)) for name, cell in rows)
    return Table((heading, *(one.label for one in results)), cells)


def trials(result: Result) -> Table:
    """Return every attempt at solving."""
    columns = (
        "start",
        "solver",
        "it says",
        "walk",
        "effort [N² m² s]",
        "time [s]",
        "checks failed",
    )
    rows = tuple(
        (
            Cell(trial.start),
            Cell(trial.solver),
            Cell(trial.status),
            _verdict(trial.success),
            number(trial.cost, ".1f"),
            number(trial.wall_time, ".1f"),
            Cell(", ".join(trial.failed) or "none"),
        )
        for trial in result.outcome.trials
    )
    return Table(columns, rows)


# Checks and constraints


def checks(results: Sequence[Result]) -> Table:
    """Return every check with its limit, its equation and whether it is passed."""
    found = _by_name([one.outcome.checks for one in results])
    alone = len(results) == 1
    heads = ("found", "passed", "t [s]") if alone else ("found", "passed")
    rows = [
        (*_about(name, ones), _limit(ones), *(cell for one in ones for cell in _check(one, alone)))
        for name, ones in found.items()
    ]
    columns = ("check", "Eq.", "unit", "limit", *(head for _ in results for head in heads))
    return Table(columns, tuple(rows), _groups(4, results, len(heads)))


def violations(results: Sequence[Result]) -> Table:
    """Return the worst violation of every constraint at the instants that were constrained."""
    found = _by_name([one.outcome.violations for one in results])
    heads = ("beyond its bound", "t [s]", "worst") if len(results) == 1 else ("beyond", "t [s]")
    rows = [
        (*_about(name, ones), *(cell for one in ones for cell in _violation(one, len(heads))))
        for name, ones in found.items()
    ]
    columns = ("constraint", "Eq.", "unit", *(head for _ in results for head in heads))
    return Table(columns, tuple(rows), _groups(3, results, len(heads)))


def _by_name(found: Sequence[Sequence[Finding]]) -> dict[str, list[Finding | None]]:
    """Return the findings of all results, None where a result has not that constraint."""
    names = dict.fromkeys(one.name for findings in found for one in findings)
    lookups = [{one.name: one for one in findings} for findings in found]
    return {name: [lookup.get(name) for lookup in lookups] for name in names}


def _groups(own: int, results: Sequence[Result], span: int) -> tuple[tuple[str, int], ...]:
    """Return headings of the columns of each result, after some columns of the table's own."""
    if len(results) == 1:
        return ()
    return ("", own), *((one.label, span) for one in results)


def _about(name: str, ones: Sequence[Finding | None]) -> tuple[Cell, ...]:
    """Return name, equation and unit; results of older versions have no equation of a check."""
    known = [one for one in ones if one]
    equation = next((one.equation for one in known if one.equation), "")
    return Cell(name), Cell(equation), Cell(known[0].unit)


def _limit(ones: Sequence[Finding | None]) -> Cell:
    """Return the limit of a check, or all of them if they differ."""
    limits = list(dict.fromkeys(one.limit for one in ones if one))
    cells = [number(limit) for limit in limits]
    return cells[0] if len(cells) == 1 else Cell(" or ".join(cell.text for cell in cells))


def _check(one: Finding | None, alone: bool) -> Iterator[Cell]:
    if one is None:
        yield from (Cell(""), Cell(""))
        return
    yield number(one.value, ".2g", "" if one.passed else "bad")
    yield Cell("yes", mark="good") if one.passed else Cell("NO", mark="bad")
    if alone:
        yield number(one.time, ".3f")


def _violation(one: Finding | None, n: int) -> tuple[Cell, ...]:
    if one is None:
        return (Cell(""),) * n
    return (number(one.value, ".2g"), number(one.time, ".3f"), Cell(one.what))[:n]


# People


def steps(results: Sequence[Result]) -> Table:
    """Return step length, cadence and double support beside those of people."""
    columns = ("quantity", "unit", "predicted", "people", "from", "to", "of their range")
    compared = [(one.label, one.comparison) for one in results if one.comparison]
    rows = [
        (Cell(label), *_step(score)) if len(results) > 1 else _step(score)
        for k in range(3)
        for label, found in compared
        for score in found.step_scores[k : k + 1]
    ]
    return Table(("walk", *columns) if len(results) > 1 else columns, tuple(rows))


def _step(score: StepScore) -> tuple[Cell, ...]:
    return (
        Cell(score.name),
        Cell(score.unit),
        *(number(x) for x in (score.predicted, score.measured, score.lower, score.upper)),
        Cell("inside" if score.inside else "outside"),
    )


def bases(results: Sequence[Result]) -> tuple[str, ...]:
    """Return what the ranges of `steps` rest on."""
    found = [score for one in results if one.comparison for score in one.comparison.step_scores]
    return tuple(dict.fromkeys(f"{score.name}: {score.basis}" for score in found))


def people(results: Sequence[Result]) -> Table:
    """Return the scores of all curves against the measured ones."""
    compared = [(one, one.comparison) for one in results if one.comparison]
    alone = len(results) == 1
    heads = _WIDE if alone else _NARROW
    rows = [
        (*_curve(curve, Cell(measured)), *_scores([c for _, c in compared], measured, curve, alone))
        for measured, curve in _measured([found for _, found in compared])
    ]
    columns = ("measured by", "curve", "unit", *(head for _ in compared for head in heads))
    groups = _WIDE_GROUPS if alone else _groups(3, [one for one, _ in compared], len(heads))
    return Table(columns, tuple(rows), groups)


_NARROW = ("r", "RMSE")
_WIDE = ("r", "RMSE", "means out", "least", "greatest", "least", "greatest", "1 SD", "2 SD")
_WIDE_GROUPS = (("", 6), ("predicted", 2), ("measured", 2), ("% of time within", 2))


def _curve(column: str, *before: Cell) -> tuple[Cell, ...]:
    """Return cells that name a curve and its unit."""
    label, unit = label_and_unit(column)
    return (*before, Cell(label), Cell(unit.replace(" ", "\N{NO-BREAK SPACE}")))


def _measured(compared: Sequence[Comparison]) -> list[tuple[str, str]]:
    """Return who measured which curves."""
    found = [
        (source.label, curve)
        for comparison in compared
        for source in comparison.references
        for curve in source.curves
    ]
    return list(dict.fromkeys(found))


def _scores(
    compared: Sequence[Comparison], measured: str, curve: str, alone: bool
) -> Iterator[Cell]:
    """Yield the scores of one curve in every walk; none where others were measured."""
    for found in compared:
        names = [source.name for source in found.references if source.label == measured]
        scores = [s for s in found.scores if s.reference in names and s.curve == curve]
        if scores:
            yield from _score_cells(scores[0], alone, _form(curve))
        else:
            yield from (Cell("") for _ in (_WIDE if alone else _NARROW))


def _form(column: str, digits: int = 2) -> str:
    """Return how numbers of a curve are written: degrees with one digit after the point."""
    return ".1f" if column.endswith("_deg") else f".{digits}f"


def _score_cells(score: Score, alone: bool, form: str) -> tuple[Cell, ...]:
    short = number(score.r, ".2f"), number(score.rmse, form)
    if not alone:
        return short
    return (
        *short,
        number(score.rmse_offset_free, form),
        *(number(x, form) for x in (*score.predicted_range, *score.measured_range)),
        *(number(100.0 * x, ".0f") for x in (score.within_1sd, score.within_2sd)),
    )


# Differences


def differences(results: Sequence[Result]) -> Table:
    """Return how far the curves of the other results are from those of the first."""
    first, *others = results
    heads = ("r", "RMS", "largest")
    found = [curve_differences(first.folder, one.folder) for one in others]
    rows = [
        (*_curve(column), *(cell for curves in found for cell in _difference(curves[k])))
        for k, column in enumerate(COLUMNS[1:])
    ]
    columns = ("curve", "unit", *(head for _ in others for head in heads))
    groups = (("", 2), *((f"{one.label} against {first.label}", len(heads)) for one in others))
    return Table(columns, tuple(rows), groups)


def _difference(found: CurveDifference) -> tuple[Cell, ...]:
    form = _form(found.curve, 3)
    return number(found.r, ".3f"), number(found.rms, form), number(found.largest, form)


def ranges(results: Sequence[Result]) -> Table:
    """Return the least and the greatest value of every curve."""
    rows = [
        (
            *_curve(column),
            *(
                number(float(end(one.cycle[column])), _form(column))
                for one in results
                for end in (min, max)
            ),
        )
        for column in COLUMNS[1:]
    ]
    columns = ("curve", "unit", *(end for _ in results for end in ("least", "greatest")))
    return Table(columns, tuple(rows), _groups(2, results, 2))


def shapes(result: Result) -> Table:
    """Return the bounds that shape a walk, the most costly first."""
    columns = ("bound", "because", "most at [% of step]", "more room", "saves [% of effort]")
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
