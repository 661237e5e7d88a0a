"""Result folders damaged at random: every command ends by itself, in one line that names the file.

python benchmarks/damaged_results.py [CASES] [SEED]

One quick walk is solved; then, for every case, one file of a copy of its folder is damaged and a
command is run on it, in this process. What is wrong is printed at once, the counts at the end.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import shutil
import signal
import struct
import sys
import tempfile
import time
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

import human_gait as hg
from human_gait import cli, prediction
from human_gait.canvas import Picture
from human_gait.people import comparison
from human_gait.pictures.plots import save_plots
from human_gait.reporting import page, panels
from human_gait.results import names

LONGEST = 60  # [s] of one command
OLD = 0.6  # share of files without digests, as older versions wrote them
JSON = (names.SUMMARY, names.EXPLANATION, names.VERIFICATION, names.COMPARISON_JSON)
ARCHIVES = (names.GAIT_FILE, names.MULTIPLIERS)
OTHERS = (names.GAIT_CYCLE, names.PLOTS[0])
READERS = (("report",), ("explain",), ("compare",), ("verify",))
OF_GAIT = (
    *READERS,
    ("export", "--format", "csv"),
    ("play", "--save", "page.html"),
    ("film", "--out", "walk.png", "--size", "100x100"),
)
LEAKS = (
    "Traceback",
    "allow_pickle",
    "set_int_max",
    "recursion depth",
    "codec can't",
    "object at 0x",
)
ODD: tuple[Callable[[random.Random], Any], ...] = (
    lambda _: 10**400,
    lambda _: -(10**30),
    lambda _: 1e308,
    lambda _: float("nan"),
    lambda _: float("-inf"),
    lambda _: "\ud800",
    lambda _: "\x1b]0;title\x07\x1b[2J",
    lambda _: "\x9b31m\u202e[red]",
    lambda _: "x" * 10**6,
    lambda _: None,
    lambda _: True,
    lambda _: [],
    lambda _: {},
    lambda _: [[[[]]]],
    lambda _: {"a": {"b": "c"}},
    lambda _: "",
    lambda dice: dice.uniform(-1e3, 1e3),
    lambda dice: dice.choice(["0.5", "NaN", "../../etc", "<b>", "0x10", "1e5"]),
)


def make_from(gait: hg.Gait, folder: Path) -> Path:
    """Write a whole result of a gait."""
    gait.save(folder)
    save_plots(hg.load(folder), folder)
    for command in ("verify", "compare"):
        with contextlib.redirect_stdout(io.StringIO()):
            cli.run([command, str(folder)])
    return folder


# Damages of any file


def _flipped(content: bytes, dice: random.Random) -> bytes:
    at = dice.randrange(len(content))
    return content[:at] + bytes([content[at] ^ 1 << dice.randrange(8)]) + content[at + 1 :]


def _spliced(content: bytes, dice: random.Random) -> bytes:
    at, start, n = (dice.randrange(len(content)) for _ in range(3))
    n %= 200
    return content[:at] + content[start : start + n] + content[at + n :]


BYTES: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    lambda content, dice: content[: dice.randrange(len(content))],
    lambda _, __: b"",
    _flipped,
    _flipped,
    _spliced,
    lambda content, dice: content + dice.randbytes(50),
    lambda content, _: b"\xef\xbb\xbf" + content,
    lambda content, _: content.decode("latin-1").encode("utf-16"),
    lambda content, dice: dice.randbytes(len(content) // 50 + 1),
    lambda content, _: bytes(len(content)),
    lambda content, _: b"junk\n" + content,
)


def _in_its_place(path: Path, dice: random.Random) -> None:
    """Put something else in the place of a file."""
    path.unlink()
    match dice.randrange(6):
        case 0:
            path.mkdir()
        case 1:
            path.symlink_to(path.name)
        case 2:
            path.symlink_to("nowhere")
        case 3:
            os.mkfifo(path)
        case 4:
            with path.open("wb") as file:
                file.truncate(2**40)
        case 5:
            path.symlink_to("/dev/zero")


def damage_bytes(path: Path, dice: random.Random) -> None:
    """Damage a file of any kind."""
    if dice.random() < 0.25:
        _in_its_place(path, dice)
    else:
        path.write_bytes(dice.choice(BYTES)(path.read_bytes(), dice))


# Damages of JSON


TEXTS = ("\ud800", "\x1b[2J", "\u202e", "x" * 3000, "")
SPOILS: tuple[Callable[[str], str], ...] = (
    lambda text: text.replace("{", '{"a": 1, "a": 2, ', 1),
    lambda text: text.replace(":", ": " + "[" * 10**5, 1),
    lambda text: text[:-1] + ', "many": [' + "0," * 10**5 + "0]}",
    lambda text: text.replace(": ", ": " + "9" * 5000, 1),
    lambda text: f"[{text}]",
)
"""What is done to the text of JSON."""


def _places(content: Any) -> Iterator[tuple[Any, Any]]:
    """Yield every container and key in a content."""
    pairs = content.items() if isinstance(content, dict) else enumerate(content)
    for key, value in pairs:
        yield content, key
        if isinstance(value, dict | list):
            yield from _places(value)


def odd_json(content: Any, dice: random.Random) -> str:
    """Return a content with something odd in it, as text that JSON or Python's reader may take."""
    if isinstance(content, dict) and dice.random() < OLD:
        for key in ("gait", "digest", "files"):
            content.pop(key, None)
    for _ in range(dice.randint(1, 2)):
        inside, key = dice.choice([*_places(content), ([0], 0)])
        if isinstance(inside, dict) and dice.random() < 0.25:
            inside.pop(key)
        elif isinstance(inside, dict) and dice.random() < 0.3:
            inside[str(dice.choice([str, *TEXTS]))] = inside[key]
        else:
            inside[key] = dice.choice(ODD)(dice)
    return dice.choice([*SPOILS, *[str] * 8])(json.dumps(content))


