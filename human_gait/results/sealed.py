"""JSON files that tell which walk they belong to, and whether they are as they were written.

``gait`` is the digest of that walk (`gait_digest`), ``digest`` that of everything else in the file.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

MARK = rb'gaits?(?:_digest)?(?:=|\0|": |" content=)"?([0-9a-f]{16})'
"""How files of all kinds say which gait they are of: a pattern, whose group is the digest."""

_SEAL = "digest"
_DIGITS = 16


def write_json(path: Path, content: Mapping[str, Any], gait: str | Mapping[str, str]) -> None:
    """Write a JSON file that belongs to a walk, or to several.

    Parameters
    ----------
    path : Path
    content : mapping
        Numbers that are not finite become null: JSON has none.
    gait : str or mapping of str to str
        The digest of the walk, or of each by its name.
    """
    key = "gait" if isinstance(gait, str) else "gaits"
    whole = {key: gait, **plain(content)}
    text = json.dumps({_SEAL: _seal(whole), **whole}, indent=2, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def is_broken(content: Any) -> bool:
    """Tell whether a content was changed since it was written; of older files nobody knows."""
    if not isinstance(content, Mapping) or _SEAL not in content:
        return False
    return bool(content[_SEAL] != _seal({k: v for k, v in content.items() if k != _SEAL}))


def digest_of(content: bytes) -> str:
    """Return 16 hexadecimal digits of a content."""
    return hashlib.sha256(content).hexdigest()[:_DIGITS]


def plain(content: Any) -> Any:
    """Return a content whose numbers are finite or None."""
    if isinstance(content, Mapping):
        return {key: plain(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [plain(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


def _seal(content: Mapping[str, Any]) -> str:
    """Return the digest of a content, however it is spaced and ordered."""
    try:
        text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    except ValueError:  # an integer of thousands of digits
        return ""
    return digest_of(text.encode("ascii"))
