"""`racecraft leaderboards`."""

from __future__ import annotations

from racecraft.actions.figures import Figures
from racecraft.cli.from_request import command
from racecraft.cli.output import table
from racecraft.worlds.deepracer.actions.leaderboards import leaderboards as action

MAX_ROWS = 25


def _show(facts: Figures) -> None:
    races, laps, lines = facts["races"], facts.get("laps"), []
    for row in races if laps is not None else races[-MAX_ROWS:]:
        timed = row["timing"] if row["laps"] == 1 else f"{row['timing']} of {row['laps']} laps"
        cells = [row["date"], row["name"], row["track"], row["type"].lower().replace("_", " "), timed,
                 str(row["racers"]), row["winner"] or "–", _seconds(row["winner_seconds"])]  # fmt: skip
        if laps is not None:
            cells += [_seconds(row["own_seconds"]), "–" if row["own_rank"] is None else str(row["own_rank"])]
        lines.append(cells)
    own = () if laps is None else ("you, s", "place")
    titles = ("launched", "race", "track", "type", "timed by", "racers", "winner", "s", *own)
    table(titles, lines, left=("launched", "race", "track", "type", "timed by", "winner"))
    if laps is None and len(races) > MAX_ROWS:
        print(f"The latest {MAX_ROWS} of {len(races)} races; --track NAME shows all on one track, --json all of them.")
    if laps is not None:
        print(
            f"{laps['full_laps']} of {len(laps['laps'])} laps were driven to the end; a race over several wants so "
            f"many in a row, and one of another kind gives no place. {facts['note']}"
        )


def _seconds(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


leaderboards = command(action, _show)
