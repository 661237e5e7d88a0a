"""People drawn as they are among 4,082 men and 1,986 women: stature, mass, lengths of segments.

Stature and mass have the percentiles of ANSUR II, and its correlation. A measure of a segment is
its regression on both, with residuals that are correlated as those of the survey. Measures are
taken between landmarks, lengths of the body here between the centres of joints: each length is what
it is for the median person, times measure over the median's measure.

References
----------
C. C. Gordon et al., "2012 Anthropometric Survey of U.S. Army Personnel: Methods and Summary
Statistics", Natick/TR-15/007 (2014); ``data/ansur2``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from statistics import NormalDist
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from human_gait import data
from human_gait.arrays import FloatArray
from human_gait.exceptions import ScenarioError
from human_gait.scenario import Subject
from human_gait.scenario.lengths import usual_lengths
from human_gait.scenario.survey import at_score, percentile_of

MEASURES: Mapping[str, Mapping[str, float]] = {
    "thigh": {"trochanterionheight": 1.0, "tibialheight": -1.0},
    "shank": {"tibialheight": 1.0, "lateralmalleolusheight": -1.0},
    "ankle_height": {"lateralmalleolusheight": 1.0},
    "foot": {"footlength": 1.0},
    "hip_width": {"bicristalbreadth": 1.0},
    "shoulder_width": {"biacromialbreadth": 1.0},
    "upper_arm": {"acromionradialelength": 1.0},
    "forearm": {"radialestylionlength": 1.0},
    "hand": {"handlength": 1.0},
    "head_and_neck": {"stature": 1.0, "cervicaleheight": -1.0},
}
"""Lengths by name, and the sums of measures of the survey that each grows with."""

SEXES = ("female", "male")

_DRAWN = ("stature", "mass")
_TAKEN = sorted({name for parts in MEASURES.values() for name in parts} - {*_DRAWN})
_MOST_DRAWS = 100
_NORMAL = NormalDist()


@dataclass(frozen=True)
class Population:
    """Random people, the same for a sex and a seed however many are asked for.

    A study can so grow from a hundred people to a thousand. Stature, mass and lengths are drawn
    together, as ANSUR II (``data/ansur2``) has them; who would leave the ranges that settings allow
    is drawn anew. These are soldiers of 17 to 58 years: hardly any is very small, very heavy or
    old.

    Strength is the 50th percentile for a person's sex, stature and mass, or drawn uniformly from
    the 1st to the 99th. How it falls with age is not in the survey: ages are told, of the survey's
    distribution and independent of all else, and change nothing.

    >>> people = hg.Population("both", 100)
    >>> people[0]
    >>> walks = [hg.Scenario("walk", hg.comfortable_walk(who), who) for who in people]

    Parameters
    ----------
    sex : str
        ``male``, ``female``, or ``both``: women and men in turn, those of the two populations.
    n : int
        How many, at least 1.
    seed : int
        Not below 0. Another one makes other people.
    strength : bool
        Whether the percentile of strength is drawn; else it is 50.

    Raises
    ------
    ValueError
        If one of these is not so.
    """

    sex: str
    n: int
    seed: int = 0
    strength: bool = False

    def __post_init__(self) -> None:
        if self.sex not in (*SEXES, "both"):
            raise ValueError(f"sex is {self.sex!r}, must be one of male, female, both")
        for name, least in (("n", 1), ("seed", 0)):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
                raise ValueError(f"{name} is {value!r}, must be a whole number from {least}")

    def __len__(self) -> int:
        return int(self.n)

    @overload
    def __getitem__(self, index: int) -> Subject: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Subject, ...]: ...
    def __getitem__(self, index: int | slice) -> Subject | tuple[Subject, ...]:
        """Return one person, or several, in the order in which they are drawn."""
        if isinstance(index, slice):
            return tuple(self[k] for k in range(len(self))[index])
        return self._drawn(range(len(self))[index])[0]

    def __iter__(self) -> Iterator[Subject]:
        return (self[k] for k in range(len(self)))

    def to_table(self) -> dict[str, npt.NDArray[Any]]:
        """Return the people as columns of length n: what `Subject` has, and what it means.

        ``stature_percentile`` and ``mass_percentile`` are those of the sex in ANSUR II;
        ``leg_length`` and ``trunk`` follow from the rest; ``age``, [year], changes nothing.
        """
        rows = [_row(*self._drawn(k)) for k in range(len(self))]
        return {name: np.array([row[name] for row in rows]) for name in rows[0]}

    def _drawn(self, k: int) -> tuple[Subject, float]:
        """Return person k and the age."""
        sex, number = (SEXES[k % 2], k // 2) if self.sex == "both" else (self.sex, k)
        return _person(sex, int(self.seed), number, self.strength)


def _row(who: Subject, age: float) -> dict[str, Any]:
    shares = {"stature": 1000.0 * who.stature, "mass": who.mass}
    return {
        "sex": who.sex,
        "stature": who.stature,
        "mass": who.mass,
        **{f"{name}_percentile": percentile_of(who.sex, name, x) for name, x in shares.items()},
        "strength": who.strength,
        "age": age,
        "leg_length": who.leg_length,
        "trunk": who.trunk,
        **who.lengths,
    }


@lru_cache(maxsize=10_000)
def _person(sex: str, seed: int, number: int, strength: bool) -> tuple[Subject, float]:
    """Draw one person, from random numbers of his or her own, and the age [year]."""
    rng = np.random.default_rng([seed, number, 1 + SEXES.index(sex)])
    survey = _survey(sex)
    for _ in range(_MOST_DRAWS):
        z = rng.standard_normal(len(_DRAWN) + len(_TAKEN) + 2)
        percentile = round(1.0 + 98.0 * _NORMAL.cdf(z[-1]), 2) if strength else 50.0
        try:
            who = survey.person(z[:2], z[2:-2], percentile)
        except ScenarioError:  # nobody whom the settings allow
            continue
        return who, round(at_score(sex, "age", z[-2]), 1)
    raise RuntimeError(f"no person among {_MOST_DRAWS} draws")


@dataclass(frozen=True, eq=False)
class _Survey:
    """What the survey says of one sex.

    Attributes
    ----------
    sex : str
    correlation : float
        Of the normal scores of stature and mass.
    intercept : (k,) array, [mm]
        Of the regressions of the measures ``_TAKEN``.
    slopes : (k, 2) array
        By stature [mm/mm] and by mass [mm/kg].
    root : (k, k) array, [mm]
        Of the covariance of the residuals, lower triangular.
    """

    sex: str
    correlation: float
    intercept: FloatArray
    slopes: FloatArray
    root: FloatArray

    def person(self, z: FloatArray, residual: FloatArray, strength: float) -> Subject:
        """Return a person for independent normal numbers.

        Raises
        ------
        ScenarioError
            If settings do not allow it.
        """
        of_mass = self.correlation * z[0] + np.sqrt(1.0 - self.correlation**2) * z[1]
        stature, mass = at_score(self.sex, "stature", z[0]), at_score(self.sex, "mass", of_mass)
        found, median = self._measures(stature, mass, residual), self._median()
        lengths = {name: round(x * found[name] / median[name], 4) for name, x in self._usual()}
        body = {"stature": round(stature / 1000.0, 4), "mass": round(mass, 2)}
        return Subject.from_table({"sex": self.sex, **body, "strength": strength, **lengths})

    def _measures(self, stature: float, mass: float, residual: FloatArray) -> dict[str, float]:
        """Return what the lengths grow with, [mm], of someone of a stature [mm] and mass [kg]."""
        values = self.intercept + self.slopes @ np.array([stature, mass]) + self.root @ residual
        taken = dict(zip(_TAKEN, values, strict=True)) | {"stature": stature}
        return {
            name: float(sum(sign * taken[part] for part, sign in parts.items()))
            for name, parts in MEASURES.items()
        }

    def _median(self) -> dict[str, float]:
        stature, mass = (at_score(self.sex, name, 0.0) for name in _DRAWN)
        return self._measures(stature, mass, np.zeros(len(_TAKEN)))

    def _usual(self) -> Iterator[tuple[str, float]]:
        """Yield the lengths of the median person, [m]."""
        return iter(usual_lengths(self.sex, at_score(self.sex, "stature", 0.0) / 1000.0).items())


@cache
def _survey(sex: str) -> _Survey:
    rows = {
        row["measure"]: row for row in data.rows("ansur2/length_regressions") if row["sex"] == sex
    }
    taken = [rows[name] for name in _TAKEN]
    columns = ("intercept_mm", "per_mm_stature", "per_kg_mass", "residual_sd_mm")
    intercept, by_stature, by_mass, sd = (
        np.array([float(row[column]) for row in taken]) for column in columns
    )
    r = correlations(sex, [*_DRAWN, *_TAKEN])
    # Partial correlation: what stature and mass leave, R_mm - R_md R_dd^-1 R_dm
    left = r[2:, 2:] - r[2:, :2] @ np.linalg.solve(r[:2, :2], r[:2, 2:])
    spread = sd / np.sqrt(np.diag(left))
    root = np.asarray(np.linalg.cholesky(left * np.outer(spread, spread)), dtype=np.float64)
    slopes = np.stack([by_stature, by_mass], axis=1)
    return _Survey(sex, _between_scores(sex, float(r[0, 1])), intercept, slopes, root)


def correlations(sex: str, measures: Sequence[str]) -> FloatArray:
    """Return Pearson's r of measures of the survey with each other."""
    rows = {row["measure"]: row for row in data.rows("ansur2/correlations") if row["sex"] == sex}
    return np.array([[float(rows[one][other]) for other in measures] for one in measures])


def _between_scores(sex: str, r: float) -> float:
    """Return the correlation of normal scores for Pearson's r of stature and mass.

    Mass is near lognormal, of s^2 = ln(1 + (SD / mean)^2): r of stature and ln m is larger than
    that of stature and m by sqrt(exp(s^2) - 1) / s.
    """
    (row,) = (
        row
        for row in data.rows("ansur2/percentiles")
        if (row["sex"], row["measure"]) == (sex, "mass")
    )
    variation = float(row["sd"]) / float(row["mean"])
    return float(r * variation / np.sqrt(np.log1p(variation**2)))