def damage_json(path: Path, dice: random.Random) -> None:
    """Damage a JSON file that stays text."""
    content = odd_json(json.loads(path.read_text(encoding="utf-8")), dice)
    path.write_text(content, encoding="utf-8", errors="surrogatepass")


# Damages of archives


def odd_array(array: np.ndarray, dice: random.Random) -> Any:
    """Return an array that is not what it was."""
    if array.dtype.kind == "U" and not array.ndim and str(array).startswith("{"):
        return np.array(odd_json(json.loads(str(array)), dice).encode("utf-8", "replace").decode())
    flat = np.array(array, dtype=object if array.dtype.kind == "U" else float).copy()
    if flat.size and array.dtype.kind == "f":
        where = dice.randrange(flat.size)
        flat.flat[where] = dice.choice([np.nan, np.inf, -np.inf, 1e308, 1e-320, 1e9, 0.0, -1.0])
    kinds = (
        lambda: flat,
        lambda: array.astype(object),
        lambda: array.astype("S") if array.dtype.kind == "U" else array.astype(np.float16),
        lambda: array.astype(complex) if array.dtype.kind == "f" else np.array(7),
        lambda: array[:0] if array.ndim else np.zeros(0),
        lambda: array[None],
        lambda: np.asarray(array).T,
        lambda: np.zeros((0, 3)),
        lambda: np.array({"a": 1}, dtype=object),
        lambda: np.array("x" * 10**6),
        lambda: np.zeros(3, dtype=[("a", "f8"), ("b", "i4")]),
        lambda: np.array(["2020-01-01"], dtype="M8[D]"),
    )
    return dice.choice(kinds)()


def damage_archive(path: Path, dice: random.Random) -> None:
    """Damage an archive that stays one."""
    with np.load(path) as file:
        arrays: dict[str, Any] = dict(file)
    if dice.random() < OLD:
        for name in ("digests", "__gait__"):
            arrays.pop(name, None)
    name = dice.choice(sorted(arrays))
    match dice.randrange(8):
        case 0:
            arrays.pop(name)
        case 1:
            arrays[dice.choice(["\x1b[2J", "a" * 300, "\u202e", "t.npy", "../x"])] = arrays[name]
        case 2:
            arrays |= {f"n{k}": np.zeros(1) for k in range(dice.choice([150, 300]))}
        case _:
            with np.errstate(all="ignore"):
                arrays[name] = odd_array(arrays[name], dice)
    np.savez(path, **arrays)
    match dice.randrange(10):
        case 0:
            with zipfile.ZipFile(path, "a") as archive:
                _raw(archive, f"{name}.npy", dice)
        case 1:
            _many(path)


def _raw(archive: zipfile.ZipFile, name: str, dice: random.Random) -> None:
    """Add a member again, or what claims to be an array and is none."""
    import warnings  # noqa: PLC0415, of zipfile about names that are there twice

    header = str({"descr": "<f8", "fortran_order": False, "shape": (2 ** dice.randint(3, 62),)})
    nested = "(" * 5000 + "\n"
    text = dice.choice([header + "\n", nested, "{}\n", "\\d\n", "{'descr': '|O'}\n"]).encode()
    content = b"\x93NUMPY\1\0" + struct.pack("<H", len(text) % 2**16) + text + bytes(80)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        archive.writestr(dice.choice([name, "new.npy", "new"]), content)


def _many(path: Path) -> None:
    """Write an archive of 100,000 empty members."""
    if not _MANY:
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w") as archive:
            for k in range(100_000):
                archive.writestr(f"{k}.npy", b"")
        _MANY.append(stream.getvalue())
    path.write_bytes(_MANY[0])


