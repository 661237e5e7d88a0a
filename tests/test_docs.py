"""What the pages name is there: modules, functions, tests, files, settings; pictures are fresh.

The changelog may name what has gone since.
"""

import ast
import importlib
import pkgutil
import re
import tomllib
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

import human_gait
from docs import architecture, pages
from human_gait.settings import all_settings

ROOT = Path(__file__).resolve().parent.parent
WRITTEN = (*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "docs").glob("how-to/*.md"))
PAGES = sorted({*WRITTEN} - {ROOT / "CHANGELOG.md"})
FENCED = re.compile(r"^```[\s\S]*?^```$|^    .*$", re.MULTILINE)
CODE = re.compile(r"`([^`\n]+)`")
TEST = re.compile(r"(test_\w+\.py)(?:::(\w+))?")
DOTTED = re.compile(r"([a-z_]\w*(?:\.\w+)+)(?:\(.*\))?")
FILE = re.compile(
    r"\w+\.(bvh|c3d|csv|gif|html|json|mot|mp4|npz|osim|parquet|png|sto|toml|trc|urdf|xml|yaml)"
)
VALUES = {"gait": human_gait.Gait, "hg": human_gait, "scenario": human_gait.Scenario}
FOREIGN = {"numpy", "opensim", "pandas", "pydrake"}


def named(page):
    """What a page sets as code within its sentences."""
    return sorted(set(CODE.findall(FENCED.sub("", page.read_text(encoding="utf-8")))))


@cache
def modules():
    """Every module of the package by each end of its dotted path."""
    found = {"human_gait": [human_gait]}
    for info in pkgutil.walk_packages(human_gait.__path__, "human_gait."):
        if info.name.endswith("__main__"):
            continue
        parts = info.name.split(".")
        for start in range(len(parts)):
            found.setdefault(".".join(parts[start:]), []).append(importlib.import_module(info.name))
    return found


def has(value, path):
    """Whether attributes lead from a value along a path; a field of a class is one, too."""
    for k, name in enumerate(path):
        if name in getattr(value, "__dataclass_fields__", {}):
            return k == len(path) - 1
        try:
            value = getattr(value, name)
        except AttributeError:
            return False
    return True


def resolves(name):
    """Whether a dotted name leads from a module, or a value that pages speak of, to something."""
    parts = name.split(".")
    starts = [(value, parts[1:]) for first, value in VALUES.items() if first == parts[0]]
    for length in range(1, len(parts)):
        found = modules().get(".".join(parts[:length]), ())
        starts += [(module, parts[length:]) for module in found]
    return any(has(start, path) for start, path in starts)


def homes(name):
    """Modules that define what a dotted name ends with: where it may have moved."""
    parts = name.split(".")
    path = parts[next((k for k, part in enumerate(parts) if part[0].isupper()), -1) :]
    every = {module.__name__: module for found in modules().values() for module in found}
    return [
        ".".join([module.rpartition(".")[2], *path])
        for module, value in sorted(every.items())
        if getattr(getattr(value, path[0], None), "__module__", None) == module and has(value, path)
    ]


def fault(code):
    """What is wrong with one piece of code in a sentence, or nothing."""
    if code.endswith(".py") and " " not in code:
        there = (ROOT / code).is_file() or list(ROOT.glob(f"[!.]*/**/{Path(code).name}"))
        return "" if there else "no such file"
    for file, test in TEST.findall(code):
        if not (ROOT / "tests" / file).is_file():
            return "no such file of tests"
        if test and test not in named_in(file):
            return f"{file} has no such test"
    found = DOTTED.fullmatch(code)
    if not found or FILE.fullmatch(code) or code.split(".")[0] in FOREIGN | {".ci"}:
        return ""
    name = found[1]
    if name in {one.dotted for one in all_settings()} or resolves(name):
        return ""
    return f"not found; defined today: {', '.join(homes(name)) or 'nowhere'}"


