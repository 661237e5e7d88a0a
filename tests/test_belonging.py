"""Files of a result folder that are of another walk, or were changed, are named and refused."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from walking import guessed_gait

import human_gait as hg
from human_gait import cli
from human_gait.canvas import Picture
from human_gait.exceptions import ResultError
from human_gait.export.formats import export
from human_gait.people import comparison
from human_gait.people.comparison import compare_folder, compare_to_folder
from human_gait.problem.program import build_program
from human_gait.reporting.results import read_results
from human_gait.results.names import (
    COMPARISON,
    EXPLANATION,
    EXPORT,
    GAIT_CYCLE,
    GAIT_FILE,
    MULTIPLIERS,
    OPENSIM_COORDINATES,
    PLOTS,
    SUMMARY,
    VERIFICATION,
)
from human_gait.results.reading import read_json
from human_gait.solving.warm_start import fitting
from human_gait.walk.belonging import own_gait, strangers
from human_gait.walk.described import gait_digest
from human_gait.walk.gait_cycle import COLUMNS, FURTHER, gait_cycle
from human_gait.walk.gait_file import load_gait, save_gait

READERS = {
    "report": lambda folder: read_results([folder]),
    "compare": compare_folder,
    "explain": hg.explain,
    "figures": own_gait,
}
MADE = {
    f"{EXPORT}/{OPENSIM_COORDINATES}",
    SUMMARY,
    EXPLANATION,
    GAIT_CYCLE,
    VERIFICATION,
    MULTIPLIERS,
    *PLOTS,
    *COMPARISON,
}
NO_DIGEST = {GAIT_CYCLE, "compare.csv"}


def make(folder, load):
    """A whole result without a solve, each file as its command writes it, the pictures empty."""
    gait = guessed_gait(load)
    multipliers = fitting({}, build_program(gait.scenario, gait.basis))
    replace(gait, multipliers=multipliers).save(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(comparison, "compare_figure", lambda *_: Picture(1.0, 1.0))
        compare_to_folder(folder)
    for name in PLOTS:
        (folder / name).write_bytes(Picture(1.0, 1.0).png({"gait": gait_digest(gait)}))
    export(gait, folder / EXPORT, "mot")
    cli.run(["verify", str(folder)])
    return folder


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    place = tmp_path_factory.mktemp("two")
    return make(place / "unladen", 0.0), make(place / "laden", 18.144)


@pytest.fixture
def mixed(two, tmp_path):
    """A copy of one result to spoil, and the other."""
    return shutil.copytree(two[0], tmp_path / "walk"), two[1]


def old(folder):
    """Take from files what older versions did not write."""
    for path in folder.glob("*.json"):
        found = json.loads(path.read_text())
        for key in ("gait", "digest", "files"):
            found.pop(key, None)
        path.write_text(json.dumps(found))
    gait = load_gait(folder)
    kept = {"solver": "newton", "status": "optimal", "cost": 4000.0}
    save_gait(replace(gait, solution=kept), folder)
    told = {"solver": "newton", "solver_status": "optimal", "cost": 4000.0}
    for name in (SUMMARY, EXPLANATION):
        edited(folder / name, lambda found: found.update(told))
    return folder


def edited(path, change):
    found = json.loads(path.read_text())
    change(found)
    path.write_text(json.dumps(found))


def test_every_file_carries_the_digest_of_its_gait(two):
    for folder in two:
        assert {str(path.relative_to(folder)) for path in folder.rglob("*")} >= MADE
        digest = gait_digest(load_gait(folder))
        for name in MADE - NO_DIGEST - {MULTIPLIERS}:
            assert digest.encode() in (folder / name).read_bytes(), name
        assert not list(strangers(load_gait(folder), folder))
        for read in READERS.values():
            read(folder)


def test_the_table_of_the_cycle_is_what_pandas_reads_at_once(two):
    table = pd.read_csv(two[0] / GAIT_CYCLE)
    assert table.shape == (101, len(COLUMNS) + len(FURTHER))
    assert all(kind.kind in "fi" for kind in table.dtypes)


@pytest.mark.parametrize("before", [0, 2**20])
def test_a_film_of_another_walk_is_named_wherever_it_says_so(two, tmp_path, before):
    mine, other = (load_gait(folder) for folder in two)
    film = tmp_path / "walk.mp4"
    for gait in (mine, other):
        film.write_bytes(bytes(before) + f"gait={gait_digest(gait)}".encode() + bytes(100))
        named = [name for name, _ in strangers(mine, tmp_path)]
        assert named == ([] if gait is mine else [film.name])


@pytest.mark.parametrize(
    ("name", "reader"),
    [*((name, "figures") for name in sorted(MADE)), *((PLOTS[0], reader) for reader in READERS)],
)
def test_a_file_of_another_walk_is_named(mixed, name, reader):
    folder, other = mixed
    shutil.copy(other / name, folder / name)
    with pytest.raises(ResultError, match=name.partition(".")[0]) as caught:
        READERS[reader](folder)
    assert f"human-gait verify {folder}" in str(caught.value)


def test_a_gait_of_another_walk_is_told(mixed, capsys):
    folder, other = mixed
    shutil.copy(other / GAIT_FILE, folder)
    for command in ("report", "compare", "explain"):
        assert cli.run([command, str(folder)]) == cli.BAD_INPUT
        error = capsys.readouterr().err
        assert error.startswith(f"error: {folder}/")
        assert error.count("\n") == 1
    assert cli.run(["verify", str(folder)]) == cli.NO_SOLUTION
    told = capsys.readouterr().out
    assert "other files off the gait" in told
    named = {name for name in MADE if f"{name}: " in told}
    assert named == MADE - {VERIFICATION, "compare.csv"}  # written anew; belongs to the json
    with pytest.raises(ResultError, match="of another walk"):
        hg.load(folder)  # its multipliers are


def test_a_comparison_of_another_walk_is_replaced(mixed):
    for name in COMPARISON:
        shutil.copy(mixed[1] / name, mixed[0] / name)
    compare_folder(mixed[0])


@pytest.mark.parametrize(
    ("name", "change"),
    [
        (SUMMARY, lambda found: found.update(cost=1)),
        (SUMMARY, lambda found: found.update(walking_speed_m_per_s=2.0)),
        (SUMMARY, lambda found: found.update(body_mass_kg=50)),
        (SUMMARY, lambda found: found.update(iterations=found["iterations"] + 1)),
        (SUMMARY, lambda found: found["versions"].update(drake="9")),
        (SUMMARY, lambda found: [one.update(value=0.0) for one in found["checks"].values()]),
        (SUMMARY, lambda found: found.pop("violations")),
        (SUMMARY, lambda found: found.update(success=True)),
        (EXPLANATION, lambda found: found["shapes"].append({})),
        (EXPLANATION, lambda found: found.update(step_time_s=0.6)),
        (VERIFICATION, lambda found: found.popitem()),
        ("compare.json", lambda found: found["scores"][0].update(r=1.0)),
    ],
)
def test_a_file_that_was_edited_is_named(mixed, capsys, name, change):
    folder, _ = mixed
    edited(folder / name, change)
    with pytest.raises(ResultError, match=name):
        own_gait(folder)
    if name != VERIFICATION:
        assert not hg.verify(folder)["other files off the gait"].passed
    assert cli.run(["explain", str(folder)]) == cli.BAD_INPUT
    assert name in capsys.readouterr().err


def test_a_file_that_is_spaced_or_ordered_otherwise_is_the_same(mixed):
    folder, _ = mixed
    for name in (SUMMARY, EXPLANATION):
        found = json.loads((folder / name).read_text())
        (folder / name).write_text(json.dumps(found, sort_keys=True, separators=(",", ":")))
    table = pd.read_csv(folder / GAIT_CYCLE)
    table["mine"] = 1.0
    table.to_csv(folder / GAIT_CYCLE, index=False)
    own_gait(folder)


@pytest.mark.parametrize("column", ["knee_flexion_deg", "vertical_up_BW", "hip_W_per_kg"])
def test_a_column_that_was_changed_is_named(mixed, column):
    folder, _ = mixed
    table = pd.read_csv(folder / GAIT_CYCLE)
    table[column] *= 1.05
    table.to_csv(folder / GAIT_CYCLE, index=False)
    with pytest.raises(ResultError, match=rf"{GAIT_CYCLE}: {column} is not that of gait\.npz"):
        own_gait(folder)


def test_what_is_compared_is_the_gait_whatever_the_table_says(mixed):
    folder, _ = mixed
    expected = gait_cycle(load_gait(folder))
    (folder / GAIT_CYCLE).unlink()
    (folder / SUMMARY).unlink()
    found = compare_folder(folder)
    assert found.speed == 1.2
    for name, curve in found.cycle.items():
        np.testing.assert_array_equal(curve, expected[name])


def test_older_folders_are_read_and_contradictions_named(mixed):
    folder, other = old(mixed[0]), mixed[1]
    own_gait(folder)
    assert hg.load(folder) == load_gait(folder)
    content = (folder / SUMMARY).read_text()
    for change in (
        {"cost": 1.0},
        {"body_mass_kg": 50},
        {"solver_status": "iteration limit reached"},
        {"scenario": json.loads((other / SUMMARY).read_text())["scenario"]},
    ):
        edited(folder / SUMMARY, lambda found, change=change: found.update(change))
        with pytest.raises(ResultError, match=f"{SUMMARY}: .*{next(iter(change))}"):
            own_gait(folder)
        (folder / SUMMARY).write_text(content)
    shutil.copy(other / GAIT_CYCLE, folder)
    with pytest.raises(ResultError, match=GAIT_CYCLE):
        own_gait(folder)


def test_numbers_that_are_none_are_null_and_read_again(tmp_path):
    from human_gait.results.sealed import write_json
    from human_gait.results.shapes import NUMBER

    write_json(tmp_path / "a.json", {"x": np.inf, "y": [np.nan, 1.0]}, "0" * 16)
    assert read_json(tmp_path / "a.json", {"x": NUMBER})["y"] == [None, 1.0]
