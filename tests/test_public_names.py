"""The door of the package: what is there, what it costs to open, and that it says what it does."""

import ast
import inspect
import json
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import human_gait as hg
from human_gait.late import late

ROOT = Path(hg.__file__).parent
HEAVY = ("matplotlib", "meshcat", "pydrake", "pinocchio", "scipy", "pandas", "IPython", "rich")


def python(*arguments):
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, check=False, timeout=120
    )


def test_dir_shows_the_public_names_and_no_others():
    assert dir(hg) == sorted({*hg.__all__, "__version__"})
    assert list(hg.__all__) == sorted(set(hg.__all__))


@pytest.mark.parametrize("name", hg.__all__)
def test_every_name_is_there_and_no_module_takes_its_place(name):
    """A module called like a function of the package would replace it when it is imported."""
    assert not inspect.ismodule(getattr(hg, name))
    assert not (ROOT / name).exists()
    assert not (ROOT / f"{name}.py").exists()


def test_the_names_of_old_are_there():
    old = {"Gait", "Scenario", "load_scenario", "predict", "build_program", "solve", "verify"}
    old |= {"bspline_trajectory", "play", "GaitError", "ModelError", "NoSolutionFound"}
    assert old | {"ResultError", "ScenarioError"} <= set(hg.__all__)


def test_all_can_be_imported_at_once():
    space = {}
    exec("from human_gait import *", space)
    assert set(hg.__all__) <= space.keys()


def test_what_is_not_there_is_said_as_python_does():
    with pytest.raises(AttributeError, match="module 'human_gait' has no attribute 'predikt'"):
        _ = hg.predikt
    assert not hasattr(hg, "Any")
    assert not hasattr(hg, "importlib")


def test_version():
    assert hg.__version__ == version("human-gait")


def test_importing_the_package_imports_nothing_heavy():
    asked = (
        f"import sys, human_gait; dir(human_gait); print([m for m in {HEAVY} if m in sys.modules])"
    )
    assert python("-c", asked).stdout.strip() == "[]"


@pytest.mark.parametrize("module", ["human_gait", "human_gait.cli"])
def test_a_module_is_the_command(module):
    assert python("-m", module, "--version").stdout == f"human-gait {hg.__version__}\n"
    failed = python("-m", module, "predict", "nonexistent.toml")
    assert failed.returncode == 2
    assert failed.stderr.startswith("error: nonexistent.toml")


def late_calls():
    """Every name that is looked up late, with the function it is looked up in."""
    for path in sorted(ROOT.rglob("*.py")):
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(function, ast.FunctionDef):
                continue
            for call in ast.walk(function):
                named = isinstance(call, ast.Call) and getattr(call.func, "id", "") == "late"
                if named and all(isinstance(one, ast.Constant) for one in call.args):
                    yield function.name, *(one.value for one in call.args)


def parameters(function):
    signature = inspect.signature(function)
    return [(one.name, one.kind) for one in signature.parameters.values()][1:]


@pytest.mark.parametrize(("method", "module", "name"), list(late_calls()))
def test_what_is_looked_up_late_is_there_and_takes_the_same(method, module, name):
    found = late(module, name)
    if callable(found) and not method.startswith("_") and method != "times":
        assert parameters(found) == parameters(getattr(hg.Gait, method))


def test_methods_of_a_gait_are_looked_up_late():
    assert {"save", "export", "plot", "to_dataframe"} <= {method for method, *_ in late_calls()}


# Docstrings


def documented():
    for name in hg.__all__:
        thing = getattr(hg, name)
        yield name, thing
        if inspect.isclass(thing):
            for attribute, member in vars(thing).items():
                function = member.fget if isinstance(member, property) else member
                function = getattr(function, "__func__", function)
                ours = getattr(function, "__module__", "").startswith("human_gait")
                if inspect.isfunction(function) and ours and not attribute.startswith("_"):
                    yield f"{name}.{attribute}", function


@pytest.mark.parametrize(("name", "thing"), list(documented()))
def test_every_public_name_has_a_docstring(name, thing):
    text = inspect.getdoc(thing)
    assert text, name
    assert text.splitlines()[0].endswith((".", ":")), name


@pytest.mark.parametrize(
    "name", [name for name in hg.__all__ if inspect.isfunction(getattr(hg, name))]
)
def test_the_docstring_of_a_function_names_its_parameters(name):
    """And the order is that of the call."""
    function = getattr(hg, name)
    text = inspect.getdoc(function)
    given = list(inspect.signature(function).parameters)
    if "Parameters\n---" in text:
        part = text.split("Parameters\n----------\n")[1].split("\n\n")[0]
        told = [line.split(" : ")[0] for line in part.splitlines() if not line.startswith(" ")]
        assert [one.strip() for line in told for one in line.split(",")] == given
    else:
        assert len(given) <= 2, f"{name} has parameters that nothing is said about"


# The tutorial

NOTEBOOK = ROOT.parent / "docs" / "tutorial.ipynb"


def imported(source):
    for node in ast.walk(source):
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module


def test_the_tutorial_uses_public_names_only():
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
    tree = ast.parse(code)
    modules = set(imported(tree))
    assert [name for name in modules if name.split(".")[0] == "human_gait"] == ["human_gait"]
    used = [node for node in ast.walk(tree) if isinstance(node, ast.Attribute)]
    ours = {node.attr for node in used if getattr(node.value, "id", "") == "hg"}
    assert {"predict", "verify", "compare", "play", "report"} <= ours <= set(hg.__all__)
    assert not [node.attr for node in used if node.attr.startswith("_")]
