"""Why a solve failed and what shapes a gait: each rule with a case that it is for and one not."""

import contextlib
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from solves import solved
from walking import guessed_gait
from walks import PEOPLE, scenario

from human_gait import cli
from human_gait.body.skeleton import DOF_NAMES, N_DOF, in_words, index
from human_gait.checks import ground, motion
from human_gait.exceptions import ResultError, ScenarioError
from human_gait.problem.balance_rows import GROUND_PUSHES
from human_gait.problem.constraints import LIMITS, SYMMETRY
from human_gait.problem.contact_rows import CONTACT_POSITION, GROUND_PENETRATION, SOFT_IMPACT
from human_gait.problem.posture_rows import ARM_LEG_COUPLING, PELVIC_VELOCITY, STRENGTH
from human_gait.problem.program import GaitProgram, build_program
from human_gait.problem.residual import Demand
from human_gait.problem.units import COST_SCALE
from human_gait.problem.violation import Violation
from human_gait.results.explanation import explained
from human_gait.solving import solver as solver_room
from human_gait.solving.diagnosis import amount, not_kept, suggestions, violation_text
from human_gait.solving.drake_solvers import SOLVERS
from human_gait.solving.shadow_prices import NEGLIGIBLE, STEPS, influences, limit_row
from human_gait.solving.solver import Solution, solve
from human_gait.walk.gait_cycle import save_gait_cycle
from human_gait.walk.gait_file import save_gait

DEFAULTS = {"control_points": 8, "intervals": 20}
FOOT = Violation(CONTACT_POSITION, "m", 0.012, 0.1, "left heel, forward")
OFF_GRID = motion.DEPTH.found(0.02, 0.01, 0.1)
SLIPPERY = ground.SLIDING.found(0.8, 0.5, 0.1)


def demanded(demand, program):
    """The constraint of a program with a demand."""
    return next(c for c in program.constraints if c.demand == demand)


def failed(task, violations=(FOOT,), checks=(), **changes):
    """What is suggested after a solve that ended at the guess, str by key."""
    program = GaitProgram(task)  # not refused first
    outcome = {"converged": False, "interrupted": False, "status": "13: infeasible", **changes}
    numbers = {"iterations": 1, "evaluations": 1, "cost": 1.0, "wall_time": 1.0}
    solution = Solution(
        gait=program.gait(program.guess()),
        violations=list(violations),
        **{"solver": "snopt", **numbers, **outcome},
    )
    return {one.key: str(one) for one in suggestions(program, solution, list(checks))}


@pytest.mark.parametrize("task", PEOPLE.values(), ids=PEOPLE)
def test_every_row_says_what_it_is_about_and_no_two_of_an_instant_the_same(task):
    for constraint in build_program(task).constraints:
        assert constraint.what.shape == constraint.lower.shape
        assert np.all(np.char.str_len(constraint.what) > 0)
        rows = set(zip(constraint.instants, constraint.what, strict=True))
        assert len(rows) == len(constraint.what)


def test_a_selection_of_instants_keeps_the_words_of_its_rows():
    for constraint in build_program(scenario()).constraints:
        some = constraint.instants[:1]
        expected = constraint.what[np.isin(constraint.instants, some)]
        np.testing.assert_array_equal(constraint.rows_at(some).what, expected)


def test_rows_of_standing_points_say_where_and_along_which_axis():
    """Raising the body moves the heights, moving it forward the forward places, and so on."""
    program = build_program(scenario())
    constraint = demanded(CONTACT_POSITION, program)
    guess = program.guess().reshape(-1, N_DOF)
    before = program.residual(constraint, guess.ravel())[0]
    for joint, axis in (("tx", "sideways"), ("ty", "height")):
        moved = guess.copy()
        moved[:, index(f"pelvis_{joint}")] += 0.01
        change = np.abs(program.residual(constraint, moved.ravel())[0] - before)
        early = constraint.instants < 5  # of a mirrored spline the end moves the other way
        named = np.char.endswith(constraint.what, axis)
        assert change[named & early].min() > 1e-3
        np.testing.assert_allclose(change[~named], 0.0, atol=1e-12)
    sides = {what.split()[0] for what in constraint.what[constraint.instants == 10]}
    assert sides == {"left"}


