"""Processes that write results into a folder and fail on the way; run by `test_folder`.

python writers.py FOLDER "kill|full|stop|together [exchange|renames|one-by-one]"...

tries each way within FOLDER, in a process of its own that is a copy of this one, and writes into
FOLDER/WAY.out a line for each try: its number, what the folder of the result holds then, and how
the process ended. What the processes say goes into FOLDER/WAY.err.
"""

import os
import resource
import shutil
import signal
import sys
import tempfile
import time
from functools import cache
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from walking import guessed_gait

from human_gait.exceptions import ResultError
from human_gait.prediction import OURS
from human_gait.results import exchange
from human_gait.results import folder as result_folder
from human_gait.walk.gait_cycle import save_gait_cycle
from human_gait.walk.gait_file import load_gait, save_gait

DERIVED = [name for name in OURS if name not in ("gait.npz", "gait_cycle.csv", "summary.json")]
LOADS = (0.0, 10.0, 20.0)
STEPS = {
    os: ["replace", "rename", "fsync", "mkdir", "link", "unlink", "rmdir", "open"],
    exchange: ["exchange", "carry"],
    shutil: ["rmtree"],
}
FULL = 10_000  # bytes that fit on the disk, at the first try
LOOKS = 40
READ = set()  # results that were read back once: the others have the same bytes


@cache
def content(load):
    """The files of a result, without its pictures; the load tells which one it is."""
    with tempfile.TemporaryDirectory() as name:
        save_gait(guessed_gait(load), Path(name))
        save_gait_cycle(guessed_gait(load), Path(name) / "gait_cycle.csv")
        (Path(name) / "summary.json").write_text(f"{load}\n")
        return {path.name: path.read_bytes() for path in Path(name).iterdir()}


def write(folder, load):
    """Write a result as prediction does."""
    with result_folder.replaced_folder(folder, DERIVED) as new:
        for name, part in content(load).items():
            (new / name).write_bytes(part)


def state(folder):
    """Return the load of the result in a folder, if its files belong together."""
    if not folder.exists():
        return "none"
    loads = {
        load
        for load in LOADS
        for name, part in content(load).items()
        if (folder / name).read_bytes() == part
    }
    files = {path.name for path in folder.iterdir() if not path.name.startswith(".")}
    foreign = {"notes.txt", "mine"} if (folder.parent / "had notes").exists() else set()
    whole = files - set(DERIVED) == {*content(LOADS[0]), *foreign}
    stale = files & set(DERIVED) and loads != {LOADS[0]}
    if len(loads) != 1 or not whole or stale:
        return f"a mix: {loads}, {sorted(files)}"
    if not loads <= READ:
        load_gait(folder)
        READ.update(loads)
    return str(*loads)


def fail_at(call, fail):
    """Call `fail` before or (odd numbers) after one of the steps above."""
    calls = iter(range(sys.maxsize))

    def failing(step):
        def wrapped(*arguments, **options):
            if next(calls) == call:
                fail()
            result = step(*arguments, **options)
            if next(calls) == call:
                fail()
            return result

        return wrapped

    for module, names in STEPS.items():
        for name in names:
            setattr(module, name, failing(getattr(module, name)))


def die():
    os._exit(137)


def stop():
    raise KeyboardInterrupt


def child(work):
    """Do work in a process of its own and return its number."""
    number = os.fork()
    if number:
        return number
    try:
        work()
    except ResultError as error:
        sys.stderr.write(f"{error}\n")
        sys.stderr.flush()
        os._exit(2)
    except KeyboardInterrupt:
        os._exit(130)
    except BaseException:  # noqa: BLE001, nothing may go on in this copy of the process
        sys.excepthook(*sys.exc_info())
        os._exit(70)
    os._exit(0)


def tell(*words):
    sys.stdout.write(" ".join(map(str, words)) + "\n")
    sys.stdout.flush()


def end(number):
    return os.waitstatus_to_exitcode(os.waitpid(number, 0)[1])


def tries(folder, spoil):
    """Write the second result over the first, spoilt at ever later points, until it succeeds."""
    for k in range(10_000):
        if not folder.exists():
            prepare(folder)

        def work(k=k):
            spoil(k)
            write(folder, LOADS[1])

        code = end(child(work))
        now = state(folder)
        tell(k, now, code)
        if code == 0:
            return
        if now != str(LOADS[0]):
            shutil.rmtree(folder, ignore_errors=True)


def prepare(folder):
    write(folder, LOADS[0])
    (folder / "verification.json").write_text("{}")
    (folder / "notes.txt").write_text("mine")
    (folder / "mine").mkdir()
    (folder / "mine" / "data").write_text("mine")
    (folder.parent / "had notes").touch()


def fill(k):
    size = FULL + 60_000 * k
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def together(folder):
    """Let processes write, each its result again and again; halt them now and then to look."""

    def work(load):
        while True:
            write(folder, load)

    write(folder, LOADS[0])
    numbers = [child(lambda load=load: work(load)) for load in LOADS]
    for k in range(LOOKS):
        time.sleep(0.03 + 0.01 * k / LOOKS)
        for number in numbers:
            os.kill(number, signal.SIGSTOP)
            os.waitpid(number, os.WUNTRACED)  # or it has ended, which sends what follows into error
        tell(k, state(folder), 0)
        for number in numbers:
            os.kill(number, signal.SIGCONT)
    for number in numbers:
        os.kill(number, signal.SIGKILL)
    tell(LOOKS, state(folder), max(map(end, numbers)))


def trial(folder, how, way="exchange"):
    """Try one way, in this process."""
    if way == "renames":
        exchange.exchange = exchange.rename_both
    if way == "one-by-one":
        result_folder.can_move = lambda _: False
    if how == "together":
        together(folder)
        return
    spoils = {"kill": lambda k: fail_at(k, die), "stop": lambda k: fail_at(k, stop), "full": fill}
    tries(folder, spoils[how])


def apart(place, name):
    """Try one way in a process of its own; return how that ended."""

    def work():
        for number, kind in ((1, "out"), (2, "err")):
            os.dup2(os.open(place / f"{name}.{kind}", os.O_WRONLY | os.O_CREAT), number)
        trial(place / name / "walk", *name.split())

    (place / name).mkdir()
    return end(child(work))


def main(place, *names):
    for load in LOADS:
        content(load)
    for name in names:
        if code := apart(Path(place), name):
            sys.exit(f"{name} ended with {code}")


if __name__ == "__main__":
    main(*sys.argv[1:])
