"""Settings that a user can find: listed, explained, in a new scenario and for editors."""

from human_gait.settings.records import Setting, all_settings

__all__ = ["Setting", "all_settings"]
