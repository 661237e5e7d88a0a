"""The files of a result folder, held against the gait beside them."""

from __future__ import annotations

from pathlib import Path

from human_gait.checks.check import Check, Claim, Kind
from human_gait.results.names import VERIFICATION
from human_gait.walk.belonging import strangers
from human_gait.walk.gait import Gait

_FILES = Claim("other files off the gait", "files", Kind.FILE)


def folder_check(gait: Gait, folder: Path) -> Check:
    """Return the check of the files in the folder of a gait; it says what is wrong with each.

    All count but ``verification.json``, which is about to be replaced.
    """
    found = list(strangers(gait, folder, (VERIFICATION,)))
    what = "; ".join(f"{name}: {wrong}" for name, wrong in found)
    return _FILES.found(float(len(found)), 0.0, 0.0, what)
