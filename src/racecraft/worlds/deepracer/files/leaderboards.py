"""Leaderboards of AWS's races as their public archive keeps them: one list of races, a folder of tables each.

Begin with `read_leaderboards`. Nothing of them is shipped; the folder is the user's own copy, laid out so (facts B9)::

    leaderboards.csv                  a row a race: Arn, Name, LaunchTime (ms since 1970), TrackArn, TimingMethod, …
    <Arn>/FINAL.csv                   its last state, a row a racer: Alias, Rank, RankingScore and lap times in ms, …
    <Arn>/<time>.csv                  states before, by the hour

Columns came and went over the years, so those that are not `REQUIRED` may be absent. Times are seconds here.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message

INDEX, FINAL = "leaderboards.csv", "FINAL.csv"
EXPECTED = "a copy of the archive's raw_data/leaderboards: leaderboards.csv, and a folder with FINAL.csv for each race"
REQUIRED = ("Arn", "Name", "LaunchTime", "TrackArn", "RaceType", "TimingMethod")
"""Columns of the list of races."""
TOTAL, AVERAGE, BEST = "TOTAL_TIME", "AVG_LAP_TIME", "BEST_LAP_TIME"
TIMINGS = {TOTAL: "total", AVERAGE: "mean lap", BEST: "best lap"}
"""What races were decided by, and what it is called."""
WITHOUT_ROUTE = {
    "Canada_Race": "Canada_Training", "ChinaAlt_track": "China_track", "MexicoAlt_track": "Mexico_track",
    "New_YorkAlt_Track": "New_York_Track", "Tokyo_Racing_track": "Tokyo_Training_track",
    "Virtual_Competition_1": "reinvent_base", "Virtual_May19_Comp_track": "Virtual_May19_Train_track",
}  # fmt: skip
"""Tracks of the races of 2019 of which no public route file was found → the circuit on which racers prepared for them.
It is taken for another one: what can be told of Canada_Race is some 18 m, of Canada_Training 21.7 m."""
UNFINISHED_MS = 1e12
"""Scores beyond it (the archive has some near 2^63) are of racers who never finished."""


class LeaderboardError(InputFileError):
    """An archive of leaderboards, or a table in it, cannot be read."""


@dataclass(frozen=True)
class Entry:
    """One racer's place."""

    rank: int
    alias: str
    score_seconds: float
    """What decided: by the race's `timing` a total, a mean lap or a best lap, s."""
    best_lap_seconds: float | None
    """None where the archive does not tell it."""
    laps: int | None
    submissions: int | None
    resets: float | None
    """A lap, in the mean."""


@dataclass(frozen=True)
class Leaderboard:
    """One race."""

    arn: str
    name: str
    launched: datetime
    """UTC."""
    track: str
    """As AWS calls it, which is mostly its name in our catalogue too."""
    race_type: str
    """TIME_TRIAL, OBJECT_AVOIDANCE or HEAD_TO_HEAD_RACING."""
    timing: str
    """One of TIMINGS."""
    laps: int
    """In a row, that are timed."""
    division: str
    """OPEN or PRO; "" where there was none."""
    table: Path | None
    """Its last state; None where the copy has none."""

    def entries(self) -> list[Entry]:
        """Return the racers who finished, by rank.

        Raises:
            LeaderboardError: The table is damaged; the message names its line.
        """
        if self.table is None:
            return []
        found = (_entry(self.table, line, row) for line, row in _rows(self.table, ("Rank",)))
        return sorted((one for one in found if one is not None), key=lambda one: one.rank)


