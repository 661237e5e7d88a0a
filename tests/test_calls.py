"""What a person calls from Python: with gaits, scenarios or paths, and what comes back."""

import dataclasses
import json
import pickle
import sys

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest
from pages import sparing
from walking import guessed_gait

import human_gait as hg
from human_gait.checks.contents import COST, OWN_COST
from human_gait.cli import run
from human_gait.problem.balance_rows import TURNING_FRICTION
from human_gait.problem.constraints import LIMITS
from human_gait.problem.posture_rows import STRENGTH
from human_gait.problem.program import build_program
from human_gait.results.names import EXPLANATION, GAIT_CYCLE, GAIT_FILE, SUMMARY

GAIT = guessed_gait(18.0)
TASK = hg.load_scenario("paper-normal")


# A gait, looked at


def test_a_curve_by_name_is_that_of_one_stride():
    times = GAIT.times
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(2 * GAIT.step_time, rel=1e-12)
    k = GAIT.joint_names.index("knee_flexion_r")
    np.testing.assert_array_equal(GAIT["knee_flexion_r"], GAIT.q(times)[:, k])
    np.testing.assert_array_equal(GAIT["knee_flexion_r_velocity"], GAIT.v(times)[:, k])
    np.testing.assert_array_equal(GAIT["knee_flexion_r_torque"], GAIT.tau(times)[:, k])
    muscles = GAIT.muscle_torque(times)[:, k]
    np.testing.assert_array_equal(GAIT["knee_flexion_r_muscle_torque"], muscles)
    now = GAIT.instants(times)
    np.testing.assert_array_equal(GAIT["grf_l_y"], now.grf[:, 1, 1])
    np.testing.assert_array_equal(GAIT["cop_r_z"], now.cop[:, 0, 2])
    np.testing.assert_array_equal(GAIT["yaw_moment_l"], now.yaw_moment[:, 1])
    np.testing.assert_array_equal(GAIT["zmp_z"], now.zmp[:, 2])


def test_all_names_are_curves():
    curves = dict(GAIT)
    assert list(curves) == list(GAIT.keys()) == list(GAIT)
    assert {curve.shape for curve in curves.values()} == {GAIT.times.shape}
    assert "knee_flexion_r" in GAIT
    assert "knee" not in GAIT
    assert set(GAIT.joint_names) < set(curves)


@pytest.mark.parametrize(
    ("name", "hint"),
    [("knee_flexion", "did you mean knee_flexion_"), ("qqq", "gait.keys"), (7, "gait.keys")],
)
def test_an_unknown_curve_is_named_with_the_nearest(name, hint):
    with pytest.raises(KeyError, match=hint):
        _ = GAIT[name]


def test_muscles_give_the_torque_less_that_of_tissues():
    t = np.array([0.1, 0.3, 0.9])
    assert GAIT.muscle_torque(0.1).shape == (55,)
    np.testing.assert_array_equal(GAIT.muscle_torque(t), GAIT.instants(t).active)
    assert not np.allclose(GAIT.muscle_torque(t), GAIT.tau(t))


def test_a_table_has_a_column_for_each_name():
    table = GAIT.to_dataframe()
    assert list(table.columns) == list(GAIT.keys())
    np.testing.assert_array_equal(table.index, GAIT.times)
    for name in ("knee_flexion_r", "hip_flexion_l_torque", "grf_r_x"):
        np.testing.assert_allclose(table[name], GAIT[name], rtol=0, atol=1e-9)
    few = GAIT.to_dataframe([0.1, 0.9])
    np.testing.assert_allclose(few["pelvis_ty"], GAIT.q([0.1, 0.9])[:, 2])
    assert few.index.name == "time"
    assert isinstance(few, pd.DataFrame)


def test_without_pandas_one_line_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError) as caught:
        GAIT.to_dataframe()
    assert "pip install 'human-gait[pandas]'" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_picture_is_shown_by_a_notebook():
    figure = GAIT.plot()
    assert figure._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(ValueError, match="joint_angles"):
        GAIT.plot("angles")


