"""What a file was made from, in the words and within the rules of each format."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from human_gait.scenario import Scenario
from human_gait.walk.described import gait_digest, no_walk
from human_gait.walk.gait import Gait


@dataclass(frozen=True)
class Note:
    """What a file was made from.

    Attributes
    ----------
    scenario : Scenario or None
        With all its settings.
    digest : str
        Of the gait, as `gait_digest` has it; empty where there is none.
    no_walk : str
        One sentence if the gait is no walk, else empty.
    """

    scenario: Scenario | None = None
    digest: str = ""
    no_walk: str = ""

    @classmethod
    def of(cls, gait: Gait) -> Note:
        """Return the note of what is made from a gait."""
        return cls(gait.scenario, gait_digest(gait), no_walk(gait))

    def entries(self) -> dict[str, Any]:
        """Return what there is to say, by name, for files that hold JSON."""
        scenario = self.scenario.to_dict() if self.scenario else None
        said = {"no_walk": self.no_walk, "gait_digest": self.digest, "scenario": scenario}
        return {name: what for name, what in said.items() if what}

    def lines(self) -> list[str]:
        """Return ``name=value`` for each entry, ASCII, the scenario as JSON."""
        return [f"{name}={_on_one_line(what)}" for name, what in self.entries().items()]

    def short(self) -> list[str]:
        """Return the lines without the scenario."""
        return [line for line in self.lines() if not line.startswith("scenario=")]

    def xml(self, more: Iterable[str] = ()) -> str:
        """Return the text of a comment of XML, in which no two hyphens may meet."""
        lines = "\n".join([*self.lines(), *more])
        return f"\n{lines.replace('--', _TWO_HYPHENS)}\n".replace("--", "- -")


_TWO_HYPHENS = "-\\u002d"  # the same to a reader of JSON


def _on_one_line(what: Any) -> str:
    text = what if isinstance(what, str) else json.dumps(what)
    return text.encode("ascii", "backslashreplace").decode()
