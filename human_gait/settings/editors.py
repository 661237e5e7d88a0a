"""The JSON schema of scenarios, by which editors complete, explain and check what is typed.

Draft 4, the newest that editors of TOML know. What depends on several settings (the order of the
phases, the reach of the legs) is left to the loader.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from human_gait import data
from human_gait.body.skeleton import DOF_NAMES, in_words
from human_gait.scenario import Scenario
from human_gait.scenario.limits import NOT_FROZEN, range_rule
from human_gait.scenario.schema import Section
from human_gait.scenario.units import DIMENSIONS, quantity_pattern
from human_gait.settings.records import Setting, all_settings

SCHEMA_FILE = Path(data.__file__).parent / "scenario.schema.json"
"""Where the schema is installed; ``human-gait settings --json-schema`` writes it."""


def json_schema() -> dict[str, Any]:
    """Return the schema of a scenario."""
    tables = {name: _table(name, kind) for name, kind in Scenario.sections().items()}
    top = {each.key: _described(each) for each in all_settings() if not each.section}
    return {
        "$schema": "http://json-schema.org/draft-04/schema#",
        "title": "A scenario of human-gait",
        **_object({**top, **tables}, ["walk"]),
        "definitions": {
            _kind(unit): {"type": "string", "pattern": quantity_pattern(unit)}
            for unit in DIMENSIONS
        },
    }


def schema_text() -> str:
    """Return the schema as the text of its file."""
    return json.dumps(json_schema(), indent=1, ensure_ascii=True) + "\n"


def _table(name: str, kind: type[Section]) -> dict[str, Any]:
    """Return the schema of one section."""
    settings = {each.key: each for each in all_settings() if each.section == name}
    required = [key for key, setting in settings.items() if setting.required]
    if name == "limits":
        inside = _limits(*settings.values())
    else:
        inside = {key: _described(setting) for key, setting in settings.items()}
    words = str(kind.__doc__).partition("\n")[0]
    return {"description": words, **_object(inside, required)}


def _object(properties: Mapping[str, Any], required: list[str]) -> dict[str, Any]:
    table = {"type": "object", "properties": properties, "additionalProperties": False}
    return {**table, "required": required} if required else table  # draft 4 wants no empty list


def _described(setting: Setting) -> dict[str, Any]:
    """Return the schema of one setting, with what an editor shows of it."""
    told = [f"{setting.meaning}\n\n{setting.allowed}; default: {setting.default_words}"]
    told += [f"source: {setting.source}"] if setting.source else []
    shown: dict[str, Any] = {"description": "\n\n".join(told)}
    if setting.default is not None:
        many = isinstance(setting.default, tuple)
        shown["default"] = list(setting.default) if many else setting.default
    return {**shown, **_values(setting)}


def _values(setting: Setting) -> dict[str, Any]:
    if setting.choices:
        return {"enum": list(setting.choices)}
    if setting.low is None:
        return {"type": "string", "pattern": f"^(?:{setting.pattern})$"}
    rule = {"unit": setting.unit, "range": (setting.low, setting.high)}
    if setting.whole:
        return {"type": "integer", "minimum": setting.low, "maximum": setting.high}
    return _number(rule) if setting.count == 1 else _vector(rule, setting.count)


def _number(rule: Mapping[str, Any]) -> dict[str, Any]:
    """Return the schema of a number or, if it has a dimension, of a quantity."""
    low, high = rule["range"]
    number = {"type": "number", "minimum": low, "maximum": high}
    if rule["unit"] not in DIMENSIONS:
        return number
    return {"anyOf": [number, {"$ref": f"#/definitions/{_kind(rule['unit'])}"}]}


def _kind(unit: str) -> str:
    """Return the name of what is measured in a unit, without its article."""
    return DIMENSIONS[unit].noun.partition(" ")[2].replace(" ", "_")


def _vector(rule: Mapping[str, Any], count: int) -> dict[str, Any]:
    return {"type": "array", "items": _number(rule), "minItems": count, "maxItems": count}


def _limits(frozen: Setting, own: Setting) -> dict[str, Any]:
    """Return the schemas of what stands under ``[limits]``, every joint by its name."""
    names = [name for name in DOF_NAMES if name not in NOT_FROZEN]
    items = {"type": "array", "items": {"enum": names}}
    return {
        "frozen": {"description": frozen.meaning, "default": [], **items},
        **{name: _joint(name, own.meaning) for name in DOF_NAMES},
    }


def _joint(name: str, meaning: str) -> dict[str, Any]:
    rule = range_rule(name)
    words = f"{in_words(name)}, [lower, upper] in {rule['unit']}: {meaning}"
    return {"description": words, **_vector(rule, 2)}