def test_exports_take_one_format_or_several(tmp_path):
    one = GAIT.export(str(tmp_path / "one"), "csv", rate=50)
    assert {path.suffix for path in one} == {".csv", ".json"}  # what they were made from
    two = GAIT.export(tmp_path / "two", ["bvh", "csv"], rate=50)
    assert {path.suffix for path in two} == {".csv", ".bvh", ".json"}
    with pytest.raises(ValueError, match="choose from"):
        GAIT.export(tmp_path / "three", "xlsx")
    assert not (tmp_path / "three").exists()


# Models of the body


WALKERS = {
    "gait": GAIT,
    "body": GAIT.body,
    "scenario": GAIT.scenario,
    "file": None,
}


@pytest.mark.parametrize("who", WALKERS)
def test_models_of_other_programs_have_the_order_of_the_joint_names(who, tmp_path):
    given = WALKERS[who]
    if given is None:
        given = tmp_path / "walker.toml"
        given.write_text(GAIT.scenario.to_toml())
    model, plant = hg.pinocchio_model(given), hg.drake_plant(given)
    assert model.nq == model.nv == plant.num_positions() == plant.num_velocities() == 55
    for k, name in enumerate(GAIT.joint_names):
        numbered = f"j{k + 1:02d}_{name}"
        joint = model.joints[model.getJointId(numbered)]
        assert joint.idx_q == joint.idx_v == k
        assert plant.GetJointByName(numbered).position_start() == k
        assert plant.GetJointByName(numbered).velocity_start() == k


def test_the_model_gives_the_torques_of_the_swinging_arm():
    """Of a limb that touches nothing inverse dynamics needs no ground."""
    model = hg.pinocchio_model(GAIT)
    tau = pin.rnea(model, model.createData(), GAIT.q(0.3), GAIT.v(0.3), GAIT.a(0.3))
    k = GAIT.joint_names.index("elbow_flexion_r")
    assert tau[k] == pytest.approx(GAIT.tau(0.3)[k], rel=1e-9)


def test_a_model_is_the_callers_own():
    model = hg.pinocchio_model(GAIT)
    model.gravity.linear = np.zeros(3)
    assert np.abs(hg.pinocchio_model(GAIT).gravity.linear).max() > 9.0


def test_a_subject_carries_nothing():
    mass = pin.computeTotalMass(hg.pinocchio_model(GAIT.scenario.subject))
    with_load = pin.computeTotalMass(hg.pinocchio_model(GAIT))
    assert with_load - mass == pytest.approx(18.0)


# What is no walk


def test_a_gait_that_is_no_walk_is_kept_and_explained(tmp_path):
    """The guess has been through no solver."""
    folder = GAIT.save(tmp_path / "guess")
    assert json.loads((folder / SUMMARY).read_text())["success"] is False
    text = str(hg.explain(GAIT))
    assert text.startswith("not kept:")
    assert text == str(hg.explain(folder))
    assert hg.explain(GAIT).bounds == ()
    assert hg.load(folder) == GAIT
    assert "no walk" in repr(hg.load(folder))


def test_saving_replaces_a_result_and_leaves_other_files(tmp_path, monkeypatch):
    sparing(monkeypatch)
    (tmp_path / "notes.txt").write_text("mine")
    GAIT.save(tmp_path)
    hg.report(tmp_path)
    GAIT.save(tmp_path)
    assert (tmp_path / "notes.txt").read_text() == "mine"
    assert not (tmp_path / "report.html").exists()
    assert {GAIT_FILE, SUMMARY, GAIT_CYCLE, EXPLANATION} <= {p.name for p in tmp_path.iterdir()}


OF_RESULTS = (hg.load, hg.verify, hg.compare, hg.explain, hg.play, hg.report, hg.bspline_trajectory)


