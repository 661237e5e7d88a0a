"""What Python offers for values: to copy, send, compare and show them, for every public one."""

import atexit
import copy
import inspect
import pickle
import shutil
from dataclasses import is_dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pytest
from lxml import html
from walking import guessed_gait

import human_gait as hg
from human_gait.studies.index import write_index
from human_gait.studies.plan import plan_of
from human_gait.studies.store import Kept, Store
from human_gait.studies.study_file import StudyFile

MOST_BYTES = 50_000
MOST_LINES, WIDTH = 15, 100
HOLDERS = {"GaitProgram", "NewtonSolver", "Predictor"}
"""Classes that are no values: a problem holds what solvers have of it, a predictor problems."""


def knee(motion):
    return hg.Rows(motion.q[:, [16]])


@cache
def program():
    return hg.build_program(guessed_gait(18.0).scenario)


def small_study(gait):
    """A study of one walk, in a folder that is gone with the process."""
    folder = Path(mkdtemp(prefix="study-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    asked = StudyFile.from_table({"name": "small", "scenario": gait.scenario.to_dict()})
    plan, store = plan_of(asked), Store(folder)
    store.save(plan.jobs[0].key, Kept({"key": plan.jobs[0].key, "success": True}, None, gait))
    write_index(plan, store, store.keys())
    return hg.open_study(folder)


@cache
def values():
    """A value of every public class."""
    gait = guessed_gait(18.0)
    checks, scenario = hg.verify(gait), gait.scenario
    sections = {type(one).__name__: one for one in vars(scenario).values() if is_dataclass(one)}
    now, worst = gait.instants(gait.times), program().violations(gait.free)
    motion = hg.Motion(now.t, now.q, now.v, now.a, now.active)
    found = (True, False, "newton", "optimal", 30, 40, 4020.4, 2.0, worst, {"a": np.ones(9)})
    return {
        **sections,
        "Iterate": hg.Iterate("torque", 3, 0.1, 4020.4, worst[0], gait.free),
        "Motion": motion,
        "PathConstraint": hg.PathConstraint("knee", knee, 0.0, np.full(1, 2.0), "rad"),
        "Rows": hg.Rows(now.q, np.zeros((*now.q.shape, 55))),
        "RunningCost": hg.RunningCost("knee", knee, 3.0),
        "Solution": hg.Solution(gait, *found),
        "UnsupportedProgram": hg.UnsupportedProgram("it is so"),
        "Body": gait.body,
        "Check": checks[0],
        "Checks": checks,
        "Comparison": hg.compare(gait),
        "Dimensionless": hg.dimensionless(gait),
        "DofRange": hg.DofRange("knee_flexion_r", 0.0, 90.0),
        "Energy": hg.energy(gait),
        "Explanation": hg.explain(gait),
        "Gait": gait,
        "GaitError": hg.GaitError("it is so"),
        "ModelError": hg.ModelError("it is so"),
        "NoSolutionFound": hg.NoSolutionFound("no walk", gait, [checks[0]]),
        "SolveInterrupted": hg.SolveInterrupted("interrupted", gait, [checks[0]]),
        "ResultError": hg.ResultError("it is so"),
        "Population": hg.Population("both", 3, 1),
        "Study": small_study(gait),
        "Samples": now,
        "Plate": (
            plate := hg.Plate(now.t, now.grf[:, 0], now.cop[:, 0], now.yaw_moment[:, 0], "r")
        ),
        "Recording": hg.Recording(
            Path("walk.mot"), now.t, {"knee_flexion_r": now.q[:, 16]}, plates=(plate,)
        ),
        "TrialError": hg.TrialError("it is so"),
        "Scenario": scenario,
        "Tracking": hg.Tracking(gait, 1e4),
        "ScenarioError": hg.ScenarioError("walk.speed", "must be a number", value=-1, source="a"),
    }


CLASSES = [name for name in hg.__all__ if inspect.isclass(getattr(hg, name))]
SHOWN = sorted(set(CLASSES) - HOLDERS)
ERRORS = [name for name in SHOWN if issubclass(getattr(hg, name), Exception)]
VALUES = [name for name in SHOWN if name not in ERRORS]
WAYS = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda value: pickle.loads(pickle.dumps(value)),
}


def test_there_is_one_of_every_class():
    assert sorted(values()) == SHOWN
    for name, value in values().items():
        assert type(value) is getattr(hg, name)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", VALUES)
def test_a_copy_is_equal(name, way):
    value = values()[name]
    again = WAYS[way](value)
    assert again == value
    assert (again != value) is False
    assert type(again) is type(value)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", ERRORS)
def test_a_copy_of_an_error_says_and_carries_the_same(name, way):
    error = values()[name]
    again = WAYS[way](error)
    assert (type(again), str(again)) == (type(error), str(error))
    assert vars(again) == vars(error)


@pytest.mark.parametrize("name", VALUES)
def test_what_is_equal_has_one_hash_and_what_is_a_list_has_none(name):
    value = values()[name]
    if isinstance(value, list):
        with pytest.raises(TypeError):
            hash(value)
    else:
        assert len({value, copy.deepcopy(value)}) == 1


@pytest.mark.parametrize("name", VALUES)
def test_values_of_different_kinds_differ(name):
    value = values()[name]
    for other in (*values().values(), None, 0, "text"):
        if other is not value:
            assert (value == other) is False


CHANGED = {
    "Check": lambda check: replace(check, limit=check.limit + 1e-9),
    "Checks": lambda checks: hg.Checks(checks[1:]),
    "Comparison": lambda found: replace(found, speed=found.speed + 1e-9),
    "Energy": lambda found: replace(found, effort=found.effort + 1e-9),
    "Gait": lambda gait: replace(gait, control_points=gait.control_points + 1e-12),
    "Samples": lambda now: replace(now, grf=now.grf + 1e-9),
    "Scenario": lambda scenario: scenario.replace(friction=0.4),
}


@pytest.mark.parametrize("name", CHANGED)
def test_a_small_change_makes_another_value(name):
    value = values()[name]
    assert CHANGED[name](value) != value


def test_gaits_are_equal_however_they_were_found():
    gait = values()["Gait"]
    other = replace(gait, solution={"solver": "by hand"}, multipliers={"a": np.ones(3)})
    assert other == gait
    assert hash(other) == hash(gait)
    assert replace(gait, scenario=gait.scenario.replace(friction=0.4)) != gait


@pytest.mark.parametrize("name", VALUES)
def test_caches_do_not_travel(name):
    """A value that has been used pickles to what it did before."""
    value = WAYS["pickle"](values()[name])
    before = pickle.dumps(value)
    for attribute in dir(value):
        if not attribute.startswith("__"):
            getattr(value, attribute)
    if isinstance(value, hg.Gait):
        value.tau(0.1)
    assert len(pickle.dumps(value)) == len(before)


def test_a_gait_is_small_when_it_is_sent():
    gait = replace(guessed_gait(18.0))
    gait.tau(0.1)
    rows = {
        "all": np.random.default_rng(0).normal(size=1500)
    }  # as many as the package's walks have
    assert len(pickle.dumps(replace(gait, multipliers=rows))) < MOST_BYTES


def lines_on_a_terminal(text):
    return sum(max(-(-len(line) // WIDTH), 1) for line in text.splitlines())


@pytest.mark.parametrize("name", SHOWN)
def test_a_value_is_shown_in_few_lines(name):
    value = values()[name]
    text = repr(value)
    assert 0 < lines_on_a_terminal(text) < MOST_LINES
    assert " object at 0x" not in text
    assert not text.startswith("<human_gait")


def test_what_a_person_wants_to_know_of_a_gait():
    story = {"solver": "newton", "status": "optimal", "cost": 12.5}
    gait = replace(values()["Gait"], solution=story)
    for fact in ("guessed walk", "1.2 m/s", "0.66 m", "male", "18 kg", "newton", "optimal", "12.5"):
        assert fact in repr(gait)
    assert "no walk" in repr(replace(gait, solution={"success": False}))


@pytest.mark.parametrize("name", ["Checks", "Comparison", "Energy", "Gait"])
def test_a_notebook_shows_it_as_html(name):
    shown = html.fromstring(values()[name]._repr_html_())
    assert shown.xpath("//table | //pre")
    assert shown.text_content().strip()


def test_text_of_a_gait_is_never_read_as_html():
    gait = replace(values()["Gait"], solution={"solver": "<script>alert(1)</script>", "cost": 1.0})
    assert "<script" not in gait._repr_html_()
    assert "<script" not in hg.Checks([hg.Check("<script>", "<b>", 1.0, 0.0, 0.0)])._repr_html_()


def test_checks_by_name_and_place():
    checks = values()["Checks"]
    name = checks.names[3]
    assert checks[name] is checks[3]
    assert type(checks[:3]) is hg.Checks
    assert len(checks.failed) == sum(not check.passed for check in checks) > 0
    assert not checks.passed
    assert not checks.failed.passed
    assert all(check.name in str(checks) for check in checks)
    with pytest.raises(KeyError, match="did you mean 'joint limits exceeded'"):
        _ = checks["joint limit exceeded"]
    with pytest.raises(IndexError):
        _ = checks[999]


def changed(array, value):
    array = array.copy()
    array.flat[array.size // 2] = value
    return array


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("control_points", np.nan),
        ("control_points", np.inf),
        ("control_points", 1e300),
        ("breaks", np.nan),
    ],
)
def test_a_gait_that_is_not_of_finite_numbers_is_refused_in_one_line(name, value):
    """Large numbers are finite, but not what follows from them."""
    gait = values()["Gait"]
    gait = replace(gait, **{name: changed(getattr(gait, name), value)})
    with pytest.raises(hg.ResultError, match="not a finite number: ") as caught:
        hg.verify(gait)
    assert "\n" not in str(caught.value)
    assert np.isfinite(value) or name in str(caught.value)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("breaks", lambda breaks: breaks[::-1]),
        ("breaks", lambda breaks: breaks[[0, 2, 1, *range(3, len(breaks))]]),
        ("breaks", lambda breaks: breaks[:-1]),
        ("breaks", lambda breaks: breaks[:, None]),
        ("breaks", lambda breaks: breaks[:0]),
        ("breaks", lambda breaks: breaks.tolist()),
        ("breaks", lambda breaks: breaks.astype(str)),
        ("control_points", lambda P: P[:-1]),
        ("control_points", lambda P: P[:, :54]),
        ("control_points", lambda P: P.ravel()),
        ("control_points", list),
        ("control_points", lambda P: P + 1j),
    ],
)
def test_a_gait_that_makes_no_splines_is_refused_by_the_name_of_the_array(name, change):
    gait = values()["Gait"]
    with pytest.raises(hg.GaitError, match=name) as caught:
        hg.verify(replace(gait, **{name: change(getattr(gait, name))}))
    assert "\n" not in str(caught.value)


def test_a_gait_of_large_numbers_fails_its_checks():
    gait = values()["Gait"]
    assert not hg.verify(replace(gait, control_points=100.0 * gait.control_points)).passed


@pytest.mark.parametrize("start", [3, {}, ["folder"]])
def test_what_is_no_walk_to_start_from_is_refused_by_its_type(start):
    with pytest.raises(TypeError, match=f"a gait or .* folder .*, not {type(start).__name__}"):
        hg.predict(values()["Scenario"], warm_from=start)


def test_a_comparison_prints_its_scores():
    found = values()["Comparison"]
    text = str(found)
    for score in found.scores:
        assert (f"{score.r:.2f}" if np.isfinite(score.r) else "  -  ") in text
    assert all(reference.label in text for reference in found.references)


def test_a_problem_tells_its_size():
    text = repr(program())
    for part in ("guessed walk", f"{len(program().variables)} variables", "pinocchio"):
        assert part in text
