"""What `--watch` costs a whole training: `python benchmarks/watch_training.py [--rounds 5] [--iterations 80]`.

The same default training (same seed, so the same ticks to the bit) is run again and again as the command, with
`--watch` and without in turns; while it is watched, somebody asks the page for its live ticks and its curves as a
browser does. Told are the wall seconds between its first tick and its last iteration, which count what the page's own
process takes away, and the processor seconds of the whole command, the page in them. Medians over the rounds, of a
machine that does nothing else: on a busy one the wall's spread is wider than what is measured.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path

LIVE_SECONDS, CURVES_SECONDS = 0.25, 1.0
"""How often the page asks for live ticks, and for the rest."""


def trained(run: Path, iterations: int, watch: bool) -> tuple[float, float]:
    """Train; return the wall seconds of the loop and the processor seconds of the command."""
    command = [sys.executable, "-m", "racecraft", "train", "--run", str(run), "--stop", f"iterations={iterations}"]
    command += ["--no-pictures", "--json", *(["--watch"] if watch else [])]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    over = threading.Event()
    reader = threading.Thread(target=look_on, args=(process, over))
    reader.start()
    _, status, usage = os.wait4(process.pid, 0)
    over.set()
    reader.join()
    if status:
        raise SystemExit(f"{' '.join(command)}: ended with status {status}")
    last = (run / "metrics.jsonl").read_text(encoding="utf-8").splitlines()[-1]
    return float(json.loads(last)["seconds"]), usage.ru_utime + usage.ru_stime


def look_on(process: subprocess.Popen[str], over: threading.Event) -> None:
    """Read what the command says; once it names a page, ask that page until the command is over."""
    assert process.stderr is not None
    for line in process.stderr:
        if found := re.search(r"watch: (http://\S+/)", line):
            threading.Thread(target=ask, args=(found[1], over), daemon=True).start()


def ask(page: str, over: threading.Event) -> None:
    """Ask as a browser that shows live cars."""
    after, curves_at = 0, 0.0
    while not over.wait(LIVE_SECONDS):
        try:
            with urllib.request.urlopen(f"{page}api/live?after={after}", timeout=10) as answer:
                after = (json.load(answer).get("reel") or {}).get("last", after)
            if time.monotonic() >= curves_at:
                curves_at = time.monotonic() + CURVES_SECONDS
                for what in ("api/run", "api/curves?after=0", "api/iterations"):
                    urllib.request.urlopen(f"{page}{what}", timeout=10).read()
        except (urllib.error.URLError, OSError, ValueError):
            continue  # the page is not there yet, or no longer


def main() -> None:
    words = argparse.ArgumentParser()
    words.add_argument("--rounds", type=int, default=5)
    words.add_argument("--iterations", type=int, default=80)
    asked = words.parse_args()
    spent: dict[bool, list[tuple[float, float]]] = {False: [], True: []}
    with tempfile.TemporaryDirectory() as folder:
        trained(Path(folder) / "warm", 2, watch=False)
        for number in range(asked.rounds):
            for watch in (False, True):
                spent[watch].append(trained(Path(folder) / f"{number}-{watch}", asked.iterations, watch))
    for place, what in enumerate(("wall seconds of the loop", "processor seconds of the command")):
        plain, seen = (statistics.median(one[place] for one in spent[watch]) for watch in (False, True))
        print(f"{what}: {plain:.2f} unwatched, {seen:.2f} watched, {100 * (seen / plain - 1):+.1f} %")


if __name__ == "__main__":
    main()
