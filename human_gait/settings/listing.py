"""Settings as a person reads them: all in a table, or some of them explained."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from human_gait.body.skeleton import DOF_NAMES
from human_gait.scenario import Scenario
from human_gait.scenario.limits import range_rule
from human_gait.scenario.schema import unknown
from human_gait.scenario.values import or_quantity
from human_gait.settings.records import Setting, all_settings

_WIDEST_DEFAULT = 24


def listing() -> str:
    """Return the table of all settings: a heading for each section, a line for each setting."""
    return "\n\n".join(_table(name) for name in ("", *Scenario.sections()))


def explanation(key: str) -> str:
    """Return everything about a setting, about all of one name, or about a section.

    Raises
    ------
    ScenarioError
        If there is no setting or section of that name, with the nearest.
    """
    found = [each for each in all_settings() if key in (each.section, each.dotted, each.key)]
    if key.removeprefix("limits.") in DOF_NAMES:
        found = [each for each in all_settings() if each.key == "<joint>"]
    if not found:
        raise unknown(key, key, _names(), "setting")
    told = [_heading(key), ""] if key in Scenario.sections() else []
    told.append("\n\n".join("\n".join(_explained(each)) for each in found))
    if key in ("limits", "limits.frozen", "frozen"):
        told += ["", "joints: " + ", ".join(DOF_NAMES)]
    return "\n".join(told)


def _names() -> list[str]:
    """Return everything that can be asked for, whole sections first."""
    settings = list(all_settings())
    names = [*Scenario.sections(), *(each.key for each in settings)]
    return list(dict.fromkeys([*names, *(each.dotted for each in settings), *DOF_NAMES]))


def _heading(section: str) -> str:
    words = str(Scenario.sections()[section].__doc__).partition("\n")[0]
    return f"[{section}]  {words}"


def _table(section: str) -> str:
    rows = [
        (each.key, _shortened(each.default_words), _short_range(each), each.meaning)
        for each in all_settings()
        if each.section == section
    ]
    head = _heading(section) if section else "at the top of the file"
    return "\n".join([head, *_columns(rows)])


def _columns(rows: Sequence[tuple[str, ...]]) -> Iterator[str]:
    """Yield each row with its first columns as wide as those of every section."""
    widths = (22, _WIDEST_DEFAULT, 30)
    for row in rows:
        cells = [cell.ljust(width) for cell, width in zip(row, widths, strict=False)]
        yield "  " + "  ".join([*cells, row[-1]]).rstrip()


def _shortened(words: str) -> str:
    return words if len(words) <= _WIDEST_DEFAULT else words[: _WIDEST_DEFAULT - 3] + "..."


def _short_range(setting: Setting) -> str:
    """Return choices or range without the words around them."""
    if setting.choices:
        return " | ".join(setting.choices)
    if setting.low is None:
        return {"<joint>": "[lower, upper]", "frozen": "names of joints"}.get(setting.key, "text")
    each = "each " if setting.count > 1 else ""
    return f"{each}{setting.low:g} to {setting.high:g} {setting.unit}".rstrip()


def _explained(setting: Setting) -> Iterator[str]:
    """Yield the lines about one setting."""
    yield setting.dotted
    yield f"  {setting.meaning}"
    rule = range_rule("") if setting.key == "<joint>" else {"unit": setting.unit}
    yield f"  allowed  {setting.allowed}{or_quantity(rule)}"
    yield f"  default  {setting.default_words}"
    if setting.source:
        yield f"  source   {setting.source}"
