"""The file of a study: which walk, what is varied, who walks, and what is asked of the result.

::

    scenario = "preferred"        # a file or a name, or a table [scenario] with the settings
    pace = "similar"              # each person at the speed and step of equal Froude number

    [vary]
    load.mass = [0, "20 lb", "40 lb"]
    walk.speed = { from = 1.0, to = 1.6, count = 4 }

    [design]
    kind = "sobol"                # grid, paired, sobol, latin-hypercube
    count = 64

    [population]
    sex = "both"
    count = 100

    [outputs]
    show = ["cost_of_transport"]
    limits = ["knee_extension_peak < 1.0"]
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import tomli_w

from human_gait.exceptions import ScenarioError
from human_gait.scenario import Scenario, load_scenario
from human_gait.scenario.files import shipped_studies
from human_gait.scenario.schema import gathered, refuse, unknown
from human_gait.scenario.text import read_toml
from human_gait.scenario.whole import lawful_name
from human_gait.stopping import TIME_LIMIT
from human_gait.studies.varied import Values, values_of

KINDS = ("grid", "paired", "sobol", "latin-hypercube")
PACES = ("given", "similar")
SEXES = ("male", "female", "both")
MOST_WALKS = 10_000_000
_DRAWN = ("sobol", "latin-hypercube")
_KEYS = (
    "name",
    "scenario",
    "pace",
    "tries",
    "time_limit",
    "vary",
    "design",
    "population",
    "outputs",
)


@dataclass(frozen=True)
class Design:
    """How the varied settings are combined.

    Attributes
    ----------
    kind : str
        ``grid``: every value with every other; ``paired``: the first with the first, and so on;
        ``sobol``, ``latin-hypercube``: points drawn between the ends.
    count, seed : int
        Of the points that are drawn.
    """

    kind: str = "grid"
    count: int = 0
    seed: int = 0


@dataclass(frozen=True)
class People:
    """Who walks, besides the person of the scenario.

    Attributes
    ----------
    sex : str
        ``male``, ``female`` or ``both``: half and half.
    count, seed : int
        As of `Population`.
    strength : bool
        Whether the percentile of strength is drawn, too.
    """

    sex: str = "both"
    count: int = 100
    seed: int = 0
    strength: bool = False


@dataclass(frozen=True)
class StudyFile:
    """All that a study file says.

    Attributes
    ----------
    name : str
    scenario : Scenario
        What is varied.
    vary : mapping of str to Values
        By the dotted key of the setting.
    pace : str
        ``given``: everyone at the speed and step of the scenario; ``similar``: at those of the same
        Froude number and the same step per leg length as the person of the scenario.
    tries : int
        From how many of the solver's own starts a walk is looked for before it counts as not found.
    time_limit : float, [s]
        For a walk; a guard only, since it makes a result depend on the machine.
    design : Design
    people : People or None
    show : tuple of str
        Columns of the index that matter most.
    limits : tuple of str
        Such as ``knee_extension_peak < 1.0``.
    """

    name: str
    scenario: Scenario
    vary: Mapping[str, Values] = field(default_factory=dict)
    pace: str = "given"
    tries: int = 2
    time_limit: float = TIME_LIMIT
    design: Design = field(default_factory=Design)
    people: People | None = None
    show: tuple[str, ...] = ()
    limits: tuple[str, ...] = ()

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a study file, or the study of that name that comes with the package.

        Raises
        ------
        ScenarioError
            If it cannot be read, or for each thing in it that is not allowed: file, key, value.
        """
        source, studies = Path(path), shipped_studies()
        if not source.exists():
            source = studies.get(str(path), source)
        try:
            table = read_toml(source)
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else error
            if isinstance(error, FileNotFoundError):
                reason = f"{reason}; the package has {', '.join(studies)}"
            raise ScenarioError("", f"cannot be read: {reason}", source=str(source)) from None
        except ScenarioError as error:
            raise error.found_in(str(source)) from None
        try:
            return cls.from_table({"name": lawful_name(source.stem), **table}, source.parent)
        except ScenarioError as error:
            raise _placed(error, source) from None

    @classmethod
    def from_table(cls, table: Mapping[str, Any], folder: Path = Path()) -> Self:
        """Make a study from tables as they stand in a file; scenarios are looked for beside it.

        Raises
        ------
        ScenarioError
            For each thing that is not allowed.
        """
        errors = [unknown(key, key, _KEYS, "key of a study") for key in table if key not in _KEYS]
        values: dict[str, Any] = {}
        for name, read in _READERS.items():
            if name in table:
                with gathered(errors):
                    values |= read(table[name])
        with gathered(errors):
            values["scenario"] = _scenario(table.get("scenario"), folder)
        with gathered(errors):
            values["vary"] = values_of(table.get("vary", {}))
        with gathered(errors):
            design = values.get("design", Design())
            _check_design(design, values.get("vary", {}))
        refuse(errors)
        return cls(**values)

    def to_table(self) -> dict[str, Any]:
        """Return the study as plain tables, the scenario in full; inverse of `from_table`."""
        table: dict[str, Any] = {
            "name": self.name,
            "pace": self.pace,
            "tries": self.tries,
            "time_limit": self.time_limit,
            "scenario": self.scenario.to_dict(),
            "vary": {key: values.to_plain() for key, values in self.vary.items()},
            "outputs": {"show": list(self.show), "limits": list(self.limits)},
        }
        table["design"] = {"kind": self.design.kind, "seed": self.design.seed}
        if self.design.count:
            table["design"]["count"] = self.design.count
        if self.people:
            table["population"] = vars(self.people).copy()
        return table

    def to_toml(self) -> str:
        """Return the text of a file that reads back equal."""
        return tomli_w.dumps(self.to_table())


