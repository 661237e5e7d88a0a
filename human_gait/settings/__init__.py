"""Settings that a user can find: listed, explained, in a new scenario and for editors."""

from human_gait.settings.editors import SCHEMA_FILE, json_schema, schema_text
from human_gait.settings.listing import explanation, listing
from human_gait.settings.records import Setting, all_settings
from human_gait.settings.template import scenario_text, write_scenario

__all__ = [
    "SCHEMA_FILE",
    "Setting",
    "all_settings",
    "explanation",
    "json_schema",
    "listing",
    "scenario_text",
    "schema_text",
    "write_scenario",
]
