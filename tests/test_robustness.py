"""The design of the benchmark, and one of its walks, from the first guess of the tool."""

import numpy as np
import pytest

from benchmarks.robustness import HIGHEST, LOWEST, SIZE, design, regions, run, summary

WALKS = (14,)  # an ordinary one: the whole design takes an hour
LONGEST = 600.0


def values(scenario):
    walk, subject = scenario.walk, scenario.subject
    return {
        "speed": walk.speed,
        "step_length": walk.step_length,
        "load": scenario.load.mass,
        "stature": subject.stature,
        "mass": subject.mass,
    }


def test_the_design_is_fixed_and_large_enough():
    walks = design()
    assert len(walks) == SIZE >= 200
    assert walks == design()
    assert design(20) == walks[:20]


def test_the_design_fills_its_ranges():
    """Both sexes, and every third of every range has its share, but for steps out of reach."""
    walks = design()
    assert sum(walk.subject.sex == "female" for walk in walks) == SIZE // 2
    for sex in ("female", "male"):
        long = [w for w in walks if w.subject.sex == sex and w.walk.step_length > 0.65]
        assert 0.2 * SIZE / 2 < len(long) < 0.8 * SIZE / 2
    for name, low in LOWEST.items():
        found = np.array([values(walk)[name] for walk in walks])
        assert low <= found.min() <= found.max() <= HIGHEST[name]
        counts, _ = np.histogram(found, bins=3, range=(low, HIGHEST[name]))
        assert counts.min() > 0.25 * SIZE


def result(number, success, **where):
    middle = {name: (low + HIGHEST[name]) / 2 for name, low in LOWEST.items()}
    rest = {"sex": "female", "seconds": 10.0 * number, "starts": 1 + (not success)}
    return {"number": number, "success": success, "engines_apart": 1e-14, **middle, **rest, **where}


def test_every_result_belongs_to_one_region_of_each_kind():
    results = [result(1, True, speed=0.6), result(2, False, speed=1.8), result(3, True, load=10.0)]
    parts = dict(regions(results))
    assert parts.pop("all") == results
    for name in LOWEST:
        kinds = [part for region, part in parts.items() if region.startswith(name.split("_")[0])]
        assert sorted(one["number"] for part in kinds for one in part) == [1, 2, 3]
    found = summary(results)
    assert (found["walks"], found["found"], found["more_than_one_start"]) == (3, 2, 1)
    assert found["median_seconds"] == 20.0
    assert summary([])["walks"] == 0


@pytest.mark.solve
def test_a_walk_of_the_design_is_found_and_what_is_done_is_not_done_again(tmp_path):
    """By all three engines; a second run only reads."""
    results = run(list(WALKS), tmp_path, workers=1, plain=True)
    for one in results:
        assert one["success"], one
        assert one["engines_apart"] < 1e-9
        assert one["seconds"] < LONGEST
    lines = (tmp_path / "results.jsonl").read_text()
    assert run(list(WALKS), tmp_path, workers=1, plain=True) == results
    assert (tmp_path / "results.jsonl").read_text() == lines