def _placed(error: ScenarioError, source: Path) -> ScenarioError:
    """Return an error with the file; those of another file, the scenario's, have theirs."""
    each = [one if one.source else one.found_in(str(source)) for one in error.errors]
    return ScenarioError.of(each)


def _scenario(given: object, folder: Path) -> Scenario:
    if isinstance(given, Mapping):
        return Scenario.from_dict(given)
    if not isinstance(given, str):
        rule = "is missing" if given is None else "must be a file, a name or a table"
        raise ScenarioError("scenario", f'{rule}: scenario = "normal"', given)
    beside = folder / given
    return load_scenario(beside if beside.is_file() else given)


def _check_design(design: Design, vary: Mapping[str, Values]) -> None:
    """Refuse a design that does not fit what is varied."""
    drawn = design.kind in _DRAWN
    if drawn and not design.count:
        raise ScenarioError("design.count", f"is missing: how many points {design.kind} draws")
    if design.count and not drawn:
        allowed = f"only {' and '.join(_DRAWN)} draw points"
        raise ScenarioError("design.count", f"is of no use with {design.kind}: {allowed}")
    lengths = {key: len(values.steps) for key, values in vary.items()}
    if design.kind == "paired" and len(set(lengths.values())) > 1:
        told = ", ".join(f"{key} has {count}" for key, count in lengths.items())
        raise ScenarioError("vary", f"paired settings need as many values each: {told}")


def _word(key: str, given: object, allowed: tuple[str, ...]) -> str:
    if given not in allowed:
        raise ScenarioError(key, f"must be one of {', '.join(allowed)}", given)
    return str(given)


def _count(key: str, given: object, least: int, most: int) -> int:
    if isinstance(given, bool) or not isinstance(given, int) or not least <= given <= most:
        raise ScenarioError(key, f"must be a whole number from {least} to {most}", given)
    return given


def _seconds(given: object) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float) or not 1 <= given <= 86400:
        raise ScenarioError("time_limit", "must be a number from 1 to 86400 s", given)
    return float(given)


def _parts(name: str, given: object, known: tuple[str, ...]) -> Mapping[str, Any]:
    """Return a table of a study whose keys are known."""
    if not isinstance(given, Mapping):
        raise ScenarioError(name, f"must be a table with {', '.join(known)}", given)
    refuse([unknown(f"{name}.{key}", key, known, "key") for key in given if key not in known])
    return given


def _design(given: object) -> dict[str, Any]:
    table = _parts("design", given, ("kind", "count", "seed"))
    kind = _word("design.kind", table.get("kind", "grid"), KINDS)
    count = _count("design.count", table["count"], 1, MOST_WALKS) if "count" in table else 0
    return {"design": Design(kind, count, _count("design.seed", table.get("seed", 0), 0, 2**31))}


def _people(given: object) -> dict[str, Any]:
    table = _parts("population", given, ("sex", "count", "seed", "strength"))
    strength = table.get("strength", False)
    if not isinstance(strength, bool):
        raise ScenarioError("population.strength", "must be true or false", strength)
    return {
        "people": People(
            _word("population.sex", table.get("sex", "both"), SEXES),
            _count("population.count", table.get("count", 100), 1, MOST_WALKS),
            _count("population.seed", table.get("seed", 0), 0, 2**31),
            strength,
        )
    }


def _outputs(given: object) -> dict[str, Any]:
    table = _parts("outputs", given, ("show", "limits"))
    return dict(_texts(table))


def _texts(table: Mapping[str, Any]) -> Iterator[tuple[str, tuple[str, ...]]]:
    for key, value in table.items():
        if not isinstance(value, list) or not all(isinstance(one, str) for one in value):
            raise ScenarioError(f"outputs.{key}", "must be a list of texts", value)
        yield key, tuple(value)


def _name(given: object) -> dict[str, Any]:
    if not isinstance(given, str) or lawful_name(given) != given:
        allowed = "must be a name of letters, digits, '_', '-', '.' and blanks"
        raise ScenarioError("name", allowed, given)
    return {"name": given}


_READERS = {
    "name": _name,
    "pace": lambda given: {"pace": _word("pace", given, PACES)},
    "tries": lambda given: {"tries": _count("tries", given, 1, 20)},
    "time_limit": lambda given: {"time_limit": _seconds(given)},
    "design": _design,
    "population": _people,
    "outputs": _outputs,
}
