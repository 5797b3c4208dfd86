"""Judge what was entered, and drive a season again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from racecraft.actions.action import action
from racecraft.actions.league.options import LeagueOptions, RaceNamed
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import argument, option

if TYPE_CHECKING:
    from racecraft.league.auditing import AuditedHeat
    from racecraft.league.race import Drive, Result


@dataclass(frozen=True, kw_only=True)
class JudgeRequest(RaceNamed):
    """Which race is judged."""

    heats: int | None = option(None, "Drive at most so many; by default all that wait.", low=1)


@dataclass(frozen=True)
class JudgedHeats:
    """What was driven."""

    race: str
    results: tuple[Result, ...]
    """In the order in which they were driven."""


@action
def judge_race(request: JudgeRequest, progress: Progress = quiet) -> JudgedHeats:
    """Drive every entry that waits, each in a process of its own, on a seed that was unknown before.

    Example: racecraft league judge club-evening

    Raises:
        UserInputError: Another process judges the race; or its cars meet each other and it is still open.
    """
    from racecraft.league.judging import JudgedHeat, judge

    league = request.open()
    race = league.race(request.race)

    def tell(judged: JudgedHeat) -> None:
        names = " against ".join(league.entries(race.id)[one].racer for one in judged.heat.entries)
        what = judged.result.failure or "; ".join(_told(drive) for drive in judged.result.drives)
        progress(f"{names}: {what} ({judged.result.seconds:.1f} s)")

    judged = judge(league, race, request.heats, on_heat=tell)
    return JudgedHeats(race.id, tuple(one.result for one in judged))


def _told(drive: Drive) -> str:
    """Return laps of one alone, places of those who met."""
    if len(drive.outcomes) == 1:
        return " ".join("–" if lap is None else f"{lap:.3f}" for lap in drive.outcomes[0].laps)
    return "places " + ", ".join(str(one.place) for one in drive.outcomes)


@dataclass(frozen=True, kw_only=True)
class AuditRequest(LeagueOptions):
    """What is driven again."""

    race: str | None = argument("A race; by default all of the league, or of --season.", None)
    season: str | None = option(None, "All races of a season.")


@dataclass(frozen=True)
class Audit:
    """Heats that were driven again by their recorded actions."""

    heats: tuple[AuditedHeat, ...]

    @property
    def different(self) -> tuple[AuditedHeat, ...]:
        """Those that were not the same."""
        return tuple(one for one in self.heats if not one.is_equal)

    def as_dictionary(self) -> dict[str, object]:
        """Return counts, and every heat that differs."""
        return {
            "heats": len(self.heats),
            "equal": len(self.heats) - len(self.different),
            "different": list(self.different),
        }


@action
def audit_races(request: AuditRequest, progress: Progress = quiet) -> Audit:
    """Drive judged heats again by their recorded actions, and compare every tick.

    On the machine and version that judged, each is equal to the bit. Elsewhere differences are shown; they disqualify
    nobody.

    Examples:

        racecraft league audit club-evening

        racecraft league audit --season winter
    """
    from racecraft.league.auditing import audit

    league = request.open()
    races = league.races() if request.race is None else [league.race(request.race)]
    if request.season is not None:
        season = league.season(request.season).id
        races = [race for race in races if race.season == season]
    with progress.counting("heats") as count:
        return Audit(tuple(audit(league, races, count)))