def test_joints_have_names_of_their_own_in_words():
    words = [in_words(name) for name in DOF_NAMES]
    assert len(set(words)) == N_DOF
    assert in_words("knee_flexion_r") == "right knee flexion"
    assert not any("_" in word for word in words)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (np.pi, "rad", "180 deg"),
        (0.012, "m", "12 mm"),
        (1.5, "m", "1.5 m"),
        (0.012, "m/s", "12 mm/s"),
        (0.5, "of the load", "50 % of the load"),
        (0.5, "body weight", "50 % of body weight"),
    ],
)
def test_amounts_are_in_units_that_one_would_say(value, unit, text):
    assert amount(value, unit) == text


def test_a_violation_tells_which_point_how_far_and_when():
    text = violation_text(FOOT, step_time=0.5)
    for part in (
        f"{CONTACT_POSITION.name} (Eq. {CONTACT_POSITION.equation})",
        FOOT.what,
        "12 mm",
        "0.100 s",
        "20 % of the step",
    ):
        assert part in text


def test_a_violation_tells_how_long_it_lasts():
    text = violation_text(replace(FOOT, first=0.05, last=0.25), step_time=0.5)
    assert "not kept from 10 to 50 %" in text
    assert "from" not in violation_text(FOOT, step_time=0.5)


def test_the_span_of_a_violation_holds_its_worst_instant():
    program = build_program(scenario())
    for worst in program.violations(program.guess()):
        if worst.value > 0.0:
            assert 0.0 <= worst.first <= worst.time <= worst.last <= program.basis.step_time
        else:
            assert worst.first == worst.last == 0.0


def test_violations_are_ranked_by_what_may_be_tolerated():
    """A slip of 0.2 m/s is within 0.3 m/s, a millimetre is a quarter of 4 mm."""
    slip = Violation(SOFT_IMPACT, "m/s", 0.03, 0.1)
    foot, kept = replace(FOOT, value=0.001), replace(FOOT, value=0.0)
    assert not_kept(scenario(), [slip, kept, foot]) == [foot, slip]


def test_every_unit_of_a_row_has_a_step_of_its_own():
    for periodicity in ("acceleration", "velocity"):
        program = build_program(scenario(periodicity=periodicity))
        units = {c.unit for c in program.constraints} | {u for _, u in program.symmetry_words}
        assert units <= set(STEPS)


def test_every_constraint_has_a_meaning():
    program = build_program(scenario()).with_friction()
    demands = [constraint.demand for constraint in program.constraints]
    assert all(demand.meaning for demand in [*demands, SYMMETRY, LIMITS])


def test_every_tolerance_is_a_setting_that_relaxes_its_constraint():
    """Moved as the record says, the rows have more room; the other way they have less."""
    task = scenario()
    for k, constraint in enumerate(build_program(task).constraints):
        tolerance = constraint.demand.tolerance
        if tolerance is None:
            continue
        more = 1.01 if tolerance.upwards else 0.99
        for factor, freer in ((more, True), (2.0 - more, False)):
            value = factor * getattr(task.tolerances, tolerance.key)
            changed = replace(task.tolerances, **{tolerance.key: value})
            program = build_program(replace(task, tolerances=changed))
            other = program.constraints[k]
            assert other.demand == constraint.demand
            assert roomier(program, other, constraint) == freer, constraint.name


def roomier(program, other, constraint):
    """Whether the rows together are further within their bounds."""
    now = program.instants(program.guess())
    found = []
    for one in (other, constraint):
        value = one.evaluate(now).value
        found.append(np.minimum(one.upper - value, value - one.lower).sum())
    return found[0] > found[1]


def test_a_constraint_that_is_new_is_told_all_the_same():
    program = build_program(scenario())
    last = replace(program.constraints[-1], demand=Demand(name="new one"), unit="N")
    program.constraints = [last]
    prices = {last.name: np.ones(len(last.lower)), LIMITS.name: np.zeros(len(program.unit))}
    found = influences(program, solution_like(program, prices, cost=1.0))
    assert {(one.name, one.meaning, one.step) for one in found} == {
        ("new one", "of new one", "0.01 N")
    }


def test_nothing_special_names_the_tolerance_of_the_worst_constraint():
    found = failed(scenario(**DEFAULTS))
    assert list(found) == ["tolerances.contact"]
    value = float(found["tolerances.contact"].split()[1])
    assert value > scenario().tolerances.contact + FOOT.value


