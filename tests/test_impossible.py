"""What no walk can keep is refused before anything is solved; what could be found is not."""

import re
from dataclasses import replace

import numpy as np
import pytest
from walks import PEOPLE, scenario

import human_gait as hg
from benchmarks.robustness import design
from human_gait import cli
from human_gait.body.skeleton import DOF_NAMES
from human_gait.checks.motion import KNEE
from human_gait.exceptions import ScenarioError
from human_gait.problem.impossible import Suggestion, impossible, rounded_up
from human_gait.problem.posture_rows import KNEE_AT_MID_SWING
from human_gait.problem.program import GaitProgram, build_program
from human_gait.problem.reach import MISSED, nearest
from human_gait.scenario import Limits, load_scenario, shipped_scenarios

SIDES = "rl"
FINE = {"intervals": 20, "dynamics_per_interval": 2}
SLIPPERY = scenario(ground={"friction": 0.05}, **FINE)


def held(joint, low, high, **sections):
    return scenario(limits={f"{joint}_{side}": [low, high] for side in SIDES}, **sections)


HOPELESS = {
    "all joints held": (
        scenario(
            limits={"frozen": [n for n in DOF_NAMES if n not in ("pelvis_tz", "pelvis_ty")]},
        ),
        {"limits.frozen"},
    ),
    "hips held": (
        held("hip_flexion", 10, 10, step_length=0.7, **FINE),
        {"limits.hip_flexion_r", "limits.hip_flexion_l"},
    ),
    "straight knees": (
        held("knee_flexion", -5, 5),
        {"limits.knee_flexion_r", "limits.knee_flexion_l"},
    ),
    "one straight knee": (scenario(limits={"knee_flexion_l": [0, 40]}), {"limits.knee_flexion_l"}),
    "frozen knee": (scenario(limits={"frozen": ["knee_flexion_l"]}), {"limits.frozen"}),
    "pelvis at 5 m": (scenario(limits={"pelvis_ty": [5, 6]}), {"limits.pelvis_ty"}),
    "pelvis far ahead": (scenario(limits={"pelvis_tz": [5, 9]}), {"limits.pelvis_tz"}),
    "pelvis that stays": (scenario(limits={"pelvis_tz": [-0.1, 0]}), {"limits.pelvis_tz"}),
    "legs apart": (
        held("hip_abduction", 40, 45),
        {"limits.hip_abduction_r", "limits.hip_abduction_l"},
    ),
    "slippery": (SLIPPERY, {"ground.friction"}),
    "a point too low": (
        scenario(ground={"friction": 0.3, "pivot_height": 0.3}, **FINE),
        {"ground.friction"},
    ),
    "more pieces than instants": (
        scenario(control_points=40, intervals=12),
        {"discretisation.intervals"},
    ),
}


@pytest.fixture(params=HOPELESS, scope="module")
def hopeless(request):
    """A scenario without a walk, the keys that say so and the errors."""
    task, keys = HOPELESS[request.param]
    with pytest.raises(ScenarioError) as caught:
        build_program(task)
    return task, keys, caught.value.errors


def test_it_is_refused_by_key_with_value_and_what_to_try(hopeless):
    _, keys, errors = hopeless
    assert {error.key for error in errors} == keys
    for error in errors:
        assert "\n" not in error.line
        assert re.search(r"leaves no walk: .*\d.*; try ", error.line)
        assert error.value is not None or error.key == "limits.frozen"


def test_a_range_that_is_suggested_is_enough(hopeless):
    task, _, errors = hopeless
    wider = {}
    for error in errors:
        if found := re.search(r"such as \[(.*), (.*)\]", error.allowed):
            wider[error.key] = [float(found[1]), float(found[2])]
        elif found := re.search(r"try at least ([\d.]+)", error.allowed):
            wider[error.key] = float(found[1]) if "." in found[1] else int(found[1])
    if wider:
        table = task.to_dict()
        for key, value in wider.items():
            section, _, name = key.partition(".")
            table[section][name] = value
        changed = type(task).from_dict(table)
        program = GaitProgram(changed)
        assert impossible(changed, program.functions.walker, program.basis) == []


