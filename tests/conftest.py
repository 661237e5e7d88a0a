"""Settings of all tests.

``HYPOTHESIS_PROFILE=thorough pytest tests/test_faults.py`` tries ten times as many mutations.
"""

import os

from hypothesis import settings
from sharing import forget

settings.register_profile("shared machine", deadline=None)  # a busy core is no failure
settings.register_profile("thorough", deadline=None, max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "shared machine"))


def pytest_unconfigure():
    """Leave nothing behind of what tests share (`solves`)."""
    forget()
