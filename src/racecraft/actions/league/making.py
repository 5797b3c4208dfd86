"""What every new race has, whatever its world. A world's own action adds its rules; see `make_race`."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from racecraft.contract.errors import SettingError
from racecraft.league.race import AVERAGE, BEST, FORMATS, MAX_WINDOW, RANKINGS, SOLO, STAGES, TOTAL, Race
from racecraft.settings.request import Request, option


@dataclass(frozen=True, kw_only=True)
class DeadlineOptions(Request):
    """Who may enter, and until when."""

    PANEL: ClassVar[str] = "Entries"
    opens: str | None = option(None, "Entries are accepted from then on: 2026-12-01T18:00, or +2h.")
    closes: str | None = option(
        None, "Entries are accepted until then: 2026-12-01T18:00, or +3h; by default without end."
    )
    submissions: int | None = option(None, "Entries of one racer; by default any number.", low=1)
    practice: bool = option(False, "A practice race: always open, in no season.")
    season: str | None = option(None, "The season that its points count for.")
    stage: str | None = option(None, "qualifier or final.", choices=STAGES)
    qualifier: str | None = option(None, "Race whose first racers alone may enter.")
    qualified: int = option(8, "How many of them.", low=1)


@dataclass(frozen=True, kw_only=True)
class RankingOptions(Request):
    """What decides the race."""

    PANEL: ClassVar[str] = "Ranking"
    ranking: str = option(
        BEST, "Best lap, average or total of consecutive laps, or most laps in a time.", choices=RANKINGS
    )
    window: int | None = option(
        None, "Consecutive laps that average and total count; by default all of a drive.", low=1, high=MAX_WINDOW
    )
    format: str = option(SOLO, "Each drives alone, or they meet: round_robin, bracket, ladder.", choices=FORMATS)
    meetings: int = option(10, "Heats of a ladder for each racer, on average.", low=1)


def make_race(
    folder: Path,
    title: str,
    kind: str,
    tracks: Sequence[str],
    laps: int,
    rules: Mapping[str, Any],
    ranking: RankingOptions,
    deadline: DeadlineOptions,
    grid: int = 2,
    own_tracks: Mapping[str, bytes] | None = None,
) -> Race:
    """Add a race to a league, which is made where there is none; return it.

    Args:
        folder: The league's.
        title: For people.
        kind: Of its world.
        tracks: Their own names.
        laps: Of a drive.
        rules: The world's, complete.
        ranking: What decides it.
        deadline: Who may enter, and until when.
        grid: How many meet in a heat.
        own_tracks: Files of tracks that not everybody has, by name; the race keeps them.

    Raises:
        UserInputError: Options contradict each other, or the folder cannot be written.
    """
    from racecraft.actions.league.options import moment, require_dates, title_of
    from racecraft.league.store import League

    title = title_of(title, "race")
    if ranking.window is not None and ranking.ranking not in (AVERAGE, TOTAL):
        raise SettingError("--window counts laps of --ranking average or total, and the ranking is {ranking}.",
                           ranking=ranking.ranking)  # fmt: skip
    window = ranking.window or laps
    if ranking.ranking in (AVERAGE, TOTAL) and ranking.format == SOLO and window > laps:
        raise SettingError(
            "--window is {window}, and a drive has {laps} laps; expected at most that many.", window=window, laps=laps
        )
    opens, closes = moment(deadline.opens, "--opens"), moment(deadline.closes, "--closes")
    require_dates(deadline.practice, opens, closes, deadline.season or "")
    league = League.open_or_create(folder)
    season = league.season(deadline.season).id if deadline.season else ""
    qualifier = league.race(deadline.qualifier).id if deadline.qualifier else ""
    return league.add_race(
        Race(
            id="",
            title=title,
            kind=kind,
            tracks=tuple(tracks),
            rules=dict(rules),
            format=ranking.format,
            ranking=ranking.ranking,
            window=window,
            grid=grid,
            meetings=ranking.meetings,
            created=time.time(),
            opens=opens,
            closes=closes,
            max_submissions=deadline.submissions,
            is_practice=deadline.practice,
            season=season,
            stage=deadline.stage or "",
            qualifier=qualifier,
            qualified=deadline.qualified,
        ),
        own_tracks,
    )
