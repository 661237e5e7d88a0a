"""Build the compiled kernel with the package, where there is a C++ compiler.

Hatchling calls the hook. Without a compiler the package is the same, but slower. What is built runs
on every x86-64 processor that has AVX2; others leave it out.
"""

from __future__ import annotations

import hashlib
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

SOURCE, LIBRARY = "human_gait/kernel/kernel.cpp", "human_gait/kernel/kernel.library"
FLAGS = ["-O3", "-ffp-contract=fast", "-fno-math-errno", "-fPIC", "-shared", "-Wall", "-Wextra"]
COMPILERS = ("c++", "g++", "clang++")
PROCESSORS = (["-march=x86-64-v3"], ["-mavx2", "-mfma"], [])
"""What is compiled for, the first that works: `kernel_runs_here` asks for AVX2 and FMA alone."""


class KernelHook(BuildHookInterface):
    """Compile before a wheel is made, also that of an editable installation."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002
        """Compile, and put the library into the wheel, which then is for this platform alone."""
        root = Path(self.root)
        if built(root / SOURCE, root / LIBRARY):
            build_data["artifacts"].append(LIBRARY)
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-{_platform()}"
        else:
            self.app.display_warning("the kernel is left out, solves take longer: no C++ compiler")


def built(source: Path, library: Path) -> bool:
    """Compile a library, unless it is there; return whether there is one."""
    digest = hashlib.sha256(source.read_bytes()).hexdigest()  # `kernel` refuses another's
    given = os.environ.get("CXXFLAGS")
    if not given and library.exists() and digest.encode() in library.read_bytes():
        return True
    compiler = os.environ.get("CXX") or next(filter(shutil.which, COMPILERS), None)
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        new = Path(folder, library.name)
        for flags in [shlex.split(given)] if given else PROCESSORS:
            command = [*FLAGS, f'-DKERNEL_SOURCE="{digest}"', *flags, "-o", str(new), str(source)]
            if compiler and _compiled([*shlex.split(compiler), *command]):
                new.replace(library)  # at once: others may be loading the old one
                return True
    library.unlink(missing_ok=True)
    return False


def _compiled(command: list[str]) -> bool:
    """Run a compiler; what it complains of goes to standard error."""
    try:
        done = subprocess.run(command, check=False, capture_output=True, text=True)
    except OSError as error:
        print(f"kernel: {command[0]}: {error}", file=sys.stderr)
        return False
    if done.returncode:
        print(f"kernel: {' '.join(command)}\n{done.stderr}", file=sys.stderr)
    return done.returncode == 0


def _platform() -> str:
    """Return the tag of this platform, or the one that is given."""
    if given := os.environ.get("WHEEL_PLATFORM"):
        return given
    from packaging.tags import platform_tags  # noqa: PLC0415, hatchling needs it too

    return next(platform_tags())
