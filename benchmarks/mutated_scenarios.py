"""Whether anything in a scenario file gets past the reader that nobody foresaw.

    python benchmarks/mutated_scenarios.py [--cases N] [--first N] [--predict N] [--out DIR]

Mutates the shipped scenarios, each case from its own seed: values to the ends of their ranges and
beyond, alone and in pairs, types, keys, phases, limits, bytes and structure of the text. Each file
is read, and the problem of what is valid is built; nothing is solved. A case ends well if that
works or a ScenarioError of one line for each mistake says why not, within `LONGEST` seconds of
processor time. Of the valid ones a sample is predicted with a time limit of `TIME_LIMIT` seconds.
Prints how the cases ended; what went wrong is kept in DIR; exit code 1 if anything did.
"""

from __future__ import annotations

import argparse
import json
import resource
import signal
import subprocess
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from rich.console import Console

from human_gait.body.skeleton import DOF_NAMES
from human_gait.exceptions import ScenarioError
from human_gait.problem.program import build_program
from human_gait.scenario import Limits, Scenario, load_scenario, shipped_scenarios

CASES = 5000
LONGEST = 10.0
"""Processor time that a case may take, [s]."""
TIME_LIMIT = 5.0
ENDING = 120.0
"""For a prediction to start, to end after its limit, and to write its result, [s]."""

_COARSE = {"control_points": 7, "intervals": 12, "dynamics_per_interval": 1}
_ODD: list[Any] = [
    *(0, -1, 1, 6, 10**6, 10**30, -(2**63), 0.0, -0.0, 1e-320, 1e308, 0.5),
    *(float("nan"), float("inf"), float("-inf"), True, False, "", "male", "force", "x" * 300),
    *([], {}, [0.0] * 3, [1, 2], [[[]]], {"speed": 1.2}, [{"a": 1}], "40 lb", "5 ft 9", "1 ly"),
]
_PARTS = [b"[", b"]", b"{", b"=", b".", b'"', b"'", b"#", b"\n", b"\0", b"\xff", b"1e999", b"a.b.c"]

Rng = np.random.Generator
Tables = dict[str, Any]


def _settings() -> list[tuple[str, str, dict[str, Any]]]:
    """Return section, name and rule of every setting that has a range or choices."""
    kinds = [(name, kind) for name, kind in Scenario.sections().items() if kind is not Limits]
    return [(name, key, dict(kind.rule(key))) for name, kind in kinds for key in kind.kinds()]


SETTINGS = _settings()


def mutated(number: int) -> tuple[str, bytes]:
    """Return the way and the bytes of one case."""
    rng = np.random.default_rng(number)
    files = sorted(shipped_scenarios().values())
    file = files[rng.integers(len(files))]
    tables = load_scenario(file).to_dict()
    tables["discretisation"] |= _COARSE
    ways: list[Callable[[Tables, Rng], object]] = [_ends, _ends, _pair, _odd, _keys, _limits]
    ways += [_phases, _text, _structure]
    way = ways[rng.integers(len(ways))]
    if way is _text:
        content = _text(file.read_bytes(), rng)
    elif way is _structure:
        content = _structure(tomli_w.dumps(tables), rng)
    else:
        way(tables, rng)
        content = tomli_w.dumps(_writable(tables)).encode()
    return way.__name__.lstrip("_"), content


def _end(rule: dict[str, Any], kind: object, rng: Rng, beyond: bool) -> Any:
    """Return an end of the range of a setting, or a value just beyond it."""
    if "range" not in rule:
        return str(rng.choice(rule.get("choices", ["x"])))
    low, high = rule["range"]
    values = [low, high, low + rng.random() * (high - low)]
    if beyond:
        values += [np.nextafter(low, -np.inf), np.nextafter(high, np.inf), 2 * high, -high]
    value = float(values[rng.integers(len(values))])
    if isinstance(kind, list):
        return [value] * len(kind)
    return round(value) if isinstance(kind, int) else value


def _ends(tables: Tables, rng: Rng, n: int = 1, beyond: bool = True) -> None:
    """Move settings to the ends of their ranges."""
    for i in rng.choice(len(SETTINGS), n, replace=False):
        section, key, rule = SETTINGS[i]
        tables[section][key] = _end(rule, tables[section][key], rng, beyond)


