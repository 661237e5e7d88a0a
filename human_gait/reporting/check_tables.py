"""Tables of a report about the checks of a walk and the constraints of its problem."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from human_gait.reporting.cells import Cell, Table, groups, number
from human_gait.reporting.outcome import Finding
from human_gait.reporting.results import Result


def checks(results: Sequence[Result]) -> Table:
    """Return every check with its limit, its equation and whether it is passed."""
    found = _by_name([one.outcome.checks for one in results])
    alone = len(results) == 1
    heads = ("found", "passed", "t [s]", "what") if alone else ("found", "passed")
    rows = [
        (*_about(name, ones), _limit(ones), *(cell for one in ones for cell in _check(one, alone)))
        for name, ones in found.items()
    ]
    columns = ("check", "Eq.", "unit", "limit", *(head for _ in results for head in heads))
    return Table(columns, tuple(rows), groups(4, results, len(heads)))


def violations(results: Sequence[Result]) -> Table:
    """Return the worst violation of every constraint at the instants that were constrained."""
    found = _by_name([one.outcome.violations for one in results])
    heads = ("beyond its bound", "t [s]", "worst") if len(results) == 1 else ("beyond", "t [s]")
    rows = [
        (*_about(name, ones), *(cell for one in ones for cell in _violation(one, len(heads))))
        for name, ones in found.items()
    ]
    columns = ("constraint", "Eq.", "unit", *(head for _ in results for head in heads))
    return Table(columns, tuple(rows), groups(3, results, len(heads)))


def _by_name(found: Sequence[Sequence[Finding]]) -> dict[str, list[Finding | None]]:
    """Return the findings of all results, None where a result has not that constraint."""
    names = dict.fromkeys(one.name for findings in found for one in findings)
    lookups = [{one.name: one for one in findings} for findings in found]
    return {name: [lookup.get(name) for lookup in lookups] for name in names}


def _about(name: str, ones: Sequence[Finding | None]) -> tuple[Cell, ...]:
    """Return name, equation and unit; results of older versions have no equation of a check."""
    known = [one for one in ones if one]
    equation = next((one.equation for one in known if one.equation), "")
    return Cell(name), Cell(equation), Cell(known[0].unit)


def _limit(ones: Sequence[Finding | None]) -> Cell:
    """Return the limit of a check, or all of them if they differ."""
    limits = list(dict.fromkeys(one.limit for one in ones if one))
    cells = [number(limit) if math.isfinite(limit) else Cell("none") for limit in limits]
    return cells[0] if len(cells) == 1 else Cell(" or ".join(cell.text for cell in cells))


def _check(one: Finding | None, alone: bool) -> Iterator[Cell]:
    if one is None:
        yield from (Cell(""), Cell(""))
        return  # of one result alone there are all
    yield number(one.value, ".2g", "" if one.passed else "bad")
    yield _verdict(one)
    if alone:
        yield from (number(one.time, ".3f"), Cell(one.what))


def _verdict(one: Finding) -> Cell:
    if not one.passed:
        return Cell("NO", mark="bad")
    return Cell("yes", mark="good") if math.isfinite(one.limit) else Cell("note")


def _violation(one: Finding | None, n: int) -> tuple[Cell, ...]:
    if one is None:
        return (Cell(""),) * n
    return (number(one.value, ".2g"), number(one.time, ".3f"), Cell(one.what))[:n]