_MANY: list[bytes] = []


# Cases


def damage(folder: Path, dice: random.Random) -> tuple[str, tuple[str, ...]]:
    """Damage one file of a folder; return its name and the command to run."""
    kind = dice.choice(["json", "json", "archive", "archive", "bytes", "bytes"])
    if kind == "json":
        name = dice.choice(JSON)
        damage_json(folder / name, dice)
    elif kind == "archive":
        name = dice.choice(ARCHIVES)
        damage_archive(folder / name, dice)
    else:
        name = dice.choice([*JSON, *ARCHIVES, *ARCHIVES, *OTHERS])
        damage_bytes(folder / name, dice)
    commands = OF_GAIT if name == names.GAIT_FILE else READERS
    return name, dice.choice(commands)


@contextlib.contextmanager
def quickly(read: bool) -> Iterator[None]:
    """Leave out what is made once everything is read: curves, the animation, the engines.

    Parameters
    ----------
    read : bool
        Whether the gait is as it was written: then it need not be checked again.
    """
    with contextlib.ExitStack() as patched:
        for target, name, instead in (
            (page, "GROUPS", {"Joint angles": ("knee_flexion_deg",)}),
            (page, "ENERGY_GROUPS", {}),
            (panels, "pictures", lambda *_: ()),
            (page, "page_of", lambda *_, **__: ""),
            (page, "still_address", lambda *_, **__: ""),
            (comparison, "compare_figure", lambda *_: Picture(1.0, 1.0)),
            (prediction, "verify", (lambda _: []) if read else prediction.verify),
        ):
            patched.enter_context(mock.patch.object(target, name, instead))
        yield


def run(folder: Path, command: tuple[str, ...], read: bool) -> tuple[int, str, str, float]:
    """Run a command on a folder; return its exit code, what it said and how long it took [s]."""

    def give_up(*_: object) -> None:
        raise TimeoutError(f"no end after {LONGEST} s")

    name, *options = command
    options = [
        str(folder.parent / word) if word.endswith((".html", ".png")) else word for word in options
    ]
    out, err, begin = io.StringIO(), io.StringIO(), time.perf_counter()
    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(LONGEST)
    try:
        with quickly(read), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = cli.run([name, str(folder), *options])
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    return code, out.getvalue(), err.getvalue(), time.perf_counter() - begin


def complaints(name: str, code: int, out: str, err: str) -> Iterator[str]:
    """Yield what is wrong with the end of a command on a folder with a damaged file."""
    lines = [line for line in err.splitlines() if not line.startswith(("note: ", "warning: "))]
    if code not in (0, 1, 2):
        yield f"exit code {code}"
    if code == 2 and (len(lines) != 1 or not lines[0].startswith("error: ")):
        yield f"{len(lines)} lines of errors"
    if code != 2 and lines:
        yield "an error that is none"
    if code == 2 and name not in err and not (name == names.COMPARISON_CSV and "compare" in err):
        yield "the file is not named"
    if leaks := [word for word in LEAKS if word in err or word in out]:
        yield f"it says {leaks[0]!r}"
    if any(sign in out + err for sign in "\x1b\x07\x9b\u202e"):
        yield "what steers a terminal is printed"


def tried(whole: Path, number: int, seed: int = 0) -> dict[str, Any]:
    """Damage a copy of a whole result and run a command on it."""
    dice = random.Random(f"{seed} {number}")
    with tempfile.TemporaryDirectory() as place:
        folder = shutil.copytree(whole, Path(place) / "walk")
        name, command = damage(folder, dice)
        case = {"number": number, "file": name, "command": command[0]}
        try:
            code, out, err, seconds = run(folder, command, name != names.GAIT_FILE)
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            return case | {"code": 70, "seconds": 0.0, "wrong": [repr(error)[:300]], "said": ""}
        wrong = list(complaints(name, code, out, err))
        return case | {"code": code, "seconds": seconds, "wrong": wrong, "said": err}


def main(cases: str = "2000", seed: str = "0") -> int:
    """Try cases, print what is wrong and the counts; return whether anything was."""
    ends: Counter[tuple[str, int]] = Counter()
    wrong, longest = 0, 0.0
    with tempfile.TemporaryDirectory() as place:
        whole = make_from(hg.predict("preferred"), Path(place) / "whole")
        for number in range(int(cases)):
            found = tried(whole, number, int(seed))
            ends[found["command"], found["code"]] += 1
            longest = max(longest, found["seconds"])
            if found["wrong"]:
                wrong += 1
                sys.stdout.write(f"{found}\n")
                sys.stdout.flush()
    for (command, code), count in sorted(ends.items()):
        sys.stdout.write(f"{command:8} exit {code}: {count}\n")
    sys.stdout.write(f"{cases} cases, {wrong} wrong, the longest {longest:.1f} s\n")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
