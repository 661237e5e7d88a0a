"""Settings of all tests.

``HYPOTHESIS_PROFILE=thorough pytest tests/test_faults.py`` tries ten times as many mutations.
"""

import os

import pytest
from hypothesis import settings
from sharing import forget

settings.register_profile("shared machine", deadline=None)  # a busy core is no failure
settings.register_profile("thorough", deadline=None, max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "shared machine"))


@pytest.fixture(scope="module")
def driver(tmp_path_factory):
    """A real browser, driven by Selenium."""
    from browser import chrome

    with chrome(tmp_path_factory.mktemp("profile")) as found:
        yield found


LONG = (
    *("test_browser.py", "test_study_runs.py", "test_readme.py", "test_gait_solve.py"),
    "test_tutorial.py",
)


def pytest_collection_modifyitems(items):
    """Begin with the longest files, that no core is left waiting for one of them in the end."""
    items.sort(key=lambda item: item.path.name not in LONG)


def pytest_unconfigure():
    """Leave nothing behind of what tests share (`solves`)."""
    forget()


@pytest.fixture(scope="session")
def exported(tmp_path_factory):
    """A walk and the folder of what readers of trials read of it."""
    from exports import walking

    from human_gait.export.formats import export_gait

    folder = tmp_path_factory.mktemp("exported")
    gait = walking("a rigid backpack")
    export_gait(gait, folder, ["mot", "grf", "sto", "trc", "c3d", "csv"])
    return gait, folder


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item):
    """Trace no whole solve, a fifth longer then: it is for quick tests to reach the lines."""
    tracing = getattr(item.config.pluginmanager.get_plugin("_cov"), "cov_controller", None)
    if tracing is None or not item.get_closest_marker("solve"):
        return (yield)
    tracing.pause()
    try:
        return (yield)
    finally:
        tracing.resume()
