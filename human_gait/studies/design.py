"""The points of a study: every combination of what is varied that its design asks for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

from scipy.stats import qmc

from human_gait.studies.study_file import Design
from human_gait.studies.varied import Values

Point = Mapping[str, Any]


def points(vary: Mapping[str, Values], design: Design) -> Iterator[Point]:
    """Yield the settings of each walk, by dotted key; one without any if nothing is varied.

    The first setting of a grid changes slowest. Sobol points are scrambled (Owen), with the seed.
    """
    if not vary:
        yield {}
    elif design.kind == "grid":
        yield from (_named(vary, combined) for combined in product(*_steps(vary)))
    elif design.kind == "paired":
        yield from (_named(vary, combined) for combined in zip(*_steps(vary), strict=True))
    else:
        kind = qmc.Sobol if design.kind == "sobol" else qmc.LatinHypercube
        for shares in _sampled(kind(len(vary), rng=design.seed), design.count):
            drawn = zip(vary.values(), shares, strict=True)
            yield _named(vary, [values.drawn(share) for values, share in drawn])


def n_points(vary: Mapping[str, Values], design: Design) -> int:
    """Return how many points there are, without making them."""
    if design.count:
        return design.count if vary else 1
    lengths = [len(values.steps) for values in vary.values()]
    if design.kind == "paired":
        return lengths[0] if lengths else 1
    count = 1
    for length in lengths:
        count *= length
    return count


def _steps(vary: Mapping[str, Values]) -> list[tuple[Any, ...]]:
    return [values.steps for values in vary.values()]


def _named(vary: Mapping[str, Values], values: Any) -> Point:
    return dict(zip(vary, values, strict=True))


def _sampled(sampler: qmc.QMCEngine, count: int) -> list[list[float]]:
    """Return points in the unit cube; of Sobol's a power of two, cut to what is asked for.

    Sobol sequences are balanced in powers of two only; a part of one is as good as others are.
    """
    if isinstance(sampler, qmc.Sobol):
        whole = sampler.random_base2(max(count - 1, 1).bit_length())
        return [list(map(float, one)) for one in whole[:count]]
    return [list(map(float, one)) for one in sampler.random(count)]
