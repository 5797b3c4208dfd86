"""`racecraft league`: races, entries, boards. What makes races are commands of worlds (`WorldKind.race_commands`)."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import typer

from racecraft.actions.action import Action
from racecraft.actions.league.boards import RaceList, ShownBoard, ShownRace, list_races, show_board, show_race
from racecraft.actions.league.entries import Entered, Withdrawn, enter_race, withdraw_entry
from racecraft.actions.league.exporting import ExportedLeague, export_league
from racecraft.actions.league.filming import FilmedDrive, film_race_drive
from racecraft.actions.league.judging import Audit, JudgedHeats, audit_races, judge_race
from racecraft.actions.league.managing import (
    ChangedRace,
    RaceScreen,
    ResetRace,
    close_race,
    copy_race,
    edit_race,
    open_race,
    reset_race,
    show_on_screen,
)
from racecraft.actions.league.options import RaceNamed
from racecraft.actions.league.seasons import (
    MadeSeason,
    Records,
    create_season,
    show_racer,
    show_records,
    show_standings,
)
from racecraft.cli.from_request import command
from racecraft.cli.output import print_next_steps, table, word
from racecraft.contract.kind import load
from racecraft.contract.kinds import kinds
from racecraft.contract.progress import Progress
from racecraft.league.race import Race

if TYPE_CHECKING:
    from racecraft.league.records import Career
    from racecraft.league.seasons import Standings


app = typer.Typer(help="Races between models: enter, judge, boards, seasons.", no_args_is_help=True)


def organisers_command(what: str, act: Action[Any], show: Callable[[Any], None]) -> Callable[..., None]:
    """Return the command of an act that stands in the log of people, as it does when it is done in a console.

    Args:
        what: As the log calls it: "close race".
        act: The action; its result names a race.
        show: Prints the result.
    """

    @functools.wraps(act)
    def logged(request: RaceNamed, progress: Progress) -> Any:
        from racecraft.actions.people import log_act

        result = act(request, progress=progress)
        log_act(what, getattr(result.race, "id", result.race), league=str(request.league.resolve()))
        return result

    return command(Action(logged), show)


def show_changed(changed: ChangedRace) -> None:
    """Print a race that was made or changed, and what one does next."""
    race = changed.race
    print(f"{race.id}: {race.title}, on {', '.join(race.tracks)}; {_until(race)}")
    enter = ("enter it", f"racecraft league enter {word(race.id)} runs/NAME")
    print_next_steps(
        *([enter] if race.is_open(time.time()) else []),
        ("judge what was entered", f"racecraft league judge {word(race.id)}"),
    )


def _show_list(found: RaceList) -> None:
    if not found.races:
        print('no races yet; racecraft league create "Club evening" --track Oval_track makes one')
        return
    rows = [
        (
            one.race.id, one.race.title, ", ".join(one.race.tracks), _until(one.race), str(one.racers),
            str(one.waiting), one.leader or "–",
        )
        for one in found.races
    ]  # fmt: skip
    table(("id", "race", "track", "entries", "racers", "waiting", "leader"), rows,
          left=("id", "race", "track", "entries", "leader"), whole=("id",))  # fmt: skip


def _show_race(shown: ShownRace) -> None:
    race = shown.race
    print(f"{race.title} ({race.id}), on {', '.join(race.tracks)}; {_until(race)}")
    for line in shown.rules:
        print(f"  {line}")
    if race.max_submissions is not None:
        print(f"  {race.max_submissions} submissions a racer")
    if race.qualifier:
        print(f"  for the first {race.qualified} of {race.qualifier}")


def _show_entered(entered: Entered) -> None:
    entry = entered.entry
    left = "" if entered.submissions_left is None else f"; {entered.submissions_left} submissions left"
    print(f"{entered.race}: {entry.racer} entered {entry.model} as number {entry.number}{left}")
    print_next_steps(("judge it", f"racecraft league judge {word(entered.race)}"))


def _show_withdrawn(done: Withdrawn) -> None:
    print(f"{done.race}: entry {done.entry} is off the board; its files are in {done.kept}")


def _show_judged(judged: JudgedHeats) -> None:
    if not judged.results:
        print(f"{judged.race}: nothing waits")
        return
    print(f"{judged.race}: {len(judged.results)} judged")
    print_next_steps(("the board", f"racecraft league board {word(judged.race)}"))


def _show_board(shown: ShownBoard) -> None:
    from racecraft.league.board_table import TEXTS, table_of
    from racecraft.league.scoring import ranking_text

    found = shown.board
    race = found.race
    print(f"{race.title}, {', '.join(race.tracks)}: {ranking_text(race)}")
    heads, rows = table_of(found)
    table(heads, rows, left=TEXTS, whole=("racer",))
    if shown.history:
        print("AWS's races here, in another simulator: a neighbourhood, no result.")
        table(
            ("launched", "race", "timed by", "racers", "winner, s", "the leader here, s", "rank"),
            [
                (one["date"], one["race"], f"{one['timing']}, {one['laps']} laps", str(one["racers"]),
                 _seconds(one["winner_seconds"]), _seconds(one["own_seconds"]), str(one["own_rank"] or "–"))
                for one in shown.history
            ],
            left=("launched", "race", "timed by"),
        )  # fmt: skip
    if found.waiting:
        print(f"{found.waiting} wait to be judged: racecraft league judge {word(race.id)}")


def _seconds(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


def _show_film(done: FilmedDrive) -> None:
    print(f"{done.race} {done.heat}: {done.video}")


def _show_reset(done: ResetRace) -> None:
    print(f"{done.race}: {done.results} results put aside; their entries wait to be judged again")


def _show_screen(done: RaceScreen) -> None:
    print(done.link or f"{done.race}: no link shows it without sign-in")


def _show_audit(done: Audit) -> None:
    for one in done.different:
        where = " (judged on another machine or version, where bits may differ)" if one.is_other_machine else ""
        print(f"{one.race} {one.heat}: {'; '.join(one.differences)}{where}")
    print(f"{len(done.heats) - len(done.different)} of {len(done.heats)} heats are equal to the bit")


def _show_season(made: MadeSeason) -> None:
    print(f"{made.season.id}: {made.season.title}; points {', '.join(map(str, made.season.points))}")
    print_next_steps(("a race in it", f'racecraft league create "First race" --season {word(made.season.id)}'))


def _show_standings(found: Standings) -> None:
    titles = ("place", "racer", *(race.title for race in found.races), "wins", "points", "behind")
    rows = [
        (str(row.place), row.racer, *map(str, row.race_points), str(row.wins), str(row.points),
         f"-{row.gap}" if row.gap else "")
        for row in found.rows
    ]  # fmt: skip
    table(titles, rows, left=("racer",), whole=("racer",))
    if found.is_over and found.rows:
        print(f"{found.season.title} is over; champion: {', '.join(found.leaders)}")


def _show_records(found: Records) -> None:
    rows = [
        (one.track, one.type.replace("_", " ").lower(), f"{one.seconds:.3f}", one.racer, one.model, one.race)
        for one in found.records
    ]
    table(("track", "race type", "lap, s", "racer", "model", "race"), rows,
          left=("track", "race type", "racer", "model", "race"))  # fmt: skip


def _show_racer(career: Career) -> None:
    print(f"{career.racer}: {len(career.races)} races, {career.wins} won, "
          f"{career.podiums} podiums; {career.laps} laps, {career.resets} resets")  # fmt: skip
    rows = [
        (one.title, "–" if one.place is None else f"{one.place} of {one.racers}", str(one.entries))
        for one in career.races
    ]
    table(("race", "place", "entries"), rows, left=("race",))
    for one in career.best_laps:
        print(f"  {one.track}, {one.type.replace('_', ' ').lower()}: {one.seconds:.3f} s ({one.model})")


def _show_exported(done: ExportedLeague) -> None:
    for path in done.files:
        print(path)


def _until(race: Race) -> str:
    now = time.time()
    if race.is_practice:
        return "practice, always open"
    if race.is_closed or (race.closes is not None and race.closes <= now):
        return "closed"
    if race.opens is not None and race.opens > now:
        return f"opens {_local(race.opens)}"
    return "open" if race.closes is None else f"open until {_local(race.closes)}"


def _local(moment: float) -> str:
    return time.strftime("%Y-%m-%d %H:%M", time.localtime(moment))


for _name, _made in (
    *((one.name, load(one.target)) for kind in kinds() for one in kind.race_commands),
    ("list", command(list_races, _show_list)),
    ("show", command(show_race, _show_race)),
    ("enter", command(enter_race, _show_entered)),
    ("withdraw", organisers_command("withdraw entry", withdraw_entry, _show_withdrawn)),
    ("judge", command(judge_race, _show_judged)),
    ("board", command(show_board, _show_board)),
    ("edit", organisers_command("edit race", edit_race, show_changed)),
    ("copy", organisers_command("copy race", copy_race, show_changed)),
    ("close", organisers_command("close race", close_race, show_changed)),
    ("open", organisers_command("open race", open_race, show_changed)),
    ("film", command(film_race_drive, _show_film)),
    ("screen", organisers_command("change screen's link", show_on_screen, _show_screen)),
    ("reset", organisers_command("reset race", reset_race, _show_reset)),
    ("audit", command(audit_races, _show_audit)),
    ("season", command(create_season, _show_season)),
    ("standings", command(show_standings, _show_standings)),
    ("records", command(show_records, _show_records)),
    ("racer", command(show_racer, _show_racer)),
    ("export", command(export_league, _show_exported)),
):
    app.command(_name)(_made)
