"""Whether a result that somebody changed is told from one that nobody did.

    python benchmarks/tampering.py RESULT ... [--entries N] [--full]

Changes one thing at a time in the ``gait.npz`` of each RESULT: every array by 1 %, as a whole and
at N single numbers of it, every setting by 1 % or to its neighbour, everything that is told of the
solution. Once the digests stay as they were; once they are made anew, as somebody would who knows
how: then only what can be computed is left to tell. Prints who tells; with ``--full`` all checks
are asked, else those of the file's contents.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import suppress
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from human_gait.body.limits import position_limits
from human_gait.body.skeleton import index
from human_gait.checks.contents import contents_checks
from human_gait.checks.verification import verify
from human_gait.exceptions import ScenarioError
from human_gait.results.names import GAIT_FILE
from human_gait.scenario import Scenario
from human_gait.settings.departures import departures
from human_gait.settings.records import Setting, all_settings
from human_gait.walk.described import gait_digest
from human_gait.walk.gait import Gait
from human_gait.walk.gait_file import restored, sealed

Members = Mapping[str, Any]
Change = tuple[str, Members]

JOINT, FROZEN = "knee_flexion_r", "wrist_flexion_r"
NOTHING = "nobody"


def changes(members: Members, entries: int, rng: np.random.Generator) -> Iterator[Change]:
    """Yield every change, by what is changed, and the members with it."""
    yield from of_arrays(members, entries, rng)
    yield from of_settings(members)
    yield from of_solution(members)
    for name in ("format", "about"):
        yield name, {**members, name: np.array(f"{members[name]} ")}
    names = np.roll(members["dof_names"], 1)
    yield "dof_names", {**members, "dof_names": names}


def of_arrays(members: Members, entries: int, rng: np.random.Generator) -> Iterator[Change]:
    """Yield each array of numbers 1 % larger: all of it, and single numbers of it."""
    for name, array in members.items():
        if np.asarray(array).dtype.kind != "f":
            continue
        yield name, {**members, name: array * 1.01}
        counting = np.flatnonzero(np.abs(array) > 1e-6 * np.abs(array).max())
        for place in rng.choice(counting, min(entries, len(counting)), replace=False):
            changed = array.copy()
            changed.flat[place] *= 1.01
            yield name, {**members, name: changed}


def of_settings(members: Members) -> Iterator[Change]:
    """Yield each setting of the scenario, 1 % larger or the next one."""
    tables = json.loads(str(members["scenario"]))
    for setting in all_settings():
        changed = deepcopy(tables)
        table = changed[setting.section] if setting.section else changed
        key = JOINT if setting.key == "<joint>" else setting.key
        table[key] = neighbour(setting, table.get(key))
        dotted = f"{setting.section}.{key}" if setting.section else key
        yield dotted, {**members, "scenario": np.array(json.dumps(changed))}


def neighbour(setting: Setting, value: Any) -> Any:
    """Return another value of a setting, as near as may be."""
    if setting.key == "<joint>":
        return [float(np.rad2deg(end[index(JOINT)])) * 1.01 for end in position_limits()]
    if setting.key == "frozen":
        return [*value, FROZEN]
    if isinstance(value, str):
        return next((one for one in setting.choices if one != value), f"{value}x")
    if isinstance(value, list):
        return [number * 1.01 for number in value] if any(value) else [0.01 * setting.high] * 3
    moved = value + 1 if setting.whole else value * 1.01 or 0.01 * (setting.high or 1.0)
    return moved if setting.high is None or moved <= setting.high else value * 0.99


def of_solution(members: Members) -> Iterator[Change]:
    """Yield each thing that is told of how the walk was found, another one."""
    told = json.loads(str(members["solution"]))
    for key, value in told.items():
        if key == "digest":
            continue  # one of those that stay, or are made anew
        changed = not value if isinstance(value, bool) else None
        if changed is None:
            changed = value * 1.01 if isinstance(value, int | float) else f"{value}x"
        content = json.dumps({**told, key: changed})
        yield f"solution.{key}", {**members, "solution": np.array(content)}


def told_by(members: Members, before: Gait, full: bool = False) -> str:
    """Return who tells that something is wrong: the reader, a check, the header, or nobody.

    `before` is the gait of the file as it was.
    """
    try:
        record = restored(members)
    except (KeyError, TypeError, ValueError, ScenarioError) as error:
        return f"the reader: {error}"
    if record.gait == before and record.gait.solution == before.solution:
        record = replace(record, gait=before)  # whose samples are known
    checks = verify(record) if full else contents_checks(record)
    failed = [check.told for check in checks if not check.passed]
    if failed:
        return f"checks: {'; '.join(failed)}"
    shown = header(record.gait.scenario) - header(before.scenario)
    return f"the header: {', '.join(sorted(shown))}" if shown else NOTHING


def made_anew(members: Members) -> Members:
    """Return the members with digests that fit them, as far as they make a walk."""
    told = json.loads(str(members["solution"]))
    if "digest" in told:
        with suppress(KeyError, TypeError, ValueError, ScenarioError):
            told["digest"] = gait_digest(restored(members).gait)
    return sealed({**members, "solution": np.array(json.dumps(told))})


def header(scenario: Scenario) -> set[str]:
    """Return what ``human-gait verify`` shows of a scenario that no check can judge."""
    return {scenario.name, *map(str, departures(scenario))}


def main() -> None:
    """Change the results that are named, and print who tells."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("results", nargs="+", type=Path)
    parser.add_argument("--entries", type=int, default=20, help="numbers of each array")
    parser.add_argument("--full", action="store_true", help="ask all checks")
    given = parser.parse_args()
    console, counted = Console(highlight=False), Counter[tuple[str, str]]()
    unnoticed: dict[str, set[str]] = {"as they were": set(), "made anew": set()}
    for folder in given.results:
        with np.load(folder / GAIT_FILE, allow_pickle=False) as file:
            members = sealed(dict(file))
        before, rng = restored(members).gait, np.random.default_rng(0)
        for name, changed in changes(members, given.entries, rng):
            for digests, now in (("as they were", changed), ("made anew", made_anew(changed))):
                who = told_by(now, before, given.full)
                counted[digests, who.partition(":")[0]] += 1
                if who == NOTHING:
                    unnoticed[digests].add(name)
    table = Table("digests", "told by", "changes", box=None)
    for (digests, who), n in sorted(counted.items()):
        table.add_row(digests, who, str(n))
    console.print(table)
    for digests, names in unnoticed.items():
        console.print(f"digests {digests}, told by nobody: {', '.join(sorted(names)) or 'nothing'}")


if __name__ == "__main__":
    main()