@pytest.mark.parametrize(
    ("demand", "what", "s", "key"),
    [
        (CONTACT_POSITION, "left heel, forward", 0.1, "contact"),
        (CONTACT_POSITION, "left heel, height", 0.1, "contact_height"),
        (SOFT_IMPACT, "left heel, vertical", 0.1, "contact_speed"),
        (SOFT_IMPACT, "left heel, vertical", 0.01, "landing_speed"),
        (SOFT_IMPACT, "left toe, vertical", 0.18, "landing_speed"),
        (SOFT_IMPACT, "right inner ball, vertical", 0.1, "contact_speed"),
        (SOFT_IMPACT, "right toe, forward", 0.1, "toe_off_speed"),
    ],
)
def test_the_tolerance_is_that_of_the_point_and_its_time(demand, what, s, key):
    task = scenario(control_points=14, objective={"formulation": "human"})
    worst = Violation(demand, "m/s", 0.01, s * task.walk.step_time, what)
    assert list(failed(task, [worst])) == [f"tolerances.{key}"]
    assert list(failed(scenario(**DEFAULTS), [worst])) == [f"tolerances.{demand.tolerance.key}"]


def test_a_tolerance_out_of_range_is_not_suggested():
    found = failed(scenario(**DEFAULTS), [replace(FOOT, value=1.0)])
    assert list(found) == ["--solver"]


def usual(found):
    """Whether only the tolerance of the worst constraint is suggested."""
    return list(found) == ["tolerances.contact"]


def test_a_fast_cadence_is_named_with_what_is_possible():
    found = failed(scenario(1.6, 0.4, **DEFAULTS))
    assert "240 steps/min" in found["walk.speed"]
    assert "at most 1.20" in found["walk.speed"]
    assert 0.4 < float(found["walk.step_length"].split()[1].rstrip(",")) < 0.9
    assert usual(failed(scenario(1.1, 0.4, **DEFAULTS)))


def test_a_slow_cadence_is_named_too():
    assert "at least" in failed(scenario(0.3, 0.6, **DEFAULTS))["walk.speed"]
    assert usual(failed(scenario(0.5, 0.6, **DEFAULTS)))


def test_a_speed_at_which_people_run_is_named():
    assert "people run" in failed(scenario(2.5, 0.85, **DEFAULTS))["walk.speed"]
    assert usual(failed(scenario(2.0, 0.85, **DEFAULTS)))


def test_a_long_step_is_told_in_leg_lengths():
    task = scenario(1.8, 1.0, **DEFAULTS)
    text = failed(task)["walk.step_length"]
    assert f"{1.0 / task.subject.leg_length:.2f} leg lengths" in text
    assert usual(failed(scenario(1.6, 0.8, **DEFAULTS)))


def test_a_body_out_of_proportion_is_told_as_bmi():
    heavy = {"sex": "male", "stature": 1.6, "mass": 150.0}
    assert "BMI of 59" in failed(scenario(subject=heavy, **DEFAULTS))["subject.mass"]
    assert usual(failed(scenario(subject=heavy | {"mass": 80.0}, **DEFAULTS)))


def test_a_heavy_load_is_told_in_body_mass():
    found = failed(scenario(load={"mass": 60.0}, **DEFAULTS))
    assert "% of the body mass" in found["load.mass"]
    assert usual(failed(scenario(load={"mass": 20.0}, **DEFAULTS)))


def test_few_control_points_are_named():
    found = failed(scenario(control_points=6, intervals=20))
    assert "3 cubic pieces" in found["discretisation.control_points"]
    assert usual(failed(scenario(control_points=9, intervals=20)))


def test_a_frozen_knee_cannot_bend_in_swing():
    frozen = ["knee_flexion_r", "knee_flexion_l"]
    found = failed(scenario(limits={"frozen": frozen}, **DEFAULTS))
    assert all(name in found["limits.frozen"] for name in frozen)
    assert "60" in found["limits.frozen"]
    wrist = failed(scenario(limits={"frozen": ["wrist_flexion_r"]}, **DEFAULTS))
    assert "limits.frozen" not in wrist


def test_a_range_without_60_deg_of_knee_flexion_is_named():
    narrow = scenario(limits={"knee_flexion_l": [0.0, 40.0]}, **DEFAULTS)
    assert "60" in failed(narrow)["limits.knee_flexion_l"]
    wide = scenario(limits={"knee_flexion_l": [0.0, 80.0]}, **DEFAULTS)
    assert "limits.knee_flexion_l" not in failed(wide)


