"""Studies: what a file may say, which walks it makes, which starts from which, what is kept."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from walking import guessed_gait
from walks import scenario

import human_gait as hg
from human_gait.exceptions import GaitError, ResultError, ScenarioError
from human_gait.problem.program import build_program
from human_gait.scenario.nearness import NEAR, Place
from human_gait.studies import calls, engine, work
from human_gait.studies.design import n_points, points
from human_gait.studies.engine import Order
from human_gait.studies.index import columns, write_index
from human_gait.studies.limits import parse_limits
from human_gait.studies.numbers import (
    CURVES,
    curves_of,
    number_columns,
    numbers_of,
    settings_of,
)
from human_gait.studies.opened import open_study
from human_gait.studies.plan import MOST_TOGETHER, n_walks, plan_of
from human_gait.studies.store import Kept, Store, check_store
from human_gait.studies.study_file import Design, StudyFile
from human_gait.studies.varied import Values
from human_gait.studies.work import Terms, Told
from human_gait.walk.gait_cycle import gait_cycle

BASE = scenario().to_dict()


def study(**more):
    return StudyFile.from_table({"name": "test", "scenario": BASE, **more})


def grid():
    return study(vary={"walk": {"speed": [1.1, 1.2, 1.3]}, "load.mass": [0, "20 lb"]})


# --- the file


def test_a_file_reads_back_as_it_was(tmp_path):
    asked = study(
        pace="similar",
        tries=3,
        vary={"walk.speed": {"from": 1.0, "to": 1.4, "step": 0.1}, "load.position": [[0, 0, -0.2]]},
        design={"kind": "grid", "seed": 4},
        population={"sex": "female", "count": 3},
        outputs={"show": ["cost"], "limits": ["cost < 1"]},
    )
    (tmp_path / "again.toml").write_text(asked.to_toml())
    assert StudyFile.read(tmp_path / "again.toml") == asked


def test_a_scenario_is_looked_for_beside_the_study(tmp_path):
    (tmp_path / "mine.toml").write_text(scenario(1.3).to_toml())
    (tmp_path / "s.toml").write_text('scenario = "mine.toml"\n')
    assert StudyFile.read(tmp_path / "s.toml").scenario.walk.speed == 1.3
    assert StudyFile.read(tmp_path / "s.toml").name == "s"


WRONG = {
    "scenario": ({"scenario": 3}, "scenario = 3", "must be a file, a name or a table"),
    "no such key": ({"varry": {}}, "varry", "did you mean vary"),
    "no such setting": ({"vary": {"walk.sped": [1]}}, "vary.walk.sped", "did you mean"),
    "a section": ({"vary": {"walk": [1]}}, "vary.walk", "no single setting"),
    "out of range": ({"vary": {"speed": [1.0, 99.0]}}, "vary.walk.speed = 99.0", "from 0.1 to 3"),
    "of words": ({"vary": {"sex": {"from": 1, "to": 2}}}, "vary.subject.sex", "has no range"),
    "no end": ({"vary": {"speed": {"from": 1}}}, "vary.walk.speed", "has no to"),
    "down": ({"vary": {"speed": {"from": 2, "to": 1}}}, "vary.walk.speed = 1.0", "must go up"),
    "step": ({"vary": {"speed": {"from": 1, "to": 2, "step": 0}}}, "speed.step = 0", "above 0"),
    "too wide": (
        {"vary": {"speed": {"from": 1, "to": 2, "step": 5}}},
        "walk.speed.step",
        "does not lead",
    ),
    "twice": ({"vary": {"speed": [1], "walk.speed": [1]}}, "vary.walk.speed", "given twice"),
    "a part": ({"vary": {"load.position.z": [0]}}, "load.position.z", "lists for load.position"),
    "empty": ({"vary": {"speed": []}}, "vary.walk.speed", "must have 1 to"),
    "value twice": ({"vary": {"speed": [1.2, 1.2]}}, "vary.walk.speed = 1.2", "given twice"),
    "kind": ({"design": {"kind": "all"}}, 'design.kind = "all"', "grid, paired, sobol"),
    "no count": ({"design": {"kind": "sobol"}}, "design.count", "is missing"),
    "count": ({"design": {"count": 3}}, "design.count", "is of no use with grid"),
    "unequal": (
        {"vary": {"speed": [1], "load.mass": [0, 1]}, "design": {"kind": "paired"}},
        "vary",
        "as many values each",
    ),
    "people": ({"population": {"count": 0}}, "population.count = 0", "from 1 to"),
    "strength": ({"population": {"strength": 1}}, "population.strength", "true or false"),
    "outputs": ({"outputs": {"show": "cost"}}, "outputs.show", "list of texts"),
    "name": ({"name": "a/b"}, "name", "must be a name"),
    "tries": ({"tries": 1.5}, "tries = 1.5", "whole number"),
    "time": ({"time_limit": 0}, "time_limit = 0", "from 1 to"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_in_a_file_is_told_with_key_value_and_what_is_allowed(case):
    table, *told = WRONG[case]
    with pytest.raises(ScenarioError) as raised:
        study(**table)
    assert all(words in str(raised.value) for words in told), raised.value
    assert len(str(raised.value).splitlines()) == 1


def test_every_value_that_is_not_allowed_is_told():
    with pytest.raises(ScenarioError) as raised:
        study(vary={"load.mass": [0, "x", 400]})
    assert [error.value for error in raised.value.errors] == ["x", 400]


OUTPUTS = {
    "show": (["strenght_share"], "did you mean strength_share"),
    "limits": (["strenght_share < 0.8"], "did you mean strength_share"),
}


@pytest.mark.parametrize("key", OUTPUTS)
def test_outputs_that_no_index_has_are_refused_before_anything_is_done(key, tmp_path):
    given, hint = OUTPUTS[key]
    with pytest.raises(ScenarioError, match=hint) as raised:
        calls.begin(study(outputs={key: given}), tmp_path)
    assert raised.value.key == f"outputs.{key}"
    assert not list(tmp_path.iterdir())


def test_what_people_are_drawn_with_is_not_varied():
    with pytest.raises(ScenarioError, match=r"vary\.subject\.stature: people are drawn with it"):
        plan_of(study(vary={"stature": [1.7]}, population={"count": 2}))
    plan_of(study(vary={"strength": [50, 60]}, population={"count": 2}))


def test_all_that_is_wrong_is_told_with_the_file(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text('pace = "quick"\n[vary]\nspeed = [9]\n[design]\nkind = "x"\n')
    with pytest.raises(ScenarioError) as raised:
        StudyFile.read(path)
    lines = str(raised.value).splitlines()
    assert len(lines) == 4
    assert all(line.startswith(f"{path}: ") for line in lines)


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(ScenarioError, match=r"none\.toml: cannot be read: No such file"):
        StudyFile.read(tmp_path / "none.toml")


# --- the points


def test_a_grid_has_every_value_with_every_other():
    asked = grid()
    found = list(points(asked.vary, asked.design))
    assert len(found) == n_points(asked.vary, asked.design) == 6
    assert len({tuple(point.items()) for point in found}) == 6
    assert found[0] == {"walk.speed": 1.1, "load.mass": 0.0}
    assert found[1]["load.mass"] == pytest.approx(20 * 0.45359237)


def test_paired_settings_go_together():
    vary = {"a": Values((1, 2)), "b": Values(("x", "y"))}
    assert list(points(vary, Design("paired"))) == [{"a": 1, "b": "x"}, {"a": 2, "b": "y"}]


@pytest.mark.parametrize("kind", ["sobol", "latin-hypercube"])
def test_drawn_points_fill_the_ranges_and_are_the_same_for_a_seed(kind):
    vary = {"a": Values((1.0, 3.0), between=True), "b": Values((1, 9), between=True)}
    vary["c"] = Values(("x", "y"))
    drawn = list(points(vary, Design(kind, 100, 7)))
    assert drawn == list(points(vary, Design(kind, 100, 7)))
    assert drawn != list(points(vary, Design(kind, 100, 8)))
    a, b = (np.array([point[name] for point in drawn]) for name in "ab")
    assert np.histogram(a, 4, (1.0, 3.0))[0] == pytest.approx([25] * 4, abs=4)
    assert set(b) <= set(range(1, 10))
    assert 40 <= sum(point["c"] == "x" for point in drawn) <= 60


# --- the walks


def test_a_plan_is_the_same_every_time_and_each_key_is_one_scenario():
    one, other = plan_of(grid()), plan_of(grid())
    assert one.jobs == other.jobs
    assert len({job.key for job in one.jobs}) == n_walks(grid()) == 6
    renamed = plan_of(StudyFile.from_table({**grid().to_table(), "name": "another"}))
    assert [job.key for job in renamed.jobs] == [job.key for job in one.jobs]


def test_a_key_is_of_the_version_too(monkeypatch):
    before = plan_of(grid()).jobs[0].key
    monkeypatch.setattr("human_gait.studies.plan.package_version", lambda: "99")
    assert plan_of(grid()).jobs[0].key != before


def test_walks_start_from_one_that_is_near_and_starts_from_nothing():
    asked = study(vary={"speed": {"from": 0.8, "to": 1.6, "count": 60}})
    jobs = {job.key: job for job in plan_of(asked).jobs}
    followers = [job for job in jobs.values() if job.start]
    assert followers
    for job in followers:
        head = jobs[job.start]
        assert not head.start
        assert Place.of(head.scenario).distance(Place.of(job.scenario)) <= NEAR
    counts = [sum(job.start == key for job in followers) for key in jobs]
    assert max(counts) < MOST_TOGETHER


def test_other_kinds_of_walks_are_no_start():
    asked = study(vary={"subject.sex": ["male", "female"], "speed": [1.2, 1.21]}, pace="similar")
    jobs = {job.key: job for job in plan_of(asked).jobs}
    for job in jobs.values():
        if job.start:
            assert jobs[job.start].scenario.subject.sex == job.scenario.subject.sex


def test_parts_are_all_walks_once_and_nobody_waits_for_another_part():
    whole = plan_of(study(vary={"speed": {"from": 0.6, "to": 2.0, "count": 50}}))
    parts = [whole.part(number, 4) for number in range(1, 5)]
    keys = [job.key for part in parts for job in part.jobs]
    assert sorted(keys) == sorted(job.key for job in whole.jobs)
    for part in parts:
        mine = {job.key for job in part.jobs}
        assert all(job.start in mine for job in part.jobs if job.start)


def test_a_scenario_that_is_not_allowed_is_a_walk_that_says_why():
    jobs = plan_of(study(vary={"step_length": [0.6, 1.9]})).jobs
    assert [job.scenario is None for job in jobs] == [False, True]
    assert "reach of legs" in jobs[1].refused
    with pytest.raises(ScenarioError, match="no walk of the study is allowed"):
        plan_of(study(vary={"step_length": [1.9]}))


def test_similar_people_walk_at_one_froude_number():
    people = {"sex": "both", "count": 4}
    base = scenario()
    own = base.walk.speed**2 / base.subject.leg_length
    for job in plan_of(study(pace="similar", population=people)).jobs:
        leg, walk = job.scenario.subject.leg_length, job.scenario.walk
        assert walk.speed**2 / leg == pytest.approx(own, rel=1e-3)
        assert walk.step_length / leg == pytest.approx(
            base.walk.step_length / base.subject.leg_length, rel=1e-3
        )


def test_everyone_of_a_population_walks_at_every_point():
    asked = study(population={"sex": "male", "count": 3}, vary={"load.mass": [0, 5]})
    jobs = plan_of(asked).jobs
    assert [(job.person, job.scenario.load.mass) for job in jobs] == [
        (person, load) for person in range(3) for load in (0.0, 5.0)
    ]
    assert [job.scenario.subject for job in jobs[::2]] == [*hg.Population("male", 3, 0)]


def test_another_sex_or_percentile_is_another_person():
    jobs = plan_of(study(vary={"sex": ["female"], "percentile": [5, 95]}, pace="similar")).jobs
    small, tall = (job.scenario.subject for job in jobs)
    assert small.sex == tall.sex == "female"
    assert small.stature < hg.Subject.default("female").stature < tall.stature
    assert small.thigh < tall.thigh


# --- the order


def jobs_of(asked):
    return plan_of(asked).jobs


def test_a_walk_comes_after_the_one_it_starts_from():
    jobs = jobs_of(study(vary={"speed": {"from": 1.0, "to": 1.5, "count": 9}}))
    order, done = Order(jobs, ()), []
    while len(done) < len(jobs):
        at_once = []
        while (job := order.next()) is not None:
            assert not job.start or job.start in done
            at_once.append(job)
        assert at_once
        for job in at_once:
            done.append(job.key)
            order.done(job.key)
    assert sorted(done) == sorted(job.key for job in jobs)


def test_what_starts_from_a_walk_that_is_there_need_not_wait():
    jobs = jobs_of(study(vary={"speed": [1.0, 1.02, 1.04]}))
    order = Order(jobs[1:], {jobs[0].key})
    assert [order.next().key for _ in range(2)] == [job.key for job in jobs[1:]]


# --- the store


def kept(key="0" * 32, success=True):
    gait = guessed_gait()
    row = {"success": success, "reason": "" if success else "why", "tries": 2, "seconds": 1.0}
    row |= {"key": key, "start": "cold", **settings_of(gait.scenario), "cost": 2.5}
    return Kept(row, curves_of(gait) if success else None, gait)


def test_what_is_kept_of_a_walk_comes_back(tmp_path):
    store, one = Store(tmp_path), kept()
    one = replace(one, gait=one.gait.retold(one.gait.solution, {"a / b": np.arange(3.0)}))
    store.save("0" * 32, one)
    row, curves = store.curves("0" * 32)
    assert row == one.row
    np.testing.assert_array_equal(curves, one.curves)
    gait = store.gait("0" * 32)
    assert gait == one.gait
    np.testing.assert_array_equal(gait.multipliers["a / b"], np.arange(3.0))
    assert store.keys() == {"0" * 32}


def test_a_walk_that_was_not_written_whole_is_not_there(tmp_path, monkeypatch):
    store = Store(tmp_path)

    def full(file, **_):
        file.write(b"PK\3\4 half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", full)
    with pytest.raises(ResultError, match="No space left"):
        store.save("1" * 32, kept())
    assert store.keys() == set()
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_what_killed_processes_left_is_swept(tmp_path):
    check_store(tmp_path)
    folder = tmp_path / "walks" / "00"
    folder.mkdir()
    left = Store(tmp_path).path("0" * 32)
    from human_gait.results.unfinished import MARK

    unfinished = folder / f".{left.name[:30]}{MARK}999999999-abc.npz"
    unfinished.write_bytes(b"half")
    check_store(tmp_path)
    assert not unfinished.exists()


def test_a_damaged_walk_is_done_again(tmp_path):
    jobs = jobs_of(grid())
    store = Store(tmp_path)
    for job in jobs:
        store.save(job.key, kept(job.key))
    store.path(jobs[2].key).write_bytes(b"PK\3\4 half")
    begun = calls.begin(grid(), tmp_path)
    assert [job.key for job in begun.left] == [jobs[2].key]


@pytest.mark.parametrize(
    ("row", "changes", "again"),
    [
        ({}, {}, False),
        ({}, {"time_limit": 600.0}, False),
        ({"out_of_time": True}, {}, False),
        ({"out_of_time": True}, {"time_limit": 600.0}, True),
        ({"again": True}, {}, True),
    ],
)
def test_what_was_no_fault_of_a_walk_is_tried_again(row, changes, again, tmp_path):
    asked = grid()
    for job in jobs_of(asked):
        one = kept(job.key, success=False)
        Store(tmp_path).save(job.key, Kept({**one.row, "time_limit": 300.0, **row}))
    more = StudyFile.from_table({**asked.to_table(), **changes})
    assert len(calls.begin(more, tmp_path).left) == (6 if again else 0)


def test_another_study_is_not_put_into_the_folder_of_one(tmp_path):
    calls.begin(grid(), tmp_path)
    other = StudyFile.from_table({**grid().to_table(), "name": "other"})
    with pytest.raises(ResultError, match=r"holds the study test, this one is other: .*--out"):
        calls.begin(other, tmp_path)


def test_a_walk_is_found_from_nothing_where_the_one_it_starts_from_was_lost(tmp_path):
    job = next(job for job in jobs_of(grid()) if job.start)
    engine.lost(replace(job, key=job.start), terms(tmp_path), "died")
    program = build_program(job.scenario)
    assert work._start(job, Store(tmp_path), program) == (None, program)


def test_a_walk_that_was_not_found_is_tried_again_only_if_more_is_to_be_tried(tmp_path):
    asked = grid()
    for job in jobs_of(asked):
        Store(tmp_path).save(job.key, kept(job.key, success=False))
    assert not calls.begin(asked, tmp_path).left
    more = StudyFile.from_table({**asked.to_table(), "tries": 3})
    assert len(calls.begin(more, tmp_path).left) == 6


# --- one walk


def terms(folder):
    return Terms(str(folder), work.package_version(), 1, 60.0)


def test_what_is_not_allowed_is_a_row_with_its_reason(tmp_path):
    job = jobs_of(study(vary={"step_length": [0.6, 1.9]}))[1]
    told = work.find(job, terms(tmp_path))
    assert not told.success
    assert told.reason == "not allowed: walk.step_length"
    assert "reach of legs" in Store(tmp_path).row(job.key)["diagnosis"]
    with pytest.raises(ResultError, match="nothing was solved"):
        Store(tmp_path).gait(job.key)


def test_what_nobody_foresaw_is_a_row_too(tmp_path, monkeypatch):
    def broken(*_):
        raise np.linalg.LinAlgError("singular")

    monkeypatch.setattr(work, "build_program", broken)
    told = work.find(jobs_of(grid())[0], terms(tmp_path))
    assert told.reason == "not foreseen: LinAlgError: singular"


def test_another_version_of_the_package_is_refused(tmp_path):
    with pytest.raises(ResultError, match=r"the study 0\.0: install it"):
        work.find(jobs_of(grid())[0], Terms(str(tmp_path), "0.0", 1, 60.0))


# --- the index


@pytest.fixture(scope="module")
def indexed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    asked = grid()
    plan, store = plan_of(asked), Store(folder)
    for k, job in enumerate(plan.jobs):
        store.save(job.key, kept(job.key, success=k != 4))
    assert write_index(plan, store, store.keys()) == 6
    return plan, open_study(folder)


def test_a_damaged_walk_is_left_out_of_the_index(tmp_path):
    plan, store = plan_of(grid()), Store(tmp_path)
    for job in plan.jobs:
        store.save(job.key, kept(job.key))
    store.path(plan.jobs[2].key).write_bytes(b"PK half")
    assert write_index(plan, store, store.keys()) == 5


def test_the_index_has_a_row_a_walk_in_the_order_of_the_plan(indexed):
    plan, found = indexed
    frame = found.to_dataframe()
    assert list(frame.index) == [job.key for job in plan.jobs]
    assert list(frame.success) == [True] * 4 + [False, True]
    assert (
        list(frame.walk_speed) == [guessed_gait().scenario.walk.speed] * 6
    )  # of the row, not of the plan
    assert found.varied == ("walk_speed", "load_mass")
    assert len(found.columns) == len(columns()) > 150


def test_three_numbers_that_are_varied_are_columns_of_their_own(tmp_path):
    asked = study(vary={"load.position": [[0, 0.05, -0.2], [0, 0.05, -0.3]], "load.mass": [9]})
    plan, store = plan_of(asked), Store(tmp_path)
    for job in plan.jobs:
        work.find(replace(job, scenario=None), terms(tmp_path))
    write_index(plan, store, store.keys())
    frame = open_study(tmp_path).to_dataframe()
    assert open_study(tmp_path).varied == ("load_position_z", "load_mass")
    assert list(frame.load_position_z) == [-0.2, -0.3]


def test_a_limit_counts_what_goes_beyond_and_not_what_is_missing():
    (limit,) = parse_limits(["cost <= 2"], ["cost"])
    values = np.array([1.0, 2.0, 3.0, np.nan])
    assert list(limit.exceeded(values)) == [False, False, True, False]
    (limit,) = parse_limits(["cost > 2"], ["cost"])
    assert list(limit.exceeded(values)) == [True, True, False, False]


def test_the_numbers_of_a_walk_are_those_of_its_curves():
    gait = guessed_gait()
    gait = gait.retold({"cost": 1.0}, {})
    numbers, cycle = numbers_of(gait, []), gait_cycle(gait)
    assert set(numbers) == {column.name for column in number_columns()}
    assert numbers["knee_flexion_max"] == cycle["knee_flexion_deg"].max()
    assert numbers["knee_extension_peak"] == cycle["knee_extension_Nm_per_kg"].max()
    assert numbers["cost_of_transport"] == hg.energy(gait).cost_of_transport
    assert numbers["froude"] == hg.dimensionless(gait).froude
    knee = gait.joint_names.index("knee_flexion_r")
    stride = gait.instants(np.linspace(0.0, 2.0 * gait.step_time, 2001))
    assert numbers["knee_flexion_torque"] == pytest.approx(abs(stride.tau[:, knee]).max(), rel=0.03)
    assert numbers["knee_flexion_speed"] == pytest.approx(abs(stride.v[:, knee]).max(), rel=0.03)
    assert math.isnan(numbers["friction_against_sliding"])


def test_numbers_that_are_missing_are_nan_and_words_are_none(indexed):
    frame = indexed[1].to_dataframe()
    assert math.isnan(frame["effort"].iloc[0])
    assert frame["subject_sex"].iloc[0] == "male"


def test_every_column_of_numbers_says_its_unit_and_all_say_what_they_are(indexed):
    units, meanings = indexed[1].units, indexed[1].meanings
    assert units["walk_speed"] == "m/s"
    assert units["knee_extension_peak"] == "N m/kg"
    assert all(meanings.values())
    assert indexed[1].to_dataframe().attrs["units"] == units


def test_others_read_the_index_and_the_curves(indexed):
    import duckdb

    plan, found = indexed
    path = found.folder / "index.parquet"
    (count,) = duckdb.sql(f"select count(*) from '{path}' where success and cost > 2").fetchall()[0]
    assert count == 5
    import pandas as pd

    curves = pd.read_parquet(found.folder / "cycles.parquet")
    assert list(curves["key"]) == [job.key for job in plan.jobs]


def test_curves_come_by_key_and_are_nan_where_there_is_no_walk(indexed):
    plan, found = indexed
    keys = [plan.jobs[5].key, plan.jobs[4].key]
    curves = found.cycles(keys, ["knee_flexion_deg"])["knee_flexion_deg"]
    own = curves_of(guessed_gait())[CURVES.index("knee_flexion_deg")]
    np.testing.assert_array_equal(curves[0], own)
    assert np.isnan(curves[1]).all()
    with pytest.raises(ResultError, match="no curve elbow"):
        found.cycles(columns=["elbow"])
    with pytest.raises(ResultError, match="no walk nobody"):
        found.cycles(["nobody"])


def test_a_folder_without_a_study_is_refused(tmp_path):
    with pytest.raises(ResultError, match=r"no study here \(no index.parquet\)"):
        hg.open_study(tmp_path)
    (tmp_path / "index.parquet").write_bytes(b"PAR1 no")
    with pytest.raises(ResultError, match=r"index.parquet: cannot be read"):
        hg.open_study(tmp_path)


def test_an_index_of_something_else_is_refused(tmp_path):
    import pandas as pd

    pd.DataFrame({"a": [1]}).to_parquet(tmp_path / "index.parquet")
    with pytest.raises(ResultError, match="does not say what it is of"):
        hg.open_study(tmp_path)


# --- who finds them


def test_without_dask_the_message_says_what_to_install(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(GaitError, match=r"human-gait\[study\]"), engine.workers_here(1):
        pass


def test_a_scheduler_that_is_not_there_is_named(monkeypatch):
    monkeypatch.setattr(engine, "_WAIT", 1)
    with (
        pytest.raises(GaitError, match="no Dask scheduler answers"),
        engine.workers_of("tcp://127.0.0.1:9"),
    ):
        pass


@pytest.mark.parametrize("given", [{"workers": -1}, {"workers": 2, "scheduler": "tcp://x"}])
def test_workers_that_cannot_be_are_refused(given):
    with pytest.raises(GaitError), calls.workers_for(given["workers"], given.get("scheduler")):
        pass


def test_a_walk_that_kills_its_workers_is_not_found(tmp_path):
    from distributed.scheduler import KilledWorker

    class Future:
        def result(self):
            raise KilledWorker("walk", None, 3)

    job = jobs_of(grid())[0]
    told = engine._outcome(Future(), job, terms(tmp_path))
    assert not told.success
    assert Store(tmp_path).row(job.key)["reason"] == told.reason
    assert "died" in told.reason


def test_the_amount_is_told_before_anything_is_done(tmp_path):
    asked = grid()
    amount = calls.begin(asked, tmp_path).amount
    assert (amount.walks, amount.left) == (6, 6)
    assert 0 < amount.cold < 6
    assert amount.seconds > 0.0
    assert amount.bytes > 0
    jobs = jobs_of(asked)
    Store(tmp_path).save(jobs[0].key, kept(jobs[0].key))
    assert calls.begin(asked, tmp_path).amount.left == 5


def test_neighbours_go_up_by_less_than_what_is_near():
    """The same density of walks in a larger range makes more heads, not longer ways."""
    for count, end in ((20, 1.2), (40, 1.6)):
        asked = study(vary={"speed": {"from": 0.8, "to": end, "count": count}})
        speeds = [job.scenario.walk.speed for job in jobs_of(asked) if not job.start]
        assert all(b - a <= 2.2 * NEAR * (3.0 - 0.1) for a, b in pairwise(sorted(speeds)))


def test_told_is_plain():
    assert Told("k", True, "", 1.0)._asdict().keys() == {"key", "success", "reason", "seconds"}
