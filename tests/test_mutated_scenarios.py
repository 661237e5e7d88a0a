"""Mutated scenarios are read and built, or refused: the benchmark of 5,000, in short."""

from collections import Counter

import pytest

from benchmarks import mutated_scenarios
from benchmarks.mutated_scenarios import mutated, outcome, predicted, run
from human_gait.scenario import shipped_scenarios

CASES = 100


def test_cases_are_the_same_whenever_they_are_made():
    assert [mutated(number) for number in range(20)] == [mutated(number) for number in range(20)]


def test_no_mutated_scenario_gets_past_the_reader(tmp_path):
    counts = run(range(CASES), tmp_path / "mutated")
    assert [what for what in counts if what.endswith("fault")] == []
    assert sum(counts.values()) == CASES
    ways, ends = (Counter(what.split(": ")[i] for what in counts) for i in (0, 1))
    assert len(ways) >= 7
    assert set(ends) == {"built", "refused"}
    assert list((tmp_path / "mutated").iterdir()) == []


@pytest.mark.parametrize("error", [ValueError, RecursionError, KeyboardInterrupt])
def test_what_nobody_foresaw_is_a_fault(tmp_path, monkeypatch, error):
    def fails(_):
        raise error

    monkeypatch.setattr(mutated_scenarios, "build_program", fails)
    content = shipped_scenarios()["normal"].read_bytes()
    end, said = outcome(content, tmp_path / "case.toml")
    assert end == "fault"
    assert error.__name__ in said


def test_a_case_that_takes_too_long_is_a_fault(tmp_path, monkeypatch):
    monkeypatch.setattr(mutated_scenarios, "LONGEST", 0.0)
    content = shipped_scenarios()["normal"].read_bytes()
    assert outcome(content, tmp_path / "case.toml")[0] == "fault"


def test_a_prediction_is_told_by_how_it_ends(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text("[walk]\n")
    end, said = predicted(path, tmp_path / "out")
    assert end == "refused"
    assert "walk.speed" in said