def test_a_range_that_stands_in_the_way_of_the_worst_row_is_named():
    """A pelvis below 0.8 m: the right toes cannot stay above the ground unless it rises."""
    low = {"pelvis_ty": [0.5, 0.8]}
    ground = Violation(GROUND_PENETRATION, "m", 0.1, 0.1, "right toe, height")
    found = failed(scenario(limits=low, **DEFAULTS), [ground])
    assert "pelvis height, held at 0.80 m" in found["limits.pelvis_ty"]
    high = scenario(limits={"pelvis_ty": [0.5, 1.4]}, **DEFAULTS)
    assert "limits.pelvis_ty" not in failed(high, [ground])


def test_what_fails_between_the_instants_asks_for_more_of_them():
    task = scenario(**DEFAULTS)
    found = failed(task, [], [OFF_GRID], converged=True)
    assert "40" in found["discretisation.intervals"]
    kept = replace(OFF_GRID, value=0.0)
    assert failed(task, [], [kept], converged=True) == {}


def test_a_slippery_floor_asks_for_shorter_steps():
    found = failed(scenario(**DEFAULTS), [], [SLIPPERY], converged=True)
    assert list(found) == ["walk.step_length", "ground.friction"]


def test_friction_that_no_floor_has_is_not_suggested_and_of_two_needs_the_larger_counts():
    turning = ground.TURNING.found(1.7123, 0.5, 0.1)
    found = failed(scenario(**DEFAULTS), [], [SLIPPERY, turning], converged=True)
    assert "at least 1.72 " in found["ground.friction"]
    assert "1.71 of friction is needed" in found["walk.step_length"]
    icy = ground.SLIDING.found(33.05, 0.5, 0.1)
    assert "ground.friction" not in failed(scenario(**DEFAULTS), [], [icy], converged=True)
    shortest = scenario(0.3, 0.1, **DEFAULTS)
    assert "walk.step_length" not in failed(shortest, [], [SLIPPERY], converged=True)


SETTING = r"(?:at least|at most|shorter than) ([\d.]+)|^([\d.]+)(?: to ([\d.]+))?"


def odd_tasks():
    """Scenarios with one setting at an end of its range, and some with two or three."""
    usual = scenario(**DEFAULTS)
    for name, kind in type(usual).sections().items():
        for key in kind.kinds():
            if "range" in kind.rule(key) and kind.kinds()[key] in (int, float):
                for end in kind.rule(key)["range"]:
                    with contextlib.suppress(ScenarioError):
                        yield usual.replace({f"{name}.{key}": kind.kinds()[key](end)})
    yield usual.replace(stature=2.2, **{"subject.mass": 30.0})
    yield usual.replace(stature=1.3, **{"subject.mass": 200.0}, step_length=0.3)
    yield usual.replace({"subject.mass": 30.0, "load.mass": 100.0})
    yield usual.replace(speed=3.0, step_length=0.1)
    yield usual.replace(speed=0.1, step_length=1.0)


def test_advice_is_within_the_range_of_its_setting_and_given_once():
    icy = ground.SLIDING.found(5.0, 0.5, 0.1)
    tasks = [task for task in odd_tasks() if task.discretisation.intervals <= 40]
    assert len(tasks) > 50
    for task in tasks:
        program = GaitProgram(task)
        gait, numbers = program.gait(program.guess()), (1, 1, 1.0, 1.0)
        solution = Solution(gait, False, False, "newton", "no room", *numbers, [FOOT])  # type: ignore[arg-type]
        found = suggestions(program, solution, [icy, OFF_GRID])
        assert len({one.key for one in found}) == len(found)
        for one in found:
            section, _, key = one.key.partition(".")
            kind = type(task).sections().get(section)
            number = re.search(SETTING, one.change)
            if kind and number and section != "limits":
                low, high = kind.rule(key)["range"]
                values = [float(value) for value in number.groups() if value]
                assert all(low <= value <= high for value in values), str(one)


def test_phases_that_nobody_has_are_named():
    late = {"foot_flat": 0.97, "ball_off": 0.97, "double_support": 0.97}
    late |= {"heel_unloading": 0.98, "mid_swing": 0.98, "heel_off": 0.99}
    found = failed(scenario(phases=late, **DEFAULTS))
    assert "97 % of the step" in found["phases.double_support"]
    assert "phases.double_support" not in failed(scenario(**DEFAULTS))


