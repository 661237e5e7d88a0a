"""A folder that the processes of one run of pytest share, and that goes with the run."""

import os
from pathlib import Path
from shutil import rmtree
from tempfile import gettempdir

BESIDE_OTHERS = "PYTEST_XDIST_WORKER" in os.environ
RUN = os.getppid() if BESIDE_OTHERS else os.getpid()  # pytest-xdist starts the others from one
FOLDER = Path(gettempdir()) / f"human-gait-tests-{RUN}"


def forget():
    """Remove what was shared, unless others may still read it."""
    if not BESIDE_OTHERS:
        rmtree(FOLDER, ignore_errors=True)