def _pair(tables: Tables, rng: Rng) -> None:
    _ends(tables, rng, int(rng.integers(2, 4)), beyond=False)


def _odd(tables: Tables, rng: Rng) -> None:
    """Put something of another type, or of another size, in the place of a value."""
    section, key, _ = SETTINGS[rng.integers(len(SETTINGS))]
    place = tables if rng.random() < 0.2 else tables[section]
    place[section if place is tables else key] = _ODD[rng.integers(len(_ODD))]


def _keys(tables: Tables, rng: Rng) -> None:
    """Remove, rename, add or move a key."""
    section, key, _ = SETTINGS[rng.integers(len(SETTINGS))]
    name = ["", "x", key.upper(), key[:-1], key + " ", "é", "walk", "a" * 500][rng.integers(8)]
    match rng.integers(4):
        case 0:
            del tables[section][key]
        case 1:
            tables[section][name] = tables[section].pop(key)
        case 2:
            tables[name or "y"] = tables[section][key]
        case _:
            tables[name or "y"] = tables.pop(section)


def _limits(tables: Tables, rng: Rng) -> None:
    """Freeze joints, or give them ranges, of which some leave no walk."""
    chosen = [str(name) for name in rng.choice([*DOF_NAMES, "nothing"], rng.integers(1, 5), False)]
    if rng.random() < 0.4:
        tables["limits"] = {"frozen": chosen}
        return
    scale = float(rng.choice([1.0, 20.0, 90.0, 180.0]))
    ends = np.round(np.sort(rng.uniform(-scale, scale, (len(chosen), 2)), axis=1), 2)
    tables["limits"] = dict(zip(chosen, ends.tolist(), strict=True))


def _phases(tables: Tables, rng: Rng) -> None:
    """Draw all events anew, in their order, and the grid."""
    ends = np.array([0.01, 0.01, 0.02, 0.1, 0.5, 0.9, 0.97, 0.98])
    both = float(rng.choice([*ends, rng.uniform(0.01, 0.98)]))
    late = np.sort(rng.uniform(both, 0.99, 3)) if rng.random() < 0.7 else both + 1e-4 * np.arange(4)
    early = rng.uniform(0.01, both, 2) if rng.random() < 0.7 else (both, both)
    names = ("mid_swing", "heel_unloading", "heel_off", "foot_flat", "ball_off", "double_support")
    values = [*map(float, late[-3:]), *map(float, early), both]
    tables["phases"] = dict(zip(names, np.clip(values, 0.01, 0.99).tolist(), strict=True))
    grid = {"intervals": rng.integers(12, 31), "dynamics_per_interval": rng.integers(1, 4)}
    tables["discretisation"] |= {key: int(value) for key, value in grid.items()}


def _text(content: bytes, rng: Rng) -> bytes:
    """Change some bytes: cut, flip, put in, take out, or bring from elsewhere."""
    for _ in range(rng.integers(1, 5)):
        at, start, n = (int(x) for x in rng.integers(0, [len(content), len(content), 40]))
        part = _PARTS[rng.integers(len(_PARTS))]
        content = (
            content[:at] + bytes([rng.integers(256)]) + content[at + 1 :],
            content[:at] + part + content[at:],
            content[:at] + content[at + n :],
            content[:at] + content[start : start + n] + content[at:],
            content[: at + 1],
        )[rng.integers(5)]
    return content


