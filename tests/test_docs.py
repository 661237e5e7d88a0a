"""What the pages name exists: modules, functions, tests, files."""

import ast
import importlib
import pkgutil
import re
from functools import cache
from pathlib import Path

import pytest

import human_gait

ROOT = Path(__file__).resolve().parent.parent
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")])
CODE = re.compile(r"`([^`\n]+)`")
FENCED = re.compile(r"^```[\s\S]*?^```$|^    .*$", re.MULTILINE)
TEST = re.compile(r"(test_\w+\.py)(?:::(\w+))?")
DOTTED = re.compile(r"([a-z_]\w*(?:\.\w+)+)(?:\(.*\))?")


def named(page):
    """What a page sets as code within its sentences."""
    return sorted(set(CODE.findall(FENCED.sub("", page.read_text(encoding="utf-8")))))


@cache
def modules():
    """Every module of the package by each end of its dotted path."""
    found = {}
    for info in pkgutil.walk_packages(human_gait.__path__, "human_gait."):
        parts = info.name.split(".")
        for start in range(len(parts)):
            found.setdefault(".".join(parts[start:]), []).append(info.name)
    return found


def resolves(name):
    """Whether a dotted name leads from a module to something in it."""
    parts = name.split(".")
    for length in range(len(parts) - 1, 0, -1):
        for module in modules().get(".".join(parts[:length]), ()):
            value = importlib.import_module(module)
            try:
                for part in parts[length:]:
                    value = getattr(value, part)
            except AttributeError:
                continue
            return True
    return False


def homes(name):
    """Where the package has a class or function of the last names of a dotted one, to choose from."""
    for last in range(1, name.count(".") + 1):
        wanted = ".".join(name.split(".")[last:])
        ends = {module for found in modules().values() for module in found}
        homes = [f"{end.rpartition('.')[2]}.{wanted}" for end in sorted(ends)]
        defined = [home for home in homes if resolves(home) and is_defined(home)]
        if defined:
            return defined
    return []


def is_defined(name):
    """Whether a name is one of the module that it begins with, and not of one imported there."""
    module, first = name.split(".")[:2]
    values = [getattr(importlib.import_module(m), first, None) for m in modules()[module]]
    return any(getattr(v, "__module__", "").endswith(f".{module}") for v in values if v)


def is_of_the_code(name):
    """Whether a dotted name begins with a module, of now or of before, and is no setting or file."""
    first = name.split(".")[0]
    return first in modules() or first in FORMER


FORMER = {"adjoint", "bspline", "constraints", "curvature", "dh", "engines"}


@cache
def tests_of(file):
    tree = ast.parse((ROOT / "tests" / file).read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


if __name__ == "__main__":
    for page in PAGES:
        for code in named(page):
            m = DOTTED.fullmatch(code)
            if m and not code.startswith("test_"):
                print(page.name, code, "OK" if resolves(m[1]) else homes(m[1]))
            for file, test in TEST.findall(code):
                if not (ROOT / "tests" / file).exists() or (test and test not in tests_of(file)):
                    print(page.name, code, "NO TEST")
