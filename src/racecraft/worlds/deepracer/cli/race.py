"""`racecraft race`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from racecraft.cli.from_request import command
from racecraft.cli.output import print_files, table
from racecraft.worlds.deepracer.actions.race import Raced
from racecraft.worlds.deepracer.actions.race import race as action

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.evaluation.head_to_head import RaceResult


def print_standings(result: RaceResult) -> None:
    """Print a row a driver, the one with the best mean place first."""
    rows = []
    for one in sorted(result.as_dictionary()["drivers"], key=lambda facts: facts["mean_place"]):
        seconds = "-" if one["mean_seconds"] is None else f"{one['mean_seconds']:.2f}"
        counts = (str(one[name]) for name in ("overtakes", "crashes", "was_hit", "off_tracks"))
        finishes = f"{one['finishes']}/{one['races']}"
        rows.append((one["driver"], str(one["wins"]), f"{one['mean_place']:.2f}", finishes, seconds, *counts))
    titles = ("car", "wins", "mean place", "finishes", "mean seconds", "overtakes", "crashes", "was hit", "off track")
    table(titles, rows, left=("car",))


def _show(raced: Raced) -> None:
    result = raced.result
    over = f"over {raced.laps} laps" if raced.track.closed else "from start to finish"
    print(f"{len(result.races)} races {over} on {raced.track.title or raced.track.name}:")
    print_standings(result)
    print(f"{result.overtakes_per_race:.2f} overtakes a race")
    for sentence in raced.limits:
        print(sentence)
    print_files(raced.files)


race = command(action, _show)
