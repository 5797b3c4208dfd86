"""What a league keeps: races, entries, results and seasons, each one JSON file. Begin with `Race`.

The classes are the files: a field here is a key there. A world's own rules (`Race.rules`) and facts (`Entry.facts`)
are plain values that only the world reads.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

SOLO, ROUND_ROBIN, BRACKET, LADDER = FORMATS = ("solo", "round_robin", "bracket", "ladder")
"""Each entry drives alone; every racer meets every other; the loser of a meeting is out; ratings decide, and those meet
of whose games most is learned."""
BEST, AVERAGE, TOTAL, LAPS = RANKINGS = ("best", "average", "total", "laps")
"""What decides a solo race: the best lap; the mean or the sum of the best window of consecutive laps; the number of
laps within the race's time."""
QUALIFIER, FINAL = STAGES = ("qualifier", "final")
MAX_LAPS, MAX_WINDOW = 1000, 100


@dataclass(frozen=True, kw_only=True)
class Race:
    """A race: where, by which rules, until when, and what decides it."""

    id: str
    """Name of its folder."""
    title: str
    kind: str
    """Whose world: "deepracer"."""
    tracks: tuple[str, ...]
    """One, or several of a cup: every entry drives on each."""
    rules: dict[str, Any]
    """The world's own, complete."""
    format: str = SOLO
    """One of FORMATS."""
    ranking: str = BEST
    """One of RANKINGS; of a race of FORMATS that are no solo, wins decide."""
    window: int = 1
    """How many consecutive full laps the rankings "average" and "total" count."""
    grid: int = 2
    """How many meet in a heat of a ladder; in other formats two."""
    meetings: int = 10
    """Heats of a ladder for each racer, on average."""
    created: float = 0.0
    """Seconds since 1970 (UTC), as all moments here."""
    opens: float | None = None
    """Entries are accepted from then on; None: at once."""
    closes: float | None = None
    """Entries are accepted until then; None: without end."""
    max_submissions: int | None = None
    """Entries of one racer; None: any number."""
    is_closed: bool = False
    """The organiser has closed it."""
    is_practice: bool = False
    """It is always open and belongs to no season."""
    person: str = ""
    """Who owns it; "": the only user of the machine."""
    season: str = ""
    """Id of its season; "": none."""
    stage: str = ""
    """One of STAGES, or "" for a race that is neither."""
    qualifier: str = ""
    """Id of the race whose first racers may enter this one; "": anybody."""
    qualified: int = 8
    """How many of them."""
    screen: str = ""
    """What the link of its screens is made from; "": there is no link."""
    version: int = 1

    @property
    def needs_all_entries(self) -> bool:
        """Whether nothing can be judged before it is closed: who meets whom depends on everybody."""
        return self.format in (ROUND_ROBIN, BRACKET)

    def is_open(self, now: float) -> bool:
        """Return whether it takes entries at a moment."""
        if self.is_practice:
            return True
        has_begun = self.opens is None or now >= self.opens
        return has_begun and not self.is_closed and (self.closes is None or now < self.closes)


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One car, or snake, in a race. Its files stay as they were when it was entered."""

    number: int
    """Counted from 1 in its race."""
    racer: str
    """Name on the board."""
    model: str
    """What the racer calls the model."""
    entered: float
    person: str = ""
    """Who owns it; "": the only user of the machine."""
    facts: dict[str, Any] = field(default_factory=dict)
    """What the world's check found: sensors, speeds, algorithm, …"""
    version: int = 1


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What one entry did on one track."""

    laps: tuple[float | None, ...] = ()
    """Seconds of each lap, penalties included; None for a lap that was not completed."""
    total_seconds: float = 0.0
    """Simulated seconds of the whole drive."""
    progress_percent: float = 0.0
    """Of the last lap, 0 to 100."""
    resets: int = 0
    crashes: int = 0
    off_tracks: int = 0
    penalty_seconds: float = 0.0
    place: int = 1
    """Among those who drove together."""
    places: tuple[int, ...] = ()
    """Likewise in each game of a heat in which all change seats; equals share a place."""
    faults: int = 0
    """Moves that came late, or were none."""
    ended: str = ""
    """Why the drive ended: "lap_complete", "off_track", "retired", …"""
    digest: str = ""
    """SHA-256 of every tick; equal digests are equal drives, bit for bit."""
    mean_speed_mps: float | None = None


@dataclass(frozen=True, kw_only=True)
class Drive:
    """All entries of a heat on one track."""

    track: str
    seed: int
    outcomes: tuple[Outcome, ...]
    """In the order of the heat's entries."""
    folder: str = ""
    """Its files, below the folder of the race."""


@dataclass(frozen=True, kw_only=True)
class Result:
    """A judged heat: one entry alone, or several against each other."""

    heat: str
    """Name of its file."""
    entries: tuple[int, ...]
    """Numbers of the entries."""
    drives: tuple[Drive, ...]
    """One a track; none where the entry could not be driven."""
    judged: float
    seconds: float = 0.0
    """Wall-clock seconds that judging took."""
    machine: str = ""
    """What the bits depend on: processor and versions."""
    limits: tuple[str, ...] = ()
    """What the process that drove had given up; empty where the system has no limits, or others took part."""
    failure: str = ""
    """Why the entry could not be driven; "": it was driven."""
    round: int = 0
    """Of a bracket, counted from 1."""
    version: int = 1

    @cached_property
    def scores(self) -> dict[tuple[str, int], Any]:
        """What `scoring.score_of` has computed, by ranking and window: a result never changes."""
        return {}

    @cached_property
    def figures(self) -> dict[int, dict[str, Any]]:
        """What `board.board_of` has added up, by the index of the entry."""
        return {}


Places = tuple[tuple[float, float], ...]
"""Where each car of a heat is, (x, y) each in metres, x east, y north; () in a world without roads."""


@dataclass(frozen=True, kw_only=True)
class Driving:
    """A heat that is being driven."""

    racers: tuple[str, ...]
    share: float = 0.0
    """How much of it is driven, 0 to 1."""
    text: str = ""
    """The same for people: "lap 2 of 3, 45 %"."""
    track: int = 0
    """Which of the race's tracks, counted from 0."""
    places: Places = ()
    """Where each of them is now."""


@dataclass(frozen=True, kw_only=True)
class Season:
    """Several races whose places give points."""

    id: str
    title: str
    points: tuple[int, ...] = (25, 18, 15, 12, 10, 8, 6, 4, 2, 1)
    """Of the first place, the second, …; no points after the last one."""
    counted: int | None = None
    """Only so many of a racer's best races count; None: all."""
    created: float = 0.0
    person: str = ""
    version: int = 1
