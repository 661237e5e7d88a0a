"""A new scenario file that tells what each of its settings does."""

from __future__ import annotations

import os
import shlex
import textwrap
from collections.abc import Iterator
from pathlib import Path

from human_gait.exceptions import GaitError
from human_gait.results.folder import whole_file
from human_gait.scenario import Scenario, lawful_name, load_scenario, scenario_file
from human_gait.scenario.schema import Section
from human_gait.settings.editors import SCHEMA_FILE
from human_gait.settings.records import Setting, all_settings, as_text

USUAL = "preferred"
"""The scenario whose required settings a new one has: people choose this step at this speed."""

_WIDTH = 96
_ENDING = ".toml"
_HOW_TO = (
    '# A setting that begins with "#" is as it is by default: take the "#" away to change it.',
    '# Numbers are in the unit that is named; others can be given: "40 lb", "5 ft 9 in".',
)
_EXAMPLE = '#knee_flexion_r = ["0 deg", "70 deg"]'


def write_scenario(
    name: str = "", out: Path | None = None, template: str = "", force: bool = False
) -> Path:
    """Write a new scenario with all settings, explained.

    Parameters
    ----------
    name : str
        Its name; else that of the file.
    out : Path, optional
        The file, else ``NAME.toml``.
    template : str
        A scenario to begin with: one that comes with the package, or a file.
    force : bool
        Whether to replace a file that is there.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    GaitError
        If the file exists, the template cannot be read or the name is not allowed.
    """
    name = name.removesuffix(_ENDING) or (lawful_name(out.stem) if out else "walk")
    target = out or Path(f"{name}{_ENDING}")
    content = scenario_text(name, target, template)
    if os.path.lexists(target) and not force:
        raise GaitError(f"{target}: exists already, --force replaces it")
    with whole_file(target) as path:
        path.write_text(content, encoding="utf-8")
    return target


def scenario_text(name: str, target: Path, template: str = "") -> str:
    """Return the text of a scenario file, to be written as `target`, that explains all of it."""
    scenario = load_scenario(template or USUAL).replace(name=name)
    lines = [f"#:schema {SCHEMA_FILE.as_uri()}", *_head(target, template), ""]
    lines += _setting(
        next(all_settings()), as_text(name), as_usual=name == lawful_name(target.stem)
    )
    for section in Scenario.sections():
        lines += ["", "", *_section(scenario, section)]
    return "\n".join(lines) + "\n"


def _head(target: Path, template: str) -> Iterator[str]:
    yield from _leading_comment(template) if template else ()
    named = str(target) if str(target).isprintable() else "FILE"  # a comment is one line of text
    yield f"# Predict this walk: human-gait predict {shlex.quote(named)}"
    yield from _HOW_TO


def _leading_comment(template: str) -> Iterator[str]:
    """Yield what the template says of itself ahead of its settings."""
    file = scenario_file(template)
    text = file.read_text(encoding="utf-8-sig") if file.is_file() else ""  # a pipe is read once
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        if not line.startswith("#:"):
            yield line
    yield "#"


def _section(scenario: Scenario, name: str) -> Iterator[str]:
    section: Section = getattr(scenario, name)
    yield from _comment(str(type(section).__doc__).partition("\n")[0])
    yield f"[{name}]"
    settings = [each for each in all_settings() if each.section == name]
    table = section.to_table()
    for setting in settings:
        yield ""
        if setting.key in table:
            as_usual = section.follows(setting.key, scenario.about)
            yield from _setting(setting, as_text(table.pop(setting.key)), as_usual)
        else:  # it stands for every key that is left
            yield from _setting(setting, "", as_usual=True)
            yield from [f"{key} = {as_text(value)}" for key, value in table.items()] or [_EXAMPLE]


def _setting(setting: Setting, value: str, as_usual: bool) -> Iterator[str]:
    """Yield what is said of a setting, and the setting itself."""
    yield from _comment(setting.meaning)
    facts = [setting.allowed, f"default: {setting.default_words}"]
    facts += [f"source: {setting.source}"] if setting.source else []
    yield from _comment("; ".join(facts).replace("default: required", "required"))
    if value:
        yield f"{'#' if as_usual else ''}{setting.key} = {value}"


def _comment(text: str) -> list[str]:
    return [f"# {line}" for line in textwrap.wrap(text, _WIDTH, break_on_hyphens=False)]
