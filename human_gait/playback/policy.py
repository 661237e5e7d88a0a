"""What a page may do: run the scripts that it was made with, and load nothing."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable

NOTHING = "default-src 'none'; base-uri 'none'; form-action 'none'"
"""Content Security Policy of what is only read."""


def content_policy(scripts: Iterable[str]) -> str:
    """Return the Content Security Policy of a page, as its ``meta`` element has it.

    Scripts are allowed by what they say: one that came into the page with the text of a file does
    not run. Styles stand everywhere in the page; with no source that they could load from they
    only paint.

    Parameters
    ----------
    scripts : iterable of str
        Texts of the ``script`` elements of the page and of the pages in its frames, which have to
        keep to its policy, too.
    """
    sources = " ".join(map(_source, scripts))
    return f"{NOTHING}; script-src {sources}; style-src 'unsafe-inline'; img-src data:"


def _source(script: str) -> str:
    digest = hashlib.sha256(script.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"