def _structure(text: str, rng: Rng) -> bytes:
    """Change the file as a whole: its encoding, depth, size, or what is nested in it."""
    n = int(rng.choice([2, 19, 21, 500, 20_000]))
    brackets, key = "[" * n + "]" * n, ".".join("a" * n)
    changed = (
        text.encode("utf-16"),
        text.encode("utf-8-sig"),
        text.replace("\n", "\r\n").encode(),
        text.replace("\n", "\r").encode(),
        (text * 2).encode(),
        f"x = {brackets}\n{text}".encode(),
        (text + "[x]\ny = " + "{a = " * n + "1" + "}" * n).encode(),
        f"{key} = 1\n{text}".encode(),
        (text + f"[{key}]\n").encode(),
        (text + "[limits]\n" + "".join(f"j{i} = [0, 1]\n" for i in range(n))).encode(),
        ("".join(f"k{i} = 1\n" for i in range(n)) + text).encode(),
        text.replace("1.2", "9" * n).encode(),
        text.replace("1.2", '"' + " " * 20 * n + '1 m/s"').encode(),
        text.encode() + b"\0",
        b"#" * 50 * n + b"\n" + text.encode(),
        text.encode("utf-8")[: len(text) // 2],
    )
    return changed[rng.integers(len(changed))]


def _writable(table: Tables) -> Tables:
    """Return the tables with whole numbers that TOML can hold."""
    return json.loads(json.dumps(table), parse_int=lambda digits: int(digits[:18]))  # type: ignore[no-any-return]


class Hang(BaseException):
    """A case took far too long."""


def outcome(content: bytes, path: Path) -> tuple[str, str]:
    """Return how a case ended, ``built``, ``refused`` or a fault, and what was said."""
    path.write_bytes(content)
    began = time.process_time()
    try:
        build_program(load_scenario(path))
        end, said = "built", ""
    except ScenarioError as error:
        lines = [one.line for one in error.errors]
        fine = all(line.isprintable() or "\n" not in line for line in lines)
        end, said = "refused" if fine and lines else "fault", str(error)
    except Hang:
        end, said = "fault", "no end"
    except BaseException:  # noqa: BLE001, that is what is looked for
        end, said = "fault", traceback.format_exc()
    spent = time.process_time() - began
    return (end, said) if spent <= LONGEST else ("fault", f"{spent:.1f} s: {said}")


def predicted(path: Path, out: Path) -> tuple[str, str]:
    """Return how the prediction of a valid case ended, and what was said."""
    words = ["predict", path, "--out", out, "--time-limit", f"{TIME_LIMIT:g}"]
    command = [sys.executable, "-m", "human_gait", *map(str, words)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=TIME_LIMIT + ENDING, check=False
        )
    except subprocess.TimeoutExpired:
        return "fault", f"no end after {TIME_LIMIT + ENDING:g} s"
    kept = (out / "gait.npz").is_file() == (done.returncode in (0, 1))
    ends = {0: "a walk", 1: "no walk", 2: "refused"}
    well = done.returncode in ends and kept and "Traceback" not in done.stderr
    return ends[done.returncode] if well else "fault", done.stdout + done.stderr


def run(numbers: range, folder: Path, predictions: int = 0) -> Counter[str]:
    """Return how many cases ended in which way; keep the files of faults in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    counts: Counter[str] = Counter()
    valid: list[int] = []
    signal.signal(signal.SIGALRM, _hang)
    for number in numbers:
        way, content = mutated(number)
        path = folder / f"{number}.toml"
        signal.alarm(int(20 * LONGEST))
        end, said = outcome(content, path)
        signal.alarm(0)
        counts[f"{way}: {end}"] += 1
        _keep(path, end, said)
        valid += [number] if end == "built" else []
    for number in np.random.default_rng(0).permutation(valid)[:predictions]:
        path = folder / f"{number}.toml"
        path.write_bytes(mutated(int(number))[1])
        end, said = predicted(path, folder / str(number))
        counts[f"predicted: {end}"] += 1
        _keep(path, end, said)
    return counts


def _hang(*_: object) -> None:
    raise Hang


def _keep(path: Path, end: str, said: str) -> None:
    """Keep the file of a fault, and what was said of it."""
    if end != "fault":
        path.unlink()
        return
    path.with_suffix(".txt").write_text(said, encoding="utf-8", errors="replace")


def main() -> None:
    """Run the cases and print how they ended."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=CASES)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--predict", type=int, default=20, help="how many of the valid ones")
    parser.add_argument("--out", type=Path, default=Path("out/mutated"))
    options = parser.parse_args()
    began = time.process_time()
    numbers = range(options.first, options.first + options.cases)
    counts = run(numbers, options.out, options.predict)
    console = Console(highlight=False)
    for what, count in sorted(counts.items()):
        console.print(f"{count:6d}  {what}")
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    console.print(f"{time.process_time() - began:.0f} s of processor time, {memory:.2f} GB")
    sys.exit(any(what.endswith("fault") for what in counts))


if __name__ == "__main__":
    main()
