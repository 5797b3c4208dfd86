"""AWS's historic boards beside a race on the same track. Begin with `history`.

Rank and times alone: the archive's licence says nothing of its racers' names. Its cars drove in another simulator.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from racecraft.league.race import Race
from racecraft.worlds.deepracer.evaluation.history import placed
from racecraft.worlds.deepracer.evaluation.laps import Lap, LapReport
from racecraft.worlds.deepracer.files.leaderboards import TIMINGS, read_leaderboards
from racecraft.worlds.deepracer.tracks.catalogue import known_name


def history(race: Race, laps: Sequence[float | None], archive: Path) -> list[dict[str, Any]]:
    """Return AWS's races on a race's first track, the oldest first, and where laps would stand in each.

    Args:
        race: The race.
        laps: Of its leader, s; None: not completed.
        archive: The user's copy of AWS's leaderboards.

    Raises:
        LeaderboardError: There is none, or a table is damaged.
    """
    report = LapReport(
        tuple(Lap(0.0, 100.0 if lap else 0.0, lap, "lap_complete" if lap else "off_track", 0) for lap in laps)
    )
    rows = []
    for board in read_leaderboards(archive):
        if (known_name(board.track) or board.track).casefold() != race.tracks[0].casefold():
            continue
        place, entries = placed(report, board, str(race.rules["type"])), board.entries()
        rows.append({
            "date": board.launched.date().isoformat(), "race": board.name, "type": board.race_type,
            "timing": TIMINGS[board.timing], "laps": board.laps, "racers": len(entries),
            "winner_seconds": entries[0].score_seconds if entries else None,
            "own_seconds": place.own_seconds if place else None, "own_rank": place.rank if place else None,
        })  # fmt: skip
    return rows
