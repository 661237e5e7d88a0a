"""A constraint or a check is known by its record: its name is nothing but what people read."""

import ast
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from walking import guessed_gait
from walks import scenario

import human_gait
from human_gait.checks.check import Check
from human_gait.checks.verification import verify
from human_gait.problem.constraints import LIMITS, SYMMETRY
from human_gait.problem.program import build_program
from human_gait.reporting import check_tables as tables
from human_gait.reporting.outcome import Finding
from human_gait.solving.diagnosis import not_kept, suggestions, violation_text
from human_gait.solving.shadow_prices import influences
from human_gait.solving.solver import Solution
from human_gait.solving.starts import Attempt
from human_gait.solving.warm_start import fitting
from human_gait.walk.gait_file import make_record

ROOT = Path(human_gait.__file__).parents[1]
DEFINING = (
    *(f"human_gait/problem/{name}.py" for name in ("constraints", "contact_rows")),
    *(f"human_gait/problem/{name}.py" for name in ("balance_rows", "posture_rows", "limb_rows")),
    *(f"human_gait/checks/{name}.py" for name in ("contents", "laws", "ground")),
    *(f"human_gait/checks/{name}.py" for name in ("motion", "limbs")),
)
NEW = "renamed: "
RECORD = make_record(guessed_gait())
LOW = {"pelvis_ty": [0.5, 0.8]}  # in the way of feet that have to be clear of the ground


class Walks:
    """Problems that are asked about: with every demand, with a limit in the way, with few ties."""

    def __init__(self):
        grid = {"control_points": 8, "intervals": 20}
        tied, few = grid | {"periodicity": "velocity"}, grid | {"periodicity": "position"}
        self.whole = build_program(scenario(posture={"limbs": "apart"}, **tied)).with_friction()
        self.low = build_program(scenario(limits=LOW, **tied))
        self.loose = build_program(scenario(tolerances={"feet_apart": 0.0}, **few))

    @property
    def demands(self):
        return [*(constraint.demand for constraint in self.whole.constraints), LIMITS, SYMMETRY]


@pytest.fixture(scope="module")
def walks():
    return Walks()


@pytest.fixture(scope="module")
def said(walks):
    """What is said under the names that constraints and checks have."""
    return everything_said(walks)


@pytest.fixture
def renamed(walks, said, monkeypatch):
    """All constraints and checks have other names, where they are defined."""
    assert said
    names = [(demand, demand.name) for demand in walks.demands]
    plain = Check.__init__

    def make(check, name, *rest, **others):
        plain(check, NEW + name.removeprefix(NEW), *rest, **others)

    monkeypatch.setattr(Check, "__init__", make)
    for demand, name in names:
        object.__setattr__(demand, "name", NEW + name)
    yield
    for demand, name in names:
        object.__setattr__(demand, "name", name)


def ended(program, violations=(), multipliers=(), converged=False):
    """A solve that ended at the guess."""
    return Solution(
        gait=program.gait(program.guess()),
        converged=converged,
        interrupted=False,
        solver="snopt",
        status="13: infeasible",
        iterations=1,
        evaluations=1,
        cost=1.0,
        wall_time=1.0,
        violations=list(violations),
        multipliers=dict(multipliers),
    )


def of_violations(program):
    """What is said of every constraint that is not kept, by itself and among the others."""
    found = program.violations(program.guess())
    near = [replace(one, value=0.002) for one in found]
    alone = [suggestions(program, ended(program, [one]), []) for one in (*found, *near)]
    texts = [violation_text(one, 0.5) for one in not_kept(program.scenario, found)]
    return [str(one) for found in alone for one in found] + texts


def of_checks(walks, found):
    """What is said of every check that fails, by itself, and whether the walk would slip."""
    said = []
    for check in found:
        failed = [replace(check, value=check.limit + 1.0)]
        for program in (walks.whole, walks.loose):
            solution = ended(program, converged=True)
            said += [str(one) for one in suggestions(program, solution, failed)]
            said.append(f"it slips: {bool(Attempt('', program, solution, failed).beyond)}")
    return said


def of_prices(program):
    """What is said of every bound if all cost the same, and what of it goes to the next solve."""
    rows = {c.name: np.ones(len(c.lower)) for c in program.constraints}
    rows[LIMITS.name] = np.ones(len(program.unit))
    rows[SYMMETRY.name] = np.ones(len(program.symmetry_words))
    kept = fitting(rows, program)
    found = influences(program, ended(program, multipliers=rows, converged=True))
    return [
        *(f"{one.name}: {one.what}, {one.meaning}, {one.saving:.6g}" for one in found),
        *(f"{name} {price.sum():.6g}" for name, price in kept.items()),
    ]


def of_reports(found):
    """The table of the checks."""
    fields = "name", "unit", "value", "limit", "time", "equation"
    findings = [Finding(**{key: getattr(check, key) for key in fields}) for check in found]
    result = SimpleNamespace(label="a", outcome=SimpleNamespace(checks=findings))
    return [" ".join(cell.text for cell in row) for row in tables.checks([result]).rows]


def everything_said(walks):
    checks = verify(RECORD)
    return [
        *of_violations(walks.whole),
        *of_violations(walks.low),
        *of_checks(walks, checks),
        *of_prices(walks.whole),
        *of_reports(checks),
    ]


@pytest.mark.usefixtures("renamed")
def test_constraints_and_checks_that_are_renamed_are_told_of_as_before(walks, said):
    after = everything_said(walks)
    assert sum(NEW in line for line in after) > 100
    assert [line.replace(NEW, "") for line in after] == said


@pytest.mark.parametrize(
    "part",
    [
        *("tolerances.contact:", "tolerances.contact_speed:", "tolerances.pelvis_speed:"),
        *("tolerances.feet_apart:", "tolerances.zmp_margin:", "tolerances.load_transfer:"),
        *("limits.pelvis_ty:", "discretisation.intervals:", "discretisation.periodicity:"),
        *("ground.friction:", "it slips: True", "it slips: False", "the ground cannot pull"),
        "Newton, Euler",
    ],
)
def test_what_is_compared_there_is_of_every_kind(said, part):
    assert any(part in line for line in said)


def literals(path):
    """The strings of a module that are no documentation, in lower case."""
    tree = ast.parse(path.read_text())
    told = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    return [
        node.value.casefold()
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in told
    ]


def test_no_name_is_written_anywhere_but_where_it_is_defined(walks):
    names = [*(demand.name for demand in walks.demands), *(check.name for check in verify(RECORD))]
    names = {name.casefold() for name in names}
    folders = ("human_gait", "benchmarks")
    modules = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
    assert len(modules) > 80
    found = {}
    for path in modules:
        place = path.relative_to(ROOT).as_posix()
        for name in set(literals(path)) & names:
            found.setdefault(name, []).append(place)
    assert [places for places in found.values() if len(places) > 1] == []
    assert {place for places in found.values() for place in places} <= set(DEFINING)
    assert len(found) > 40  # but for those of the engines, which are put together