def test_an_interrupted_solve_that_cannot_end_well_says_so():
    frozen = scenario(limits={"frozen": ["knee_flexion_r"]}, **DEFAULTS)
    assert list(failed(frozen, interrupted=True)) == ["limits.frozen"]


def test_out_of_iterations_another_solver_is_suggested_or_to_go_on():
    status = "32: major iteration limit reached"
    found = failed(scenario(**DEFAULTS), status=status)
    assert found["--solver"].startswith("--solver: newton")
    assert "human-gait refine" not in found
    assert "human-gait refine" in failed(scenario(**DEFAULTS), [], status=status)
    assert "--solver" not in failed(scenario(**DEFAULTS))
    for solver, other in (("newton", "snopt"), ("ipopt", "newton")):
        for status in ("iteration limit reached", "Max iteration exceeded"):
            found = failed(scenario(**DEFAULTS), status=status, solver=solver)
            assert found["--solver"].startswith(f"--solver: {other}")


def test_an_interrupted_solve_blames_nothing():
    impossible = scenario(3.0, 0.4, **DEFAULTS)
    assert list(failed(impossible, interrupted=True)) == ["predict"]


EXACT = {
    "newton": {},
    "snopt": {"Major optimality tolerance": 1e-6},
    "ipopt": {"tol": 1e-6, "mu_strategy": "monotone"},
}
CURVED = {"newton": ARM_LEG_COUPLING, "snopt": ARM_LEG_COUPLING, "ipopt": "none: it is slow"}


@pytest.fixture(scope="module", params=["acceleration", "velocity"])
def program(request):
    return build_program(scenario(periodicity=request.param))


@pytest.mark.parametrize("solver", SOLVERS)
def test_multipliers_are_what_holds_the_cost_back(program, solver):
    """Stationarity: the gradient of a cost is the sum of multipliers times gradients of rows.

    A quadratic cost under the linear rows, some products and the bounds is quick to minimise.
    """
    easy = [c for c in program.constraints if c.linear or c.demand == CURVED[solver]]
    stage = program.stage(easy)
    guess, unit = program.guess(), program.unit
    apart = np.tile(program.limits[1], program.basis.n_free) - guess > 0.1  # pull some joints up
    target = (guess + 0.5 * apart) / unit
    Q, b = 2.0 * np.diag(unit**2), -2.0 * unit**2 * target
    stage.prog.AddQuadraticCost(Q, b, stage.variables)
    end = solver_room.run_stage(program, stage, solver, guess, EXACT[solver])
    assert end.solved
    at = end.free
    slope = 2.0 * (at - target * unit) / COST_SCALE
    found = program.multipliers(end.duals, at)
    held = found[LIMITS.name].copy()
    matrix = program.symmetry[0]
    if len(matrix):
        held += matrix.T @ found[SYMMETRY.name]
    for constraint in easy:
        held += program.residual(constraint, at)[1].T @ found[constraint.name]
    np.testing.assert_allclose(held, slope, atol=2e-3 * np.abs(slope).max())
    lower, upper = (np.tile(limit, program.basis.n_free) for limit in program.limits)
    assert all(np.any(found[c.name] != 0.0) for c in easy if not c.linear)
    assert np.any(found[LIMITS.name] < 0.0)
    assert np.all((at - lower)[found[LIMITS.name] > 0.0] <= 1e-4)
    assert np.all((upper - at)[found[LIMITS.name] < 0.0] <= 1e-4)


def test_a_limit_before_the_step_is_that_of_the_other_side_at_its_end():
    program = build_program(scenario())
    T = program.basis.step_time
    row = limit_row(program, index("knee_flexion_r"), 2.0)
    assert row.what.startswith("left knee flexion, not below")
    assert 0.5 * T < row.time < T
    lateral = limit_row(program, index("spine1_lateral"), 2.0)
    assert "not above" in lateral.what  # in the mirror it bends to the other side
    inner = limit_row(program, 3 * N_DOF + index("knee_flexion_r"), -2.0)
    assert inner.what.startswith("right knee flexion, not above")


