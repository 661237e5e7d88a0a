"""The process of ``human-gait``: signals are heeded before anything heavy is imported."""

from __future__ import annotations

import gc
import os
import signal
import sys

from human_gait.stopping import JOB_SIGNALS, heed_for_good

_OBJECTS = 100_000
"""New objects after which Python looks for garbage: imports make as many, and none is garbage."""


def main() -> None:
    """Run the command line of this process, which ends with it."""
    heed_for_good(JOB_SIGNALS)
    try:
        code = ended()
    except KeyboardInterrupt:
        code = _interrupted()
    for number in JOB_SIGNALS:  # all is done
        signal.signal(number, signal.SIG_IGN)
    gc.freeze()  # it all ends here: Python would look for garbage in it, for a quarter of a second
    sys.exit(code)


def ended() -> int:
    """Run the command line and return its exit code.

    Linear algebra gets one thread unless told otherwise: the matrices are small, and sums in
    another order would lead the solvers along another path.
    """
    from human_gait.faults import BAD_INPUT  # noqa: PLC0415, signals come first
    from human_gait.results.streams import Outlet, outlet  # noqa: PLC0415
    from human_gait.surroundings import process_is_ours  # noqa: PLC0415
    from human_gait.terminal import complain  # noqa: PLC0415

    process_is_ours()
    gc.set_threshold(_OBJECTS)
    sys.stdout, sys.stderr = outlet(sys.stdout), outlet(sys.stderr)
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    code = _run()
    if sys.stdout:
        sys.stdout.flush()
    if Outlet.failure and code == 0:
        code = complain(f"the output cannot be written: {Outlet.failure}", BAD_INPUT)
    return code


def _run() -> int:
    """Run the command; what stops it from being imported is told as well."""
    from human_gait.faults import failed  # noqa: PLC0415
    from human_gait.late import late  # noqa: PLC0415

    try:
        run = late("cli", "run")
    except KeyboardInterrupt:
        return _interrupted()
    except BaseException as error:  # noqa: BLE001, nothing ends with a traceback
        return failed(error)
    return int(run(sys.argv[1:]))


def _interrupted() -> int:
    from human_gait.faults import interrupted  # noqa: PLC0415

    return interrupted()
