"""Build the compiled kernel with the package, where there is a C++ compiler.

Hatchling calls the hook. Without a compiler the package is the same, but slower; what is built is
for this processor. `.ci/build_wheel` builds for all that have AVX2.
"""

from __future__ import annotations

import hashlib
import os
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

SOURCE, LIBRARY = "human_gait/kernel/kernel.cpp", "human_gait/kernel/kernel.library"
FLAGS = ["-O3", "-ffp-contract=fast", "-fno-math-errno", "-fPIC", "-shared", "-Wall", "-Wextra"]
COMPILERS = ("c++", "g++", "clang++")


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
            self.app.display_warning("no C++ compiler: the kernel is left out, solves take longer")


def built(source: Path, library: Path) -> bool:
    """Compile a library, unless it is newer than its source; return whether there is one."""
    given = os.environ.get("CXXFLAGS")
    if not given and library.exists() and library.stat().st_mtime >= source.stat().st_mtime:
        return True
    digest = hashlib.sha256(source.read_bytes()).hexdigest()  # `kernel` refuses that of another
    compiler = os.environ.get("CXX") or next(filter(shutil.which, COMPILERS), None)
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        new = Path(folder, library.name)
        for flags in [shlex.split(given)] if given else [["-march=native"], ["-mcpu=native"], []]:
            if compiler and _compiled(
                [*shlex.split(compiler), *_flags(digest), *flags], source, new
            ):
                new.replace(library)  # at once: others may be loading the old one
                return True
    library.unlink(missing_ok=True)
    return False


def _flags(digest: str) -> list[str]:
    return [*FLAGS, f'-DKERNEL_SOURCE="{digest}"']


def _compiled(command: list[str], source: Path, library: Path) -> bool:
    try:
        arguments = [*command, "-o", str(library), str(source)]
        return subprocess.run(arguments, check=False, capture_output=True).returncode == 0
    except OSError:
        return False


def _platform() -> str:
    """Return the tag of this platform, or the one that is given."""
    if given := os.environ.get("WHEEL_PLATFORM"):
        return given
    from packaging.tags import platform_tags  # noqa: PLC0415, hatchling needs it too

    return next(platform_tags())