def test_influences_sum_prices_of_all_instants_and_leave_out_what_is_negligible():
    program = build_program(scenario(limits={"frozen": ["wrist_flexion_r"]}))
    prices = {c.name: np.zeros(len(c.lower)) for c in program.constraints}
    prices[LIMITS.name] = np.zeros(len(program.unit))
    speed = demanded(PELVIC_VELOCITY, program)
    prices[speed.name][[2, 5]] = 3.0, -7.0
    prices[GROUND_PUSHES.name][0] = 1e-9
    prices[LIMITS.name][N_DOF * 2 + index("wrist_flexion_r")] = 1.0
    solution = solution_like(program, prices, cost=1.0)
    found = {one.name: one for one in influences(program, solution)}
    assert set(found) == {PELVIC_VELOCITY.name, LIMITS.name}
    assert found[PELVIC_VELOCITY.name].price == 10.0
    assert found[PELVIC_VELOCITY.name].saving == pytest.approx(10.0 * STEPS["m/s"][0])
    assert found[PELVIC_VELOCITY.name].time == program.times[speed.instants[5]]
    assert "held at 0 deg" in found[LIMITS.name].what
    assert influences(program, solution_like(program, {}, cost=1.0)) == []


def test_what_strength_would_save_is_told_of_a_newton_metre():
    program = build_program(scenario()).with_strength()
    prices = {c.name: np.zeros(len(c.lower)) for c in program.constraints}
    prices[LIMITS.name] = np.zeros(len(program.unit))
    prices[demanded(STRENGTH, program).name][7] = -2.0
    (found,) = influences(program, solution_like(program, prices, cost=1000.0))
    assert (found.step, found.saving) == ("1 N m", pytest.approx(2e-3))


@pytest.mark.parametrize("cost", [0.0, -5.0])
def test_savings_of_a_rewarded_walk_are_shares_of_its_effort(cost):
    """Rewards may leave nothing of the objective, or less: the effort itself, Eq. (18), is left."""
    program = build_program(scenario())
    prices = {c.name: np.zeros(len(c.lower)) for c in program.constraints}
    prices[LIMITS.name] = np.zeros(len(program.unit))
    effort = program.cost(program.guess())[0]
    prices[PELVIC_VELOCITY.name][2] = -effort
    (found,) = influences(program, solution_like(program, prices, cost))
    assert found.saving == pytest.approx(STEPS["m/s"][0], rel=1e-9)


def solution_like(program, multipliers, cost):
    numbers = {"iterations": 1, "evaluations": 1, "wall_time": 1.0}
    return Solution(
        gait=program.gait(program.guess()),
        converged=True,
        interrupted=False,
        solver="snopt",
        status="1",
        cost=cost,
        violations=[],
        multipliers=multipliers,
        **numbers,
    )


SHAPE = {
    "constraint": "contact position",
    "equation": "20",
    "what": "left heel, forward",
    "meaning": "it stands",
    "unit": "m",
    "price": 5.0,
    "step": "1 mm",
    "saving": 0.2,
    "time_s": 0.2 * guessed_gait().step_time,
}
EXPLANATION = {"cost": 1.0, "step_time_s": guessed_gait().step_time, "shapes": [SHAPE]}
SUCCESS = {"success": True, "diagnosis": None}
FAILURE = {
    "success": False,
    "diagnosis": {
        "not_kept": ["left heel: 3 mm"],
        "try": [{"key": "walk.speed", "change": "[slower]", "because": "too fast"}],
    },
}


@pytest.fixture
def folder(tmp_path):
    """A result folder with these files, as objects or as text."""

    def write(summary=None, explanation=None):
        save_gait(guessed_gait(), tmp_path)
        for name, content in (("summary", summary), ("explanation", explanation)):
            if content is not None:
                text = content if isinstance(content, str) else json.dumps(content)
                (tmp_path / f"{name}.json").write_text(text)
        return tmp_path

    return write


