"""Some settings of a scenario changed, under the names that a person would use for them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from human_gait import data
from human_gait.exceptions import ScenarioError
from human_gait.scenario.schema import About, Section, gathered, nearest, refuse, unknown


def changed_table(
    whole: Section, about: About, changes: Iterable[tuple[str, Any]]
) -> dict[str, Any]:
    """Return a scenario as a table in which some settings are changed.

    What is as by default is left out: it follows from what is changed. So does what a changed
    setting leads (`Section.leads`).

    Parameters
    ----------
    whole : Section
        The scenario.
    about : About
        What its defaults follow from.
    changes : pairs of str and value
        Settings by their dotted key, by their own name where only one section has it, or sections.

    Raises
    ------
    ScenarioError
        If a key is unknown, could mean several settings or is given twice.
    """
    table, errors = departing(whole, about), list[ScenarioError]()
    found: dict[str, Any] = {}
    for name, value in changes:
        with gathered(errors):
            key = full_key(type(whole), str(name))
            if key in found:
                raise ScenarioError(key, "is given twice")
            found[key] = value
    refuse(errors)
    for key in found:
        _make_way(table, whole, key)
    for key in sorted(found, key=lambda key: "." in key):  # sections first: keys change them
        _put(table, key, found[key])
    return table


def departing(whole: Section, about: About) -> dict[str, Any]:
    """Return a scenario as tables without the settings that would be the same if left out."""
    table = whole.to_table()
    for name in whole.sections():
        section: Section = getattr(whole, name)
        for key in section.kinds():
            if section.follows(key, about):
                table[name].pop(key, None)
    return table


def _make_way(table: dict[str, Any], whole: Section, key: str) -> None:
    """Take out what follows from a setting that is given anew."""
    name, _, setting = key.partition(".")
    kind = whole.sections().get(name)
    for led in kind.leads.get(setting, ()) if kind else ():
        table[name].pop(led, None)


def _put(table: dict[str, Any], key: str, value: Any) -> None:
    """Set one value of a table of tables; what is no table there stays, to be refused later."""
    name, dot, setting = key.partition(".")
    found = table.get(name, {})
    inside = found.to_table() if isinstance(found, Section) else found
    if not dot:
        table[name] = value
    elif isinstance(inside, Mapping):
        table[name] = {**inside, setting: value}


def full_key(whole: type[Section], name: str) -> str:
    """Return the dotted key that a name stands for.

    Raises
    ------
    ScenarioError
        If it stands for none, with the nearest, or for several, with all of them.
    """
    sections = whole.sections()
    if name in whole.kinds() or name.partition(".")[0] in sections:
        return name
    dotted = whole.inner_keys()
    meant = [key for key in dotted if key.partition(".")[2] == name]
    if len(meant) == 1:
        return meant[0]
    if meant:
        raise ScenarioError(name, f"could be several settings: say {' or '.join(meant)}")
    joints = [f"limits.{row['name']}" for row in data.rows("joint_limits")]
    bare = {key.partition(".")[2]: key for key in [*dotted, *joints]}
    near = nearest(name, [*whole.kinds(), *bare])
    if near and near[0] in bare:
        raise ScenarioError(name, f"unknown setting, did you mean {bare[near[0]]}?")
    raise unknown(name, name, [*whole.kinds(), *dotted], "setting")