@cache
def named_in(file):
    tree = ast.parse((ROOT / "tests" / file).read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_everything_a_page_names_is_there(page):
    faults = {code: fault(code) for code in named(page)}
    assert not {code: found for code, found in faults.items() if found}


def test_a_name_of_yesterday_is_found_out_with_its_new_home():
    """As when a function moves, a test is renamed, a setting goes."""
    assert resolves("dh.frames")
    assert resolves("human_gait.body.dh.frames")
    assert fault("curvature.frames") == "not found; defined today: dh.frames"
    assert "ground_reaction.GroundReaction.in_state" in fault("walk.GroundReaction.in_state")
    assert fault("dh.no_such_function").endswith("nowhere")
    assert fault("walk.no_such_setting")
    assert fault("test_dh.py::test_no_such_thing")
    assert fault("test_no_such_file.py")
    assert fault("no_such_file.py")
    assert fault("gait.no_such_method(t)")
    assert not fault("walk.speed")


def test_the_readme_goes_through_the_wings():
    """Every package, with no module that is not there."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    section = text.split("## How it works")[1].split("\n## ")[0]
    words = {code for code in CODE.findall(section) if re.fullmatch(r"[a-z_]+", code)}
    assert words <= {name.rpartition(".")[2] for name in modules()}
    wings = {info.name for info in pkgutil.iter_modules(human_gait.__path__) if info.ispkg}
    assert wings - {"data", "results", "settings"} <= words


def test_the_version_is_the_same_everywhere():
    """In what pip installs, in what is cited and at the top of the changelog."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    cited = re.search(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    newest = re.search(r"^## \[(.+?)\](?: - \d{4}-\d\d-\d\d)?$", changes, re.MULTILINE)
    assert cited[1] == newest[1] == project["version"]


def test_the_picture_of_the_wings_is_fresh():
    committed = architecture.PICTURE.read_text(encoding="utf-8")
    assert committed == architecture.picture(), "run python docs/architecture.py"


def test_the_picture_has_every_wing_once_and_arrows_downwards_alone():
    rows = architecture.layers()
    wings = [name for row in rows for name in row]
    assert len(wings) == len(set(wings))
    found = {info.name for info in pkgutil.iter_modules(human_gait.__path__)} - {"__main__"}
    assert found <= set(wings)
    layout = architecture.Layout(rows, architecture.reduced(architecture.arrows()))
    for upper, lower in layout.chains:
        assert layout.row_of[upper] < layout.row_of[lower]
    with pytest.raises(ValueError, match="dh imports links, which is not below it"):
        architecture.Layout([["links"], ["dh"]], [("dh", "links")])


def test_an_arrow_that_follows_from_others_is_left_out():
    everything = {("a", "b"), ("b", "c"), ("a", "c"), ("a", "d")}
    assert architecture.reduced(everything) == [("a", "b"), ("a", "d"), ("b", "c")]
    assert architecture.reduced({("a", "b"), ("b", "a")})  # a circle ends, too


def test_boxes_of_a_row_do_not_touch():
    layout = architecture.Layout(architecture.layers(), architecture.reduced(architecture.arrows()))
    for row in layout.rows:
        places = [layout.x[name] for name in row if ">" not in name]
        assert all(b - a > architecture.BOX[0] for a, b in pairwise(places))


def test_the_page_of_settings_has_every_setting_with_what_it_allows():
    text = pages.settings_page()
    rows = {}
    section = ""
    for line in text.splitlines():
        if line.startswith("## ["):
            section = line.strip("# []")
        elif line.startswith("| `"):
            cells = [cell.strip() for cell in line.strip("|").split(" | ")]
            rows[section, cells[0].strip("`")] = cells
    settings = list(all_settings())
    assert set(rows) == {(one.section, one.key) for one in settings}
    for one in settings:
        cells = rows[one.section, one.key]
        assert cells[1:3] == [one.meaning, one.unit]
        assert cells[4:] == [one.default_words, one.source]
        if one.low is not None:
            assert f"{one.low:g} to {one.high:g}" in cells[3].replace("\N{NO-BREAK SPACE}", " ")


def formulations():
    """The rows of the table that has them side by side: key, three cells, where from."""
    theory = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")
    table = theory.partition("### Side by side")[2].partition("\n### ")[0]
    rows = [row.strip("|").split("|") for row in table.splitlines() if row.startswith("| `")]
    return {row[0].strip(" `"): [cell.strip() for cell in row[1:]] for row in rows}


@pytest.mark.parametrize(("column", "formulation"), [(0, "human"), (1, "effort"), (2, "paper")])
def test_formulations_stand_side_by_side_as_they_are(column, formulation):
    scenario = human_gait.Scenario("any", {"speed": 1.2}, objective={"formulation": formulation})
    assert len(formulations()) > 25
    for key, row in formulations().items():
        told, (section, name) = row[column], key.split(".")
        value = getattr(getattr(scenario, section), name)
        if isinstance(value, str):
            assert told == f'`"{value}"`', key
        else:
            values = list(value) if isinstance(value, tuple) else [value]
            numbers = re.findall(r"\d+(?:\.\d+)?", told)[: len(values)]
            assert [float(number) for number in numbers] == values, key


def test_what_is_calibrated_is_called_so():
    told = {key for key, row in formulations().items() if "**calibrated**" in row[3]}
    tissues = {"objective.passive_torques"}  # of some joints
    assert told == tissues | {one.dotted for one in all_settings() if "calibrated" in one.source}


def test_the_reference_has_every_public_name_and_every_wing():
    """A class or function of the package under its own name, each once over all pages."""
    made = pages.pages()
    public = pages.public_names()
    for name, path in public.items():
        assert f"\n::: {path}\n    options:\n      heading: {name}\n" in made["reference/index.md"]
    words = made["reference/index.md"].split()
    assert words.index("Errors") < words.index(public["ScenarioError"])
    assert words.index("Functions") < words.index(public["predict"]) < words.index("Values")
    missing = set(human_gait.__all__) - set(public)
    assert all(isinstance(getattr(human_gait, name), str) for name in missing)
    wings = {wing for row in architecture.layers() for wing in row} - pages.INSIDE
    assert {f"reference/{wing}.md" for wing in wings} == {
        path for path in made if path.startswith("reference/") and not path.endswith("index.md")
    }


@pytest.mark.parametrize(
    "html",
    [
        '<script src="https://example.org/x.js"></script>',
        '<link rel=stylesheet href="//fonts.example.org/css">',
        "<img src='http://example.org/x.png'>",
    ],
)
def test_a_page_that_asks_a_server_is_refused(html):
    assert len(pages.foreign(html)) == 1
    assert pages.foreign('<a href="https://example.org">x</a><script src="x.js"></script>') == []


def test_the_page_of_own_costs_has_every_example():
    text = pages.own_costs_page()
    examples = list((ROOT / "docs" / "examples").glob("*.py"))
    assert examples
    for example in examples:
        assert example.read_text(encoding="utf-8") in text
    assert "hg.PathConstraint(" in text.split("## ")[0]


def test_long_names_in_tables_may_break_and_others_not():
    long = "<td><code>test_dh.py::test_frames_follow_the_tree</code> <code>a_b</code></td>"
    found = pages.breakable(long)
    assert "test_<wbr>dh.py::<wbr>test_<wbr>frames" in found.replace("dh.<wbr>py", "dh.py")
    assert "<code>a_b</code>" in found
