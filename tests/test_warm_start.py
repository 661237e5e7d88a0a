"""Another walk as a start: what is kept, what is scaled, what is left out, what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from solves import solved
from walks import BACKPACK, near_walk, scenario

from human_gait.body.skeleton import N_DOF, index
from human_gait.exceptions import ResultError
from human_gait.newton import interior_point
from human_gait.newton.active_set import LOST, OPTIMAL
from human_gait.newton.nonlinear_program import End
from human_gait.problem.constraints import LIMITS, SYMMETRY
from human_gait.problem.program import build_program
from human_gait.results.names import MULTIPLIERS
from human_gait.solving import newton_solver as room
from human_gait.solving.drake_solvers import OPTIONS
from human_gait.solving.solver import solve
from human_gait.solving.starts import WARM, Start, climb
from human_gait.solving.warm_start import adapted, fitting, load_multipliers, save_multipliers

FORWARD = index("pelvis_tz")
JOINTS = np.delete(np.arange(N_DOF), FORWARD)
TASK = scenario(control_points=9)
PROGRAM = build_program(TASK)


@pytest.fixture(scope="module")
def gait():
    """Near the guess, unsymmetric, within the joint limits."""
    free = near_walk(PROGRAM).reshape(-1, N_DOF)
    return PROGRAM.gait(np.clip(free, *PROGRAM.limits).ravel())


def prices(program, seed=0):
    """A multiplier for every row."""
    rng = np.random.default_rng(seed)
    sizes = {c.name: len(c.lower) for c in program.constraints} | {LIMITS.name: len(program.unit)}
    if program.symmetry_words:
        sizes[SYMMETRY.name] = len(program.symmetry_words)
    return {name: rng.normal(size=size) for name, size in sizes.items()}


GUESS = PROGRAM.gait(PROGRAM.guess())


def assert_same(found, expected):
    assert set(found) == set(expected)
    for name, price in expected.items():
        np.testing.assert_array_equal(found[name], price)


# --- the file


def test_multipliers_are_read_as_they_were_written(tmp_path):
    written = prices(PROGRAM)
    save_multipliers(replace(GUESS, multipliers=written), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [MULTIPLIERS]
    assert_same(load_multipliers(GUESS, tmp_path), written)


def test_constraints_may_have_any_name(tmp_path):
    """Those that numpy or an archive would take for something else, too."""
    names = ["file", "allow_pickle", "arr_0", "a", "a.npy", "a/b", "../c", "", "\0", "__names__"]
    names += ["__0__", "self", "args", "caf\udce9", "\N{GREEK SMALL LETTER MU}", "n" * 70_000]
    written = {name: np.full(k + 1, float(k)) for k, name in enumerate(names)}
    save_multipliers(replace(GUESS, multipliers=written), tmp_path)
    assert_same(load_multipliers(GUESS, tmp_path), written)
    assert [path.name for path in tmp_path.iterdir()] == [MULTIPLIERS]


@pytest.mark.parametrize("names", ["", "[]", "3", '{"__0__": "a", "gone": "b"}', "[" * 9999])
def test_names_that_are_damaged_are_refused(tmp_path, names):
    np.savez(tmp_path / MULTIPLIERS, __names__=np.array(names), __0__=np.ones(3))
    with pytest.raises(ResultError, match=MULTIPLIERS):
        load_multipliers(GUESS, tmp_path)


def test_no_multipliers_are_no_file_and_no_file_is_no_multipliers(tmp_path):
    save_multipliers(GUESS, tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert load_multipliers(GUESS, tmp_path) == {}
    assert load_multipliers(GUESS, tmp_path / "nowhere") == {}


def test_multipliers_of_another_walk_are_refused(tmp_path):
    save_multipliers(replace(GUESS, multipliers=prices(PROGRAM)), tmp_path)
    with pytest.raises(ResultError, match=f"{MULTIPLIERS}.* another walk"):
        load_multipliers(replace(GUESS, control_points=GUESS.control_points + 1e-9), tmp_path)


def test_multipliers_of_older_versions_are_read(tmp_path):
    np.savez(tmp_path / MULTIPLIERS, **prices(PROGRAM))
    assert_same(load_multipliers(GUESS, tmp_path), prices(PROGRAM))


@pytest.mark.parametrize("damage", ["text", "cut", "flipped", "empty", "one array"])
def test_a_damaged_file_is_named(tmp_path, damage):
    save_multipliers(replace(GUESS, multipliers=prices(PROGRAM)), tmp_path)
    content = (tmp_path / MULTIPLIERS).read_bytes()
    middle = len(content) // 2
    (tmp_path / MULTIPLIERS).write_bytes(
        {
            "text": b"multipliers",
            "cut": content[:middle],
            "flipped": content[:middle] + bytes([content[middle] ^ 8]) + content[middle + 1 :],
            "empty": b"",
            "one array": content,
        }[damage]
    )
    if damage == "one array":
        with (tmp_path / MULTIPLIERS).open("wb") as file:
            np.save(file, np.ones(3))
    with pytest.raises(ResultError, match=MULTIPLIERS):
        load_multipliers(GUESS, tmp_path)


@pytest.mark.parametrize(
    "odd",
    [
        np.array([1.0, np.nan]),
        np.array([np.inf]),
        np.ones((2, 3)),
        np.array(1.0),
        np.array(["1.0"]),
        np.array([1j]),
        np.array([{}], dtype=object),
    ],
    ids=["nan", "infinite", "matrix", "scalar", "text", "complex", "object"],
)
def test_what_is_no_list_of_finite_numbers_is_refused(tmp_path, odd):
    np.savez(tmp_path / MULTIPLIERS, allow_pickle=True, **{"contact position": odd})
    with pytest.raises(ResultError, match=MULTIPLIERS):
        load_multipliers(GUESS, tmp_path)


# --- the motion


def test_on_the_same_problem_the_control_points_are_the_same(gait):
    np.testing.assert_array_equal(adapted(gait, PROGRAM), gait.free)


@pytest.mark.parametrize(
    ("speed", "step_length"), [(1.0, 0.66), (1.2, 0.73), (1.5, 0.75), (0.9, 0.5)]
)
def test_another_speed_or_step_keeps_the_joints_and_scales_the_way(gait, speed, step_length):
    """At the same phases of the step."""
    program = build_program(scenario(speed, step_length, control_points=9))
    other = program.gait(adapted(gait, program))
    phases = np.linspace(0.0, 1.0, 30)
    old, new = gait.q(phases * gait.step_time), other.q(phases * other.step_time)
    np.testing.assert_allclose(new[:, JOINTS], old[:, JOINTS], atol=1e-12)
    longer = step_length / 0.66
    np.testing.assert_allclose(new[:, FORWARD], longer * old[:, FORWARD], atol=1e-12)
    assert new[-1, FORWARD] - new[0, FORWARD] == pytest.approx(step_length, abs=1e-12)


def test_a_load_changes_nothing(gait):
    program = build_program(replace(TASK, load=scenario(load=BACKPACK).load))
    np.testing.assert_array_equal(adapted(gait, program), gait.free)


@pytest.mark.parametrize("control_points", [15, 21])
def test_more_control_points_give_nearly_the_same_curves(gait, control_points):
    """Every old piece is divided evenly: nothing gets lost."""
    program = build_program(scenario(control_points=control_points, intervals=24))
    other = program.gait(adapted(gait, program))
    phases = np.linspace(0.0, 1.0, 50) * gait.step_time
    assert other.free.shape == ((control_points - 3) * N_DOF,)
    np.testing.assert_allclose(other.q(phases), gait.q(phases), atol=1e-9)


@pytest.mark.parametrize(
    "task",
    [
        scenario(control_points=12),
        scenario(control_points=9, periodicity="velocity"),
        scenario(1.3, 0.7, control_points=14),
    ],
    ids=["12", "clamped", "faster"],
)
def test_other_pieces_give_curves_that_are_near(gait, task):
    """The disturbance of 0.02 from control point to control point is all that may get lost."""
    program = build_program(task)
    other = program.gait(adapted(gait, program))
    phases = np.linspace(0.0, 1.0, 50)
    old, new = gait.q(phases * gait.step_time), other.q(phases * other.step_time)
    old[:, FORWARD] *= task.walk.step_length / 0.66
    apart = np.sqrt(np.mean((new - old) ** 2, axis=0))
    assert apart.max() < 0.01


def test_a_clamped_gait_is_a_start_for_a_clamped_one_and_for_a_mirrored_one(gait):
    clamped = build_program(scenario(control_points=9, periodicity="velocity"))
    there = clamped.gait(adapted(gait, clamped))
    np.testing.assert_array_equal(adapted(there, clamped), there.free)
    back = PROGRAM.gait(adapted(there, PROGRAM))
    t = np.linspace(0.0, gait.step_time, 50)
    assert np.abs(back.q(t) - gait.q(t)).max() < 0.03


@pytest.mark.parametrize("control_points", [9, 12])
def test_new_joint_limits_are_kept(gait, control_points):
    limits = {"frozen": ["wrist_flexion_r"], "knee_flexion_l": [5.0, 40.0]}
    free = {"swing_knee": "free"}
    program = build_program(
        scenario(1.3, 0.7, control_points=control_points, limits=limits, posture=free)
    )
    points = adapted(gait, program).reshape(-1, N_DOF)
    lower, upper = program.limits
    assert np.all((points >= lower) & (points <= upper))
    assert np.any(points[:, index("knee_flexion_l")] == upper[index("knee_flexion_l")])
    assert np.all(points[:, index("wrist_flexion_r")] == 0.0)


# --- the multipliers


@pytest.mark.parametrize("periodicity", ["acceleration", "velocity"])
def test_all_multipliers_fit_the_same_problem(periodicity):
    program = build_program(scenario(control_points=9, periodicity=periodicity))
    found, given = fitting(prices(program), program), prices(program)
    for name, price in given.items():
        np.testing.assert_array_equal(found[name], price)
    assert all(len(found[name]) == 0 for name in set(found) - set(given))


def test_multipliers_of_other_rows_are_zero():
    """Twice as many instants, but as many control points: the limits alone belong together."""
    finer = build_program(scenario(control_points=9, intervals=24))
    given = prices(PROGRAM)
    found = fitting(given, finer)
    np.testing.assert_array_equal(found[LIMITS.name], given[LIMITS.name])
    sizes = {c.name: len(c.lower) for c in finer.constraints}
    kept = {c.name for c in PROGRAM.constraints if len(c.lower) == sizes[c.name]}
    assert "contact position" not in kept
    for name, size in sizes.items():
        expected = given[name] if name in kept else np.zeros(size)
        np.testing.assert_array_equal(found[name], expected)


def test_multipliers_of_other_control_points_keep_those_of_the_instants():
    more = build_program(scenario(control_points=10))
    given = prices(PROGRAM)
    found = fitting(given, more)
    np.testing.assert_array_equal(found[LIMITS.name], np.zeros(len(more.unit)))
    for constraint in more.constraints:
        np.testing.assert_array_equal(found[constraint.name], given[constraint.name])


def test_multipliers_that_no_row_is_called_by_are_left_out():
    found = fitting({"another constraint": np.ones(3)}, PROGRAM)
    assert "another constraint" not in found
    assert not any(np.any(price) for price in found.values())
    assert set(found) >= {c.name for c in PROGRAM.constraints} | {LIMITS.name}


def test_a_floor_that_holds_by_friction_has_rows_of_its_own():
    slippery = PROGRAM.with_friction()
    found, given = fitting(prices(PROGRAM), slippery), prices(PROGRAM)
    assert not np.any(found["sliding friction"])
    np.testing.assert_array_equal(found["contact position"], given["contact position"])
    back = fitting(prices(slippery), PROGRAM)
    assert "sliding friction" not in back


# --- both


def warm(solution, program):
    """A solve from another walk."""
    start, multipliers = adapted(solution.gait, program), fitting(solution.multipliers, program)
    return solve(program, start=start, multipliers=multipliers)


@pytest.fixture(scope="module")
def coarse():
    """A coarse walk, some seconds."""
    solution = solve(build_program(scenario()))
    assert solution.converged
    return solution


@pytest.fixture(scope="module")
def faster():
    return build_program(scenario(1.05 * 1.2))


@pytest.fixture(scope="module")
def faster_walk(faster):
    """The walk a little faster, from the guess."""
    return solve(faster)


def test_a_warm_walk_a_little_faster_takes_few_iterations(coarse, faster, faster_walk):
    found = warm(coarse, faster)
    assert found.converged
    assert found.status == OPTIMAL
    assert faster_walk.converged
    assert found.iterations <= faster_walk.iterations / 2
    assert found.cost == pytest.approx(faster_walk.cost, rel=1e-3)


def test_where_the_active_set_is_lost_the_barrier_goes_on(monkeypatch, coarse, faster, faster_walk):
    """From the same start; the steps that led nowhere are counted."""
    starts = []

    def lost(_, start, duals):
        starts.append(start)
        return End(start + 9.0, duals, False, LOST, 7)

    monkeypatch.setattr(room, "follow", lost)
    found = warm(coarse, faster)
    assert len(starts) == 1
    assert found.converged
    assert found.status == interior_point.OPTIMAL
    assert 7 < found.iterations < 7 + faster_walk.iterations
    assert found.cost == pytest.approx(faster_walk.cost, rel=1e-3)


def test_dense_matrices_are_for_few_variables(monkeypatch):
    def refuse(*_):
        raise AssertionError

    monkeypatch.setattr(room, "follow", refuse)
    monkeypatch.setitem(OPTIONS["newton"], "most_iterations", 1)
    many = build_program(scenario(control_points=11))
    assert len(many.variables) > 400
    gait = many.gait(many.guess())
    solve(many, start=gait.free, multipliers=prices(many))


@pytest.mark.solve
@pytest.mark.parametrize(
    ("what", "change"), [("speed", 1.05), ("step_length", 0.95), ("load", 1.05)]
)
def test_a_walk_changed_by_5_percent_is_found_sooner_from_its_neighbour(what, change):
    """By its first start, verified, and no dearer than the one that is found cold."""
    before = solved("paper-backpack-40")
    task = before.gait.scenario
    part = "load" if what == "load" else "walk"
    name = "mass" if what == "load" else what
    changed = replace(getattr(task, part), **{name: change * getattr(getattr(task, part), name)})
    other = build_program(replace(task, **{part: changed}))
    multipliers = fitting(load_multipliers(before.gait, before.folder), other)
    start = Start(WARM, adapted(before.gait, other), multipliers)
    (found,), (cold,) = climb(other, start=start), climb(other)
    assert found.success
    assert cold.success
    assert found.solution.status == OPTIMAL
    assert found.solution.iterations <= cold.solution.iterations / 3
    assert found.solution.cost <= 1.001 * cold.solution.cost
