"""Write .ci/constraints.txt: the newest versions that install together on each Python given.

Usage: refresh_constraints.py python3.11 python3.12 python3.13
"""

import subprocess
import sys
import tempfile
import tomllib
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CONSTRAINTS = ROOT / ".ci" / "constraints.txt"
HEADER = """\
# Exact versions for a reproducible installation; written by `make pins`, not by hand.
# Used by the Makefile: pip install -c .ci/constraints.txt -e '.[test,docs]'
"""


def requirements() -> list[str]:
    """Return what pyproject.toml asks for, with the build backend and editable installs."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = settings["project"]
    extras = {name for names in project["optional-dependencies"].values() for name in names}
    return [
        *project["dependencies"],
        *sorted(extras),
        *settings["build-system"]["requires"],
        "editables",
    ]


def installed(python: str, wanted: list[str]) -> tuple[str, list[str]]:
    """Install into a throw-away environment; return the version of Python and the frozen list."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([python, "-m", "venv", folder], check=True)
        pip = [f"{folder}/bin/python", "-m", "pip"]
        subprocess.run([*pip, "install", "--quiet", "--only-binary=:all:", *wanted], check=True)
        frozen = subprocess.run([*pip, "freeze"], check=True, capture_output=True, text=True)
        config = (Path(folder) / "pyvenv.cfg").read_text(encoding="utf-8")
    version = next(line.split("=")[1] for line in config.splitlines() if line.startswith("version"))
    return ".".join(version.split(".")[:2]).strip(), frozen.stdout.split()


def merged(frozen_by_python: dict[str, list[str]]) -> list[str]:
    """Return one line per requirement, with a marker where the Pythons differ."""
    pythons = defaultdict(list)
    for python, frozen in frozen_by_python.items():
        for requirement in frozen:
            pythons[requirement].append(python)
    return sorted(
        (line + marker(found, list(frozen_by_python)) for line, found in pythons.items()),
        key=str.lower,
    )


def marker(found: list[str], pythons: list[str]) -> str:
    """Return the environment marker of a requirement found on some of the Pythons."""
    if found == pythons:
        return ""
    return "; " + " or ".join(f'python_version == "{python}"' for python in found)


def main(pythons: list[str]) -> None:
    """Refresh the file for the given Pythons."""
    frozen_by_python = dict(installed(python, requirements()) for python in pythons)
    lines = merged(frozen_by_python)
    CONSTRAINTS.write_text(HEADER + "\n".join(lines) + "\n", encoding="utf-8")
    print(f"{CONSTRAINTS}: {len(lines)} pins for Python {', '.join(frozen_by_python)}")


if __name__ == "__main__":
    main(sys.argv[1:])
