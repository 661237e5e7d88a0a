"""The way from scenario to folder, with solves cut short; `test_gait_solve` lets them finish.

Drawing takes longer than all the rest, and no solver has a say in it: one result here has pictures.
"""

import contextlib
import io
import json
import shutil
import signal
from dataclasses import replace
from importlib.metadata import version
from itertools import islice

import numpy as np
import pytest
from walking import guessed_gait
from walks import BACKPACK, scenario

from human_gait import prediction as room
from human_gait.checks.check import Check
from human_gait.exceptions import NoSolutionFound, ResultError, ScenarioError
from human_gait.prediction import (
    predict_by_all_solvers,
    predict_to_folder,
    refine_to_folder,
    verify_folder,
)
from human_gait.problem.refinement import refined_program
from human_gait.problem.violation import Violation
from human_gait.results.names import EXPORTED, MULTIPLIERS, PLOTS
from human_gait.solving import solver as solver_room
from human_gait.solving import starts as ladder_room
from human_gait.solving.diagnosis import Suggestion
from human_gait.solving.drake_solvers import OPTIONS, SOLVERS
from human_gait.solving.starts import OWN_GUESS, WARM
from human_gait.solving.warm_start import adapted, fitting, load_multipliers, save_multipliers
from human_gait.walk.described import no_walk
from human_gait.walk.gait_cycle import load_gait_cycle
from human_gait.walk.gait_file import load_gait, save_gait
from human_gait.walks import predict

RUNGS = ladder_room.own_starts
TASK = scenario(control_points=6, load=BACKPACK)
KEYS = {
    *("success", "solver", "dynamics", "solver_status", "wall_time_s", "iterations", "evaluations"),
    *("n_variables", "n_constraints", "violations", "walking_speed_m_per_s", "step_length_m"),
    *("cost", "body_mass_kg", "load_kg", "versions", "start", "seed", "attempts"),
}
LIMIT = {"newton": "most_iterations", "snopt": "Major iterations limit", "ipopt": "max_iter"}
LIMIT_REACHED = {"newton": "iteration limit reached", "snopt": "32"}
SECOND_START = {"newton": "own guess, by a posture path", "snopt": "own guess, freer"}
FILES = {"explanation.json", "gait.npz", "summary.json", "gait_cycle.csv"}
DYNAMICS = {"newton": "pinocchio", "snopt": "dh"}
DRAWN = "newton"


