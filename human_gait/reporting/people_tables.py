"""Tables of a report that hold walks against measured people."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from human_gait.people.comparison import Comparison
from human_gait.people.reference import Score
from human_gait.people.spatiotemporal import StepScore
from human_gait.reporting.cells import Cell, Table, curve_cells, form_of, groups, number
from human_gait.reporting.results import Result


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
    if len(results) > 1:
        return Table(("walk", *columns), tuple(rows), names=2)
    return Table(columns, tuple(rows))


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
    compared = [one for one in results if one.comparison]
    found = [one.comparison for one in results if one.comparison]
    alone = len(results) == 1
    heads = _WIDE if alone else _NARROW
    rows = [
        (
            *curve_cells(curve, Cell(measured)),
            *_scores(found, measured, curve, alone),
        )
        for measured, curve in _measured(found)
    ]
    columns = ("measured by", "curve", "unit", *(head for _ in compared for head in heads))
    above = _WIDE_GROUPS if alone else groups(3, compared, len(heads))
    return Table(columns, tuple(rows), above, names=2)


_NARROW = ("r", "RMSE")
_WIDE = (
    "r",
    "RMSE",
    "RMSE without offset",
    "least",
    "greatest",
    "least",
    "greatest",
    "1 SD",
    "2 SD",
)
_WIDE_GROUPS = (("", 6), ("predicted", 2), ("measured", 2), ("% of time within", 2))


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
            yield from _score_cells(scores[0], alone, form_of(curve))
        else:
            yield from (Cell("") for _ in (_WIDE if alone else _NARROW))


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
