"""Reports that are made in a moment, for tests of what else is in them or of where they are."""

from human_gait.reporting import page, panels

PLAYBACK = '<!DOCTYPE html><title>walk</title><script>const quoted = "\'</iframe>";</script>'


def sparing(monkeypatch, groups=None):
    """Leave out what takes seconds to draw: curves but for some groups, pictures, the animation."""
    monkeypatch.setattr(page, "GROUPS", groups or {})
    monkeypatch.setattr(page, "ENERGY_GROUPS", {})
    monkeypatch.setattr(panels, "pictures", lambda *_: ())
    monkeypatch.setattr(page, "page_of", lambda *_, **__: PLAYBACK)
    monkeypatch.setattr(page, "still_address", lambda *_: "data:image/png;base64,")