@pytest.mark.parametrize("call", OF_RESULTS)
def test_a_path_without_a_result_is_one_line(call, tmp_path):
    with pytest.raises(hg.ResultError) as caught:
        call(tmp_path / "nowhere")
    assert "nowhere" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("call", [hg.film, hg.play, hg.bspline_trajectory])
def test_what_is_neither_a_gait_nor_a_path_is_a_type_error(call):
    with pytest.raises(TypeError):
        call(None)


@pytest.mark.parametrize("call", [hg.predict, hg.build_program, hg.pinocchio_model, hg.drake_plant])
def test_a_path_without_a_scenario_is_one_line(call):
    with pytest.raises(hg.ScenarioError, match=r"nowhere\.toml: cannot be read"):
        call("nowhere.toml")


def test_an_unknown_solver_is_refused_before_anything_is_read():
    with pytest.raises(ValueError, match="choose one of newton, snopt, ipopt"):
        hg.predict("nowhere.toml", solver="nowton")


def test_a_trajectory_of_drake_and_a_problem_by_path(tmp_path):
    folder = GAIT.save(tmp_path / "guess")
    found = hg.bspline_trajectory(str(folder))
    np.testing.assert_allclose(found.value(0.2)[:, 0], GAIT.q(0.2), atol=1e-12)
    (tmp_path / "own.toml").write_text(GAIT.scenario.to_toml())
    assert hg.build_program(tmp_path / "own.toml").scenario == GAIT.scenario


# A prediction


@pytest.fixture(scope="module")
def told():
    return []


@pytest.fixture(scope="module")
def walk(told, tmp_path_factory):
    path = tmp_path_factory.mktemp("scenarios") / "quick.toml"
    path.write_text(TASK.to_toml())
    return hg.predict(str(path), progress=told.append)


@pytest.fixture(scope="module")
def saved(walk, tmp_path_factory):
    return walk.save(tmp_path_factory.mktemp("results") / "quick")


@pytest.mark.solve
def test_progress_is_told_to_a_function(walk, told):
    assert [now.number for now in told] == list(range(1, len(told) + 1))
    assert told[-1].cost == pytest.approx(walk.solution["cost"], rel=0.1)


@pytest.mark.parametrize("held", [(), ("friction",), ("strength",), ("friction", "strength")])
def test_a_saved_gait_tells_what_it_was_held_by(tmp_path, held):
    """Its problem is the one that it solved: rows of friction and strength are there if it was."""
    program = build_program(GAIT.scenario)
    for way in held:
        program = program.with_friction() if way == "friction" else program.with_strength()
    prices = {one.name: np.zeros(len(one.lower)) for one in program.constraints}
    prices[LIMITS.name] = np.zeros(GAIT.free.shape)
    rows = {TURNING_FRICTION.name, STRENGTH.name} & prices.keys()
    for name in rows:
        prices[name][3] = 1e4
    solution = {"solver": "newton", "status": "optimal", "cost": 1e3}
    gait = dataclasses.replace(GAIT, multipliers=prices, solution=solution)
    told = json.loads((gait.save(tmp_path / "walk") / EXPLANATION).read_text())
    assert {one["constraint"] for one in told["shapes"]} == rows
    assert len(rows) == len(held)


@pytest.mark.solve
def test_a_predicted_gait_knows_how_it_was_found(walk):
    assert walk.scenario == TASK
    assert walk.solution["success"] is True
    assert walk.solution["start"] == "own guess"
    assert walk.solution["iterations"] > 1
    assert walk.multipliers
    assert OWN_COST not in walk.solution
    assert hg.verify(walk).passed
    walk.tau(0.1)
    assert len(pickle.dumps(walk)) < 50_000
    again = pickle.loads(pickle.dumps(walk))
    assert again.solution == walk.solution
    assert again.multipliers.keys() == walk.multipliers.keys()