def test_the_command_line_and_python_refuse_it_before_anything_is_solved(tmp_path, capsys):
    path = tmp_path / "slippery.toml"
    path.write_text(SLIPPERY.to_toml())
    assert cli.run(["predict", str(path), "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"error: {path}: ground.friction = 0.05: leaves no walk: ")
    assert told.count("\n") == 1
    assert not (tmp_path / "out").exists()
    for call in (hg.predict, hg.build_program):
        with pytest.raises(ScenarioError, match=r"ground\.friction = 0\.05"):
            call(SLIPPERY)


def reasons(task):
    program = GaitProgram(task)
    return impossible(task, program.functions.walker, program.basis)


@pytest.mark.parametrize(
    ("ground", "key"),
    [
        ({"pad": 0.12}, "ground.pad"),
        ({"loading": [1.1, 0.75, 0.4]}, "ground.pad"),
        ({"loading": [1.5, 1.5, 1.5]}, "ground.loading"),
    ],
)
def test_a_heel_has_to_carry_where_it_is_loaded(ground, key):
    def program(**more):
        return build_program(hg.Scenario("heel", hg.Walk(1.2), ground={**ground, **more}))

    with pytest.raises(ScenarioError, match=rf"{key} = .*: leaves no walk: before it is flat"):
        program()
    if key == "ground.pad":
        told = str(reasons(hg.Scenario("heel", hg.Walk(1.2), ground=ground))[0])
        least = float(re.search(r"at least ([\d.]+)", told)[1])
        program(pad=least)
        with pytest.raises(ScenarioError, match=key):
            program(pad=least - 0.011)


def test_a_heel_may_be_shallow_where_the_load_may_pass_at_any_time():
    any_time = {"load_transfer": 1.0}
    task = hg.Scenario("heel", hg.Walk(1.2), tolerances=any_time, ground={"pad": 0.12})
    assert reasons(task) == []


@pytest.mark.parametrize("name", ["friction", "pelvis_tz"])
def test_bounds_are_tight(name):
    """At the bound that is told it is not refused, a little below it is."""

    def with_value(value):
        if name == "friction":
            return scenario(ground={"friction": value}, **FINE)
        return scenario(limits={"pelvis_tz": [-0.3, -0.3 + value]})

    text = str(reasons(with_value(0.05))[0])
    bound = float(re.search(r"(?:at least|one of) ([\d.]+)", text)[1])
    assert any(name in one.key for one in reasons(with_value(bound - 0.02)))
    assert not any(name in one.key for one in reasons(with_value(bound + 0.001)))


def test_feet_that_push_in_parallel_need_no_friction_for_that():
    task = scenario(ground={"friction": 0.05, "sharing": "parallel"}, **FINE)
    assert reasons(task) == []


@pytest.mark.parametrize(("tolerance", "refused"), [(0.2, True), (0.35, True), (0.41, False)])
def test_a_foot_counts_as_loaded_from_a_tenth_beyond_what_may_be_shifted(tolerance, refused):
    """From a tolerance of 0.4 on there is no instant at which both have to be."""
    task = scenario(ground={"friction": 0.05}, tolerances={"load_transfer": tolerance}, **FINE)
    assert bool(reasons(task)) is refused


def test_a_bound_is_rounded_so_that_it_holds():
    assert [rounded_up(value) for value in (0.1401, 0.14, 2.0)] == ["0.15", "0.14", "2.00"]


def test_a_suggestion_and_its_refusal_say_the_same():
    one = Suggestion("ground.friction", "at least 0.2", "it slips")
    assert str(one) == "ground.friction: at least 0.2 (it slips)"
    expected = "ground.friction = 0.1: leaves no walk: it slips; try at least 0.2"
    assert one.refusal(0.1).line == expected


# --- what could be found


@pytest.mark.parametrize("path", shipped_scenarios().values(), ids=lambda path: path.stem)
def test_no_shipped_scenario_is_refused(path):
    assert reasons(load_scenario(path)) == []


def test_walks_that_were_found_are_not_refused():
    """Some of the benchmark's, and postures that keep their plan, sought as if limits were own."""
    for task in design()[:6]:
        program = GaitProgram(replace(task, discretisation=scenario().discretisation))
        walker, basis = program.functions.walker, program.basis
        assert impossible(task, walker, basis) == []
    for task in design()[:2]:
        program = GaitProgram(replace(task, discretisation=scenario().discretisation))
        assert nearest(task, program.functions.walker, program.basis).missed < MISSED


@pytest.mark.parametrize("task", PEOPLE.values(), ids=PEOPLE)
def test_wide_limits_of_ones_own_are_not_refused(task):
    own = Limits.from_table({"knee_flexion_r": [0, 80], "frozen": ["wrist_flexion_l"]})
    assert reasons(replace(task, limits=own)) == []


@pytest.mark.parametrize(
    "walk",
    [(1.2, 0.15), (1.0, 0.15), (0.1, 0.3), (3.0, 0.7), (0.1, 0.7), (1.8, 0.9)],
)
def test_steps_that_are_unusual_are_tried(walk):
    """Walks of 480 and of 20 steps a minute are found: no pace is refused."""
    assert reasons(scenario(*walk)) == []


# --- the knee of Eq. (25)


def test_the_knee_at_mid_swing_can_be_left_out():
    stiff = held("knee_flexion", 0, 5, posture={"swing_knee": "free"})
    program = build_program(stiff)
    assert KNEE_AT_MID_SWING.name not in {one.name for one in program.constraints}
    usual = build_program(scenario())
    assert KNEE_AT_MID_SWING.name in {one.name for one in usual.constraints}
    gait = program.gait(program.guess())
    names = {check.name for check in hg.verify(gait)}
    assert KNEE.name not in names
    assert KNEE.name in {check.name for check in hg.verify(usual.gait(usual.guess()))}


# --- phases


def random_phases(rng):
    """Phases in their order, at the ends of what is allowed as often as between."""
    both = float(rng.choice([0.01, 0.02, 0.5, 0.95, 0.98, rng.uniform(0.01, 0.98)]))
    swing = float(rng.choice([both + 1e-4, 0.99, rng.uniform(both + 1e-4, 0.99)]))
    later = np.sort(rng.uniform(0.001, 0.99, 2)) + np.array([0.0, 0.002])
    unloading, off = both + later * (0.985 - both)
    events = {"mid_swing": swing, "heel_unloading": unloading, "heel_off": min(off, 0.99)}
    early = {name: float(rng.uniform(0.01, both)) for name in ("foot_flat", "ball_off")}
    return {"double_support": both, **early, **{k: float(v) for k, v in events.items()}}


def test_every_valid_combination_of_phases_builds():
    rng = np.random.default_rng(0)
    for _ in range(24):
        grid = {
            "intervals": int(rng.integers(12, 21)),
            "control_points": int(rng.choice([5, 6, 7, 8])),
            "periodicity": "velocity",
        }
        task = scenario(phases=random_phases(rng), **grid)
        program = build_program(task)
        assert all(len(one.lower) for one in program.constraints)
        found = program.violations(program.guess())
        assert np.isfinite([one.value for one in found]).all()
        assert program.posture(program.guess(), 1.0, 1.0).constraints
        assert program.with_friction().violations(program.guess())
