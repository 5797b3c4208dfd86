"""How soon the default car laps on 16 tracks, spread over length and curvature: `python benchmarks/first_laps.py`.

The catalogue's loops, one of each place, fall into four groups by length, and each group's four tracks stand at even
ranks of curvature in it, so that nothing is chosen by how it comes out. Each is trained by `train` with the preset
`race` in one thread, judging and files included, until it laps: two evaluations in a row in which all 20 judged starts
bring a full lap. A track that does not lap within the preset's budget is trained anew with four times as much. Leaves
`first-laps.md` and `first-laps.json` in the folder of `--out`; tracks that are in the latter are not trained again.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from many_tracks import distinct_loops
from racecraft.formats.atomic import write_atomic
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.tracks.track import Track
from racecraft.worlds.deepracer.training.plan import RaceRequest
from racecraft.worlds.deepracer.training.presets import RACE_STEPS
from racing import Curve
from run_all import machine

GROUPS = RANKS = 4
MORE = 4
"""The second try's budget, in budgets of the preset."""


def main() -> None:
    """Train on every track that has no row yet; write the page after each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    parser.add_argument("--count", type=int, default=GROUPS * RANKS, help="train on so many tracks, then stop")
    options = parser.parse_args()
    file = options.out / "first-laps.json"
    rows = json.loads(file.read_text()) if file.exists() else []
    done = {row["track"] for row in rows if row["seed"] == options.seed}
    for track in [track for track in spread_tracks() if track.name not in done][: options.count]:
        rows.append(first_laps(track, options.seed))
        print(rows[-1], flush=True)
        write_atomic(file, json.dumps(rows, indent=1) + "\n")
        write_atomic(options.out / "first-laps.md", page(rows))


def spread_tracks() -> list[Track]:
    """Return GROUPS × RANKS tracks: in each group by length those at even ranks of curvature."""
    by_length = sorted(distinct_loops(), key=lambda track: track.length)
    groups = [sorted(by_length[rows[0] : rows[-1] + 1], key=curvature)
              for rows in np.array_split(np.arange(len(by_length)), GROUPS)]  # fmt: skip
    return [group[int((rank + 0.5) / RANKS * len(group))] for group in groups for rank in range(RANKS)]


def curvature(track: Track) -> float:
    """Return how much a track turns a metre on average, rad."""
    steps = np.diff(track.centre, axis=0)
    turns = np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))
    return float(np.abs(turns).sum() / track.length)


def first_laps(track: Track, seed: int) -> dict[str, Any]:
    """Train on a track until it laps; return what it took of how many steps."""
    row = {"track": track.name, "length_m": round(track.length, 1), "turns_degrees_per_m": round(
        float(np.degrees(curvature(track))), 1), "seed": seed, "machine": machine(), "tries": []}  # fmt: skip
    for budget in (RACE_STEPS, MORE * RACE_STEPS):
        curve = Curve()
        with tempfile.TemporaryDirectory() as folder:
            request = RaceRequest(
                run=Path(folder) / "run", preset="race", seed=seed, stops=("laps", f"steps={budget}"),
                overrides=("runtime.threads=1",), track=track.name,
            )  # fmt: skip
            train(request, curve, lambda text: None)
        row["tries"].append({"budget": budget, "stable": curve.stable, "last": curve.rows[-1]})
        if curve.stable is not None:
            break
    return row


def page(rows: list[dict[str, Any]]) -> str:
    """Return the rows as a page."""
    lapped = [row for row in rows if row["tries"][-1]["stable"]]
    soon = sum(len(row["tries"]) == 1 for row in lapped)
    lines = [
        "# How soon the default car laps",
        "",
        "`python benchmarks/first_laps.py`: the default car (`v6` to 2.5 m/s, preset `race`) on 16 tracks spread over "
        "length and curvature, one thread, beside other work, so cost is **CPU seconds of the process**, judging and "
        "files included, compilation left out. Stable: two evaluations in a row in which all 20 judged starts bring a "
        f"full lap. {'; '.join(sorted({row['machine'] for row in rows}))}.",
        "",
        f"**{len(lapped)} of the {len(rows)} tracks trained on so far lap**, {soon} of them within the preset's "
        f"{RACE_STEPS:,} steps.",
        "",
        "| track | length | turns a metre | seed | stable after, CPU s of each try | last try's steps | of |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        *before, last = row["tries"]
        spent = "".join(f"{one['last']['cpu_seconds']:.1f} + " for one in before)
        took = last["stable"] or {
            "cpu_seconds": f"not in {last['last']['cpu_seconds']:g}",
            "steps": last["last"]["steps"],
        }
        lines.append(
            f"| {row['track']} | {row['length_m']} m | {row['turns_degrees_per_m']}° | {row['seed']} | "
            f"{spent}{took['cpu_seconds']} | {took['steps']:,} | {last['budget']:,} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