def test_explain_prints_the_bounds_of_a_walk(folder, capsys):
    assert cli.run(["explain", str(folder(SUCCESS, EXPLANATION))]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    for part in ("contact position: left heel, forward", "20 %", "1 mm", "20.00 %", "it stands"):
        assert part in printed


def test_explain_prints_the_diagnosis_of_a_failure(folder, capsys):
    assert cli.run(["explain", str(folder(FAILURE))]) == 0
    printed = capsys.readouterr().out
    assert "left heel: 3 mm" in printed
    assert "walk.speed: [slower] (too fast)" in printed


def test_a_failure_without_a_diagnosis_says_so(folder, capsys):
    assert cli.run(["explain", str(folder({"success": False}))]) == 0
    assert "why is not recorded" in capsys.readouterr().out


def test_a_walk_without_costly_bounds_says_so(folder, capsys):
    assert cli.run(["explain", str(folder(SUCCESS, EXPLANATION | {"shapes": []}))]) == 0
    assert "No bound" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("summary", "explanation"),
    [
        (None, None),
        ("{", None),
        ("\udcff".encode("utf-8", "surrogateescape").decode("latin-1") + "{", None),
        ("[]", EXPLANATION),
        ({"success": False, "diagnosis": {"not_kept": []}}, None),
        ({"success": False, "diagnosis": {"not_kept": 3, "try": []}}, None),
        ({"success": False, "diagnosis": {"not_kept": [], "try": [3]}}, None),
        (SUCCESS, None),
        (SUCCESS, "{"),
        (SUCCESS, "[" * 100_000),
        (SUCCESS, "[]"),
        (SUCCESS, {"shapes": [{}], "step_time_s": 1.0}),
        (SUCCESS, EXPLANATION | {"step_time_s": 0.0}),
        (SUCCESS, EXPLANATION | {"step_time_s": "x"}),
        (SUCCESS, EXPLANATION | {"shapes": 3}),
        (SUCCESS, EXPLANATION | {"shapes": [SHAPE | {"saving": None}]}),
    ],
)
def test_what_is_missing_or_damaged_is_one_line(folder, capsys, summary, explanation):
    path = folder(summary, explanation)
    with pytest.raises(ResultError, match="predict it again"):
        explained(path)
    assert cli.run(["explain", str(path)]) == cli.BAD_INPUT
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("error: ")


@pytest.mark.parametrize("damage", [None, "{", "[]"])
def test_explain_report_and_compare_say_the_same_of_one_summary(tmp_path, capsys, damage):
    save_gait(guessed_gait(), tmp_path)
    save_gait_cycle(guessed_gait(), tmp_path / "gait_cycle.csv")
    (tmp_path / "explanation.json").write_text(json.dumps(EXPLANATION))
    if damage:
        (tmp_path / "summary.json").write_text(damage)
    commands = ("explain", "report", "compare") if damage == "{" else ("explain", "report")
    said = set()
    for command in commands:
        assert cli.run([command, str(tmp_path)]) == cli.BAD_INPUT
        said.add(capsys.readouterr().err)
    assert len(said) == 1


def test_explain_of_no_result_is_bad_input(capsys):
    assert cli.run(["explain", "nowhere"]) == cli.BAD_INPUT
    assert "no result here" in capsys.readouterr().err


@pytest.mark.solve
def test_the_explanation_of_a_walk_names_bounds_that_hold_it():
    result = solved("paper-normal")
    found = json.loads((result.folder / "explanation.json").read_text())
    savings = [one["saving"] for one in found["shapes"]]
    assert savings == sorted(savings, reverse=True)
    assert savings[-1] >= NEGLIGIBLE
    assert {CONTACT_POSITION.name, LIMITS.name} <= {one["constraint"] for one in found["shapes"]}
    assert all(0.0 <= one["time_s"] <= found["step_time_s"] for one in found["shapes"])
    assert result.summary["diagnosis"] is None
    explained(result.folder)


@pytest.mark.solve
def test_multipliers_of_a_walk_foretell_what_more_room_saves():
    """At the optimum: stationary; and solved again with 0.1 mm more tolerance for the feet."""
    gait = solved("paper-normal").gait
    task, free = gait.scenario, gait.control_points[: gait.basis.n_free].ravel()
    program = build_program(task)
    solution = solve(program, start=free)
    assert solution.converged
    free = solution.gait.control_points[: program.basis.n_free].ravel()
    slope, prices = program.cost(free)[1], solution.multipliers
    left = slope - prices[LIMITS.name]
    for constraint in program.constraints:
        left -= program.residual(constraint, free)[1].T @ prices[constraint.name]
    assert np.linalg.norm(left * program.unit) < 0.02 * np.linalg.norm(slope * program.unit)
    more = 1e-4
    room = task.replace({"tolerances.contact": task.tolerances.contact + more})
    looser = solve(build_program(room), start=free)
    foretold = -more * np.abs(prices[CONTACT_POSITION.name]).sum()
    assert looser.cost - solution.cost == pytest.approx(foretold, rel=0.2)
