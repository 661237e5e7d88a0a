"""Scenario files, and those that come with the package."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from human_gait import data
from human_gait.exceptions import ScenarioError
from human_gait.scenario.schema import nearest
from human_gait.scenario.text import read_toml
from human_gait.scenario.whole import Scenario, lawful_name

_PACKED = Path(data.__file__).parent / "scenarios"  # where an installed package has them
_EDITED = Path(data.__file__).parents[2] / "scenarios"  # where people edit them
_ENDING = ".toml"


def shipped_scenarios() -> dict[str, Path]:
    """Return the files of the scenarios that come with the package, by name."""
    folder = _PACKED if _PACKED.is_dir() else _EDITED
    return {path.stem: path for path in sorted(folder.glob(f"*{_ENDING}"))}


def shipped_studies() -> dict[str, Path]:
    """Return the files of the studies that come with the package, by name."""
    folder = (_PACKED if _PACKED.is_dir() else _EDITED) / "studies"
    return {path.stem: path for path in sorted(folder.glob(f"*{_ENDING}"))}


def scenario_file(path: str | Path) -> Path:
    """Return the file that is meant: `path`, or the shipped scenario of that name.

    A file of one's own comes first, and what looks like a file (``normal.toml``, ``a/normal``) is
    one.
    """
    own = Path(path)
    return own if _is_file(own) else shipped_scenarios().get(str(path), own)


def load_scenario(path: str | Path) -> Scenario:
    """Read a scenario from a TOML file.

    Parameters
    ----------
    path : str or Path
        The file; its name without ending names the scenario unless it has a key ``name``, with
        hyphens for signs that names cannot have (`lawful_name`). Where there is no such file, the
        name of a scenario that comes with the package, ``"normal"``.

    Returns
    -------
    Scenario

    Raises
    ------
    ScenarioError
        If the file cannot be read or settings are unknown, missing, of wrong type or not allowed;
        it tells all of them.
    """
    source = scenario_file(path)
    try:
        return Scenario.from_dict({"name": lawful_name(source.stem), **_read_toml(source)})
    except ScenarioError as error:
        raise error.found_in(str(source)) from None


def scenario_of(given: Scenario | str | Path) -> Scenario:
    """Return a scenario that is given itself, or by its file or name.

    Raises
    ------
    ScenarioError
        As `load_scenario`.
    """
    return given if isinstance(given, Scenario) else load_scenario(given)


def _hint(name: str) -> str:
    """Return what else could have been meant by the name of a scenario."""
    if _is_file(Path(name + _ENDING)):
        return f", did you mean {name}{_ENDING}?"
    files = shipped_scenarios()
    near = nearest(name, list(files))
    return f", did you mean {near[0]}?" if near else f"; the package has {', '.join(files)}"


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except ValueError:  # a path with a null character
        return False


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return read_toml(path)
    except (OSError, ValueError) as error:  # ValueError: a path with a null character
        reason = error.strerror if isinstance(error, OSError) else error
        missing = isinstance(error, FileNotFoundError) and path.name == str(path)
        hint = _hint(path.name) if missing else ""
        raise ScenarioError("", f"cannot be read: {reason}{hint}") from None
