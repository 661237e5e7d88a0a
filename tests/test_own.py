"""Costs and constraints of one's own: derivatives, shapes, and that every solver honours them."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from walks import central_difference, near_walk, scenario

import human_gait as hg
from human_gait.body.skeleton import MIRROR_INDEX, MIRROR_SIGN, N_DOF, index
from human_gait.problem.objective import squared_torque_rate
from human_gait.problem.own import Motion, PathConstraint, Rows, RunningCost
from human_gait.problem.program import build_program
from human_gait.solving.solver import solve

RNG = np.random.default_rng(7)
A, B, C, D = (RNG.normal(size=(2, N_DOF)) for _ in range(4))
TASKS = {
    "mirrored": scenario(control_points=6),
    "clamped": scenario(control_points=5, periodicity="velocity"),
}


def curved(motion):
    """Two rows that depend on everything, none of it linearly."""
    q, v, a, tau = motion.q, motion.v, motion.a, motion.torque / 50.0
    inner = q @ A.T + 0.1 * v @ B.T + 0.01 * a @ C.T + 0.1 * tau @ D.T
    slope = np.cos(inner)[..., None]
    by = slope * A, 0.1 * slope * B, 0.01 * slope * C, 0.1 * slope * D / 50.0
    return Rows(np.sin(inner), *by)


def curved_second(motion, multipliers):
    rows = curved(motion)
    J = np.concatenate(rows[1:], axis=2) / np.cos(np.arcsin(rows.value))[..., None]
    return np.einsum("kr,kri,krj->kij", -multipliers * rows.value, J, J)


def powers(motion):
    """Squared joint powers: torque times velocity."""
    power = motion.torque * motion.v
    diagonal = np.eye(N_DOF)
    return Rows(
        power, by_v=motion.torque[..., None] * diagonal, by_torque=motion.v[..., None] * diagonal
    )


def torque_rate(program):
    task = program.scenario
    n = task.discretisation.intervals * task.discretisation.dynamics_per_interval
    return squared_torque_rate(
        1e-3 * np.ones(N_DOF), task.walk.step_time / n, task.discretisation.mirrored
    )


COSTS = {
    "as it is": RunningCost("sum", curved, weight=300.0, squared=False),
    "as it is, second derivatives given": RunningCost(
        "sum", curved, weight=300.0, squared=False, second=curved_second
    ),
    "squared, second derivatives given": RunningCost(
        "squares", curved, weight=300.0, second=curved_second
    ),
    "rewarded": RunningCost("reward", curved, weight=-300.0, second=curved_second),
}


@pytest.fixture(params=TASKS.values(), ids=TASKS, scope="module")
def task(request):
    return request.param


def slopes_agree(program, terms=(), constraints=(), hessian=True):
    """Gradient and Hessian of terms and rows against central differences."""
    free, functions = near_walk(program), program.functions
    rng = np.random.default_rng(2)
    weighted = [(c, rng.normal(size=len(c.lower))) for c in constraints]
    along = rng.normal(size=(len(free), 4))

    def value(at):
        rows = sum(m @ program.residual(c, at)[0] for c, m in weighted)
        return (functions.cost(terms, at)[0] if terms else 0.0) + rows

    def gradient(at):
        rows = sum(m @ program.residual(c, at)[1] for c, m in weighted)
        return (functions.cost(terms, at)[1] if terms else 0.0) + rows

    assert worst(gradient(free) @ along, central_difference(value, free, along)) < 1e-6
    if hessian:
        rows = [(c, m, 0.0 * m) for c, m in weighted]
        found = functions.hessian(free, [(term, 1.0) for term in terms], rows).dense()
        np.testing.assert_allclose(found, found.T, atol=1e-10 * np.abs(found).max())
        assert worst(found @ along, central_difference(gradient, free, along)) < 1e-5


def worst(found, slopes):
    return np.abs(found - slopes).max() / np.abs(slopes).max()


@pytest.mark.parametrize("name", COSTS)
def test_derivatives_of_a_cost(task, name):
    program = build_program(task, costs=[COSTS[name]])
    slopes_agree(program, program.terms[1:])


def test_a_squared_cost_has_the_second_derivatives_of_gauss_and_newton(task):
    """Exact where the rows are zero: the cost of their distance from what they are there."""
    program = build_program(task)
    free = near_walk(program)
    here = curved(motion_of(program, free)).value

    def apart(motion):
        rows = curved(motion)
        return rows._replace(value=rows.value - here)

    term = RunningCost("distance", apart, weight=300.0).term()
    along = np.random.default_rng(2).normal(size=(len(free), 4))
    found = program.functions.hessian(free, [(term, 1.0)], []).dense() @ along
    slopes = central_difference(lambda at: program.functions.cost([term], at)[1], free, along)
    assert worst(found, slopes) < 1e-5


def motion_of(program, free):
    now = program.instants(free)
    return Motion(now.t, now.q, now.v, now.a, now.muscle_torque)


def test_derivatives_of_rates_of_torques_couple_neighbouring_instants(task):
    program = build_program(task)
    slopes_agree(program, [torque_rate(program)])


def test_the_rate_of_torque_is_that_of_the_differences(task):
    """Of a whole step, the last difference to the mirror image of its beginning."""
    program = build_program(task)
    free, term = near_walk(program), torque_rate(program)
    tau = program.instants(free).muscle_torque
    dt = program.times[1]
    if program.basis.mirrored:
        tau = np.vstack([tau, MIRROR_SIGN * tau[0, MIRROR_INDEX]])
    expected = 1e-3 * np.sum((np.diff(tau, axis=0) / dt) ** 2) * dt
    assert program.functions.cost([term], free)[0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("second", [None, curved_second], ids=["differences", "given"])
def test_derivatives_of_a_constraint(task, second):
    own = PathConstraint("own", curved, -1.0, 1.0, second=second)
    program = build_program(task, constraints=[own])
    slopes_agree(program, constraints=program.constraints[-1:])


def test_powers_by_differences_of_their_gradient():
    program = build_program(
        TASKS["mirrored"], constraints=[PathConstraint("power", powers, upper=500.0)]
    )
    slopes_agree(program, constraints=program.constraints[-1:])


def test_everything_together_is_the_sum_of_its_parts(task):
    own = PathConstraint("own", curved, -1.0, 1.0, second=curved_second)
    program = build_program(task, costs=[COSTS["rewarded"]], constraints=[own])
    curved_ones = [c for c in program.constraints if not c.linear]
    slopes_agree(program, [*program.terms, torque_rate(program)], curved_ones)


def plain(motion):
    """The flexion of the right knee, which any motion has."""
    by_q = np.zeros((len(motion.t), 1, N_DOF))
    by_q[:, 0, KNEE] = 1.0
    return Rows(motion.q[:, [KNEE]], by_q)


def spoilt(part, at=0, by=np.nan):
    """The same with one number that is none."""

    def rows(motion):
        found = plain(motion)
        getattr(found, part)[at] = by
        return found

    return rows


KNEE = index("knee_flexion_r")
FEW = (2, 4 * N_DOF, 4 * N_DOF)
MISTAKES = {
    "an array": ({"rows": lambda m: m.q}, "returns ndarray, must be Rows"),
    "nothing": ({"rows": lambda _: None}, "returns NoneType, must be Rows"),
    "a list": ({"rows": lambda m: list(plain(m))}, "returns list, must be Rows"),
    "no rows": ({"rows": lambda m: Rows(np.zeros((len(m.t), 0)))}, r"rows of shape .*, 0\), must"),
    "rows that are words": ({"rows": lambda _: Rows("knee")}, "rows are no array of numbers"),
    "NaN": ({"rows": spoilt("value")}, "rows at the first guess must be finite"),
    "infinite": ({"rows": spoilt("value", by=np.inf)}, "rows at the first guess must be finite"),
    "NaN late": ({"rows": spoilt("value", at=-1)}, "rows at the first guess must be finite"),
    "partials of NaN": ({"rows": spoilt("by_q")}, "by_q at the first guess must be finite"),
    "second of one instant": (
        {"second": lambda *_: np.zeros(FEW[1:])},
        "second derivatives of shape .* must be",
    ),
    "second of q alone": (
        {"second": lambda m, _: np.zeros((len(m.t), N_DOF, N_DOF))},
        "second derivatives of shape .* must be",
    ),
    "no second": ({"second": lambda *_: None}, "second derivatives of shape .* must be"),
    "second of NaN": (
        {"second": lambda m, _: np.full((len(m.t), *FEW[1:]), np.nan)},
        "second derivatives at the first guess must be finite",
    ),
}


def told_in_one_line(make, name, what):
    """What is said of a mistake begins with the name of what it is in."""
    with pytest.raises((TypeError, ValueError), match=what) as raised:
        make()
    said = str(raised.value)
    assert said.startswith(f"{name}: ")
    assert len(said.splitlines()) == 1


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_in_functions_are_told_before_anything_is_solved(name):
    changes, what = MISTAKES[name]
    program = build_program(TASKS["mirrored"])
    now = program.instants(program.guess())
    held = replace(PathConstraint("own", plain, upper=2.0), **changes)
    told_in_one_line(lambda: held.constraint(now), "own", what)
    cost = replace(RunningCost("own", plain), **changes)
    told_in_one_line(lambda: cost.checked(now), "own", what)


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"weight": np.nan}, "weight is nan, must be finite"),
        ({"weight": -np.inf}, "weight is -inf, must be finite"),
        ({"weight": "much"}, "weight is 'much', must be a number"),
        ({"weight": None}, "weight is None, must be a number"),
        ({"name": 7}, "name is 7, must be text"),
    ],
)
def test_mistakes_in_a_cost_are_told(changes, what):
    program = build_program(TASKS["mirrored"])
    cost = replace(RunningCost("own", plain), **changes)
    now = program.instants(program.guess())
    told_in_one_line(lambda: cost.checked(now), cost.name, what)


def test_a_cost_without_mistakes_is_itself():
    program = build_program(TASKS["mirrored"])
    for cost in COSTS.values():
        assert cost.checked(program.instants(program.guess())) is cost


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"upper": np.nan}, "row 1 has the bounds -inf and nan, must be numbers, lower <= upper"),
        ({"lower": np.nan}, "row 1 has the bounds nan and 1, must be numbers, lower <= upper"),
        ({"lower": 1.1}, "row 1 has the bounds 1.1 and 1, must be numbers, lower <= upper"),
        ({"upper": np.inf}, "row 1 has the bounds -inf and inf, one of them must be finite"),
        ({"upper": [1.0, np.inf]}, "row 2 has the bounds -inf and inf, one of them must be finite"),
        ({"lower": np.inf, "upper": np.inf}, "row 1 has the bounds inf and inf, one"),
        ({"upper": "high"}, "bounds are no array of numbers"),
        ({"name": None}, "name is None, must be text"),
        ({"unit": 1}, "unit is 1, must be text"),
        ({"meaning": 1}, "meaning is 1, must be text"),
        ({"what": "ab"}, "what is 'ab', must be a list of texts"),
        ({"what": [1, 2]}, r"what is \[1, 2\], must be a list of texts"),
    ],
)
def test_mistakes_in_a_constraint_are_told(changes, what):
    own = replace(PathConstraint("own", curved, upper=1.0), **changes)
    told_in_one_line(lambda: build_program(TASKS["mirrored"], constraints=[own]), own.name, what)


def test_bounds_may_meet_and_may_be_on_one_side_only():
    for lower, upper in ((0.5, 0.5), (-np.inf, 1.0), (-1.0, np.inf), ([0.0, -np.inf], 1.0)):
        own = PathConstraint("own", curved, lower, upper)
        held = build_program(TASKS["mirrored"], constraints=[own]).constraints[-1]
        assert np.all(held.lower <= held.upper)


@pytest.mark.parametrize("part", Motion._fields)
def test_functions_cannot_write_into_the_walk(part):
    """Neither when they are called for rows nor for their second derivatives."""
    program = build_program(TASKS["mirrored"])
    now = program.instants(program.guess())

    def writing(motion):
        getattr(motion, part)[:] = 0.0
        return plain(motion)

    def too(motion, _):
        writing(motion)

    for changes in ({"rows": writing}, {"second": too}):
        own = replace(PathConstraint("own", plain, upper=2.0), **changes)
        with pytest.raises(ValueError, match="read-only"):
            own.constraint(now)
    assert all(given.flags.writeable for given in (now.q, now.v, now.a, now.muscle_torque))


WRONG = {
    "rows of one axis": lambda m: Rows(np.zeros(len(m.t))),
    "rows of another number of instants": lambda m: Rows(np.zeros((len(m.t) + 1, 2))),
    "partials of another shape": lambda m: Rows(
        np.zeros((len(m.t), 1)), np.zeros((len(m.t), 1, 3))
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_shapes_are_named(name):
    with pytest.raises(ValueError, match=r"own: (rows|by_q) of shape .* must be"):
        build_program(TASKS["mirrored"], constraints=[PathConstraint("own", WRONG[name])])


@pytest.mark.parametrize(
    ("changes", "what"),
    [({"lower": [0.0, 0.0, 0.0]}, "bounds of shape"), ({"what": ["one"]}, "1 words for 2 rows")],
)
def test_bounds_and_words_have_to_be_as_many_as_rows(changes, what):
    own = replace(PathConstraint("own", curved, upper=1.0), **changes)
    with pytest.raises(ValueError, match=f"own: {what}"):
        build_program(TASKS["mirrored"], constraints=[own])


@pytest.mark.parametrize("name", ["ZMP stability", "joint limit", "own"])
def test_a_name_that_is_taken_is_refused(name):
    taken = [PathConstraint(each, curved, upper=1.0) for each in (name, "own")]
    with pytest.raises(ValueError, match=f"'{name}' is the name of more than one"):
        build_program(TASKS["mirrored"], constraints=taken)


@pytest.fixture(scope="module")
def bent():
    """A walk whose right knee may not bend by more than 65 deg, as nowhere without that."""

    def knee(motion):
        by_q = np.zeros((len(motion.q), 1, N_DOF))
        by_q[:, 0, index("knee_flexion_r")] = 1.0
        return Rows(motion.q[:, [index("knee_flexion_r")]], by_q)

    def sideways(motion):
        by_q = np.zeros((len(motion.q), 1, N_DOF))
        by_q[:, 0, index("pelvis_tx")] = 1.0
        return Rows(motion.q[:, [index("pelvis_tx")]], by_q)

    cost = RunningCost("swaying of the pelvis", sideways, weight=1e7)
    limit = PathConstraint("knee", knee, upper=np.deg2rad(60.5), unit="rad", what=["right knee"])
    return build_program(scenario(), costs=[cost], constraints=[limit])


@pytest.mark.solve
@pytest.mark.parametrize("solver", ["newton", "snopt"])
def test_solvers_honour_them(bent, solver):
    plain = solve(build_program(scenario()))
    found = solve(bent, solver)
    assert plain.converged
    assert found.converged
    assert largest_knee(plain) > 61.0
    assert largest_knee(found) < 60.6
    assert sway(found) < 0.7 * sway(plain)
    assert {v.name for v in found.violations} >= {"knee"}
    assert len(found.multipliers["knee"]) == len(bent.times)


@pytest.mark.solve
@pytest.mark.parametrize("way", ["found", "loaded", "pickled"])
def test_what_a_bound_of_ones_own_costs_stays_with_the_gait(stiff, way, tmp_path):
    """In the words that it was given, where it belongs among the others, and with its meaning."""
    assert len(pickle.dumps(stiff)) < 50_000
    if way == "pickled":
        stiff = pickle.loads(pickle.dumps(stiff))
    folder = stiff.save(tmp_path / "kept")
    gait = hg.load(folder) if way == "loaded" else stiff
    told = hg.explain(gait)
    bounds = told.bounds
    own = [bound for bound in bounds if bound.name == "knee"]
    assert [(one.what, one.meaning, one.step) for one in own] == [
        ("right knee", "a brace is worn", "1 deg")
    ]
    price = np.abs(gait.multipliers["knee"]).sum()
    expected = price * np.deg2rad(1.0) / gait.solution["cost"]
    assert own[0].saving == pytest.approx(expected, rel=1e-9)
    assert [one.saving for one in bounds] == sorted((b.saving for b in bounds), reverse=True)
    assert "a brace is worn" in told.text
    assert hg.explain(folder).bounds == bounds


@pytest.mark.solve
def test_a_walk_without_bounds_of_ones_own_carries_nothing_of_them(stiff):
    found = hg.predict(stiff.scenario, warm_from=stiff)
    assert stiff.solution.keys() - found.solution.keys() == {"own_bounds"}
    assert "knee" not in [bound.name for bound in hg.explain(found).bounds]


@pytest.fixture(scope="module")
def stiff():
    """A walk whose right knee may not bend by more than 57 deg, for a reason."""
    task = scenario(intervals=20, dynamics_per_interval=2)
    limit = PathConstraint("knee", plain, -np.inf, 1.0, "rad", ["right knee"], "a brace is worn")
    return hg.predict(task, constraints=[limit])


def largest_knee(solution):
    t = build_program(solution.gait.scenario).times
    return np.rad2deg(solution.gait.q(t)[:, index("knee_flexion_r")].max())


def sway(solution):
    return np.std(solution.gait.q(np.linspace(0.0, 1.1, 50))[:, index("pelvis_tx")])


def test_they_stay_in_the_problem_of_friction_and_of_other_scenarios(bent):
    for program in (bent.with_friction(), bent.for_scenario(scenario(control_points=6))):
        assert "knee" in [c.name for c in program.constraints]
        assert "swaying of the pelvis" in [t.name for t in program.terms]
        names = [b.evaluator().get_description() for b in program.torques.prog.GetAllCosts()]
        assert "swaying of the pelvis" in names


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_in_a_cost_are_told_when_the_problem_is_built(name):
    changes, what = MISTAKES[name]
    cost = replace(RunningCost("own", plain), **changes)
    told_in_one_line(lambda: build_program(TASKS["mirrored"], costs=[cost]), "own", what)


@pytest.mark.parametrize(
    ("what", "given"),
    [
        ("costs", PathConstraint("own", curved, -1.0)),
        ("costs", [PathConstraint("own", curved, -1.0)]),
        ("constraints", [RunningCost("own", curved)]),
        ("constraints", None),
    ],
)
def test_what_is_no_list_of_the_right_kind_is_refused(what, given):
    with pytest.raises(TypeError, match=f"{what} must be a list of"):
        build_program(TASKS["mirrored"], **{what: given})


def test_a_gradient_asks_for_no_second_derivatives():
    """Differences of a function's first ones would be a hundred calls."""
    calls, program = [], build_program(scenario())

    def counted(motion):
        calls.append(len(motion.t))
        return Rows(motion.q[:, :1], by_q=np.eye(55)[None, :1].repeat(len(motion.t), axis=0))

    cost, free = RunningCost("angle", counted, squared=False), program.guess()
    program.functions.gradient(free, [(cost.term(), 1.0)])
    assert len(calls) == 1