def read_leaderboards(folder: str | Path) -> list[Leaderboard]:
    """Return the races of a copy of the archive, the oldest first.

    Args:
        folder: The copy, or the folder in it that holds `leaderboards.csv`.

    Raises:
        LeaderboardError: There is none, or the list of races is damaged.
    """
    top = Path(folder)
    index = next((place / INDEX for place in (top, top / "raw_data" / "leaderboards", top / "leaderboards")
                  if (place / INDEX).is_file()), None)  # fmt: skip
    if index is None:
        found = "there is no such folder" if not top.is_dir() else Message("holds no {index}", index=INDEX)
        raise LeaderboardError(top, found, EXPECTED)
    boards = [_board(index, line, row) for line, row in _rows(index, REQUIRED)]
    if not boards:
        raise LeaderboardError(index, "names no race", "a row a race")
    return sorted(boards, key=lambda board: board.launched)


def _rows(path: Path, required: tuple[str, ...]) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield (line, cells by column) of a table; one with no more than its head yields nothing."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            table = csv.DictReader(file, strict=True)
            missing = [name for name in required if name not in (table.fieldnames or ())]
            if missing:
                raise LeaderboardError(
                    path,
                    Message("has no column {missing}", missing=", ".join(missing)),
                    Message("the columns {required}", required=", ".join(required)),
                )
            for row in table:
                if None in row or None in row.values():
                    raise LeaderboardError(path, "more or fewer cells than columns", "a whole row", line=table.line_num)
                yield table.line_num, row
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise LeaderboardError(
            path, Message("cannot be read ({error})", error=error), "a table of comma-separated values"
        ) from error


def _board(index: Path, line: int, row: dict[str, str]) -> Leaderboard:
    launched = _number(index, line, row, "LaunchTime")
    if launched is None:
        raise LeaderboardError(index, "LaunchTime is empty", "milliseconds since 1970", line=line)
    timing = row["TimingMethod"]
    if timing not in TIMINGS:
        raise LeaderboardError(
            index,
            Message("TimingMethod is '{timing}'", timing=timing),
            Message("one of {timings}", timings=", ".join(TIMINGS)),
            line=line,
        )
    try:
        opened = datetime.fromtimestamp(launched / 1000.0, UTC)
    except (OverflowError, OSError, ValueError):
        raise LeaderboardError(
            index, Message("LaunchTime is {launched:g}", launched=launched), "milliseconds since 1970", line=line
        ) from None
    laps = _number(index, line, row, "MinimumLaps")
    return Leaderboard(
        arn=row["Arn"],
        name=row["Name"].strip(),
        launched=opened,
        track=row["TrackArn"].rpartition("track/")[2],
        race_type=row["RaceType"],
        timing=timing,
        laps=1 if timing == BEST or not laps else int(laps),
        division=row.get("RacingDivision", ""),
        table=_table(index.parent / row["Arn"]),
    )


def _table(folder: Path) -> Path | None:
    """Return a race's last state."""
    if (folder / FINAL).is_file():
        return folder / FINAL
    states = sorted(folder.glob("*.csv"))  # their names are times, year first
    return states[-1] if states else None


def _entry(path: Path, line: int, row: dict[str, str]) -> Entry | None:
    """Return a racer's place; None for one who never finished."""
    rank, score = (_number(path, line, row, name) for name in ("Rank", "RankingScore"))
    if score is None:
        score = _number(path, line, row, "AvgLapTime")
    if rank is None or not score or score > UNFINISHED_MS:
        return None
    best, laps, sent, resets = (
        _number(path, line, row, name) for name in ("BestLapTime", "LapCount", "SubmissionCount", "AvgResets")
    )
    return Entry(
        rank=int(rank),
        alias=row.get("Alias", ""),
        score_seconds=score / 1000.0,
        best_lap_seconds=best / 1000.0 if best else None,
        laps=None if laps is None else int(laps),
        submissions=None if sent is None else int(sent),
        resets=resets,
    )


def _number(path: Path, line: int, row: dict[str, str], name: str) -> float | None:
    """Return a cell as a number; None where it is empty or the column absent."""
    text = row.get(name, "").strip()
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not 0.0 <= value < math.inf:
        raise LeaderboardError(
            path, Message("{name} is '{text}'", name=name, text=text), "a number, 0 or more", line=line
        )
    return value
