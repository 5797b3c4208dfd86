"""What each acceleration of learning and judging is worth: `python benchmarks/accelerations.py [--rounds 3]`.

A training runs as it is and with one acceleration off, by turns, each in a process of its own; what is compared is the
seconds of an iteration that the acceleration is for, the first iteration, which may compile, left out. An acceleration
stays where it is worth a tenth of what somebody waits for. Run it when nothing else runs: about a quarter of an hour.
Leaves `accelerations.md` and `accelerations.json` in the folder of `--out`.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.formats.atomic import write_atomic
from run_all import machine

HERE = Path(__file__).resolve().parent
UNJUDGED = "--set", "evaluation.every=100"
AWS = "train", "--preset", "aws", "--stop", "iterations=3", *UNJUDGED
CARS = "train", "--preset", "race", "--stop", "iterations=12", *UNJUDGED
JUDGED = "train", "--preset", "fast", "--stop", "iterations=12", "--set", "evaluation.every=1"
CARTPOLE = "gym", "train", "CartPole-v1", "--stop", "iterations=30", *UNJUDGED
LEARN = ("seconds_learn",)
WORK = "seconds_collect", *LEARN
ALL = *WORK, "seconds_judge"
SPIN_LONG = "import os; os.environ['GOMP_SPINCOUNT'] = '300000'"  # libgomp's own


@dataclass(frozen=True)
class Acceleration:
    """One thing that is done for speed alone."""

    name: str
    where: str
    """Its module, below racecraft."""
    case: str
    """What somebody waits for."""
    command: tuple[str, ...]
    counted: tuple[str, ...]
    """Columns of metrics.jsonl that are summed, s."""
    off: str = ""
    """Python that switches it off before the command begins."""
    option: tuple[str, ...] = ()
    """What switches it off, where it is a setting."""
    busy: int = 0
    """Programs beside it that never rest."""


ACCELERATIONS = (
    Acceleration("half precision", "algorithms/half_precision.py", "preset aws: learning", AWS, LEARN,
                 option=("--set", "ppo.precision=float32")),
    Acceleration("policy and critic in a thread each", "algorithms/parallel_updates.py", "preset aws: learning",
                 AWS, LEARN, "import racecraft.algorithms.ppo_steps as m; m.WORTH_A_THREAD = 1 << 62"),
    Acceleration("frames in tiles", "algorithms/convolution.py", "preset aws: learning",
                 AWS, LEARN, "import racecraft.algorithms.convolution as m; m.FEW_CHANNELS = 0"),
    Acceleration("gradient written out", "algorithms/closed_form.py", "CartPole: collecting, learning",
                 CARTPOLE, WORK, "import racecraft.algorithms.ppo_steps as m; m.closed_form_of = lambda *given: None"),
    Acceleration("threads that wait sleep soon", "__init__.py", "default car: collecting, learning",
                 CARS, WORK, SPIN_LONG),
    Acceleration("threads that wait sleep soon", "__init__.py", "default car beside three busy programs",
                 CARS, WORK, SPIN_LONG, busy=3),
    Acceleration("laps judged in compiled code", "algorithms/compiled_policy.py", "fast car judged each time: all",
                 JUDGED, ALL, "import racecraft.algorithms.compiled_policy as m; m.compile_policy = lambda *_: None"),
)  # fmt: skip

READING = """
Two rounds tell a half from nothing, not a tenth from nothing. Half precision, the written-out gradient and compiled
judging clearly stay, threads probably. That waiting threads sleep soon costs a tenth while nothing else runs, and is
worth two and a half times where other programs do. Tiles gained nothing on this processor; on a Xeon they were worth a
quarter. Rows were measured on two evenings. Freed memory that was kept and one thread for small work gained nothing
and are gone ([car-learning.md](car-learning.md)). Compiled judging was measured in one round.
"""


def main() -> None:
    """Measure every acceleration by turns and write the table after each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", default="", help="those whose name holds this")
    parser.add_argument("--out", type=Path, default=HERE)
    options = parser.parse_args()
    rows = []
    for one in (one for one in ACCELERATIONS if options.only in one.name):
        turns = [(seconds(one, False, seed), seconds(one, True, seed)) for seed in range(1, options.rounds + 1)]
        rows.append({"name": one.name, "where": one.where, "case": one.case, "on_off_seconds": turns})
        print(row_of(rows[-1]), flush=True)
        write_atomic(options.out / "accelerations.json", json.dumps(rows, indent=1) + "\n")
        write_atomic(options.out / "accelerations.md", page(rows, options.rounds))


def seconds(one: Acceleration, is_off: bool, seed: int) -> float:
    """Train; return the mean of the counted seconds of an iteration, the first one left out."""
    words = [*one.command, "--seed", str(seed), "--run", "run", "--no-pictures", *(one.option if is_off else ())]
    begin = f"import sys\nfrom racecraft.cli.entry import main\nsys.argv[1:] = {words!r}\nmain()"
    environment = {**os.environ, "PYTHONPATH": str(HERE.parent / "src")}
    with tempfile.TemporaryDirectory() as folder:
        code = f"{one.off}\n{begin}" if is_off else begin
        with busy_programs(one.busy):
            done = subprocess.run(
                [sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, text=True
            )
        metrics = Path(folder) / "run" / "metrics.jsonl"
        if not metrics.exists():
            raise SystemExit(f"{one.name}: nothing was trained:\n{done.stderr}")
        _, *rows = map(json.loads, metrics.read_text(encoding="utf-8").splitlines())
    return statistics.mean(sum(row[name] for name in one.counted) for row in rows)


@contextmanager
def busy_programs(count: int) -> Iterator[None]:
    """So many run beside."""
    programs = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for program in programs:
            program.kill()
            program.wait()


def row_of(row: dict[str, Any]) -> str:
    """Return a measured acceleration as a row of the table."""
    turns = row["on_off_seconds"]
    on, off = (1000 * statistics.median(column) for column in zip(*turns, strict=True))
    ratios = sorted(off / on for on, off in turns)
    spread = f"{statistics.median(ratios):.2f} ({ratios[0]:.2f} – {ratios[-1]:.2f})"
    return f"| {row['name']} | `{row['where']}` | {row['case']} | {on:,.0f} | {off:,.0f} | {spread} |"


def page(rows: list[dict[str, Any]], rounds: int) -> str:
    """Return the table as a page."""
    return (
        (
            "# What each acceleration is worth\n\n"
            "`python benchmarks/accelerations.py`: a training with an acceleration and without it, a process each, "
            f"{rounds} rounds by turns; milliseconds of an iteration, the first one left out. Medians; in brackets the "
            f"smallest and the largest ratio. {machine()}.\n\n"
            "| acceleration | module | what is waited for | with it, ms | without it, ms | ratio |\n"
            "|---|---|---|---|---|---|\n"
        )
        + "".join(f"{row_of(row)}\n" for row in rows)
        + READING
    )


if __name__ == "__main__":
    main()
