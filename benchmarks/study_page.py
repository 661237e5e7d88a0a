"""How long the page of a very large study takes, how large it is, and how much memory it needs.

    python benchmarks/study_page.py [ROWS]

Writes a synthetic study of 100,000 walks, or of ROWS, into a temporary folder, with the files of
those walks that move in the page, and makes its page in a process of its own. Ends with 1 if that
takes 10 s, 15 MB or 2 GB, or more.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console

import human_gait as hg
from human_gait.findings.rows import read_rows
from human_gait.findings.walkers import chosen

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))

from synthetic_study import write_study, write_walk

SECONDS, BYTES, MEMORY = 10.0, 15e6, 2e9
OUTPUTS = 90  # that mean nothing, beside some that do: as many numbers as a real index has


def written(folder: Path, n: int) -> None:
    """Write a study of n walks, with the files of those that will move."""
    write_study(folder, "many", n, walks=False, further=OUTPUTS)
    study = hg.open_study(folder)
    rows = read_rows(study)
    settings = [*rows.causes]
    table = study.table(settings).to_pylist()
    for row in chosen(rows, [one.name for one in rows.outputs]):
        write_walk(folder, rows.keys[row], table[row])


def main(n: int) -> int:
    """Measure, tell, and return the exit code."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "many"
        written(folder, n)
        began = time.perf_counter()
        command = [sys.executable, "-m", "human_gait", "study-report", str(folder)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        seconds = time.perf_counter() - began
        size = (folder / "report.html").stat().st_size
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    memory = 1024 * used.ru_maxrss
    Console().print(
        f"{n} walks: {seconds:.1f} s ({used.ru_utime + used.ru_stime:.1f} s of processor), "
        f"{size / 1e6:.1f} MB, {memory / 1e9:.2f} GB of memory"
    )
    return int(seconds >= SECONDS or size >= BYTES or memory >= MEMORY)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000))