@pytest.mark.solve
def test_a_saved_gait_is_what_it_was_and_every_command_takes_it(walk, saved, capsys, monkeypatch):
    sparing(monkeypatch)
    for path in (saved, str(saved), saved / GAIT_FILE):
        again = hg.load(path)
        assert again == walk
        assert again.solution == walk.solution
        for name, prices in walk.multipliers.items():
            np.testing.assert_array_equal(again.multipliers[name], prices)
    for command in ("verify", "explain", "compare"):
        assert run([command, str(saved)]) == 0, capsys.readouterr().err
    assert run(["report", str(saved), "--out", str(saved / "report.html")]) == 0


@pytest.mark.solve
def test_checks_and_scores_of_a_path_are_those_of_the_gait(walk, saved):
    assert set(hg.verify(saved).names) - set(hg.verify(walk).names) == {"other files off the gait"}
    assert hg.verify(str(saved / GAIT_FILE)).passed
    assert hg.compare(saved) == hg.compare(walk) == hg.compare(str(saved / GAIT_FILE))
    assert str(hg.explain(saved)) == str(hg.explain(walk))
    assert hg.explain(walk).bounds


@pytest.mark.solve
@pytest.mark.parametrize("way", ["gait", "folder", "file", "loaded"])
def test_a_warm_start_takes_the_multipliers_along(walk, saved, way):
    ways = {"gait": walk, "folder": saved, "file": str(saved / GAIT_FILE), "loaded": hg.load(saved)}
    near = TASK.replace({"walk.speed": TASK.walk.speed * 1.002})
    found = hg.predict(near, warm_from=ways[way])
    assert found.solution["start"] == "warm start"
    assert found.solution["iterations"] < walk.solution["iterations"] / 2
    assert hg.verify(found).passed


@pytest.mark.solve
def test_without_multipliers_a_start_is_not_as_warm(walk):
    """What the test above would miss if they did not matter."""
    near = TASK.replace({"walk.speed": TASK.walk.speed * 1.002})
    cold = hg.predict(near, warm_from=dataclasses.replace(walk, multipliers={}))
    warm = hg.predict(near, warm_from=walk)
    assert warm.solution["iterations"] < cold.solution["iterations"]


@pytest.mark.solve
def test_a_report_takes_gaits_and_folders(walk, saved, tmp_path, monkeypatch):
    alone = hg.report(walk, out=str(tmp_path / "alone.html"))
    assert alone.stat().st_size > 100_000
    sparing(monkeypatch)
    page = hg.report([walk, saved], out=tmp_path / "both.html")
    assert page == tmp_path / "both.html"
    assert TASK.name in page.read_text()
    assert hg.report(str(saved)) == saved / "report.html"


def pelvis(motion):
    by_q = np.zeros((len(motion.t), 1, 55))
    by_q[:, 0, 1] = 1.0
    return hg.Rows(motion.q[:, 1:2], by_q=by_q)


@pytest.mark.solve
def test_a_walk_with_a_cost_and_a_constraint_of_ones_own_is_kept(walk, tmp_path):
    """Neither goes into a file: what is saved knows the cost that was found and the rest."""
    own = hg.RunningCost("sway", pelvis, weight=1e5)
    held = hg.PathConstraint("narrow", pelvis, -0.015, 0.015, "m")
    found = hg.predict(TASK, warm_from=walk, costs=[own], constraints=[held])
    assert np.abs(found["pelvis_tx"]).max() < np.abs(walk["pelvis_tx"]).max()
    folder = found.save(tmp_path / "own")
    summary = json.loads((folder / SUMMARY).read_text())
    assert summary["cost"] == found.solution["cost"] > walk.solution["cost"]
    assert summary["success"] is True
    assert found.solution[OWN_COST] > 0.0
    cost = hg.verify(folder)[COST.name]
    assert cost.passed
    assert f"{found.solution[OWN_COST]:.6g} of one's own" in cost.what
    again = hg.load(folder)
    assert again == found
    assert again.multipliers.keys() == found.multipliers.keys() >= {"narrow"}
    assert hg.explain(found).bounds
    assert hg.predict(TASK, warm_from=again).solution["success"]
