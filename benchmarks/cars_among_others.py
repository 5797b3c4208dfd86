"""Whether cars learn to drive among others, and how soon: `python benchmarks/cars_among_others.py [--seeds 3]`.

The three folders of examples/ are trained by the command, one after another, a run a seed: six boxes and three bots
until five laps of five are driven without a touch twice in a row, two cars against their past selves for ten minutes.
Told are the seconds until that was reached, and of the two cars how often the last self overtakes itself at half its
pace, in races of two laps. On a machine that does nothing else: seconds are of the wall.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def trained(name: str, seed: int, folder: Path, stops: list[str]) -> dict[str, Any]:
    """Train an example; return what the command tells."""
    command = [sys.executable, "-m", "racecraft", "train", str(EXAMPLES / name), "--seed", str(seed), "--json"]
    command += ["--run", str(folder / f"{name}-{seed}"), "--no-pictures", *(f"--stop={stop}" for stop in stops)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=True)
    told: dict[str, Any] = json.loads(done.stdout)
    return told


def main() -> None:
    words = argparse.ArgumentParser()
    words.add_argument("--seeds", type=int, default=3)
    words.add_argument("--minutes", type=float, default=15.0)
    asked = words.parse_args()
    with tempfile.TemporaryDirectory() as place:
        for name in ("six_boxes", "three_bots"):
            for seed in range(1, asked.seeds + 1):
                told = trained(name, seed, Path(place), ["laps", f"minutes={asked.minutes:g}"])
                seconds = told["seconds_to_stable_laps"]
                reached = "not reached" if seconds is None else f"{seconds:.1f} s"
                print(f"{name}, seed {seed}: five laps of five twice in a row: {reached}", flush=True)
        for seed in range(1, asked.seeds + 1):
            races = trained("overtaking", seed, Path(place), ["minutes=10"])["races"]
            passing, gain = races["against_a_slower_self"], races["last_over_first"]["points"]
            print(
                f"overtaking, seed {seed}: {passing['overtakes_per_race']:.2f} overtakes a race of itself at "
                f"{passing['pace']:.0%} of its pace, {passing['wins']} of {passing['races']} won, "
                f"{passing['crashes']} crashes; {gain:+.0f} Elo over the first self",
                flush=True,
            )


if __name__ == "__main__":
    main()