@pytest.fixture(scope="module")
def cut_short():
    """Stop each stage of every solver after one iteration, and the ladder after two starts."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ladder_room, "own_starts", lambda *given: islice(RUNGS(*given), 2))
        for options in (OPTIONS, solver_room.POSTURE_OPTIONS):
            for name, limit in LIMIT.items():
                patch.setitem(options, name, options[name] | {limit: 1})
        yield


@pytest.fixture(scope="module", params=LIMIT_REACHED)
def solver(request):
    return request.param


@pytest.fixture(scope="module")
def failed(cut_short, solver, tmp_path_factory):  # noqa: ARG001, for its effect
    """A failing prediction: its folder, whether it took itself for a success, what it printed."""
    folder, out = tmp_path_factory.mktemp("out") / "not yet there", io.StringIO()
    with contextlib.redirect_stdout(out):
        done = predict_to_folder(TASK, solver, folder, DYNAMICS[solver], plots=solver == DRAWN)
    return folder, done, out.getvalue()


@pytest.fixture(scope="module")
def summary(failed):
    return json.loads((failed[0] / "summary.json").read_text())


def test_a_solve_that_fails_is_no_success(failed, summary):
    assert failed[1] is False
    assert summary["success"] is False


def test_a_solve_that_fails_keeps_everything_it_has(failed, solver):
    folder, *_ = failed
    written = {path.name for path in folder.iterdir()}
    drawn = {"playback.html", *PLOTS} if solver == DRAWN else set()
    assert written == FILES | drawn
    assert written < set(room.OURS)
    assert MULTIPLIERS not in written  # an iterate has none
    gait = load_gait(folder)
    assert gait.scenario == TASK
    assert gait.solution["solver"] == solver
    assert gait.solution["success"] is False
    assert no_walk(gait).startswith(
        f"This is no walk: {solver} ended with '{LIMIT_REACHED[solver]}"
    )
    assert len(load_gait_cycle(folder / "gait_cycle.csv")["knee_flexion_deg"]) == 101


@pytest.mark.usefixtures("cut_short")
def test_files_of_ones_own_stay_and_what_was_made_from_the_old_result_goes(tmp_path):
    stale = [f"{folder}export/{name}" for folder in ("", "newton/") for name in EXPORTED]
    stale += ["compare.csv", "report.html", "verification.json", "agreement.json"]
    stale += ["newton/summary.json", "snopt/summary.json"]
    own = ["export/my_setup.xml", "newton/notes.txt", "model.osim", "export/mine/motion.bvh"]
    for name in (*stale, *own):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("old" if name in own else "gait_digest=0123456789abcdef")
    for folder in ("", "newton", "snopt"):
        save_gait(guessed_gait(), tmp_path / folder)
    predict_to_folder(TASK, "newton", tmp_path, plots=False)
    assert [name for name in stale if (tmp_path / name).exists()] == []
    assert [name for name in own if not (tmp_path / name).exists()] == []
    assert not (tmp_path / "snopt").exists()


def test_the_summary_tells_what_was_solved_and_how(summary, solver):
    assert set(summary) >= KEYS
    assert summary["n_variables"] == 3 * 55
    assert summary["n_constraints"] == room.build_program(TASK).n_constraint_rows
    assert (summary["body_mass_kg"], summary["load_kg"]) == (78.4, 18.0)
    assert (summary["walking_speed_m_per_s"], summary["step_length_m"]) == (1.2, 0.66)
    assert summary["solver"] == solver
    assert summary["dynamics"] == DYNAMICS[solver]
    assert summary["solver_status"].startswith(LIMIT_REACHED[solver])
    assert 0 < summary["iterations"] <= summary["evaluations"] + 1
    assert summary["wall_time_s"] > 0.0
    for package in ("drake", "daqp"):
        assert summary["versions"][package] == version(package)
    starts = [attempt["start"] for attempt in summary["attempts"]]
    assert starts == [OWN_GUESS, SECOND_START[solver]]
    assert summary["start"] in starts
    assert summary["wall_time_s"] == sum(attempt["wall_time_s"] for attempt in summary["attempts"])


def test_the_summary_has_the_worst_violation_of_every_constraint(summary):
    names = {constraint.name for constraint in room.build_program(TASK).constraints}
    assert set(summary["violations"]) == names
    worst = summary["violations"]["contact position"]
    assert worst["value"] > TASK.tolerances.contact
    assert worst["unit"] == "m"
    assert worst["what"].startswith(("left ", "right "))
    assert 0.0 <= worst["time_s"] <= TASK.walk.step_time


def test_a_failure_leaves_its_diagnosis_and_no_explanation_of_a_walk(failed, summary):
    diagnosis = summary["diagnosis"]
    assert any("contact position" in line and " mm" in line for line in diagnosis["not_kept"])
    keys = [one["key"] for one in diagnosis["try"]]
    assert "discretisation.control_points" in keys  # 6 are less than usual
    assert keys[-1] == "--solver"  # there were no iterations left
    explanation = json.loads((failed[0] / "explanation.json").read_text())
    assert explanation["shapes"] == []
    assert explanation["cost"] == summary["cost"]


def test_a_failure_is_explained_and_lines_tell_the_progress(failed, solver):
    printed = " ".join(failed[2].split())  # however the lines are folded
    for part in (
        f"{3 * 55} variables",
        f"dynamics by {DYNAMICS[solver]}",
        "posture 1",
        f"next start: {SECOND_START[solver]}",
        "cost",
        "worst:",
        "FAIL",
        "found no walk",
        "not kept:",
        "contact position (Eq. 20, 21)",
        "at t = 0.",
    ):
        assert part in printed


@pytest.mark.usefixtures("cut_short")
def test_from_python_a_failure_is_an_exception_that_carries_the_gait():
    with pytest.raises(NoSolutionFound, match="snopt stopped: 32"):
        predict(TASK, "snopt")
    with pytest.raises(NoSolutionFound, match="newton stopped: iteration limit") as caught:
        predict(TASK)
    with pytest.raises(ValueError, match="newton"):
        predict(TASK, dynamics="newton")
    assert caught.value.gait.scenario == TASK
    assert caught.value.gait.solution["success"] is False
    assert "no walk" in repr(caught.value.gait)
    assert np.all(np.isfinite(caught.value.gait.control_points))
    report = caught.value.report
    broken = {one.name for one in report if isinstance(one, Violation)}
    assert broken >= {"contact position", "ZMP stability"}
    assert any(isinstance(one, Check) for one in report)
    assert [one.key for one in report if isinstance(one, Suggestion)][-1] == "--solver"


@pytest.mark.usefixtures("cut_short")
def test_a_refined_result_starts_at_the_same_motion(tmp_path):
    gait, starts = guessed_gait(), []
    with pytest.MonkeyPatch.context() as patch:

        def record(program, solver, start, tell, **given):
            starts.append(program.gait(start))
            return solver_room.solve(program, solver, start, tell, **given)

        patch.setattr(ladder_room, "solve", record)
        refine_to_folder(gait, 11, "snopt", tmp_path, plots=False)
    t = np.linspace(0.0, gait.step_time, 30)
    np.testing.assert_allclose(starts[0].q(t), gait.q(t), atol=1e-12)
    assert load_gait(tmp_path).basis.n_control_points == 11


def test_a_result_cannot_be_refined_to_fewer_control_points():
    with pytest.raises(ScenarioError, match=r"control_points.* more than the 9 there are"):
        refine_to_folder(guessed_gait(), 9, "snopt", None)


def test_refining_keeps_two_intervals_to_a_piece_and_the_old_instants():
    program, _ = refined_program(guessed_gait(), 20)
    grid = program.scenario.discretisation
    assert grid.intervals == 40
    assert program.basis.n_control_points == 20


@pytest.mark.usefixtures("cut_short")
def test_all_solvers_start_alike_and_are_compared(tmp_path, capsys, monkeypatch):
    """Cut very short: what counts is what they are given and what is written."""
    starts = []

    def record(program, solver, start, tell, **given):
        starts.append((solver, start))
        return solver_room.solve(program, solver, start, tell, **given)

    monkeypatch.setattr(ladder_room, "solve", record)
    assert predict_by_all_solvers(TASK, tmp_path, plots=False) is False
    assert [name for name, _ in starts] == list(SOLVERS)
    for _, start in starts[1:]:
        np.testing.assert_array_equal(start, starts[0][1])
    for name in SOLVERS:
        assert json.loads((tmp_path / name / "summary.json").read_text())["solver"] == name
    found = json.loads((tmp_path / "agreement.json").read_text())
    assert set(found["results"]) == set(SOLVERS)
    printed = capsys.readouterr().out
    assert "snopt - newton" in printed
    assert "ipopt - newton" in printed


@pytest.fixture(scope="module")
def other_walk(tmp_path_factory):
    """A result with multipliers of a slightly slower walk, made up."""
    folder, task = tmp_path_factory.mktemp("walk"), scenario(1.15, control_points=6)
    program = room.build_program(task)
    gait = program.gait(program.guess())
    save_gait(gait, folder)
    rows = {c.name: len(c.lower) for c in program.constraints} | {"joint limit": 3 * 55}
    multipliers = {name: np.linspace(-1.0, 1.0, n) for name, n in rows.items()}
    save_multipliers(replace(gait, multipliers=multipliers), folder)
    return folder


@pytest.fixture
def asked(monkeypatch):
    """What the ladder asks of the solver: start and the rest, by attempt."""
    found = []

    def record(program, solver, start=None, tell=None, **given):
        found.append((start, given))
        return solver_room.solve(program, solver, start, tell, **given)

    monkeypatch.setattr(ladder_room, "solve", record)
    return found


@pytest.mark.usefixtures("cut_short")
def test_a_warm_start_comes_first_then_the_own_ones(tmp_path, capsys, other_walk, asked):
    warm = {"warm_from": other_walk, "plots": False}
    assert predict_to_folder(TASK, "newton", tmp_path, **warm) is False
    summary = json.loads((tmp_path / "summary.json").read_text())
    starts = [attempt["start"] for attempt in summary["attempts"]]
    assert starts == [WARM, OWN_GUESS, SECOND_START["newton"]]
    program = room.build_program(TASK)
    (start, given), *others = asked
    np.testing.assert_array_equal(start, adapted(load_gait(other_walk), program))
    expected = fitting(load_multipliers(load_gait(other_walk), other_walk), program)
    assert set(given["multipliers"]) == set(expected)
    for name, price in expected.items():
        np.testing.assert_array_equal(given["multipliers"][name], price)
    assert all(start is None and "multipliers" not in given for start, given in others)
    assert "no walk yet; next start: warm start" not in capsys.readouterr().out


@pytest.mark.usefixtures("cut_short")
def test_a_result_without_multipliers_is_a_start_too(tmp_path, other_walk, asked):
    folder = tmp_path / "walk"
    folder.mkdir()
    save_gait(load_gait(other_walk), folder)
    predict_to_folder(TASK, "newton", tmp_path / "out", warm_from=folder, plots=False)
    start, given = asked[0]
    assert np.all(np.isfinite(start))
    assert not any(np.any(price) for price in given["multipliers"].values())


@pytest.mark.usefixtures("cut_short")
def test_a_result_may_be_its_own_start_and_loses_its_old_multipliers(tmp_path, other_walk):
    """The new one has none, as it failed: those of the old one would not belong to it."""
    shutil.copytree(other_walk, tmp_path, dirs_exist_ok=True)
    predict_to_folder(TASK, "newton", tmp_path, warm_from=tmp_path, plots=False)
    assert load_multipliers(load_gait(other_walk), other_walk)
    assert load_multipliers(load_gait(tmp_path), tmp_path) == {}


def test_what_cannot_be_started_from_is_refused_before_solving(tmp_path, asked):
    for folder in (tmp_path, tmp_path / "nowhere"):
        with pytest.raises(ResultError, match=r"gait.npz"):
            predict_to_folder(TASK, "newton", tmp_path / "out", warm_from=folder)
    assert asked == []
    assert not (tmp_path / "out").exists()


def test_a_result_is_checked_anew_from_its_file(tmp_path, capsys):
    """A guess is no walk; the file says so and why."""
    save_gait(guessed_gait(), tmp_path)
    assert verify_folder(tmp_path) is False
    found = json.loads((tmp_path / "verification.json").read_text())
    assert found["unbalanced force or moment"]["passed"] is True
    assert found["standing points off their footholds"]["passed"] is False
    assert "FAIL" in capsys.readouterr().out


def test_a_verdict_that_cannot_be_written_is_a_verdict(tmp_path, capsys, monkeypatch):
    save_gait(guessed_gait(), tmp_path)
    check = Check(name="step length", value=0.0, limit=1.0, unit="m", time=0.0)
    (tmp_path / "verification.json").mkdir()
    for limit, walks in ((1.0, True), (-1.0, False)):
        monkeypatch.setattr(room, "verify", lambda _, limit=limit: [replace(check, limit=limit)])
        assert verify_folder(tmp_path) is walks
        captured = capsys.readouterr()
        assert "step length" in captured.out
        assert captured.err.count("\n") == 1
        assert f"warning: {tmp_path / 'verification.json'}: is in the way: " in captured.err


@pytest.mark.usefixtures("cut_short")
def test_an_interruption_ends_the_comparison_of_solvers(tmp_path, monkeypatch):
    def press(program, solver, start, **_):
        def tell(_):
            signal.raise_signal(signal.SIGINT)

        return solver_room.solve(program, solver, start, tell)

    monkeypatch.setattr(ladder_room, "solve", press)
    assert predict_by_all_solvers(TASK, tmp_path, plots=False) is False
    assert [path.name for path in tmp_path.iterdir()] == ["newton"]


def test_the_folder_is_made_only_when_there_is_something_to_keep(tmp_path, monkeypatch):
    def fail(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(ladder_room, "solve", fail)
    with pytest.raises(KeyboardInterrupt):
        predict_to_folder(TASK, "snopt", tmp_path / "out")
    assert not (tmp_path / "out").exists()
