"""The files of a result folder, held against the gait beside them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from human_gait.checks.check import Check, Claim, Kind
from human_gait.results.names import VERIFICATION
from human_gait.walk.belonging import strangers
from human_gait.walk.gait import Gait

_FILES = Claim("other files off the gait", "files", Kind.FILE)


def folder_checks(gait: Gait, folder: Path) -> tuple[list[Check], Sequence[str]]:
    """Return the check of the files in the folder of a gait, and what is wrong with each.

    All count but ``verification.json``, which a check replaces.
    """
    wrong = list(strangers(gait, folder, (VERIFICATION,)))
    return [_FILES.found(float(len(wrong)), 0.0, 0.0)], wrong
