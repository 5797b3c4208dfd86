"""One model over 20 tracks, judged on 10 that it never saw: `python benchmarks/many_tracks.py`. 20 minutes, two cores.

Of the catalogue's places (a road driven the other way round, lengthened or otherwise painted is of the same) 30 are
drawn by chance: 10 are held out, 20 trained on, four cars each, with the default car, reward and preset. Lapped is a
track whose every lap is full, one from each of five starts. Leaves `many-tracks.md` and `many-tracks.json` in the
folder it is told.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import random
import re
import sys
import tempfile
from pathlib import Path

from racecraft.formats.atomic import write_atomic
from racecraft.training.progress import LineWatcher
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.files.generalisation import ROLES, read_generalisation
from racecraft.worlds.deepracer.tracks.catalogue import load_track, names
from racecraft.worlds.deepracer.tracks.track import Track
from racecraft.worlds.deepracer.training.hold_out import are_alike
from racecraft.worlds.deepracer.training.plan import RaceRequest

TRAINED, HELD_OUT = 20, 10
OPEN = "Straight_track"
"""The one circuit that is no loop."""


def main() -> None:
    """Train, judge and write down what came of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--seed", type=int, default=1, help="of the draw of tracks, and of the training")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    parser.add_argument("--note", default="nothing else ran", help="what else the machine did meanwhile")
    options = parser.parse_args()
    held_out, trained = drawn_tracks(options.seed)
    with tempfile.TemporaryDirectory() as folder:
        request = RaceRequest(
            tracks=tuple(trained),
            hold_out=tuple(held_out),
            stops=(f"minutes={options.minutes:g}",),
            run=Path(folder) / "run",
            seed=options.seed,
        )
        done = train(request, LineWatcher(sys.stdout))
        told = read_generalisation(done.run.generalisation)
        rows = [row for row in done.run.read_metrics() if row.get("held_out_tracks_lapped") is not None]
    assert told is not None
    result = {
        "seed": options.seed,
        "seconds": round(done.outcome.seconds, 1),
        "steps": done.outcome.steps,
        "machine": f"{os.cpu_count()} cores, {platform.machine()}; {options.note}",
        "curve": [{name: row[name] for name in CURVE} for row in rows],
        "tracks": [one.as_dictionary() for one in told[1]],
    }
    write_atomic(options.out / "many-tracks.json", json.dumps(result, indent=1) + "\n")
    write_atomic(options.out / "many-tracks.md", page(result))


def drawn_tracks(seed: int) -> tuple[list[str], list[str]]:
    """Return the names held out and those trained on: of each place (open and pro share one) and each road one."""
    drawn = random.Random(seed).sample([track.name for track in distinct_loops()], HELD_OUT + TRAINED)
    return sorted(drawn[:HELD_OUT]), sorted(drawn[HELD_OUT:])


def distinct_loops() -> list[Track]:
    """Return the catalogue's loops, one of each place and of each road."""
    roads: dict[str, Track] = {}
    for name in names():
        place, track = re.sub(r"_(open|pro)(_c?cw)?$", "", name), load_track(name)
        if name != OPEN and place not in roads and not any(are_alike(track, other) for other in roads.values()):
            roads[place] = track
    return list(roads.values())


CURVE = ("iteration", "seconds", "steps", "trained_tracks_lapped", "trained_progress", "held_out_tracks_lapped",
         "held_out_progress")  # fmt: skip


def page(result: dict) -> str:
    """Return the figures as a page."""
    last = result["curve"][-1]
    lines = [
        "# One model over 20 tracks",
        "",
        f"`python benchmarks/many_tracks.py`, seed {result['seed']}: {result['seconds']:.0f} s of training, "
        f"{result['steps']:,} steps, {result['machine']}.",
        "",
        f"**{last['held_out_tracks_lapped']:.0%} of the held-out tracks are lapped from every start** after "
        f"{last['seconds']:.0f} s; of the trained ones {last['trained_tracks_lapped']:.0%}.",
        "",
        "| seconds | steps | trained: lapped | progress | held out: lapped | progress |",
        "|---|---|---|---|---|---|",
    ]
    for row in result["curve"]:
        trained, held_out = (f"{row[f'{r}_tracks_lapped']:.0%} | {row[f'{r}_progress']:.1f} %" for r in ROLES[:2])
        lines.append(f"| {row['seconds']:.0f} | {row['steps']:,} | {trained} | {held_out} |")
    lines += ["", "| track | | full laps | mean progress | best lap |", "|---|---|---|---|---|"]
    for one in sorted(result["tracks"], key=lambda one: (one["role"], one["label"])):
        best = f"{one['best_lap_seconds']:.2f} s" if one["best_lap_seconds"] else "–"
        lines.append(
            f"| {one['label']} | {one['role'].replace('_', ' ')} | {one['full_laps']} of {one['laps']} | "
            f"{one['mean_progress_percent']:.1f} % | {best} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
